"""The chapter on calibration: what it tells of stand-in records, of one surface, and of a model alone."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paxel_design.report.content import Chart, Heading, Quantity, Section, Table, Verdicts
from paxel_design.report.sections.calibration import section
from paxel_design.report.sections.prediction import PAPER_TABLE_I, PAPER_TABLE_II
from paxel_design.report.source import ReportSource, installation_source, model_source
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.storage import model_to_dict, write_json

Check = Callable[[Section], None]
Follow = Callable[[Mapping[str, Quantity], Path], int]


@pytest.fixture(scope="module")
def source(calibrated: Installation) -> ReportSource:
    return installation_source(calibrated)


@pytest.fixture(scope="module")
def made(source: ReportSource) -> Section:
    return section(source)


def _table(made: Section, name: str) -> Table:
    (table,) = (block for block in made.blocks if isinstance(block, Table) and block.name == name)
    return table


def test_every_figure_is_what_the_stages_say(
    made: Section, calibrated: Installation, check_section: Check, check_sources: Follow
) -> None:
    check_section(made)
    assert check_sources(made.quantities, calibrated.path) > 80
    assert made.quantities["calibration.prediction.white.dE00_p95"].value == 0.75
    assert made.quantities["calibration.clusters.white.of.black"].value == 26.0
    assert {b.text for b in made.blocks if isinstance(b, Heading)} >= {
        "Prediction of colours", "Registration", "Clusters", "Response curves", "Honesty of the projector", "Stability",
        "Warnings",
    }  # fmt: skip


def test_the_papers_figures_stand_beside_and_the_bench_is_named(made: Section) -> None:
    table = _table(made, "calibration-prediction-table")
    assert table.rows[-1][1:] == tuple(f"{v:g}" for surface in ("pattern", "white") for v in PAPER_TABLE_I[surface])
    assert "hardware" in table.rows[-1][0]
    assert table.caption.endswith("(virtual bench).")
    assert len(table.rows) == 4  # own, without correction, another K, the paper's
    assert _table(made, "calibration-extra").rows[0][1] == "{calibration.extra.refined_A.used}"
    assert len(_table(made, "calibration-extra").rows) == 1  # the correction was not tested in cross-validation


def test_the_worst_channel_and_cluster_are_judged(made: Section) -> None:
    verdicts = {verdict.quantity: verdict for verdict in made.verdicts}
    assert verdicts["calibration.registration.blue.residual_rms_px"].judgement == "usable"
    assert verdicts["calibration.clusters.white.of.white"].judgement == "weak"
    assert verdicts["calibration.prediction.pattern.dE00_mean"].judgement == "good"
    assert verdicts["calibration.honesty"].judgement == "usable"
    assert any(isinstance(block, Verdicts) for block in made.blocks)


def test_residual_maps_are_drawn_where_the_captures_have_them(made: Section, source: ReportSource) -> None:
    (chart,) = (b for b in made.blocks if isinstance(b, Chart) and b.name == "calibration-residual-maps")
    panels = [axes for axes in chart.figure.axes if axes.get_title()]
    assert [axes.get_title() for axes in panels] == ["red", "green", "blue"]
    drawn = np.ma.filled(panels[2].images[0].get_array(), np.nan)
    assert np.isnan(drawn[:4]).all()
    assert panels[0].images[0].get_extent() == [0, 240, 136, 0]  # projector pixels


def test_hardware_is_not_called_a_bench(source: ReportSource) -> None:
    captions = [getattr(block, "caption", "") for block in section(replace(source, bench="")).blocks]
    assert not any("virtual" in caption for caption in captions)


def test_what_was_not_recorded_is_left_out(source: ReportSource, check_section: Check) -> None:
    records = {name: record for name, record in source.records.items() if not name.startswith("calibration/")}
    records["calibration/calibration.json"] = {"inputs": {}}
    bare = section(replace(source, records=records))
    check_section(bare)
    headings = [block.text for block in bare.blocks if isinstance(block, Heading)]
    assert headings == ["Response curves", "The model"]


def test_a_model_alone_tells_the_light_of_its_clusters(
    tmp_path: Path, bw_model: Callable[[int], PredictionModel], check_section: Check
) -> None:
    model = bw_model(2)
    write_json(tmp_path / "model.json", model_to_dict(model))
    made = section(model_source(tmp_path / "model.json"))
    check_section(made)
    Lab = XYZ_to_Lab(model.pattern.predict_XYZ(np.array([0, 0, 0, 1, 1, 1.0])), model.white_point)
    assert made.quantities["calibration.model.pattern.white.L"].value == pytest.approx(Lab[0], abs=0.005)
    assert made.quantities["calibration.model.white.all.L"].value == pytest.approx(100.0)
    assert not made.verdicts


def test_one_channel_stands_beside_table_II(source: ReportSource, check_section: Check) -> None:
    """One surface and one channel, as under ultraviolet light."""
    model = source.model
    pattern = replace(model.pattern, A=model.pattern.A[:, ::3])
    response = replace(model.response, code=model.response.code[:1], linear=model.response.linear[:1])
    one = replace(model, channels=("uv",), pattern=pattern, white=None, response=response)
    accuracy = {k: v for k, v in source.records["calibration/accuracy.json"].items() if k not in ("white", "by_input")}
    made = section(replace(source, model=one, records={**source.records, "calibration/accuracy.json": accuracy}))
    check_section(made)
    table = _table(made, "calibration-prediction-table")
    assert table.rows[-1][1:] == tuple(f"{v:g}" for v in PAPER_TABLE_II["pattern"])
    assert "Table II" in table.rows[-1][0]
