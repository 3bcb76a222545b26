"""The table of effects: what each wants to be shown on the two surfaces, and how it is written in text.

This is the one truth for both packages: the design side makes a sub-gamut for each row of `EFFECTS`, the runtime
asks which pictures a row wants. An effect is a frozen dataclass of its settings; text and file names follow from
them. Nothing here knows how a sub-gamut is found (``paxel_design.gamut``) or how a projection is made.

    text                    file name               object
    ``full``                ``full``                ``Full()``
    ``neutralize:50,0,0``   ``neutralize-50_0_0``   ``Neutralize(Lab=(50.0, 0.0, 0.0))``
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from paxel_runtime.errors import InputError

__all__ = ["EFFECTS", "DualImage", "Effect", "Full", "Neutralize", "parse_effect"]


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
    """

    key: ClassVar[str]
    description: ClassVar[str]
    pictures: ClassVar[tuple[str, ...]]

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
    pictures = ("image",)


@dataclass(frozen=True)
class DualImage(_WithoutSettings):
    """Two pictures, one a surface, each in colours that go with every colour of the other (a product pair)."""

    key = "dual-image"
    description = "two pictures in one projection, one on each surface"
    pictures = ("on_pattern", "on_white")


@dataclass(frozen=True)
class Neutralize(Effect):
    """One picture that vanishes: the other surface shows one uniform colour (Section VI-B of the paper).

    Attributes
    ----------
    Lab : tuple of 3 floats
        The uniform colour, CIELAB under the model's white point; L* 0..100.

    Raises
    ------
    InputError
        If `Lab` is not three finite numbers with L* in 0..100.
    """

    Lab: tuple[float, float, float] = (50.0, 0.0, 0.0)

    key = "neutralize"
    description = "one picture that vanishes into one uniform colour on the other surface"
    pictures = ("image",)

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

    @property
    def value(self) -> str:
        return ",".join(_number_text(v) for v in self.Lab)

    @classmethod
    def from_value(cls, value: str) -> Effect:
        return cls(tuple(value.split(","))) if value else cls()  # type: ignore[arg-type]  # checked and made floats


EFFECTS: dict[str, type[Effect]] = {effect.key: effect for effect in (Full, DualImage, Neutralize)}
"""Every effect by its key, in the order of help texts and of ``paxel gamut``."""


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
