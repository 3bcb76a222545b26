"""Ragged edges of a print: noise of where ink ends, which no angle of a layout changes.

It moves light from cluster to cluster at random, so that a lit cluster has grain besides its beats: more of it, the
more edge there is in an area and the more pixels lie near the limit of their cluster.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["RAGGED_CORRELATION_MM", "RAGGED_MM", "RAGGED_STEP_MM", "ragged_edges"]

RAGGED_MM = 0.015
"""Rms of an edge about its line, what ISO/IEC 24790 calls raggedness."""

RAGGED_CORRELATION_MM = 0.05
"""Distance along an edge over which its noise falls to 1/e: two or three drops of ink."""

RAGGED_STEP_MM = 0.0125

_SIDE = 512  # of a tile of 6.4 mm: a power of two


@cache
def ragged_edges() -> NDArray[np.float32]:
    """Displacement of the print in x and y, (512, 512, 2) every `RAGGED_STEP_MM`, rms 1, periodic."""
    frequency = np.fft.fftfreq(_SIDE, RAGGED_STEP_MM)
    # exp(-(d / c)^2) is the correlation of noise filtered by exp(-(pi c f)^2 / 2)
    along = np.exp(-((np.pi * RAGGED_CORRELATION_MM * frequency) ** 2) / 2)
    white = np.random.default_rng(0).standard_normal((2, _SIDE, _SIDE))
    noise = np.fft.ifft2(np.fft.fft2(white) * along[:, None] * along[None]).real
    noise /= noise.std(axis=(1, 2), keepdims=True)
    return np.ascontiguousarray(np.moveaxis(noise, 0, -1), np.float32)
