"""The table of effects: what each wants to be shown on the two surfaces, and how it is written in text.

This is the one truth for both packages: the design side makes a sub-gamut for each row of `EFFECTS`, the runtime
asks which pictures a row wants. An effect is a frozen dataclass of its settings; text and file names follow from
them. Nothing here knows how a sub-gamut is found (``paxel_design.gamut``) or how a projection is made.

    text                    file name               object
    ``full``                ``full``                ``Full()``
    ``neutralize:50,0,0``   ``neutralize-50_0_0``   ``Neutralize(Lab=(50.0, 0.0, 0.0))``
    ``hue-shift:45``        ``hue-shift-45``        ``HueShift(angle_deg=45)``
    ``decolorize:free,2``   ``decolorize-free_2``   ``Decolorize("free", tolerance=2)``

The definitions, with p the colour shown on one surface and q its partner, what the other surface shows at once:

- *full*, *monochrome*: every p, whatever q is;
- *hue-shift* (h, band): q's hue angle is at least h from p's, either way, and q's chroma at least `CHROMA_FLOOR`; p's
  own chroma has no floor; q's lightness is free, or within `lightness_band` of p's;
- *chroma* (s, band): q has p's hue and s times its chroma; lightness as above;
- *decolorize*: q is gray: of any lightness (``free``), of p's own (``same``), or at p's place between black and full
  white of its surface, in linear light (``relative``); with ``free`` also within `tolerance` of a gray, in dE00;
- *neutralize* (to c): q is c, or within `tolerance` of c, in dE00;
- *full-change* (Section V-A1): p goes with a black and a white gray on the other surface, and with a complementary
  colour there, one whose light adds up to gray with p's own;
- *dual-image*: one side of a pair of sets of which every p goes with every q.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from paxel_runtime.errors import InputError

__all__ = [
    "CHROMA_FLOOR",
    "EFFECTS",
    "Chroma",
    "Decolorize",
    "DualImage",
    "Effect",
    "Full",
    "FullChange",
    "HueShift",
    "Monochrome",
    "Neutralize",
    "parse_effect",
    "require_projectable",
]

CHROMA_FLOOR = 5.0
"""Least chroma of the partner of a hue shift, CIELAB: below it a hue is not seen."""

LARGEST_HUE_SHIFT_DEG = 170.0
"""At 180 degrees the partners are half-planes without volume."""


class Effect(ABC):
    """What is to be shown on the two surfaces; each row of `EFFECTS` is a final subclass.

    Attributes
    ----------
    key : str
        Name of the row, the text before the colon.
    description : str
        One line for help texts and reports.
    pictures : tuple of str
        The pictures it wants: ``("image",)``, shown on the surface the sub-gamut is shown on, or
        ``("on_pattern", "on_white")``.
    surfaces : int
        How many surfaces the model must have.
    projectable : bool
        Whether `paxel_runtime.make_projection` can show it; a sub-gamut and its figures exist for every row.
    """

    key: ClassVar[str]
    description: ClassVar[str]
    pictures: ClassVar[tuple[str, ...]] = ("image",)
    surfaces: ClassVar[int] = 2
    projectable: ClassVar[bool] = False

    @property
    @abstractmethod
    def value(self) -> str:
        """The settings as text, what stands after the colon; empty where there are none."""

    @classmethod
    @abstractmethod
    def from_value(cls, value: str) -> Effect:
        """The effect with the settings of `value`; every setting at its default for an empty text."""

    @property
    def text(self) -> str:
        """The effect as text, such as ``neutralize:50,0,0``; `parse_effect` reads it back."""
        return f"{self.key}:{self.value}" if self.value else self.key

    @property
    def name(self) -> str:
        """The effect in a file name, such as ``neutralize-50_0_0``."""
        return f"{self.key}-{self.value.replace(',', '_')}" if self.value else self.key


class _WithoutSettings(Effect):
    """An effect that has nothing to set."""

    @property
    def value(self) -> str:
        return ""

    @classmethod
    def from_value(cls, value: str) -> Effect:
        if value:
            raise InputError(f"effect {cls.key} takes no value, got {value!r}; write {cls.key}")
        return cls()


@dataclass(frozen=True)
class Full(_WithoutSettings):
    """Any colour of one surface, whatever the other surface then shows."""

    key = "full"
    description = "one picture in every colour its surface can show; the other surface is left free"
    surfaces = 1
    projectable = True


@dataclass(frozen=True)
class Monochrome(_WithoutSettings):
    """One colour picture from light of one channel (Section V-B of the paper): the same set as `Full`."""

    key = "monochrome"
    description = "one colour picture from single-channel light, such as ultraviolet, on fluorescent inks"
    surfaces = 1


@dataclass(frozen=True)
class HueShift(Effect):
    """One picture whose hues turn by at least an angle on the other surface (Fig. 4a).

    Attributes
    ----------
    angle_deg : float
        Least difference of hue, > 0 and at most 170.
    lightness_band : float or None
        Largest difference of L* between both surfaces, > 0; None leaves it free.
    """

    angle_deg: float = 45.0
    lightness_band: float | None = None

    key = "hue-shift"
    description = "one picture whose hues turn by at least an angle on the other surface"

    def __post_init__(self) -> None:
        _set_number(self, "angle_deg", 0, LARGEST_HUE_SHIFT_DEG, "45", above=True)
        _set_number(self, "lightness_band", 0, 100, "45,10", above=True)

    @property
    def value(self) -> str:
        return _text(self.angle_deg, self.lightness_band)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*_parts(value, 2, cls.key, "angle[,lightness band]"))  # type: ignore[arg-type]  # checked, made floats


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

    def __post_init__(self) -> None:
        _set_number(self, "scale", 0, 10, "0.5", above=True)
        _set_number(self, "lightness_band", 0, 100, "0.5,10", above=True)

    @property
    def value(self) -> str:
        return _text(self.scale, self.lightness_band)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*_parts(value, 2, cls.key, "scale[,lightness band]"))  # type: ignore[arg-type]  # checked, made floats


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
    LIGHTNESSES: ClassVar[tuple[str, ...]] = ("free", "relative", "same")

    def __post_init__(self) -> None:
        if self.lightness not in self.LIGHTNESSES:
            raise InputError(
                f"effect decolorize: lightness must be one of {', '.join(self.LIGHTNESSES)}; got {self.lightness!r}"
            )
        _set_number(self, "tolerance", 0, 10, "free,2")
        if self.tolerance and self.lightness != "free":
            raise InputError(
                f"effect decolorize: a tolerance goes with lightness free only, got {self.value}; write "
                f"decolorize:free,{_number_text(self.tolerance)} or decolorize:{self.lightness}"
            )

    @property
    def value(self) -> str:
        return self.lightness + (f",{_number_text(self.tolerance)}" if self.tolerance else "")

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*_parts(value, 2, cls.key, "lightness[,tolerance]"))  # type: ignore[arg-type]  # checked, made floats


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
    projectable = True

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
        _set_number(self, "tolerance", 0, 10, "50,0,0,2")

    @property
    def value(self) -> str:
        return _text(*self.Lab, self.tolerance or None)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        parts = value.split(",") if value else ["50", "0", "0"]
        return cls(tuple(parts[:3]), *_parts(",".join(parts[3:]), 1, cls.key, "L,a,b[,tolerance]"))  # type: ignore[arg-type]


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
        _set_number(self, "L_black", 0, 100, "20,60")
        _set_number(self, "L_white", 0, 100, "20,60")
        if (self.L_black is None) != (self.L_white is None) or not (self.L_black or 0) <= (self.L_white or 100):
            raise InputError(
                f"effect full-change: give both, L_black below L_white, or none; got {self.L_black}, {self.L_white}"
            )

    @property
    def value(self) -> str:
        return _text(self.L_black, self.L_white)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(*_parts(value, 2, cls.key, "L black,L white"))  # type: ignore[arg-type]  # checked, made floats


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
    projectable = True
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
    effect.key: effect for effect in (Full, HueShift, Chroma, Decolorize, Neutralize, FullChange, DualImage, Monochrome)
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


def _number_text(number: float) -> str:
    """Shortest text that reads back as the same number, without a trailing ``.0``."""
    return repr(int(number)) if number.is_integer() else repr(number)


def require_projectable(effect: Effect) -> None:
    """Refuse an effect of which no projection can be made.

    Raises
    ------
    InputError
        Naming the effects that can be projected.
    """
    if not effect.projectable:
        able = ", ".join(key for key, row in EFFECTS.items() if row.projectable)
        raise InputError(
            f"effect {effect.text} has a sub-gamut (paxel gamut --effect {effect.text}) and no projection; "
            f"effects that can be projected: {able}"
        )


def _text(*numbers: float | None) -> str:
    """Settings as text; those that are not given stand last and are left out."""
    return ",".join(_number_text(number) for number in numbers if number is not None)


def _parts(value: str, at_most: int, key: str, form: str) -> list[str]:
    """Settings of a text; none where it is empty."""
    parts = value.split(",") if value else []
    if len(parts) > at_most:
        raise InputError(f"effect {key}: write {key}:{form}; got {key}:{value}")
    return parts


def _set_number(effect: Effect, field: str, low: float, high: float, example: str, above: bool = False) -> None:
    """Make a field of a frozen effect a number in its range, from a number or its text; None stays."""
    given = getattr(effect, field)
    if given is None:
        return
    try:
        number = float(given) + 0.0
    except (TypeError, ValueError):
        number = math.nan
    if not (low <= number <= high) or (above and number == low):
        rule = f"> {low:g} and at most {high:g}" if above else f"a number {low:g}..{high:g}"
        raise InputError(
            f"effect {effect.key}: {field} must be {rule}, got {given!r}; write for example {effect.key}:{example}"
        )
    object.__setattr__(effect, field, number)
