"""How bodies in one CIELAB space look in every report: who is drawn first, in which colour, and seen from where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from paxel_design.gamut.scenes import SceneBody
from paxel_design.report.charts.style import PALETTE

__all__ = ["AZIMUTHS_DEG", "BODY_COLORS", "colored"]

BODY_COLORS = ("#7f7f7f", *PALETTE)
"""Of bodies in turn that have none of their own; the outermost is gray glass."""

AZIMUTHS_DEG = (-55.0, 125.0)
"""Where the viewer stands, from +a* towards +b*: opposite sides."""


def colored(bodies: Sequence[SceneBody]) -> tuple[SceneBody, ...]:
    """The bodies, the largest first, each with its colour; a single one without keeps the colours of its vertices."""
    order = sorted(bodies, key=lambda body: -body.mesh.mesh_volume)
    if len(order) == 1:
        return tuple(order)
    return tuple(replace(body, color=body.color or BODY_COLORS[k % len(BODY_COLORS)]) for k, body in enumerate(order))
