"""The installation that changes are tried on: its model, and its print and viewer where they are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from paxel_design.what_if.figures import Room, room_of
from paxel_design.what_if.light import black_level
from paxel_design.what_if.pixels import Pixels, pixels_of
from paxel_design.what_if.simulated_print import Lighting, simulated_print
from paxel_runtime.errors import InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.printed import printed_pattern
from paxel_runtime.settings import Settings

__all__ = ["Case", "PrintCase", "case_of"]


@dataclass(frozen=True, eq=False)
class PrintCase:
    """The print of an installation, simulated once as it is.

    Attributes
    ----------
    pattern : Pattern
    lighting : Lighting
    settings : Settings
    simulated : PredictionModel
    room : Room
        Of the simulated model.
    """

    pattern: Pattern
    lighting: Lighting
    settings: Settings
    simulated: PredictionModel
    room: Room


@dataclass(frozen=True, eq=False)
class Case:
    """What changes are tried on.

    Attributes
    ----------
    model : PredictionModel
        The measured one, its linear part.
    room : Room
    printed : PrintCase or None
        None for a model alone.
    pixels : Pixels or None
        None where no calibration left them.
    records : mapping of str to dict
        The stages' records, by path.
    """

    model: PredictionModel
    room: Room
    printed: PrintCase | None = None
    pixels: Pixels | None = None
    records: Mapping[str, dict[str, Any]] = field(default_factory=dict)


def case_of(
    model: PredictionModel,
    installation: Installation | None = None,
    records: Mapping[str, dict[str, Any]] | None = None,
) -> Case:
    """The case of an installation, or of a model alone.

    Raises
    ------
    InputError
        If the model has no gamut.
    """
    linear = model.linear
    room = room_of(linear)
    if installation is None:
        return Case(linear, room, records=dict(records or {}))
    try:
        printed = _print_case(linear, printed_pattern(installation), installation.settings)
    except InstallationError:  # no print is left: what the matrices allow
        return Case(linear, room, records=dict(records or {}))
    return Case(linear, room, printed, pixels_of(installation), dict(records or {}))


def _print_case(model: PredictionModel, pattern: Pattern, settings: Settings) -> PrintCase:
    projector, count = settings.projector, len(model.clusters)
    lighting = Lighting(
        projector.width_mm / projector.resolution[0],
        count,
        model.channels,
        settings.clusters.method,
        model.white is not None,
        black_level(model),
    )
    simulated = simulated_print(pattern, lighting)
    return PrintCase(pattern, lighting, settings, simulated, room_of(simulated))
