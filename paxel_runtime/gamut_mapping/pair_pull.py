"""Pulling the pairs of two pictures that lie outside the joint gamut inside: exact, and by as little as a ray allows.

Knows CIELAB pictures and half-spaces; nothing of how the pairs came about.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import linprog

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import GamutError
from paxel_runtime.gamut_mapping.pair_limits import pair_to_XYZ
from paxel_runtime.model.lab_scalars import root
from paxel_runtime.model.subgamut import PairGamut
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["deepest_grays", "pull_inside"]

_TILE = 16
_ROUNDING = 5e-7
"""How far inside a pulled pair ends, XYZ: so that float32 Lab does not carry it out again."""


def deepest_grays(pairs: PairGamut) -> NDArray[np.float64]:
    """XYZ (6,) of the pair of grays that is farthest from the joint gamut's boundary.

    Raises
    ------
    GamutError
        If no pair of grays lies inside.
    """
    white = pairs.white_point
    rows = np.stack([pairs.normals[:, :3] @ white, pairs.normals[:, 3:] @ white, np.ones(len(pairs.offsets))], axis=1)
    found = linprog([0.0, 0.0, -1.0], A_ub=rows, b_ub=pairs.offsets, bounds=[(0, 1), (0, 1), (0, None)])
    if not found.success or not found.x[2] > _ROUNDING:
        raise GamutError("no pair of grays lies inside the joint gamut: two pictures cannot be shown at once")
    return np.concatenate([found.x[0] * white, found.x[1] * white])


def pull_inside(
    Lab_pattern: NDArray[np.float32], Lab_white: NDArray[np.float32], pairs: PairGamut, anchor: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Move every pair that lies outside along the ray to `anchor`, in XYZ, onto the boundary; both pictures in place.

    Half-spaces that hold for a whole tile of pixels are not looked at again for each: exact, and many times faster
    where a model has thousands.

    Parameters
    ----------
    Lab_pattern, Lab_white : (H, W, 3) float32 arrays
    pairs : PairGamut
    anchor : (6,) float64 array
        XYZ of a pair well inside (`deepest_grays`).

    Returns
    -------
    (H, W) bool array
        Which pixels were moved.
    """
    rows, offsets, white = (np.array(a, np.float64) for a in (pairs.normals, pairs.offsets, pairs.white_point))
    moved = np.zeros(Lab_pattern.shape[:2], np.bool_)
    pull = partial(_pull, Lab_pattern, Lab_white, rows, offsets, white, anchor, moved)
    in_bands(pull, -(-len(moved) // _TILE))
    return moved


@njit(**KERNEL)
def _pull(
    Lab_pattern: NDArray[np.float32],
    Lab_white: NDArray[np.float32],
    rows: NDArray[np.float64],
    row_offsets: NDArray[np.float64],
    white: NDArray[np.float64],
    anchor: NDArray[np.float64],
    moved: NDArray[np.bool_],
    first: int,
    stop: int,
) -> None:
    for band in range(first, stop):
        top = band * _TILE
        bottom = min(top + _TILE, moved.shape[0])
        _pull_band(Lab_pattern[top:bottom], Lab_white[top:bottom], rows, row_offsets, white, anchor, moved[top:bottom])


@njit(**CALLED)
def _pull_band(
    Lab_pattern: NDArray[np.float32],
    Lab_white: NDArray[np.float32],
    rows: NDArray[np.float64],
    row_offsets: NDArray[np.float64],
    white: NDArray[np.float64],
    anchor: NDArray[np.float64],
    moved: NDArray[np.bool_],
) -> None:
    """Tiles of a band of raster rows, one after the other."""
    tall, width = moved.shape
    XYZ = np.empty((tall, _TILE, 6))
    Lab, low, high = np.empty(6), np.empty(6), np.empty(6)
    near = np.empty(len(row_offsets), np.int64)
    for left in range(0, width, _TILE):
        wide = min(_TILE, width - left)
        for c in range(6):
            low[c], high[c] = np.inf, -np.inf
        for i in range(tall):
            for j in range(wide):
                for c in range(3):
                    Lab[c], Lab[c + 3] = Lab_pattern[i, left + j, c], Lab_white[i, left + j, c]
                pair_to_XYZ(Lab, white, XYZ[i, j])
                for c in range(6):
                    low[c], high[c] = min(low[c], XYZ[i, j, c]), max(high[c], XYZ[i, j, c])
        count = 0
        for r in range(len(row_offsets)):
            least = row_offsets[r]
            for c in range(6):
                least -= max(rows[r, c] * low[c], rows[r, c] * high[c])
            if least < 0.0:
                near[count] = r
                count += 1
        if count == 0:
            continue
        for i in range(tall):
            for j in range(wide):
                share = _share_inside(XYZ[i, j], near[:count], rows, row_offsets, anchor)
                if share < 1.0:
                    moved[i, left + j] = True
                    _store(Lab_pattern[i, left + j], XYZ[i, j], 0, share, anchor, white)
                    _store(Lab_white[i, left + j], XYZ[i, j], 3, share, anchor, white)


@njit(**CALLED)
def _share_inside(
    XYZ: NDArray[np.float64],
    near: NDArray[np.int64],
    rows: NDArray[np.float64],
    row_offsets: NDArray[np.float64],
    anchor: NDArray[np.float64],
) -> float:
    """How much of the way from the anchor to a pair lies inside; 1 where the pair does."""
    share = 1.0
    for r in near:
        slack = row_offsets[r]
        for c in range(6):
            slack -= rows[r, c] * XYZ[c]
        if slack < -_ROUNDING:
            at_anchor = row_offsets[r]
            for c in range(6):
                at_anchor -= rows[r, c] * anchor[c]
            share = min(share, (at_anchor - _ROUNDING) / (at_anchor - slack))
    return share


@njit(**CALLED)
def _store(
    Lab: NDArray[np.float32],
    XYZ: NDArray[np.float64],
    first: int,
    share: float,
    anchor: NDArray[np.float64],
    white: NDArray[np.float64],
) -> None:
    """Lab of anchor + share (XYZ - anchor), three of the six numbers from `first`."""
    fx = root((anchor[first] + share * (XYZ[first] - anchor[first])) / white[0])
    fy = root((anchor[first + 1] + share * (XYZ[first + 1] - anchor[first + 1])) / white[1])
    fz = root((anchor[first + 2] + share * (XYZ[first + 2] - anchor[first + 2])) / white[2])
    Lab[0] = 116.0 * fy - 16.0
    Lab[1] = 500.0 * (fx - fy)
    Lab[2] = 200.0 * (fy - fz)
