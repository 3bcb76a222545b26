"""Ways to look at a projection: from which distance, and what has moved since the calibration. Numbers only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation

__all__ = ["LOOK_TAGS", "Look", "looks_of", "usual_look"]

LOOK_TAGS = ("at-", "sheet-", "tilt-", "shift-")
"""How the tag of a look starts, by what is unusual about it."""


@dataclass(frozen=True)
class Look:
    """One way to look at a projection.

    Attributes
    ----------
    distance_mm : float
        Of the viewer from the wall, > 0.
    sheet_distance_mm, sheet_tilt_deg : float or None
        How the white sheet is held: its gap to the wall, and its turn about the upright axis; None as it is set.
    print_shift_px : float
        Projector pixels by which the print has moved to the right, or the projection to the left.

    Raises
    ------
    InputError
        If the distance is not positive.
    """

    distance_mm: float
    sheet_distance_mm: float | None = None
    sheet_tilt_deg: float | None = None
    print_shift_px: float = 0.0

    def __post_init__(self) -> None:
        if not self.distance_mm > 0:
            raise InputError(f"--distance must be > 0 mm, got {self.distance_mm:g}")

    def tag(self, usual_distance_mm: float) -> str:
        """What it adds to file names; empty for the usual look at everything in its place."""
        parts = []
        if self.distance_mm != usual_distance_mm:
            parts.append(f"at-{self.distance_mm:g}mm")
        if self.sheet_distance_mm is not None:
            parts.append(f"sheet-{self.sheet_distance_mm:g}mm")
        if self.sheet_tilt_deg is not None:
            parts.append(f"tilt-{self.sheet_tilt_deg:g}deg")
        if self.print_shift_px:
            parts.append(f"shift-{self.print_shift_px:g}px")
        return ".".join(parts)

    @property
    def surfaces(self) -> tuple[str, ...]:
        """The surfaces that look different so."""
        if self.sheet_distance_mm is not None or self.sheet_tilt_deg is not None:
            return ("white",)
        return ("pattern",) if self.print_shift_px else ("pattern", "white")

    def bench_changes(self, mm_per_px: float) -> dict[str, Any]:
        """Fields of the bench's setup that differ from the installation's."""
        changes: dict[str, Any] = {}
        if self.sheet_distance_mm is not None:
            changes["sheet_distance_mm"] = self.sheet_distance_mm
        if self.sheet_tilt_deg is not None:
            changes["sheet_tilt_deg"] = (0.0, self.sheet_tilt_deg)
        if self.print_shift_px:
            changes["print_offset_mm"] = (self.print_shift_px * mm_per_px, 0.0)
        return changes


def usual_look(installation: Installation) -> Look:
    """From the viewer's distance, everything in its place."""
    return Look(installation.settings.viewing.distance_mm)


def looks_of(
    installation: Installation,
    distances_mm: Sequence[float] = (),
    sheet_distance_mm: float | None = None,
    sheet_tilt_deg: float | None = None,
    print_shifts_px: Sequence[float] = (),
) -> list[Look]:
    """The looks that are asked for, each from every distance (the viewer's own where none is given).

    A sheet or a print that has moved is looked at in place of the usual wall, not besides it: the usual look is always
    made.
    """
    looks = []
    for distance_mm in distances_mm or (usual_look(installation).distance_mm,):
        looks += [Look(distance_mm, print_shift_px=shift_px) for shift_px in print_shifts_px]
        if sheet_distance_mm is not None or sheet_tilt_deg is not None:
            looks.append(Look(distance_mm, sheet_distance_mm, sheet_tilt_deg))
        if not looks or looks[-1].distance_mm != distance_mm:
            looks.append(Look(distance_mm))
    return looks
