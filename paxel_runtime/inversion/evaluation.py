"""What inputs show: XYZ of x on both surfaces, and how far that is from the wanted colours, in SIMD lanes.

Works on `LANES` pixels at a time in a flat workspace (see `lanes`), 3 rows a surface: the second surface is the
workspace from ``3 * LANES`` on. Knows CIELAB, dE00 and A x + black; not how x is found.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.inversion.lanes import LANES, Floats, Surfaces, Vec3, Vec6, black_of, column, lane_columns, take_own
from paxel_runtime.inversion.local_model import Lab_to_t, squared_dE76_jet, t_to_Lab
from paxel_runtime.model.delta_e import TRUE_dE00, squared_dE00_jet
from paxel_runtime.numba_options import CALLED, INLINED, KERNEL

__all__ = [
    "AIM",
    "ERROR",
    "EVALUATION_ROWS",
    "SHOWN",
    "WANTED",
    "aim",
    "compare",
    "evaluate",
    "show",
    "show_input",
]

# Rows of the workspace
WANTED = 0 * LANES  # 6: wanted Lab
AIM = 6 * LANES  # 6: its XYZ
SHOWN = 12 * LANES  # 6: XYZ that the inputs give
ERROR = 18 * LANES  # 1 in 3: dE00
EVALUATION_ROWS = 24

_KERNEL: dict[str, Any] = {**KERNEL, "fastmath": {"contract"}}
_LANES: dict[str, Any] = {**CALLED, "fastmath": {"contract"}}


@njit(**_LANES)
def aim(w: Floats, white: Vec3) -> None:
    """XYZ of the wanted colours on one surface."""
    for lane in range(LANES):
        tx, ty, tz = Lab_to_t(w[WANTED + lane], w[WANTED + LANES + lane], w[WANTED + 2 * LANES + lane])
        w[AIM + lane], w[AIM + LANES + lane], w[AIM + 2 * LANES + lane] = tx * white[0], ty * white[1], tz * white[2]


@njit(**_LANES)
def compare(w: Floats, per_white: Vec3, euclidean: bool) -> None:
    """dE00 (dE76 if `euclidean`) between the wanted colours and those shown, on one surface."""
    if euclidean:
        for lane in range(LANES):
            L1, a1, b1 = w[WANTED + lane], w[WANTED + LANES + lane], w[WANTED + 2 * LANES + lane]
            L, a, b = _shown_Lab(w, lane, per_white)
            w[ERROR + lane] = math.sqrt(squared_dE76_jet(L1, a1, b1, L, a, b)[0])
    else:
        for lane in range(LANES):
            L1, a1, b1 = w[WANTED + lane], w[WANTED + LANES + lane], w[WANTED + 2 * LANES + lane]
            L, a, b = _shown_Lab(w, lane, per_white)
            w[ERROR + lane] = math.sqrt(squared_dE00_jet(L1, a1, b1, L, a, b, TRUE_dE00)[0])


@njit(**INLINED)
def _shown_Lab(w: Floats, lane: int, per_white: Vec3) -> Vec3:
    return t_to_Lab(
        w[SHOWN + lane] * per_white[0],
        w[SHOWN + LANES + lane] * per_white[1],
        w[SHOWN + 2 * LANES + lane] * per_white[2],
    )


@njit(**INLINED)
def show_input(w: Floats, lane: int, a: Vec6, x: float) -> None:
    """Add an input with column `a` of A to what a lane shows."""
    w[SHOWN + lane] += a[0] * x
    w[SHOWN + LANES + lane] += a[1] * x
    w[SHOWN + 2 * LANES + lane] += a[2] * x
    w[SHOWN + 3 * LANES + lane] += a[3] * x
    w[SHOWN + 4 * LANES + lane] += a[4] * x
    w[SHOWN + 5 * LANES + lane] += a[5] * x


@njit(**INLINED)
def show(w: Floats, v: NDArray[np.floating], columns: Floats) -> None:
    """SHOWN += A v, `v` being inputs in rows of lanes."""
    for j in range(columns.shape[0]):
        if columns.ndim == 2:
            a = column(columns, j, 0)
            for lane in range(LANES):
                show_input(w, lane, a, v[j * LANES + lane])
        else:
            for lane in range(LANES):
                show_input(w, lane, column(columns, j, lane), v[j * LANES + lane])


@njit(**_KERNEL)
def evaluate(
    x: Floats, Lab: Floats, surfaces: Surfaces, AT: Floats, black: Floats, white: Floats, euclidean: bool, dE: Floats
) -> None:
    """dE00 between the wanted colours (m, 6) and those that x (m, n) gives, on each surface: `dE` (m, 2), out.

    dE76 where `euclidean`. The other arguments are those of `newton`.
    """
    n = x.shape[1]
    w = np.zeros(EVALUATION_ROWS * LANES)
    second = w[3 * LANES :]
    v = np.empty(n * LANES)
    columns = lane_columns(AT)
    per_white = (1.0 / white[0], 1.0 / white[1], 1.0 / white[2])
    for first in range(0, x.shape[0], LANES):
        count = min(LANES, x.shape[0] - first)
        for lane in range(LANES):
            p = first + min(lane, count - 1)
            take_own(AT, p, lane, columns)
            for i in range(6):
                w[WANTED + i * LANES + lane] = Lab[p, i]
                w[SHOWN + i * LANES + lane] = black_of(black, p, i)
            for j in range(n):
                v[j * LANES + lane] = x[p, j]
        show(w, v, columns)
        compare(w, per_white, euclidean)
        if len(surfaces) == 2:
            compare(second, per_white, euclidean)
        for lane in range(count):
            for s in range(len(surfaces)):
                dE[first + lane, s] = w[ERROR + 3 * s * LANES + lane]
