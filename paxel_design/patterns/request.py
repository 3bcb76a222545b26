"""What every layout is asked for, and the shares of the colorants as whole numbers of cells.

This file knows names, shares and numbers of cells; it knows no millimetres and no layout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant

__all__ = ["MOST_COLORANTS", "LayoutRequest", "apportion", "check_shares"]

MOST_COLORANTS = 12
"""Each colorant is a cluster to calibrate and covers at most its share of the light: beyond this nothing is left."""

_SUM_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class LayoutRequest:
    """What a layout has to fill cells with.

    Attributes
    ----------
    colorants : tuple of Colorant
        Cells are indices into it.
    shares : tuple of float
        Share of the area for each colorant, > 0, summing to 1.
    shape : (int, int)
        Rows and columns of cells that cover the pattern at its angle; a layout that repeats may ignore it.
    seed : int
        Seed of everything random.
    blue_noise : str
        Method of the blue-noise layout.
    flatness : float
        Of the blue-noise method ``"swap"``: see `paxel_design.patterns.swap`.
    tile_order : ``"search"`` or tuple of str
        Names of the colorants along one row of a tile or across the stripes.
    """

    colorants: tuple[Colorant, ...]
    shares: tuple[float, ...]
    shape: tuple[int, int] = (128, 128)
    seed: int = 0
    blue_noise: str = "swap"
    flatness: float = 2.0
    tile_order: str | tuple[str, ...] = "search"


def check_shares(shares: Sequence[float] | None, names: Sequence[str]) -> tuple[float, ...]:
    """Shares of the area, one for each colorant; equal ones for None.

    Raises
    ------
    InputError
        If there are not 2 to `MOST_COLORANTS` colorants, not as many shares, a share is not positive, or they do
        not sum to 1.
    """
    n = len(names)
    if not 2 <= n <= MOST_COLORANTS:
        raise InputError(
            f"a pattern must have 2 to {MOST_COLORANTS} colorants, got {n} ({', '.join(names) or 'none'}): "
            "each is a cluster to calibrate and gets only its share of the light"
        )
    if shares is None:
        return (1.0 / n,) * n
    values = tuple(float(share) for share in shares)
    if len(values) != n:
        raise InputError(f"a pattern's shares must be one for each of its {n} colorants, got {len(values)}")
    if not all(np.isfinite(values)) or min(values) <= 0:
        raise InputError(f"a pattern's shares must be > 0, got {list(values)}: leave a colorant without share out")
    total = sum(values)
    if abs(total - 1) > _SUM_TOLERANCE:
        suggestion = ", ".join(f"{value / total:.6g}" for value in values)
        raise InputError(f"a pattern's shares must sum to 1, got {total:.6g}; in this proportion: {suggestion}")
    return values


def apportion(shares: Sequence[float], total: int) -> NDArray[np.int64]:
    """Whole numbers of cells that sum to `total`, each within one cell of its share (largest remainders)."""
    exact = np.asarray(shares, np.float64) * total
    counts = np.floor(exact + 1e-9).astype(np.int64)
    rest = total - int(counts.sum())
    counts[np.argsort(counts - exact, kind="stable")[:rest]] += 1
    return counts
