"""How visible a periodic row of colorants is when each row is the one below shifted: what tiles are searched by.

S-CIELAB (X. Zhang and B. Wandell, "A spatial extension of CIELAB for digital color-image reproduction", J. SID 5,
1997): the colours are blurred in an opponent space as the eye blurs them, luminance least and blue-yellow most, and
what is left is measured in CIELAB about the mean colour. Deviations are small after the blur, so CIELAB is linearised
there, and a row needs only its discrete Fourier transform. The scale is fixed: a cell is seen under `CELL_ARCMIN`
(a 0.75 mm dot from 2.6 m); only the ratio between arrangements is used.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import XYZ_to_Lab, illuminant_D65, spectra_to_XYZ
from paxel_runtime.model.pattern import Colorant

__all__ = ["CELL_ARCMIN", "colorants_to_XYZ", "row_visibility"]

CELL_ARCMIN = 1.0

_XYZ_TO_OPPONENT = np.array([[0.279, 0.72, -0.107], [-0.449, 0.29, -0.077], [0.086, -0.59, 0.501]])
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


def row_visibility(rows_XYZ: NDArray[np.float64], shift: int) -> NDArray[np.float64]:
    """Root mean square CIELAB difference from the mean colour that the eye still sees.

    Parameters
    ----------
    rows_XYZ : (..., N, 3) array
        One period of a row of cells, XYZ, Y = 1 for white; the same mean for all leading axes.
    shift : int
        The cell above is `shift` cells further on in the row: cell (r, c) is ``rows_XYZ[(c + r * shift) % N]``.

    Returns
    -------
    (...) float64 array
        Root mean square of CIELAB differences.

    Notes
    -----
    Harmonics above half a cycle per cell, which a square cell also has, are far beyond what the eye resolves here.
    """
    n = rows_XYZ.shape[-2]
    amplitude = np.fft.fft(rows_XYZ, axis=-2)[..., 1:, :] / n
    k = np.arange(1, n)
    fx, fy = (f - np.round(f) for f in (k / n, k * shift / n))
    squared_f = (fx**2 + fy**2) * (60 / CELL_ARCMIN) ** 2  # cycles per degree
    eye = np.stack([_channel(gaussians, squared_f) for gaussians in _EYE], axis=-1)
    eye = eye * (np.sinc(fx) * np.sinc(fy))[:, None]
    mean_XYZ = rows_XYZ.reshape(-1, n, 3)[0].mean(axis=0)
    opponent_to_Lab = _Lab_jacobian(mean_XYZ) @ np.linalg.inv(_XYZ_TO_OPPONENT)
    Lab = (amplitude @ _XYZ_TO_OPPONENT.T * eye) @ opponent_to_Lab.T
    return np.sqrt((np.abs(Lab) ** 2).sum(axis=(-2, -1)))


def _channel(gaussians: Sequence[tuple[float, float]], squared_f: NDArray[np.float64]) -> NDArray[np.float64]:
    """Modulation transfer of one opponent channel, 1 at frequency 0."""
    total = sum(weight for weight, _ in gaussians)
    terms = [weight * np.exp(-(np.pi**2) * spread**2 * squared_f) for weight, spread in gaussians]
    return np.sum(terms, axis=0) / total


def _Lab_jacobian(XYZ: NDArray[np.float64]) -> NDArray[np.float64]:
    """dLab/dXYZ at XYZ under D65, (3, 3), by central differences."""
    D65 = illuminant_D65()
    white_XYZ = spectra_to_XYZ(D65) / spectra_to_XYZ(D65)[1]
    step = _LAB_STEP * np.eye(3)
    return (XYZ_to_Lab(XYZ + step, white_XYZ) - XYZ_to_Lab(XYZ - step, white_XYZ)).T / (2 * _LAB_STEP)
