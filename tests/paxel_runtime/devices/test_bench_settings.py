"""What paxel.toml says of the bench reaches it, its rules are the bench's own; any number of channels is captured."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from PIL import Image

from paxel_design.patterns import make_pattern
from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.devices.bench_setup import BAYER
from paxel_runtime.devices.bench_spectra import read_projector_spectra
from paxel_runtime.devices.virtual import BenchSetup
from paxel_runtime.errors import InputError, SettingsError
from paxel_runtime.frame_files import read_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.effects import Full
from paxel_runtime.model.fluorescence import EXCITATION_NM
from paxel_runtime.optics.geometry import CameraPose
from paxel_runtime.optics.spectra import PROJECTORS, RESPONSES, excitation_spectra, primaries
from paxel_runtime.settings import BENCH_CHANNELS, PRESETS, SPECTRA, Response, make_settings
from paxel_runtime.stages import calibrate, open_bench, open_devices, preview, project
from paxel_runtime.storage import read_npz, read_tiff

SMALL: dict[str, Any] = {
    "pattern.size_mm": [60.0, 40.0],
    "projector.resolution": [96, 64],
    "projector.width_mm": 14.06,
    "camera.resolution": [256, 192],
    "meter.aperture_mm": 7.0,
    "clusters.count": 2,
}
RGBW = ["red", "green", "blue", "white"]


def installation_of(folder: Path, **changes: Any) -> Installation:
    overrides = SMALL | {key.replace("__", "."): value for key, value in changes.items()}
    installation = Installation.create(folder, make_settings(overrides=overrides))
    make_print(installation)
    return installation


def setup_of(**changes: Any) -> BenchSetup:
    base: dict[str, Any] = {
        "pattern": make_pattern("checkerboard", ("black", "white"), 0.75, 30.0, (60.0, 40.0)),
        "resolution": (96, 64),
        "width_mm": 281.0,
        "channels": ("red", "green", "blue"),
        "bits": 8,
        "camera_resolution": (256, 192),
        "camera_bits": 14,
        "aperture_mm": 7.0,
        "quality": "ideal",
        "seed": 0,
    }
    return BenchSetup(**base | changes)


# --- every key reaches the bench -------------------------------------------------------------------------------------


KEYS: list[tuple[str, Any, str, Any]] = [
    ("bench__seed", 3, "seed", 3),
    ("bench__white_sheet", "uncoated", "second_surface", "uncoated"),
    ("model__second_surface", "gray", "second_surface", "gray"),
    ("bench__sheet_distance_mm", 12.0, "sheet_distance_mm", 12.0),
    ("bench__sheet_tilt_deg", [5.0, -3.0], "sheet_tilt_deg", (5.0, -3.0)),
    ("bench__ambient", 0.02, "ambient", 0.02),
    ("bench__brightener", True, "brightener", True),
    ("bench__overprint", True, "overprint", True),
    ("bench__channel_blur", [1.0, 1.0, 1.5], "channel_blur", (1.0, 1.0, 1.5)),
    ("bench__exposure", 0.5, "exposure", 0.5),
    ("bench__bayer", "demosaiced", "bayer", "demosaiced"),
    ("bench__camera_pan", [0.05, 0.0], "camera_pose", CameraPose(pan=(0.05, 0.0))),
    ("bench__camera_zoom", 0.9, "camera_pose", CameraPose(zoom=0.9)),
    ("bench__camera_roll_deg", 2.0, "camera_pose", CameraPose(roll_deg=2.0)),
    ("bench__camera_slant", [0.1, 0.0], "camera_pose", CameraPose(slant=(0.1, 0.0))),
    ("projector__channels", ["green", "uv"], "channels", ("green", "uv")),
    ("projector__bits", 10, "bits", 10),
    ("projector__spectra", "rgbw", "projector", "rgbw"),
    ("projector__responses", ["linear", "srgb", "power"], "responses", ("linear", "srgb", "power")),
]


@pytest.mark.parametrize(("key", "value", "field", "expected"), KEYS)
def test_a_key_reaches_the_bench(
    key: str, value: Any, field: str, expected: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[BenchSetup] = []
    monkeypatch.setattr("paxel_runtime.stages.devices.VirtualBench", seen.append)
    monkeypatch.setattr("paxel_runtime.stages.devices.load_pattern", lambda _: setup_of().pattern)
    default, changed = (make_settings(overrides=SMALL | extra) for extra in ({}, {key.replace("__", "."): value}))
    for settings in (default, changed):
        open_bench(Installation(tmp_path, settings))
    assert getattr(seen[1], field) == expected
    assert getattr(seen[0], field) != expected


def test_a_bench_with_every_option_answers(tmp_path: Path) -> None:
    bench = open_bench(
        installation_of(
            tmp_path,
            projector__channels=RGBW,
            projector__spectra="rgbw",
            projector__bits=10,
            bench__level_spectra=True,
            bench__sheet_distance_mm=2.0,
            bench__ambient=0.05,
            bench__brightener=True,
            bench__bayer="raw",
            bench__camera_roll_deg=2.0,
        )
    )
    bench.show(np.full((64, 96, 4), 1023, np.uint16))
    for surface in ("pattern", "white"):
        bench.place(surface)
        assert bench.capture().shape == (192, 256)
        assert bench.measure().min() > 0


# --- the rules are the bench's own -----------------------------------------------------------------------------------


def test_names_are_those_of_the_bench() -> None:
    assert SPECTRA == PROJECTORS
    assert get_args(Response) == RESPONSES
    for projector in PROJECTORS:
        assert primaries(BENCH_CHANNELS, projector).shape == (len(BENCH_CHANNELS), 81)
        with pytest.raises(InputError):
            primaries((*BENCH_CHANNELS, "cyan"), projector)
    for kind in BAYER:
        make_settings(overrides={"bench.bayer": kind})


@pytest.mark.parametrize(
    ("key", "field", "good", "bad"),
    [
        ("bench.sheet_distance_mm", "sheet_distance_mm", (0.0, 50.0), (-0.1, 50.1)),
        ("bench.sheet_tilt_deg", "sheet_tilt_deg", ((20.0, -20.0),), ((20.1, 0.0), (0.0, -20.1))),
        ("bench.ambient", "ambient", (0.0, 10.0), (-0.01, 10.1)),
        ("bench.channel_blur", "channel_blur", ((0.1, 1.0, 10.0),), ((0.05, 1.0, 1.0), (1.0, 1.0, 11.0), (1.0,))),
        ("bench.exposure", "exposure", (0.001, 100.0), (0.0, 101.0)),
        ("bench.bayer", "bayer", ("raw",), ("xtrans",)),
        ("bench.white_sheet", "second_surface", ("uncoated", "yellow"), ("velvet",)),
        ("projector.responses", "responses", (("power", "srgb", "rgbw"),), (("power",), ("gamma",) * 3)),
        ("projector.channels", "channels", (("white",), tuple(RGBW)), ((), ("red", "red"), ("cyan",))),
        ("projector.spectra", "projector", ("rgbw",), ("lantern",)),
        ("bench.level_spectra", "level_spectra", (False,), (True,)),
    ],
)
def test_a_value_is_good_for_the_file_and_the_bench_or_for_neither(
    key: str, field: str, good: tuple[Any, ...], bad: tuple[Any, ...]
) -> None:
    for value in good:
        make_settings(overrides={key: value})
        setup_of(**{field: value})
    for value in bad:
        with pytest.raises(SettingsError, match=key.replace(".", r"\.")):
            make_settings(overrides={key: value})
        with pytest.raises(InputError):
            setup_of(**{field: value})


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"projector.channels": ["a", "b", "c", "d", "e"], "projector.spectra": "my.csv"}, "one to four"),
        ({"projector.channels": ["Rot 1"], "projector.spectra": "my.csv"}, "letters, digits"),
        ({"projector.bits": 9}, r"projector\.bits must be 8 or 10"),
        ({"bench.camera_zoom": 0.0}, r"bench\.camera_zoom must be > 0"),
        ({"bench.camera_slant": [0.31, 0.0]}, r"bench\.camera_slant\[0\] must be <= 0.3"),
        ({"bench.white_sheet": "yellow", "model.second_surface": "gray"}, "white_sheet must be"),
    ],
)
def test_what_cannot_stand_on_a_bench_is_named(overrides: dict[str, Any], words: str) -> None:
    with pytest.raises(SettingsError, match=words):
        make_settings(overrides=overrides)


# --- spectra of one's own --------------------------------------------------------------------------------------------


def write_spectra(path: Path, scale: float, shift_nm: float = 0.0) -> None:
    nm = np.arange(340, 781, 4)
    columns = [np.exp(-0.5 * ((nm - peak - shift_nm) / 12.0) ** 2) for peak in (630, 530, 460)]
    rows = ["wavelength_nm,R,G,B"]
    rows += [",".join(f"{v:.6g}" for v in (w, *(scale * c for c in row))) for w, *row in zip(nm, *columns, strict=True)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def test_spectra_of_a_file_have_one_scale(tmp_path: Path) -> None:
    found = []
    for scale in (1.0, 250.0):
        write_spectra(tmp_path / "mine.csv", scale)
        found.append(read_projector_spectra(tmp_path / "mine.csv", ("B", "G", "R")))
    for name in ("R", "G", "B"):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-5, atol=1e-12)  # six digits in the file
    lights = np.array([found[0][name] for name in ("B", "G", "R")])
    assert spectra_to_XYZ(lights.sum(axis=0)[-81:])[1] == pytest.approx(1.0)
    assert [WAVELENGTHS_NM[light[-81:].argmax()] for light in lights] == [460, 530, 630]
    np.testing.assert_array_equal(excitation_spectra(("G",), "dlp", found[0])[0], found[0]["G"])


def test_a_lamp_that_no_eye_sees_has_the_power_of_white(tmp_path: Path) -> None:
    nm = np.arange(300, 421, 2)
    rows = [f"{w},{np.exp(-0.5 * ((w - 370) / 5) ** 2):.6g}" for w in nm]
    (tmp_path / "uv.csv").write_text("nm,lamp\n" + "\n".join(rows), encoding="utf-8")
    lamp = read_projector_spectra(tmp_path / "uv.csv", ("lamp",))["lamp"]
    assert lamp.sum() == pytest.approx(primaries(("white",)).sum())
    assert EXCITATION_NM[lamp.argmax()] == 370


def test_wrong_spectra_are_named(tmp_path: Path) -> None:
    write_spectra(tmp_path / "mine.csv", 1.0)
    with pytest.raises(InputError, match="it has R, G, B, and lacks red"):
        read_projector_spectra(tmp_path / "mine.csv", ("red", "G"))
    write_spectra(tmp_path / "mine.csv", -1.0)
    with pytest.raises(InputError, match="R must be >= 0"):
        read_projector_spectra(tmp_path / "mine.csv", ("R",))
    with pytest.raises(InputError, match=r"projector\.spectra: there is no file"):
        read_projector_spectra(tmp_path / "none.csv", ("R",))


def test_a_projector_of_one_s_own_stands_on_the_bench_and_its_file_is_watched(tmp_path: Path) -> None:
    installation = installation_of(
        tmp_path, projector__channels=["R", "B"], projector__spectra="mine.csv", bench__quality="ideal"
    )
    write_spectra(tmp_path / "mine.csv", 3.0)
    bench = open_bench(installation)
    bench.place("paper")
    bench.show(np.full((64, 96, 2), (255, 0), np.uint8))
    expected = read_projector_spectra(tmp_path / "mine.csv", ("R", "B"))["R"][-81:]
    reading = bench.measure() / bench._setup.library["white"].reflectance  # what the paper takes away
    np.testing.assert_allclose(reading, expected, rtol=1e-4, atol=1e-7)
    before = installation.inputs("captures")["files"]["mine.csv"]
    write_spectra(tmp_path / "mine.csv", 3.0, shift_nm=5.0)
    assert installation.inputs("captures")["files"]["mine.csv"] != before


# --- captures with any number of channels ----------------------------------------------------------------------------


def check_captures(installation: Installation) -> None:
    """The geometry is the bench's, and each channel is captured as one plane."""
    folder, truth = installation.folder("captures"), open_bench(installation).truth
    tables = read_npz(folder / "registration.npz")
    for name in installation.settings.projector.channels:
        apart = np.linalg.norm(tables[f"camera_xy_{name}"] - truth.camera_xy(name), axis=-1)
        assert np.sqrt(np.mean(apart[8:-8, 8:-8] ** 2)) < 0.1  # a picture of 256 px: not the figures of issue 5
        assert read_tiff(folder / f"white-full-{name}.tif").shape == (192, 256)


def test_one_channel_is_captured_and_sorted(tmp_path: Path) -> None:
    installation = installation_of(tmp_path, projector__channels=["white"], projector__bits=10)
    facts = capture(installation, open_devices(installation), lambda *_: None)
    assert facts["clusters"]["2"]["names"] == ["black", "white"]
    check_captures(installation)


@pytest.mark.slow
def test_ten_bits_and_four_channels_go_all_the_way(tmp_path: Path) -> None:
    installation = installation_of(
        tmp_path,
        projector__channels=RGBW,
        projector__spectra="rgbw",
        projector__bits=10,
        model__correction="off",
        bench__quality="ideal",
    )
    capture(installation, open_devices(installation), lambda *_: None)
    check_captures(installation)
    accuracy = calibrate(installation)
    assert accuracy["pattern"]["dE00_mean"] < 0.1  # an ideal bench is linear: what is left are codes and the ramps
    make_gamut(installation, Full(), "pattern")
    picture = np.random.default_rng(0).integers(0, 256, (4, 6, 3), np.uint8).repeat(16, axis=0).repeat(16, axis=1)
    Image.fromarray(picture).save(tmp_path / "picture.png")
    record = project(installation, Full(), {"image": tmp_path / "picture.png"})
    assert record["pixels_in_gamut"] == 1.0
    codes = read_frame(tmp_path / "projection" / "full.png", 10)
    assert codes.shape == (64, 96, 4)
    assert codes.max() > 255
    seen = preview(installation, "full", open_bench(installation))["on_pattern"]
    assert seen["dE00_mean"] < 4  # a picture of 24 squares at the distance at which their edges are an eye's blur wide


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_stands_on_the_bench_and_shines(preset: str, tmp_path: Path) -> None:
    settings = make_settings(preset, {key: value for key, value in SMALL.items() if key != "clusters.count"})
    installation = Installation.create(tmp_path, settings)
    make_print(installation)
    bench = open_bench(installation)
    N = len(settings.projector.channels)
    full, dark = (bench.view_XYZ(np.full((64, 96, N), level, np.uint8), "pattern") for level in (255, 0))
    assert full[..., 1].mean() > 100 * dark[..., 1].mean()
    assert 0.1 < full[..., 1].mean() < 0.8  # of full white, or of the brightest solid where the lamp is no light
