"""Single-picture effects through a 3-D table: inputs x at a lattice of picture colours, tetrahedra between them.

An effect with one picture is a function of that picture's colour alone, mapping and inversion included, so it can be
tabulated once and looked up at video speed. The lattice is regular in 8-bit sRGB; each cell is cut into six tetrahedra
along its gray diagonal, so grays are interpolated between grays (J. Kasson et al. 1995, *tetrahedral interpolation*).
The error is measured where it is largest, at the middle of cells, and stands in the table. Knows 8-bit sRGB and
inputs; nothing of effects, files or clusters' places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["ColourTable", "build_table", "look_up"]

_PROBES = 20_000


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Inputs of every colour of a lattice.

    Attributes
    ----------
    x : (m, m, m, n) float32 array
        Linear inputs at sRGB red, green, blue = 255 i / (m - 1).
    dE00_p99, dE00_max : float
        Error of the interpolation in predicted colour, on the worse surface: 99 % and all of 20,000 middles of cells.
    """

    x: NDArray[np.float32]
    dE00_p99: float
    dE00_max: float


def build_table(
    Lab_to_x: Callable[[NDArray[np.float32]], NDArray[np.floating]],
    model: PredictionModel,
    *,
    nodes: int = 33,
    seed: int = 0,
) -> ColourTable:
    """Tabulate a function of picture colours.

    Parameters
    ----------
    Lab_to_x : callable
        Picture colours, CIELAB (count, 3) float32 -> linear inputs (count, n): a mapping followed by `invert`.
    model : PredictionModel
        Predicts what an interpolated x shows, for the error.
    nodes : int
        m, 2..65; memory is 4 n m^3 bytes.
    seed : int
        Of the cells that are probed, where there are more than 20,000.

    Returns
    -------
    ColourTable

    Raises
    ------
    InputError
        If `nodes` is out of range, or the function gives other than (count, n) finite numbers.
    """
    if not 2 <= nodes <= 65:
        raise InputError(f"a colour table needs 2 to 65 nodes an axis, got {nodes}")
    steps = np.linspace(0.0, 1.0, nodes)
    lattice = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    x = _asked(Lab_to_x, lattice, model.n).astype(np.float32).reshape(nodes, nodes, nodes, model.n)
    cells = np.random.default_rng(seed).integers(0, nodes - 1, (min(_PROBES, 4 * (nodes - 1) ** 3), 3))
    middles = (cells + 0.5) / (nodes - 1)
    exact = _asked(Lab_to_x, middles, model.n)
    found = np.empty((len(middles), model.n), np.float32)
    _interpolate(x, (255.0 * middles).astype(np.float32), found)
    pairs = zip(model.predict(exact), model.predict(found.astype(np.float64)), strict=True)
    errors = np.max([dE00(a, b) for a, b in pairs if a is not None and b is not None], axis=0)
    return ColourTable(x, float(np.quantile(errors, 0.99)), float(errors.max()))


def _asked(
    Lab_to_x: Callable[[NDArray[np.float32]], NDArray[np.floating]], sRGB: NDArray[np.float64], n: int
) -> NDArray[np.floating]:
    x = np.asarray(Lab_to_x(sRGB_to_Lab(sRGB).astype(np.float32)))
    if x.shape != (len(sRGB), n) or not np.isfinite(x).all():
        raise InputError(f"a colour table needs {(len(sRGB), n)} finite inputs from its function, got {x.shape}")
    return x


def look_up(table: ColourTable, picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear inputs of every pixel.

    Parameters
    ----------
    table : ColourTable
    picture : (..., 3) uint8 array
        sRGB.

    Returns
    -------
    (..., n) float32 array

    Raises
    ------
    InputError
        If the picture is not 8-bit sRGB.
    """
    if picture.shape[-1:] != (3,) or picture.dtype != np.uint8:
        raise InputError(f"a colour table takes (..., 3) uint8 sRGB, got {picture.shape} {picture.dtype}")
    n = table.x.shape[-1]
    x = np.empty((picture.size // 3, n), np.float32)
    _interpolate(table.x, picture.reshape(-1, 3), x)
    return x.reshape(*picture.shape[:-1], n)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _interpolate_one(table: NDArray[np.float32], colour: NDArray[np.number], x: NDArray[np.float32]) -> None:
    """From the cell's dark corner along its axes to the bright one, in falling order of the fractions."""
    m = table.shape[0]
    scale = np.float32((m - 1) / 255.0)
    r, g, b = scale * colour[0], scale * colour[1], scale * colour[2]
    i, j, k = min(int(r), m - 2), min(int(g), m - 2), min(int(b), m - 2)
    u, v, w = np.float32(r - i), np.float32(g - j), np.float32(b - k)
    if u >= v:
        if v >= w:
            second, third, high, mid, low = (1, 0, 0), (1, 1, 0), u, v, w
        elif u >= w:
            second, third, high, mid, low = (1, 0, 0), (1, 0, 1), u, w, v
        else:
            second, third, high, mid, low = (0, 0, 1), (1, 0, 1), w, u, v
    elif w >= v:
        second, third, high, mid, low = (0, 0, 1), (0, 1, 1), w, v, u
    elif w >= u:
        second, third, high, mid, low = (0, 1, 0), (0, 1, 1), v, w, u
    else:
        second, third, high, mid, low = (0, 1, 0), (1, 1, 0), v, u, w
    for c in range(table.shape[3]):
        x[c] = (
            (np.float32(1.0) - high) * table[i, j, k, c]
            + (high - mid) * table[i + second[0], j + second[1], k + second[2], c]
            + (mid - low) * table[i + third[0], j + third[1], k + third[2], c]
            + low * table[i + 1, j + 1, k + 1, c]
        )


@njit(cache=True, parallel=True)
def _interpolate(table: NDArray[np.float32], colours: NDArray[np.number], x: NDArray[np.float32]) -> None:
    """x (count, n) at colours (count, 3), 0..255."""
    for p in prange(len(colours)):
        _interpolate_one(table, colours[p], x[p])
