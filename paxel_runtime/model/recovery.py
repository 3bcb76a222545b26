"""A reflectance from its colour: the smoothest one that has it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import illuminant_D50, spectra_to_XYZ

__all__ = ["XYZ_to_reflectance"]

_NEWTON_STEPS = 100


def XYZ_to_reflectance(XYZ: ArrayLike, tolerance: float = 1e-10) -> NDArray[np.float64]:
    """The reflectance with a colour and the least squared slope of z = artanh(2 r - 1).

    Parameters
    ----------
    XYZ : (3,) array
        Wanted colour as print shops measure it: under D50, 2 degrees, Y = 1 for the perfect diffuser.
    tolerance : float
        Newton's method on the stationary point of the Lagrangian ends when no residual exceeds it.

    Returns
    -------
    (81,) float64 array
        On `WAVELENGTHS_NM`, within 0..1 (S. A. Burns 2020, "Numerical methods for smoothest reflectance
        reconstruction": LHTSS).

    Raises
    ------
    InputError
        If no surface has the colour: it lies outside what light of D50 can become by reflection.
    """
    wanted = np.asarray(XYZ, np.float64)
    D50 = illuminant_D50()
    XYZ_of_band = spectra_to_XYZ(np.diag(D50)) / spectra_to_XYZ(D50)[1]
    bands = len(XYZ_of_band)
    difference = np.diff(np.eye(bands), axis=0)
    hessian = 2.0 * difference.T @ difference
    z, multipliers = np.zeros(bands), np.zeros(3)
    for _ in range(_NEWTON_STEPS):
        r, slope = (np.tanh(z) + 1.0) / 2.0, 0.5 / np.cosh(z) ** 2
        pull = XYZ_of_band @ multipliers
        residual = np.concatenate((hessian @ z + slope * pull, r @ XYZ_of_band - wanted))
        if np.abs(residual).max() < tolerance:
            return np.asarray(r)
        jacobian = np.zeros((bands + 3, bands + 3))
        jacobian[:bands, :bands] = hessian - np.diag(2.0 * slope * np.tanh(z) * pull)
        jacobian[:bands, bands:] = slope[:, None] * XYZ_of_band
        jacobian[bands:, :bands] = jacobian[:bands, bands:].T
        try:
            step = np.linalg.solve(jacobian, -residual)
        except np.linalg.LinAlgError:
            break
        length = float(np.abs(step[:bands]).max())
        if not np.isfinite(length) or np.abs(z).max() > 50.0:
            break
        step *= min(1.0, 2.0 / length)  # tanh saturates: a longer step in z may not come back
        z, multipliers = z + step[:bands], multipliers + step[bands:]
    raise InputError(
        f"no reflectance has the colour XYZ {[round(float(v), 4) for v in wanted]} under D50: "
        "XYZ of an ink must be measured under D50, with Y = 1 for the perfect diffuser"
    )
