"""A projector's raster over a print: what each pixel's light meets, and what the print returns when pixels are lit.

Sampled within the pixels, with the projector's blur over the 3 x 3 pixels around and the light's spread in the paper;
shares no code with the virtual bench.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf

from paxel_design.visibility.edges import RAGGED_STEP_MM, ragged_edges
from paxel_design.visibility.passages import SCATTERING_MM, scattered_cells
from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["BLUR_PX", "area_shares", "light_met", "met_by_light", "returned"]

BLUR_PX = 0.36
"""Sigma of a projector pixel's own blur besides its square: a common lens in focus."""

_FIBONACCI = (8, 13, 21, 34, 55, 89, 144, 233, 377, 610, 987, 1597)


def met_by_light(
    pattern: Pattern,
    pitch_mm: float,
    size_px: int,
    *,
    offset_px: tuple[float, float] = (0.0, 0.0),
    aim: ArrayLike | None = None,
    samples: int = 89,
    blur_px: float = BLUR_PX,
    scattering_mm: float = SCATTERING_MM,
    ragged_mm: float = 0.0,
) -> NDArray[np.float64]:
    """Share of the light that enters and leaves each colorant, over each pixel's area, from the 3 x 3 pixels around.

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
    aim : (3, 3) array, optional
        Homography from where a place of the projection should fall (mm, +y up, from the middle of the piece) to where
        on the print it falls: hands turn a projector and tilt it, and a registration tells. None = straight.
    samples : int
        Places in a pixel; the next Fibonacci number is taken.
    blur_px : float
        Sigma of the projector's blur, pixels.
    scattering_mm, ragged_mm : float
        Sigma of the light's way in the paper, and of the noise of the print's edges.

    Returns
    -------
    (size_px, size_px, M, M, 9) float64 array
        Colorant where light enters, colorant where it leaves, neighbour: entry 3 a + b is the light of the pixel at row
        a - 1, column b - 1 from this one. Sums to 1 over all three.

    Raises
    ------
    InputError
        If a length is not positive, there are too few pixels or samples, or the aim is no homography.
    """
    if not (
        pitch_mm > 0
        and min(blur_px, scattering_mm, ragged_mm) >= 0
        and size_px >= 16
        and 8 <= samples <= _FIBONACCI[-1]
    ):
        raise InputError(
            f"a raster needs pitch_mm > 0, blur_px, scattering_mm and ragged_mm >= 0, size_px >= 16 and 8 to "
            f"{_FIBONACCI[-1]} samples, got {pitch_mm}, {blur_px}, {scattering_mm}, {ragged_mm}, {size_px}, {samples}"
        )
    straight = np.array([[pitch_mm, 0.0, 0.0], [0.0, -pitch_mm, 0.0], [0.0, 0.0, 1.0]])  # rows run down, +y up
    onto = np.eye(3) if aim is None else np.asarray(aim, np.float64)
    if onto.shape != (3, 3) or not np.isfinite(onto).all() or abs(np.linalg.det(onto)) < 1e-12:
        raise InputError(f"an aim must be a (3, 3) homography that can be inverted, got {np.asarray(aim).tolist()}")
    angle = np.deg2rad(pattern.angle_deg)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    in_turns = np.eye(3)  # of the torus of cells
    in_turns[:2, :2] = turn / np.array(pattern.print_scale) / pattern.dot_size_mm
    in_turns[:2] /= np.array(pattern.cells.shape[::-1])[:, None]
    places, weights = _samples(samples, blur_px)
    offset, scattered = np.asarray(offset_px, np.float64), scattered_cells(pattern, scattering_mm)
    turn_mm = np.array(pattern.cells.shape[::-1]) * pattern.dot_size_mm
    edges = (
        (ragged_edges() * (ragged_mm / turn_mm)).astype(np.float32) if ragged_mm else np.zeros((0, 0, 2), np.float32)
    )
    colorants = len(pattern.colorants)
    met = np.zeros((size_px, size_px, colorants, colorants, 9))
    in_bands(
        lambda first, stop: _meet(
            pattern.cells, scattered, in_turns @ onto @ straight, offset, places, weights, edges,
            turn_mm / RAGGED_STEP_MM, first, met[first:stop],
        ),
        size_px,
    )  # fmt: skip
    return met


def area_shares(met: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of each pixel's area that enters and leaves each colorant, (H, W, M, M): all pixels lit alike."""
    return np.asarray(met.sum(axis=-1))


def returned(lit: NDArray[np.floating], met: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """What every pixel's area returns when pixels are lit by 0..1, (H, W); the piece repeats at its rim.

    Parameters
    ----------
    lit : (H, W) array
    met : (H, W, M, M, 9) array
        Of `met_by_light`.
    values : (M, M) array
        What returns of light that enters and leaves each colorant, such as its luminance factor.
    """
    light = np.einsum("ab,ijabn->ijn", values, met)
    return np.asarray(sum(light[..., n] * around for n, around in enumerate(_around(lit))))


def light_met(lit: NDArray[np.floating], met: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over the piece of the light that enters and leaves each colorant when pixels are lit by 0..1, (M, M)."""
    light = sum(np.einsum("ij,ijab->ab", around, met[..., n]) for n, around in enumerate(_around(lit)))
    return np.asarray(light / lit.size)


def _around(lit: NDArray[np.floating]) -> Iterator[NDArray[np.floating]]:
    """The 3 x 3 pixels around each, in the order of `met_by_light`; the piece repeats at its rim."""
    return (np.roll(lit, (1 - a, 1 - b), axis=(0, 1)) for a in range(3) for b in range(3))


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


@njit(**INLINED)
def _cell_of(turns: float, cells: int) -> int:
    """Which of so many cells a place lies in, in turns of the torus: floor is quick, a remainder of integers is not."""
    return min(int((turns - np.floor(turns)) * cells), cells - 1)


@njit(**KERNEL)
def _meet(
    cells: NDArray[np.uint8],
    scattered: NDArray[np.float32],
    px_to_turns: NDArray[np.float64],
    offset_px: NDArray[np.float64],
    places: NDArray[np.float64],
    weights: NDArray[np.float64],
    edges: NDArray[np.float32],
    steps_per_turn: NDArray[np.float64],
    first: int,
    met: NDArray[np.float64],
) -> None:
    """`met_by_light` on rows `first` and on, (rows, size, M, M, 9). Within a pixel the wall is linear."""
    size, colorants = met.shape[1], met.shape[2]
    rows, columns = cells.shape
    fine_rows, fine_columns = scattered.shape[:2]
    across, up = steps_per_turn
    last = len(edges) - 1  # of a power of two, or there are none
    light = np.empty((colorants, colorants, 9))
    h = px_to_turns
    for r in range(met.shape[0]):
        for q in range(size):
            # the pixel's middle, from the middle of the piece, rows down
            x, y = q + 0.5 + offset_px[0] - 0.5 * size, r + first + 0.5 + offset_px[1] - 0.5 * size
            depth = h[2, 0] * x + h[2, 1] * y + h[2, 2]
            u = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / depth
            v = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / depth
            ux, uy = (h[0, 0] - u * h[2, 0]) / depth, (h[0, 1] - u * h[2, 1]) / depth
            vx, vy = (h[1, 0] - v * h[2, 0]) / depth, (h[1, 1] - v * h[2, 1]) / depth
            light[:] = 0.0
            for k in range(len(places)):
                dy, dx = places[k, 0] - 0.5, places[k, 1] - 0.5
                s, t = u + ux * dx + uy * dy, v + vx * dx + vy * dy
                if last >= 0:
                    i, j = int(np.floor(s * across)) & last, int(np.floor(t * up)) & last
                    s, t = s + edges[j, i, 0], t + edges[j, i, 1]
                into = cells[_cell_of(t, rows), _cell_of(s, columns)]
                j, i = _cell_of(t, fine_rows), _cell_of(s, fine_columns)
                for m in range(9):
                    light[into, 0, m] += weights[k, m]
                for out in range(1, colorants):
                    share = scattered[j, i, out - 1]
                    for m in range(9):
                        light[into, out, m] += share * weights[k, m]
            for into in range(colorants):
                for m in range(9):
                    met[r, q, into, 0, m] = light[into, 0, m]
                for out in range(1, colorants):
                    for m in range(9):  # through the first leaves what the others leave over
                        met[r, q, into, out, m] = light[into, out, m]
                        met[r, q, into, 0, m] -= light[into, out, m]
