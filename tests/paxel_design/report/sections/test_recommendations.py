"""The section of recommendations: of an installation with a print, and of a model alone."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from paxel_design.report.content import Bullets, Chart, Heading, Paragraph, Section, Table, filled
from paxel_design.report.sections.recommendations import section
from paxel_design.report.source import ReportSource
from paxel_design.stages.print_sheet import make_print
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import make_settings

Check = Callable[[Section], None]
ModelOf = Callable[[int], PredictionModel]

ROOT = Path(__file__).resolve().parents[4]
SMALL = {
    "projector.resolution": [240, 135],
    "projector.width_mm": 35.1,
    "pattern.size_mm": [40, 30],
    "clusters.count": 2,
    # dots of 1.25 mm melt from 4.2 m on, as the print's spectrum tells
    "viewing.distance_mm": 3000,
}
ACCURACY = {
    "model": "corrected",
    "pattern": {"dE00_mean": 0.2},
    "linear": {"pattern": {"dE00_mean": 0.5}},
    "noise_floor": {"pattern": {"dE00_mean": 0.2}},
}


@pytest.fixture(scope="module")
def of_print(bw_model: ModelOf, tmp_path_factory: pytest.TempPathFactory) -> Section:
    installation = Installation.create(tmp_path_factory.mktemp("show") / "a", make_settings("bw-checkerboard", SMALL))
    make_print(installation)
    path = installation.path / "calibration" / "model.json"
    records = {"calibration/accuracy.json": ACCURACY}
    return section(ReportSource(bw_model(2), path, "virtual bench, ideal", installation, records))


@pytest.fixture(scope="module")
def of_model(bw_model: ModelOf, tmp_path_factory: pytest.TempPathFactory) -> Section:
    return section(ReportSource(bw_model(2), tmp_path_factory.mktemp("alone") / "model.json"))


def _table(found: Section) -> Table:
    return next(block for block in found.blocks if isinstance(block, Table))


def _lists(found: Section) -> dict[str, tuple[str, ...]]:
    """Items under each heading."""
    lists: dict[str, tuple[str, ...]] = {}
    heading = ""
    for block in found.blocks:
        if isinstance(block, Heading):
            heading = block.text
        elif isinstance(block, Bullets):
            lists[heading] = block.items
    return lists


def test_texts_name_quantities_that_are_there(of_print: Section, of_model: Section, check_section: Check) -> None:
    for found in (of_print, of_model):
        check_section(found)
        assert found.key == "recommendations"
        assert all(quantity.source.startswith("computed") for quantity in found.quantities.values())


def test_no_number_of_the_installation_stands_in_a_text(of_print: Section, of_model: Section) -> None:
    for found in (of_print, of_model):
        texts = [cell for row in _table(found).rows for cell in row]
        texts += [item for items in _lists(found).values() for item in items]
        for text in texts:
            bare = re.sub(r"\{[^}]*\}|L\*|CIELAB\^3|dE00|D65", "", text)
            assert not re.search(r"\d", bare), text


def test_the_larger_effect_comes_first_and_by_its_gain(of_print: Section) -> None:
    titles = [filled(row[0], of_print.quantities) for row in _table(of_print).rows]
    keys = [re.findall(r"recommendations\.([a-z0-9.-]+)\.before", row[1])[0] for row in _table(of_print).rows]
    effects = [key for key in keys if key.startswith(("dot-size-1", "finer", "clusters", "darker"))]
    assert keys[: len(effects)] == effects
    gains = [of_print.quantities[f"recommendations.{key}.gain"].value for key in effects]
    assert gains == sorted(gains, reverse=True)  # type: ignore[type-var]
    assert "3 clusters in place of 2" in titles
    # the chart shows every sheet, the table the one with which the surfaces share most
    assert [title for title in titles if title.startswith("A gray second sheet")] == [
        "A gray second sheet that reflects 0.3 of what the white paper does"
    ]


def test_what_brings_nothing_is_told_too(of_print: Section) -> None:
    lists = _lists(of_print)
    tried = lists["Tried, and brings little or costs"]
    assert any("Half the black level" in item for item in tried)
    assert any("More or quieter readings" in item for item in tried)
    assert ["correction" in item for item in lists["In use already"]] == [True]
    melts = [filled(item, of_print.quantities) for item in lists["Would gain, but not here"]]
    assert any("viewers at 3 m would see the dots" in item for item in melts), melts


def test_the_bench_is_named_where_figures_come_from_it(of_print: Section, of_model: Section) -> None:
    for found, named in ((of_print, True), (of_model, False)):
        captions = [block.caption for block in found.blocks if isinstance(block, Table | Chart)]
        assert len(captions) == 3
        assert all(("(virtual bench)" in caption) == named for caption in captions)


def test_a_model_alone_says_what_is_missing_and_what_its_matrices_tell(of_model: Section) -> None:
    assert any("installation folder" in block.text for block in of_model.blocks if isinstance(block, Paragraph))
    assert {name.rsplit(".", 1)[0] for name in of_model.quantities} == {
        f"recommendations.{key}"
        for key in ("ambient", "black-half", "darkest-cluster", "gray-sheet-0.3", "gray-sheet-0.4", "gray-sheet-0.5")
    }
    value = {name.removeprefix("recommendations."): q.value for name, q in of_model.quantities.items()}
    assert value["darkest-cluster.cluster"] == "black"
    assert value["ambient.after"] < value["ambient.before"] < value["black-half.after"]  # type: ignore[operator]


def test_the_angle_has_less_moire_and_farther_is_seen_less(of_print: Section) -> None:
    value = {name.removeprefix("recommendations."): q.value for name, q in of_print.quantities.items()}
    assert value["angle.after"] <= value["angle.before"]  # type: ignore[operator]
    assert value["angle.angle_now"] == 30.0
    assert value["farther.after"] < value["farther.before"]  # type: ignore[operator]


def test_without_anything_to_gain_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch, bw_model: ModelOf) -> None:
    from paxel_design.report.sections import recommendations

    monkeypatch.setattr(recommendations, "changes_of", lambda _: ())
    found = section(ReportSource(bw_model(2), Path("model.json")))
    assert any("Nothing that was tried" in block.text for block in found.blocks if isinstance(block, Paragraph))
    assert not any(isinstance(block, Table | Chart) for block in found.blocks)


def test_the_deviations_told_are_those_of_the_benchmark(of_model: Section) -> None:
    """``reports/recommended_gains.py`` made the reference by whole calibrations on the virtual bench."""
    text = next(b.text for b in of_model.blocks if isinstance(b, Paragraph) and "recommended_gains" in b.text)
    reference = json.loads((ROOT / "reports" / "reference" / "recommended_gains.json").read_text(encoding="utf-8"))
    told = [float(number) for number in re.findall(r"right to ([\d.]+) L\*, volumes of one surface to (\d+)", text)[0]]
    assert reference["largest_deviation_L"] <= told[0] < reference["largest_deviation_L"] + 0.1
    assert (
        100 * reference["largest_deviation_of_volume"] <= told[1] < 100 * reference["largest_deviation_of_volume"] + 1
    )
    assert "twelve changes" in text
    assert len(reference["changes"]) == 12
