"""The printed pattern: what hangs on the wall, its spectrum, and how visible it and its moire are to the viewer.

All of it is computed from the design; nothing here was measured, on the virtual bench or elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from paxel_design.printing.preview import pattern_detail
from paxel_design.report.charts.pattern import MOIRE_GAIN, crop_with_ruler, moire_pictures, spectrum_chart
from paxel_design.report.content import (
    Block,
    Chart,
    Heading,
    Paragraph,
    Picture,
    Pictures,
    Quantity,
    Section,
    Table,
    Verdicts,
)
from paxel_design.report.rules import judged
from paxel_design.report.source import ReportSource, quantities_at
from paxel_design.stages.print_sheet import visibility_of
from paxel_design.visibility import layout_spectrum
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.printed import printed_pattern

__all__ = ["section"]

_TITLE = "The pattern"
_CROP_MM = (132.0, 30.0)
_BEATS = 3
_MIDDLE = slice(128, 192)
"""Rows and columns of the middle of a moire picture."""
_LOOKED_AT = {
    "distance_mm": "viewing.distance_mm",
    "luminance_cd_m2": "viewing.luminance_cd_m2",
}

_PRINT = {
    "layout": ("layout", ""),
    "colorants": ("colorants", ""),
    "dot_size_mm": ("dot_size_mm", "mm"),
    "angle_deg": ("angle_deg", "degrees"),
    "width_mm": ("size_mm/0", "mm"),
    "height_mm": ("size_mm/1", "mm"),
    "cell_rows": ("cells/rows", "dots"),
    "cell_columns": ("cells/columns", "dots"),
    "trim_width_mm": ("pdf/trim_mm/0", "mm"),
    "trim_height_mm": ("pdf/trim_mm/1", "mm"),
    "pages": ("pdf/pages", "pages"),
    "plates": ("pdf/plates", ""),
    "ink_spread_um": ("pdf/ink_spread_um", "um"),
    "dpi": ("inputs/settings/printer.dpi", "dots per inch"),
}

_SEEN = {
    "distance_mm": ("distance_mm", "mm"),
    "luminance_cd_m2": ("luminance_cd_m2", "cd/m2"),
    "pitch_mm": ("pixel_pitch_mm", "mm"),
    "seen_luminance": ("print/luminance", "thresholds"),
    "seen_opponent": ("print/opponent", "thresholds"),
    "seen_cpd": ("print/frequency_cpd", "cycles per degree"),
    "moire": ("moire/visibility", "thresholds"),
    "moire_contrast": ("moire/contrast", ""),
    "moire_period_mm": ("moire/period_mm", "mm"),
}


def section(source: ReportSource) -> Section:
    """The chapter; of a model.json alone, a sentence: it does not tell what is printed."""
    installation = source.installation
    if installation is None:
        text = (
            "A model.json tells what light does, not what is printed. In an installation folder this chapter shows the "
            "pattern at true scale, its spectrum, and how visible it and its moire are from the viewer's place: "
            "start one with paxel new."
        )
        return Section("pattern", _TITLE, (Paragraph(text),))
    pattern = printed_pattern(installation)
    source, recorded_view = _with_visibility(source, installation, pattern)
    quantities = _quantities(source, installation, recorded_view)
    seen = (
        judged("print", "pattern.seen", quantities),
        judged("moire", "pattern.moire", quantities),
    )
    blocks: list[Block] = [Paragraph(_INTRODUCTION)]
    blocks += [_true_scale(pattern), _facts(quantities), Heading("How visible it is"), Paragraph(_SEEN_TEXT)]
    blocks.append(Verdicts("pattern-verdicts", "The print as the viewer sees it (computed from the design).", seen))
    visibility = source.records[_VISIBILITY]
    pitch_mm, distance_mm = visibility["pixel_pitch_mm"], visibility["distance_mm"]
    chart = spectrum_chart(
        layout_spectrum(pattern), pattern.dot_size_mm, pitch_mm, distance_mm, visibility["luminance_cd_m2"]
    )
    blocks.append(
        Chart(
            "pattern-spectrum",
            "Spectrum of the print. Left: its lines in the plane. Right: their contrast by frequency, and what the eye "
            "just sees from the viewer's place (Barten); the dots are not seen as long as no line reaches the shade.",
            chart,
        )
    )
    blocks += [Heading("Moire"), *_moire(pattern, visibility, quantities)]
    return Section("pattern", _TITLE, tuple(blocks), quantities, seen)


_VISIBILITY = "print/visibility.json"

_INTRODUCTION = (
    "What hangs on the wall: layout {pattern.layout}, inks {pattern.colorants}, {pattern.width_mm} x "
    "{pattern.height_mm} mm, dots of {pattern.dot_size_mm} mm at {pattern.angle_deg} degrees. A projector pixel is "
    "{pattern.pitch_mm} mm wide on it, so that a dot spans {pattern.dot_px} pixels."
)

_SEEN_TEXT = (
    "Visibilities are counted in thresholds of contrast: 1 is just seen by half of the observers, 10 is plain. From "
    "{pattern.distance_m} m, with the lit print at {pattern.luminance_cd_m2} cd/m2, the dots reach {pattern.seen}; "
    "the line that is seen best has {pattern.seen_cpd} cycles per degree. A pattern that is seen by itself also makes "
    "the hidden picture legible as texture: stay at the distance the pictures' chapter names, or farther."
)


def _with_visibility(source: ReportSource, installation: Installation, pattern: Pattern) -> tuple[ReportSource, bool]:
    """The source with ``visibility.json`` of today's viewer and projector, and whether it is the recorded one."""
    settings = installation.settings
    there = source.records.get(_VISIBILITY, {})
    flat = settings.values()
    pitch_mm = settings.projector.width_mm / settings.projector.resolution[0]
    if all(there.get(key) == flat[name] for key, name in _LOOKED_AT.items()) and there["pixel_pitch_mm"] == pitch_mm:
        return source, True
    return replace(source, records={**source.records, _VISIBILITY: visibility_of(pattern, settings)}), False


def _quantities(source: ReportSource, installation: Installation, recorded_view: bool) -> dict[str, Quantity]:
    """Of the print, of the view, and what follows from them."""
    quantities = quantities_at(
        source, {f"pattern.{key}": (f"print/pattern.json#/{path}", unit) for key, (path, unit) in _PRINT.items()}
    )
    colorants = source.records["print/pattern.json"]["colorants"]
    quantities |= quantities_at(
        source, {f"pattern.share.{name}": (f"print/pattern.json#/shares/{name}", "share") for name in colorants}
    )
    seen = {f"pattern.{key}": (f"{_VISIBILITY}#/{path}", unit) for key, (path, unit) in _SEEN.items()}
    beats = source.records[_VISIBILITY].get("beats", [])[:_BEATS]
    for k in range(len(beats)):
        seen[f"pattern.beat.{k}.period_mm"] = (f"{_VISIBILITY}#/beats/{k}/period_mm", "mm")
        seen[f"pattern.beat.{k}.direction_deg"] = (f"{_VISIBILITY}#/beats/{k}/direction_deg", "degrees")
    told = quantities_at(source, seen)
    if not recorded_view:
        words = "computed for the viewer and the projector of paxel.toml, as paxel pattern does for visibility.json"
        told = {name: replace(quantity, source=words) for name, quantity in told.items()}
    quantities |= told
    scale = installation.settings.printer.measured_ruler_mm
    quantities["pattern.rulers_mm"] = Quantity(
        f"{scale[0]:g} and {scale[1]:g}", "mm", "paxel.toml: printer.measured_ruler_mm"
    )
    record = source.records[_VISIBILITY]
    seen_at_all = float((record["print"]["luminance"] ** 2 + record["print"]["opponent"] ** 2) ** 0.5)
    quantities["pattern.distance_m"] = Quantity(record["distance_mm"] / 1000, "m", "the viewer's distance in metres", 2)
    words = "root of the squares of its visibility in luminance and in opponent colours"
    quantities["pattern.seen"] = Quantity(seen_at_all, "thresholds", words, 2)
    dot_px = source.records["print/pattern.json"]["dot_size_mm"] / record["pixel_pitch_mm"]
    quantities["pattern.dot_px"] = Quantity(dot_px, "pixels", "dot size over the projector's pixel on the wall")
    return quantities


def _true_scale(pattern: Pattern) -> Pictures:
    """A crop that a ruler can be laid on, and one enlarged."""
    width_mm, height_mm = (min(limit, size) for limit, size in zip(_CROP_MM, pattern.size_mm, strict=True))
    crop = Picture(
        crop_with_ruler(pattern, width_mm, height_mm),
        "true scale",
        "ruler in millimetres; true on A4 printed at 100 %",
        width_mm=width_mm,
    )
    glows = any(ink.fluorescence is not None and ink.spot for ink in pattern.palette)
    light = "inks in the colour of their own light" if glows else "colours under D65"
    detail = Picture(pattern_detail(pattern), "enlarged: 14 dots wide", light)
    return Pictures("pattern-crops", "The middle of the pattern.", (crop, detail))


def _facts(quantities: Mapping[str, Quantity]) -> Table:
    """What the print shop and the technician need."""
    inks = [name.removeprefix("pattern.share.") for name in quantities if name.startswith("pattern.share.")]
    spread = "nothing done against ink spread"
    if quantities["pattern.ink_spread_um"].value:
        spread = "every edge is drawn in by {pattern.ink_spread_um} um against ink spread"
    rows = [
        ("repeats after", "{pattern.cell_columns} x {pattern.cell_rows} dots"),
        ("ink, share of the area", "; ".join(f"{name} {{pattern.share.{name}}} %" for name in inks)),
        ("sheet after cutting", "{pattern.trim_width_mm} x {pattern.trim_height_mm} mm, pages: {pattern.pages}"),
        ("plates", "{pattern.plates}"),
        ("printer", f"{{pattern.dpi}} dots per inch; {spread}"),
        ("rulers as measured on the print", "{pattern.rulers_mm} mm; 100 mm as designed"),
    ]
    return Table("pattern-facts", "The print sheet.", ("what", "is"), tuple(rows), words=True)


def _moire(pattern: Pattern, visibility: Mapping[str, Any], quantities: Mapping[str, Quantity]) -> list[Block]:
    """How the raster beats with the print, as a picture and as periods."""
    if "pattern.moire_period_mm" in quantities:
        text = (
            "The projector's raster beats with the print. With one cluster lit alone, the worst case, the beat reaches "
            "{pattern.moire} thresholds at a period of {pattern.moire_period_mm} mm (contrast {pattern.moire_contrast},"
            ' the worst within 1 % of zoom). Pictures light all clusters, and assembly.method = "refine" evens out '
            "most of what is left."
        )
    else:
        text = "The projector's raster makes no beat with the print that is slower than its dots."
    lit, seen = moire_pictures(
        pattern,
        visibility["pixel_pitch_mm"],
        visibility["distance_mm"],
        K=visibility["moire"]["clusters"],
        partition=visibility["moire"]["partition"],
    )
    blocks: list[Block] = [
        Paragraph(text),
        Pictures(
            "pattern-moire-picture",
            "The cluster of the brightest ink, lit alone (simulated).",
            (
                Picture(lit[_MIDDLE, _MIDDLE], "its middle", "64 x 64 projector pixels", pixelated=True),
                Picture(lit, "what returns", "320 x 320 projector pixels"),
                Picture(seen, "what reaches the eye", f"its contrast raised {MOIRE_GAIN:g} times"),
            ),
        ),
    ]
    beats = [name for name in quantities if name.startswith("pattern.beat.") and name.endswith("period_mm")]
    if beats:
        rows = tuple(
            (str(k + 1), f"{{pattern.beat.{k}.period_mm}}", f"{{pattern.beat.{k}.direction_deg}}")
            for k in range(len(beats))
        )
        header = ("beat, strongest first", "period, mm", "across the stripes, degrees from +x")
        blocks.append(Table("pattern-beats", "Where the beats come from the geometry alone.", header, rows))
    return blocks
