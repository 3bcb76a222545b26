"""`paxel report`: all three files or none, the same bytes for the same input, and every figure where it says.

Chapters that take long have stand-ins here; what they tell is tested beside them, and all together in the slow test.
"""

import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_design.demo import run_demo
from paxel_design.report.content import Paragraph, Quantity, Section
from paxel_design.report.record import report_record
from paxel_design.report.sections import summary
from paxel_design.report.source import ReportSource, installation_source
from paxel_design.stages import report as stage
from paxel_design.stages.report import FILES, make_report, make_report_of_model, report_sections
from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import make_settings
from paxel_runtime.storage import model_to_dict, write_json

Follow = Callable[[Mapping[str, Quantity], Path], int]


def _stand_in(key: str) -> Callable[[ReportSource], Section]:
    def section(source: ReportSource) -> Section:
        volume = Quantity(12345.678, "CIELAB^3", "computed")
        return Section(key, key, (Paragraph(f"A volume of {{{key}.volume}}."),), {f"{key}.volume": volume})

    return section


_LONG = {"gamuts": "gamut", "pictures": "pictures", "recommendations": "recommendations"}
_DRAWN = {"pattern": "pattern", "calibration": "calibration"}


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only fixed texts and tables are set."""
    for name, key in (_LONG | _DRAWN).items():
        monkeypatch.setitem(stage._CHAPTERS, name, _stand_in(key))
    monkeypatch.setattr(stage, "_MOST_JOBS", 1)
    monkeypatch.setattr(summary, "_glance", lambda source: Paragraph("no pictures"))


@pytest.fixture
def show(calibrated: Installation, tmp_path: Path) -> Installation:
    """A copy to work on."""
    shutil.copytree(calibrated.path, tmp_path / "show")
    return Installation.open(tmp_path / "show")


def _bytes(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def _paxel(*words: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def _as_quantities(record: Mapping[str, Any]) -> dict[str, Quantity]:
    return {
        name: Quantity(tuple(q["value"]) if isinstance(q["value"], list) else q["value"], q["unit"], q["source"])
        for name, q in record["quantities"].items()
    }


def test_every_figure_is_what_the_stages_say(
    calibrated: Installation, check_sources: Follow, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, key in _LONG.items():
        monkeypatch.setitem(stage._CHAPTERS, name, _stand_in(key))
    source = installation_source(calibrated)
    told: list[str] = []
    sections = report_sections(source, lambda words, *_: told.append(words))
    record = report_record(sections, title="", subtitle="", bench=source.bench, date=source.date, inputs={})
    assert check_sources(_as_quantities(record), calibrated.path) > 100
    assert all(row["quantity"] in record["quantities"] for row in record["verdicts"])
    assert set(told) == {f"report: {name}" for name in stage._CHAPTERS}


@pytest.mark.usefixtures("quick")
def test_a_report_is_the_same_twice_and_told_to_be_up_to_date(show: Installation) -> None:
    code, out, err = _paxel("report", show.path, "--json")
    assert code == 0, err
    record = json.loads(out)
    folder = show.folder("report")
    first = _bytes(folder)
    assert sorted(first) == sorted(FILES)
    assert json.loads(first["report.json"]) == record
    assert record["sections"] == [
        "summary", "pattern", "calibration", "gamut", "pictures", "recommendations", "definitions", "provenance",
    ]  # fmt: skip
    assert (record["measured_on"], record["date"]) == ("virtual bench, realistic", "2026-03-04")
    assert record["inputs"]["files"]["captures/complete.json"]
    assert {s.stage.name: s.state for s in show.status()}["report"] == "done"

    code, again, err = _paxel("report", show.path, "--json")
    assert "report is up to date; nothing to do" in err
    assert json.loads(again) == record
    make_report(show)
    assert _bytes(folder) == first
    (show.path / "gamut").mkdir()
    write_json(show.path / "gamut" / "more.json", {"inputs": show.inputs("gamut")})
    assert {s.stage.name: s.state for s in show.status()}["report"] == "stale"


@pytest.mark.usefixtures("quick")
def test_a_report_that_fails_leaves_the_old_one(show: Installation, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = show.folder("report")
    folder.mkdir()
    (folder / "report.json").write_text("{}", encoding="utf-8")

    def broken(*_: object, **__: object) -> None:
        raise InputError("no")

    monkeypatch.setattr(stage, "write_pdf", broken)
    with pytest.raises(InputError, match="no"):
        make_report(show)
    assert _bytes(folder) == {"report.json": b"{}"}
    out = show.path / "elsewhere"
    with pytest.raises(InputError, match="no"):
        make_report_of_model(show.folder("calibration") / "model.json", out)
    assert not list(out.iterdir())


@pytest.mark.usefixtures("quick")
def test_a_model_alone(tmp_path: Path, bw_model: Callable[[int], PredictionModel]) -> None:
    model = tmp_path / "theirs.json"
    write_json(model, model_to_dict(bw_model(2)))
    code, out, err = _paxel("report", "--model", model, "--json")
    assert code == 0, err
    assert "nothing was written" in err
    record = json.loads(out)
    assert record["subtitle"] == "theirs.json"
    assert record["sections"] == [
        "summary", "calibration", "gamut", "recommendations", "definitions", "provenance",
    ]  # fmt: skip
    assert list(tmp_path.iterdir()) == [model]
    code, out, err = _paxel("report", "--model", model, "--out", tmp_path / "out")
    assert code == 0, err
    assert "report.pdf" in out
    assert sorted(_bytes(tmp_path / "out")) == sorted(FILES)
    assert json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8")) == record


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ((), 2, "give a folder, or --model FILE"),
        (("{show}", "--model", "m.json"), 2, "give a folder, or --model FILE"),
        (("{show}", "--out", "x"), 2, "--out goes with --model"),
        (("{show}",), 1, "run: paxel pattern"),
        (("--model", "{show}/none.json"), 2, "there is no model file"),
        (("--model", "{show}/none.json", "--out", "{show}/paxel.toml"), 2, "--out must be a folder"),
    ],
)
def test_mistakes_are_answered_and_write_nothing(
    words: tuple[str, ...], code: int, message: str, tmp_path: Path
) -> None:
    show = Installation.create(tmp_path / "show", make_settings())
    found, out, err = _paxel("report", *(word.format(show=show.path) for word in words))
    assert found == code
    assert message in " ".join(err.split())
    assert not out
    assert [path.name for path in show.path.iterdir()] == ["paxel.toml"]


@pytest.mark.slow
def test_a_whole_report_of_the_demonstration(tmp_path: Path, check_sources: Follow) -> None:
    """Minutes: every chapter and both writers, twice, in two processes."""
    small = {"projector.resolution": [480, 270], "projector.width_mm": 70.3, "camera.resolution": [1024, 768]}
    run_demo(tmp_path / "show", "bw-checkerboard", small, lambda *_: None, lambda *_: None)
    show = Installation.open(tmp_path / "show")
    record = make_report(show, jobs=2)
    first = _bytes(show.folder("report"))
    assert check_sources(_as_quantities(record), show.path) > 200
    assert len(first["report.pdf"]) < 8e6
    assert len(first["report.html"]) < 12e6
    make_report(show, jobs=1)
    assert _bytes(show.folder("report")) == first
