"""What contrast the eye just sees at which spatial frequency: luminance after Barten, opponent colours after S-CIELAB.

Figures are in *threshold units*: 1 is just seen by half of the observers, 10 is plain. Knows frequencies, distances and
luminances; nothing of patterns or projectors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_design.visibility.s_cielab import eye_transfer
from paxel_runtime.errors import InputError

__all__ = ["FIELD_DEG", "OPPONENT_THRESHOLD", "cycles_per_degree", "luminance_sensitivity", "opponent_sensitivity"]

FIELD_DEG = 10.0
"""Angle that the projection subtends, for the pupil and for the lowest frequencies; the result hardly depends on it."""

OPPONENT_THRESHOLD = 1.0
"""Amplitude in CIELAB units of an opponent grating of low frequency that is just seen."""


def cycles_per_degree(frequency_per_mm: ArrayLike, distance_mm: float) -> NDArray[np.float64]:
    """Spatial frequency at the eye of a grating on the wall.

    Parameters
    ----------
    frequency_per_mm : array
        Cycles per millimetre.
    distance_mm : float

    Raises
    ------
    InputError
        If the distance is not positive.
    """
    if not distance_mm > 0:
        raise InputError(f"viewing.distance_mm must be > 0, got {distance_mm}")
    return np.asarray(frequency_per_mm, np.float64) * distance_mm * np.tan(np.deg2rad(1.0))


def luminance_sensitivity(frequency_cpd: ArrayLike, luminance_cd_m2: float = 100.0) -> NDArray[np.float64]:
    """Reciprocal of the threshold modulation of a luminance grating (Barten 1999), 0 at frequency 0.

    P. G. J. Barten, "Contrast Sensitivity of the Human Eye", 1999, with his constants: pupil, optical transfer and
    photon noise at that luminance, lateral inhibition below 7 cycles a degree. As in colour-science, which takes
    seconds to import; tests compare.

    Parameters
    ----------
    frequency_cpd : array
        Cycles per degree, >= 0.
    luminance_cd_m2 : float
        Mean luminance of what is seen.

    Raises
    ------
    InputError
        If the luminance is not positive.
    """
    if not luminance_cd_m2 > 0:
        raise InputError(f"viewing.luminance_cd_m2 must be > 0, got {luminance_cd_m2}")
    f = np.asarray(frequency_cpd, np.float64)
    pupil_mm = 5 - 3 * np.tanh(0.4 * np.log10(luminance_cd_m2 * FIELD_DEG**2 / 40**2))
    stiles_crawford = 1 - (pupil_mm / 9.7) ** 2 + (pupil_mm / 12.4) ** 4
    trolands = np.pi * pupil_mm**2 / 4 * luminance_cd_m2 * stiles_crawford
    spread_deg = np.hypot(0.5 / 60, 0.08 / 60 * pupil_mm)
    transfer = np.exp(-2 * (np.pi * spread_deg * f) ** 2)
    per_area = (
        1 / FIELD_DEG**2 + 1 / 12**2 + f**2 / 15**2
    )  # of what the eye integrates over: a field, 12 deg, 15 cycles
    with np.errstate(divide="ignore"):  # at 0 lateral inhibition is complete, and the sensitivity 0
        neural = 3e-8 / -np.expm1(-((f / 7) ** 2))
    photons = 1 / (0.03 * 1.2274e6 * trolands)
    return np.asarray(transfer / 3 / np.sqrt(2 / 0.1 * per_area * (photons + neural)))


def opponent_sensitivity(frequency_cpd: ArrayLike) -> NDArray[np.float64]:
    """Reciprocal of the threshold amplitude, in CIELAB units, of red-green and yellow-blue gratings, (..., 2).

    The eye's blur of the opponent channels in S-CIELAB over `OPPONENT_THRESHOLD`: no fall at low frequencies, and a
    limit at about a third of luminance's. 0 at frequency 0.
    """
    frequency = np.asarray(frequency_cpd, np.float64)
    return np.where(frequency[..., None] > 0, eye_transfer(frequency)[..., 1:] / OPPONENT_THRESHOLD, 0.0)
