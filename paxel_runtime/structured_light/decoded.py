"""What structured light tells of each camera pixel: the data that decoding makes and registration reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.structured_light.checks import DECODED, REASONS, SensorNoise

__all__ = ["HALF_SURE_PX", "Decoded", "sigma_to_confidence"]

HALF_SURE_PX = 0.1
"""Standard deviation, projector pixels, at which the confidence is one half."""


@dataclass(frozen=True, eq=False)
class Decoded:
    """What structured light tells of each camera pixel, (h, w).

    Attributes
    ----------
    projector_xy : (h, w, 2) float32 array
        Column and row of the projector that light the pixel (an integer is a pixel's centre); NaN where rejected.
    signal : (h, w) float32 array
        Light of the projector that the pixel sees, raw units, also where rejected: the first harmonic of the lines,
        mean of both axes, which is about white minus black.
    reason : (h, w) uint8 array
        0 = decoded; otherwise an index into `REASONS`.
    noise : SensorNoise
        As read off the captures.
    ripple_px : (float, float)
        Amplitude (rms over the picture) of the lines' ripple that was removed from column and row.
    confidence : (h, w) float32 array
        0 where rejected, otherwise 0..1 by the standard deviation to expect of the noise of the pixel's own captures,
        see `sigma_to_confidence`.
    """

    projector_xy: NDArray[np.float32]
    signal: NDArray[np.float32]
    reason: NDArray[np.uint8]
    noise: SensorNoise
    ripple_px: tuple[float, float]
    confidence: NDArray[np.float32]

    @property
    def counts(self) -> dict[str, int]:
        """Number of camera pixels by reason."""
        return dict(zip(REASONS, np.bincount(self.reason.ravel(), minlength=len(REASONS)).tolist(), strict=True))


def sigma_to_confidence(sigma_px: NDArray[np.float32], reason: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Confidence 0..1 of places known to `sigma_px` projector pixels (root mean square of both axes).

    ``1 / (1 + (sigma_px / HALF_SURE_PX)^2)``: one half at a tenth of a pixel, and ``c / (1 - c)`` is the weight of a
    least-squares fit. 0 where `reason` says that the pixel was rejected.
    """
    confidence = np.float32(1) / (np.float32(1) + np.square(sigma_px / np.float32(HALF_SURE_PX)))
    confidence[reason != DECODED] = 0
    return confidence
