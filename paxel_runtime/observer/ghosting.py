"""Ghosting: how much of the other surface's picture is left in a view (design: section 4, *Ghosting*).

Two measures, by the kind of gamut mapping. Static mapping treats every pixel alike, so a regression on the other
picture tells its share. Adaptive mapping lets slow parts of both pictures depend on each other, on purpose and unseen;
there a mark is planted in the other picture, everything is made once more, and what differs between both views of this
one is the ghost itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.observer.smoothing import high_passed

__all__ = [
    "GHOST_CYCLES_PER_DEGREE",
    "coefficient_of_other",
    "ghost_L",
    "ghosting_percent",
    "picture_correlation",
    "plant_mark",
    "planted_mark",
]

GHOST_CYCLES_PER_DEGREE = 1.0
"""Ghosts are looked for above this frequency: slower ones are not seen as a picture."""

_UNIFORM_L = 1e-3
_GHOST_PERCENTILE = 99.0
_DISC_DEG, _PITCH_DEG = 0.4, 0.8
_MARK_L = 20.0


def ghosting_percent(
    L_view: NDArray[np.floating],
    L_own: NDArray[np.floating],
    L_other: NDArray[np.floating],
    inner: NDArray[np.bool_],
    px_per_degree: float | None = None,
) -> float | None:
    """Share of the other picture's contrast that is left in a view, percent.

    With R = L* of the view - L* of its mapped picture, the least-squares fit R ~ 1 + own + other over the pixels gives
    100 |coefficient of other|. It means something for static mapping, and where the two mapped pictures correlate
    below 0.5 (`picture_correlation`): beyond that own and other cannot be told apart.

    Parameters
    ----------
    L_view, L_own, L_other : (H, W) arrays
        L* through the eye, of the view, its own mapped picture and the other surface's.
    inner : (H, W) bool array
        Pixels that count.
    px_per_degree : float, optional
        With it all three are high-passed at one cycle per degree first: what is left of the other picture's detail.

    Returns
    -------
    float or None
        None where the other picture has one lightness.
    """
    if px_per_degree is not None:
        L_view, L_own, L_other = (
            high_passed(L, inner, px_per_degree, GHOST_CYCLES_PER_DEGREE) for L in (L_view, L_own, L_other)
        )
    if np.ptp(L_other[inner]) < _UNIFORM_L:
        return None
    return 100 * abs(coefficient_of_other(L_view[inner] - L_own[inner], L_own[inner], L_other[inner]))


def picture_correlation(
    L_own: NDArray[np.floating], L_other: NDArray[np.floating], inner: NDArray[np.bool_]
) -> float | None:
    """Correlation of two pictures' L*; None where one has a single lightness."""
    own, other = L_own[inner], L_other[inner]
    if min(np.ptp(own), np.ptp(other)) < _UNIFORM_L:
        return None
    return float(np.corrcoef(own.astype(np.float64), other.astype(np.float64))[0, 1])


def planted_mark(shape: tuple[int, int], px_per_degree: float) -> NDArray[np.bool_]:
    """A known mark: a lattice of discs of 0.4 degree every 0.8 degree, so that it lies on every part of a picture.

    Parameters
    ----------
    shape : (H, W)
    px_per_degree : float
        Pixels of the picture in one degree of the viewer's field.

    Returns
    -------
    (H, W) bool array
        True on the discs: a fifth of the area.
    """
    pitch = _PITCH_DEG * px_per_degree
    y, x = (((np.arange(n) - (n - 1) / 2) / pitch) for n in shape)
    from_centre = np.hypot(*(np.mod(c + 0.5, 1.0) - 0.5 for c in np.meshgrid(x, y)))
    return from_centre < 0.5 * _DISC_DEG / _PITCH_DEG


def plant_mark(Lab: NDArray[np.floating], mark: NDArray[np.bool_]) -> NDArray[np.float32]:
    """A picture (H, W, 3) with the mark in it: 20 L* brighter on dark places, 20 L* darker on bright ones."""
    marked = np.array(Lab, np.float32)
    L = marked[..., 0]
    L += np.where(mark, np.where(L < 50.0, _MARK_L, -_MARK_L), 0.0).astype(np.float32)
    return marked


def ghost_L(
    L_view: NDArray[np.floating],
    L_view_marked: NDArray[np.floating],
    inner: NDArray[np.bool_],
    px_per_degree: float,
) -> float:
    """Ghost of a mark that was planted in the other picture: how far two views of this one differ, in L*.

    Parameters
    ----------
    L_view, L_view_marked : (H, W) arrays
        L* through the eye of the same picture's views, without and with the mark in the other picture.
    inner : (H, W) bool array
    px_per_degree : float

    Returns
    -------
    float
        99th percentile of the absolute difference above one cycle per degree.
    """
    difference = high_passed(L_view_marked - L_view, inner, px_per_degree, GHOST_CYCLES_PER_DEGREE)
    return float(np.percentile(np.abs(difference[inner]), _GHOST_PERCENTILE))


def coefficient_of_other(
    response: NDArray[np.floating], own: NDArray[np.floating], other: NDArray[np.floating]
) -> float:
    """Least-squares fit response ~ 1 + own + other over (n,) pixels: the coefficient of other."""
    response, own, other = (a.astype(np.float64) - a.mean(dtype=np.float64) for a in (response, own, other))
    oo, ww, ow = own @ own, other @ other, own @ other
    determinant = oo * ww - ow**2
    if oo <= _UNIFORM_L**2 * len(own):
        return float(other @ response / ww)
    if determinant <= 1e-9 * oo * ww:  # one picture twice: own takes it all
        return 0.0
    return float((oo * (other @ response) - ow * (own @ response)) / determinant)
