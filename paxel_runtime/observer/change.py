"""What an effect did to colours between the two surfaces, as seen: hue turned, chroma changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import Lab_to_LCh

__all__ = ["HUE_CHROMA_FLOOR", "change_figures"]

HUE_CHROMA_FLOOR = 5.0
"""Hues of less chroma are not seen, and not counted."""


def change_figures(
    Lab_shown: NDArray[np.floating], Lab_other: NDArray[np.floating], inner: NDArray[np.bool_]
) -> dict[str, float | None]:
    """How the colours of one surface's view differ from the other's.

    Parameters
    ----------
    Lab_shown, Lab_other : (H, W, 3) arrays
        Views through the eye: of the surface that shows the picture, and of the other.
    inner : (H, W) bool array

    Returns
    -------
    dict
        ``hue_pixels``: share of pixels with a chroma above 5 on both; ``hue_turn_deg`` and ``hue_turn_sd_deg``: mean
        and standard deviation of the angle from the shown hue to the other's, -180..180, over these (circular; None
        without any); ``chroma_ratio``: other over shown, least squares, None where the picture is gray.
    """
    shown, other = Lab_to_LCh(Lab_shown[inner]), Lab_to_LCh(Lab_other[inner])
    colored = (shown[:, 1] > HUE_CHROMA_FLOOR) & (other[:, 1] > HUE_CHROMA_FLOOR)
    turn = sd = None
    if colored.any():
        turns = np.exp(1j * np.deg2rad(other[colored, 2] - shown[colored, 2], dtype=np.float64))
        mean = turns.mean()
        turn = float(np.rad2deg(np.angle(mean)))
        # about the mean direction: no angle is averaged across the seam
        sd = float(np.std(np.rad2deg(np.angle(turns * np.exp(-1j * np.angle(mean))))))
    power = float(np.mean(shown[:, 1].astype(np.float64) ** 2))
    ratio = float(np.mean(shown[:, 1].astype(np.float64) * other[:, 1])) / power if power > 1e-4 else None
    return {
        "hue_pixels": float(np.mean(colored)),
        "hue_turn_deg": turn,
        "hue_turn_sd_deg": sd,
        "chroma_ratio": ratio,
    }
