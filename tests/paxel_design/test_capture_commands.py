"""`paxel capture --device folder` and `paxel decode` as a person meets them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_runtime.captures.acquisition import plan_exposures
from paxel_runtime.installation import Installation
from paxel_runtime.storage import read_json
from paxel_runtime.structured_light import plan_gray_sequence

run = CliRunner()
SMALL = {"pattern.size_mm": [30, 20], "projector.resolution": [64, 40], "projector.width_mm": 9.4, "clusters.count": 2}


def _paxel(*words: object) -> tuple[int, str, str]:
    result = run.invoke(app, [str(word) for word in words])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def installation(tmp_path: Path) -> Path:
    path = tmp_path / "show"
    sets = [word for key, value in SMALL.items() for word in ("--set", f"{key}={json.dumps(value)}")]
    assert _paxel("new", path, *sets)[0] == 0
    assert _paxel("pattern", path)[0] == 0
    return path


def test_capture_by_folder_writes_frames_and_says_what_to_do(installation: Path) -> None:
    code, out, err = _paxel("capture", installation, "--device", "folder", "--timeout", "0.1")
    assert code == 1
    assert out == ""
    plan = plan_exposures(Installation.open(installation))
    geometry = [e for e in plan if e.device == "camera" and not e.clusters and not e.mask]
    assert sum(bool(e.light) for e in geometry) == 2 + 2 * (5 + 5) + 16 + 2 * 16  # green in full, of others the lines
    pictures = sum(e.device == "camera" for e in plan)
    told = f"{pictures} pictures ({len(geometry)} for the geometry, then {pictures - len(geometry)})"
    assert f"capturing {told} and {len(plan) - pictures} readings" in err
    assert "photographs of the printed pattern to take, of frames 0001 to " in err
    assert "nothing came for 0.1 s; still waiting for a photograph of frame 0001-pattern-light-green-white.png" in err
    assert "run the same command to go on" in err
    frames = sorted(path.name for path in (installation / "captures" / "frames").iterdir())
    assert len(frames) == len(geometry)
    record = read_json(installation / "captures" / "exposures.json")
    assert record["device"] == "folder"
    assert record["frames"][: len(frames)] == frames
    assert len(record["frames"]) == len(record["exposures"])


def test_a_folder_session_goes_on_without_its_flag(installation: Path) -> None:
    _paxel("capture", installation, "--device", "folder", "--timeout", "0.1")
    marker = installation / "captures" / "frames" / "0001-pattern-light-green-white.png"
    made = marker.stat().st_mtime_ns
    code, _, err = _paxel("capture", installation, "--timeout", "0.1")
    assert code == 1
    assert "still waiting for a photograph of frame 0001" in err
    assert marker.stat().st_mtime_ns == made
    assert not (installation / "captures-1").exists()


def test_capture_refuses_what_it_does_not_know(installation: Path) -> None:
    code, _, err = _paxel("capture", installation, "--device", "polaroid")
    assert code == 2
    assert "--device must be virtual or folder, got 'polaroid'" in err
    assert _paxel("capture", installation, "--device", "folder", "--timeout", "-1")[0] == 2
    assert not (installation / "captures").exists()


def test_the_setting_names_the_device_too(installation: Path) -> None:
    toml = installation / "paxel.toml"
    toml.write_text(toml.read_text().replace('kind = "virtual"', 'kind = "folder"'))
    code, _, err = _paxel("capture", installation, "--timeout", "0.1")
    assert code == 1
    assert "still waiting for a photograph" in err


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Captures of a plain wall, two camera pixels a projector pixel, nothing beside the frame."""
    folder = tmp_path_factory.mktemp("foreign")
    noise = np.random.default_rng(0)
    for i, frame in enumerate(plan_gray_sequence(40, 24)):
        light = gaussian_filter(frame.pixels(40, 24).repeat(2, axis=0).repeat(2, axis=1).astype(float), 0.8)
        level = 6.0 + 180.0 * light + noise.normal(0.0, 1.0, light.shape)
        Image.fromarray(np.rint(level).astype(np.uint8)).save(folder / f"pattern_{i:02d}.png")
    return folder


def test_decode_writes_camera_size_arrays_and_figures(foreign: Path, tmp_path: Path) -> None:
    out_file = tmp_path / "decoded.npz"
    words = ("decode", foreign, "--scheme", "opencv-gray", "--projector", "40x24", "--out", out_file, "--json")
    code, out, _ = _paxel(*words)
    assert code == 0
    figures = json.loads(out)
    assert figures["camera"] == [80, 48]
    assert figures["projector"] == [40, 24]
    assert figures["captures"] == 24
    with np.load(out_file) as data:
        arrays: dict[str, NDArray[np.generic]] = {name: data[name] for name in ("column", "row", "confidence")}
    assert all(a.shape == (48, 80) and a.dtype == np.float32 for a in arrays.values())
    known = np.isfinite(arrays["column"])
    assert np.array_equal(known, np.isfinite(arrays["row"]))
    assert np.mean(known) == figures["decoded"] > 0.95
    assert np.all(arrays["confidence"][~known] == 0)
    y, x = np.indices((48, 80))
    # pixel 0 of the projector covers camera pixels 0 and 1: its centre lies at 0.5
    inner = np.s_[6:-6, 6:-6]
    for name, truth in (("column", (x - 0.5) / 2), ("row", (y - 0.5) / 2)):
        error = np.abs(arrays[name] - truth)[inner]
        assert np.nanpercentile(error, 95) < 0.25  # half of a camera pixel's width


def test_decode_refuses_before_it_writes(foreign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for words, text in (
        (("--projector", "40"), "--projector must be WIDTHxHEIGHT in pixels, such as 1024x768; got '40'"),
        (("--projector", "40x24", "--scheme", "x"), "--scheme must be one of opencv-gray, got 'x'"),
        (("--projector", "40x24", "--out", "d.png"), "--out must end in .npz"),
        (("--projector", "40x24", "--out", "none/d.npz"), "there is no folder"),
    ):
        code, _, err = _paxel("decode", foreign, *words)
        assert code == 2, words
        assert text in err
    code, _, err = _paxel("decode", foreign, "--projector", "80x24")
    assert code == 1
    assert "a projector of 80 x 24 pixels needs 26 captures, got 24" in err
    assert list(tmp_path.iterdir()) == []


def test_decode_says_that_a_picture_is_mirrored(foreign: Path, tmp_path: Path) -> None:
    for path in foreign.iterdir():
        Image.open(path).transpose(Image.Transpose.FLIP_LEFT_RIGHT).save(tmp_path / path.name)
    code, out, err = _paxel("decode", tmp_path, "--projector", "40x24", "--out", tmp_path / "d.npz", "--json")
    assert code == 0
    assert json.loads(out)["mirrored"]
    assert "seen mirrored" in err
