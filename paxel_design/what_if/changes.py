"""What a change of an installation is: one figure before and after, what it costs, how it is done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

__all__ = ["AIMS", "BASES", "LEAST_GAIN", "Aim", "Basis", "Change", "Number", "helpful", "idle", "option"]

Aim = Literal["effect", "shared", "seen", "true"]
AIMS: dict[Aim, str] = {
    "effect": "For a larger effect",
    "shared": "For pictures equally light on both surfaces",
    "seen": "For dots and moire that are seen less",
    "true": "For truer colours",
}
"""What changes are for, in the order in which they are told."""

Basis = Literal["matrices", "pixels", "print", "viewer", "records"]
BASES: dict[Basis, str] = {
    "matrices": "computed exactly from the measured matrices",
    "pixels": "computed as the measured figure times the ratio of two models of the installation's own pixels, sorted "
    "in the other way and in the present one",
    "print": "computed as the measured figure times the ratio of two simulated prints, the changed one and the present",
    "viewer": "computed from the design's spectrum and the sensitivity of the eye",
    "records": "computed from the records of calibration, projection and preview",
}
"""What a gain was computed from."""

LEAST_GAIN = 0.02
"""Relative gain below which nobody prints or measures anew, and that a simulation does not tell from nothing."""

_MOST_DIGITS = 5


@dataclass(frozen=True)
class Number:
    """A number of a change's texts: its value, unit and significant digits."""

    value: float | int | str | tuple[float, ...]
    unit: str = ""
    digits: int = 3


@dataclass(frozen=True)
class Change:
    """A change, and what it gains.

    Texts hold names of numbers in braces: ``{before}``, ``{after}``, ``{gain}`` (percent) and those of `values`.

    Attributes
    ----------
    key : str
        Unique among changes, such as ``"dot-size-1"``.
    aim : Aim
    title : str
        The change in a few words.
    figure, unit : str
        What it changes.
    before, after : float
        The figure as it is, and as it would be; where the change is in use, without it and with it.
    basis : Basis
    cost, how : str
        What is paid for it; the command or the key of paxel.toml.
    less_is_better : bool
        Whether a small figure is good.
    enough : float
        Where less is better: below this, less is of no use.
    volume_gain : float or None
        Relative gain of the volume of colours, where that was computed: 0.1 is ten percent more.
    objection : str
        Why not here, if it cannot be recommended whatever it gains.
    in_use : bool
        Whether the installation has it already.
    values : mapping of str to Number
        Further numbers of the texts.
    """

    key: str
    aim: Aim
    title: str
    figure: str
    unit: str
    before: float
    after: float
    basis: Basis
    cost: str
    how: str
    less_is_better: bool = False
    enough: float = 0.0
    volume_gain: float | None = None
    objection: str = ""
    in_use: bool = False
    values: Mapping[str, Number] = field(default_factory=dict)

    @property
    def gain(self) -> float | None:
        """Relative improvement of the figure, negative if it gets worse; None where there was nothing before."""
        before, after = self.before, self.after
        if self.less_is_better:
            before, after = max(before, self.enough), max(after, self.enough)
        if not before > 0:
            return None
        return (before - after if self.less_is_better else after - before) / before

    @property
    def helps(self) -> bool:
        """Whether the gain is worth telling: more than `LEAST_GAIN`, or something where there was nothing."""
        return self.after > 0 if self.gain is None else self.gain > LEAST_GAIN


def option(value: float, unit: str = "") -> Number:
    """A number that someone sets: with as many digits as it has, up to five."""
    digits = next((d for d in range(1, _MOST_DIGITS) if float(f"{value:.{d}g}") == value), _MOST_DIGITS)
    return Number(value, unit, digits)


def helpful(changes: Sequence[Change]) -> tuple[Change, ...]:
    """Those not in use that help, by aim and then by gain, the largest first."""
    order = list(AIMS)
    found = [change for change in changes if change.helps and not change.in_use and not change.objection]
    # from nothing to something has no ratio: then the most of it
    return tuple(sorted(found, key=lambda c: (order.index(c.aim), c.gain is not None, -(c.gain or 0.0), -c.after)))


def idle(changes: Sequence[Change]) -> tuple[Change, ...]:
    """Those not in use that bring nothing or do harm, in the order given."""
    return tuple(change for change in changes if not change.helps and not change.in_use)
