"""The section on pictures: of a finished installation, of one without projections, and of hardware."""

import json
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from paxel_design.report.content import Bullets, Heading, Paragraph, Pictures, Section, Table
from paxel_design.report.sections import seen
from paxel_design.report.sections.pictures import section
from paxel_design.report.source import ReportSource

Check = Callable[[Section], None]

GHOST = "what is left of the other picture"


@pytest.fixture(scope="module")
def of_bench(projected_source: ReportSource) -> Section:
    return section(projected_source)


def _rows(found: Section) -> dict[str, Pictures]:
    return {block.name: block for block in found.blocks if isinstance(block, Pictures)}


def test_every_projection_with_its_pictures(of_bench: Section, check_section: Check) -> None:
    check_section(of_bench)
    headings = [block.text for block in of_bench.blocks if isinstance(block, Heading)]
    assert [h.split(":")[0] for h in headings if "leaks" not in h] == ["dual-image", "free", "hidden 1"]
    labels = {name: [one.label for one in row.pictures] for name, row in _rows(of_bench).items()}
    wanted, ghost = ["wanted", "fitted", "out of gamut"], [GHOST]
    look = ["seen, at true brightness", "seen, as the eye adapts"]
    assert labels == {
        "pictures-dual-image-frame": ["the projection image", "its middle, pixels enlarged"],
        "pictures-dual-image-on-pattern": wanted + look + ghost,
        "pictures-dual-image-on-white": wanted + look + ghost,
        "pictures-free-frame": ["the projection image", "its middle, pixels enlarged"],
        "pictures-free-on-pattern": wanted + look,
        "pictures-free-on-white": look,
        "pictures-hidden-1-frame": ["the projection image", "its middle, pixels enlarged"],
        "pictures-hidden-1-on-pattern": wanted + look,  # the white sheet has no picture that could shine through
        "pictures-hidden-1-on-white": look + ghost,
    }
    assert "one colour all over" in _rows(of_bench)["pictures-hidden-1-on-white"].caption
    assert "left free" in _rows(of_bench)["pictures-free-on-white"].caption
    assert len([block for block in of_bench.blocks if isinstance(block, Table)]) == 6


def test_figures_are_those_of_the_records(of_bench: Section, projected_source: ReportSource) -> None:
    assert projected_source.installation is not None
    root = projected_source.installation.path
    followed = 0
    for name, quantity in of_bench.quantities.items():
        match = re.fullmatch(r"(.+\.json)#/(.+?)( x 100)?", quantity.source)
        if match is None:
            assert quantity.source.startswith("computed"), name
            continue
        value = json.loads((root / match[1]).read_text())
        for key in match[2].split("/"):
            value = value[key]
        assert quantity.value == (100 * value if match[3] else tuple(value) if isinstance(value, list) else value), name
        followed += 1
    assert followed > 40


def test_what_is_out_of_gamut_is_white_where_nothing_is_moved(
    of_bench: Section, projected_source: ReportSource
) -> None:
    q = {name: quantity.value for name, quantity in of_bench.quantities.items()}
    for surface in ("pattern", "white"):
        own = f"pictures.dual-image.on-{surface}"
        assert q[f"{own}.moved_mean"] < q[f"{own}.moved_p95"]
        # More than 1 dE00 is rarer than any chroma that was lowered by 0.1.
        assert 0 < q[f"{own}.moved"] <= q[f"{own}.pixels_moved"] + 1
    map_ = _rows(of_bench)["pictures-hidden-1-on-pattern"].pictures[2].picture
    white = np.all(map_ == 255, axis=-1).mean()
    assert 100 * white <= 100 - float(str(q["pictures.hidden-1.on-pattern.moved"]))


def test_a_hidden_picture_is_told_of_on_the_surface_that_hides_it(of_bench: Section) -> None:
    q = of_bench.quantities
    assert {name for name in q if name.endswith(".hidden_seen")} == {
        "pictures.dual-image.on-pattern.hidden_seen",
        "pictures.dual-image.on-white.hidden_seen",
        "pictures.hidden-1.on-white.hidden_seen",
    }
    for name in list(q):
        if name.endswith(".hidden_seen"):
            shown, hidden = (float(str(q[key].value)) for key in (name.replace("seen", "shown"), name))
            assert hidden < 0.1 * shown  # the ideal bench hides well
    leaks = [block for block in of_bench.blocks if isinstance(block, Bullets)]
    assert len(leaks) == 3
    assert all("only the projection image" in block.items[-1] for block in leaks)
    judged = {verdict.quantity for verdict in of_bench.verdicts}
    assert "pictures.hidden-1.on-white.hidden_seen" in judged
    assert "pictures.dual-image.on-white.dE00_mean" in judged


def test_beyond_the_limit_views_are_left_out_and_that_is_said(
    projected_source: ReportSource, check_section: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(seen, "_MOST_PIXELS", 240 * 135 * 2)
    found = section(projected_source)
    check_section(found)
    assert "what is left of the other picture" in [
        p.label for p in _rows(found)["pictures-dual-image-on-white"].pictures
    ]
    assert len(_rows(found)["pictures-hidden-1-on-white"].pictures) == 2
    assert any("left out" in block.text for block in found.blocks if isinstance(block, Paragraph))


def test_without_a_preview_the_command_is_given(projected_source: ReportSource, check_section: Check) -> None:
    records = {path: record for path, record in projected_source.records.items() if not path.startswith("preview/")}
    found = section(replace(projected_source, records=records))
    check_section(found)
    texts = [block.text for block in found.blocks if isinstance(block, Paragraph)]
    assert sum("paxel preview DIR" in text for text in texts) == 3
    assert len(_rows(found)["pictures-dual-image-on-white"].pictures) == 3


def test_on_hardware_nothing_is_called_virtual(projected_source: ReportSource, check_section: Check) -> None:
    found = section(replace(projected_source, bench=""))
    check_section(found)
    assert not any("virtual" in row.caption for row in _rows(found).values())
    assert "looked at on the wall" in str(found.blocks[0])


@pytest.mark.parametrize("alone", [True, False])
def test_without_projections_the_command_is_given(projected_source: ReportSource, alone: bool) -> None:
    found = section(
        replace(projected_source, installation=None if alone else projected_source.installation, records={})
    )
    (paragraph,) = found.blocks
    assert isinstance(paragraph, Paragraph)
    assert "paxel project" in paragraph.text
    assert not found.quantities
