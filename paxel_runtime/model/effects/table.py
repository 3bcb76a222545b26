"""The table of effects: what each wants to be shown on the two surfaces, and how it is written in text.

This is the one truth for both packages: the design side makes a sub-gamut for each row of `EFFECTS`, the runtime
asks which pictures a row takes, and what the other surface is to show. An effect is a frozen dataclass of its settings;
text and file names follow from them. Nothing here knows how a sub-gamut is found (``paxel_design.gamut``) or how a
projection is made.

    text                    file name               object
    ``full``                ``full``                ``Full()``
    ``neutralize:50,0,0``   ``neutralize-50_0_0``   ``Neutralize(Lab=(50.0, 0.0, 0.0))``
    ``hue-shift:45``        ``hue-shift-45``        ``HueShift(angle_deg=45)``
    ``decolorize:free,2``   ``decolorize-free_2``   ``Decolorize("free", tolerance=2)``

A picture's colour (L, C, h) is p; its partner q is what the other surface shows at once:

    effect        pictures             sub-gamut: the p for which there is a q            q of a projection
    full          image                every p                                            left free
    monochrome    image                every p, on one surface                            -
    hue-shift     image                q's hue at least the angle from p's, either way,   (L', C, h + angle)
                                       q's chroma at least `CHROMA_FLOOR`
    chroma        image                q has p's hue and `scale` times its chroma         (L', scale C, h)
    decolorize    image                q is gray                                          (L', 0, -)
    neutralize    image                q is one colour                                    that colour
    watermark     image, mark          q has p's hue and chroma                           (L' + strength (mark's L*
                                                                                          - its mean), C, h)
    full-change   image                p goes with a black, with a white, and with its    (L', C, h + 180)
                                       complement (Section V-A1)
    dual-image    on_pattern, on_white one side of a pair of sets of which every p goes   the other picture
                                       with every q

L' follows from L by one rising curve: ``free``, the one that leaves the most room for chroma; ``relative``, p's own
place between black and full white of its surface, in linear light; ``same``, L itself. A `lightness_band` holds it near
L. With `tolerance` a sub-gamut allows q that are within a dE00 of the one meant; a projection asks for the one meant.
A complement's light and p's own add up to gray; its hue is the opposite one, up to the bend of CIELAB.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from paxel_runtime.errors import InputError
from paxel_runtime.model.effects.effect import (
    LIGHTNESSES,
    Effect,
    Partner,
    WithoutSettings,
    number_text,
    parts_of,
    set_number,
    text_of,
)

__all__ = [
    "CHROMA_FLOOR",
    "EFFECTS",
    "Chroma",
    "Decolorize",
    "DualImage",
    "Full",
    "FullChange",
    "HueShift",
    "Monochrome",
    "Neutralize",
    "Watermark",
    "parse_effect",
]

CHROMA_FLOOR = 5.0
"""Least chroma of the partner of a hue shift, CIELAB: below it a hue is not seen."""

LARGEST_HUE_SHIFT_DEG = 170.0
"""At 180 degrees the partners are half-planes without volume."""


@dataclass(frozen=True)
class Full(WithoutSettings):
    """Any colour of one surface, whatever the other surface then shows."""

    key = "full"
    description = "one picture in every colour its surface can show; the other surface is left free"
    surfaces = 1


@dataclass(frozen=True)
class Monochrome(WithoutSettings):
    """One colour picture from light of one channel (Section V-B of the paper): the same set as `Full`."""

    key = "monochrome"
    description = "one colour picture from single-channel light, such as ultraviolet, on fluorescent inks"
    surfaces = 1


@dataclass(frozen=True)
class HueShift(Effect):
    """One picture whose hues turn by an angle on the other surface (Fig. 4a), its chroma kept.

    Attributes
    ----------
    angle_deg : float
        Turn of hue, counter-clockwise in (a*, b*): -170 to 170, not 0. The sub-gamut holds the colours whose hue can
        turn at least as far, either way.
    lightness_band : float or None
        Largest difference of L* between both surfaces, > 0; None leaves it free.
    """

    angle_deg: float = 45.0
    lightness_band: float | None = None

    key = "hue-shift"
    description = "one picture whose hues turn by an angle on the other surface"
    in_sub_gamut = False

    def __post_init__(self) -> None:
        set_number(self, "angle_deg", -LARGEST_HUE_SHIFT_DEG, LARGEST_HUE_SHIFT_DEG, "45")
        if self.angle_deg == 0:
            raise InputError("effect hue-shift: angle_deg must not be 0; write for example hue-shift:45")
        set_number(self, "lightness_band", 0, 100, "45,10", above=True)

    @property
    def value(self) -> str:
        return text_of(self.angle_deg, self.lightness_band)

    @property
    def partner(self) -> Partner:
        return Partner(turn_deg=self.angle_deg, lightness_band=self.lightness_band)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*parts_of(value, 2, cls.key, "angle[,lightness band]"))  # type: ignore[arg-type]  # checked, made floats


@dataclass(frozen=True)
class Chroma(Effect):
    """One picture whose chroma is multiplied on the other surface, its hues kept.

    Attributes
    ----------
    scale : float
        Partner's chroma over the picture's, > 0 and at most 10.
    lightness_band : float or None
        Largest difference of L* between both surfaces, > 0; None leaves it free.
    """

    scale: float = 0.5
    lightness_band: float | None = None

    key = "chroma"
    description = "one picture whose chroma is multiplied on the other surface"
    in_sub_gamut = False

    def __post_init__(self) -> None:
        set_number(self, "scale", 0, 10, "0.5", above=True)
        set_number(self, "lightness_band", 0, 100, "0.5,10", above=True)

    @property
    def value(self) -> str:
        return text_of(self.scale, self.lightness_band)

    @property
    def partner(self) -> Partner:
        return Partner(chroma_scale=self.scale, lightness_band=self.lightness_band)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*parts_of(value, 2, cls.key, "scale[,lightness band]"))  # type: ignore[arg-type]  # checked, made floats


@dataclass(frozen=True)
class Decolorize(Effect):
    """One picture that turns gray on the other surface (Fig. 4b).

    Attributes
    ----------
    lightness : str
        Of the grays: ``"free"``, ``"relative"`` (the colour's place between black and full white of its surface, in
        linear light, is the gray's place between those of the other surface) or ``"same"`` (nearly empty: the
        pattern is always darker).
    tolerance : float
        Largest dE00 of the partner from its nearest gray, 0..10; 0 for exactly gray, 2 in the paper. Only with
        ``free``: beside a gray of given lightness dE00 allows most at both ends of the scale, and what lies within a
        tolerance of those grays is not convex.

    Raises
    ------
    InputError
        If the lightness is unknown, the tolerance out of range, or given with another lightness than ``free``.
    """

    lightness: str = "free"
    tolerance: float = 0.0

    key = "decolorize"
    description = "one picture that turns gray on the other surface"
    in_sub_gamut = False

    def __post_init__(self) -> None:
        if self.lightness not in LIGHTNESSES:
            raise InputError(
                f"effect decolorize: lightness must be one of {', '.join(LIGHTNESSES)}; got {self.lightness!r}"
            )
        set_number(self, "tolerance", 0, 10, "free,2")
        if self.tolerance and self.lightness != "free":
            raise InputError(
                f"effect decolorize: a tolerance goes with lightness free only, got {self.value}; write "
                f"decolorize:free,{number_text(self.tolerance)} or decolorize:{self.lightness}"
            )

    @property
    def value(self) -> str:
        return self.lightness + (f",{number_text(self.tolerance)}" if self.tolerance else "")

    @property
    def partner(self) -> Partner:
        return Partner(chroma_scale=0.0, lightness=self.lightness)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*parts_of(value, 2, cls.key, "lightness[,tolerance]"))  # type: ignore[arg-type]  # checked, made floats


@dataclass(frozen=True)
class Neutralize(Effect):
    """One picture that vanishes: the other surface shows one uniform colour (Section VI-B of the paper).

    Attributes
    ----------
    Lab : tuple of 3 floats
        The uniform colour, CIELAB under the model's white point; L* 0..100.
    tolerance : float
        Largest dE00 of the partner from that colour, 0..10; 0 for exactly that colour.

    Raises
    ------
    InputError
        If `Lab` is not three finite numbers with L* in 0..100, or the tolerance is out of range.
    """

    Lab: tuple[float, float, float] = (50.0, 0.0, 0.0)
    tolerance: float = 0.0

    key = "neutralize"
    description = "one picture that vanishes into one uniform colour on the other surface"

    def __post_init__(self) -> None:
        try:
            Lab = tuple(float(v) for v in self.Lab)
        except (TypeError, ValueError):
            Lab = ()
        if len(Lab) != 3 or not all(math.isfinite(v) for v in Lab) or not 0 <= Lab[0] <= 100:
            raise InputError(
                f"effect neutralize: Lab must be three numbers L,a,b with L* in 0..100, got {self.Lab!r}; "
                "write for example neutralize:50,0,0"
            )
        object.__setattr__(self, "Lab", tuple(v + 0.0 for v in Lab))  # -0 becomes 0: one text for one colour
        set_number(self, "tolerance", 0, 10, "50,0,0,2")

    @property
    def value(self) -> str:
        return text_of(*self.Lab, self.tolerance or None)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        parts = value.split(",") if value else ["50", "0", "0"]
        return cls(tuple(parts[:3]), *parts_of(",".join(parts[3:]), 1, cls.key, "L,a,b[,tolerance]"))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Watermark(Effect):
    """One picture on both surfaces, and on the other one a second picture over it as a faint change of lightness.

    Attributes
    ----------
    strength : float
        What the mark's L*, less its mean, is multiplied by; > 0 and at most 1.
    """

    strength: float = 0.1

    key = "watermark"
    description = "one picture on both surfaces, and a second one faintly over it on the other surface"
    pictures = ("image", "mark")
    in_sub_gamut = False

    def __post_init__(self) -> None:
        set_number(self, "strength", 0, 1, "0.1", above=True)

    @property
    def value(self) -> str:
        return text_of(self.strength)

    @property
    def partner(self) -> Partner:
        return Partner(mark_strength=self.strength)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*parts_of(value, 1, cls.key, "strength"))  # type: ignore[arg-type]  # checked, made floats


@dataclass(frozen=True)
class FullChange(Effect):
    """One picture whose colours can be changed at will (Fig. 4b): to black, to white and to their complement.

    Attributes
    ----------
    L_black, L_white : float or None
        L* of the black and the white on the other surface, 0..100; None for the ends of the largest lightness
        rectangle (Section VI-B). Both or none are given.
    """

    L_black: float | None = None
    L_white: float | None = None

    key = "full-change"
    description = "one picture whose colours can change to black, to white and to their complement"

    def __post_init__(self) -> None:
        set_number(self, "L_black", 0, 100, "20,60")
        set_number(self, "L_white", 0, 100, "20,60")
        if (self.L_black is None) != (self.L_white is None) or not (self.L_black or 0) <= (self.L_white or 100):
            raise InputError(
                f"effect full-change: give both, L_black below L_white, or none; got {self.L_black}, {self.L_white}"
            )

    @property
    def value(self) -> str:
        return text_of(self.L_black, self.L_white)

    @property
    def partner(self) -> Partner:
        return Partner(turn_deg=180.0)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*parts_of(value, 2, cls.key, "L black,L white"))  # type: ignore[arg-type]  # checked, made floats


@dataclass(frozen=True)
class DualImage(Effect):
    """Two pictures, one a surface, each in colours that go with every colour of the other (a product pair).

    Attributes
    ----------
    pair : str
        Which product pair: ``"auto"``, ``"closure"`` (of the grays of the largest lightness rectangle),
        ``"volume"`` (largest product of both volumes) or ``"contrast"`` (largest smaller lightness range). The first
        takes the closure, but ``"volume"`` where the closure's smaller side is below a tenth of the larger.
    """

    pair: str = "auto"

    key = "dual-image"
    description = "two pictures in one projection, one on each surface"
    pictures = ("on_pattern", "on_white")
    PAIRS: ClassVar[tuple[str, ...]] = ("auto", "closure", "volume", "contrast")

    def __post_init__(self) -> None:
        if self.pair not in self.PAIRS:
            raise InputError(f"effect dual-image: the pair must be one of {', '.join(self.PAIRS)}; got {self.pair!r}")

    @property
    def value(self) -> str:
        return "" if self.pair == "auto" else self.pair

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(value) if value else cls()


EFFECTS: dict[str, type[Effect]] = {
    effect.key: effect
    for effect in (Full, HueShift, Chroma, Decolorize, Neutralize, FullChange, DualImage, Watermark, Monochrome)
}
"""Every effect by its key, in the order of help texts."""


def parse_effect(text: str) -> Effect:
    """The effect that `text` names, such as ``"dual-image"`` or ``"neutralize:50,0,0"``.

    Parameters
    ----------
    text : str
        Key of a row of `EFFECTS`, and after a colon its settings; without them the defaults.

    Raises
    ------
    InputError
        If the key is not in the table (the choices are listed), or the settings break a rule.
    """
    key, colon, value = text.partition(":")
    if key not in EFFECTS:
        raise InputError(f"effect must be one of {', '.join(EFFECTS)}; got {text!r}")
    if colon and not value:
        raise InputError(f"effect {key}: a value must follow the colon, got {text!r}; for the default write {key}")
    return EFFECTS[key].from_value(value)
