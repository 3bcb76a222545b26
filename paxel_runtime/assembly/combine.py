"""Combined pixels: all pixels of a small block show one pair of colours (paper: section V-A3, its simple approach).

A block holds every cluster, so that the effect is right whatever the picture; its resolution is that of the blocks.
Knows inputs and labels; nothing of colours or codes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.assembly.dither import check_inputs
from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import KERNEL

__all__ = ["block_px_of", "combine"]


def block_px_of(dot_px: float, colorants: int) -> int:
    """Pixels along a block that holds every colorant, wherever it lies: sqrt(M) dots, rounded up to whole ones."""
    if not dot_px > 0 or colorants < 1:
        raise InputError(f"blocks need dots larger than 0 px and a colorant, got {dot_px} and {colorants}")
    return max(2, math.ceil(dot_px * math.ceil(math.sqrt(colorants)) - 1e-6))


def combine(x: NDArray[np.float32], labels: NDArray[np.uint8], channels: int, block_px: int) -> NDArray[np.float32]:
    """Intensities (H, W, N): each pixel takes its own cluster's inputs of the mean x of its block; 0 outside.

    Parameters
    ----------
    x : (H, W, n) float32 array
        Linear inputs 0..1, n = K N; may be a memory map.
    labels : (H, W) or (H, W, N) uint8 array
        Cluster of each pixel, in each channel where those differ; 255 = outside the pattern.
    channels : int
        N.
    block_px : int
        Pixels along a block; see `block_px_of`.

    Raises
    ------
    InputError
        If shapes do not fit, a label names no cluster, or the block is not at least a pixel.
    """
    by_channel = check_inputs(x, labels, channels)
    if block_px < 1:
        raise InputError(f"a block must be at least 1 pixel, got {block_px}")
    p = np.zeros((*labels.shape[:2], channels), np.float32)
    blocks_at_once = max(1, 256 // block_px)

    def work(start: int, stop: int) -> None:
        for first in range(start, stop, blocks_at_once):
            rows = slice(first * block_px, min(first + blocks_at_once, stop) * block_px)
            x_rows = np.ascontiguousarray(x[rows], np.float32)
            _combine_rows(x_rows, np.ascontiguousarray(by_channel[rows]), block_px, p[rows])

    in_bands(work, -(-len(p) // block_px))
    return p


@njit(**KERNEL)
def _combine_rows(x: NDArray[np.float32], labels: NDArray[np.uint8], block: int, p: NDArray[np.float32]) -> None:
    height, width, n = x.shape
    channels = labels.shape[2]
    for i in range(-(-height // block)):
        mean = np.empty(n)
        last = min(i * block + block, height)
        for first in range(0, width, block):
            mean[:] = 0.0
            count = 0
            for row in range(i * block, last):
                for column in range(first, min(first + block, width)):
                    if labels[row, column, 0] != 255:
                        count += 1
                        for k in range(n):
                            mean[k] += x[row, column, k]
            for row in range(i * block, last):
                for column in range(first, min(first + block, width)):
                    for j in range(channels):
                        if count and labels[row, column, j] != 255:
                            p[row, column, j] = mean[labels[row, column, j] * channels + j] / count
