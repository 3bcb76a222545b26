"""CAM16-UCS: a colour-appearance space as a second opinion beside CIELAB (paper: section VII asks for one).

Li et al. 2017, "Comprehensive color solutions: CAM16, CAT16, and CAM16-UCS"; average surround. Plain formulas, checked
against colour-science in the tests.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["ADAPTING_CD_M2", "CAM16_UCS_difference", "XYZ_to_CAM16_UCS"]

ADAPTING_CD_M2 = 20.0
"""Luminance that the eye is adapted to: a fifth of a projection of 100 cd/m2."""

_BACKGROUND = 20.0
_F, _C, _NC = 1.0, 0.69, 1.0
_TO_CONES = np.array(
    [[0.401288, 0.650173, -0.051461], [-0.250268, 1.204414, 0.045854], [-0.002079, 0.048952, 0.953127]]
)


def XYZ_to_CAM16_UCS(
    XYZ: ArrayLike, white_XYZ: ArrayLike, adapting_cd_m2: float = ADAPTING_CD_M2
) -> NDArray[np.float64]:
    """(..., 3) J', a', b' of (..., 3) XYZ under the white point `white_XYZ` (3,), Y = 1 for white.

    Negative light (readings with noise) counts as none.
    """
    white = 100.0 * np.asarray(white_XYZ, np.float64)
    cones_white = _TO_CONES @ white
    adapted = _F * (1.0 - np.exp((-adapting_cd_m2 - 42.0) / 92.0) / 3.6)
    gain = adapted * white[1] / cones_white + 1.0 - adapted
    k = 1.0 / (5.0 * adapting_cd_m2 + 1.0)
    F_L = 0.2 * k**4 * 5.0 * adapting_cd_m2 + 0.1 * (1.0 - k**4) ** 2 * np.cbrt(5.0 * adapting_cd_m2)
    n = _BACKGROUND / white[1]
    z, N_bb = 1.48 + np.sqrt(n), 0.725 * n**-0.2

    def response(cones: NDArray[np.float64]) -> NDArray[np.float64]:
        power = (F_L * np.abs(cones * gain) / 100.0) ** 0.42
        return np.sign(cones) * 400.0 * power / (power + 27.13) + 0.1

    def achromatic(seen: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((2.0 * seen[..., 0] + seen[..., 1] + seen[..., 2] / 20.0 - 0.305) * N_bb)

    seen = response(np.maximum(100.0 * np.asarray(XYZ, np.float64), 0.0) @ _TO_CONES.T)
    R, G, B = seen[..., 0], seen[..., 1], seen[..., 2]
    a, b = R - 12.0 * G / 11.0 + B / 11.0, (R + G - 2.0 * B) / 9.0
    hue = np.arctan2(b, a)
    J = 100.0 * np.maximum(achromatic(seen) / achromatic(response(cones_white)), 0.0) ** (_C * z)
    eccentricity = 0.25 * (np.cos(hue + 2.0) + 3.8)
    t = 50000.0 / 13.0 * _NC * N_bb * eccentricity * np.hypot(a, b) / (R + G + 21.0 * B / 20.0)
    M = t**0.9 * (1.64 - 0.29**n) ** 0.73 * np.sqrt(J / 100.0) * F_L**0.25
    radius = np.log1p(0.0228 * M) / 0.0228
    return np.stack((1.7 * J / (1.0 + 0.007 * J), radius * np.cos(hue), radius * np.sin(hue)), axis=-1)


def CAM16_UCS_difference(XYZ_1: ArrayLike, XYZ_2: ArrayLike, white_XYZ: ArrayLike) -> NDArray[np.float64]:
    """Colour difference (...,) of (..., 3) XYZ in CAM16-UCS: the Euclidean distance there."""
    apart = XYZ_to_CAM16_UCS(XYZ_1, white_XYZ) - XYZ_to_CAM16_UCS(XYZ_2, white_XYZ)
    return np.asarray(np.linalg.norm(apart, axis=-1))
