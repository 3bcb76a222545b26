"""The build of the paper's figures: what deviates is found and told; every script keeps to the conventions."""

import ast
import json
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from paxel_runtime.errors import GamutError, UsageError
from paxel_runtime.installation import Installation
from reports import build, shared_installations
from reports.comparison import README, REFERENCE, deviations, read_references, readme_table, with_table
from reports.paper import TOLERANCES, Figure, Item, Result, Run, record, run_item

REPORTS = Path(build.__file__).parent
ITEM = Item("invented", "Fig. 99", "two numbers")
FIGURES = {
    "error": Figure(1.0, "dE00", "colour difference", paper=1.9),
    "hue": Figure(359.0, "degrees", "hue angle"),
    "inks": Figure(6, "", "count"),
    "solve": Figure(5.0, "s", "time"),
}


def made(quick: bool = True, **changed: Figure) -> dict[str, Any]:
    """A record of the invented item."""
    return record(ITEM, Run(Path(), quick), Result("1.0", FIGURES | changed), 0.1)


def test_our_figure_says_virtual_bench_and_the_papers_says_hardware() -> None:
    error = made()["figures"]["error"]
    assert error["measured_on"] == "virtual bench, realistic"
    assert error["paper"] == {"value": 1.9, "measured_on": "hardware (the paper, Fig. 99)"}
    with pytest.raises(ValueError, match="kind must be one of colour difference"):
        Figure(1.0, "m", "length")


def test_figures_within_their_tolerance_agree_and_hues_go_around_the_circle() -> None:
    near = made(error=Figure(1.14, "dE00", "colour difference"), hue=Figure(1.5, "degrees", "hue angle"))
    assert deviations("invented", near, {"quick": made()}) == []


@pytest.mark.parametrize(
    ("name", "figure", "words"),
    [
        ("error", Figure(1.2, "dE00", "colour difference"), r"'error': 1.2 dE00, reference 1, may be 0.15 away \(.+\)"),
        ("error", Figure(math.nan, "dE00", "colour difference"), "'error': nan"),
        ("error", Figure(1.0, "dE76", "colour difference"), "now a colour difference in 'dE76', was .* in 'dE00'"),
        ("hue", Figure(3.0, "degrees", "hue angle"), "'hue': 3 degrees, reference 359, may be 3 away"),
        ("inks", Figure(7, "", "count"), "'inks': 7, reference 6, may be 0 away"),
        ("extra", Figure(1, "", "count"), "'extra' has no reference; make it with: python -m reports.build --quick"),
    ],
)
def test_a_deviation_is_found_and_told(name: str, figure: Figure, words: str) -> None:
    (line,) = deviations("invented", made(**{name: figure}), {"quick": made()})
    assert re.search(words, line), line


def test_times_are_told_and_not_compared() -> None:
    assert deviations("invented", made(solve=Figure(500.0, "s", "time")), {"quick": made()}) == []


def test_a_missing_reference_says_how_to_make_it_and_a_missing_figure_is_told() -> None:
    (line,) = deviations("invented", made(), {"full": made(quick=False)})
    assert "no quick reference" in line
    assert line.endswith("python -m reports.build --quick --only invented --write-reference")
    (line,) = deviations("invented", made(), {"quick": made(gone=Figure(1, "", "count"))})
    assert line == "'gone' is in the reference and was not made"


def test_a_relation_that_does_not_hold_ends_in_one_line_and_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = Result("1 and 2", FIGURES, {"one is less than two": True, "two is less than one": False})
    assert run_item(ITEM, lambda run: broken, [str(tmp_path), "--quick"]) == 1
    assert capsys.readouterr().err == "invented: this does not hold: two is less than one\n"
    written = json.loads((tmp_path / "invented.json").read_text())
    assert written["relations"]["two is less than one"] is False
    assert (written["size"], written["item"]) == ("quick", "Fig. 99")

    def fail(run: Run) -> Result:
        raise GamutError("no volume")

    assert run_item(ITEM, fail, [str(tmp_path)]) == 1
    assert capsys.readouterr().err == "invented: no volume\n"


@pytest.fixture
def invented(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Builds one invented script in a folder of its own, with references and README of its own."""
    readme = tmp_path / "README.md"
    readme.write_text(with_table(README.read_text(encoding="utf-8"), ""), encoding="utf-8")
    for name, value in (("BUILD", tmp_path), ("REFERENCE", tmp_path), ("README", readme), ("NAMES", ("invented",))):
        monkeypatch.setattr(build, name, value)

    def run(result: Result, *arguments: str) -> int:
        module = ModuleType("reports.invented")
        module.__dict__.update(ITEM=ITEM, make=lambda run: result)
        monkeypatch.setitem(sys.modules, "reports.invented", module)
        return build.main(["--quick", *arguments])

    return run


def test_a_build_fails_until_there_is_a_reference_and_when_a_figure_moves(
    invented: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = Result("one", FIGURES, {"one is one": True})
    assert invented(good) == 1
    assert "there is no quick reference" in capsys.readouterr().out
    assert invented(good, "--write-reference") == 0
    assert "| Fig. 99 | two numbers | one (virtual bench, realistic, quick) |" in (tmp_path / "README.md").read_text()
    assert invented(good) == 0
    capsys.readouterr()
    assert invented(Result("two", FIGURES | {"inks": Figure(5, "", "count")})) == 1
    told = capsys.readouterr().out
    assert "NOT OK (1)" in told
    assert "Fig. 99: 'inks': 5, reference 6" in told
    assert invented(Result("one", FIGURES, {"one is two": False}), "--write-reference") == 1
    assert "Fig. 99: invented: this does not hold: one is two" in capsys.readouterr().out
    assert read_references("invented", tmp_path)["quick"]["relations"] == {"one is one": True}


def test_a_quick_build_leaves_long_items_out_unless_they_are_named(
    invented: Callable[..., int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert set(build.LONG) < {path.stem for path in REPORTS.glob("*.py")}
    monkeypatch.setattr(build, "LONG", ("invented",))
    assert invented(Result("one", FIGURES)) == 0
    assert "0 items" in capsys.readouterr().out
    assert invented(Result("one", FIGURES), "--only", "invented") == 1, "there is no reference"


def test_a_ready_installation_takes_the_place_of_the_shared_one_of_the_same_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shared_installations, "BUILD", tmp_path / "build")
    ready = Installation.create(tmp_path / "ready", shared_installations.settings_of("cmyrgb", True)).path
    assert shared_installations.adopt(ready, True) == "cmyrgb"
    assert shared_installations.place_of("cmyrgb", True).resolve() == ready.resolve()
    with pytest.raises(UsageError, match="has the settings of none of the full installations: bw-checkerboard, cmyrgb"):
        shared_installations.adopt(ready, False)


@pytest.mark.parametrize("name", build.NAMES)
def test_every_script_keeps_to_the_conventions(name: str) -> None:
    text = (REPORTS / f"{name}.py").read_text(encoding="utf-8")
    item = build.item_of(name)
    assert item.name == name
    assert set(item.uses) <= set(shared_installations.SHARED)
    assert len(text.splitlines()) <= 95
    assert text.endswith('if __name__ == "__main__":\n    sys.exit(run_item(ITEM, make))\n'), "[FOLDER] [--quick]"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("paxel"):
            assert not any(alias.name.startswith("_") for alias in node.names), "public names only"


@pytest.mark.parametrize("name", build.NAMES)
def test_every_script_has_references_of_both_sizes_in_which_its_relations_hold(name: str) -> None:
    references = read_references(name, REFERENCE)
    assert set(references) == {"full", "quick"}
    for size, reference in references.items():
        assert reference["size"] == size
        assert reference["figures"]
        assert all(figure["kind"] in TOLERANCES for figure in reference["figures"].values())
        assert all(reference["relations"].values())


def test_the_readme_has_the_table_of_the_references_and_names_every_script() -> None:
    readme = README.read_text(encoding="utf-8")
    assert with_table(readme, readme_table([build.item_of(name) for name in build.NAMES], REFERENCE)) == readme
    for path in REPORTS.glob("*.py"):
        assert re.search(rf"\b{path.stem}\b", readme), f"{path.name} is not in reports/README.md"
