"""The printing plates of a sheet: which inks it needs, and how much of each a colorant lays down.

A colorant is either a mixture of the four process inks or one spot ink, printed alone as a solid. This file knows
names and amounts; how a PDF writes a colour space is known in `colour_spaces`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from paxel_design.printing.font import missing_characters
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant

__all__ = ["PROCESS_INKS", "Plates", "is_paper", "plates_of", "recipe_of"]

PROCESS_INKS = ("Cyan", "Magenta", "Yellow", "Black")
"""Names of the four process plates, as PDF spells them."""

# Names that mean every plate or none (PDF 1.7, 8.6.6.4), and the process inks, whose plates are not spot plates
_RESERVED = frozenset(name.lower() for name in (*PROCESS_INKS, "All", "None"))
_NAME_LIMIT = 60


@dataclass(frozen=True)
class Plates:
    """The plates of a sheet.

    Attributes
    ----------
    names : tuple of str
        The process inks (all four without spot inks, else those in use), then the spot inks.
    spots : tuple of Colorant
        The colorants with a plate of their own, in the order of their plates.
    """

    names: tuple[str, ...]
    spots: tuple[Colorant, ...]

    def amounts(self, colorant: Colorant | None) -> tuple[float, ...]:
        """How much ink, 0..1, each plate lays down for a colorant; None is bare paper."""
        if colorant is None:
            return (0.0,) * len(self.names)
        if colorant.spot:
            return tuple(float(name == colorant.spot) for name in self.names)
        recipe = dict(zip(PROCESS_INKS, colorant.cmyk, strict=True))
        return tuple(float(recipe.get(name, 0.0)) for name in self.names)


def is_paper(colorant: Colorant) -> bool:
    """Whether a colorant is bare paper: no ink on any plate."""
    return not colorant.spot and max(colorant.cmyk) <= 0.0


def recipe_of(colorant: Colorant | None) -> str:
    """The printer's recipe of a colorant, such as ``"M100 Y100"`` or ``"spot UV red"``; None is bare paper."""
    if colorant is None or is_paper(colorant):
        return "no ink"
    if colorant.spot:
        return f"spot {colorant.spot}"
    return " ".join(f"{ink}{100 * share:g}" for ink, share in zip("CMYK", colorant.cmyk, strict=True) if share)


def plates_of(colorants: Sequence[Colorant]) -> Plates:
    """The plates that print some colorants.

    Raises
    ------
    InputError
        If a spot name is a process ink's, means all plates or none, stands for two colorants, is longer than 60
        characters or has letters that the sheet's typeface lacks.
    """
    spots = tuple(colorant for colorant in colorants if colorant.spot)
    for name, times in Counter(colorant.spot for colorant in spots).items():
        if name.lower() in _RESERVED:
            raise InputError(
                f"a spot plate must have a name of its own, got {name!r}: leave the spot name out for a mixture of "
                "process inks"
            )
        if times > 1:
            raise InputError(f"a spot plate must print one colorant, got {times} on {name!r}: name each plate once")
        if len(name) > _NAME_LIMIT or missing_characters(name):
            raise InputError(
                f"a spot plate's name must be at most {_NAME_LIMIT} Latin letters, digits and signs, got {name!r}"
            )
    if not spots:
        return Plates(PROCESS_INKS, ())
    used = [any(c.cmyk[i] > 0 for c in colorants if not c.spot) for i in range(len(PROCESS_INKS))]
    process = tuple(ink for ink, use in zip(PROCESS_INKS, used, strict=True) if use)
    return Plates((*process, *(colorant.spot for colorant in spots)), spots)
