"""How plainly a picture can be made out that a surface should not show, against what the eye just sees.

The part of a view that goes with the hidden picture is found for each octave of spatial frequency and weighted by the
eye's contrast sensitivity (Barten), as visibilities of layouts and moire are. Knows luminance, nothing of where it
comes from.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from paxel_design.visibility.sensitivity import cycles_per_degree, luminance_sensitivity
from paxel_runtime.errors import InputError
from paxel_runtime.observer.ghosting import GHOST_CYCLES_PER_DEGREE
from paxel_runtime.observer.smoothing import local_mean

__all__ = ["HiddenPicture", "hidden_picture"]

_ADAPTED_DEG = 0.5
"""Sigma of the surround that the eye adapts to: contrast is relative to its mean."""

_SLOWEST_CPD = GHOST_CYCLES_PER_DEGREE
"""Slower changes are not seen as a picture."""

_FULL_CONTRAST = 1.0

_FEWEST_MODES = 8
"""Fourier coefficients in an octave below which nothing can be told from chance."""

_WINDOW_MODES = 2.25
"""Neighbouring coefficients that a Hann window ties together, in two dimensions."""


@dataclass(frozen=True)
class HiddenPicture:
    """A picture in a view that should not show it.

    Attributes
    ----------
    seen : float
        Of what goes with the hidden picture, in threshold units: 1 is just seen by half of the observers on a plain
        surface.
    shown : float
        Of the hidden picture itself, where it is shown: for scale.
    rms_percent : float
        Root mean square contrast of what goes with the hidden picture, percent of the local luminance; what is too
        fine for the eye does not count.
    """

    seen: float
    shown: float
    rms_percent: float


def hidden_picture(
    Y_view: NDArray[np.floating],
    Y_own: NDArray[np.floating],
    Y_hidden: NDArray[np.floating],
    inner: NDArray[np.bool_],
    mm_per_px: float,
    distance_mm: float,
    luminance_cd_m2: float,
) -> HiddenPicture:
    """How plainly a hidden picture is seen in a view.

    In each octave the view's difference from its own picture is fitted by the own and the hidden picture, with real
    coefficients c; c^2 is taken less what chance would give. The contrasts c h of all octaves, weighted by the eye's
    sensitivity, add up as powers: sqrt(2 sum S^2 |c h|^2), so that a grating of modulation m gives m S.

    Parameters
    ----------
    Y_view, Y_own : (H, W) arrays
        Luminance of the view, before the eye and without the light's fall-off, and of the picture meant to be seen.
    Y_hidden : (H, W) array
        Luminance of the picture that should not be seen.
    inner : (H, W) bool array
        Pixels that count.
    mm_per_px, distance_mm, luminance_cd_m2 : float
        Of the raster and the viewer.

    Raises
    ------
    InputError
        If shapes differ, or no pixel counts.
    """
    if not (Y_view.shape == Y_own.shape == Y_hidden.shape == inner.shape) or not inner.any():
        raise InputError(
            f"a hidden picture needs arrays (H, W) of one shape and pixels that count, got {Y_view.shape}, "
            f"{Y_own.shape}, {Y_hidden.shape} and {np.count_nonzero(inner)} pixels"
        )
    rows, columns = (slice(where.min(), where.max() + 1) for where in np.nonzero(inner))
    mask = inner[rows, columns]
    px_per_degree = distance_mm * np.tan(np.deg2rad(1.0)) / mm_per_px
    surround_px = _ADAPTED_DEG * px_per_degree
    window = np.outer(*(np.hanning(size + 2)[1:-1] for size in mask.shape)) * mask
    own, hidden, view = (np.asarray(Y[rows, columns], np.float64) for Y in (Y_own, Y_hidden, Y_view))
    around_own, around_hidden = local_mean(own, mask, surround_px), local_mean(hidden, mask, surround_px)
    O, H = (_spectrum(Y, around, window) for Y, around in ((own, around_own), (hidden, around_hidden)))  # noqa: E741
    R = _spectrum(view - own, around_own, window, difference=True)
    fy, fx = np.fft.fftfreq(mask.shape[0], mm_per_px), np.fft.rfftfreq(mask.shape[1], mm_per_px)
    cpd = cycles_per_degree(np.hypot(fy[:, None], fx), distance_mm)
    twice = np.broadcast_to(np.where((fx == 0) | (2 * np.arange(len(fx)) == mask.shape[1]), 1.0, 2.0), cpd.shape)
    sensitivity = luminance_sensitivity(cpd, luminance_cd_m2)
    # Where full contrast would not be seen, the dots themselves are all there is.
    visible, weight = (cpd >= _SLOWEST_CPD) & (sensitivity > _FULL_CONTRAST), sensitivity**2
    seen = power = 0.0
    edges = _SLOWEST_CPD * 2.0 ** np.arange(np.ceil(np.log2(cpd.max() / _SLOWEST_CPD)) + 1)
    for low, high in pairwise(edges):
        octave = visible & (cpd >= low) & (cpd < high)
        if np.count_nonzero(octave) < _FEWEST_MODES:
            continue
        squared = _coefficient_squared(R[octave], O[octave], H[octave])
        density = twice[octave] * np.abs(H[octave]) ** 2
        seen += squared * float(density @ weight[octave])
        power += squared * float(density.sum())
    shown = float((twice * np.abs(H) ** 2 * weight)[visible].sum())
    return HiddenPicture(float(np.sqrt(2 * seen)), float(np.sqrt(2 * shown)), 100 * float(np.sqrt(power)))


def _spectrum(
    Y: NDArray[np.float64], around: NDArray[np.float64], window: NDArray[np.float64], difference: bool = False
) -> NDArray[np.complex128]:
    """Fourier coefficients of local contrast; squares of their moduli add up to its variance under the window."""
    contrast = np.divide(Y, around, out=np.full(Y.shape, 0.0 if difference else 1.0), where=around > 0)
    contrast -= (contrast * window).sum() / window.sum()
    return np.fft.rfft2(contrast * window) / np.sqrt((window**2).sum() * window.size)


def _coefficient_squared(
    R: NDArray[np.complex128],
    O: NDArray[np.complex128],  # noqa: E741
    H: NDArray[np.complex128],
) -> float:
    """c^2 of the fit R ~ a O + c H with real coefficients, less what it would be by chance; at least 0."""
    own_power = float(np.vdot(O, O).real)
    if own_power > 1e-12:
        R, H = (part - O * (np.vdot(O, part).real / own_power) for part in (R, H))
    H_power = float(np.vdot(H, H).real)
    if H_power < 1e-12:
        return 0.0
    c = float(np.vdot(H, R).real) / H_power
    rest = float(np.linalg.norm(R - c * H) ** 2)
    chance = _WINDOW_MODES * rest / (2 * len(R) * H_power)
    return max(c**2 - chance, 0.0)
