"""Void-and-cluster: blue noise of two colorants on a torus (R. Ulichney 1993, Proc. SPIE 1913, 332-343).

The pattern of one share is wanted, not a whole dither array. So of Ulichney's ranking only the part that leads there
is run: a random start of ones (at most a tenth of the torus) is relaxed, then the largest void is filled until the
rarer colorant has its share (his phases for ranks up to half; the commoner colorant is the rest).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.gaussian import blur, gaussian_kernel
from paxel_design.patterns.request import LayoutRequest, apportion
from paxel_design.patterns.void_and_cluster_kernels import fill_voids, relax
from paxel_runtime.errors import InputError

__all__ = ["VOID_AND_CLUSTER_TORUS", "void_and_cluster", "void_and_cluster_ones"]

VOID_AND_CLUSTER_TORUS = (128, 128)
"""Rows and columns of the torus that repeats over the sheet."""

_SIGMA = 1.5  # cells: the width of Ulichney's Gaussian
_START = 0.1  # share of the random start


def void_and_cluster(request: LayoutRequest) -> NDArray[np.uint8]:
    """`VOID_AND_CLUSTER_TORUS` cells for a request of two colorants.

    Raises
    ------
    InputError
        If there are more than two colorants.
    """
    if len(request.colorants) != 2:
        raise InputError(
            f'void-and-cluster must have exactly 2 colorants, got {len(request.colorants)}: blue_noise = "swap" '
            "takes any number"
        )
    size = VOID_AND_CLUSTER_TORUS[0] * VOID_AND_CLUSTER_TORUS[1]
    counts = apportion(request.shares, size)
    rarer = int(np.argmin(counts))
    ones = void_and_cluster_ones(int(counts[rarer]), VOID_AND_CLUSTER_TORUS, request.seed)
    return ones if rarer == 1 else 1 - ones


def void_and_cluster_ones(count: int, shape: tuple[int, int], seed: int) -> NDArray[np.uint8]:
    """`count` ones, at most half of the cells, spread over a torus of zeros, (rows, columns) uint8."""
    rng = np.random.default_rng(seed)
    size = shape[0] * shape[1]
    start = min(count, max(1, round(_START * size)))
    ones = np.zeros(size, np.uint8)
    ones[rng.choice(size, start, replace=False)] = 1
    ones = ones.reshape(shape)
    kernel = gaussian_kernel(_SIGMA)
    blurred = blur(ones, kernel)
    relax(ones, blurred, kernel, size)
    fill_voids(ones, blurred, kernel, count - start)
    return ones
