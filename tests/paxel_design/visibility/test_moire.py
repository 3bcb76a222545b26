"""Moire of a lit cluster: conservation, exact grids, the slow reference, the beats that explain it."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from paxel_design.patterns import make_pattern
from paxel_design.visibility.beats import SLOW_SHARE, beats
from paxel_design.visibility.edges import RAGGED_CORRELATION_MM, RAGGED_MM
from paxel_design.visibility.moire import moire, moire_of_picture, moire_picture, sort_pixels, worst_moire
from paxel_design.visibility.passages import passages_to_XYZ
from paxel_design.visibility.raster import area_shares, light_met, met_by_light, returned
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

PITCH_MM = 281.0 / 1920.0


def checker(dot_mm: float, angle_deg: float) -> Pattern:
    return make_pattern("checkerboard", ("black", "white"), dot_mm, angle_deg, (120, 80))


def slow_picture(pattern: Pattern, size: int, blur_px: float, scattering_mm: float, sub: int = 16) -> np.ndarray:
    """The same by brute force: every sub-pixel's light from every lit pixel, on a fine grid through `Pattern.label`."""
    n = size * sub
    at = (np.arange(n) + 0.5) / sub - 0.5 * size
    label = pattern.label(at[None] * PITCH_MM, -at[:, None] * PITCH_MM)
    Y = passages_to_XYZ(pattern.palette)[..., 1]
    share = (label == 1).astype(float).reshape(size, sub, size, sub).mean(axis=(1, 3))
    light = gaussian_filter(np.kron(share > 0.5, np.ones((sub, sub))), blur_px * sub, truncate=6)
    left = np.zeros((n, n))
    for into in range(2):
        spread = gaussian_filter(light * (label == into), scattering_mm / PITCH_MM * sub, truncate=6)
        left += spread * Y[into, label]
    return left.reshape(size, sub, size, sub).mean(axis=(1, 3))


@pytest.mark.parametrize("scattering_mm", [0.0, 0.06])
def test_the_picture_is_the_brute_force_one(scattering_mm: float) -> None:
    """To 2 % of white where both light the same pixels: 3 x 3 pixels hold 99.9 % of the light, samples err by 1 %.

    With scattering to 6 %: what leaves beyond a pixel's rim is counted where it entered.
    """
    pattern, size = checker(0.6, 30.0), 20
    fast = moire_picture(pattern, PITCH_MM, size_px=size, samples=987, scattering_mm=scattering_mm)
    slow = slow_picture(pattern, size, 0.36, scattering_mm)
    inner = (slice(4, -4), slice(4, -4))
    apart = np.abs(fast - slow)[inner]
    assert np.median(apart) < (0.03 if scattering_mm else 0.005)
    assert np.mean(apart < (0.06 if scattering_mm else 0.02)) > 0.9  # a pixel on the limit may be sorted the other way
    assert abs((fast - slow)[inner].mean()) < 0.005


def test_an_exactly_aligned_grid_has_no_moire_and_a_thousandth_brings_it_back() -> None:
    """A dot of 5 whole pixels at 0 degrees: nothing slower than the print; 0.1 % of scale beats over the field."""
    exact = moire(checker(5 * PITCH_MM, 0.0), PITCH_MM, 4000.0)
    off = worst_moire(checker(5 * PITCH_MM, 0.0), [1.001 * PITCH_MM], 4000.0, phases=2, size_px=384, samples=34)
    assert exact.contrast < 1e-3
    assert off.contrast > 5 * exact.contrast


@pytest.mark.parametrize(("dot_mm", "K", "times"), [(0.5, 2, 1.5), (0.75, 2, 2.0), (1.0, 2, 2.0), (0.75, 3, 2.0)])
def test_thirty_degrees_beats_zero(dot_mm: float, K: int, times: float) -> None:
    """The paper's Fig. 12, sorted as there: over pitches to either side, the worst of both among them."""
    pitches = PITCH_MM * np.array([0.97, 0.985, 1.015])
    at_0, at_30 = (
        worst_moire(checker(dot_mm, a), pitches, 4000.0, K=K, partition="lab", phases=1, size_px=256, samples=55)
        for a in (0.0, 30.0)
    )
    assert at_0.visibility > times * at_30.visibility


def test_a_beat_stands_where_the_picture_has_its_stripes() -> None:
    """A grid of stripes: the slowest beat's period is the picture's strongest slow component."""
    cells = np.tile(np.array([[0, 1]], np.uint8), (2, 1))
    pattern = Pattern("stripes", ("black", "white"), cells, 2.1 * PITCH_MM, 0.0, (120.0, 80.0))
    view = moire_picture(pattern, PITCH_MM, size_px=420)
    spectrum = np.abs(np.fft.rfft(view.mean(axis=0) - view.mean()))
    spectrum[:3] = 0  # slower than the piece resolves
    slow = spectrum[: int(SLOW_SHARE / 2.1 * 420)]
    seen_mm = 420 * PITCH_MM / int(np.argmax(slow))
    periods = [beat.period_mm for beat in beats(pattern, PITCH_MM, count=10)]
    harmonics = [period / k for period in periods for k in (1, 2, 3)]
    assert min(abs(seen_mm / period - 1) for period in harmonics) < 0.03


def test_what_makes_no_sense_is_told() -> None:
    with pytest.raises(InputError, match="K = 2 or 3"):
        moire(checker(0.75, 30.0), PITCH_MM, 4000.0, K=5)
    for wrong in ({"pitch_mm": 0.0}, {"pitch_mm": PITCH_MM, "size_px": 4}, {"pitch_mm": PITCH_MM, "samples": 2}):
        with pytest.raises(InputError, match="a raster needs"):
            moire(checker(0.75, 30.0), distance_mm=4000.0, **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("partition", ["light", "lab"])
def test_samples_in_a_pixel_have_converged(partition: Literal["light", "lab"]) -> None:
    """To 5 % of the stated figures, the worst over pitches and phases, and of the mean contrast: 89 against 610."""
    found = {}
    for samples in (89, 610):
        seen = [
            moire(checker(0.75, 30.0), PITCH_MM * zoom, 4000.0, partition=partition, size_px=144, samples=samples,
                  offset_px=(0.37 * k, 0.71 * k))
            for k, zoom in enumerate((0.98, 0.993, 1.006, 1.019))
        ]  # fmt: skip
        found[samples] = [np.mean([m.contrast for m in seen]), max(m.visibility for m in seen)]
    assert found[89] == pytest.approx(found[610], rel=0.05)


def test_the_papers_sorting_lights_pixels_that_meet_a_third_of_white() -> None:
    """k-means of L*, shares all alike: 0.35 where light itself would say 0.5; a fifth of white is half of its L*."""
    XYZ = passages_to_XYZ(checker(0.75, 0.0).palette)
    share = np.linspace(0, 1, 4001)
    shares = np.stack([1 - share, share], axis=-1)[..., None] * np.eye(2)
    limits = {p: share[np.argmax(sort_pixels(shares, XYZ, 2, p) == 1)] for p in ("light", "lab")}  # type: ignore[arg-type]
    assert limits["light"] == pytest.approx(0.5, abs=1e-3)
    assert 0.2 < limits["lab"] < 0.4
    edges = sort_pixels(shares, XYZ, 3, "light")
    assert [int(edges[int(4000 * s)]) for s in (0.2, 0.3, 0.5, 0.7, 0.8)] == [0, 2, 2, 2, 1]


def test_the_printed_scale_is_that_of_the_raster() -> None:
    """A print that came out 2 % larger under a pixel 2 % larger looks the same."""
    larger = replace(checker(0.75, 30.0), print_scale=(1.02, 1.02))
    np.testing.assert_allclose(
        moire_picture(larger, 1.02 * PITCH_MM, size_px=64), moire_picture(checker(0.75, 30.0), PITCH_MM, size_px=64)
    )


def test_a_turned_projector_is_a_print_turned_back_and_a_larger_one_a_larger_pixel() -> None:
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]]
    turned = moire_picture(checker(0.75, 30.0), PITCH_MM, size_px=64, aim=turn)
    back = moire_picture(checker(0.75, 30.0 - np.rad2deg(0.1)), PITCH_MM, size_px=64)
    assert np.mean(np.isclose(turned, back, atol=1e-6)) > 0.99  # rounding moves a sample over an edge now and then
    larger = moire_picture(checker(0.75, 30.0), PITCH_MM, size_px=64, aim=np.diag([1.02, 1.02, 1.0]))
    zoomed = moire_picture(checker(0.75, 30.0), 1.02 * PITCH_MM, size_px=64)
    assert np.mean(np.isclose(larger, zoomed, atol=1e-6)) > 0.99


def test_a_tilted_projector_has_the_pitch_of_the_place() -> None:
    """At a place of a keystone, a small piece of the raster is that of a straight one, pitch and place as there."""
    tilted = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.004, 0.0, 1.0]])
    met = area_shares(met_by_light(checker(0.75, 30.0), PITCH_MM, 96, aim=tilted))[..., 1, :].sum(axis=-1)
    x_px = np.array([-40.5, 0.5, 40.5])
    for x, share in zip(x_px, met[48, [7, 48, 88]], strict=True):
        at = (np.arange(65) / 64 - 0.5)[None] + np.zeros((65, 1))
        x_mm, y_mm = (x + at) * PITCH_MM, (-0.5 - at.T) * PITCH_MM
        depth = 1 + 0.004 * x_mm
        label = checker(0.75, 30.0).label(x_mm / depth, y_mm / depth)
        assert share == pytest.approx(np.mean(label == 1), abs=0.03)  # of 89 samples against 4225


def test_light_is_kept() -> None:
    """Every pixel's light leaves somewhere, at any number of colorants, with ragged edges and scattering too."""
    colours = make_pattern("tiles", ("cyan", "magenta", "yellow", "black"), 0.75, 30.0, (60.0, 40.0))
    met = met_by_light(colours, PITCH_MM, 32, ragged_mm=0.015)
    np.testing.assert_allclose(met.sum(axis=(2, 3, 4)), 1.0, atol=1e-6)  # the table of scattered cells is float32
    lit = np.random.default_rng(3).random((32, 32))
    values = np.arange(16.0).reshape(4, 4)
    assert (light_met(lit, met) * values).sum() == pytest.approx(returned(lit, met, values).mean(), rel=1e-9)


def test_ragged_edges_leave_the_grain_that_their_length_asks_for() -> None:
    """Under full light: slow variance = edge length x rms^2 x integral of its correlation x the band's area, over the
    mean squared. To a fifth: a piece of 45 mm has 700 waves of the band, its mean square 5 %, corners of dots as much.
    """
    dot, size = 1.5, 300
    met = met_by_light(checker(dot, 30.0), PITCH_MM, size, scattering_mm=0.0, ragged_mm=RAGGED_MM, samples=144)
    smooth = met_by_light(checker(dot, 30.0), PITCH_MM, size, scattering_mm=0.0, samples=144)
    white = np.array([[0.0, 0.0], [0.0, 1.0]])
    grain = returned(np.ones((size, size)), met, white) - returned(np.ones((size, size)), smooth, white)
    seen = moire_of_picture(0.5 + grain, dot, PITCH_MM, 4000.0).contrast
    band = np.pi * (SLOW_SHARE / dot) ** 2
    expected = np.sqrt(2 / dot * RAGGED_MM**2 * np.sqrt(np.pi) * RAGGED_CORRELATION_MM * band) / 0.5
    assert seen == pytest.approx(expected, rel=0.2)


def test_the_worst_is_the_worst_of_pitches_and_phases() -> None:
    """And hardly depends on which phases: a piece of 23 mm holds them all."""
    pitches = PITCH_MM * np.array([0.985, 1.0, 1.015])
    found = {n: worst_moire(checker(0.75, 0.0), pitches, 4000.0, phases=n, size_px=160) for n in (1, 2)}
    each = [moire(checker(0.75, 0.0), p, 4000.0, offset_px=(k / 2, 0.3 * k), size_px=160).visibility
            for p in pitches for k in (0, 1)]  # fmt: skip
    assert found[2].visibility == max(each)
    assert found[1].visibility <= found[2].visibility < 1.25 * found[1].visibility


def test_stripes_are_a_line_and_noise_is_none() -> None:
    """All of a wave's variance lies in its line; of white noise in the band as much as 9 of its hundreds of places."""
    x = np.arange(256) * PITCH_MM
    wave = np.tile(1 + 0.1 * np.cos(2 * np.pi * 0.2 * x), (256, 1))
    noise = 1 + 0.1 * np.random.default_rng(2).standard_normal((256, 256))
    assert moire_of_picture(wave, 0.75, PITCH_MM, 4000.0).line_share > 0.95
    assert moire_of_picture(noise, 0.75, PITCH_MM, 4000.0).line_share < 0.1
