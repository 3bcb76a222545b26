"""The figures of one projection in two tables: what fitting its pictures cost, and how well they are seen."""

from __future__ import annotations

from collections.abc import Mapping

from paxel_design.report.content import Block, Paragraph, Quantity, Table, Verdict
from paxel_design.report.rules import judged
from paxel_design.report.sections.gamut_texts import surface_words
from paxel_design.report.sections.parts import Part, on_the_bench
from paxel_design.report.source import ReportSource, recorded
from paxel_runtime.stages.projected import Projected

__all__ = ["picture_tables"]

_SHARE = "share"
"""Unit of what is recorded as 0..1 and told in percent."""

_FITTING = {
    "pixels_in_gamut_before": ("colours that were in reach as they were, %", _SHARE),
    "pixels_moved": ("pixels whose chroma was lowered, %", _SHARE),
    "chroma_kept": ("chroma kept, %", _SHARE),
    "L_from": ("lightness of the picture, L*", "L*"),
    "L_to": ("lightness it was given, L*", "L*"),
}
"""Of ``mapping`` in the projection's record."""

_SEEN = {
    "dE00_mean": ("off the fitted picture, mean dE00", "dE00"),
    "dE00_p95": ("off the fitted picture, 95 % dE00", "dE00"),
    "source_dE00_mean": ("off the wanted picture, mean dE00", "dE00"),
    "ghosting_percent": ("other picture shining through, %", "%"),
    "ghosting_fine_percent": ("its details, %", "%"),
    "texture_L": ("texture of the dots, rms L*", "L*"),
    "texture_ghost_percent": ("other picture in the texture, %", "%"),
    "coherent_gain": ("height of edges kept, %", _SHARE),
    "local_contrast_kept": ("local contrast kept of the wanted, %", _SHARE),
    "L_range": ("lightness as seen, L*", "L*"),
    "chroma_mean": ("chroma as seen, mean", "CIELAB"),
    "minimum_distance_mm": ("dots vanish from, mm", "mm"),
    "verdict": ("verdict of the preview", ""),
}
"""Of ``on_<surface>`` in the preview's record."""

_JUDGED = {
    "dE00_mean": ("colours-seen", 1.0),
    "ghosting_percent": ("ghosting", 1.0),
    "local_contrast_kept": ("contrast-kept", 1.0),
}


def picture_tables(source: ReportSource, key: str, projected: Projected) -> Part:
    """Tables of the records of a projection and its preview, with verdicts.

    Parameters
    ----------
    source : ReportSource
    key : str
        Of the projection, in the names of quantities and anchors.
    projected : Projected
    """
    words, bench = surface_words(source), on_the_bench(source)
    places = {surface: f"pictures.{key}.on-{surface}" for surface in projected.mapped}
    record, preview = f"projection/{projected.name}.json", f"preview/{projected.name}.json"
    quantities: dict[str, Quantity] = {}
    fitting = _table(
        source,
        (f"pictures-{key}-fitting", f"{projected.name}: what fitting cost{bench}."),
        {surface: f"{record}#/mapping/{surface}" for surface in places},
        _FITTING,
        places,
        quantities,
        words,
    )
    seen = _table(
        source,
        (f"pictures-{key}-seen", f"{projected.name}: what is seen{bench}."),
        {surface: f"{preview}#/on_{surface}" for surface in places},
        _SEEN,
        places,
        quantities,
        words,
    )
    blocks = [
        *fitting,
        *_reach(source, record, f"pictures.{key}", quantities),
        *seen,
        *_change(source, f"{preview}#/change", f"pictures.{key}.change", quantities),
    ]
    return Part(blocks, quantities, _verdicts(projected.name, words, places, quantities))


def _table(
    source: ReportSource,
    name_and_caption: tuple[str, str],
    pointers: Mapping[str, str],
    figures: Mapping[str, tuple[str, str]],
    places: Mapping[str, str],
    quantities: dict[str, Quantity],
    words: Mapping[str, str],
) -> list[Block]:
    """A row a figure, a column a surface; rows and columns without any figure are left out."""
    found = {
        (figure, surface): recorded(source, f"{pointer}/{figure}", percent=True)
        if unit == _SHARE
        else recorded(source, f"{pointer}/{figure}", unit)
        for figure, (_, unit) in figures.items()
        for surface, pointer in pointers.items()
    }
    told = {at: value for at, value in found.items() if value is not None}
    if not told:
        return []
    quantities |= {f"{places[surface]}.{figure}": value for (figure, surface), value in told.items()}
    columns = [surface for surface in pointers if any(at[1] == surface for at in told)]
    rows = tuple(
        (title, *(f"{{{places[s]}.{figure}}}" if (figure, s) in told else "-" for s in columns))
        for figure, (title, _) in figures.items()
        if any(at[0] == figure for at in told)
    )
    header = ("", *(f"on the {words[surface]}" for surface in columns))
    return [Table(*name_and_caption, header, rows)]


def _reach(source: ReportSource, record: str, own: str, quantities: dict[str, Quantity]) -> list[Block]:
    """How many pixels show what was fitted."""
    reach = recorded(source, f"{record}#/pixels_in_gamut", percent=True)
    largest = recorded(source, f"{record}#/dE00_max", "dE00")
    if reach is None or largest is None:
        return []
    quantities |= {f"{own}.in_reach": reach, f"{own}.dE00_max": largest}
    if reach.value == 100:
        return [Paragraph(f"Every pixel can show what was fitted, to {{{own}.dE00_max}} dE00.")]
    return [
        Paragraph(
            f"{{{own}.in_reach}} % of the pixels can show exactly what was fitted, on all surfaces at once; the others "
            f"are at most {{{own}.dE00_max}} dE00 off."
        )
    ]


def _change(source: ReportSource, pointer: str, own: str, quantities: dict[str, Quantity]) -> list[Block]:
    """What an effect with one picture did to its colours from surface to surface."""
    units = {"hue_turn_deg": "degrees", "hue_turn_sd_deg": "degrees", "chroma_ratio": ""}
    found = {name: recorded(source, f"{pointer}/{name}", unit) for name, unit in units.items()}
    told = {f"{own}.{name}": value for name, value in found.items() if value is not None}
    quantities |= told
    parts = []
    if f"{own}.hue_turn_deg" in told and f"{own}.hue_turn_sd_deg" in told:
        parts.append(
            f"hues turn by {{{own}.hue_turn_deg}} degrees (standard deviation {{{own}.hue_turn_sd_deg}} degrees)"
        )
    if f"{own}.chroma_ratio" in told:
        parts.append(f"chroma is {{{own}.chroma_ratio}} times as large")
    return [Paragraph(f"From surface to surface {' and '.join(parts)}.")] if parts else []


def _verdicts(
    name: str, words: Mapping[str, str], places: Mapping[str, str], quantities: Mapping[str, Quantity]
) -> tuple[Verdict, ...]:
    return tuple(
        judged(rule, f"{own}.{figure}", quantities, scale, of=f"({name}, {words[surface]})")
        for surface, own in places.items()
        for figure, (rule, scale) in _JUDGED.items()
        if f"{own}.{figure}" in quantities
    )
