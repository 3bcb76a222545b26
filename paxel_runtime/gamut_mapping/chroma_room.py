"""Colour in the room that lightness leaves: how far each part of the frame may go from static mapping to the source.

The *return* u of a place is -1 where a colour keeps only `LEAST_CHROMA` of the chroma that static mapping gives it, 0
where it keeps that, 1 where it has the source's own; hue stays. u changes slowly over the frame, one u a surface, so
colour takes room without letting the other picture in. Knows CIELAB pictures and the joint gamut.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, eye

from paxel_runtime.bands import in_bands
from paxel_runtime.gamut_mapping.pair_fit import Aim, fit_pair
from paxel_runtime.gamut_mapping.pair_limits import half_planes, relevant_rows
from paxel_runtime.gamut_mapping.spline_grid import SplineGrid, spline_weights, weighted_rows
from paxel_runtime.model.subgamut import PairGamut
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["LEAST_CHROMA", "ChromaReturn", "fit_chroma_return"]

LEAST_CHROMA = 0.87
"""Share of static mapping's chroma that lightness leaves room for."""

_SMOOTHNESS = 4.0
"""Weight of changes over the frame, against that of being below 1."""
_MARGIN = 0.02
_ITERATIONS = 160
_EVERY = 32
_NO_CHROMA = 1e-3


@dataclass(frozen=True, eq=False)
class ChromaReturn:
    """u over the frame.

    Attributes
    ----------
    grid : SplineGrid
        Over rows and columns.
    control : (rows, columns) float64 array
        Control values, -1..1.
    """

    grid: SplineGrid
    control: NDArray[np.float64]

    def apply(
        self, Lab_source: NDArray[np.float32], Lab_static: NDArray[np.float32], L: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Target (H, W, 3): lightness L (H, W), the source's hue, and chroma by the return."""
        rows = spline_weights((np.arange(self.grid.height) + 0.5) / self.grid.height, self.grid.cells[0])
        columns = spline_weights((np.arange(self.grid.width) + 0.5) / self.grid.width, self.grid.cells[1])
        pictures = (np.ascontiguousarray(picture, np.float32) for picture in (Lab_source, Lab_static, L))
        target = np.empty(Lab_static.shape, np.float32)
        control = np.array(self.control[..., None], np.float64)
        in_bands(partial(_apply, *pictures, control, *rows, *columns, target), len(target))
        return target


def fit_chroma_return(
    grid: SplineGrid,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    L: NDArray[np.float64],
    ab_source: NDArray[np.float64],
    chroma: NDArray[np.float64],
    pairs: PairGamut,
) -> tuple[ChromaReturn, ChromaReturn]:
    """The returns of both surfaces that bring most colour back while every sampled pair can be shown.

    Parameters
    ----------
    grid : SplineGrid
        Over rows and columns.
    rows, columns : (n,) int64 arrays
        The samples.
    L : (n, 2) float64 array
        Lightness of the targets on the pattern and on the white surface.
    ab_source : (n, 2, 2) float64 array
        (a*, b*) of the sources.
    chroma : (n, 2) float64 array
        Chroma of static mapping.
    pairs : PairGamut
    """
    sampled = grid.at(rows, columns)
    chroma_source = np.hypot(ab_source[..., 0], ab_source[..., 1])
    hue = ab_source / np.maximum(chroma_source, _NO_CHROMA)[..., None]
    up = np.maximum(chroma_source - chroma, 0.0)
    aims = tuple(_aim(grid, sampled, up[:, s]) for s in range(2))

    def colors(C: NDArray[np.float64], L: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([L[..., None], C[..., None] * hue], axis=-1).reshape(-1, 6)

    pairs = relevant_rows(pairs, colors(chroma, L))

    def limits(u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        slope = np.where(u < 0, (1 - LEAST_CHROMA) * chroma, up)
        now = colors(chroma + np.clip(u, -1, 1) * slope, L)
        return half_planes(now, colors(slope, np.zeros_like(L)), u, pairs, _MARGIN)

    fitted = fit_pair((aims[0], aims[1]), limits, iterations=_ITERATIONS, every=_EVERY)
    first, second = (ChromaReturn(grid, np.clip(grid.unraveled(c), -1, 1)) for c in fitted)
    return first, second


def _aim(grid: SplineGrid, sampled: csr_matrix, gain: NDArray[np.float64]) -> Aim:
    """u = 1, by the chroma that it brings, and smooth."""
    weight = sampled.T @ gain
    weight = weight / max(float(weight.mean()), 1e-9) + 0.1
    down, across = (grid.differences(axis) for axis in (0, 1))
    quadratic = _SMOOTHNESS * (down.T @ down + across.T @ across) + csr_matrix(np.diag(weight))
    return Aim(quadratic.tocsr(), weight, sampled, csr_matrix(eye(grid.size)), (-1.0, 1.0), np.zeros(grid.size))


@njit(**KERNEL)
def _apply(
    Lab_source: NDArray[np.float32],
    Lab_static: NDArray[np.float32],
    L: NDArray[np.float32],
    control: NDArray[np.float64],
    row_first: NDArray[np.int64],
    row_weights: NDArray[np.float64],
    column_first: NDArray[np.int64],
    column_weights: NDArray[np.float64],
    target: NDArray[np.float32],
    first: int,
    stop: int,
) -> None:
    for row in range(first, stop):
        line = weighted_rows(control, row_first[row], row_weights[row])
        _apply_row(Lab_source[row], Lab_static[row], L[row], line, column_first, column_weights, target[row])


@njit(**CALLED)
def _apply_row(
    Lab_source: NDArray[np.float32],
    Lab_static: NDArray[np.float32],
    L: NDArray[np.float32],
    line: NDArray[np.float64],
    column_first: NDArray[np.int64],
    column_weights: NDArray[np.float64],
    target: NDArray[np.float32],
) -> None:
    for column in range(len(L)):
        u = 0.0
        for c in range(3):
            u += column_weights[column, c] * line[column_first[column] + c, 0]
        a, b = Lab_source[column, 1], Lab_source[column, 2]
        C_source = np.sqrt(a * a + b * b)
        C = np.sqrt(Lab_static[column, 1] ** 2 + Lab_static[column, 2] ** 2)
        C += u * (max(C_source - C, 0.0) if u > 0.0 else (1.0 - LEAST_CHROMA) * C)
        scale = C / C_source if C_source > _NO_CHROMA else 0.0
        target[column, 0] = L[column]
        target[column, 1] = scale * a
        target[column, 2] = scale * b
