"""Print beyond the solid inks of the library: other papers, and several inks on one place of the paper.

For the latter, the measured colour of them together, and how much of each fine sample has it. This file knows no light.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.pattern import Colorant
from paxel_runtime.optics.geometry import BenchMaps
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.ink import InkLayers, ink_coverage

__all__ = ["lay_over", "overprints", "papers"]

_Recipe = tuple[float, float, float, float]


def overprints(recipes: Sequence[_Recipe | None]) -> dict[tuple[int, ...], NDArray[np.float64]]:
    """Reflectance (81,) of every group of inks that has a colour of its own where its solids lie over each other.

    Together, solids of the process inks are one of the 16 Neugebauer primaries of FOGRA39L. Left out are groups with an
    ink whose recipe is no solid, and those that are together no other than a part of them (blue over cyan).

    Parameters
    ----------
    recipes : sequence of CMYK or None
        Of each ink, 0..1; None for an ink with a plate of its own.

    Returns
    -------
    dict of numbers of inks, rising -> spectrum
        Pairs first.
    """
    solid = [
        i
        for i, recipe in enumerate(recipes)
        if recipe is not None and any(recipe) and all(share in (0.0, 1.0) for share in recipe)
    ]
    groups = {}
    for size in range(2, len(solid) + 1):
        for group in combinations(solid, size):
            together = _together(recipes, group)
            parts = [_together(recipes, part) for part in combinations(group, size - 1)]
            if together not in parts and together in _primaries():
                groups[group] = _primaries()[together]
    return groups


def _together(recipes: Sequence[_Recipe | None], group: tuple[int, ...]) -> tuple[float, ...]:
    return tuple(max(shares) for shares in zip(*(recipes[i] or (0.0,) * 4 for i in group), strict=True))


@cache
def papers() -> dict[str, Colorant]:
    """Papers other than the library's coated white: ``"uncoated"`` (FOGRA29L)."""
    rows = _rows("papers.csv")
    return {row[0]: Colorant(row[0], np.array(row[5:], np.float64), (0.0, 0.0, 0.0, 0.0)) for row in rows}


@cache
def _primaries() -> dict[tuple[float, ...], NDArray[np.float64]]:
    return {tuple(map(float, row[1:5])): np.array(row[5:], np.float64) for row in _rows("overprints.csv")}


def _rows(table: str) -> list[list[str]]:
    text = (files("paxel_runtime") / "data" / table).read_text(encoding="utf-8")
    return [line.split(",") for line in text.splitlines() if not line.startswith(("#", "name"))]


def lay_over(
    layers: InkLayers, maps: BenchMaps, grid: FineGrid, decided: NDArray[np.uint8], groups: Sequence[tuple[int, ...]]
) -> NDArray[np.uint8]:
    """Coverage by each ink alone, then by each of `groups` together: (L + groups, rows, columns) uint8.

    Within a sample, inks that share it overlap by what their shares exceed the whole (the edges of two there run along
    each other, as those of neighbouring cells do). Groups are dealt with in order; each takes its overlap from those
    that are a part of it, then from the darkest of its inks, which had it all.

    Parameters
    ----------
    decided : (L, rows, columns) uint8 array
        `ink_coverage` of all layers, where the darker ink decides.
    groups : sequence of tuples of int
        Layers whose overprint has a colour of its own, the darkest first; from `overprints`.
    """
    coverage = np.zeros((len(decided) + len(groups), *grid.shape), np.uint8)
    coverage[: len(decided)] = decided
    involved = sorted({k for group in groups for k in group})
    alone = {k: ink_coverage(_one_layer(layers, k), maps, grid)[0] for k in involved}
    for place, group in enumerate(groups, len(decided)):
        over = alone[group[0]].copy()
        for k in group[1:]:
            np.maximum(over, 255 - alone[k], out=over)
            over -= 255 - alone[k]
        parts = [len(decided) + i for i, part in enumerate(groups) if set(part) < set(group)]
        for source in (*reversed(parts), group[0]):
            moved = np.minimum(over, coverage[source])
            coverage[source] -= moved
            coverage[place] += moved
            over -= moved
    return coverage


def _one_layer(layers: InkLayers, k: int) -> InkLayers:
    """Layer k as it would be without the others, its edges as rough as among them."""
    ragged = layers.ragged_mm
    if len(ragged):
        steps = np.round(k / layers.ragged_step_mm * np.array([5.3, -3.7])).astype(int)  # the place that k has in it
        ragged = np.roll(ragged, (int(steps[0]), int(steps[1])), (0, 1))
    return layers._replace(
        differs=layers.differs[k : k + 1],
        offsets_mm=layers.offsets_mm[k : k + 1],
        ragged_mm=np.ascontiguousarray(ragged),
    )
