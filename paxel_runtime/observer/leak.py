"""What a picture leaks to someone who sees only the projection image, as a file on a screen (paper: section VIII).

Blurred, the projection image is close to what the white sheet shows; the pattern's picture hides in how neighbouring
pixels differ. Both are looked for: in the blurred image, and in its local contrast.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import linear_sRGB_to_XYZ, sRGB_to_linear_sRGB
from paxel_runtime.observer.eye import eye_blur
from paxel_runtime.observer.smoothing import local_deviation, local_mean

__all__ = ["codes_to_Y", "leak_figures"]

_FLAT = 1e-6


def codes_to_Y(codes: NDArray[np.unsignedinteger], bits: int) -> NDArray[np.float32]:
    """Luminance 0..1 of a projection image (H, W, N) on an sRGB screen; other than three channels are shown as gray."""
    levels = sRGB_to_linear_sRGB(np.arange(2**bits) / (2**bits - 1)).astype(np.float32)
    channels = codes.shape[2]
    weights = linear_sRGB_to_XYZ(np.eye(3))[:, 1] if channels == 3 else np.full(channels, 1 / channels)
    return np.asarray(levels[codes] @ weights.astype(np.float32))


def leak_figures(
    Y: NDArray[np.floating],
    L_picture: NDArray[np.floating],
    L_other: NDArray[np.floating] | None,
    inner: NDArray[np.bool_],
    sigma_px: float,
    window_px: float,
) -> dict[str, float | None]:
    """How well a surface's picture can be told from the projection image alone, by someone without the print.

    Partial correlations, what goes with the other surface's picture taken out of both sides first: 0 nothing, 1 the
    picture itself.

    Parameters
    ----------
    Y : (H, W) array
        Luminance of the projection image, `codes_to_Y`.
    L_picture, L_other : (H, W) arrays
        L* of the picture, and of the other surface's (None where it has none).
    inner : (H, W) bool array
    sigma_px : float
        Blur of whoever looks, pixels.
    window_px : float
        Of the local contrast, pixels: a few dots.

    Returns
    -------
    dict
        ``blurred``: with the blurred image; ``texture``: with its local standard deviation. None where the picture has
        one lightness.
    """
    if Y.shape != L_picture.shape:
        raise InputError(f"projection image and picture must have one shape, got {Y.shape} and {L_picture.shape}")
    others = [] if L_other is None else [L_other]
    blurred = np.cbrt(eye_blur(Y, sigma_px))
    deviation = local_deviation(np.cbrt(Y), inner, window_px)
    wide = [local_mean(L, inner, window_px)[inner] for L in (L_picture, *others)]
    return {
        "blurred": _partial_correlation(blurred[inner], L_picture[inner], [L[inner] for L in others]),
        "texture": _partial_correlation(deviation[inner], wide[0], wide[1:]),
    }


def _partial_correlation(
    seen: NDArray[np.floating], picture: NDArray[np.floating], others: Sequence[NDArray[np.floating]]
) -> float | None:
    """|Correlation| of two (n,) arrays after the regression of both on the others; None where the picture is flat."""
    left = [a.astype(np.float64) - a.mean(dtype=np.float64) for a in (seen, picture)]
    spread = [float(np.std(a)) for a in left]
    for other in others:
        c = other.astype(np.float64) - other.mean(dtype=np.float64)
        if (power := float(c @ c)) > _FLAT * len(c):
            left = [a - c * float(a @ c) / power for a in left]
    if spread[1] < _FLAT or float(np.std(left[1])) < 1e-3 * spread[1]:
        return None
    if float(np.std(left[0])) < _FLAT * max(spread[0], _FLAT):
        return 0.0
    return float(abs(np.corrcoef(left[0], left[1])[0, 1]))
