"""The section on pictures: every projection with its sources, what is seen of it, and what was lost on the way."""

from __future__ import annotations

import re
from collections.abc import Sequence

from paxel_design.report.charts.maps import scales_chart
from paxel_design.report.content import Block, Chart, Heading, Paragraph, Section, Verdicts
from paxel_design.report.sections.leaks import leaks
from paxel_design.report.sections.parts import Part, on_the_bench
from paxel_design.report.sections.picture_rows import picture_rows
from paxel_design.report.sections.picture_tables import picture_tables
from paxel_design.report.sections.seen import seen_projections
from paxel_design.report.source import ReportSource
from paxel_runtime.model.effects import parse_effect

__all__ = ["section"]

_COMMANDS = "paxel project DIR --effect dual-image --on-pattern a.jpg --on-white b.jpg, then paxel preview DIR"
_COMMANDS_OF_ONE = "paxel project DIR --effect monochrome --image a.jpg, then paxel preview DIR"


def section(source: ReportSource) -> Section:
    """Every projection that is up to date; where there is none, the command that makes one.

    Parameters
    ----------
    source : ReportSource
        Views are looked at once more on the virtual bench, some seconds an effect.
    """
    names = [path[len("projection/") : -len(".json")] for path in sorted(source.records) if _is_projection(path)]
    if source.installation is None or not names:
        return Section("pictures", "Pictures", (Paragraph(_nothing(source)),))
    parts: list[Part] = []
    maps = False
    for key, (projected, seen) in zip(_keys(names), seen_projections(source, names), strict=True):
        effect = parse_effect(projected.record["effect"])
        heading = Heading(f"{projected.name}: {effect.description}")
        rows = picture_rows(source, key, projected, seen)
        parts += [Part([heading]), rows, picture_tables(source, key, projected), leaks(source, key, projected, seen)]
        maps |= bool(seen)
    quantities = {name: quantity for part in parts for name, quantity in part.quantities.items()}
    verdicts = tuple(verdict for part in parts for verdict in part.verdicts)
    blocks: list[Block] = [Paragraph(_introduction(source))]
    if verdicts:
        blocks.append(Verdicts("pictures-verdicts", f"How well pictures are seen{on_the_bench(source)}.", verdicts))
    blocks.append(Chart("pictures-scales", _SCALES, scales_chart(maps)))
    blocks += [block for part in parts for block in part.blocks]
    return Section("pictures", "Pictures", tuple(blocks), quantities, verdicts)


_SCALES = "Scales of the maps below, light to dark in gray print too."


def _introduction(source: ReportSource) -> str:
    text = (
        "Each projection takes source pictures (wanted), fits their colours into what both surfaces can show at once "
        "(fitted), and computes the projection image, of which every pixel serves its own ink. "
    )
    if source.bench:
        return text + "What is seen was simulated on the virtual bench at the set distance, dots blurred as by the eye."
    return text + "What is seen has to be looked at on the wall."


def _nothing(source: ReportSource) -> str:
    if source.installation is None:
        return (
            "A model.json alone has no pictures: they need the map of which projector pixel lights which ink. In an "
            "installation they are made with paxel project and looked at with paxel preview."
        )
    commands = _COMMANDS if source.model.white is not None else _COMMANDS_OF_ONE
    return f"Nothing is projected yet, or it is out of date. Pictures are made with: {commands}."


def _is_projection(path: str) -> bool:
    return path.startswith("projection/") and path.endswith(".json")


def _keys(names: Sequence[str]) -> list[str]:
    """Names for quantities and anchors: letters, digits and dashes, each once."""
    keys: list[str] = []
    for name in names:
        key = re.sub(r"[^A-Za-z0-9_-]", "-", name)
        keys.append(key if key not in keys else f"{key}-{len(keys)}")
    return keys
