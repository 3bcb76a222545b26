"""Dots seen from too near: their texture, the other picture in it, and the distance from which it is gone.

Near the wall the eye does not average the dots. How strongly each place's dots alternate depends on both pictures, so
the other picture becomes legible as texture. No assembly removes it; the distance does.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.observer.eye import eye_sigma_mm
from paxel_runtime.observer.ghosting import coefficient_of_other
from paxel_runtime.observer.smoothing import local_deviation, local_mean

__all__ = ["TEXTURE_SEEN_L", "minimum_distance_mm", "texture_ghost_percent", "texture_window_px"]

TEXTURE_SEEN_L = 1.0
"""Texture that is seen: standard deviation of L* through the eye. At the least distance it is this strong."""

_WINDOW_DOTS = 0.75
_NEAREST_MM, _FARTHEST_MM = 100.0, 100_000.0
_UNIFORM_L = 1e-3


def texture_window_px(dot_px: float, colorants: int) -> float:
    """Sigma of the window in which texture is judged: three quarters of a dot for each colorant, pixels.

    Raises
    ------
    InputError
        If the dots have no size, or there is no colorant.
    """
    if not (dot_px > 0 and colorants >= 1):
        raise InputError(f"a texture needs dots > 0 px of at least one colorant, got {dot_px} px and {colorants}")
    return _WINDOW_DOTS * dot_px * colorants


def texture_ghost_percent(
    L_view: NDArray[np.floating],
    L_own: NDArray[np.floating],
    L_other: NDArray[np.floating],
    inner: NDArray[np.bool_],
    window_px: float,
) -> float | None:
    """The other picture as texture: local standard deviation of L* regressed on both pictures, percent.

    With S the standard deviation of (view - own) in a Gaussian window, the least-squares fit S ~ 1 + own + other gives
    100 |coefficient of other|: L* of texture for 100 L* of the other picture.

    Parameters
    ----------
    L_view, L_own, L_other : (H, W) arrays
        L* through the eye, of the view and of both mapped pictures.
    inner : (H, W) bool array
    window_px : float
        See `texture_window_px`.

    Returns
    -------
    float or None
        None where the other picture has one lightness.
    """
    if np.ptp(L_other[inner]) < _UNIFORM_L:
        return None
    S = local_deviation(L_view - L_own, inner, window_px)[inner]
    own, other = (local_mean(L, inner, window_px)[inner] for L in (L_own, L_other))
    return 100 * abs(coefficient_of_other(S, own, other))


def minimum_distance_mm(
    Y_view: NDArray[np.floating],
    Y_own: NDArray[np.floating],
    inner: NDArray[np.bool_],
    mm_per_px: float,
    window_px: float,
) -> float:
    """Distance from which the texture of the dots is weaker than `TEXTURE_SEEN_L`, over the whole frame (rms).

    The texture's spectrum is taken once: what the view has more than its picture, finer than the window, as L* about
    the local mean. The eye at distance d multiplies it by the square of its Gaussian's transform, so that the variance
    at every distance is a sum over frequencies.

    Parameters
    ----------
    Y_view : (H, W) array
        Luminance of the leveled view before the eye, Y = 1 for the white point.
    Y_own : (H, W) array
        Luminance of its mapped picture before the eye.
    inner : (H, W) bool array
        Pixels that count.
    mm_per_px, window_px : float

    Returns
    -------
    float
        mm, between 100 and 100,000; 100 where nothing is seen from anywhere.
    """
    from scipy.fft import rfft2, rfftfreq

    mean_Y = local_mean(Y_view, inner, window_px)
    rest = Y_view - Y_own
    rest = np.where(inner, rest - local_mean(rest, inner, window_px), 0.0)
    L_per_Y = _L_slope(np.where(inner, mean_Y, 1.0))
    power = np.abs(rfft2((rest * L_per_Y).astype(np.float32))) ** 2
    if power.shape[1] > 1:
        power[:, 1 : (rest.shape[1] + 1) // 2] *= 2  # the half of the spectrum that is not stored
    power /= rest.size * np.count_nonzero(inner)
    rows, columns = np.fft.fftfreq(rest.shape[0]), rfftfreq(rest.shape[1])
    squared_f = ((rows[:, None] ** 2 + columns**2) / mm_per_px**2).ravel()  # (cycles/mm)^2
    # Nothing finer than a few thousand bins is needed: the eye's transform is smooth in f^2.
    edges = np.linspace(0.0, squared_f.max(), 4097)
    binned, _ = np.histogram(squared_f, edges, weights=power.ravel())
    centres = 0.5 * (edges[1:] + edges[:-1])

    def texture_L(distance_mm: float) -> float:
        sigma_mm = eye_sigma_mm(distance_mm)
        return math.sqrt(float(binned @ np.exp(-4 * (math.pi * sigma_mm) ** 2 * centres)))

    low, high = _NEAREST_MM, _FARTHEST_MM
    if texture_L(low) <= TEXTURE_SEEN_L:
        return low
    while high / low > 1.002:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if texture_L(middle) > TEXTURE_SEEN_L else (low, middle)
    return high


def _L_slope(Y: NDArray[np.floating]) -> NDArray[np.floating]:
    """dL*/dY of CIELAB."""
    Y = np.maximum(Y, (6.0 / 29.0) ** 3)
    return 116.0 / 3.0 * Y ** (-2.0 / 3.0)
