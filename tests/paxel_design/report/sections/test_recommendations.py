"""The section of recommendations: of an installation with a print, and of a model alone."""

import re
from collections.abc import Callable
from itertools import pairwise

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
    blocks = list(found.blocks)
    return {
        head.text: items.items
        for head, items in pairwise(blocks)
        if isinstance(head, Heading) and isinstance(items, Bullets)
    }


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
    assert any(title.startswith("A gray second sheet that reflects 0.5") for title in titles)


def test_what_brings_nothing_is_told_too(of_print: Section) -> None:
    lists = _lists(of_print)
    tried = lists["Tried, and brings nothing or costs"]
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


def test_a_model_alone_says_what_is_missing(of_model: Section) -> None:
    assert any("installation folder" in block.text for block in of_model.blocks if isinstance(block, Paragraph))
    assert not any("dot-size" in name for name in of_model.quantities)


def test_without_anything_to_gain_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch, bw_model: ModelOf) -> None:
    from pathlib import Path

    from paxel_design.report.sections import recommendations

    monkeypatch.setattr(recommendations, "changes_of", lambda _: ())
    found = section(ReportSource(bw_model(2), Path("model.json")))
    assert any("Nothing that was tried" in block.text for block in found.blocks if isinstance(block, Paragraph))
    assert not any(isinstance(block, Table | Chart) for block in found.blocks)
