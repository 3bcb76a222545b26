"""Static gamut mapping: a picture's colours -> colours that a sub-gamut holds (paper: section V-A1; design: section 10).

Lightness goes linearly onto the gray axis inside the sub-gamut, hue stays, chroma is compressed towards the boundary.
Knows half-spaces and CIELAB; nothing of surfaces, models or files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.subgamut import SubGamut

__all__ = ["CHROMA_KNEES", "Mapped", "map_to_subgamut"]

CHROMA_KNEES = {"soft": 0.5, "clip": 1.0}
"""Share of the chroma at the boundary up to which a colour keeps its chroma, by the way chroma is treated."""

TOLERANCE = 5e-7
"""How far outside a half-space a mapped colour may lie, XYZ with Y = 1: what float32 Lab can resolve."""

_LIGHTNESS_NODES = 128
_HUE_NODES = 720
_CHROMA_LIMIT = 256.0
_HALVINGS = 24
_FIGURE_PIXELS = 250_000


@dataclass(frozen=True, eq=False)
class Mapped:
    """A picture in the colours of a sub-gamut.

    Attributes
    ----------
    Lab : (H, W, 3) float32 array
        Every pixel lies in the sub-gamut.
    figures : dict
        ``pixels_moved``: share of pixels whose chroma was lowered by more than 0.1; ``pixels_in_gamut_before`` and
        ``pixels_in_gamut``: share in the sub-gamut with the source's chroma, and after; ``dE00_mean`` and
        ``dE00_p95`` between source and mapped picture (on an even grid of at most a quarter million pixels);
        ``L_from`` and ``L_to``: the lightness range of the picture and where it went.
    """

    Lab: NDArray[np.float32]
    figures: dict[str, Any]


def map_to_subgamut(
    Lab: NDArray[np.float32],
    sub_gamut: SubGamut,
    *,
    chroma: str = "soft",
    lightness: tuple[float, float] | None = None,
) -> Mapped:
    """Bring every colour of a picture into a sub-gamut.

    Lightness L* is mapped linearly from the picture's range to ``sub_gamut.gray_range()``; what lies beyond the
    range is clipped. Hue angle is kept. With C_max the chroma of the boundary at the new lightness and the hue, and
    K = 0.5 C_max, ``"soft"`` keeps chroma C <= K and takes C > K to ``K + (C_max - K) u / (1 + u)`` with
    ``u = (C - K) / (C_max - K)``: slope 1 at the knee, never beyond C_max, monotone. ``"clip"`` takes min(C, C_max).

    C_max is read from a table over lightness and hue (found by halvings on the half-spaces); a colour that is then
    outside by the rounding of a corner is halved back to the boundary itself.

    Parameters
    ----------
    Lab : (H, W, 3) float32 array
        Source picture, CIELAB as numbers (taken under the sub-gamut's white point).
    sub_gamut : SubGamut
    chroma : "soft" | "clip"
    lightness : (low, high), optional
        L* of the picture that go to the ends of the range; by default its 0.5 and 99.5 percentiles, or 0 and 100
        where these are less than 1 apart (a picture of one gray).

    Returns
    -------
    Mapped

    Raises
    ------
    InputError
        If Lab is no finite (H, W, 3) picture, `chroma` is unknown, or `lightness` does not rise.
    GamutError
        If the sub-gamut holds no stretch of the gray axis.
    """
    if Lab.ndim != 3 or Lab.shape[2] != 3 or not Lab.size:
        raise InputError(f"gamut mapping needs a picture (H, W, 3), got {Lab.shape}")
    if chroma not in CHROMA_KNEES:
        raise InputError(f"mapping.chroma must be one of {', '.join(CHROMA_KNEES)}; got {chroma!r}")
    Lab = np.ascontiguousarray(Lab, np.float32)
    if not np.all(np.isfinite(Lab)):
        raise InputError("gamut mapping needs finite CIELAB, got NaN or infinity in the picture")
    L_from = np.array(_lightness_range(Lab) if lightness is None else lightness, np.float64)
    if not L_from[1] > L_from[0]:
        raise InputError(f"the picture's lightness range must rise, got {L_from.tolist()}")
    L_to = np.array(sub_gamut.gray_range(), np.float64)

    rows, white = np.column_stack([sub_gamut.normals, sub_gamut.offsets]), np.asarray(sub_gamut.white_point, np.float64)
    boundary = _boundary_chroma(rows, white, L_to[0], L_to[1], _LIGHTNESS_NODES, _HUE_NODES)
    mapped, counts = _map_pixels(Lab, rows, white, boundary, L_from, L_to, CHROMA_KNEES[chroma])

    moved, before, after = counts.sum(axis=0) / (Lab.shape[0] * Lab.shape[1])
    step = int(np.ceil(np.sqrt(max(1.0, Lab.shape[0] * Lab.shape[1] / _FIGURE_PIXELS))))
    dE = dE00(Lab[::step, ::step], mapped[::step, ::step])
    return Mapped(
        mapped,
        {
            "pixels_moved": float(moved),
            "pixels_in_gamut_before": float(before),
            "pixels_in_gamut": float(after),
            "dE00_mean": float(np.mean(dE)),
            "dE00_p95": float(np.quantile(dE, 0.95)),
            "L_from": L_from.tolist(),
            "L_to": L_to.tolist(),
        },
    )


def _lightness_range(Lab: NDArray[np.float32]) -> tuple[float, float]:
    low, high = np.percentile(Lab[..., 0], [0.5, 99.5])
    return (float(low), float(high)) if high - low >= 1.0 else (0.0, 100.0)


@njit(cache=True, error_model="numpy", inline="always")
def _inverse_f(f: float) -> float:
    """Share of the white's X, Y or Z whose CIELAB root is `f`."""
    return f * f * f if f > 6.0 / 29.0 else (116.0 * f - 16.0) * (27.0 / 24389.0)


@njit(cache=True, error_model="numpy")
def _is_inside(
    L: float, a: float, b: float, rows: NDArray[np.float64], white: NDArray[np.float64], tolerance: float
) -> bool:
    """Whether a colour violates no half-space (rows: normal, offset) by more than `tolerance`."""
    fy = (L + 16.0) / 116.0
    X = white[0] * _inverse_f(fy + a / 500.0)
    Y = white[1] * _inverse_f(fy)
    Z = white[2] * _inverse_f(fy - b / 200.0)
    for i in range(rows.shape[0]):
        if rows[i, 0] * X + rows[i, 1] * Y + rows[i, 2] * Z > rows[i, 3] + tolerance:
            return False
    return True


@njit(cache=True, parallel=True, error_model="numpy")
def _boundary_chroma(
    rows: NDArray[np.float64], white: NDArray[np.float64], L_low: float, L_high: float, n_lightness: int, n_hue: int
) -> NDArray[np.float64]:
    """Chroma of the boundary on a grid of lightness (ends included) and hue (0 to 360 degrees, both ends)."""
    boundary = np.empty((n_lightness, n_hue + 1))
    for i in prange(n_lightness):
        L = L_low + (L_high - L_low) * i / (n_lightness - 1)
        for j in range(n_hue + 1):
            hue = 2.0 * np.pi * (j % n_hue) / n_hue
            ca, cb = np.cos(hue), np.sin(hue)
            low, high = 0.0, _CHROMA_LIMIT
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                if _is_inside(L, middle * ca, middle * cb, rows, white, 0.0):
                    low = middle
                else:
                    high = middle
            boundary[i, j] = low
    return boundary


@njit(cache=True, parallel=True, error_model="numpy")
def _map_pixels(
    Lab: NDArray[np.float32],
    rows: NDArray[np.float64],
    white: NDArray[np.float64],
    boundary: NDArray[np.float64],
    L_from: NDArray[np.float64],
    L_to: NDArray[np.float64],
    knee: float,
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Mapped picture, and for each raster row the number of pixels moved, inside before and inside after."""
    height, width = Lab.shape[0], Lab.shape[1]
    mapped = np.empty_like(Lab)
    counts = np.zeros((height, 3), np.int64)
    last_L, n_hue = boundary.shape[0] - 1, boundary.shape[1] - 1
    for row in prange(height):
        for column in range(width):
            share = (np.float64(Lab[row, column, 0]) - L_from[0]) / (L_from[1] - L_from[0])
            share = min(max(share, 0.0), 1.0)
            L = np.float64(np.float32(L_to[0] + share * (L_to[1] - L_to[0])))
            a, b = np.float64(Lab[row, column, 1]), np.float64(Lab[row, column, 2])
            C = np.sqrt(a * a + b * b)
            before = _is_inside(L, a, b, rows, white, TOLERANCE)
            counts[row, 1] += before

            scale = 1.0
            if C > 0.0 and not (before and knee >= 1.0):
                # The chroma of the boundary at this lightness and hue, bilinear in the table.
                u = share * last_L
                v = (np.arctan2(b, a) / (2.0 * np.pi) % 1.0) * n_hue
                i, j = min(int(u), last_L - 1), min(int(v), n_hue - 1)
                u, v = u - i, v - j
                C_max = (1.0 - u) * ((1.0 - v) * boundary[i, j] + v * boundary[i, j + 1]) + u * (
                    (1.0 - v) * boundary[i + 1, j] + v * boundary[i + 1, j + 1]
                )
                C_knee = knee * C_max
                if C > C_knee:
                    room, excess = C_max - C_knee, C - C_knee
                    scale = (C_knee + (room * excess / (room + excess) if room > 0.0 else 0.0)) / C

            inside = True
            if scale < 1.0 or not before:
                inside = _is_inside(L, np.float32(scale * a), np.float32(scale * b), rows, white, TOLERANCE)
            if not inside:
                # The table rounded a corner away: back to the boundary itself.
                low, high = 0.0, scale
                near = max(0.0, scale - 0.25 / C)
                if _is_inside(L, np.float32(near * a), np.float32(near * b), rows, white, TOLERANCE):
                    low = near
                while (high - low) * C > 1e-4:
                    middle = 0.5 * (low + high)
                    if _is_inside(L, np.float32(middle * a), np.float32(middle * b), rows, white, TOLERANCE):
                        low = middle
                    else:
                        high = middle
                scale = low
                inside = scale > 0.0 or _is_inside(L, 0.0, 0.0, rows, white, TOLERANCE)
            mapped[row, column, 0] = L
            mapped[row, column, 1] = scale * a
            mapped[row, column, 2] = scale * b
            counts[row, 0] += (1.0 - scale) * C > 0.1
            counts[row, 2] += inside
    return mapped, counts
