"""Chapters of fixed text and of provenance, and the first page."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paxel_design.report.content import Chart, Paragraph, Pictures, Quantity, Section, Table, Verdict, Verdicts, filled
from paxel_design.report.record import all_quantities
from paxel_design.report.sections import definitions, provenance, summary
from paxel_design.report.sections.definitions import DEFINITIONS, GLOSSARY
from paxel_design.report.source import ReportSource, installation_source, model_source
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.storage import file_sha256, model_to_dict, write_json

Check = Callable[[Section], None]
Follow = Callable[[Mapping[str, Quantity], Path], int]

README = Path(__file__).resolve().parents[4] / "README.md"


@pytest.fixture(scope="module")
def source(calibrated: Installation) -> ReportSource:
    return installation_source(calibrated)


def test_the_glossary_is_the_readmes() -> None:
    text = README.read_text(encoding="utf-8").partition("## Glossary")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", text, re.MULTILINE)
    assert dict(rows[1:]) == GLOSSARY


def test_definitions_explain_the_bench_only_where_there_is_one(source: ReportSource, check_section: Check) -> None:
    made = definitions.section(source)
    check_section(made)
    assert {row[0] for block in made.blocks if isinstance(block, Table) for row in block.rows} >= {
        *DEFINITIONS,
        *GLOSSARY,
    }
    assert isinstance(made.blocks[0], Paragraph)
    assert "Virtual bench" in made.blocks[0].text
    on_hardware = definitions.section(replace(source, bench=""))
    assert not any("bench" in getattr(block, "text", "") for block in on_hardware.blocks)


def test_provenance_names_versions_hashes_and_settings(
    source: ReportSource, calibrated: Installation, check_section: Check, check_sources: Follow
) -> None:
    made = provenance.section(source)
    check_section(made)
    assert check_sources(made.quantities, calibrated.path) >= 3
    assert made.quantities["provenance.setting.clusters.count"].value == "2"
    assert "provenance.setting.pattern.dot_size_mm" not in made.quantities  # as paxel new writes it
    digest = file_sha256(calibrated.path / "calibration" / "model.json")
    assert digest.startswith(str(made.quantities["provenance.sha256.calibration.model.json"].value))
    assert made.quantities["provenance.version.numpy"].value == np.__version__
    assert made.quantities["provenance.date"].value == "2026-03-04"


def _others() -> list[Section]:
    quantities = {
        "gamut.lightness.L_pattern": Quantity((19.0, 42.0), "L*"),
        "gamut.lightness.L_white": Quantity((45.0, 69.0), "L*"),
        "calibration.prediction.pattern.dE00_mean": Quantity(0.3, "dE00"),
        "calibration.prediction.white.dE00_mean": Quantity(3.0, "dE00"),
    }
    of = "calibration.prediction.{}.dE00_mean".format
    verdicts = (
        Verdict("on the pattern", of("pattern"), "good", "good up to 1, usable up to 2.5 dE00"),
        Verdict("on the white surface", of("white"), "weak", "good up to 1, usable up to 2.5 dE00", "do this"),
        Verdict("another", of("pattern"), "usable", "good up to 0.1, usable up to 1 dE00"),
    )
    return [Section("calibration", "C", (), quantities, verdicts)]


def test_the_summary_gathers_the_worst_verdict_of_each_rule(source: ReportSource) -> None:
    others = _others()
    made = summary.section(source, others)
    (table,) = (block for block in made.blocks if isinstance(block, Verdicts))
    assert [verdict.name for verdict in table.verdicts] == ["on the white surface", "another"]
    known = all_quantities([made, *others])
    texts = " ".join(filled(block.text, known) for block in made.blocks if isinstance(block, Paragraph))
    assert "19.0 to 42.0 on the pattern and 45.0 to 69.0 on the sheet" in texts
    assert "to 0.300 dE00 on the pattern and 3.00 on the sheet" in texts
    assert texts.count("Colours come out") == 1
    assert "Figures judged: 3; good 1, usable 1, weak 1. Look first at: on the white surface." in texts


def test_a_summary_without_pictures_shows_what_light_can_do(
    source: ReportSource, tmp_path: Path, bw_model: Callable[[int], PredictionModel]
) -> None:
    (chart,) = (block for block in summary.section(source, []).blocks if isinstance(block, Chart))
    assert "paxel project" in chart.caption
    write_json(tmp_path / "model.json", model_to_dict(bw_model(3)))
    alone = summary.section(model_source(tmp_path / "model.json"), [])
    (chart,) = (block for block in alone.blocks if isinstance(block, Chart))
    assert "A model.json alone" in chart.caption
    assert len(chart.figure.axes) == 3
    assert not any(isinstance(block, Verdicts) for block in alone.blocks)
    one = replace(source.model, white=None)
    assert "pattern alone" in _first_words(summary.section(replace(source, model=one), []))


def _first_words(made: Section) -> str:
    first = made.blocks[0]
    assert isinstance(first, Paragraph)
    return first.text


def test_a_summary_shows_what_is_sent_and_seen(projected_source: ReportSource, check_section: Check) -> None:
    made = summary.section(projected_source, [])
    check_section(made)
    (row,) = (block for block in made.blocks if isinstance(block, Pictures))
    assert [one.label for one in row.pictures] == [
        "sent: the projection image",
        "seen on the pattern",
        "seen on the sheet",
    ]
    record = projected_source.records["preview/dual-image.json"]
    assert made.quantities["summary.seen.white.dE00_mean"].value == record["on_white"]["dE00_mean"]
    one = replace(projected_source, records={**projected_source.records, "preview/dual-image.json": {"on_pattern": {}}})
    (row,) = (block for block in summary.section(one, []).blocks if isinstance(block, Pictures))
    assert row.pictures[0].label.startswith("wanted")
    assert len(row.pictures) == 3
