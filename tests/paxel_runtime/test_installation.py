"""The folder of an installation: what is stale, and that nothing half-made ever stands in it."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from paxel_runtime.errors import InstallationError
from paxel_runtime.installation import STAGES, Installation
from paxel_runtime.settings import make_settings, settings_to_toml
from paxel_runtime.storage import write_json

RECORDS = {
    "print": ["pattern.json"],
    "captures": ["exposures.json", "complete.json"],
    "calibration": ["calibration.json", "model.json", "clusters.png"],
    "gamut": ["full.on-pattern.json"],
    "projection": ["dual-image.json", "dual-image.png"],
    "preview": ["dual-image.json"],
    "report": ["report.json"],
}


@pytest.fixture
def fill(tmp_path: Path) -> Callable[..., Installation]:
    """Write stand-ins for the stages' files: only hashes and settings matter to staleness."""

    def run(until: str = "preview", **overrides: object) -> Installation:
        toml = tmp_path / "paxel.toml"
        toml.write_text(settings_to_toml(make_settings(overrides=overrides)), encoding="utf-8")
        installation = Installation.open(tmp_path)
        for stage in STAGES:
            folder = installation.folder(stage.name)
            folder.mkdir(exist_ok=True)
            for name in RECORDS[stage.name]:
                stem = "dual-image" if stage.name == "preview" else ""
                write_json(folder / name, {"inputs": installation.inputs(stage.name, stem=stem), "content": name})
            if stage.name == until:
                break
        return installation

    return run


def _states(path: Path) -> dict[str, str]:
    return {s.stage.name: s.state for s in Installation.open(path).status()}


def _set(path: Path, key: str, value: object) -> None:
    toml = path / "paxel.toml"
    toml.write_text(settings_to_toml(make_settings(overrides={key: value})), encoding="utf-8")


def test_everything_is_done_when_nothing_changed(fill: Callable[..., Installation]) -> None:
    installation = fill()
    assert set(_states(installation.path).values()) == {"done"}


def test_an_empty_folder_says_what_is_missing(fill: Callable[..., Installation]) -> None:
    installation = fill(until="print")
    states = _states(installation.path)
    assert states["print"] == "done"
    assert {states[name] for name in list(states)[1:]} == {"missing"}


@pytest.mark.parametrize(
    ("key", "value", "first_stale"),
    [
        ("pattern.dot_size_mm", 0.5, "print"),
        ("printer.dpi", 720, "print"),
        ("projector.width_mm", 100.0, "captures"),
        ("clusters.count", 2, "captures"),
        ("bench.quality", "harsh", "captures"),
        ("mapping.chroma", "clip", "projection"),
        ("viewing.distance_mm", 3000.0, "projection"),
    ],
)
def test_a_changed_key_makes_its_stage_and_all_after_it_stale(
    key: str, value: object, first_stale: str, fill: Callable[..., Installation]
) -> None:
    installation = fill()
    _set(installation.path, key, value)
    states = _states(installation.path)
    names = list(states)
    # projection does not read the gamut folder's files but the model, so gamut alone may stay done before it
    after = [n for n in names[names.index(first_stale) :] if not (first_stale == "projection" and n == "gamut")]
    assert all(states[name] == "stale" for name in after), states
    assert all(states[name] == "done" for name in names[: names.index(first_stale)]), states
    reason = next(s for s in Installation.open(installation.path).status() if s.stage.name == first_stale).reasons
    assert any(key in text for text in reason)


@pytest.mark.parametrize(
    ("lost", "first_not_done"),
    [
        ("print/pattern.json", "print"),
        ("captures/exposures.json", "captures"),
        ("captures/complete.json", "captures"),
        ("calibration/calibration.json", "calibration"),
        ("calibration/model.json", "gamut"),
        ("calibration/clusters.png", "projection"),
        ("projection/dual-image.png", "preview"),
    ],
)
def test_a_lost_file_is_told_and_never_breaks_the_status(
    lost: str, first_not_done: str, fill: Callable[..., Installation]
) -> None:
    installation = fill()
    (installation.path / lost).unlink()
    states = _states(installation.path)
    assert next(name for name, state in states.items() if state != "done") == first_not_done
    assert states["preview"] != "done"


def test_a_report_is_optional_and_stale_when_anything_it_may_tell_changes(fill: Callable[..., Installation]) -> None:
    assert "report" not in _states(fill().path)  # never made: nobody is told to
    installation = fill(until="report")
    assert _states(installation.path)["report"] == "done"
    further = installation.folder("gamut") / "further.json"
    write_json(further, {"inputs": installation.inputs("gamut")})
    assert _states(installation.path)["report"] == "stale"
    further.unlink()
    assert _states(installation.path)["report"] == "done"
    (installation.folder("preview") / "dual-image.json").unlink()
    assert _states(installation.path)["report"] == "stale"
    for stage in ("gamut", "projection", "preview"):  # it tells what there is
        for file in installation.folder(stage).iterdir():
            file.unlink()
    write_json(installation.folder("report") / "report.json", {"inputs": installation.inputs("report")})
    assert _states(installation.path)["report"] == "done"
    _set(installation.path, "viewing.distance_mm", 3000.0)
    assert _states(installation.path)["report"] == "stale"


def test_require_names_the_stage_the_reason_and_the_command(fill: Callable[..., Installation]) -> None:
    installation = fill()
    _set(installation.path, "pattern.dot_size_mm", 0.5)
    with pytest.raises(InstallationError, match=r"pattern\.dot_size_mm was 0\.75, is 0\.5.*run: paxel pattern"):
        Installation.open(installation.path).require("calibration")


def test_a_finished_block_replaces_the_folder_as_a_whole(fill: Callable[..., Installation]) -> None:
    installation = fill()
    (installation.folder("gamut") / "old.json").write_text("{}", encoding="utf-8")
    with installation.writing("gamut") as folder:
        (folder / "new.json").write_text("{}", encoding="utf-8")
    assert [p.name for p in installation.folder("gamut").iterdir()] == ["new.json"]


def test_keep_starts_with_what_is_there_and_never_changes_it_in_place(fill: Callable[..., Installation]) -> None:
    installation = fill()
    before = (installation.folder("gamut") / "full.on-pattern.json").read_bytes()
    with pytest.raises(RuntimeError), installation.writing("gamut", keep=True) as folder:
        write_json(folder / "full.on-pattern.json", {"new": True})
        raise RuntimeError
    assert (installation.folder("gamut") / "full.on-pattern.json").read_bytes() == before


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_block_leaves_the_folder_as_it_was(
    error: type[BaseException], fill: Callable[..., Installation]
) -> None:
    installation = fill()
    before = {p: p.read_bytes() for p in sorted(installation.path.rglob("*")) if p.is_file()}
    with pytest.raises(error), installation.writing("calibration") as folder:
        (folder / "half.json").write_text("{", encoding="utf-8")
        raise error
    assert {p: p.read_bytes() for p in sorted(installation.path.rglob("*")) if p.is_file()} == before


def test_a_killed_block_leaves_the_folder_as_it_was(fill: Callable[..., Installation]) -> None:
    installation = fill()
    before = {p.name: p.read_bytes() for p in installation.folder("calibration").iterdir()}
    program = (
        "import os, signal, sys\n"
        "from paxel_runtime.installation import Installation\n"
        "with Installation.open(sys.argv[1]).writing('calibration') as folder:\n"
        "    (folder / 'half.json').write_text('{')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", program, str(installation.path)], check=False, env=os.environ)
    assert {p.name: p.read_bytes() for p in installation.folder("calibration").iterdir()} == before
    with Installation.open(installation.path).writing("calibration") as folder:  # the next run clears the rest away
        (folder / "model.json").write_text("{}", encoding="utf-8")
    assert not list(installation.path.glob(".calibration-*"))


def test_a_folder_that_a_kill_left_between_the_two_renames_comes_back(fill: Callable[..., Installation]) -> None:
    installation = fill()
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    installation.folder("calibration").rename(installation.path / f".calibration-{dead.pid}-old")
    assert _states(installation.path)["calibration"] == "done"
