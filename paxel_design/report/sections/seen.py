"""Projections looked at once more on the virtual bench, for what previews' files do not hold: light in full depth.

Done as `paxel preview` does it, from the usual place; nothing is written. Frames cost a second a megapixel each, so
there is a limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_design.report.source import ReportSource
from paxel_runtime.observer import Viewer, fall_off, inner_mask, leveled, picture_to_Lab, view_to_Lab
from paxel_runtime.stages import open_bench
from paxel_runtime.stages.projected import Projected, load_projected
from paxel_runtime.stages.wall import Wall

__all__ = ["Seen", "hiding_surfaces", "seen_projections"]

_MOST_PIXELS = 10_000_000
"""Of all views together: those of two effects on a projector of 1920 x 1080, a quarter of a minute."""


@dataclass(frozen=True, eq=False)
class Seen:
    """A surface that shows its part of a projection.

    Attributes
    ----------
    Y : (H, W) float32 array
        Luminance before the eye, without the light's fall-off; 1 for the white point.
    Lab, Lab_target : (H, W, 3) float32 arrays
        The view and the picture meant to be seen, both through the eye.
    inner : (H, W) bool array
        Pixels that count.
    """

    Y: NDArray[np.float32]
    Lab: NDArray[np.float32]
    Lab_target: NDArray[np.float32]
    inner: NDArray[np.bool_]


def hiding_surfaces(projected: Projected) -> list[str]:
    """The surfaces on which another surface's picture might be seen."""
    return [surface for surface in projected.mapped if projected.other(surface) is not None]


def seen_projections(source: ReportSource, names: Sequence[str]) -> Iterator[tuple[Projected, dict[str, Seen]]]:
    """Each projection, and what is seen on those of its surfaces that have a picture to hide.

    Parameters
    ----------
    source : ReportSource
        Of an installation. Without a bench, without a preview and beyond the limit nothing is seen.
    names : sequence of str
        Of the projections.

    Yields
    ------
    projected : Projected
    seen : dict of surface to Seen
    """
    installation = source.installation
    assert installation is not None
    bench = open_bench(installation) if source.bench and names else None
    shares: dict[str, NDArray[np.float32]] = {}
    left = _MOST_PIXELS
    for name in names:
        projected = load_projected(installation, name)
        hiding = hiding_surfaces(projected)
        needed = len(hiding) * projected.inside.size
        if bench is None or f"preview/{name}.json" not in source.records or needed > left:
            yield projected, {}
            continue
        left -= needed
        wall = Wall(bench, projected, installation)
        viewer = Viewer(installation.settings.viewing.distance_mm, wall.mm_per_px)
        white, sigma_px = projected.model.white_point, viewer.sigma_px
        seen = {}
        for surface in hiding:
            if surface not in shares:  # one for all projections
                shares[surface] = fall_off(wall.reference(surface), white, sigma_px)
            level = leveled(wall.view(surface), shares[surface])
            seen[surface] = Seen(
                level[..., 1],
                view_to_Lab(level, white, sigma_px),
                picture_to_Lab(projected.mapped[surface], white, sigma_px),
                inner_mask(projected.mask(surface), sigma_px),
            )
        yield projected, seen
