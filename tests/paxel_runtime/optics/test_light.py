"""Radiometry of the virtual bench against plain spectral integration and closed forms: what may not get lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern, colorant_library
from paxel_runtime.optics import grid
from paxel_runtime.optics.geometry import make_maps
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.light import Footprint, light_rows, make_footprint, spread_columns
from paxel_runtime.optics.spectra import primaries

RGB = ("red", "green", "blue")
SIZE = (160, 120)
PITCH_MM = 0.1465
IDEAL = QUALITIES["ideal"]
NO_LOSS = {"black": 0.0, "cross_talk": 0.0, "fringing": 0.0, "dimming": 0.0, "fall_off": 0.0}
NO_NOISE = {"drift": 0.0, "meter_noise_level": 0.0, "meter_noise_band": 0.0}
LINEAR = {name: replace(QUALITIES[name], **NO_LOSS, **NO_NOISE) for name in QUALITIES}  # type: ignore[arg-type]


def bench_of(quality: BenchQuality) -> VirtualBench:
    cells = np.array([[0, 1], [1, 0]], np.uint8)
    return VirtualBench(
        BenchSetup(
            pattern=Pattern("checkerboard", ("black", "white"), cells, 0.75, 30.0, (600.0, 400.0)),
            resolution=SIZE,
            width_mm=PITCH_MM * SIZE[0],
            channels=RGB,
            bits=8,
            camera_resolution=(320, 240),
            camera_bits=16,
            aperture_mm=13.0,
            quality="ideal",
            seed=5,
        ),
        quality,
    )


def frame(*levels: int) -> NDArray[np.uint8]:
    return np.broadcast_to(np.array(levels, np.uint8), (SIZE[1], SIZE[0], 3))


def footprint_of(
    grid: FineGrid, sigma_px: float, fill_factor: float, chromatic_shift_camera_px: float = 0.0
) -> Footprint:
    size = (grid.width, grid.height)
    maps = make_maps(size, 0.1465 * size[0], (400, 300), 3, chromatic_shift_camera_px, 0.0, 60.0, 3)
    return make_footprint(grid, maps, 0, fill_factor, sigma_px, sigma_px, 0.0)


def all_light(x: NDArray[np.float32], footprint: Footprint, grid: FineGrid) -> NDArray[np.float32]:
    light = np.empty(grid.shape, np.float32)
    light_rows(spread_columns(x, footprint), footprint, 0, light)
    return light


# --- the footprint ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sigma_px", [0.36, 0.5, 0.9])
def test_uniform_light_is_1_to_float32(sigma_px: float) -> None:
    grid = FineGrid(40, 32, 4)
    light = all_light(np.ones((32, 40), np.float32), footprint_of(grid, sigma_px, 1.0, 0.6), grid)
    middle = light[14 * 4 : -14 * 4, 14 * 4 : -14 * 4]  # beyond the reach of the rim
    np.testing.assert_allclose(middle, 1.0, rtol=5e-7)  # two float32 sums of 9 to 13 weights


@pytest.mark.parametrize("fill_factor", [1.0, 0.92])
@pytest.mark.parametrize("sigma_px", [0.36, 0.5, 0.9])
def test_a_pixels_energy_is_1_to_float32(sigma_px: float, fill_factor: float) -> None:
    grid = FineGrid(32, 32, 4)
    x = np.zeros((32, 32), np.float32)
    x[15, 17] = 1.0
    light = all_light(x, footprint_of(grid, sigma_px, fill_factor), grid)
    # Samples 0.25 px apart integrate a Gaussian of 0.36 px to exp(-2 pi^2 1.44^2) = 2e-18.
    assert light.sum(dtype=np.float64) / grid.subsamples**2 == pytest.approx(1.0, abs=5e-7)


# --- the meter -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("quality", LINEAR)
@pytest.mark.parametrize("levels", [(255, 255, 255), (200, 17, 80)])
def test_uniform_white_is_plain_spectral_integration(quality: str, levels: tuple[int, int, int]) -> None:
    bench = bench_of(replace(LINEAR[quality], fill_factor=1.0))
    bench.place("white")
    bench.show(frame(*levels))
    x = [float(bench.truth.response(name, level / 255)) for name, level in zip(RGB, levels, strict=True)]
    expected = np.array(x) @ primaries(RGB) * colorant_library()["white"].reflectance
    # Readings are sums of float32 weights and intensities.
    np.testing.assert_allclose(bench.measure(), expected, rtol=1e-6)
    np.testing.assert_allclose(spectra_to_XYZ(bench.measure()), spectra_to_XYZ(expected), rtol=1e-6)


def test_the_ripple_of_the_pixels_averages_out_over_the_spot() -> None:
    readings = []
    for fill_factor in (1.0, 0.92):
        bench = bench_of(replace(LINEAR["realistic"], fill_factor=fill_factor))
        bench.show(frame(255, 255, 255))
        bench.place("white")
        readings.append(bench.measure())
    # Gaps between pixels ripple by 2e-3, of which a spot of 89 pixels leaves about the 1.5th power of 1 / 89.
    np.testing.assert_allclose(readings[0], readings[1], rtol=5e-6)


@pytest.mark.parametrize("quality", LINEAR)
def test_the_meter_reads_no_more_of_one_pixel_than_its_share_of_the_spot(quality: str) -> None:
    bench = bench_of(LINEAR[quality])
    bench.place("white")
    readings = []
    for codes in (frame(0, 255, 0), frame(0, 255, 0).copy()):
        if readings:
            codes[:, 80:] = 0
        bench.show(codes)
        readings.append(bench.measure().sum())
    # The spot's centre falls between columns 79 and 80 of 89 in its diameter; keystone moves it by 1 % of them.
    assert readings[1] / readings[0] == pytest.approx(0.5, abs=5e-3)


# --- energy ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("quality", LINEAR)
def test_white_paper_returns_the_light_it_gets(quality: str) -> None:
    bench = bench_of(LINEAR[quality])
    lit = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    lit[30:90, 40:120] = np.random.default_rng(0).integers(0, 2, (60, 80, 1), dtype=np.uint8) * 255
    XYZ = bench.view_XYZ(lit, "white").sum(axis=(0, 1), dtype=np.float64)
    of_channels = spectra_to_XYZ(primaries(RGB) * colorant_library()["white"].reflectance)
    # A channel of magnification m lights m^2 of the area as brightly; blur and scattering move light and keep it.
    expected = bench.truth.maps.magnification**2 @ of_channels * (lit[..., 0] > 0).sum() / of_channels.sum(axis=0)[1]
    # A sample gathers with its own blur: where the blur widens outwards, light of 2e-4 is gained (0 in ideal).
    np.testing.assert_allclose(XYZ, expected, rtol=1e-5 if quality == "ideal" else 5e-4)


def test_print_without_scattering_returns_each_colorants_share() -> None:
    bench = bench_of(replace(IDEAL, scattering_mm=0.0))
    share = bench.truth.coverage()[..., 0]
    view = bench.view_XYZ(frame(255, 255, 255), "pattern")
    black, white = (
        spectra_to_XYZ(primaries(RGB).sum(axis=0) * colorant_library()[name].reflectance) for name in ("black", "white")
    )
    expected = (share[..., None] * black + (1 - share[..., None]) * white) / white[1]
    inner = (slice(4, -4), slice(4, -4))  # beyond the reach of the frame's rim
    np.testing.assert_allclose(view[inner], expected[inner], atol=2e-6)  # float32 means of 16 samples
    assert view[inner].mean() == pytest.approx(expected[inner].mean(), rel=1e-3)


@pytest.mark.parametrize("quality", ["ideal", "harsh"])
def test_halving_the_step_changes_no_light(quality: str, monkeypatch: pytest.MonkeyPatch) -> None:
    codes = np.random.default_rng(1).integers(0, 256, (SIZE[1], SIZE[0], 3), dtype=np.uint8)
    # Ragged edges are left out: an edge is taken as straight within a sample.
    terms = replace(LINEAR[quality], ragged_um=0.0, fringing=QUALITIES[quality].fringing)
    views, readings = [], []
    for subsamples in (4, 8):
        monkeypatch.setattr(grid, "_LEAST_SUBSAMPLES", subsamples)
        bench = bench_of(terms)
        bench.show(codes)
        readings.append(spectra_to_XYZ(bench.measure()))
        views.append(bench.view_XYZ(codes, "pattern"))
    np.testing.assert_allclose(readings[0], readings[1], rtol=1e-3)
    inner = (slice(8, -8), slice(8, -8))
    np.testing.assert_allclose(*(view[inner].mean(axis=(0, 1)) for view in views), rtol=1e-3)
