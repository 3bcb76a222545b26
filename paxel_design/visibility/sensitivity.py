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

    With pupil, optical transfer and retinal illuminance at that luminance, as colour-science computes them.

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
    from colour.contrast import (  # here, because it takes seconds to import
        contrast_sensitivity_function_Barten1999,
        pupil_diameter_Barten1999,
        retinal_illuminance_Barten1999,
        sigma_Barten1999,
    )

    frequency = np.asarray(frequency_cpd, np.float64)
    pupil_mm = pupil_diameter_Barten1999(luminance_cd_m2, FIELD_DEG)
    # a table: the formula is slow, the curve smooth
    nodes = np.geomspace(0.02, 120.0, 400)
    sensitivity = contrast_sensitivity_function_Barten1999(
        nodes,
        sigma=sigma_Barten1999(d=pupil_mm),
        E=retinal_illuminance_Barten1999(luminance_cd_m2, pupil_mm),
        X_0=FIELD_DEG,
    )
    table = np.interp(np.log(np.maximum(frequency, nodes[0])), np.log(nodes), np.log(sensitivity))
    return np.where(frequency > 0, np.exp(table), 0.0)


def opponent_sensitivity(frequency_cpd: ArrayLike) -> NDArray[np.float64]:
    """Reciprocal of the threshold amplitude, in CIELAB units, of red-green and yellow-blue gratings, (..., 2).

    The eye's blur of the opponent channels in S-CIELAB over `OPPONENT_THRESHOLD`: no fall at low frequencies, and a
    limit at about a third of luminance's. 0 at frequency 0.
    """
    frequency = np.asarray(frequency_cpd, np.float64)
    return np.where(frequency[..., None] > 0, eye_transfer(frequency)[..., 1:] / OPPONENT_THRESHOLD, 0.0)
