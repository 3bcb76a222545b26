"""Static gamut mapping: a picture's colours -> colours that a sub-gamut holds (paper: section V-A1).

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

    C_max is read from a table over lightness and hue (found by halvings on the half-spaces). The table rounds corners:
    a colour that is outside for that, and every clipped one, is halved onto the boundary itself, so the table costs no
    promise, only a little room for chroma.

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

    columns = np.vstack([sub_gamut.normals.T, sub_gamut.offsets])
    white = np.asarray(sub_gamut.white_point, np.float64)
    boundary = _boundary_chroma(columns, white, L_to[0], L_to[1], _LIGHTNESS_NODES, _HUE_NODES)
    mapped, counts = _map_pixels(Lab, columns, white, boundary, L_from, L_to, CHROMA_KNEES[chroma])

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
def _slack(L: float, a: float, b: float, columns: NDArray[np.float64], white: NDArray[np.float64]) -> float:
    """Distance in XYZ to the nearest plane, negative outside; columns (4, m) hold the unit normals and the offset."""
    fy = (L + 16.0) / 116.0
    X = white[0] * _inverse_f(fy + a / 500.0)
    Y = white[1] * _inverse_f(fy)
    Z = white[2] * _inverse_f(fy - b / 200.0)
    slack = 1e9
    for i in range(columns.shape[1]):
        slack = min(slack, columns[3, i] - (columns[0, i] * X + columns[1, i] * Y + columns[2, i] * Z))
    return slack


@njit(cache=True, parallel=True, error_model="numpy")
def _boundary_chroma(
    columns: NDArray[np.float64], white: NDArray[np.float64], L_low: float, L_high: float, n_lightness: int, n_hue: int
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
                if _slack(L, middle * ca, middle * cb, columns, white) >= 0.0:
                    low = middle
                else:
                    high = middle
            boundary[i, j] = low
    return boundary


@njit(cache=True, error_model="numpy")
def _look_up(share: float, hue: float, boundary: NDArray[np.float64]) -> float:
    """Chroma of the boundary, bilinear in the table, at a share 0..1 of the lightness range and a hue in radians."""
    u, v = share * (boundary.shape[0] - 1), (hue / (2.0 * np.pi) % 1.0) * (boundary.shape[1] - 1)
    i, j = min(int(u), boundary.shape[0] - 2), min(int(v), boundary.shape[1] - 2)
    u, v = u - i, v - j
    return (1.0 - u) * ((1.0 - v) * boundary[i, j] + v * boundary[i, j + 1]) + u * (
        (1.0 - v) * boundary[i + 1, j] + v * boundary[i + 1, j + 1]
    )


@njit(cache=True, error_model="numpy")
def _scale_to_boundary(
    outside: float,
    slack_outside: float,
    guess: float,
    L: float,
    a: float,
    b: float,
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
) -> float:
    """A scale of (a, b) inside, at most 1e-3 of chroma or 5e-7 of XYZ from the boundary; `outside` is one beyond it.

    Regula falsi between a colour inside and one outside, from the table's `guess`, each step held to the middle
    nine tenths so that neither end sticks.
    """
    C = np.sqrt(a * a + b * b)
    low, high = 0.0, outside
    slack_low, slack_high = _slack(L, 0.0, 0.0, columns, white) + TOLERANCE, slack_outside + TOLERANCE
    for step in range(64):
        if (high - low) * C <= 1e-3 or slack_low <= 5e-7:
            break
        if step < 2:
            middle = guess + (step - 0.5) * 0.1 / C  # the table is seldom farther off
            if not low < middle < high:
                continue
        else:
            share = slack_low / (slack_low - slack_high)
            middle = low + min(max(share, 0.05), 0.95) * (high - low)
        slack = _slack(L, np.float32(middle * a), np.float32(middle * b), columns, white) + TOLERANCE
        if slack >= 0.0:
            low, slack_low = middle, slack
        else:
            high, slack_high = middle, slack
    return low


@njit(cache=True, parallel=True, error_model="numpy")
def _map_pixels(
    Lab: NDArray[np.float32],
    columns: NDArray[np.float64],
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
    for row in prange(height):
        for column in range(width):
            share = (np.float64(Lab[row, column, 0]) - L_from[0]) / (L_from[1] - L_from[0])
            share = min(max(share, 0.0), 1.0)
            L = np.float64(np.float32(L_to[0] + share * (L_to[1] - L_to[0])))
            a, b = np.float64(Lab[row, column, 1]), np.float64(Lab[row, column, 2])
            C_source = np.sqrt(a * a + b * b)
            limit = _look_up(share, np.arctan2(b, a), boundary)
            inside = limit >= C_source
            scale = 1.0
            if knee < 1.0:
                bend = knee * limit
                if bend < C_source:
                    room, excess = limit - bend, C_source - bend
                    scale = (bend + (room * excess / (room + excess) if room > 0.0 else 0.0)) / C_source
            slack = _slack(L, np.float32(scale * a), np.float32(scale * b), columns, white)
            if knee >= 1.0:  # what is inside stays as it is, the table's rounding apart
                inside = slack >= -TOLERANCE
            if slack < -TOLERANCE and C_source > 0.0:
                scale = _scale_to_boundary(scale, slack, limit / C_source, L, a, b, columns, white)
                slack = _slack(L, np.float32(scale * a), np.float32(scale * b), columns, white)
            mapped[row, column, 0] = L
            mapped[row, column, 1] = scale * a
            mapped[row, column, 2] = scale * b
            counts[row, 0] += (1.0 - scale) * C_source > 0.1
            counts[row, 1] += inside
            counts[row, 2] += slack >= -TOLERANCE
    return mapped, counts
