"""The effect of an installation after a change: its measured figures times the ratio of two models made alike."""

from __future__ import annotations

from dataclasses import replace

from paxel_design.what_if.case import Case, PrintCase
from paxel_design.what_if.changes import Basis, Change, Number
from paxel_design.what_if.figures import Room, room_of
from paxel_design.what_if.pixels import model_of_pixels, sorted_anew
from paxel_design.what_if.simulated_print import SortedBy, simulated_print
from paxel_runtime.errors import PaxelError
from paxel_runtime.model.pattern import Pattern

__all__ = ["EFFECT_WORDS", "change_of_room", "effect_numbers", "room_of_sorting", "scaled_room"]

_CONTRAST, _VOLUME = "contrast of two free pictures", "volume of all colours"
"""The figure that the effect is judged by, with two surfaces and with one."""

EFFECT_WORDS = "the effect changes by {effect} % ({effect_figure})"
"""The words for `effect_numbers`."""


def room_of_sorting(case: Case, printed: PrintCase, K: int, by: SortedBy) -> tuple[Room | None, Basis]:
    """The measured room times the ratio of two sortings: of the installation's own pixels, else of a simulated print.

    None where there can be no such clusters.
    """
    if case.pixels is None:
        return scaled_room(case, printed, printed.pattern, K=K, sorted_by=by), "print"
    model, pixels = case.model, case.pixels
    now = room_of(model_of_pixels(model, pixels, pixels.labels, len(model.clusters)))
    try:
        labels = sorted_anew(model, pixels, printed.pattern.colorants, K, by)
        then = room_of(model_of_pixels(model, pixels, labels, K))
    except PaxelError:
        return None, "pixels"
    return _ratio(case, then, now), "pixels"


def scaled_room(case: Case, printed: PrintCase, pattern: Pattern, **lighting: object) -> Room | None:
    """The measured room times the ratio of the simulated ones; None where there can be no such print."""
    try:
        then = room_of(simulated_print(pattern, replace(printed.lighting, **lighting)))  # type: ignore[arg-type]
    except PaxelError:  # dots or clusters too small for the raster
        return None
    return _ratio(case, then, printed.room)


def _ratio(case: Case, then: Room, now: Room) -> Room | None:
    """The measured room times the ratio of two that were made alike."""
    if not (now.contrast > 0 and now.volume > 0):
        return None
    contrast = case.room.contrast * then.contrast / now.contrast
    return Room(contrast, case.room.volume * then.volume / now.volume)


def change_of_room(
    case: Case,
    key: str,
    title: str,
    then: Room,
    basis: Basis,
    cost: str,
    how: str,
    values: dict[str, Number] | None = None,
    objection: str = "",
) -> Change:
    """A change for a larger effect: its figure is the contrast, or with one surface the volume of its colours."""
    now = case.room
    if case.model.white is None:
        figure, unit, before, after, volume_gain = _VOLUME, "CIELAB^3", now.volume, then.volume, None
    else:
        figure, unit, before, after = _CONTRAST, "L*", now.contrast, then.contrast
        volume_gain = then.volume / now.volume - 1 if now.volume > 0 else None
    return Change(
        key,
        "effect",
        title,
        figure,
        unit,
        before,
        after,
        basis,
        cost,
        how,
        volume_gain=volume_gain,
        objection=objection,
        values=values or {},
    )


def effect_numbers(case: Case, room: Room) -> dict[str, Number]:
    """How the effect changes where that is not the aim, for `EFFECT_WORDS`."""
    change = change_of_room(case, "", "", room, "print", "", "")
    return {"effect": Number(100 * (change.gain or 0.0), "%", 2), "effect_figure": Number(change.figure)}
