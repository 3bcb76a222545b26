"""Functions of a picture's colour as 3-D tables: a lattice of sRGB colours and tetrahedra between them.

An effect with one picture is a function of that picture's colour alone, mapping and inversion included: `build_table`
tabulates its inputs x. A gamut mapping alone is one too: `build_mapping_table` tabulates the colours it gives, for
`plan_frame`. Either is looked up at video speed. The lattice is regular in 8-bit sRGB; each cell is cut into six
tetrahedra along its gray diagonal, so grays are interpolated between grays (J. Kasson et al. 1995, *tetrahedral
interpolation*).

The error is measured at the middles of the tetrahedra's edges and stands in the table. On a tetrahedron with weights
w_i of its corners, linear interpolation misses a quadratic by the sum over its edges of 4 w_i w_j times the error at
the edge's middle, and the sum of w_i w_j is 3/8 at most: nowhere more than 3/2 of the largest of those errors.

Knows 8-bit sRGB, CIELAB and inputs; nothing of effects, files or clusters' places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["ColourTable", "MappingTable", "build_mapping_table", "build_table", "look_up", "tetrahedron"]

ColourFunction: TypeAlias = Callable[[NDArray[np.float32]], NDArray[np.floating]]
Corners: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64]
Weights: TypeAlias = tuple[np.float32, np.float32, np.float32, np.float32]

_PROBES = 50_000
_EDGES = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 1, 1]])


@dataclass(frozen=True, eq=False)
class _Error:
    """Of the interpolation, at the middles of the tetrahedra's edges (50,000 of them at most).

    Attributes
    ----------
    dE00_p99, dE00_max : float
        99 % of them, and all.
    """

    dE00_p99: float
    dE00_max: float

    @property
    def dE00_bound(self) -> float:
        """Error nowhere exceeded where the function is quadratic across a cell: 3/2 of `dE00_max`."""
        return 1.5 * self.dE00_max


@dataclass(frozen=True, eq=False)
class ColourTable(_Error):
    """Inputs of every colour of a lattice; the error is in predicted colour, on the worse surface.

    Attributes
    ----------
    x : (m, m, m, n) float32 array
        Linear inputs at sRGB red, green, blue = 255 i / (m - 1).
    """

    x: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class MappingTable(_Error):
    """What a gamut mapping makes of every colour of a lattice.

    Attributes
    ----------
    Lab : (m, m, m, 3) float32 array
        Mapped CIELAB at sRGB red, green, blue = 255 i / (m - 1).
    """

    Lab: NDArray[np.float32]


def build_table(Lab_to_x: ColourFunction, model: PredictionModel, *, nodes: int = 33, seed: int = 0) -> ColourTable:
    """Tabulate the inputs of a single-picture effect.

    Parameters
    ----------
    Lab_to_x : callable
        Picture colours, CIELAB (count, 3) float32 -> linear inputs (count, n): a mapping followed by `invert`.
    model : PredictionModel
        Predicts what an interpolated x shows, for the error.
    nodes : int
        m, 2..65; memory is 4 n m^3 bytes.
    seed : int
        Of the edges that are probed, where there are more than 50,000.

    Returns
    -------
    ColourTable

    Raises
    ------
    InputError
        If `nodes` is out of range, or the function gives other than (count, n) finite numbers.
    """
    x, exact, found = _tabulate(Lab_to_x, model.n, nodes, seed)
    pairs = zip(model.predict(exact), model.predict(found), strict=True)
    errors = np.max([dE00(a, b) for a, b in pairs if a is not None and b is not None], axis=0)
    return ColourTable(float(np.quantile(errors, 0.99)), float(errors.max()), x)


def build_mapping_table(Lab_to_Lab: ColourFunction, *, nodes: int = 33, seed: int = 0) -> MappingTable:
    """Tabulate a gamut mapping, for `plan_frame`.

    Parameters
    ----------
    Lab_to_Lab : callable
        Picture colours, CIELAB (count, 3) float32 -> wanted colours (count, 3), each for itself: a static mapping with
        a fixed range of lightness.
    nodes, seed : int
        As in `build_table`.

    Returns
    -------
    MappingTable

    Raises
    ------
    InputError
        If `nodes` is out of range, or the function gives other than (count, 3) finite numbers.
    """
    Lab, exact, found = _tabulate(Lab_to_Lab, 3, nodes, seed)
    errors = dE00(exact, found)
    return MappingTable(float(np.quantile(errors, 0.99)), float(errors.max()), Lab)


def _tabulate(
    function: ColourFunction, values: int, nodes: int, seed: int
) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.float64]]:
    """The table, and at the middles of edges what the function gives and what the table gives."""
    if not 2 <= nodes <= 65:
        raise InputError(f"a colour table needs 2 to 65 nodes an axis, got {nodes}")
    steps = np.linspace(0.0, 1.0, nodes)
    lattice = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    table = _asked(function, lattice, values).astype(np.float32).reshape(nodes, nodes, nodes, values)
    begin, end = _edges(nodes, seed)
    middles = (begin + end) / (2.0 * (nodes - 1))
    found = 0.5 * (table[tuple(begin.T)].astype(np.float64) + table[tuple(end.T)])
    return table, _asked(function, middles, values).astype(np.float64), found


def _edges(nodes: int, seed: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Both ends of the tetrahedra's edges, (count, 3) places in the lattice; of too many, some at random."""
    places = np.stack(np.meshgrid(*[np.arange(nodes)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    begin, end = (part.reshape(-1, 3) for part in np.broadcast_arrays(places, places + _EDGES))
    inside = np.flatnonzero(end.max(axis=1) < nodes)
    if len(inside) > _PROBES:
        inside = np.random.default_rng(seed).choice(inside, _PROBES, replace=False)
    return begin[inside], end[inside]


def _asked(function: ColourFunction, sRGB: NDArray[np.float64], values: int) -> NDArray[np.floating]:
    result = np.asarray(function(sRGB_to_Lab(sRGB).astype(np.float32)))
    if result.shape != (len(sRGB), values) or not np.isfinite(result).all():
        raise InputError(
            f"a colour table needs {(len(sRGB), values)} finite values from its function, got {result.shape}"
        )
    return result


def look_up(table: ColourTable | MappingTable, picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear inputs, or mapped CIELAB, of every pixel.

    Parameters
    ----------
    table : ColourTable or MappingTable
    picture : (..., 3) uint8 array
        sRGB.

    Returns
    -------
    (..., n) or (..., 3) float32 array

    Raises
    ------
    InputError
        If the picture is not 8-bit sRGB.
    """
    if picture.shape[-1:] != (3,) or picture.dtype != np.uint8:
        raise InputError(f"a colour table takes (..., 3) uint8 sRGB, got {picture.shape} {picture.dtype}")
    lattice = table.x if isinstance(table, ColourTable) else table.Lab
    nodes, values = lattice.shape[0], lattice.shape[-1]
    rows = lattice.reshape(-1, values)
    colours = np.ascontiguousarray(picture).reshape(-1, 3)
    found = np.empty((len(colours), values), np.float32)
    in_bands(lambda first, stop: _interpolate(rows, nodes, colours[first:stop], found[first:stop]), len(colours))
    return found.reshape(*picture.shape[:-1], values)


@njit(**INLINED)
def _larger(a: float, b: float) -> float:
    return a if a > b else b  # the built-in max and min look for NaN


@njit(**INLINED)
def _smaller(a: float, b: float) -> float:
    return a if a < b else b


@njit(**INLINED)
def tetrahedron(m: int, red_code: int, green_code: int, blue_code: int) -> tuple[Corners, Weights]:
    """Corners of the tetrahedron around an 8-bit colour, as rows of the flattened lattice of m^3, and their weights.

    From the cell's dark corner along its axes to the bright one, in falling order of the fractions.
    """
    scale = np.float32((m - 1) / 255.0)
    r, g, b = scale * np.float32(red_code), scale * np.float32(green_code), scale * np.float32(blue_code)
    i, j, k = _smaller(np.int32(r), m - 2), _smaller(np.int32(g), m - 2), _smaller(np.int32(b), m - 2)
    u, v, w = r - np.float32(i), g - np.float32(j), b - np.float32(k)
    above, below = _larger(u, v), _smaller(u, v)
    high, low = _larger(above, w), _smaller(below, w)
    mid = _larger(below, _smaller(above, w))
    red, green, blue = m * m, m, 1
    # selections, not branches: of six ways through a cell a processor guesses most wrongly
    first = red if (u >= v) & (u >= w) else (green if v >= w else blue)
    last = blue if (w <= u) & (w <= v) else (green if v <= u else red)
    dark = (i * m + j) * m + k
    bright = dark + red + green + blue
    corners = np.uint64(dark), np.uint64(dark + first), np.uint64(bright - last), np.uint64(bright)  # never wraps
    return corners, (np.float32(1.0) - high, high - mid, mid - low, low)


@njit(**KERNEL)
def _interpolate(rows: NDArray[np.float32], nodes: int, colours: NDArray[np.uint8], found: NDArray[np.float32]) -> None:
    """Values (count, c) of a flattened lattice (nodes^3, c) at colours (count, 3)."""
    for p in range(colours.shape[0]):
        (dark, second, third, bright), (w0, w1, w2, w3) = tetrahedron(
            nodes, colours[p, 0], colours[p, 1], colours[p, 2]
        )
        for c in range(found.shape[1]):
            found[p, c] = w0 * rows[dark, c] + w1 * rows[second, c] + w2 * rows[third, c] + w3 * rows[bright, c]
