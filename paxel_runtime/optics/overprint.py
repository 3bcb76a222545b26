"""Print beyond the solid inks of the library: other papers, and two inks on one place of the paper.

For the latter, the measured colour of both, and how much of each fine sample has it. This file knows no light.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.pattern import Colorant
from paxel_runtime.optics.geometry import BenchMaps
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.ink import InkLayers, ink_coverage

__all__ = ["lay_over", "overprint_reflectance", "papers"]

_Recipe = tuple[float, float, float, float]


def overprint_reflectance(first: _Recipe, second: _Recipe) -> NDArray[np.float64] | None:
    """Reflectance (81,) of two solid inks printed over each other, by their recipes (CMYK, 0..1).

    The solids of both together are one of the 16 Neugebauer primaries of FOGRA39L. None where a recipe is no solid of
    the process inks, or where both together are no other than one of them (blue over cyan).
    """
    if not all(share in (0.0, 1.0) for share in (*first, *second)) or not any(first) or not any(second):
        return None
    both = tuple(max(pair) for pair in zip(first, second, strict=True))
    return None if both in (first, second) else _primaries().get(both)


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
    layers: InkLayers, maps: BenchMaps, grid: FineGrid, decided: NDArray[np.uint8], pairs: list[tuple[int, int]]
) -> NDArray[np.uint8]:
    """Coverage by each ink alone, then by each of `pairs` together: (L + pairs, rows, columns) uint8.

    Within a sample, two inks that share it overlap by what their shares exceed the whole (their edges there run along
    each other, as those of neighbouring cells do). Pairs are dealt with in order; where three inks meet, the darkest
    two decide.

    Parameters
    ----------
    decided : (L, rows, columns) uint8 array
        `ink_coverage` of all layers, where the darker ink decides.
    pairs : list of (int, int)
        Layers whose overprint has a colour of its own, the darker first.
    """
    coverage = np.zeros((len(decided) + len(pairs), *grid.shape), np.uint8)
    coverage[: len(decided)] = decided
    alone = {k: ink_coverage(_one_layer(layers, k), maps, grid)[0] for k in sorted({k for pair in pairs for k in pair})}
    for place, (a, b) in enumerate(pairs, len(decided)):
        over = np.maximum(alone[a].astype(np.int16) + alone[b] - 255, 0)
        over = np.minimum(over, coverage[a])  # the darker ink had it all
        coverage[place] = over
        coverage[a] -= coverage[place]
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
