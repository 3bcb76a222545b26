"""The eye's blur of opponent colours, and CIELAB differences after it (S-CIELAB).

X. Zhang and B. Wandell, "A spatial extension of CIELAB for digital color-image reproduction", J. SID 5, 1997: colours
are blurred in an opponent space as the eye blurs them, luminance least and blue-yellow most, and what is left is
measured in CIELAB. Deviations are small after the blur, so CIELAB is linearised about the mean colour.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.model.colorimetry import XYZ_to_Lab, illuminant_D65, spectra_to_XYZ
from paxel_runtime.model.pattern import Colorant

__all__ = ["XYZ_TO_OPPONENT", "colorants_to_XYZ", "eye_transfer", "opponent_to_Lab"]

XYZ_TO_OPPONENT = np.array([[0.279, 0.72, -0.107], [-0.449, 0.29, -0.077], [0.086, -0.59, 0.501]])
"""Luminance, red-green and blue-yellow from XYZ."""

# Weight and spread in degrees of each Gaussian exp(-(r / spread)^2) of the eye, for each opponent channel
_EYE = (
    ((0.921, 0.0283), (0.105, 0.133), (-0.108, 4.336)),
    ((0.531, 0.0392), (0.330, 0.494)),
    ((0.488, 0.0536), (0.371, 0.386)),
)
_LAB_STEP = 1e-6


def colorants_to_XYZ(colorants: Sequence[Colorant]) -> NDArray[np.float64]:
    """XYZ of solid colorants, (n, 3): under D65, Y = 1 for a perfect diffuser.

    Fluorescent inks that all reflect alike are told apart by what they emit alone: then that, Y = 1 for the brightest.
    """
    D65 = illuminant_D65()
    reflected = np.array([colorant.reflectance for colorant in colorants])
    emitters = [colorant.fluorescence for colorant in colorants]
    if any(emitters) and np.array_equal(reflected, np.broadcast_to(reflected[0], reflected.shape)):
        dark = np.zeros_like(reflected[0])
        emitted_XYZ = spectra_to_XYZ([e.emission * e.excitation.max() if e else dark for e in emitters])
        return emitted_XYZ / emitted_XYZ[:, 1].max()
    return spectra_to_XYZ(reflected * D65) / spectra_to_XYZ(D65)[1]


def eye_transfer(frequency_cpd: ArrayLike) -> NDArray[np.float64]:
    """Modulation transfer of the three opponent channels, (..., 3), 1 at frequency 0.

    Parameters
    ----------
    frequency_cpd : array
        Cycles per degree.
    """
    squared = np.asarray(frequency_cpd, np.float64) ** 2
    channels = []
    for gaussians in _EYE:
        terms = [weight * np.exp(-(np.pi**2) * spread**2 * squared) for weight, spread in gaussians]
        channels.append(np.sum(terms, axis=0) / sum(weight for weight, _ in gaussians))
    return np.stack(channels, axis=-1)


def opponent_to_Lab(mean_XYZ: ArrayLike) -> NDArray[np.float64]:
    """What a small opponent deviation from a mean colour is in CIELAB under D65, (3, 3), by central differences."""
    XYZ = np.asarray(mean_XYZ, np.float64)
    D65 = illuminant_D65()
    white_XYZ = spectra_to_XYZ(D65) / spectra_to_XYZ(D65)[1]
    step = _LAB_STEP * np.eye(3)
    jacobian = (XYZ_to_Lab(XYZ + step, white_XYZ) - XYZ_to_Lab(XYZ - step, white_XYZ)).T / (2 * _LAB_STEP)
    return np.asarray(jacobian @ np.linalg.inv(XYZ_TO_OPPONENT))
