"""The command line: exit codes, JSON on standard output, messages on standard error, no file touched on a mistake."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_runtime.model.effects import EFFECTS
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import PRESETS, load_settings
from paxel_runtime.storage import model_to_dict, write_json

run = CliRunner()


def _paxel(*words: object) -> tuple[int, str, str]:
    result = run.invoke(app, [str(word) for word in words])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def test_help_answers_within_a_second_of_work() -> None:
    program = "import sys; sys.argv = ['paxel', '--help']; from paxel_design.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", program], capture_output=True, text=True, check=True
    )
    assert "paxel demo my-show" in done.stdout
    # wall time would depend on the machine; what must not be loaded does not
    for heavy in ("numba", "scipy", "skimage", "trimesh", "reportlab", "pydantic"):
        assert f" {heavy}\n" not in done.stderr, heavy
    assert len(done.stderr.splitlines()) < 600  # modules; the libraries above load a thousand and more


@pytest.mark.parametrize("command", [c.callback.__name__ for c in app.registered_commands if c.callback])
def test_every_command_has_help_that_teaches(command: str) -> None:
    code, out, _ = _paxel(command, "--help")
    assert code == 0
    assert len(out.splitlines()) > 5


def test_help_names_every_preset_and_effect() -> None:
    def words(command: str) -> str:
        return "".join(_paxel(command, "--help")[1].split())  # a name may be broken at the end of a line

    assert all(preset in words("new") for preset in PRESETS)
    for command in ("gamut", "project"):
        told = words(command)
        assert all(key in told for key in EFFECTS)


def test_new_writes_a_file_that_loads_and_never_overwrites_one(tmp_path: Path) -> None:
    folder = tmp_path / "show"
    code, out, err = _paxel("new", folder, "--set", "pattern.dot_size_mm=0.5", "--set", "bench.quality=ideal", "--json")
    assert code == 0, err
    assert json.loads(out)["settings"]["pattern.dot_size_mm"] == 0.5
    assert load_settings(folder / "paxel.toml").bench.quality == "ideal"
    before = (folder / "paxel.toml").read_bytes()
    code, _, err = _paxel("new", folder)
    assert code == 2
    assert "exists already" in err
    assert (folder / "paxel.toml").read_bytes() == before


def test_what_the_system_refuses_is_told_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("a file", encoding="utf-8")
    code, _, err = _paxel("new", tmp_path / "notes")
    assert code == 2
    assert "is a file, and an installation is a folder" in err
    code, _, err = _paxel("new", tmp_path / "notes" / "show")
    assert code == 1
    assert str(tmp_path / "notes") in err.replace("\n", "")
    assert "run the same command again" in err


def test_new_leaves_what_else_is_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "picture.jpg").write_bytes(b"mine")
    assert _paxel("new", tmp_path)[0] == 0
    assert (tmp_path / "picture.jpg").read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--set", "pattern.dot_size_mm=-1"], "pattern.dot_size_mm must be > 0, got -1"),
        (["--set", "pattern.dot_size_mm"], "--set must be KEY=VALUE"),
        (["--preset", "none"], "--preset must be one of bw-checkerboard"),
    ],
)
def test_a_mistake_in_new_writes_nothing(words: list[str], message: str, tmp_path: Path) -> None:
    code, out, err = _paxel("new", tmp_path / "show", *words)
    assert code == 2
    assert message in err
    assert not out
    assert not (tmp_path / "show").exists()


@pytest.mark.parametrize("command", ["pattern", "capture", "calibrate", "gamut", "project", "preview", "status"])
def test_a_broken_toml_is_answered_by_every_command_and_nothing_is_written(command: str, tmp_path: Path) -> None:
    _paxel("new", tmp_path / "show")
    toml = tmp_path / "show" / "paxel.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace("= 0.75", "= -0.5"), encoding="utf-8")
    code, out, err = _paxel(command, tmp_path / "show")
    assert code == 2
    assert "paxel.toml: pattern.dot_size_mm must be > 0, got -0.5 (line 6)" in err
    assert not out
    assert [p.name for p in (tmp_path / "show").iterdir()] == ["paxel.toml"]


def test_a_stage_before_its_time_names_the_command_to_run(tmp_path: Path) -> None:
    _paxel("new", tmp_path)
    code, _, err = _paxel("calibrate", tmp_path)
    assert code == 1
    assert f"run: paxel pattern {tmp_path}" in err.replace("\n", " ")


def test_pattern_makes_the_sheet_once(tmp_path: Path) -> None:
    _paxel("new", tmp_path, "--set", "pattern.size_mm=[60, 40]")
    code, out, _ = _paxel("pattern", tmp_path, "--json")
    assert code == 0
    assert json.loads(out)["dot_size_mm"] == 0.75
    assert {p.name for p in (tmp_path / "print").iterdir()} == {
        "cells.png", "pattern.json", "pattern.pdf", "preview.png", "print-sheet.txt", "visibility.json",
    }  # fmt: skip
    made = (tmp_path / "print" / "pattern.pdf").stat().st_mtime_ns
    code, again, err = _paxel("pattern", tmp_path, "--json")
    assert "up to date; nothing to do" in err
    assert json.loads(again)["cells"] == json.loads(out)["cells"]
    assert (tmp_path / "print" / "pattern.pdf").stat().st_mtime_ns == made
    states = json.loads(_paxel("status", tmp_path, "--json")[1])
    assert states["stages"][0]["state"] == "done"
    assert states["next"] == f"paxel capture {tmp_path}"


def test_the_library_of_colorants_can_be_listed() -> None:
    code, out, _ = _paxel("pattern", "--list-colorants", "--json")
    assert code == 0
    colorants = json.loads(out)
    assert colorants["white"]["XYZ"][1] == 1.0
    assert colorants["black"]["cmyk"] == [0, 0, 0, 1]
    code, _, err = _paxel("pattern")
    assert code == 2
    assert "give the installation's folder" in err


def test_gamut_of_a_foreign_model_needs_no_installation(
    tmp_path: Path, bw_model: Callable[[int], PredictionModel]
) -> None:
    write_json(tmp_path / "theirs.json", model_to_dict(bw_model(2)))
    code, out, err = _paxel("gamut", "--model", tmp_path / "theirs.json", "--json")
    assert code == 0, err
    result = json.loads(out)
    assert set(result) == {
        "lightness.json", "full.on-pattern.json", "full.on-white.json", "dual-image.on-pattern.json",
        "dual-image.on-white.json", "neutralize-50_0_0.on-pattern.json",
    }  # fmt: skip
    assert [p.name for p in tmp_path.iterdir()] == ["theirs.json"]
    code, out, _ = _paxel(
        "gamut", "--model", tmp_path / "theirs.json", "--effect", "full", "--out", tmp_path / "g", "--json"
    )
    assert json.loads(out)["effect"] == "full"
    assert {p.suffix for p in (tmp_path / "g").iterdir()} == {".json", ".npz", ".ply", ".glb", ".gam"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["gamut"], "give a folder, or --model FILE"),
        (["gamut", "--model", "none.json"], "no model file none.json"),
        (["gamut", "--model", "none.json", "--effect", "fulll"], "effect must be one of"),
        (["project", ".", "--effect", "dual-image"], "there is no paxel.toml here"),
    ],
)
def test_usage_mistakes_are_told_in_one_line(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = _paxel(*words)
    assert code == 2
    assert message in err.replace("\n", " ")
    assert not out
