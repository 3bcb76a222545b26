"""What an effect is: its settings as text, the pictures it takes, and what it asks of the other surface.

The rows themselves stand in `table`. Nothing here knows how a sub-gamut is found or how a projection is made.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from paxel_runtime.errors import InputError

__all__ = ["LIGHTNESSES", "Effect", "Partner", "WithoutSettings", "number_text", "parts_of", "set_number", "text_of"]

LIGHTNESSES = ("free", "relative", "same")
"""How light a partner is: by one curve that leaves the most room for chroma; at the colour's own place between black
and full white of its surface, in linear light; or as light as the colour itself."""


@dataclass(frozen=True)
class Partner:
    """What the other surface shows beside a colour (L, C, h) of the picture: (L', chroma_scale C, h + turn_deg).

    Attributes
    ----------
    turn_deg : float
        Turn of the hue angle, counter-clockwise in (a*, b*).
    chroma_scale : float
        Partner's chroma over the colour's.
    lightness : str
        One of `LIGHTNESSES`: how L' follows from L.
    lightness_band : float or None
        Largest difference of L* between both surfaces; None leaves it free.
    mark_strength : float
        A second picture, the mark, adds this times (its L* - its mean) to L'.
    """

    turn_deg: float = 0.0
    chroma_scale: float = 1.0
    lightness: str = "free"
    lightness_band: float | None = None
    mark_strength: float = 0.0


class Effect(ABC):
    """What is to be shown on the two surfaces; each row of the table is a final subclass.

    Attributes
    ----------
    key : str
        Name of the row, the text before the colon.
    description : str
        One line for help texts and reports.
    pictures : tuple of str
        The pictures it takes: ``("image",)``, shown on the surface the sub-gamut is shown on,
        ``("on_pattern", "on_white")``, or ``("image", "mark")``.
    surfaces : int
        How many surfaces the model must have.
    in_sub_gamut : bool
        Whether a picture's colours must lie in the effect's sub-gamut. Where they need not, the pair of a colour and
        its partner in the joint gamut is all that is asked: more than the sub-gamut, which leaves the partner free.
    """

    key: ClassVar[str]
    description: ClassVar[str]
    pictures: ClassVar[tuple[str, ...]] = ("image",)
    surfaces: ClassVar[int] = 2
    in_sub_gamut: ClassVar[bool] = True

    @property
    @abstractmethod
    def value(self) -> str:
        """The settings as text, what stands after the colon; empty where there are none."""

    @classmethod
    @abstractmethod
    def from_value(cls, value: str) -> Effect:
        """The effect with the settings of `value`; every setting at its default for an empty text."""

    @property
    def partner(self) -> Partner | None:
        """What the other surface shows beside a colour; None where it has a picture or a colour of its own, or none."""
        return None

    @property
    def text(self) -> str:
        """The effect as text, such as ``neutralize:50,0,0``; `parse_effect` reads it back."""
        return f"{self.key}:{self.value}" if self.value else self.key

    @property
    def name(self) -> str:
        """The effect in a file name, such as ``neutralize-50_0_0``."""
        return f"{self.key}-{self.value.replace(',', '_')}" if self.value else self.key


class WithoutSettings(Effect):
    """An effect that has nothing to set."""

    @property
    def value(self) -> str:
        return ""

    @classmethod
    def from_value(cls, value: str) -> Effect:
        if value:
            raise InputError(f"effect {cls.key} takes no value, got {value!r}; write {cls.key}")
        return cls()


def number_text(number: float) -> str:
    """Shortest text that reads back as the same number, without a trailing ``.0``."""
    return repr(int(number)) if number.is_integer() else repr(number)


def text_of(*numbers: float | None) -> str:
    """Settings as text; those that are not given stand last and are left out."""
    return ",".join(number_text(number) for number in numbers if number is not None)


def parts_of(value: str, at_most: int, key: str, form: str) -> list[str]:
    """Settings of a text; none where it is empty."""
    parts = value.split(",") if value else []
    if len(parts) > at_most:
        raise InputError(f"effect {key}: write {key}:{form}; got {key}:{value}")
    return parts


def set_number(effect: Effect, field: str, low: float, high: float, example: str, above: bool = False) -> None:
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
