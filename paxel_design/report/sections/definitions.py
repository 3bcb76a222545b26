"""What the report's words and sets mean: definitions, thresholds, glossary. Fixed text, the same in every report."""

from __future__ import annotations

from collections.abc import Mapping

from paxel_design.report.content import Block, Heading, Paragraph, Section, Table
from paxel_design.report.rules import rules_table
from paxel_design.report.source import ReportSource

__all__ = ["DEFINITIONS", "GLOSSARY", "section"]

DEFINITIONS: dict[str, str] = {
    "white and colour": (
        "All colours are CIELAB under the installation's own white: full white (all inputs at full, black level and "
        "ambient light included) on the white paper; with one surface, all clusters at full. A picture's colours are "
        "taken as numbers under its own white and used as targets under this one."
    ),
    "dE00": (
        "The CIEDE2000 difference of two colours. About 1 is just told side by side; 2 is the paper's tolerance; sets "
        "in this report are exact (tolerance 0) unless they say otherwise."
    ),
    "gamut, joint gamut": (
        "All colours of one surface; all pairs of colours, one on each surface, that one input makes. Light adds up, "
        "so that the joint gamut is a convex body (a zonotope) in the six dimensions of two XYZ, and the sets below "
        "are cut from it without sampling."
    ),
    "full": "Every colour of the surface, whatever the other surface then shows.",
    "hue shift": (
        "Colours whose partner on the other surface can have a hue at least the angle away and a chroma of at least "
        "the least chroma (5 if not said). Found on a grid of CIELAB, and refined."
    ),
    "chroma scaling": (
        "Colours whose partner can have the same hue, with its chroma multiplied by at least (or at most) the factor."
    ),
    "decolorisation": (
        "Colours whose partner can be gray; its lightness is free, in a fixed relation, or the same. 'Same' is nearly "
        "empty beside a white sheet: the pattern is always darker."
    ),
    "neutralisation": "Colours of one surface whose partner can be one fixed colour: the picture is hidden there.",
    "dual image": (
        "A pair of sets, one for each surface, of which every colour of one goes with every colour of the other: any "
        "two pictures can be shown at once, each mapped for itself."
    ),
    "full change": (
        "The paper's set for two pictures: colours that can change to their opposite hue and to a chosen black and "
        "white. Taken side by side it is no product; a few pairs are out of reach."
    ),
    "lightness area, rectangle": (
        "All pairs of grays (L* on the pattern, L* on the white surface) that can be shown together, and its largest "
        "rectangle: the ranges of L* that two independent gray pictures have."
    ),
    "hue area": (
        "The area in (a*, b*) of the colours that can stand on the pattern with the same colour turned by the angle on "
        "the white surface, for some ('any') or for all ('all') lightnesses of the rectangle."
    ),
    "coverage": "The share of another body's volume (sRGB, DCI-P3, Rec. 2020) that lies inside a gamut.",
    "ghosting": (
        "What shines through of the other picture. With R = the difference in L* of the seen view and the wanted one, "
        "both through the observer's eye, the fit R ~ 1 + own + other gives 100 x |coefficient of other|, in %. Under "
        "adaptive mapping a planted mark tells more: the change of this view, in L*, when a mark is put into the other "
        "picture."
    ),
    "texture, minimum distance": (
        "Nearer than a few metres a millimetre of dot is seen, and the other picture becomes legible by the texture of "
        "its dots; the minimum distance is where that ends. No assembly removes it."
    ),
    "what the projection image gives away": (
        "How well the picture for a surface is found in the projection image itself, by whoever has no pattern: 1 is "
        "plainly, 0 not at all; blurred, and by the texture of its dots."
    ),
    "visibility": (
        "In thresholds of contrast at the viewer's distance and luminance (Barten for luminance, S-CIELAB for colour): "
        "1 is just seen by half of the observers, 10 is plain."
    ),
    "purity": "The share of a cluster's light that meets one ink.",
}

GLOSSARY: dict[str, str] = {
    "chroma, hue": "how saturated a colour is, and its family (red, yellow, ...)",
    "CIELAB": (
        "perceptually uniform colour space made from XYZ and a white point; here always the full white on white paper"
    ),
    "CIEXYZ": "device-independent colour from the colour-matching functions; here Y = 1 for that white",
    "cluster": "a group of projector pixels that light the same colorant, formed by k-means on colour",
    "colorant": "one colour that is present on the pattern surface: an ink, or the bare paper",
    "colour-changing effect": "one projection whose colour changes when the surface is exchanged",
    "colour prediction model": "what is seen on each surface for any input of the projector",
    "DLP projector": "one that modulates light with micromirrors",
    "dual-image projection": ("an effect that embeds two pictures, one for the pattern and one for the white surface"),
    "nodal image": "the scene as a camera would see it from the projector, one value a projector pixel",
    "pattern surface": "the projection surface with the printed high-frequency pattern",
    "procams": "a system of projectors and cameras whose geometry is known",
    "projector colour, channel": "one light channel of the projector",
    "reflectance": "share of the light that the surface returns, for each wavelength",
    "sub-gamut": "the colours that an effect can use, a closed volume in colour space",
    "vignetting, defocus": "loss of light and sharpness towards the corners",
    "white surface": "a plain white sheet",
    "dE00": "the CIEDE2000 difference between two colours",
}
"""As in the README; a test holds the two together."""


def section(source: ReportSource) -> Section:
    """The chapter; of `source` only whether there is a bench to explain."""
    blocks: list[Block] = [
        Heading("Sets and figures"),
        _words("definitions-table", "What the sets and figures of this report are.", DEFINITIONS),
        Heading("Thresholds"),
        rules_table(),
        Heading("Glossary"),
        _words("glossary-table", "The paper's terms.", GLOSSARY),
    ]
    if source.bench:
        text = (
            "Virtual bench: a simulated projector, print, camera and spectroradiometer with the faults of real ones. "
            "Figures marked so come from there; the paper's were measured on hardware, so that the two are not to be "
            "compared digit by digit."
        )
        blocks.insert(0, Paragraph(text))
    return Section("definitions", "Definitions and glossary", tuple(blocks))


def _words(name: str, caption: str, meanings: Mapping[str, str]) -> Table:
    return Table(name, caption, ("term", "means"), tuple(meanings.items()), words=True)
