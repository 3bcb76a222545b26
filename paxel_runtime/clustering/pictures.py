"""The map of clusters as a picture, colour-coded as Fig. 3 of the paper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.clustering.clusters import OUTSIDE
from paxel_runtime.errors import InputError

__all__ = ["cluster_colors", "label_detail", "label_picture"]

_FIG_3_COLORS = {"black": (214, 55, 46), "white": (44, 98, 190)}
_EDGE_COLORS = ((62, 168, 92), (240, 180, 40), (150, 80, 170), (60, 180, 190))
_COLORANT_COLORS = {
    "black": (35, 35, 35),
    "white": (250, 250, 250),
    "red": (214, 55, 46),
    "green": (62, 168, 92),
    "blue": (44, 98, 190),
    "cyan": (40, 175, 225),
    "magenta": (215, 50, 140),
    "yellow": (250, 215, 40),
}


def label_picture(labels: NDArray[np.uint8], names: Sequence[str]) -> NDArray[np.uint8]:
    """Colour-coded cluster map, (H, W, 3) uint8 sRGB, as Fig. 3 of the paper.

    Black and white are coded as there: black red, white blue, their edges green (and on). With other colorants
    each cluster has its colorant's own colour and an edge cluster the mean of its parents'. Outside is light gray.

    Raises
    ------
    InputError
        If a label has no name.
    """
    table = np.full((256, 3), 225, np.uint8)
    table[: len(names)] = cluster_colors(names)
    beyond = labels[(labels >= len(names)) & (labels != OUTSIDE)]
    if beyond.size:
        raise InputError(f"labels must be below {len(names)} (or 255 outside), got {int(beyond.max())}")
    return table[labels]


def label_detail(
    labels: NDArray[np.uint8], names: Sequence[str], size: tuple[int, int] = (160, 120), zoom: int = 4
) -> NDArray[np.uint8]:
    """The middle of `label_picture`, `size` (width, height) pixels at most, each `zoom` x `zoom` pixels large."""
    (H, W), (width, height) = labels.shape, size
    top, left = max(0, (H - height) // 2), max(0, (W - width) // 2)
    part = label_picture(labels[top : top + height, left : left + width], names)
    return np.repeat(np.repeat(part, zoom, axis=0), zoom, axis=1)


def cluster_colors(names: Sequence[str]) -> NDArray[np.uint8]:
    """sRGB colour, (K, 3) uint8, that stands for each cluster in `label_picture` and its legend."""
    colorants = [name for name in names if "+" not in name]
    parents = [_parents(name, colorants) for name in names]
    if set(colorants) <= {"black", "white"}:
        edges = iter(np.resize(_EDGE_COLORS, (len(names), 3)))
        return np.array([_FIG_3_COLORS[p[0]] if len(p) == 1 else next(edges) for p in parents], np.uint8)
    spare = iter(np.resize(_EDGE_COLORS, (len(names), 3)))
    own = {
        name: np.array(_COLORANT_COLORS.get(name.removeprefix("uv-")) or next(spare), np.float64) for name in colorants
    }
    return np.array([np.mean([own[name] for name in p], axis=0) for p in parents]).astype(np.uint8)


def _parents(name: str, colorants: Sequence[str]) -> list[str]:
    """Colorants of a cluster's name; ``-2`` numbers edges of the same parents, where it is not a part of a colorant."""
    parents = name.split("+")
    return parents if parents[-1] in colorants else name.rpartition("-")[0].split("+")
