"""Moire of a lit cluster: conservation, exact grids, the slow reference, the beats that explain it."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from paxel_design.patterns import make_pattern
from paxel_design.visibility.beats import SLOW_SHARE, beats
from paxel_design.visibility.moire import moire, moire_picture, sort_pixels, worst_moire
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

PITCH_MM = 281.0 / 1920.0


def checker(dot_mm: float, angle_deg: float) -> Pattern:
    return make_pattern("checkerboard", ("black", "white"), dot_mm, angle_deg, (120, 80))


def slow_picture(pattern: Pattern, size: int, blur_px: float, sub: int = 16) -> np.ndarray:
    """The same by brute force: every sub-pixel's light from every lit pixel, on a fine grid through `Pattern.label`."""
    from scipy.ndimage import gaussian_filter

    n = size * sub
    at = (np.arange(n) + 0.5) / sub - 0.5 * size
    label = pattern.label(at[None] * PITCH_MM, -at[:, None] * PITCH_MM)
    Y = colorants_to_XYZ(pattern.palette)[:, 1]
    bright = int(np.argmax(Y))

    def light(pixels: np.ndarray) -> np.ndarray:
        return np.asarray(gaussian_filter(np.kron(pixels, np.ones((sub, sub))), blur_px * sub, truncate=6))

    one = gaussian_filter((label == bright).astype(float), blur_px * sub, truncate=6)
    share = one.reshape(size, sub, size, sub).mean(axis=(1, 3))
    return (light((share > 0.5).astype(float)) * Y[label]).reshape(size, sub, size, sub).mean(axis=(1, 3))


def test_the_picture_is_the_brute_force_one() -> None:
    """To 2 % of white where both light the same pixels: 3 x 3 pixels hold 99.9 % of the light, samples err by 1 %."""
    pattern, size = checker(0.6, 30.0), 20
    fast = moire_picture(pattern, PITCH_MM, size_px=size, samples=377)
    slow = slow_picture(pattern, size, 0.36)
    inner = (slice(4, -4), slice(4, -4))
    apart = np.abs(fast - slow)[inner]
    assert np.median(apart) < 0.005
    assert np.mean(apart < 0.02) > 0.9  # a pixel on the very edge may be sorted the other way: its neighbours differ


def test_an_exactly_aligned_grid_has_no_moire_and_a_thousandth_brings_it_back() -> None:
    """A dot of 5 whole pixels at 0 degrees: nothing slower than the print; 0.1 % of scale beats over the field."""
    exact = moire(checker(5 * PITCH_MM, 0.0), PITCH_MM, 4000.0)
    off = worst_moire(checker(5 * PITCH_MM, 0.0), [1.001 * PITCH_MM], 4000.0, phases=2, size_px=384, samples=34)
    assert exact.contrast < 1e-3
    assert off.contrast > 5 * exact.contrast


def test_thirty_degrees_beats_zero() -> None:
    """The paper's Fig. 12, at 0.75 mm: at least twice, over pitches to either side, K = 3."""
    pitches = PITCH_MM * np.array([0.98, 0.99, 1.01, 1.02])
    at_0, at_30 = (
        worst_moire(checker(0.75, a), pitches, 4000.0, K=3, phases=1, size_px=192, samples=34) for a in (0.0, 30.0)
    )
    assert at_0.visibility > 2 * at_30.visibility


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
    """To 5 % of the stated figure, the mean over pitches and phases: 89 samples against 610.

    Of one pitch alone the figure moves more: a few pixels on the very limit of a cluster decide it.
    """
    found = {
        samples: np.mean(
            [
                moire(checker(0.75, 30.0), PITCH_MM * zoom, 4000.0, partition=partition, size_px=160, samples=samples,
                      offset_px=(0.37 * k, 0.71 * k)).contrast
                for k, zoom in enumerate((0.98, 0.993, 1.006, 1.019))
            ]
        )
        for samples in (89, 610)
    }  # fmt: skip
    assert found[89] == pytest.approx(found[610], rel=0.05)


def test_the_papers_sorting_lights_pixels_that_meet_a_third_of_white() -> None:
    """k-means of L*, shares all alike: 0.35 where light itself would say 0.5; a fifth of white is half of its L*."""
    Y = colorants_to_XYZ(checker(0.75, 0.0).palette)
    share = np.linspace(0, 1, 4001)
    own = np.stack([1 - share, share], axis=-1)
    limits = {p: share[np.argmax(sort_pixels(own, Y, 2, p) == 1)] for p in ("light", "lab")}  # type: ignore[arg-type]
    assert limits["light"] == pytest.approx(0.5, abs=1e-3)
    assert 0.2 < limits["lab"] < 0.4
    edges = sort_pixels(own, Y, 3, "light")
    assert [int(edges[int(4000 * s)]) for s in (0.2, 0.3, 0.5, 0.7, 0.8)] == [0, 2, 2, 2, 1]


def test_the_printed_scale_is_that_of_the_raster() -> None:
    """A print that came out 2 % larger under a pixel 2 % larger looks the same."""
    larger = replace(checker(0.75, 30.0), print_scale=(1.02, 1.02))
    np.testing.assert_allclose(
        moire_picture(larger, 1.02 * PITCH_MM, size_px=64), moire_picture(checker(0.75, 30.0), PITCH_MM, size_px=64)
    )
