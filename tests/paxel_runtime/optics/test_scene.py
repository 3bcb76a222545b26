"""The bench's physics against closed forms, slow plain-numpy references and published laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import convolve1d
from scipy.special import ndtr

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import D65_XYZ, WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern, colorant_library
from paxel_runtime.optics.camera import expose, sample_camera
from paxel_runtime.optics.geometry import (
    LATTICE_PX,
    BenchMaps,
    camera_to_fine_grid,
    make_maps,
    raster_of_channel,
    raster_to_wall,
    wall_to_camera,
)
from paxel_runtime.optics.grid import MARGIN_PX, FineGrid, bspline_weights, correlated_noise, gaussian_kernel
from paxel_runtime.optics.ink import ink_coverage, make_layers
from paxel_runtime.optics.light import (
    Footprint,
    drive,
    footprint_adjoint,
    fringe,
    light_rows,
    make_footprint,
    spread_columns,
)
from paxel_runtime.optics.paper import convolve, radiance, scattered_apertures
from paxel_runtime.optics.spectra import (
    ink_terms,
    pair_factors,
    patch_factors,
    primaries,
    response,
    response_table,
)

RGB = ("red", "green", "blue")
CHECKER = np.array([[0, 1], [1, 0]], np.uint8)
FLOAT32 = 2e-6  # relative: sums of some dozen float32 products


def maps_of(resolution: tuple[int, int], **changes: float) -> BenchMaps:
    """Geometry of a small bench whose projector pixel is 0.1465 mm wide."""
    camera = (int(2.3 * resolution[0]), int(2.6 * resolution[1]))
    terms = {"chromatic_shift_camera_px": 0.0, "wave_camera_px": 0.0, "wave_correlation_px": 60.0, "seed": 3} | changes
    return make_maps(resolution, 0.1465 * resolution[0], camera, 3, **terms)  # type: ignore[arg-type]


def all_light(x: NDArray[np.float32], footprint: Footprint, grid: FineGrid) -> NDArray[np.float32]:
    light = np.empty(grid.shape, np.float32)
    light_rows(spread_columns(x, footprint), footprint, 0, light)
    return light


# --- spectra ---------------------------------------------------------------------------------------------------------


def test_full_white_of_the_primaries_is_d65_with_Y_1() -> None:
    # The table has 7 digits.
    np.testing.assert_allclose(spectra_to_XYZ(primaries(RGB).sum(axis=0)), D65_XYZ, rtol=1e-6)
    np.testing.assert_allclose(primaries(("white",))[0], primaries(RGB).sum(axis=0))


def test_a_channel_without_spectrum_is_named() -> None:
    with pytest.raises(InputError, match="infrared"):
        primaries(("red", "infrared"))


@pytest.mark.parametrize("channel", range(3))
def test_response_rises_from_0_to_1_and_is_no_power_law(channel: int) -> None:
    P = np.linspace(0, 1, 1001)
    x = response(P, channel)
    assert x[0] == 0
    assert x[-1] == 1
    assert np.all(np.diff(x) > 0)
    best = min(np.abs(x - P**gamma).max() for gamma in np.linspace(1.5, 3, 301))
    assert best > 0.005  # a gamma would be wrong by half a percent of full: more than any noise of the bench
    np.testing.assert_allclose(response_table(3, 8)[channel], response(np.arange(256) / 255, channel), rtol=1e-6)


def test_response_differs_by_channel() -> None:
    middle = [float(response(0.5, channel)) for channel in range(3)]
    assert min(abs(a - b) for i, a in enumerate(middle) for b in middle[:i]) > 0.02


def test_solid_ink_has_its_own_reflectance() -> None:
    paper, red = (colorant_library()[name].reflectance for name in ("white", "red"))
    bands, lights = np.eye(81), primaries(RGB)
    factors = pair_factors(bands, lights, paper, ink_terms(paper, red[None]))
    np.testing.assert_allclose(factors.sum(axis=(2, 3)).T / 5, lights * red, rtol=1e-4, atol=1e-8)  # float32 sums
    collapsed = patch_factors(factors)
    np.testing.assert_allclose(collapsed.sum(axis=(2, 3)).T / 5, lights * red, rtol=1e-4, atol=1e-8)
    np.testing.assert_array_equal(collapsed[..., 1], 0)


# --- the panel -------------------------------------------------------------------------------------------------------


@given(
    codes=st.integers(0, 2**32 - 1),
    channels=st.integers(1, 4),
    cross_talk=st.floats(0, 0.2),
    black=st.floats(0, 0.01),
    dimming=st.floats(0, 0.2),
)
@settings(max_examples=20, deadline=None)
def test_drive_is_cross_talk_then_black_then_dimming(
    codes: int, channels: int, cross_talk: float, black: float, dimming: float
) -> None:
    frame = np.random.default_rng(codes).integers(0, 256, (7, 5, channels), dtype=np.uint8)
    table = response_table(channels, 8)
    x = np.stack([table[j].astype(np.float64)[frame[..., j]] for j in range(channels)])
    x = x * (1 - cross_talk / 2 * (x.sum(axis=0) - x))
    x = black + (1 - black) * x
    x = x * (1 - dimming * x.mean())
    np.testing.assert_allclose(drive(frame, table, cross_talk, black, dimming), x, rtol=1e-5, atol=1e-9)


@given(seed=st.integers(0, 2**32 - 1), fraction=st.floats(0.01, 0.5), exponent=st.floats(1, 2))
@settings(max_examples=20, deadline=None)
def test_fringe_against_plain_numpy(seed: int, fraction: float, exponent: float) -> None:
    x = np.random.default_rng(seed).random((2, 6, 9), dtype=np.float32)
    framed = np.pad(x.astype(np.float64), ((0, 0), (1, 1), (1, 1)), mode="edge")
    neighbours = (framed[:, :-2, 1:-1], framed[:, 2:, 1:-1], framed[:, 1:-1, :-2], framed[:, 1:-1, 2:])
    loss = np.mean([np.maximum(0, x - n) ** exponent for n in neighbours], axis=0)
    np.testing.assert_allclose(fringe(x, fraction, exponent), x - fraction * loss, atol=1e-6)


# --- geometry --------------------------------------------------------------------------------------------------------


def test_camera_to_fine_grid_inverts_the_maps() -> None:
    grid = FineGrid(192, 108, 4)
    maps = maps_of((192, 108), wave_camera_px=0.3)
    nodes = camera_to_fine_grid(maps, grid, (441, 280))
    seen = wall_to_camera(maps, raster_to_wall(maps, grid.to_raster(nodes)))
    rows, columns = np.indices(nodes.shape[:2]) * LATTICE_PX
    # 5 steps of a contraction by less than 0.01 from 0.3 px.
    np.testing.assert_allclose(seen, np.stack((columns, rows), axis=-1), atol=1e-8)


def test_the_camera_sees_the_whole_projection() -> None:
    for seed in range(20):
        maps = make_maps((960, 540), 140.6, (2048, 1536), 3, 0.6, 0.3, 60.0, seed)
        rim = np.stack(np.meshgrid([-0.5, 480, 959.5], [-0.5, 270, 539.5]), axis=-1)
        seen = wall_to_camera(maps, raster_to_wall(maps, rim))
        assert np.all(seen > (20, 15))  # a margin of 3 % less the aberrations
        assert np.all(seen < (2027, 1520))


def test_chromatic_shift_at_the_corner() -> None:
    flat, maps = maps_of((192, 108)), maps_of((192, 108), chromatic_shift_camera_px=0.6)
    corner = np.array([0.0, 0.0])
    shift = [
        np.linalg.norm(
            wall_to_camera(maps, raster_to_wall(maps, raster_of_channel(maps, j, corner)))
            - wall_to_camera(flat, raster_to_wall(flat, corner))
        )
        for j in range(3)
    ]
    np.testing.assert_allclose(shift, [0.6, 0.0, 0.6], rtol=0.05)  # keystone and distortion stretch the corner


def test_wave_has_the_stated_rms_and_correlation() -> None:
    size = (960, 540)
    flat, wavy = maps_of(size), maps_of(size, wave_camera_px=0.3)
    pixels = np.stack(np.meshgrid(np.arange(0, 960, 5.0), np.arange(0, 540, 5.0)), axis=-1)
    moved = wall_to_camera(wavy, raster_to_wall(wavy, pixels)) - wall_to_camera(flat, raster_to_wall(flat, pixels))
    # 16 x 9 correlation lengths: the rms of a part of the field scatters by some 6 %, correlations by 0.1.
    np.testing.assert_allclose(moved.std(axis=(0, 1)), 0.3, rtol=0.2)
    lag = 12
    pairs = [(moved[:, lag:], moved[:, :-lag]), (moved[lag:], moved[:-lag])]
    correlation = np.mean([(a * b).mean() for a, b in pairs]) / (moved**2).mean()
    assert correlation == pytest.approx(np.exp(-1), abs=0.12)


def test_correlated_noise() -> None:
    noise = correlated_noise((512, 512), 8.0, np.random.default_rng(0))
    assert noise.std() == pytest.approx(1.0)
    for lag in (4, 8, 12):  # 4000 independent patches: scatter 0.02
        assert np.mean(noise * np.roll(noise, lag, 1)) == pytest.approx(np.exp(-((lag / 8) ** 2)), abs=0.05)


# --- light -----------------------------------------------------------------------------------------------------------


def test_uniform_frame_lights_by_fall_off_alone() -> None:
    grid, maps = FineGrid(64, 48, 4), maps_of((64, 48), chromatic_shift_camera_px=0.6)
    footprint = make_footprint(grid, maps, 0, 1.0, 0.36, 0.5, 0.24)
    light = all_light(np.ones((48, 64), np.float32), footprint, grid)
    inner = slice(40, -40)
    u, v = grid.to_raster(np.arange(grid.shape[1])), grid.to_raster(np.arange(grid.shape[0]))
    r2 = ((u - 31.5) ** 2 + (v[:, None] - 23.5) ** 2) / (32**2 + 24**2)
    # A box as wide as the pitch, blurred, sums to 1 everywhere but for tails beyond 4.5 sigma (7e-6).
    np.testing.assert_allclose(light[inner, inner], (1 - 0.24 * r2)[inner, inner], rtol=2e-5)


@pytest.mark.parametrize("channel", [0, 2])
def test_light_is_the_sum_of_blurred_boxes(channel: int) -> None:
    size = (240, 150)
    grid, maps = FineGrid(*size, 4), maps_of(size, chromatic_shift_camera_px=0.6)
    x = np.random.default_rng(1).random(size[::-1], dtype=np.float32)
    footprint = make_footprint(grid, maps, channel, 0.92, 0.45, 0.9, 0.4)
    light = all_light(x, footprint, grid)
    for row, column in np.random.default_rng(2).integers(0, grid.shape, (40, 2)):
        u, v = grid.to_raster(np.array([column, row]))
        own = maps.raster_centre + (np.array([u, v]) - maps.raster_centre) / maps.magnification[channel]
        r2 = np.sum(((np.array([u, v]) - maps.raster_centre) / maps.radius_px) ** 2)
        sigma, half = 0.45 + 0.45 * min(r2, 1.0), np.sqrt(0.92) / 2
        across, down = (
            (ndtr((c - np.arange(n) + half) / sigma) - ndtr((c - np.arange(n) - half) / sigma)) / (2 * half)
            for c, n in zip(own, size, strict=True)
        )
        # Sigma is constant in steps of 0.015 and over 4 pixels: off by up to 0.03 at the rim of so small a raster.
        assert light[row, column] == pytest.approx(down @ x @ across * (1 - 0.4 * r2), abs=0.006)


def test_energy_of_one_pixel() -> None:
    grid, maps = FineGrid(32, 32, 4), maps_of((32, 32))
    x = np.zeros((32, 32), np.float32)
    x[15, 17] = 1.0
    footprint = make_footprint(grid, maps, 1, 0.92, 0.5, 0.5, 0.0)
    assert all_light(x, footprint, grid).sum() / grid.subsamples**2 == pytest.approx(1.0, abs=2e-5)  # tails as above


def test_footprint_adjoint() -> None:
    grid, maps = FineGrid(48, 32, 4), maps_of((48, 32), chromatic_shift_camera_px=0.6)
    footprint = make_footprint(grid, maps, 2, 0.92, 0.36, 0.5, 0.24)
    rng = np.random.default_rng(0)
    x, weights = rng.random((32, 48), dtype=np.float32), rng.random((60, 70))
    window = all_light(x, footprint, grid)[30:90, 50:120]
    adjoint = footprint_adjoint(weights, 30, 50, footprint, (48, 32))
    assert np.sum(adjoint * x) == pytest.approx(np.sum(weights * window), rel=FLOAT32)


# --- paper -----------------------------------------------------------------------------------------------------------


def test_gaussian_kernel_has_unit_sum_and_its_variance() -> None:
    half = gaussian_kernel(1.64).astype(np.float64)
    steps = np.arange(len(half))
    assert 2 * half.sum() - half[0] == pytest.approx(1.0)
    assert 2 * np.sum(half * steps**2) == pytest.approx(1.64**2, rel=2e-3)  # cut at 4 sigma


def test_convolve_against_scipy() -> None:
    field = np.random.default_rng(0).random((37, 53), dtype=np.float32)
    kernel = gaussian_kernel(2.1)
    both = np.concatenate((kernel[:0:-1], kernel)).astype(np.float64)
    expected = convolve1d(convolve1d(field.astype(np.float64), both, 0, mode="constant"), both, 1, mode="constant")
    np.testing.assert_allclose(convolve(field, kernel), expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("fluoresces", [False, True])
@pytest.mark.parametrize("ambient", [False, True])
def test_radiance_against_plain_numpy(fluoresces: bool, ambient: bool) -> None:
    grid, maps = FineGrid(40, 36, 4), maps_of((40, 36), chromatic_shift_camera_px=0.6)
    rng = np.random.default_rng(0)
    x = rng.random((2, 36, 40), dtype=np.float32)
    footprints = [make_footprint(grid, maps, j, 0.92, 0.36, 0.5, 0.24) for j in (0, 2)]
    coverage = rng.integers(0, 128, (2, *grid.shape), dtype=np.uint8)
    paper, inks = np.full(81, 0.9), rng.uniform(0.05, 0.8, (2, 81))
    factors = pair_factors(rng.random((3, 81)), primaries(("red", "green")), paper, ink_terms(paper, inks))
    if fluoresces:  # light that entered ink 1 leaves through the paper and, dimmed, through ink 0
        factors[:, :, 0, 2] += 3.0
        factors[:, :, 1, 2] -= 1.0
    scattering, blur = gaussian_kernel(1.6), gaussian_kernel(1.1)
    uniform = 0.1 * factors[:, 0] if ambient else None
    a = np.concatenate((np.ones((1, *grid.shape)), coverage / 255))
    light = np.stack([all_light(plane, f, grid) for plane, f in zip(x, footprints, strict=True)])
    expected = np.zeros((3, *grid.shape))
    for j, k, m in np.ndindex(2, 3, 3):
        passage = a[k] * convolve((a[m] * light[j]).astype(np.float32), scattering)
        expected += factors[:, j, k, m, None, None] * passage
        if uniform is not None and j == 0:
            expected += uniform[:, k, m, None, None] * a[k] * convolve(a[m].astype(np.float32), scattering)
    expected = np.stack([convolve(plane.astype(np.float32), blur) for plane in expected])
    seen = radiance(x, footprints, coverage, factors, scattering, blur, uniform)
    rim = slice(len(scattering) + len(blur), -len(scattering) - len(blur)) if ambient else slice(None)
    # Directions with less than 1e-5 of the light are left out; ambient light does not end with the raster.
    np.testing.assert_allclose(seen[:, rim, rim], expected[:, rim, rim], rtol=1e-5, atol=1e-5 * expected.max())


def test_scattered_apertures_are_the_adjoint_of_the_paper() -> None:
    rng = np.random.default_rng(0)
    aperture, light = (np.pad(rng.random((20, 24), dtype=np.float32), 8) for _ in range(2))
    coverage = rng.integers(0, 128, (1, 36, 40), dtype=np.uint8)
    kernel = gaussian_kernel(1.64)
    a = np.concatenate((np.ones((1, 36, 40)), coverage / 255)).astype(np.float32)
    weights = scattered_apertures(aperture, coverage, kernel)
    for k, m in np.ndindex(2, 2):
        forward = np.sum(aperture * a[k] * convolve(a[m] * light, kernel))
        assert np.sum(weights[k, m] * light) == pytest.approx(forward, rel=2e-5)  # float32 sums of 1440 terms


@pytest.mark.parametrize(
    ("scattering", "n"), [(0.0, 1), (40.0, 2)], ids=["no scattering: Murray-Davies", "wide: Yule-Nielsen, n = 2"]
)
def test_optical_dot_gain_limits(scattering: float, n: int) -> None:
    # Yule & Nielsen 1951: R^(1/n) = sum of shares R_i^(1/n), in every band, for paper and two inks together.
    grid, maps = FineGrid(96, 96, 4), maps_of((96, 96))
    stripes = np.arange(grid.shape[1]) // 2 % 4
    coverage = np.stack([np.broadcast_to(np.uint8(255) * (stripes == k), grid.shape) for k in (1, 2)]).copy()
    library = colorant_library()
    paper, inks = library["white"].reflectance, np.array([library[name].reflectance for name in ("black", "yellow")])
    bands = np.eye(81)[::8] / 5  # sensors of one band, 1 nm times unit power
    factors = pair_factors(bands, np.ones((1, 81)), paper, ink_terms(paper, inks))
    if n == 1:
        factors = patch_factors(factors)
    footprint = make_footprint(grid, maps, 1, 1.0, 0.36, 0.36, 0.0)
    seen = radiance(
        np.ones((1, 96, 96), np.float32),
        [footprint],
        coverage,
        factors,
        gaussian_kernel(scattering),
        gaussian_kernel(0),
    )
    middle = slice(grid.shape[0] // 2 - 16, grid.shape[0] // 2 + 16)  # 4 periods, 4.4 sigma from the rim
    reflectance = seen[:, middle, middle].mean(axis=(1, 2))
    root = 0.5 * paper ** (1 / n) + 0.25 * (inks ** (1 / n)).sum(axis=0)
    np.testing.assert_allclose(reflectance, (root**n)[::8], rtol=1e-3)


# --- print -----------------------------------------------------------------------------------------------------------


def checkerboard(dot_mm: float = 0.75, angle_deg: float = 30.0, size_mm: tuple[float, float] = (600, 400)) -> Pattern:
    return Pattern("checkerboard", ("black", "white"), CHECKER, dot_mm, angle_deg, size_mm)


def supersampled(pattern: Pattern, maps: BenchMaps, grid: FineGrid) -> NDArray[np.float64]:
    """Share of each colorant in each fine sample by `Pattern.label` at 100 points of it."""
    rows, columns = (grid.to_raster((np.arange(size * 10) + 0.5) / 10 - 0.5) for size in grid.shape)
    wall = raster_to_wall(maps, np.stack(np.meshgrid(columns, rows), axis=-1))
    labels = pattern.label(wall[..., 0], wall[..., 1]).reshape(grid.shape[0], 10, grid.shape[1], 10)
    return np.stack([(labels == label).mean(axis=(1, 3)) for label in range(len(pattern.colorants))])


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, -77.0])
def test_coverage_is_that_of_the_label_function(angle_deg: float) -> None:
    grid, maps = FineGrid(36, 24, 4), maps_of((36, 24), wave_camera_px=0.3)
    pattern = checkerboard(angle_deg=angle_deg, size_mm=(4.0, 9.0))
    layers = make_layers(pattern, [0], (0.0, 0.0), 0.0, 0.0, 0.0, 50.0, 0)
    error = ink_coverage(layers, maps, grid)[0] / 255 - supersampled(pattern, maps, grid)[0]
    # Straight edges are exact; the few samples that hold a corner of a cell are off by up to 0.2. The reference itself
    # has 100 points a sample.
    assert np.sqrt(np.mean(error**2)) < 0.012
    assert abs(error.mean()) < 5e-4


def test_three_inks_cover_by_the_label_function() -> None:
    grid, maps = FineGrid(36, 24, 4), maps_of((36, 24))
    cells = np.array([[0, 1, 2, 3], [2, 3, 0, 1], [1, 0, 3, 2]], np.uint8)
    pattern = Pattern("tiles", ("cyan", "white", "black", "yellow"), cells, 0.5, 20.0, (600, 400))
    layers = make_layers(pattern, [2, 0, 3], (0.0, 0.0), 0.0, 0.0, 0.0, 50.0, 0)
    bytes_ = ink_coverage(layers, maps, grid)
    assert bytes_.sum(axis=0, dtype=np.int64).max() == 255
    coverage = bytes_ / 255
    expected = supersampled(pattern, maps, grid)[[2, 0, 3]]
    assert np.all(np.sqrt(np.mean((coverage - expected) ** 2, axis=(1, 2))) < 0.02)  # more corners than above


def test_ink_spread_grows_every_edge() -> None:
    grid, maps = FineGrid(160, 100, 4), maps_of((160, 100))
    stripes = Pattern("stripes", ("black", "white"), np.array([[0, 1]], np.uint8), 0.75, 30.0, (600, 400))
    for spread_um in (0.0, 25.0):
        layers = make_layers(stripes, [0], (0.0, 0.0), 0.0, spread_um, 0.0, 50.0, 0)
        share = ink_coverage(layers, maps, grid).mean() / 255
        # Both edges of a stripe of 0.75 mm; 15 periods are not a whole number in the field: 1 %.
        assert share == pytest.approx(0.5 + spread_um / 750, abs=0.01)


def test_ragged_edges_move_without_growing() -> None:
    grid, maps = FineGrid(160, 100, 4), maps_of((160, 100))
    smooth, ragged = (
        ink_coverage(make_layers(checkerboard(), [0], (0.0, 0.0), 0.0, 0.0, um, 50.0, 0), maps, grid) / 255.0
        for um in (0.0, 15.0)
    )
    assert ragged.mean() == pytest.approx(smooth.mean(), abs=2e-3)  # 250 cells of 60 correlation lengths of edge each
    # An edge displaced by e changes |e| of area a length of edge: mean |e| = sqrt(2 / pi) rms.
    edge_mm_per_mm2 = 2 / 0.75
    assert np.abs(ragged - smooth).mean() == pytest.approx(np.sqrt(2 / np.pi) * 0.015 * edge_mm_per_mm2, rel=0.1)


def test_print_scale_error() -> None:
    grid, maps = FineGrid(160, 100, 4), maps_of((160, 100))
    scaled = make_layers(checkerboard(angle_deg=0), [0], (0.005, -0.01), 0.0, 0.0, 0.0, 50.0, 0)
    coverage = ink_coverage(scaled, maps, grid)[0] / 255
    points = grid.to_raster(np.array([[70, 330], [650, 40], [333, 222]]))
    wall = raster_to_wall(maps, points)
    for (column, row), (x, y) in zip([[70, 330], [650, 40], [333, 222]], wall, strict=True):
        nominal = checkerboard(angle_deg=0).label(np.array(x / 1.005), np.array(y / 0.99))
        assert coverage[row, column] == (nominal == 0)  # points chosen inside cells


def test_inks_are_offset_from_the_first_and_the_darker_decides() -> None:
    grid, maps = FineGrid(160, 100, 4), maps_of((160, 100))
    pattern = Pattern("checkerboard", ("black", "yellow"), CHECKER, 0.75, 30.0, (600, 400))
    true = make_layers(pattern, [0, 1], (0.0, 0.0), 0.0, 0.0, 0.0, 50.0, 0)
    off = make_layers(pattern, [0, 1], (0.0, 0.0), 50.0, 0.0, 0.0, 50.0, 0)
    np.testing.assert_allclose(np.linalg.norm(off.offsets_mm, axis=1), [0, 0.05])
    aligned, shifted = ink_coverage(true, maps, grid) / 255.0, ink_coverage(off, maps, grid) / 255.0
    np.testing.assert_array_equal(shifted[0], aligned[0])
    gap = 1 - shifted.sum(axis=0)
    # Misregistration of 0.05 mm bares (and overprints) 0.05 (|cos| + |sin|) / 0.75 / 2 * 2 sides / 2 of the area.
    angle = np.arctan2(*off.offsets_mm[1][::-1]) - np.deg2rad(30)
    assert gap.mean() == pytest.approx(0.05 * (abs(np.cos(angle)) + abs(np.sin(angle))) / 0.75 / 2, rel=0.1)
    assert np.abs(1 - aligned.sum(axis=0)).mean() < 1e-3  # rounding to 8 bits


# --- camera ----------------------------------------------------------------------------------------------------------


@given(t=st.floats(0, 1))
@settings(deadline=None)
def test_bspline_weights_have_constant_moments(t: float) -> None:
    weights, distance = np.array(bspline_weights(t)), np.arange(-1, 3) - t
    np.testing.assert_allclose([weights @ distance**k for k in range(3)], [1, 0, 1 / 3], atol=1e-14)


def test_sampling_reproduces_linear_fields() -> None:
    grid = FineGrid(64, 48, 4)
    maps = maps_of((64, 48), wave_camera_px=0.1)
    row, column = np.indices(grid.shape)
    picture = sample_camera(
        (0.3 * row - 0.7 * column).astype(np.float32), camera_to_fine_grid(maps, grid, (147, 124)), (147, 124)
    )
    pixels = np.stack(np.meshgrid(np.arange(4, 60), np.arange(4, 44)), axis=-1).astype(float)
    seen = wall_to_camera(maps, raster_to_wall(maps, pixels))
    sample = grid.to_sample(pixels)
    x, y = np.floor(seen).astype(int)[..., 0], np.floor(seen).astype(int)[..., 1]
    fx, fy = seen[..., 0] - x, seen[..., 1] - y
    between = (1 - fy) * ((1 - fx) * picture[y, x] + fx * picture[y, x + 1])
    between += fy * ((1 - fx) * picture[y + 1, x] + fx * picture[y + 1, x + 1])
    # The distortion of so small a raster bends within 4 camera pixels by 1e-3 fine samples.
    np.testing.assert_allclose(between, 0.3 * sample[..., 1] - 0.7 * sample[..., 0], atol=4e-3)


def test_shot_and_read_noise() -> None:
    for level, well, read in ((0.5, 45_000.0, 4.0), (0.02, 8_000.0, 12.0)):
        picture = np.full((256, 400), level, np.float32)
        raw = expose(picture, 0.0, well, read, 16, np.random.default_rng(0)) / 65535
        expected = np.sqrt(level * well + read**2) / well
        assert raw.mean() == pytest.approx(level, abs=5 * expected / 320)  # standard error of 102,400 pixels
        assert raw.std() == pytest.approx(expected, rel=0.02)


def test_rounding_and_saturation() -> None:
    ramp = np.linspace(-0.1, 1.2, 4096, dtype=np.float32)[None]
    raw = expose(ramp, 0.0, np.inf, 0.0, 8, np.random.default_rng(0))
    assert set(np.unique(raw)) == set(np.arange(256) * 257)
    np.testing.assert_allclose(raw[0] / 65535, np.clip(ramp[0], 0, 1), atol=0.5 / 255 + 1e-6)


def test_glare_moves_light_and_keeps_its_sum() -> None:
    picture = np.zeros((256, 384), np.float32)
    picture[96:160, 160:224] = 0.8
    raw = expose(picture, 0.03, np.inf, 0.0, 16, np.random.default_rng(0)) / 65535
    assert raw[128, 192] == pytest.approx(0.8 * 0.97, rel=0.03)
    assert raw[128, 260] > 1e-4
    assert raw.sum() == pytest.approx(picture.sum(), rel=2e-3)  # rounding of faint glare to 16 bits


def test_fine_grid_coordinates() -> None:
    grid = FineGrid(20, 10, 4)
    assert grid.shape == ((10 + 2 * MARGIN_PX) * 4, (20 + 2 * MARGIN_PX) * 4)
    first = MARGIN_PX * 4 + np.arange(4)
    np.testing.assert_allclose(grid.to_raster(first), [-0.375, -0.125, 0.125, 0.375])
    np.testing.assert_allclose(grid.to_sample(grid.to_raster(first)), first)
    row, column = np.indices(grid.shape) // 4
    expected = np.arange(MARGIN_PX, 10 + MARGIN_PX)[:, None] * 100 + np.arange(MARGIN_PX, 20 + MARGIN_PX)
    np.testing.assert_array_equal(grid.pixel_means(row * 100 + column), expected)
    assert FineGrid.fitting((20, 10), 0.1465, 0.06).subsamples == 4
    assert FineGrid.fitting((20, 10), 0.3125, 0.06).subsamples == 6


def test_wavelengths_are_those_of_the_project() -> None:
    assert primaries(RGB).shape == (3, len(WAVELENGTHS_NM))
