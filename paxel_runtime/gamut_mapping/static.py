"""Static gamut mapping: a picture's colours -> colours that a sub-gamut holds (paper: section V-A1).

Lightness goes onto the gray axis inside the sub-gamut, hue stays, chroma is compressed towards the boundary. Knows
sub-gamuts and CIELAB; nothing of surfaces, models or files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping.boundary import (
    TOLERANCE,
    boundary_of_subgamut,
    colour_slack,
    diamond_angle,
    exit_along,
    look_up,
    sub_gamut_columns,
)
from paxel_runtime.gamut_mapping.options import MappingOptions, lightness_from
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.subgamut import SubGamut
from paxel_runtime.numba_options import KERNEL

__all__ = ["Mapped", "compress", "map_to_subgamut", "mapping_figures"]

_FIGURE_PIXELS = 100_000
_SAFE = 0.5
"""Share of the table's boundary below which a colour is inside without asking."""


@dataclass(frozen=True, eq=False)
class Mapped:
    """A picture in the colours of a sub-gamut.

    Attributes
    ----------
    Lab : (H, W, 3) float32 array
        Every pixel lies in the sub-gamut.
    figures : dict
        ``pixels_moved``: share of pixels whose chroma was lowered by more than 0.1; ``pixels_in_gamut_before``: share
        in the sub-gamut with the source's chroma at the new lightness; ``dE00_mean`` and ``dE00_p95`` between source
        and mapped picture, ``chroma_kept``: mean chroma over the source's (all three on an even grid of at most a
        hundred thousand pixels); ``L_from`` and ``L_to``: the lightness range of the picture and where it went.
    """

    Lab: NDArray[np.float32]
    figures: dict[str, Any]


def map_to_subgamut(
    Lab: NDArray[np.float32],
    sub_gamut: SubGamut,
    options: MappingOptions | None = None,
    *,
    lightness: tuple[float, float] | None = None,
) -> Mapped:
    """Bring every colour of a picture into a sub-gamut.

    Lightness L* is mapped linearly from the picture's range to ``sub_gamut.gray_range()``; what lies beyond the
    range is clipped. Hue angle is kept. With C_max the chroma of the boundary at the new lightness and the hue, and
    K = 0.5 C_max, ``"soft"`` keeps chroma C <= K and takes C > K to ``K + (C_max - K) u / (1 + u)`` with
    ``u = (C - K) / (C_max - K)``: slope 1 at the knee, never beyond C_max, monotone. ``"clip"`` takes min(C, C_max).

    C_max is read from a table over lightness and hue (`boundary`); at the corners of a polytope it promises a little
    less than there is. What still comes to lie outside is moved onto the boundary itself.

    Parameters
    ----------
    Lab : (H, W, 3) float32 array
        Source picture, CIELAB as numbers (taken under the sub-gamut's white point).
    sub_gamut : SubGamut
    options : MappingOptions, optional
    lightness : (low, high), optional
        L* of the picture that go to the ends of the range, instead of what `options` find; where the picture's
        lightnesses are less than 1 apart (one gray) these are 0 and 100.

    Returns
    -------
    Mapped

    Raises
    ------
    InputError
        If Lab is no finite (H, W, 3) picture, or `lightness` does not rise.
    GamutError
        If the sub-gamut holds no stretch of the gray axis.
    """
    options = options or MappingOptions()
    Lab = checked_picture(Lab)
    L_to = sub_gamut.gray_range()
    L_from = checked_lightness(lightness or lightness_from(Lab, L_to, options))
    boundary = boundary_of_subgamut(sub_gamut)
    half_spaces = sub_gamut_columns(sub_gamut) if sub_gamut.field is None else None
    mapped, counts = compress(Lab, boundary, L_from, L_to, options.knee, half_spaces, sub_gamut.white_point)
    return Mapped(mapped, mapping_figures(Lab, mapped, counts, L_from, L_to))


def checked_picture(Lab: NDArray[np.float32]) -> NDArray[np.float32]:
    """A picture as the kernels want it."""
    if Lab.ndim != 3 or Lab.shape[2] != 3 or not Lab.size:
        raise InputError(f"gamut mapping needs a picture (H, W, 3), got {Lab.shape}")
    return np.ascontiguousarray(Lab, np.float32)


def checked_lightness(L_from: tuple[float, float]) -> tuple[float, float]:
    """A range of lightness, if it rises."""
    if not L_from[1] > L_from[0]:
        raise InputError(f"the picture's lightness range must rise, got {list(L_from)}")
    return float(L_from[0]), float(L_from[1])


def mapping_figures(
    source: NDArray[np.float32],
    mapped: NDArray[np.float32],
    counts: NDArray[np.int64],
    L_from: tuple[float, float],
    L_to: tuple[float, float],
) -> dict[str, Any]:
    """The figures of `Mapped`.

    Raises
    ------
    InputError
        If the source holds NaN or infinity.
    """
    moved, before, broken = counts.sum(axis=0)
    if broken:
        raise InputError(f"gamut mapping needs finite CIELAB, got NaN or infinity in {broken} pixels of the picture")
    pixels = source.shape[0] * source.shape[1]
    step = int(np.ceil(np.sqrt(max(1.0, pixels / _FIGURE_PIXELS))))
    few, few_mapped = source[::step, ::step], mapped[::step, ::step]
    dE = dE00(few, few_mapped)
    C, C_mapped = (float(np.mean(np.hypot(p[..., 1], p[..., 2]))) for p in (few, few_mapped))
    return {
        "pixels_moved": float(moved / pixels),
        "pixels_in_gamut_before": float(before / pixels),
        "dE00_mean": float(np.mean(dE)),
        "dE00_p95": float(np.quantile(dE, 0.95)),
        "chroma_kept": C_mapped / C if C > 0 else 1.0,
        "L_from": list(L_from),
        "L_to": list(L_to),
    }


def compress(
    Lab: NDArray[np.float32],
    boundary: NDArray[np.float32],
    L_from: tuple[float, float],
    L_to: tuple[float, float],
    knee: float,
    half_spaces: NDArray[np.float64] | None,
    white_point: NDArray[np.float64],
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Map lightness linearly and compress chroma below a boundary.

    Parameters
    ----------
    Lab : (H, W, 3) float32 array
    boundary : (n, m) float32 array
        Of `boundary`, over even steps of `L_to`.
    L_from, L_to : (low, high)
    knee : float
        Share of the boundary up to which chroma stays; 1 clips.
    half_spaces : (7, m) float64 array, optional
        Of `sub_gamut_columns`: colours near the boundary are checked against them.
    white_point : (3,) float64 array

    Returns
    -------
    mapped : (H, W, 3) float32 array
    counts : (H, 3) int64 array
        For each row the number of pixels moved, inside before, and not finite.
    """
    columns = np.zeros((7, 0)) if half_spaces is None else half_spaces
    mapped, counts = np.empty_like(Lab), np.zeros((len(Lab), 3), np.int64)
    ends = np.array(L_from, np.float64), np.array(L_to, np.float64)
    in_bands(
        lambda first, stop: _compress_pixels(
            Lab[first:stop], boundary, *ends, knee, columns, white_point, mapped[first:stop], counts[first:stop]
        ),
        len(Lab),
    )
    return mapped, counts


@njit(**KERNEL)
def _compress_pixels(
    Lab: NDArray[np.float32],
    boundary: NDArray[np.float32],
    L_from: NDArray[np.float64],
    L_to: NDArray[np.float64],
    knee: float,
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
    mapped: NDArray[np.float32],
    counts: NDArray[np.int64],
) -> None:
    height, width = Lab.shape[0], Lab.shape[1]
    slope = 1.0 / (L_from[1] - L_from[0])
    for row in range(height):
        moved, before, broken = 0, 0, 0
        for column in range(width):
            a, b = np.float64(Lab[row, column, 1]), np.float64(Lab[row, column, 2])
            share = (np.float64(Lab[row, column, 0]) - L_from[0]) * slope
            if not abs(share) + abs(a) + abs(b) < 1e9:  # also true of NaN
                broken += 1
                continue
            share = min(max(share, 0.0), 1.0)
            L = L_to[0] + share * (L_to[1] - L_to[0])
            C = np.sqrt(a * a + b * b)
            limit = look_up(share, diamond_angle(a, b), boundary)
            scale, bend = 1.0, knee * limit
            if bend < C:
                room, excess = limit - bend, C - bend
                scale = (bend + (room * excess / (room + excess) if room > 0.0 else 0.0)) / C
            near = columns.shape[1] > 0 and scale * C > _SAFE * limit
            if near and colour_slack(L, scale * a, scale * b, columns, white) < -TOLERANCE:
                scale = min(scale, exit_along(L, a / C, b / C, 0.0, 0.0, 0.0, columns, white) / C)
            mapped[row, column, 0] = L
            mapped[row, column, 1] = scale * a
            mapped[row, column, 2] = scale * b
            moved += (1.0 - scale) * C > 0.1
            before += limit >= C
        counts[row, 0], counts[row, 1], counts[row, 2] = moved, before, broken
