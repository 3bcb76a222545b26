"""Repeatable tiles of any colorants with any area shares (paper, section III and Fig. 2), and stripes.

A tile is one row of N cells that repeats; each row above is the same, moved on by a number of cells: the shift. Order
and shift are searched for least visibility with the colorants' own colours, since the eye resolves light against dark
best and blue against yellow least. Stripes are the tile without shift.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import factorial, gcd, prod

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.request import LayoutRequest, apportion
from paxel_design.patterns.visibility import row_visibility
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.errors import InputError

__all__ = ["MOST_CELLS", "SHARE_TOLERANCE", "stripes", "tile_counts", "tile_of", "tiles"]

MOST_CELLS = 24
"""Longest row before it repeats."""

SHARE_TOLERANCE = 0.005
"""A row is lengthened until every share is met this well, or `MOST_CELLS` is reached."""

_MOST_ORDERS = 5040  # tried one by one (8 different cells); with more, descent from random orders
_STARTS = 4
_TIE = 1e-9  # equally visible orders: the first one found, on every machine


def tiles(request: LayoutRequest) -> NDArray[np.uint8]:
    """Least visible tile of a request, (N / gcd(N, shift), N) cells; see `tile_counts` for the shares.

    Raises
    ------
    InputError
        If the shares need a longer row than `MOST_CELLS`, or ``tile_order`` does not fit colorants and shares.
    """
    return tile_of(*_search(request, _given_order(request), range(MOST_CELLS)))


def stripes(request: LayoutRequest) -> NDArray[np.uint8]:
    """Least visible stripes of a request, one cell wide or several in a row, (1, N) cells; as `tiles`."""
    return tile_of(*_search(request, _given_order(request), range(1)))


def tile_of(order: NDArray[np.integer], shift: int) -> NDArray[np.uint8]:
    """Cells of a tile: cell (r, c) is ``order[(c + r * shift) % N]``, (N / gcd(N, shift), N) uint8."""
    n = order.size
    rows = n // gcd(n, shift) if shift else 1
    r, c = np.ogrid[:rows, :n]
    return order[(c + r * shift) % n].astype(np.uint8)


def tile_counts(shares: Sequence[float]) -> NDArray[np.int64]:
    """Cells of each colorant in a row: the shortest row whose shares all lie within `SHARE_TOLERANCE`.

    If no row up to `MOST_CELLS` does, the closest one; `Pattern.shares` tells what was realised.

    Raises
    ------
    InputError
        If a share is too small to get a cell.
    """
    wanted = np.asarray(shares, np.float64)
    rows = [apportion(shares, n) for n in range(wanted.size, MOST_CELLS + 1)]
    rows = [counts for counts in rows if counts.min() > 0]
    if not rows:
        raise InputError(
            f"a tile's shares must leave each colorant a cell in a row of {MOST_CELLS}, got {list(shares)}: "
            'take larger shares, or layout = "blue-noise"'
        )
    errors = [float(np.abs(counts / counts.sum() - wanted).max()) for counts in rows]
    fits = [i for i, error in enumerate(errors) if error <= SHARE_TOLERANCE]
    return rows[fits[0] if fits else int(np.argmin(errors))]


def _given_order(request: LayoutRequest) -> NDArray[np.uint8] | None:
    """The order that the request names, as (1, N) indices; None for a search."""
    names = [colorant.name for colorant in request.colorants]
    if request.tile_order == "search":
        return None
    if isinstance(request.tile_order, str):
        raise InputError(f'a pattern\'s tile_order must be "search" or a list of colorants, got {request.tile_order!r}')
    given = list(request.tile_order)
    if set(given) != set(names):
        raise InputError(
            f"a pattern's tile_order must name each of its colorants ({', '.join(names)}) and no other, "
            f"got {', '.join(given) or 'none'}"
        )
    order = np.array([names.index(name) for name in given], np.uint8)
    realised = np.bincount(order, minlength=len(names)) / order.size
    if np.abs(realised - request.shares).max() > SHARE_TOLERANCE:
        raise InputError(
            f"a pattern's tile_order must have its shares {[round(share, 4) for share in request.shares]}, got "
            f"{[round(float(share), 4) for share in realised]}: leave shares out, or name colorants as often as needed"
        )
    return order[None]


def _search(request: LayoutRequest, orders: NDArray[np.uint8] | None, shifts: range) -> tuple[NDArray[np.uint8], int]:
    """Least visible order and shift; `orders` (M, N) to choose from, or None for all orders of the counts."""
    XYZ = colorants_to_XYZ(request.colorants)
    if orders is not None:
        return _best(orders, XYZ, shifts)
    counts = tile_counts(request.shares)
    if factorial(int(counts.sum()) - 1) // prod(factorial(int(n)) for n in counts) * int(counts[0]) <= _MOST_ORDERS:
        return _best(np.array(list(_arrangements(counts))), XYZ, shifts)
    return _descend(counts, XYZ, shifts, request.seed)


def _best(orders: NDArray[np.uint8], XYZ: NDArray[np.float64], shifts: range) -> tuple[NDArray[np.uint8], int]:
    """Least visible of (M, N) orders with the best of the shifts; a shift and its mirror image count as one."""
    n = orders.shape[1]
    rows_XYZ = XYZ[orders]
    best, order, best_shift = np.inf, orders[0], 0
    for shift in shifts[: n // 2 + 1]:
        visibility = row_visibility(rows_XYZ, shift)
        first = int(np.argmax(visibility <= visibility.min() + _TIE))
        if visibility[first] < best - _TIE:
            best, order, best_shift = float(visibility[first]), orders[first], shift
    return order, best_shift


def _arrangements(counts: NDArray[np.int64]) -> Iterator[list[int]]:
    """All different orders of a row with these counts that begin with colorant 0 (the row is cyclic)."""

    def extend(order: list[int], left: list[int]) -> Iterator[list[int]]:
        if not any(left):
            yield list(order)
        for k, n in enumerate(left):
            if n:
                left[k] -= 1
                yield from extend([*order, k], left)
                left[k] += 1

    left = counts.tolist()
    left[0] -= 1
    return extend([0], left)


def _descend(
    counts: NDArray[np.int64], XYZ: NDArray[np.float64], shifts: range, seed: int
) -> tuple[NDArray[np.uint8], int]:
    """Swap the two cells of a row that help most until none do, from a few random orders; the best of them."""
    rng = np.random.default_rng(seed)
    cells = np.repeat(np.arange(counts.size, dtype=np.uint8), counts)
    i, j = np.triu_indices(cells.size, 1)
    found = []
    for _ in range(_STARTS):
        order, shift = _best(rng.permutation(cells)[None], XYZ, shifts)
        while True:
            swapped = np.repeat(order[None], i.size + 1, axis=0)
            every = np.arange(i.size)
            swapped[every + 1, i], swapped[every + 1, j] = order[j], order[i]
            better, better_shift = _best(swapped, XYZ, shifts)
            if np.array_equal(better, order) and better_shift == shift:
                break
            order, shift = better, better_shift
        found.append(order)
    return _best(np.array(found), XYZ, shifts)
