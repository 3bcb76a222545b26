"""One x for each wanted colour pair of the linear model: the stages that search, and more starts where it is far.

Newton's method converges to the nearest minimum. For colours of pictures, even those well out of gamut, there is only
one: 20 random starts find none that is lower. Where the best that can be shown is about a dE00 of 10 away (saturated
colours of opposite hues on the two surfaces) a second minimum may be lower, so there the search starts again from
grays, black and white. Knows systems and colours; nothing of pictures or threads.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.inversion.evaluation import evaluate
from paxel_runtime.inversion.exact import PENDING, solve_in_box
from paxel_runtime.inversion.newton import newton
from paxel_runtime.inversion.system import System
from paxel_runtime.model.colorimetry import Lab_to_XYZ

__all__ = ["errors", "search"]

Floats: TypeAlias = NDArray[np.float64]
Labels: TypeAlias = NDArray[np.uint8]

_WANTED_COLOUR = np.empty((0, 6))  # no other start
_FAR = 150.0  # weighted sum of dE^2: below it hardly a second, lower minimum exists, and never did in a picture
_LOWER = 1e-3  # and this much lower is worth another x
_DIM = 0.01  # of white: the start near black, where CIELAB is still curved


def search(Lab: Floats, system: System) -> tuple[Floats, Labels]:
    """The x in the box that meets both colours, or comes nearest.

    Parameters
    ----------
    Lab : (m, 6) array
        Wanted colours on both surfaces.
    system : System
        Of these m pixels; its correction is left out.

    Returns
    -------
    x : (m, n) array
    status : (m,) uint8 array
        EXACT, OPTIMUM or CAPPED.
    """
    x = np.empty((len(Lab), system.n))
    status = np.full(len(Lab), PENDING, np.uint8)
    if not system.is_unique:
        every = np.arange(len(Lab))
        solve_in_box(Lab, every, system.surfaces, system.AT, system.black, system.white, x, status)
    queue = np.flatnonzero(status == PENDING)
    if len(queue):
        value = np.zeros(len(Lab))
        _descend(Lab, _WANTED_COLOUR, queue, system, x, value, status)
        far = np.flatnonzero(value > _FAR)
        if len(far):
            x[far], status[far] = _start_again(Lab[far], system.of(far), x[far], value[far], status[far])
    return x, status


def errors(x: Floats, Lab: Floats, system: System, more_XYZ: Floats | None = None) -> Floats:
    """dE00 (dE76, if that is minimised) on each surface between the wanted colours and what x shows, (m, surfaces).

    `more_XYZ` (m, 6) is added to A x + black.
    """
    black = system.black if more_XYZ is None else system.black + more_XYZ
    dE = np.empty((len(x), len(system.surfaces)))
    evaluate(x, Lab, system.surfaces, system.AT, black, system.white, system.euclidean, dE)
    return dE


def _descend(
    Lab: Floats, start: Floats, queue: NDArray[np.int64], system: System, x: Floats, value: Floats, status: Labels
) -> None:
    s = system
    newton(Lab, start, queue, s.surfaces, s.AT, s.black, s.white, s.weights, s.euclidean, x, value, status)


def _start_again(Lab: Floats, system: System, x: Floats, value: Floats, status: Labels) -> tuple[Floats, Labels]:
    """x and status of the lowest minimum from several starts; those given are the ones found so far."""
    every = np.arange(len(Lab))
    for start in _starts(Lab, system, x):
        tried, tried_value, tried_status = np.empty_like(x), np.empty_like(value), np.empty_like(status)
        _descend(Lab, start, every, system, tried, tried_value, tried_status)
        lower = tried_value < value - _LOWER
        x[lower], value[lower], status[lower] = tried[lower], tried_value[lower], tried_status[lower]
    return x, status


def _starts(Lab: Floats, system: System, x: Floats) -> Iterator[Floats]:
    """XYZ (m, 6): grays as light as the answer, black, grays as light as wanted, white, what x = 1/2 shows."""
    white = np.tile(system.white, 2)
    shown = np.einsum("...ji,...j->...i", system.AT, x) + system.black
    wanted = np.concatenate([Lab_to_XYZ(Lab[:, s : s + 3], system.white) for s in (0, 3)], axis=1)
    middle = 0.5 * system.AT.sum(axis=-2) + system.black
    for start in (_grays(shown, white), _DIM * white, _grays(wanted, white), white, middle):
        yield np.array(np.broadcast_to(start, shown.shape))


def _grays(XYZ: Floats, white: Floats) -> Floats:
    """Grays of the same luminance on each surface."""
    return np.repeat(np.maximum(XYZ[:, [1, 4]], 0.0), 3, axis=1) * (white / white[1])
