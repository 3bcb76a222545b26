"""The design registration against the virtual bench's truth, and its parts against brute force."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_design.patterns import make_pattern
from paxel_runtime.clustering import lloyd
from paxel_runtime.devices.bench_setup import BenchSetup
from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.registration import DesignRegistration, register_design
from paxel_runtime.registration.print_kernels import ink_tables, pixel_shares
from paxel_runtime.registration.print_residual import gathering_filter
from paxel_runtime.registration.print_start import homography_from_corners, homography_from_fiducials
from paxel_runtime.registration.print_view import PrintOptics, Windows, lay_ink, view, view_slope

WIDTH, HEIGHT = 320, 180
PITCH_MM = 281.0 / 1920.0
CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True, eq=False)
class Session:
    """What the design registration is given, and the truth."""

    picture: NDArray[np.float32]
    camera_xy: NDArray[np.float32]
    coverage: NDArray[np.float32]
    pattern: Pattern


@cache
def pattern_of(layout: str, size_mm: tuple[float, float] = (80.0, 60.0)) -> Pattern:
    return make_pattern(layout, ("black", "white"), 0.75, 30.0, size_mm)


@cache
def session(quality: str, layout: str = "checkerboard", size_mm: tuple[float, float] = (80.0, 60.0)) -> Session:
    """Two pictures of the print and two of white paper, in green; the table is the truth, to test one thing."""
    pattern = pattern_of(layout, size_mm)
    setup = BenchSetup(pattern, (WIDTH, HEIGHT), WIDTH * PITCH_MM, CHANNELS, 8, (684, 404), 14, 12.0, quality, 0)
    bench = VirtualBench(setup)
    light = {}
    for surface in ("pattern", "white"):
        bench.place(surface)
        for level in (255, 0):
            frame = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
            frame[..., 1] = level
            bench.show(frame)
            light[surface, level] = bench.capture("green").astype(np.float32)
    white = light["white", 255] - light["white", 0]
    seen = white > 0.01 * white.max()
    picture = np.where(seen, (light["pattern", 255] - light["pattern", 0]) / np.where(seen, white, 1), np.nan)
    truth = bench.truth
    return Session(picture.astype(np.float32), truth.camera_xy("green").astype(np.float32), truth.coverage(), pattern)


@cache
def registered(quality: str, layout: str = "checkerboard") -> DesignRegistration:
    s = session(quality, layout)
    return run(s)


def run(s: Session, pattern: Pattern | None = None, to_mm: NDArray[np.float64] | None = None) -> DesignRegistration:
    valid = np.ones((HEIGHT, WIDTH), bool)
    colors = np.array([[0.03], [1.0]])
    return register_design(s.picture, s.camera_xy, valid, pattern or s.pattern, PITCH_MM, colors, to_mm=to_mm)


def rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(values**2)))


# --- against the bench ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", ["checkerboard", pytest.param("blue-noise", marks=pytest.mark.slow)])
def test_coverage_comes_from_the_design(layout: str) -> None:
    s, design = session("realistic", layout), registered("realistic", layout)
    error = design.coverage[..., 0] - s.coverage[..., 0]
    # the issue asks for 0.03; ragged edges (15 um rms over 50 um) alone would make 0.045 of the design as drawn
    assert rms(error) < 0.02
    assert np.abs(np.mean(error)) < 0.004
    assert np.mean((design.coverage[..., 0] > 0.5) == (s.coverage[..., 0] > 0.5)) > 0.99  # the issue: 0.985
    # the bench's print spreads by 10 um and its paper scatters by 60 um
    assert design.figures["ink_spread_um"] == pytest.approx(10.0, abs=3.0)
    assert design.figures["scattering_um"] == pytest.approx(60.0, abs=6.0)


def test_three_clusters_of_the_coverage_are_those_of_the_true_coverage() -> None:
    s, design = session("realistic"), registered("realistic")
    starts = np.array([[1.0], [0.0], [0.5]])
    few = np.s_[1::3, 1::2, :1]
    _, found = lloyd(design.coverage[few].reshape(-1, 1).astype(np.float64), starts)
    _, wanted = lloyd(s.coverage[few].reshape(-1, 1).astype(np.float64), starts)
    assert np.mean(found == wanted) > 0.985  # the figure


@pytest.mark.slow
def test_a_harsh_print_is_found_too() -> None:
    s, design = session("harsh"), registered("harsh")
    # half as much noise again on every edge, 8 bits, waves: the limit for `realistic` holds still
    assert rms(design.coverage[..., 0] - s.coverage[..., 0]) < 0.035
    assert design.figures["ink_spread_um"] == pytest.approx(25.0, abs=6.0)


def test_shares_are_shares() -> None:
    coverage = registered("realistic").coverage
    assert coverage.dtype == np.float32
    assert coverage.min() >= 0.0
    assert np.allclose(coverage.sum(axis=-1), 1.0, atol=1e-5)  # the pattern is larger than the projection


@pytest.mark.slow
def test_something_before_the_print_does_not_move_it() -> None:
    s = session("realistic")
    picture = s.picture.copy()
    picture[60:130, 380:480] = 0.3  # a gray card
    covered = Session(picture, s.camera_xy, s.coverage, s.pattern)
    outside = ~((np.abs(s.camera_xy[..., 0] - 430) < 60) & (np.abs(s.camera_xy[..., 1] - 95) < 45))
    assert rms((run(covered).coverage - s.coverage[..., :2])[outside]) < 0.02


def test_another_pattern_is_refused() -> None:
    other = make_pattern("blue-noise", ("black", "white"), 0.75, 30.0, (80.0, 60.0), seed=7)
    with pytest.raises(CalibrationError, match="corners_px"):
        run(session("realistic"), other)


def test_shapes_that_do_not_fit_are_refused() -> None:
    s = session("realistic")
    with pytest.raises(InputError, match=r"a picture \(h, w, C\)"):
        register_design(s.picture, s.camera_xy, np.ones((3, 3), bool), s.pattern, PITCH_MM, np.ones((2, 1)))


def test_a_small_pattern_is_placed_by_its_corners() -> None:
    s = session("realistic", size_mm=(38.0, 20.0))  # the projection is 46.8 mm x 26.3 mm
    inside = s.coverage[..., :2].sum(axis=-1)
    # corners as a person clicks them: the outermost projector pixels on the pattern, to half a pixel
    rows, columns = np.nonzero(inside > 0.5)
    picks = [np.argmin(sx * columns + sy * rows) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    corners_px = [s.camera_xy[rows[k], columns[k]] for k in picks]
    valid = np.ones((HEIGHT, WIDTH), bool)
    to_mm = homography_from_corners(corners_px, s.pattern.size_mm)
    design = register_design(s.picture, s.camera_xy, valid, s.pattern, PITCH_MM, np.array([[0.03], [1.0]]), to_mm=to_mm)
    assert rms(design.coverage[..., 0] - s.coverage[..., 0]) < 0.02
    # the rim stands where it was printed: to a third of a pixel along all of it
    assert np.mean((design.coverage.sum(axis=-1) > 0.5) == (inside > 0.5)) > 0.998


# --- starts ---------------------------------------------------------------------------------------------------------


def test_corners_must_run_clockwise() -> None:
    with pytest.raises(InputError, match="clockwise"):
        homography_from_corners([(0, 0), (0, 10), (10, 10), (10, 0)], (60.0, 40.0))
    with pytest.raises(InputError, match="no three in a line"):
        homography_from_corners([(0, 0), (5, 0), (10, 0), (0, 10)], (60.0, 40.0))


def test_fiducials_give_the_homography() -> None:
    from paxel_design.printing.fiducials import DICTIONARY, FIDUCIAL_MODULES, fiducials_of

    markers = fiducials_of((60.0, 40.0))
    scale, turn = 6.0, np.deg2rad(3.0)
    to_px = np.array([[np.cos(turn), -np.sin(turn)], [-np.sin(turn), -np.cos(turn)]]) * scale
    rows, columns = np.indices((560, 700))
    mm = (np.stack([columns - 350.0, rows - 280.0], axis=-1)) @ np.linalg.inv(to_px).T
    picture = np.full(rows.shape, 40000.0)
    for marker, modules in zip(markers, FIDUCIAL_MODULES, strict=True):
        (left, top), (right, _) = marker.corners_mm[0], marker.corners_mm[1]
        i = np.floor((mm[..., 0] - left) / (right - left) * 6).astype(int)
        j = np.floor((top - mm[..., 1]) / (right - left) * 6).astype(int)
        inside = (i >= 0) & (i < 6) & (j >= 0) & (j < 6)
        black = np.array([[c == "#" for c in row] for row in modules])
        picture[inside & black[j.clip(0, 5), i.clip(0, 5)]] = 1500.0
    picture = gaussian_filter(picture, 0.8)
    found = homography_from_fiducials(picture, {m.id: m.corners_mm for m in markers}, DICTIONARY)
    assert found is not None
    points = np.array([[0.0, 0.0], [25.0, 15.0], [-25.0, -15.0]])
    places = points @ to_px.T + (350.0, 280.0)
    plane = np.column_stack([places, np.ones(3)]) @ found.T
    assert np.allclose(plane[:, :2] / plane[:, 2:], points, atol=0.05)  # sub-pixel corners: 0.3 px of 6 px a mm
    assert homography_from_fiducials(np.full((50, 50), 100.0), {0: markers[0].corners_mm}, DICTIONARY) is None


# --- parts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", ["checkerboard", "blue-noise"])
def test_shares_of_pixels_are_those_of_dense_samples_of_the_label(layout: str) -> None:
    pattern = pattern_of(layout)
    v, u = np.indices((14, 17)).astype(np.float64)
    centres = np.stack([0.2 * u - 0.01 * v - 1.0, -0.01 * u - 0.21 * v + 0.7], axis=-1)
    dense = (np.arange(64) + 0.5) / 64 - 0.5
    dv, du = np.meshgrid(dense, dense, indexing="ij")
    x = centres[..., 0, None, None] + 0.2 * du - 0.01 * dv
    y = centres[..., 1, None, None] - 0.01 * du - 0.21 * dv
    expected = np.mean(pattern.label(x, y) == 0, axis=(-1, -2))
    shares = pixel_shares(centres, *ink_tables(pattern, [0]), 0.0, np.zeros((1, 2)))[..., 0]
    # subsamples meet a straight edge exactly but for its slope: 0.01 of a pixel, and corners
    assert np.max(np.abs(shares - expected)) < 0.02
    assert rms(shares - expected) < 0.005


def test_spread_ink_grows_by_the_length_of_its_edges() -> None:
    pattern = pattern_of("checkerboard")
    v, u = np.indices((40, 40)).astype(np.float64)
    centres = np.stack([0.15 * u, -0.15 * v], axis=-1)
    tables = ink_tables(pattern, [0])
    before, after = (pixel_shares(centres, *tables, spread, np.zeros((1, 2)))[..., 0].mean() for spread in (0.0, 0.01))
    # a dot of edge d has 4 d of edge and every second dot is black; corners overlap by terms of second order
    assert after - before == pytest.approx(0.01 * 4 * 0.75 / 2 / 0.75**2, rel=0.1)


def test_the_slope_is_the_difference_of_views() -> None:
    pattern = pattern_of("checkerboard")
    optics = PrintOptics(0.01, 0.06, 0.6, np.ones(1), np.array([[0.2]]), np.zeros((1, 2)))
    shape, tables = (200, 300), ink_tables(pattern, [0])
    coefficients = np.array([[0.1, -0.2], [0.01, -7.3], [10.9, 0.02]])
    windows = Windows.fitting(np.array([[100, 90], [180, 60]]), 10, 0.073, 0.75)
    _, slope = view_slope(windows, lay_ink(windows, coefficients, shape, optics, tables), optics)
    step = 0.1
    for axis, of_half in ((0, 10.9 / 150), (1, -7.3 / 100)):
        moved = []
        for sign in (1, -1):
            shifted = coefficients.copy()
            shifted[0, axis] += sign * step * of_half
            moved.append(view(windows, lay_ink(windows, shifted, shape, optics, tables), optics))
        difference = (moved[0] - moved[1]) / (2 * step)
        # the small turn in the coefficients is left out of `of_half`: 0.2 % of the slope
        assert rms(difference - slope[axis]) < 0.02 * rms(slope[axis])


def test_gathering_undoes_the_blur_of_fine_differences() -> None:
    rng = np.random.default_rng(0)
    fine, n, blur, scattering = 8, 48, 0.3, 0.4
    ink = rng.normal(size=(n * fine, n * fine))
    seen = gaussian_filter(ink, blur * fine, mode="wrap")
    seen = 0.5 * (seen + gaussian_filter(seen, scattering * fine, mode="wrap"))
    area, sampled = (p.reshape(n, fine, n, fine).mean(axis=(1, 3)) for p in (ink, seen))
    kernel = gathering_filter(blur, scattering, 0.0)
    shifted = [np.roll(sampled, (j, i), (0, 1)) for j in range(-2, 3) for i in range(-2, 3)]
    best = np.linalg.lstsq(np.stack([p.ravel() for p in shifted], -1), area.ravel(), rcond=None)[0]
    own = sum(w * p for w, p in zip(kernel.ravel(), shifted, strict=True))
    optimum = sum(w * p for w, p in zip(best, shifted, strict=True))
    assert rms(own - area) < 1.02 * rms(optimum - area)  # what was fitted to these very numbers is hardly better
    # what lies finer than a pixel and was blurred away stays lost: a fifth is what there is to win
    assert rms(own - area) < 0.8 * rms(sampled - area)
