"""The bench's second surface, ambient light, channels, fluorescence, own inks and camera options: their physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.bench_setup import GRAY
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.fluorescence import brightener, fluorescent_triad
from paxel_runtime.model.pattern import Colorant, Pattern, colorant_library
from paxel_runtime.optics.geometry import CameraPose
from paxel_runtime.optics.held import lens_positions_mm
from paxel_runtime.optics.overprint import overprints, papers
from paxel_runtime.optics.spectra import ambient_spectrum, primaries, shift_of_level, shift_spectra

RGB = ("red", "green", "blue")
SIZE = (144, 96)
PITCH_MM = 0.1465
IDEAL, REALISTIC = QUALITIES["ideal"], QUALITIES["realistic"]
READING = 2e-5  # relative: float32 intensities and weights, summed over a spot


def pattern_of(colorants: tuple[str, ...] = ("black", "white"), dot_mm: float = 0.75) -> Pattern:
    n = len(colorants)
    cells = (np.arange(n)[:, None] + np.arange(n)).astype(np.uint8) % n
    return Pattern("tiles", colorants, cells, dot_mm, 30.0, (600, 400))


def bench_of(terms: BenchQuality = IDEAL, **changes: object) -> VirtualBench:
    setup = BenchSetup(
        pattern=pattern_of(),
        resolution=SIZE,
        width_mm=PITCH_MM * SIZE[0],
        channels=RGB,
        bits=8,
        camera_resolution=(320, 240),
        camera_bits=16,
        aperture_mm=7.0,
        quality="ideal",
        seed=5,
    )
    return VirtualBench(replace(setup, **changes), terms)  # type: ignore[arg-type]


def uv_bench(pattern: Pattern, terms: BenchQuality = IDEAL, **changes: object) -> VirtualBench:
    return bench_of(terms, pattern=pattern, channels=("uv",), **changes)


def frame(*levels: int) -> NDArray[np.uint8]:
    return np.broadcast_to(np.array(levels, np.uint8), (SIZE[1], SIZE[0], len(levels)))


def noise_frame(channels: int = 3) -> NDArray[np.uint8]:
    return np.random.default_rng(0).integers(0, 256, (SIZE[1], SIZE[0], channels), dtype=np.uint8)


def reading(bench: VirtualBench, codes: NDArray[np.unsignedinteger], surface: str) -> NDArray[np.float64]:
    bench.place(surface)
    bench.show(codes)
    return bench.measure()


# --- the second surface ----------------------------------------------------------------------------------------------


def test_gray_sheet_is_its_reflectance_times_white() -> None:
    white, gray = bench_of(), bench_of(second_surface="gray")
    codes = noise_frame()
    np.testing.assert_allclose(reading(gray, codes, "white"), GRAY * reading(white, codes, "white"), rtol=READING)
    np.testing.assert_allclose(
        gray.view_XYZ(codes, "white"), GRAY * white.view_XYZ(codes, "white"), rtol=1e-5, atol=1e-6
    )  # float32
    np.testing.assert_allclose(reading(gray, codes, "pattern"), reading(white, codes, "pattern"), rtol=1e-12)
    picture = bench_of(second_surface="gray")
    picture.place("white")
    picture.show(frame(255, 255, 255))
    assert picture.capture().max() / 65535 == pytest.approx(0.8 * GRAY, abs=1e-4)  # exposed for white


@pytest.mark.parametrize("name", ["uncoated", "yellow"])
def test_a_sheet_of_another_paper(name: str) -> None:
    bench = bench_of(second_surface=name)
    light = primaries(RGB).sum(axis=0)
    expected = light * (papers() | colorant_library())[name].reflectance
    np.testing.assert_allclose(reading(bench, frame(255, 255, 255), "white"), expected, rtol=1e-6)  # float32


def test_a_held_sheet_at_the_wall_is_the_hung_one() -> None:
    codes = noise_frame()
    hung, held = bench_of(REALISTIC), bench_of(REALISTIC, sheet_distance_mm=0.0, sheet_tilt_deg=(0.0, 0.0))
    for bench in (hung, held):
        bench.place("white")
        bench.show(codes)
    np.testing.assert_array_equal(hung.capture(), held.capture())
    np.testing.assert_array_equal(hung.measure(), held.measure())
    np.testing.assert_array_equal(hung.truth.camera_xy("red", "white"), hung.truth.camera_xy("red"))
    near = bench_of(IDEAL, sheet_distance_mm=1e-9)  # through all of the geometry of holding
    np.testing.assert_allclose(near.truth.camera_xy("red", "white"), near.truth.camera_xy("red"), atol=1e-6)
    np.testing.assert_allclose(reading(near, codes, "white"), reading(bench_of(), codes, "white"), rtol=1e-5)


def test_a_held_sheet_moves_and_brightens_the_picture_by_the_rays() -> None:
    distance = 8.0
    bench = bench_of(sheet_distance_mm=distance)
    projector, camera = lens_positions_mm(SIZE, PITCH_MM * SIZE[0])
    middle = (SIZE[1] // 2, SIZE[0] // 2)
    moved = bench.truth.camera_xy("green", "white") - bench.truth.camera_xy("green")
    # Similar triangles: the ray from the lens below the axis is not yet up at the axis, so the spot falls lower.
    down_mm = -projector[1] * distance / projector[2] * camera[2] / (camera[2] - distance)
    assert moved[middle][1] == pytest.approx(down_mm / bench.truth.maps.camera_px_mm, rel=0.05)  # 1 % of turn, keystone
    full = frame(255, 255, 255)
    hung = bench_of()
    brighter = reading(bench, full, "white") / reading(hung, full, "white")
    np.testing.assert_allclose(brighter, (projector[2] / (projector[2] - distance)) ** 2, rtol=1e-3)
    spot = np.zeros_like(full)
    spot[60:63, 70:73] = 255
    bench.place("white")
    bench.show(spot)
    picture = bench.capture("green").astype(float)
    rows, columns = np.indices(picture.shape)
    centroid = np.array([(picture * columns).sum(), (picture * rows).sum()]) / picture.sum()
    # The centre of light lies where the truth says; float32 and the defocus's slope across 3 pixels.
    np.testing.assert_allclose(centroid, bench.truth.camera_xy("green", "white")[61, 71], atol=0.05)


def test_defocus_adds_its_variance() -> None:
    spot = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    spot[48, 72] = 255
    spread = []
    for distance in (0.0, 3.0):
        bench = bench_of(sheet_distance_mm=distance)
        seen = bench.view_XYZ(spot, "white")[..., 1].astype(float)
        columns = np.arange(SIZE[0])
        spread.append((seen.sum(axis=0) * (columns - 72) ** 2).sum() / seen.sum())
    throw = lens_positions_mm(SIZE, PITCH_MM * SIZE[0])[0, 2]
    disc_px = 8.0 * 3.0 / (throw - 3.0) / PITCH_MM  # of an 8 mm pupil
    assert spread[1] - spread[0] == pytest.approx(disc_px**2 / 16, rel=0.01)  # its change across the disc


def test_light_defocused_beyond_the_frame_falls_on_the_sheet() -> None:
    lit = []
    for column in (72, 0):
        codes = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
        codes[40:56, column] = 255
        bench = bench_of(sheet_distance_mm=3.0)  # a disc of 2.7 px radius
        bench.place("white")
        bench.show(codes)
        lit.append(bench.capture().astype(float).sum())
    assert lit[1] == pytest.approx(lit[0], rel=0.04)  # keystone and distortion; half of it was lost at a closed rim


def test_tilt_brings_the_upper_edge_nearer() -> None:
    bench = bench_of(sheet_tilt_deg=(10.0, 0.0))
    Y = bench.view_XYZ(frame(255, 255, 255), "white")[..., 1]
    assert Y[12].mean() > 1.02 * Y[48].mean() > 1.02 * Y[84].mean()
    turned = bench_of(sheet_tilt_deg=(0.0, 10.0)).view_XYZ(frame(255, 255, 255), "white")[..., 1]
    assert turned[:, 12].mean() > turned[:, 130].mean()


def test_ambient_light_adds_the_same_whatever_is_shown() -> None:
    dark, lit = bench_of(), bench_of(ambient=0.05)
    for surface in ("white", "pattern"):
        added = [reading(lit, c, surface) - reading(dark, c, surface) for c in (frame(0, 0, 0), noise_frame())]
        np.testing.assert_allclose(added[1], added[0], rtol=1e-6)
        shown = [bench.view_XYZ(c, surface) for c in (frame(0, 0, 0), noise_frame()) for bench in (lit, dark)]
        np.testing.assert_allclose(shown[2] - shown[3], shown[0], atol=2e-5)  # float32, left-out directions
    expected = 0.05 * ambient_spectrum()[-81:] * colorant_library()["white"].reflectance
    np.testing.assert_allclose(reading(lit, frame(0, 0, 0), "white"), expected, rtol=1e-5)
    lit.show(frame(0, 0, 0))
    lit.place("white")
    picture = lit.capture() / 65535
    np.testing.assert_allclose(picture / picture[120, 160], 1.0, atol=2e-3)  # the margin included; 16-bit steps
    lit.show(frame(255, 255, 255))
    assert lit.capture().max() / 65535 == pytest.approx(0.8, abs=0.01)


def test_ambient_light_excites_what_fluoresces() -> None:
    plain, bright = (bench_of(ambient=0.1, brightener=b) for b in (False, True))
    added = reading(bright, frame(0, 0, 0), "white") - reading(plain, frame(0, 0, 0), "white")
    dye = brightener()
    taken = 0.1 * float(ambient_spectrum() @ dye.excitation) * 5
    np.testing.assert_allclose(added, taken * dye.emission, rtol=1e-5, atol=1e-9)  # float32


# --- channels --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("surface", ["pattern", "white"])
def test_four_channels_add(surface: str) -> None:
    bench = bench_of(channels=(*RGB, "white"), projector="rgbw")
    codes = noise_frame(4)
    parts = [reading(bench, codes * (np.arange(4) == j).astype(np.uint8), surface) for j in range(4)]
    np.testing.assert_allclose(sum(parts), reading(bench, codes, surface), rtol=READING)
    if surface == "white":
        one = reading(bench, frame(0, 0, 0, 255), "white")
        expected = primaries(("white",), "rgbw")[0] * colorant_library()["white"].reflectance
        np.testing.assert_allclose(one, expected, rtol=1e-6, atol=1e-9)  # float32


def test_spectra_change_with_the_level_as_measured() -> None:
    names = (*RGB, "white")
    plain, shifting = (
        bench_of(channels=names, projector="rgbw", responses=("rgbw",) * 4, level_spectra=on) for on in (False, True)
    )
    for level in (0, 255):  # measured spectra are those of full
        codes = frame(*(level,) * 4)
        np.testing.assert_allclose(reading(shifting, codes, "white"), reading(plain, codes, "white"), atol=1e-7)
    half = frame(0, 128, 0, 0)
    apart = reading(shifting, half, "white") - reading(plain, half, "white")
    x = plain.truth.response("green", 128 / 255)
    paper = colorant_library()["white"].reflectance
    added = shift_spectra(names)[1, -81:] * shift_of_level(np.array([[0], [x], [0], [0]], np.float32), names)[1, 0]
    np.testing.assert_allclose(apart, added * paper, atol=1e-6 * primaries(names, "rgbw").max())
    share = np.abs(apart).sum() / reading(plain, half, "white").sum()
    assert 0.1 < share < 0.4  # of green at a quarter of its light
    seen = shifting.view_XYZ(half, "white")[48, 72] - plain.view_XYZ(half, "white")[48, 72]
    expected = spectra_to_XYZ(apart) / spectra_to_XYZ(reading(plain, frame(255, 255, 255, 255), "white"))[1]
    np.testing.assert_allclose(seen, expected, atol=1e-4)  # float32, fall-off within the spot


@pytest.mark.parametrize("bits", [8, 10])
def test_codes_are_steps_of_the_response(bits: int) -> None:
    bench = bench_of(bits=bits, responses=("linear",) * 3)
    full = reading(bench, np.full((SIZE[1], SIZE[0], 3), 2**bits - 1, np.uint16), "white")
    for code in (1, 2, 2**bits // 2):
        step = reading(bench, np.full((SIZE[1], SIZE[0], 3), code, np.uint16), "white")
        np.testing.assert_allclose(step / full, code / (2**bits - 1), rtol=READING)


def test_each_channel_has_its_curve() -> None:
    bench = bench_of(responses=("power", "srgb", "rgbw"))
    truth = bench.truth
    assert truth.response("red", 0.5) == pytest.approx(0.5**2.2)
    assert truth.response("green", 0.5) == pytest.approx(0.2140, abs=1e-4)  # IEC 61966-2-1
    assert truth.response("blue", 0.25) == pytest.approx(0.1618, abs=1e-3)  # the measured table
    full, half = (reading(bench, frame(level, 0, 0), "white") for level in (255, 128))
    np.testing.assert_allclose(half / full, (128 / 255) ** 2.2, rtol=READING)


def test_blur_differs_by_channel() -> None:
    spot = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    spot[48, 72] = 255
    bench = bench_of(channel_blur=(1.0, 1.0, 2.0), camera_resolution=(640, 480))
    bench.place("white")
    spreads = []
    for name, level in (("red", (1, 0, 0)), ("blue", (0, 0, 1))):
        bench.show(spot * np.array(level, np.uint8))
        light = bench.capture(name).sum(axis=0).astype(float)
        x = np.arange(640)
        spreads.append((light * (x - (light * x).sum() / light.sum()) ** 2).sum() / light.sum())
    pitch = PITCH_MM / bench.truth.maps.camera_px_mm
    assert spreads[1] - spreads[0] == pytest.approx(3 * (0.36 * pitch) ** 2, rel=0.05)  # 16-bit tails


# --- fluorescence ----------------------------------------------------------------------------------------------------


def test_uv_ink_shines_under_uv_alone() -> None:
    pattern = pattern_of(("uv-green", "uv-green"))
    under_uv = reading(uv_bench(pattern), frame(255), "pattern")
    fluorescence = fluorescent_triad()["uv-green"]
    assert spectra_to_XYZ(under_uv)[1] > 20 * spectra_to_XYZ(reading(uv_bench(pattern), frame(255), "white"))[1]
    shape = under_uv[10:] / under_uv[10:].max()  # beyond the LED's own visible tail
    np.testing.assert_allclose(shape, fluorescence.emission[10:] / fluorescence.emission.max(), atol=1e-3)
    visible, plain = bench_of(pattern=pattern), bench_of(pattern=pattern_of(("white", "white")))
    full = frame(255, 255, 255)
    # The triad's excitation ends at 400 nm, where the DLP has 3e-5 of its power.
    np.testing.assert_allclose(reading(visible, full, "pattern"), reading(plain, full, "pattern"), rtol=2e-3)


def test_white_paper_gives_no_light_under_uv_unless_brightened() -> None:
    pattern = pattern_of(("uv-red", "uv-green", "uv-blue"))
    plain, bright = uv_bench(pattern), uv_bench(pattern, brightener=True)
    Y = [spectra_to_XYZ(reading(bench, frame(255), "white"))[1] for bench in (plain, bright)]
    inked = spectra_to_XYZ(reading(plain, frame(255), "pattern"))[1]
    assert Y[0] < 1e-3 * inked
    assert Y[1] > 100 * Y[0]


def test_emission_does_not_depend_on_where_in_the_dot_it_was_excited() -> None:
    pattern = pattern_of(("uv-green", "uv-green"), dot_mm=40.0)
    bench = uv_bench(pattern, replace(IDEAL, scattering_mm=0.06))
    values = []
    for row, column in ((40, 60), (48, 72), (55, 80)):  # all within the spot
        spot = np.zeros((SIZE[1], SIZE[0], 1), np.uint8)
        spot[row, column] = 255
        values.append(reading(bench, spot, "pattern")[30])
    np.testing.assert_allclose(values, values[1], rtol=0.03)  # a pixel's area: keystone and distortion


def test_reflected_and_emitted_light_add() -> None:
    pattern = pattern_of(("uv-red", "cyan", "black"))
    both = bench_of(pattern=pattern, channels=("blue", "uv"))
    codes = noise_frame(2)
    parts = [reading(both, codes * (np.arange(2) == j).astype(np.uint8), "pattern") for j in range(2)]
    np.testing.assert_allclose(sum(parts), reading(both, codes, "pattern"), rtol=READING)
    seen = both.view_XYZ(codes, "pattern")
    split = [both.view_XYZ(codes * (np.arange(2) == j).astype(np.uint8), "pattern") for j in range(2)]
    np.testing.assert_allclose(sum(split), seen, rtol=1e-4, atol=1e-5)  # float32, left-out directions


@pytest.mark.parametrize("scattering_mm", [0.0, 0.06, 0.2])
def test_meter_reads_the_mean_of_the_view_under_uv(scattering_mm: float) -> None:
    pattern = pattern_of(("uv-red", "uv-green", "black"))
    bench = uv_bench(pattern, replace(IDEAL, scattering_mm=scattering_mm))
    full = frame(255)
    view = bench.view_XYZ(full, "pattern").astype(float)
    rows, columns = np.indices(SIZE[::-1])
    spot = np.hypot(columns - (SIZE[0] - 1) / 2, rows - (SIZE[1] - 1) / 2) * PITCH_MM < 3.5
    seen, XYZ = view[spot].mean(axis=0), spectra_to_XYZ(reading(bench, full, "pattern"))
    np.testing.assert_allclose(seen / seen[1], XYZ / XYZ[1], rtol=0.02)  # the spot's rim cuts whole pixels
    # Per unit of the solid that shines brightest: a third of the area has green, a third red.
    assert 0.2 < seen[1] < 0.7


def test_scattered_emission_is_lost_under_black() -> None:
    beside_black, beside_paper = (
        uv_bench(pattern_of(("uv-green", other)), replace(IDEAL, scattering_mm=0.1)) for other in ("black", "white")
    )
    assert (
        spectra_to_XYZ(reading(beside_black, frame(255), "pattern"))[1]
        < 0.97 * spectra_to_XYZ(reading(beside_paper, frame(255), "pattern"))[1]
    )


# --- inks ------------------------------------------------------------------------------------------------------------


def test_an_ink_of_your_own() -> None:
    silver = Colorant("silver", np.full(81, 0.4), (0.0, 0.0, 0.0, 0.4))
    pattern = replace(pattern_of(("silver", "silver")), library=colorant_library() | {"silver": silver})
    bench = bench_of(pattern=pattern)
    expected = primaries(RGB).sum(axis=0) * 0.4
    np.testing.assert_allclose(reading(bench, frame(255, 255, 255), "pattern"), expected, rtol=1e-4)  # float32 ink
    seen = bench_of(pattern=pattern, second_surface="silver")
    np.testing.assert_allclose(reading(seen, frame(255, 255, 255), "white"), expected, rtol=1e-6)


def test_overprints_are_the_neugebauer_primaries() -> None:
    library = colorant_library()
    cyan, magenta, yellow, black, blue = (library[n].cmyk for n in ("cyan", "magenta", "yellow", "black", "blue"))
    np.testing.assert_array_equal(overprints([cyan, magenta])[0, 1], library["blue"].reflectance)
    np.testing.assert_array_equal(overprints([yellow, cyan])[0, 1], library["green"].reflectance)
    on_black = overprints([black, yellow])[0, 1]
    assert spectra_to_XYZ(on_black)[1] < spectra_to_XYZ(library["black"].reflectance)[1]  # L* 15.7 against 16
    for none in ([blue, cyan], [(0.5, 0.0, 0.0, 0.0), cyan], [library["white"].cmyk, cyan], [None, cyan], [cyan]):
        assert overprints(none) == {}
    three = overprints([cyan, None, magenta, yellow])
    assert list(three) == [(0, 2), (0, 3), (2, 3), (0, 2, 3)]
    assert spectra_to_XYZ(three[0, 2, 3])[1] < min(spectra_to_XYZ(three[pair])[1] for pair in list(three)[:3])
    assert (0, 1, 2) not in overprints([blue, magenta, yellow])  # blue and yellow are the three already


def test_overprints_change_overlaps_alone() -> None:
    inks = pattern_of(("cyan", "magenta", "yellow"))
    full = frame(255, 255, 255)
    apart = [reading(bench_of(pattern=inks, overprint=o), full, "pattern") for o in (False, True)]
    np.testing.assert_allclose(*apart, rtol=2e-3)  # coverage of 8 bits along common edges
    grown = replace(IDEAL, ink_spread_um=60.0)
    darker, measured = (bench_of(grown, pattern=inks, overprint=o) for o in (False, True))
    Y = [spectra_to_XYZ(reading(bench, full, "pattern"))[1] for bench in (darker, measured)]
    assert Y[1] < 0.97 * Y[0]  # red, green, blue are darker than either of their inks
    coverage = measured.truth.coverage()
    np.testing.assert_allclose(coverage.sum(axis=-1), 1.0, atol=1e-5)
    np.testing.assert_array_equal(coverage, darker.truth.coverage())


def test_where_three_inks_meet_all_three_are_seen() -> None:
    """Cells so much grown that every ink lies everywhere: the sheet is one solid of cyan, magenta and yellow."""
    grown = replace(IDEAL, ink_spread_um=1500.0)
    bench = bench_of(grown, pattern=pattern_of(("cyan", "magenta", "yellow")), overprint=True)
    inks = [colorant_library()[name].cmyk for name in ("cyan", "magenta", "yellow")]
    expected = primaries(RGB).sum(axis=0) * overprints(inks)[0, 1, 2]
    np.testing.assert_allclose(reading(bench, frame(255, 255, 255), "pattern"), expected, rtol=1e-4)  # float32 ink


# --- camera ----------------------------------------------------------------------------------------------------------


def test_exposure_is_a_factor() -> None:
    normal, half, over = (bench_of(exposure=factor) for factor in (1.0, 0.5, 2.0))
    pictures = []
    for bench in (normal, half, over):
        bench.place("white")
        bench.show(frame(255, 255, 255))
        pictures.append(bench.capture().astype(float))
    np.testing.assert_allclose(pictures[1], pictures[0] / 2, atol=1.0)  # rounding to 16 bits
    assert pictures[2].max() == 65535


def test_bayer_mosaic() -> None:
    three, raw, bilinear = (bench_of(bayer=kind) for kind in ("none", "raw", "demosaiced"))
    codes = frame(255, 180, 90)
    for bench in (three, raw, bilinear):
        bench.place("white")
        bench.show(codes)
    planes, sites, filled = three.capture(), raw.capture(), bilinear.capture()
    assert (sites.shape, filled.shape) == ((240, 320), (240, 320, 3))
    np.testing.assert_array_equal(sites[::2, ::2], planes[::2, ::2, 0])
    np.testing.assert_array_equal(sites[1::2, 1::2], planes[1::2, 1::2, 2])
    np.testing.assert_array_equal(sites[::2, 1::2], planes[::2, 1::2, 1])
    inner = (slice(40, 200), slice(40, 280))
    np.testing.assert_allclose(filled[inner], planes[inner].astype(float), atol=3.0)  # smooth light: 16-bit steps
    assert raw.capture("green").shape == bilinear.capture("green").shape == (240, 320)


# --- wrong use -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"second_surface": "velvet"}, "second_surface"),
        ({"sheet_distance_mm": -1.0}, "sheet_distance_mm"),
        ({"sheet_distance_mm": 51.0}, "sheet_distance_mm"),
        ({"sheet_tilt_deg": (0.0, 21.0)}, "sheet_tilt_deg"),
        ({"ambient": -0.1}, "ambient"),
        ({"projector": "lantern"}, "lantern"),
        ({"channels": (*RGB, "cyan")}, "cyan"),
        ({"responses": ("power",)}, "responses"),
        ({"channel_blur": (0.0, 1.0, 1.0)}, "channel_blur"),
        ({"sheet_distance_mm": 40.0}, "too near to the projector"),
        ({"ambient": 10.5}, "ambient"),
        ({"level_spectra": True}, "level_spectra"),
        ({"exposure": 0.0}, "exposure"),
        ({"exposure": float("nan")}, "exposure"),
        ({"bayer": "xtrans"}, "bayer"),
    ],
)
def test_an_impossible_option_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        bench_of(**change)


def test_a_camera_may_be_aimed_otherwise_and_truth_follows() -> None:
    """A lit spot lies where the truth of the posed camera says; 0.05 px: rounding of a few camera pixels' light."""
    pose = CameraPose(pan=(0.05, -0.03), zoom=0.8, roll_deg=4.0, slant=(0.1, -0.05))
    bench = bench_of(camera_pose=pose)
    row, column = SIZE[1] // 3, SIZE[0] // 4
    codes = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    bench.place("white")
    bench.show(codes)
    dark = bench.capture("green").astype(float)
    codes[row - 1 : row + 2, column - 1 : column + 2, 1] = 255
    bench.show(codes)
    light = bench.capture("green") - dark
    x, y = bench.truth.camera_xy("green")[row, column]
    y0, x0 = int(y) - 8, int(x) - 8
    light = light[y0 : y0 + 17, x0 : x0 + 17]
    rows, columns = np.mgrid[y0 : y0 + 17, x0 : x0 + 17]
    assert (light * columns).sum() / light.sum() == pytest.approx(x, abs=0.05)
    assert (light * rows).sum() / light.sum() == pytest.approx(y, abs=0.05)


def test_a_camera_that_sees_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="the camera must see some of the projection"):
        bench_of(camera_pose=CameraPose(pan=(1.5, 0.0)))
    with pytest.raises(InputError, match="zoom must be > 0"):
        CameraPose(zoom=0.0)
    with pytest.raises(InputError, match="slant must be"):
        CameraPose(slant=(0.5, 0.0))
