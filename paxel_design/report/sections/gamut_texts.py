"""What each set of colours is called and what it means, for readers who do not know CIELAB.

The words of the gamut section that hold no figure of an installation.
"""

from __future__ import annotations

from collections.abc import Mapping

from paxel_design.report.source import ReportSource
from paxel_runtime.model.effects import Chroma, Decolorize, DualImage, Effect, Full, FullChange, HueShift, Neutralize

__all__ = ["meaning", "set_title", "surface_words"]


def surface_words(source: ReportSource) -> dict[str, str]:
    """What the surfaces are called in texts, by their names in models."""
    gray = source.installation is not None and source.installation.settings.model.second_surface == "gray"
    return {"pattern": "pattern", "white": "gray sheet" if gray else "white sheet"}


def set_title(effect: Effect) -> str:
    """A set in a few words."""
    if isinstance(effect, HueShift):
        return f"Hue turned by {abs(effect.angle_deg):g}° or more"
    if isinstance(effect, Neutralize):
        return "One colour: Lab({:g}, {:g}, {:g})".format(*effect.Lab)
    if isinstance(effect, Chroma):
        return f"Chroma times {effect.scale:g}"
    if isinstance(effect, Decolorize):
        return "Decolorised" if effect.lightness == "free" else f"Decolorised, gray {effect.lightness}"
    titles: Mapping[type[Effect], str] = {Full: "Full gamut", DualImage: "Two free pictures", FullChange: "Full change"}
    return titles.get(type(effect), effect.text)


def meaning(effect: Effect, here: str, there: str) -> str:
    """What the colours of a set can do, shown on the surface `here`, with the other called `there`."""
    if isinstance(effect, HueShift):
        return (
            f"colours that can have, on the {there}, a hue at least {abs(effect.angle_deg):g}° away, in either "
            "direction"
        )
    if isinstance(effect, Neutralize):
        return (
            "colours that can all turn into the one colour Lab({:g}, {:g}, {:g}) on the ".format(*effect.Lab)
            + f"{there}: a picture in them is hidden there"
        )
    if isinstance(effect, DualImage):
        return f"each of these colours goes with each colour of the other set on the {there}"
    if isinstance(effect, Decolorize):
        return f"colours that can turn gray on the {there}, lighter or darker as it comes"
    if isinstance(effect, FullChange):
        return (
            f"colours that go with a black, with a white and with their complement on the {there} (the paper's set for "
            "two pictures, side by side; up to a few percent of its pairs fail)"
        )
    if isinstance(effect, Full):
        return f"every colour that the {here} can show, whatever the {there} then shows"
    return f"colours that the effect {effect.text} can use"
