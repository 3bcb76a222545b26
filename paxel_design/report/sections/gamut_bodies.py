"""The parts of the gamut section on sets of colours: volumes, the full gamuts, sub-gamuts and the product pair."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from paxel_design.gamut.comparison import rgb_space
from paxel_design.gamut.meshes import gamut_mesh
from paxel_design.gamut.scenes import SceneBody
from paxel_design.report.content import Block, Heading, Paragraph, Quantity, Scene, Table, Verdict
from paxel_design.report.rules import judged
from paxel_design.report.sections.gamut_sets import COMPUTED, DRAWN_DEVIATION, DRAWN_EDGE, ColourSet, share_of
from paxel_design.report.sections.gamut_texts import meaning, set_title, surface_words
from paxel_design.report.sections.parts import NO_PART, Part, on_the_bench
from paxel_design.report.source import ReportSource
from paxel_runtime.model.effects import DualImage, Full, HueShift, Neutralize
from paxel_runtime.model.subgamut import SURFACES

__all__ = ["full_gamuts", "product_pair", "sub_gamuts", "volumes"]

_OUTER_COLOR, _INNER_COLORS = "#7f7f7f", ("#1f77b4", "#c8501e", "#2e8b57")
"""Their lightness differs, so that they are told apart in gray print too."""


def volumes(source: ReportSource, sets: Sequence[ColourSet], missing: Mapping[str, str]) -> Part:
    """A table of all sets, and why some do not exist.

    Parameters
    ----------
    source : ReportSource
    sets, missing : of `colour_sets`
    """
    words = surface_words(source)
    full = {one.shown_on: float(one.figures.at("volume")) for one in sets if isinstance(one.effect, Full)}
    sRGB = gamut_mesh(rgb_space("srgb"), DRAWN_EDGE)
    quantities: dict[str, Quantity] = {}
    rows = []
    for one in sets:
        name = f"gamut.{one.name}"
        held, inside = share_of(one, sRGB)
        quantities |= {
            f"{name}.volume": one.figures.quantity("volume", "CIELAB^3"),
            f"{name}.of_full": Quantity(100 * one.figures.at("volume") / full[one.shown_on], "%", "from both volumes"),
            f"{name}.area": one.figures.quantity("area", "CIELAB^2"),
            f"{name}.parts": one.figures.quantity("components"),
            f"{name}.srgb_held": one.figures.percent("coverage/srgb")
            if "coverage" in one.figures.values
            else Quantity(100 * held, "%", f"{COMPUTED}: volume shared with sRGB over that of sRGB"),
            f"{name}.inside_srgb": Quantity(
                100 * inside, "%", f"{COMPUTED}: volume shared with sRGB over that of the set"
            ),
        }
        columns = ("volume", "of_full", "area", "parts", "srgb_held", "inside_srgb")
        title = f"{set_title(one.effect)}, on the {words[one.shown_on]}"
        rows.append((title, *(f"{{{name}.{key}}}" for key in columns)))
    header = ("colours", "volume, CIELAB³", "of the full gamut, %", "surface, CIELAB²", "parts", "of sRGB held, %",
              "inside sRGB, %")  # fmt: skip
    caption = f"Sets of colours, in CIELAB under the white point{on_the_bench(source)}."
    note = (
        "Of sRGB held: how much of an ordinary screen's colours is there, both read under their own white. Inside "
        "sRGB: how much of the set a screen could show. Volumes and surfaces are those of the exact set, or on a grid "
        "for hue shifts. Bodies are drawn with fewer triangles: corners on the exact surface and edges up to "
        f"{DRAWN_EDGE:g} units, or moved by at most {DRAWN_DEVIATION:g} unit."
    )
    blocks: list[Block] = [
        Heading("Volumes"),
        Table("gamut-volumes", caption, header, tuple(rows)),
        Paragraph(note, small=True),
    ]
    for name, reason in missing.items():
        effect, _, surface = name.rpartition(".on-")
        quantities[f"gamut.{name}.missing"] = Quantity(reason, "", COMPUTED)
        text = f"No volume of colours for {effect} on the {words[surface]}: {{gamut.{name}.missing}}."
        blocks.append(Paragraph(text, small=True))
    verdicts: tuple[Verdict, ...] = ()
    if source.model.white is None:
        verdicts = (judged("srgb", "gamut.full.on-pattern.srgb_held", quantities),)
    return Part(blocks, quantities, verdicts)


def full_gamuts(source: ReportSource, sets: Sequence[ColourSet]) -> Part:
    """The full gamut of each surface, in its own colours."""
    words, bench = surface_words(source), on_the_bench(source)
    blocks: list[Block] = [Heading("Full gamut")]
    for one in sets:
        if isinstance(one.effect, Full):
            here = words[one.shown_on]
            caption = (
                f"Full gamut on the {here}, in its own colours: {{gamut.{one.name}.volume}} cubic CIELAB units, "
                f"{{gamut.{one.name}.srgb_held}} % of sRGB{bench}."
            )
            blocks.append(Scene(_anchor(one.name), caption, (SceneBody(one.drawn, f"full gamut on the {here}"),)))
    if source.model.white is None:
        sRGB = SceneBody(gamut_mesh(rgb_space("srgb"), DRAWN_EDGE), "sRGB", _OUTER_COLOR)
        body = SceneBody(next(one.drawn for one in sets if isinstance(one.effect, Full)), "the print", _INNER_COLORS[0])
        caption = (
            "The print's colours in those of an ordinary screen (sRGB, glassy where it is the larger body): "
            f"{{gamut.full.on-pattern.inside_srgb}} % of the print's lie in it{bench}."
        )
        blocks.append(Scene("gamut-full-and-srgb", caption, (sRGB, body)))
    return Part(blocks)


def sub_gamuts(source: ReportSource, sets: Sequence[ColourSet]) -> Part:
    """Each sub-gamut inside the full gamut of its surface (Fig. 4); hue shifts of one surface in one picture."""
    full = {one.shown_on: one for one in sets if isinstance(one.effect, Full)}
    groups: dict[tuple[str, str], list[ColourSet]] = {}
    for one in sets:
        if not isinstance(one.effect, Full | DualImage):
            stem = "hue-shift" if isinstance(one.effect, HueShift) else one.effect.name
            groups.setdefault((stem, one.shown_on), []).append(one)
    if not groups:
        return NO_PART
    quantities, verdicts = _hidden_range(source, sets)
    introduction = (
        "Each body holds the colours of one effect, inside the full gamut of its surface (glassy). The larger the "
        "body, the less a picture changes when it is fitted into it."
    )
    scenes = [_overlay(source, stem, group, full[surface]) for (stem, surface), group in groups.items()]
    return Part([Heading("Sub-gamuts"), Paragraph(introduction), *scenes], quantities, verdicts)


def _hidden_range(source: ReportSource, sets: Sequence[ColourSet]) -> tuple[dict[str, Quantity], tuple[Verdict, ...]]:
    """How much contrast a picture has that vanishes on the other surface."""
    one = next((s for s in sets if s.effect == Neutralize() and s.shown_on == "pattern"), None)
    if one is None:
        return {}, ()
    low, high = one.gamut.gray_range()
    name = f"gamut.{one.name}.L_range"
    quantities = {name: Quantity(high - low, "L*", f"{COMPUTED}: length of the gray axis inside the set")}
    return quantities, (judged("hidden-range", name, quantities, of=f"on the {surface_words(source)['white']}"),)


def product_pair(source: ReportSource, sets: Sequence[ColourSet]) -> Part:
    """The sets that any two pictures are fitted into."""
    full = {one.shown_on: one for one in sets if isinstance(one.effect, Full)}
    pairs = [one for one in sets if isinstance(one.effect, DualImage)]
    if not pairs:
        return NO_PART
    first, second = surface_words(source).values()
    blocks: list[Block] = [Heading("Two independent pictures: the product pair")]
    quantities: dict[str, Quantity] = {}
    verdicts: tuple[Verdict, ...] = ()
    sizes = {one.shown_on: float(one.figures.at("volume")) for one in pairs if one.effect == DualImage()}
    if len(sizes) == 2:
        blocks.append(
            Paragraph(
                "Two pictures that have nothing to do with each other take one set a surface: "
                f"{{gamut.dual-image.on-pattern.volume}} cubic CIELAB units on the {first} and "
                f"{{gamut.dual-image.on-white.volume}} on the {second}. Every colour of one goes with every colour of "
                "the other, and neither set can grow without breaking that: once both pictures are fitted into them, "
                "each is shown exactly, whatever the other shows at the same place."
            )
        )
        name = "gamut.dual-image.least_volume"
        quantities = {name: Quantity(min(sizes.values()), "CIELAB^3", "the smaller of both sides")}
        verdicts = (judged("product-pair", name, quantities),)
    blocks += [_overlay(source, one.effect.name, [one], full[one.shown_on]) for one in pairs]
    return Part(blocks, quantities, verdicts)


def _overlay(source: ReportSource, stem: str, group: Sequence[ColourSet], full: ColourSet) -> Scene:
    """Sets of one surface, the larger first, in its full gamut."""
    words, surface = surface_words(source), full.shown_on
    here, there = words[surface], words[SURFACES[1 - SURFACES.index(surface)]]
    group = sorted(group, key=lambda one: -one.drawn.mesh_volume)
    bodies = [SceneBody(full.drawn, f"full gamut on the {here}", _OUTER_COLOR)]
    bodies += [
        SceneBody(one.drawn, set_title(one.effect), _INNER_COLORS[k % len(_INNER_COLORS)])
        for k, one in enumerate(group)
    ]
    parts = [
        f"{set_title(one.effect)}, on the {here}: {meaning(one.effect, here, there)}; {{gamut.{one.name}.volume}} "
        f"cubic CIELAB units, {{gamut.{one.name}.of_full}} % of the full gamut{on_the_bench(source)}."
        for one in group
    ]
    return Scene(_anchor(f"{stem}-on-{surface}"), " ".join(parts), tuple(bodies))


def _anchor(name: str) -> str:
    return "gamut-" + re.sub(r"[^A-Za-z0-9_-]", "-", name)
