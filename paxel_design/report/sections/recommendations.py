"""What would make the installation better: every change with its gain, what it costs and how it is done.

Gains are those of `paxel_design.what_if`, computed for this installation; here they get words, a table and charts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from paxel_design.report.charts.gains import GainBar, gains_chart, shared_ranges_chart
from paxel_design.report.content import (
    Block,
    Bullets,
    Chart,
    Heading,
    Paragraph,
    Quantity,
    Section,
    Table,
    filled,
    unit_words,
)
from paxel_design.report.sections.parts import on_the_bench
from paxel_design.report.source import ReportSource
from paxel_design.what_if import AIMS, BASES, LEAST_GAIN, Case, Change, case_of, common_range, helpful, idle
from paxel_design.what_if import possible_changes as changes_of

__all__ = ["section"]

_KEY, _TITLE = "recommendations", "What would make it better"
_LEAST = f"{100 * LEAST_GAIN:g}"
_NAMED = re.compile(r"\{([A-Za-z_]+)\}")

_INTRODUCTION = (
    "Each change was tried in the computer on this installation's own figures, one at a time; gains do not add up. "
    "Where the measured matrices tell the outcome (black level, room light, another second sheet, area shares) it is "
    "exact. Other clusters are tried on the installation's own pixels, as the calibration knows them. Where print or "
    "raster change, the print as it is and the changed one are simulated alike, under an ideal DLP projector and on "
    "coated paper. What is found so is a ratio to the present state, and it is applied to the measured figure: what "
    "was not known concerns both and cancels for the most part."
)
_ALONE = (
    "A model.json tells what light does, not what is printed: here stand the changes that its matrices tell. In an "
    "installation folder this chapter also tries dot sizes, angles, inks, numbers of clusters and rasters."
)
_FIGURES = {
    True: "Contrast of two free pictures: the side of a square as large as the largest rectangle of L* on both "
    "surfaces, which is how much lightness two pictures have that know nothing of each other. Volume of colours: the "
    "geometric mean of both sides of the product pair. Thresholds: 1 is just seen, 10 is plain.",
    False: "Volume of all colours: of everything that the print can show, in CIELAB. Thresholds: 1 is just seen, 10 is "
    "plain.",
}
"""What the figures are, with two surfaces and with one."""

_CHECKED = (
    "On the virtual bench, twelve changes (of dots, clusters, sorting, ink, raster, room light and second sheet) were "
    "foretold in this way, then made and calibrated anew: the figures after the change were right to 0.7 L*, volumes "
    "of one surface to 4 percent (reports/recommended_gains.py). The ways of computing were chosen on these twelve, so "
    "that other changes may be foretold less well."
)
_LITTLE = "Gains below {least} percent, or losses: less than anybody would print or measure anew for."
_NOTHING = "Nothing that was tried would gain more than {least} percent."


def section(source: ReportSource) -> Section:
    """The chapter."""
    case = case_of(source.model, source.installation, source.records)
    changes = changes_of(case)
    better, none = helpful(changes), idle(changes)
    rejected = [change for change in changes if change.helps and change.objection]
    used = [change for change in changes if change.in_use]
    quantities = {name: quantity for change in changes for name, quantity in _quantities(change).items()}
    blocks: list[Block] = [Paragraph(_INTRODUCTION)]
    if case.printed is None:
        blocks.append(Paragraph(_ALONE))
    if better:
        blocks += [*_charts(case, better, quantities, on_the_bench(source)), _table(better, on_the_bench(source))]
    else:
        blocks.append(Paragraph(_NOTHING.format(least=_LEAST)))
    if rejected:
        lines = tuple(f"{_line(change)}; but {_text(change, change.objection)}" for change in rejected)
        blocks += [Heading("Would gain, but not here"), Bullets(lines)]
    if none:
        blocks += [Heading("Tried, and brings little or costs"), Paragraph(_LITTLE.format(least=_LEAST))]
        blocks.append(Bullets(tuple(_line(change) for change in none)))
    if used:
        blocks += [Heading("In use already"), Bullets(tuple(_line(change) for change in used))]
    blocks += [Paragraph(_CHECKED, small=True), Paragraph(_FIGURES[case.model.white is not None], small=True)]
    return Section(_KEY, _TITLE, tuple(blocks), quantities)


def _name(change: Change, part: str) -> str:
    return f"{_KEY}.{change.key}.{part}"


def _quantities(change: Change) -> dict[str, Quantity]:
    """All numbers of a change, by full name."""
    source = BASES[change.basis]
    found = {
        "before": Quantity(change.before, change.unit, source),
        "after": Quantity(change.after, change.unit, source),
    }
    if change.gain is not None:
        found["gain"] = Quantity(100 * change.gain, "%", source, 2)
    if change.volume_gain is not None:
        found["volume_gain"] = Quantity(100 * change.volume_gain, "%", source, 2)
    found |= {key: Quantity(n.value, n.unit, source, n.digits) for key, n in change.values.items()}
    return {_name(change, part): quantity for part, quantity in found.items()}


def _text(change: Change, text: str) -> str:
    """A text of a change with the full names of its quantities."""
    return _NAMED.sub(lambda found: f"{{{_name(change, found.group(1))}}}", text)


def _gain(change: Change) -> str:
    """The figure before and after, and the gain, with the full names of the quantities."""
    words = f"{change.figure}: {{before}} to {{after}} {unit_words(change.unit)}"
    if change.gain:
        words += " ({gain} % less)" if change.less_is_better else f" ({'+' * (change.gain > 0)}{{gain}} %)"
    if change.volume_gain:
        words += f"; volume of colours {'+' * (change.volume_gain > 0)}{{volume_gain}} %"
    return _text(change, words)


def _line(change: Change) -> str:
    return f"{_text(change, change.title)}: {_gain(change)}"


def _table(changes: Sequence[Change], bench: str) -> Table:
    """What helps; of second sheets the best alone, since the chart shows all."""
    sheet = next((change for change in changes if change.aim == "shared"), None)
    rows = tuple(
        (_text(change, change.title), _gain(change), _text(change, change.cost), _text(change, change.how))
        for change in changes
        if change.aim != "shared" or change is sheet
    )
    caption = f"What helps, by what it is for and by its gain{bench}."
    return Table(
        "recommendations-table",
        caption,
        ("Change", "Gain", "What it costs", "How (keys of paxel.toml)"),
        rows,
        words=True,
    )


def _charts(case: Case, changes: Sequence[Change], quantities: Mapping[str, Quantity], bench: str) -> list[Chart]:
    """Bars of all changes that have a gain, and the ranges of lightness of gray sheets."""
    groups = [
        (heading, [_bar(change, quantities) for change in changes if change.aim == aim and change.gain is not None])
        for aim, heading in AIMS.items()
    ]
    groups = [(heading, bars) for heading, bars in groups if bars]
    charts = []
    if groups:
        caption = f"Expected gain of each change over the present figure{bench}."
        charts.append(Chart("recommendations-gains", caption, gains_chart(groups)))
    sheets = sorted((c for c in changes if c.aim == "shared"), key=lambda c: c.key, reverse=True)
    if sheets:
        ranges = [("second surface as it is", common_range(case.model))]
        ranges += [(filled(_text(change, "gray sheet of {sheet}"), quantities), _shared(change)) for change in sheets]
        caption = (
            "Lightness that the pattern and the second surface can both show, by how much the sheet reflects of what "
            f"the white paper does{bench}."
        )
        charts.append(Chart("recommendations-sheets", caption, shared_ranges_chart(ranges)))
    return charts


def _bar(change: Change, quantities: Mapping[str, Quantity]) -> GainBar:
    volume = None if change.volume_gain is None else 100 * change.volume_gain
    return GainBar(filled(_text(change, change.title), quantities), 100 * (change.gain or 0.0), volume)


def _shared(change: Change) -> tuple[float, float] | None:
    value = change.values["shared"].value
    assert isinstance(value, tuple)
    return (value[0], value[1]) if value[1] > value[0] else None
