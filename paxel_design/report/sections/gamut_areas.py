"""The parts of the gamut section on areas: grays that both surfaces can show at once, and hues that can be turned."""

from __future__ import annotations

from functools import partial

from paxel_design.gamut import JointGamut, hue_change_area, hue_figures, lightness_area, lightness_figures
from paxel_design.report.charts.hue import hue_chart
from paxel_design.report.charts.lightness import lightness_chart
from paxel_design.report.content import Block, Chart, Heading, Paragraph, Quantity, Table
from paxel_design.report.rules import judged
from paxel_design.report.sections.gamut_sets import COMPUTED, Figures, figures_of
from paxel_design.report.sections.gamut_texts import surface_words
from paxel_design.report.sections.parts import NO_PART, Part, on_the_bench
from paxel_design.report.source import ReportSource
from paxel_runtime.errors import GamutError

__all__ = ["HUE_ANGLES_DEG", "hue", "lightness"]

HUE_ANGLES_DEG = (45.0, 90.0, 180.0)

_LENGTH = "upper end less lower end"


def lightness(source: ReportSource, joint: JointGamut) -> Part:
    """The lightness area with its rectangle (Fig. 13), and ranges that both surfaces have in common."""
    heading = Heading("Lightness that can be chosen freely")
    try:
        found = figures_of(source, "gamut/lightness.json", lambda: lightness_figures(lightness_area(joint)))
    except GamutError as error:
        none = {"gamut.lightness.missing": Quantity(str(error), "", COMPUTED)}
        return Part([heading, Paragraph("There is no lightness area: {gamut.lightness.missing}.")], none)
    there, bench = surface_words(source)["white"], on_the_bench(source)
    on_pattern, on_white = (found.at(f"rectangle/L_{surface}") for surface in ("pattern", "white"))
    lengths = on_pattern[1] - on_pattern[0], on_white[1] - on_white[0]
    quantities = {
        "gamut.lightness.area": found.quantity("area", "L* x L*"),
        "gamut.lightness.L_pattern": found.quantity("rectangle/L_pattern", "L*"),
        "gamut.lightness.L_white": found.quantity("rectangle/L_white", "L*"),
        "gamut.lightness.range_pattern": Quantity(lengths[0], "L*", _LENGTH),
        "gamut.lightness.range_white": Quantity(lengths[1], "L*", _LENGTH),
        "gamut.lightness.least_range": Quantity(min(lengths), "L*", "the shorter of both ranges"),
    }
    caption = (
        f"Grays that the pattern and the {there} can show at once: area {{gamut.lightness.area}} L* x L*. In the "
        f"hatched rectangle both lightnesses are free{bench}."
    )
    text = (
        "Any gray from L* {gamut.lightness.L_pattern} on the pattern goes with any gray from L* "
        f"{{gamut.lightness.L_white}} on the {there}: {{gamut.lightness.range_pattern}} and "
        "{gamut.lightness.range_white} units of lightness. That is the contrast of two pictures that have nothing to "
        "do with each other; a photograph on paper has about 90. Two given pictures need not use the rectangle alone: "
        "mapped together (adaptive mapping) they get more of the gray area."
    )
    common, table = _common_ranges(found, bench)
    note = (
        "Ink swallows light, so the pattern is always darker than a white sheet. Where both pictures shall look "
        "equally bright, hold a neutral gray sheet before it (Section VII of the paper)."
    )
    blocks: list[Block] = [
        heading,
        Chart("gamut-lightness", caption, lightness_chart(found.at("polygon"), on_pattern, on_white, there)),
        Paragraph(text),
        table,
        Paragraph(note, small=True),
    ]
    verdict = judged("lightness", "gamut.lightness.least_range", quantities)
    return Part(blocks, quantities | common, (verdict,))


def _common_ranges(found: Figures, bench: str) -> tuple[dict[str, Quantity], Table]:
    """The range of L* that both surfaces can have at once, for this second surface and for gray sheets."""
    quantities: dict[str, Quantity] = {}
    rows = []
    for key, ends in found.at("same_range_by_sheet").items():
        sheet = "white sheet" if key == "white" else f"gray sheet of {100 * float(key.split()[1]):.0f} % luminance"
        if ends is None:
            rows.append((sheet, "none", "none"))
            continue
        name = f"gamut.lightness.common.{key.replace(' ', '-')}"
        quantities[name] = found.quantity(f"same_range_by_sheet/{key}", "L*")
        quantities[f"{name}.length"] = Quantity(ends[1] - ends[0], "L*", _LENGTH)
        rows.append((sheet, f"{{{name}}}", f"{{{name}.length}}"))
    caption = f"The range of L* that both surfaces can have in common, by second surface{bench}."
    header = ("second surface", "common range, L*", "its length, L*")
    return quantities, Table("gamut-common-range", caption, header, tuple(rows))


def hue(source: ReportSource, joint: JointGamut) -> Part:
    """Hue-change areas at three angles (Fig. 13)."""
    areas, rows = {}, []
    quantities: dict[str, Quantity] = {}
    for angle in HUE_ANGLES_DEG:
        stem = f"hue-{angle:g}"
        try:
            found = figures_of(source, f"gamut/{stem}.json", partial(_hue_figures, joint, angle))
        except GamutError:
            return NO_PART  # without a lightness area, of which `lightness` tells
        areas[angle] = (found.at("polygon_any"), found.at("polygon_all"))
        for key in ("area_any", "area_all"):
            quantities[f"gamut.{stem}.{key}"] = found.quantity(key, "CIELAB^2")
        rows.append((f"{angle:g}°", f"{{gamut.{stem}.area_any}}", f"{{gamut.{stem}.area_all}}"))
    there, bench = surface_words(source)["white"], on_the_bench(source)
    caption = (
        "Colours on the pattern, seen along the gray axis, whose hue can turn by an angle on the "
        f"{there}; the ring shows which way each hue lies{bench}."
    )
    note = (
        "Any: the colour and its turned partner can be shown at once for some lightnesses of the rectangle above. All: "
        "for every lightness of the rectangle halved about its centre, so that a picture may be light or dark there. "
        "The farther from the centre, the more colourful."
    )
    header = ("turn of hue", "any lightness, CIELAB²", "all lightnesses, CIELAB²")
    blocks: list[Block] = [
        Heading("Hue that can be turned"),
        Chart("gamut-hue", caption, hue_chart(areas)),
        Table("gamut-hue-areas", f"Hue-change areas in a* x b*{bench}.", header, tuple(rows)),
        Paragraph(note, small=True),
    ]
    verdict = judged("hue-area", "gamut.hue-180.area_all", quantities, of="by 180° at any lightness")
    return Part(blocks, quantities, (verdict,))


def _hue_figures(joint: JointGamut, angle_deg: float) -> dict[str, object]:
    return hue_figures(hue_change_area(joint, angle_deg))
