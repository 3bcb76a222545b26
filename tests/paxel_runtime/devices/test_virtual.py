"""The virtual bench as a set of devices: its answers against its own physics, each other, and its truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.devices.base import Camera, Devices, Operator, Projector, Spectroradiometer
from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import DeviceError, InputError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern, colorant_library
from paxel_runtime.optics import grid
from paxel_runtime.optics.spectra import primaries

RGB = ("red", "green", "blue")
SIZE = (144, 96)
PITCH_MM = 0.1465
IDEAL, REALISTIC, HARSH = QUALITIES["ideal"], QUALITIES["realistic"], QUALITIES["harsh"]
QUIET = {"full_well_e": np.inf, "read_noise_e": 0.0, "camera_bits": 16, "glare": 0.0, "black": 0.0, "drift": 0.0}


def pattern_of(colorants: tuple[str, ...] = ("black", "white"), size_mm: tuple[float, float] = (600, 400)) -> Pattern:
    n = len(colorants)
    cells = (np.arange(n)[:, None] + np.arange(n)).astype(np.uint8) % n
    return Pattern("tiles", colorants, cells, 0.75, 30.0, size_mm)


def bench_of(terms: BenchQuality = IDEAL, pattern: Pattern | None = None, **changes: object) -> VirtualBench:
    setup = BenchSetup(
        pattern=pattern or pattern_of(),
        resolution=SIZE,
        width_mm=PITCH_MM * SIZE[0],
        channels=RGB,
        bits=8,
        camera_resolution=(320, 240),
        camera_bits=16,
        aperture_mm=9.0,
        quality="ideal",
        seed=5,
    )
    return VirtualBench(replace(setup, **changes), terms)  # type: ignore[arg-type]


def frame(*levels: int) -> NDArray[np.uint8]:
    return np.broadcast_to(np.array(levels, np.uint8), (SIZE[1], SIZE[0], 3))


def noise_frame(seed: int = 0) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (SIZE[1], SIZE[0], 3), dtype=np.uint8)


def spot() -> NDArray[np.bool_]:
    """Projector pixels whose centre lies in the meter's spot, but for the keystone and the wave."""
    rows, columns = np.indices(SIZE[::-1])
    return np.hypot(columns - (SIZE[0] - 1) / 2, rows - (SIZE[1] - 1) / 2) * PITCH_MM < 4.5


def test_qualities_are_the_pinned_ones() -> None:
    assert list(QUALITIES) == ["realistic", "ideal", "harsh"]
    assert (REALISTIC.black, REALISTIC.cross_talk, REALISTIC.drift) == (1 / 1000, 0.02, 0.003)
    assert (HARSH.fringing, HARSH.fringing_exponent, HARSH.dimming, HARSH.fall_off) == (0.35, 1.6, 0.08, 0.4)


def test_it_is_all_four_devices() -> None:
    bench = bench_of()
    projector: Projector = bench
    camera: Camera = bench
    meter: Spectroradiometer = bench
    operator: Operator = bench
    devices = Devices(projector, camera, meter, operator)
    devices.operator.place("white")
    devices.projector.show(frame(255, 255, 255))
    three, one = devices.camera.capture(), devices.camera.capture("green")
    assert (three.shape, three.dtype) == ((240, 320, 3), np.uint16)
    assert (one.shape, one.dtype) == ((240, 320), np.uint16)
    assert devices.meter.measure().shape == (81,)


# --- radiometry ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("levels", [(255, 255, 255), (200, 17, 80)])
def test_uniform_light_on_white_is_plain_spectral_integration(levels: tuple[int, int, int]) -> None:
    bench = bench_of()
    bench.place("white")
    bench.show(frame(*levels))
    x = [float(bench.truth.response(name, level / 255)) for name, level in zip(RGB, levels, strict=True)]
    expected = np.array(x) @ primaries(RGB) * colorant_library()["white"].reflectance
    # The figure of issue 3; float32 tables of intensities leave 1e-7.
    np.testing.assert_allclose(bench.measure(), expected, rtol=1e-6)
    np.testing.assert_allclose(spectra_to_XYZ(bench.measure()), spectra_to_XYZ(expected), rtol=1e-6)


def test_full_white_has_Y_1_at_the_meters_place() -> None:
    for quality in (IDEAL, HARSH):
        bench = bench_of(quality)
        view = bench.view_XYZ(frame(255, 255, 255), "white")
        assert (view.shape, view.dtype) == ((SIZE[1], SIZE[0], 3), np.float32)
        # Whole pixels stand for a round spot, with the fall-off of a raster of 87 px radius over it: 0.3 %.
        assert view[spot(), 1].mean() == pytest.approx(1.0, abs=3e-3)


@pytest.mark.parametrize("surface", ["pattern", "white"])
def test_meter_reads_the_mean_of_the_view(surface: str) -> None:
    bench = bench_of()
    coarse = np.random.default_rng(0).integers(0, 256, (12, 18, 3), dtype=np.uint8)
    codes = coarse.repeat(8, axis=0).repeat(8, axis=1)
    bench.place("white")
    bench.show(frame(255, 255, 255))
    white_Y = spectra_to_XYZ(bench.measure())[1]
    bench.place(surface)
    bench.show(codes)
    seen = bench.view_XYZ(codes, surface)[spot()].mean(axis=0, dtype=np.float64)
    # The rim of the spot cuts 190 of its 3000 pixels, whose values differ by 1: error sqrt(190) / 3000 / 3.
    np.testing.assert_allclose(spectra_to_XYZ(bench.measure()) / white_Y, seen, rtol=6e-3)


@pytest.mark.parametrize("surface", ["pattern", "white"])
def test_ideal_light_adds(surface: str) -> None:
    bench = bench_of()
    codes = noise_frame()
    parts = [codes * (np.arange(3) == j).astype(np.uint8) for j in range(3)]
    left = codes * (np.arange(SIZE[0]) < 70)[None, :, None].astype(np.uint8)
    for split in (parts, [left, codes - left]):
        whole = bench.view_XYZ(codes, surface)
        # Directions of less than 1e-5 of the light are left out, differently for one and for three channels.
        np.testing.assert_allclose(sum(bench.view_XYZ(part, surface) for part in split), whole, rtol=1e-5, atol=1e-5)
        readings = []
        bench.place(surface)
        for part in (*split, codes):
            bench.show(part)
            readings.append(bench.measure())
        np.testing.assert_allclose(sum(readings[:-1]), readings[-1], rtol=1e-5)  # float32 intensities


def test_real_projectors_light_does_not_add() -> None:
    bench = bench_of(replace(REALISTIC, drift=0, meter_noise_level=0, meter_noise_band=0, black=0))
    readings = []
    for levels in ((255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)):
        bench.show(frame(*levels))
        readings.append(spectra_to_XYZ(bench.measure())[1])
    assert readings[3] / sum(readings[:3]) == pytest.approx(1 - 0.02, abs=1e-4)  # two channels at full: 2 c / 2


def test_black_level_dimming_and_fringing_reach_the_wall() -> None:
    black = bench_of(replace(IDEAL, black=1 / 400))
    black.show(frame(0, 0, 0))
    dark = black.measure()
    black.show(frame(255, 255, 255))
    np.testing.assert_allclose(dark / black.measure(), 1 / 400, rtol=1e-5)
    plain, dim, fringed = (
        bench_of(quality) for quality in (IDEAL, replace(IDEAL, dimming=0.08), replace(IDEAL, fringing=0.35))
    )
    stripes = frame(255, 255, 255) * (np.arange(SIZE[0]) % 2).astype(np.uint8)[None, :, None]
    values = []
    for bench in (plain, dim, fringed):
        bench.show(stripes)
        values.append(bench.measure()[40])
    assert values[1] / values[0] == pytest.approx(1 - 0.08 / 2, rel=1e-5)
    assert values[2] / values[0] == pytest.approx(1 - 0.35 / 2, rel=1e-5)  # two of four neighbours are dark


def test_optical_dot_gain_darkens_the_pattern() -> None:
    bench = bench_of()
    black, white = (colorant_library()[name].reflectance for name in ("black", "white"))
    bench.show(frame(255, 255, 255))
    seen = bench.measure()
    light = primaries(RGB).sum(axis=0)
    share = 0.5  # of black, to 0.2 % in a spot of 12 dots
    murray_davies = light * (share * black + (1 - share) * white)
    yule_nielsen_2 = light * (share * np.sqrt(black) + (1 - share) * np.sqrt(white)) ** 2
    assert np.all(seen < 0.99 * murray_davies)
    assert np.all(seen > yule_nielsen_2)  # scattering far less wide than the dots
    bare = bench_of(replace(IDEAL, scattering_mm=0.0))
    bare.show(frame(255, 255, 255))
    np.testing.assert_allclose(bare.measure(), murray_davies, rtol=0.02)


@pytest.mark.parametrize("quality", [IDEAL, HARSH], ids=["ideal", "harsh"])
def test_finer_samples_change_nothing(quality: BenchQuality, monkeypatch: pytest.MonkeyPatch) -> None:
    quality = replace(quality, drift=0, meter_noise_level=0, meter_noise_band=0, ragged_um=0)
    readings = []
    for subsamples in (4, 8):
        monkeypatch.setattr(grid, "_LEAST_SUBSAMPLES", subsamples)
        bench = bench_of(quality)
        bench.show(noise_frame())
        readings.append(spectra_to_XYZ(bench.measure()))
    np.testing.assert_allclose(readings[0], readings[1], rtol=1e-3)


def test_several_inks_and_the_bare_rim() -> None:
    bench = bench_of(pattern=pattern_of(("cyan", "magenta", "yellow"), size_mm=(12.0, 100.0)))
    full = frame(255, 255, 255)
    bench.show(full)
    on_pattern = bench.measure()
    bench.place("white")
    on_white = bench.measure()
    shares = np.linalg.norm(on_pattern / on_white, axis=0)
    assert 0 < shares < 9
    view = bench.view_XYZ(full, "pattern") / bench.view_XYZ(full, "white")
    np.testing.assert_allclose(view[:, 5:15], 1.0, rtol=1e-4)  # beyond the pattern lies the same bare paper
    assert view[:, 60:80].mean() < 0.8


# --- geometry --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "quality",
    [
        IDEAL,
        replace(HARSH, fall_off=0.0, blur_corner_px=0.45, fringing=0.0, **QUIET),  # type: ignore[arg-type]
    ],
    ids=["ideal", "harsh warp"],
)
def test_a_single_pixel_falls_where_the_truth_says(quality: BenchQuality) -> None:
    bench = bench_of(quality, camera_resolution=(640, 480))
    bench.place("white")
    places = [(4, 5), (92, 140), (50, 70), (10, 120), (85, 9)]
    rows, columns = np.indices((480, 640))
    for channel, level in (("red", (255, 0, 0)), ("blue", (0, 0, 255))):
        truth = bench.truth.camera_xy(channel)
        codes = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
        for place in places:
            codes[place] = level
        bench.show(codes)
        picture = bench.capture(channel).astype(np.float64)
        for place in places:
            x, y = truth[place]
            near = picture * (np.hypot(columns - x, rows - y) < 24)
            centroid = np.array([(near * columns).sum(), (near * rows).sum()]) / near.sum()
            # Half a step of 16 bits over some 900 pixels of tails, and the map's bend within a footprint.
            np.testing.assert_allclose(centroid, (x, y), atol=0.01)


def test_channels_fall_apart_by_the_chromatic_shift() -> None:
    truth = bench_of(replace(IDEAL, chromatic_shift_camera_px=0.6)).truth
    apart = np.linalg.norm(truth.camera_xy("red") - truth.camera_xy("blue"), axis=-1)
    assert apart[0, 0] == pytest.approx(1.2, rel=0.06)  # both shifted by 0.6 at the corner, which keystone stretches
    assert apart[SIZE[1] // 2, SIZE[0] // 2] < 0.01


def test_coverage_of_a_checkerboard() -> None:
    coverage = bench_of().truth.coverage()
    assert coverage.shape == (SIZE[1], SIZE[0], 3)
    np.testing.assert_allclose(coverage.sum(axis=-1), 1.0, atol=1e-5)
    assert coverage[..., 0].mean() == pytest.approx(0.5, abs=0.005)  # 28 x 19 dots
    assert coverage[..., 2].max() < 1e-5
    spread = bench_of(replace(IDEAL, ink_spread_um=25.0)).truth.coverage()
    assert spread[..., 0].mean() > coverage[..., 0].mean() + 0.05  # 2 edges x 25 um of 750 um, less the corners


def test_coverage_knows_bare_paper() -> None:
    coverage = bench_of(pattern=pattern_of(("black", "yellow"), size_mm=(12.0, 100.0))).truth.coverage()
    assert coverage[:, :10, 2].min() == 1.0
    assert coverage[:, 60:80, 2].max() < 0.02  # rounding of two inks to 8 bits along their common edge


# --- camera and meter ------------------------------------------------------------------------------------------------


def test_exposure_fills_80_percent() -> None:
    bench = bench_of()
    bench.place("white")
    for channel, levels in (("red", (255, 0, 0)), ("green", (0, 255, 0)), ("blue", (0, 0, 255)), (None, (255,) * 3)):
        bench.show(frame(*levels))
        assert bench.capture(channel).max() / 65535 == pytest.approx(0.8, abs=1e-4)


def test_captures_of_the_same_differ_by_noise_alone() -> None:
    bench = bench_of(replace(REALISTIC, drift=0.0))
    bench.place("white")
    bench.show(frame(0, 255, 0))
    first, second = (bench.capture("green")[60:180, 80:240] / 65535 for _ in range(2))
    noise = (first - second).std() / np.sqrt(2)
    level = first.mean()
    assert noise == pytest.approx(np.sqrt(level * 45_000 + 16) / 45_000, rel=0.03)  # and 14-bit rounding, 1e-5
    ideal = bench_of()
    np.testing.assert_array_equal(ideal.capture(), ideal.capture())


def test_the_sensors_bits() -> None:
    bench = bench_of(HARSH)
    bench.show(noise_frame())
    assert np.all(bench.capture() % 257 == 0)  # 8 bits
    coarse = bench_of(IDEAL, camera_bits=4)
    coarse.show(noise_frame())
    assert np.all(coarse.capture("red") % (65535 // 15) == 0)


def test_meter_noise_and_drift() -> None:
    bench = bench_of(replace(IDEAL, meter_noise_level=0.001, meter_noise_band=0.003))
    bench.show(frame(255, 255, 255))
    readings = np.array([bench.measure() for _ in range(400)])
    relative = readings / readings.mean(axis=0)
    assert relative.mean(axis=1).std() == pytest.approx(np.hypot(0.001, 0.003 / 9), rel=0.15)  # 400 samples: 3.5 %
    assert relative.std(axis=0).mean() == pytest.approx(np.hypot(0.001, 0.003), rel=0.05)
    drifting = bench_of(replace(IDEAL, drift=0.01))
    drifting.show(frame(255, 255, 255))
    level = np.array([drifting.measure()[40] for _ in range(2000)])
    level /= level.mean()
    # AR(1) of coefficient 0.995 and step 0.1 s: standard deviation 0.1 s / sqrt(1 - 0.995^2) = s; 5 memories: 30 %.
    assert level.std() == pytest.approx(0.01, rel=0.5)
    assert np.diff(level).std() == pytest.approx(0.001, rel=0.1)


@pytest.mark.parametrize("quality", ["realistic", "harsh"])
def test_one_seed_one_bench(quality: str) -> None:
    answers = []
    for seed in (5, 5, 6):
        bench = bench_of(QUALITIES[quality], seed=seed)
        bench.show(noise_frame())
        answers.append((bench.capture("green"), bench.measure(), bench.capture(), bench.truth.camera_xy("red")))
    for same, other in zip(answers[0], answers[1], strict=True):
        np.testing.assert_array_equal(same, other)
    assert not np.array_equal(answers[0][0], answers[2][0])


def test_ten_bit_codes() -> None:
    eight, ten = bench_of(), bench_of(bits=10)
    eight.show(frame(255, 255, 255))
    ten.show(np.full((SIZE[1], SIZE[0], 3), 1023, np.uint16))
    np.testing.assert_allclose(eight.measure(), ten.measure(), rtol=1e-6)


def test_one_white_channel() -> None:
    bench = bench_of(channels=("white",))
    codes = np.full((SIZE[1], SIZE[0], 1), 255, np.uint8)
    assert bench.view_XYZ(codes, "white")[48, 72, 1] == pytest.approx(1.0, abs=1e-3)
    rgb = bench_of()
    bench.show(codes)
    rgb.show(frame(255, 255, 255))
    np.testing.assert_allclose(bench.measure(), rgb.measure(), rtol=1e-5)


# --- wrong use -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"quality": "perfect"}, "quality"),
        ({"channels": ()}, "channels"),
        ({"channels": ("red", "red", "blue")}, "channels"),
        ({"channels": ("red", "x-ray")}, "x-ray"),
        ({"resolution": (8, 400)}, "resolution"),
        ({"camera_resolution": (0, 0)}, "camera"),
        ({"bits": 0}, "bits"),
        ({"camera_bits": 17}, "camera"),
        ({"width_mm": -1.0}, "width_mm"),
        ({"aperture_mm": 40.0}, "aperture_mm"),
        ({"aperture_mm": float("nan")}, "aperture_mm"),
        ({"pattern": pattern_of(("black", "octarine"))}, "octarine"),
    ],
)
def test_an_impossible_bench_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        bench_of(**change)  # type: ignore[arg-type]


def test_wrong_use_is_refused() -> None:
    bench = bench_of()
    with pytest.raises(DeviceError, match="ceiling"):
        bench.place("ceiling")
    with pytest.raises(DeviceError, match="ultraviolet"):
        bench.capture("ultraviolet")
    for wrong in (np.zeros((3, 3, 3), np.uint8), np.zeros((SIZE[1], SIZE[0], 3))):
        with pytest.raises(DeviceError, match="frame"):
            bench.show(wrong)  # type: ignore[arg-type]
    with pytest.raises(DeviceError, match="at most 255"):
        bench.show(np.full((SIZE[1], SIZE[0], 3), 256, np.uint16))
