"""A projector's raster over a print: what each pixel's light meets, and what the print returns when pixels are lit.

Sampled within the pixels, with the projector's blur over the 3 x 3 pixels around; shares no code with the virtual
bench.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import erf

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.numba_options import KERNEL

__all__ = ["BLUR_PX", "met_by_light", "own_light", "returned"]

BLUR_PX = 0.36
"""Sigma of a projector pixel's own blur besides its square: a common lens in focus."""

_FIBONACCI = (8, 13, 21, 34, 55, 89, 144, 233, 377, 610, 987, 1597)


def met_by_light(
    pattern: Pattern,
    pitch_mm: float,
    size_px: int,
    *,
    offset_px: tuple[float, float] = (0.0, 0.0),
    samples: int = 89,
    blur_px: float = BLUR_PX,
) -> NDArray[np.float64]:
    """Share of the light on each colorant, over each pixel's area, from each of the 3 x 3 pixels around.

    Parameters
    ----------
    pattern : Pattern
        Its cells everywhere, with its measured scale: the pattern's edge is not looked at.
    pitch_mm : float
        Width of a projector pixel on the wall.
    size_px : int
        Edge of the piece of the projection, about the middle of the print.
    offset_px : (float, float)
        Phase of the raster against the print.
    samples : int
        Places in a pixel; the next Fibonacci number is taken.
    blur_px : float
        Sigma of the projector's blur, pixels.

    Returns
    -------
    (size_px, size_px, M, 9) float64 array
        Colorant by neighbour; entry 3 a + b is the light of the pixel at row a - 1, column b - 1 from this one. Sums to
        1 over both.

    Raises
    ------
    InputError
        If a length is not positive, or there are too few pixels or samples.
    """
    if not (pitch_mm > 0 and blur_px >= 0 and size_px >= 16 and 8 <= samples <= _FIBONACCI[-1]):
        raise InputError(
            f"a raster needs pitch_mm > 0, blur_px >= 0, size_px >= 16 and 8 to {_FIBONACCI[-1]} samples, got "
            f"{pitch_mm}, {blur_px}, {size_px}, {samples}"
        )
    places, weights = _samples(samples, blur_px)
    angle = np.deg2rad(pattern.angle_deg)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    turns_per_px = (
        turn
        * pitch_mm
        / pattern.dot_size_mm
        / np.array(pattern.print_scale)
        / np.array(pattern.cells.shape[::-1])[:, None]
    )
    offset, total = np.asarray(offset_px, np.float64), weights.sum(axis=0)
    met = np.zeros((size_px, size_px, len(pattern.colorants), 9))
    in_bands(
        lambda first, stop: _meet(pattern.cells, turns_per_px, offset, places, weights, total, first, met[first:stop]),
        size_px,
    )
    return met


def own_light(met: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of each pixel's own light on each colorant, (H, W, M), of `met_by_light`; the piece repeats at its rim."""
    own = np.zeros(met.shape[:3])
    for a in range(3):
        for b in range(3):
            # of the area at (r + da, q + db), the light of the pixel at (-da, -db) from it
            own += np.roll(met[..., 3 * (2 - a) + (2 - b)], (1 - a, 1 - b), axis=(0, 1))
    return own


def returned(lit: NDArray[np.floating], met: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """What every pixel's area returns when pixels are lit by 0..1, (H, W); the piece repeats at its rim.

    Parameters
    ----------
    lit : (H, W) array
    met : (H, W, M, 9) array
        Of `met_by_light`.
    values : (M,) array
        What each colorant returns of light, such as its luminance factor.
    """
    light = np.einsum("m,ijmn->ijn", values, met)
    seen = np.zeros(lit.shape)
    for a in range(3):
        for b in range(3):
            seen += np.roll(lit, (1 - a, 1 - b), axis=(0, 1)) * light[..., 3 * a + b]
    return seen


def _samples(samples: int, blur_px: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places in a pixel, (n, 2) row and column in 0..1, and there the light of each of the 3 x 3 pixels around, (n, 9).

    A Fibonacci lattice: along a row or a column no two places coincide, so that edges that follow the raster are met as
    finely as others. The light of all sums to 1.
    """
    n = next(f for f in _FIBONACCI if f >= samples)
    step = _FIBONACCI[_FIBONACCI.index(n) - 1] if n > _FIBONACCI[0] else 5
    i = np.arange(n)
    places = np.stack([(i + 0.5) / n, (i * step % n + 0.5) / n], axis=1)
    # the pixel above sees this place one pixel below its own
    along = np.stack([_pixel_light(places + 0.5 + shift, blur_px) for shift in (0, -1, -2)], axis=1)
    weights = (along[:, :, None, 0] * along[:, None, :, 1]).reshape(n, 9)
    return places, weights / weights.sum()


def _pixel_light(t: NDArray[np.float64], blur_px: float) -> NDArray[np.float64]:
    """Light along one axis of a pixel that lies from -0.5 to 0.5, at distance t from its middle, in pixels."""
    if blur_px == 0:
        return (np.abs(t) < 0.5).astype(np.float64)
    width = np.sqrt(2) * blur_px
    return np.asarray(0.5 * (erf((t + 0.5) / width) - erf((t - 0.5) / width)))


@njit(**KERNEL)
def _meet(
    cells: NDArray[np.uint8],
    turns_per_px: NDArray[np.float64],
    offset_px: NDArray[np.float64],
    places: NDArray[np.float64],
    weights: NDArray[np.float64],
    total: NDArray[np.float64],
    first: int,
    met: NDArray[np.float64],
) -> None:
    """`met_by_light` on rows `first` and on, into zeros (rows, size, M, 9)."""
    rows, columns = cells.shape
    (ux, uy), (vx, vy) = turns_per_px
    size = met.shape[1]
    for r in range(met.shape[0]):
        for q in range(size):
            for k in range(len(places)):
                y = 0.5 * size - (r + first) - places[k, 0] - offset_px[1]  # +y up
                x = q + places[k, 1] + offset_px[0] - 0.5 * size
                # in turns of the torus: floor is quick and a remainder of integers is not
                u, v = ux * x + uy * y, vx * x + vy * y
                column = min(int((u - np.floor(u)) * columns), columns - 1)
                row = min(int((v - np.floor(v)) * rows), rows - 1)
                label = cells[row, column]
                if label:  # the first colorant has what the others leave
                    for m in range(9):
                        met[r, q, label, m] += weights[k, m]
            for m in range(9):
                met[r, q, 0, m] = total[m]
                for label in range(1, met.shape[2]):
                    met[r, q, 0, m] -= met[r, q, label, m]
