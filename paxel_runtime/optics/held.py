"""A sheet held freely in front of the wall: where the projector's rays meet it, how bright and how sharp.

The projector's lens stands below the axis, the camera's on it (typical distances of a desktop set-up); both are
points, so that holding the sheet is one more homography between the projector's raster and what the camera sees.
Coordinates as in `geometry`, with z towards the viewer and the wall at z = 0. This file knows no ink.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL
from paxel_runtime.optics.geometry import BenchMaps, raster_to_wall
from paxel_runtime.optics.grid import in_bands

__all__ = ["HeldSheet", "defocus", "defocus_reach_px", "hold_sheet", "largest_disc_px", "lens_positions_mm"]

_THROW, _LENS_DROP, _CAMERA_DISTANCE = 1.6, 0.5, 2.5
_PUPIL_MM = 8.0
_VARIANCE_STEP = 0.05
_AREA_SLICES = 32
_NEAREST = 0.6


class HeldSheet(NamedTuple):
    """What holding a sheet in front of the wall changes.

    Attributes
    ----------
    maps : BenchMaps
        The bench's geometry, in which ``raster_to_wall`` now gives the point of the wall that the sheet's lit point
        hides from the camera.
    irradiance : (H + 2 rim, W + 2 rim) float32 array
        Light on the sheet as a multiple of that on the wall, for each pixel of the frame and of a rim around it.
    defocus_px2 : (H + 2 rim, W + 2 rim) float32 array
        Variance that the projector's blur gains along each axis, projector pixels squared.
    rim_px : int
        Pixels of that rim, onto which the frame's defocused light may fall.
    """

    maps: BenchMaps
    irradiance: NDArray[np.float32]
    defocus_px2: NDArray[np.float32]
    rim_px: int


def lens_positions_mm(resolution: tuple[int, int], width_mm: float) -> NDArray[np.float64]:
    """Positions (x, y, z) of the projector's and of the camera's lens in front of the wall, (2, 3).

    Throw ratio 1.6, the lens level with the picture's lower edge; the camera at 2.5 widths on the axis.
    """
    drop_mm = _LENS_DROP * width_mm * resolution[1] / resolution[0]
    return np.array([[0.0, -drop_mm, _THROW * width_mm], [0.0, 0.0, _CAMERA_DISTANCE * width_mm]])


def largest_disc_px(
    resolution: tuple[int, int], width_mm: float, distance_mm: float, tilt_deg: tuple[float, float]
) -> float:
    """Diameter in projector pixels, at most, to which a point is spread on a sheet that `hold_sheet` holds.

    Infinite where the sheet comes nearer to the projector than two fifths of the throw.
    """
    throw_mm, (width, height) = _THROW * width_mm, resolution
    across_mm, up_mm = np.tan(np.deg2rad(np.abs(tilt_deg)))[::-1] * width_mm / 2 * np.array([1.0, height / width])
    z_mm = np.asarray(distance_mm + across_mm + up_mm)
    return float(_disc_px(z_mm, throw_mm, width / width_mm)) if z_mm < _NEAREST * throw_mm else float("inf")


def _disc_px(z_mm: NDArray[np.float64], throw_mm: float, px_per_mm: float) -> NDArray[np.float64]:
    """Image on a sheet at z of a point that is in focus on the wall, measured where its rays would meet the wall."""
    return _PUPIL_MM * np.abs(z_mm) / (throw_mm - z_mm) * px_per_mm


def hold_sheet(
    maps: BenchMaps,
    resolution: tuple[int, int],
    width_mm: float,
    distance_mm: float,
    tilt_deg: tuple[float, float],
    rim_px: int,
) -> HeldSheet:
    """Hold a plane sheet at `distance_mm` in front of the wall's middle, tilted about the x and the y axis.

    Positive tilt brings the upper edge, then the left edge, towards the viewer. Light is conserved along each bundle
    of rays: irradiance is that of the wall times the ratio of the areas that one bundle lights on both. The lens's
    pupil (8 mm) spreads a point that is in focus on the wall to a disc of pupil * |z| / (throw - z).

    Parameters
    ----------
    maps : BenchMaps
        Of the sheet in place.
    resolution : (width, height)
        Of the projector.
    width_mm : float
        Of the projection.
    rim_px : int
        Pixels around the frame that its light may fall on: at least half of `largest_disc_px`.
    """
    projector, camera = lens_positions_mm(resolution, width_mm)
    a, b = np.deg2rad(tilt_deg)
    normal = np.array([np.cos(a) * np.sin(b), -np.sin(a), np.cos(a) * np.cos(b)])
    beyond = normal[2] * distance_mm - normal @ projector
    # A point (x, y, 0) of the wall and the lens P span a ray; it meets the sheet at P + t (W - P).
    to_wall = np.array([[1.0, 0.0, -projector[0]], [0.0, 1.0, -projector[1]], [0.0, 0.0, -projector[2]]])
    depth = normal @ to_wall
    on_sheet = np.vstack((np.outer(projector, depth) + beyond * to_wall, depth))
    x, y, z = camera
    hidden = np.array([[z, 0.0, -x, 0.0], [0.0, z, -y, 0.0], [0.0, 0.0, -1.0, z]])
    moved = hidden @ on_sheet
    raster_to_hidden = moved / moved[2, 2] @ maps.raster_to_wall

    columns, rows = (np.arange(-rim_px, size + rim_px, dtype=np.float64) for size in resolution)
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1)
    wall = raster_to_wall(maps, pixels)
    ray = wall @ to_wall[:, :2].T + to_wall[:, 2]
    t = beyond / (ray @ normal)
    z_mm = projector[2] * (1.0 - t)
    disc_px = _disc_px(z_mm, projector[2], resolution[0] / width_mm)
    return HeldSheet(
        maps=maps._replace(raster_to_wall=raster_to_hidden, wall_to_raster=np.linalg.inv(raster_to_hidden)),
        irradiance=(-(ray @ normal) / (projector[2] * t**2)).astype(np.float32),
        defocus_px2=(disc_px**2 / 16.0).astype(np.float32),  # variance of a uniform disc along an axis
        rim_px=rim_px,
    )


def defocus(x: NDArray[np.float32], variance_px2: NDArray[np.float32]) -> NDArray[np.float32]:
    """Blur intensities by a disc, the image of the lens's pupil, whose size differs from pixel to pixel.

    Each pixel gathers with the disc of its own place: a uniform frame stays uniform, and light is conserved as far as
    the disc does not change within itself (by some 1e-3 of its radius a pixel on a tilted sheet). Discs are areas on
    the squares of the raster, mixed so that their variance is the wanted one, for every value from 0, which leaves a
    pixel as it is. Outside the array it is dark.

    Parameters
    ----------
    x : (N, H, W) float32 array
    variance_px2 : (H, W) float32 array
        Along each axis; a quarter of the squared radius.

    Returns
    -------
    (N, H, W) float32 array
    """
    discs, reach = _discs(float(variance_px2.max()))
    blurred = np.empty_like(x)

    def work(start: int, stop: int) -> None:
        _gather(x, variance_px2, discs, reach, start, blurred[:, start:stop])

    in_bands(work, x.shape[1], 32)
    return blurred


def defocus_reach_px(variance_px2: NDArray[np.float32]) -> int:
    """Pixels from which `defocus` gathers at most, to each side."""
    return int(_discs(float(variance_px2.max()))[1][-1])


@cache
def _discs(largest: float) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Kernels (steps, 2 R + 1, 2 R + 1) of variance 0, 0.05, 0.1, ... up to beyond `largest`, and the reach of each."""
    wanted = np.arange(int(largest / _VARIANCE_STEP) + 2) * _VARIANCE_STEP
    radii = np.arange(0.5, 2.0 * np.sqrt(wanted[-1]) + 1.0, 0.05)
    R = int(np.ceil(radii[-1] + 0.5))
    offsets = np.arange(-R, R + 1)
    across = (np.arange(_AREA_SLICES) + 0.5) / _AREA_SLICES - 0.5
    chords = np.sqrt(np.maximum(radii[:, None, None] ** 2 - (offsets[:, None] + across) ** 2, 0.0))[:, None]
    edges = offsets[None, :, None, None]
    overlap = np.minimum(chords, edges + 0.5) - np.maximum(-chords, edges - 0.5)
    areas = np.maximum(overlap, 0.0).mean(axis=-1)
    areas = areas + np.swapaxes(areas, 1, 2)  # slices see the two axes a little differently
    areas /= areas.sum(axis=(1, 2), keepdims=True)
    variances = (areas.sum(axis=2) * offsets**2).sum(axis=1)
    upper = np.clip(np.searchsorted(variances, wanted, side="right"), 1, len(radii) - 1)
    share = ((wanted - variances[upper - 1]) / (variances[upper] - variances[upper - 1]))[:, None, None]
    kernels = (1.0 - share) * areas[upper - 1] + share * areas[upper]
    lit = kernels.any(axis=2)
    return kernels.astype(np.float32), np.array([np.abs(offsets[row]).max() for row in lit])


@njit(**KERNEL)
def _gather(
    x: NDArray[np.float32],
    variance_px2: NDArray[np.float32],
    discs: NDArray[np.float32],
    reach: NDArray[np.int64],
    start: int,
    blurred: NDArray[np.float32],
) -> None:
    channels, height, width = x.shape
    middle = discs.shape[1] // 2
    for i in range(blurred.shape[1]):
        row = start + i
        for column in range(width):
            place = variance_px2[row, column] / _VARIANCE_STEP
            low = int(place)
            share = np.float32(place - low)  # of the next disc: mixtures have the mixed variance
            far = reach[low + 1]
            top, bottom = max(-far, -row), min(far, height - 1 - row)
            left, right = max(-far, -column), min(far, width - 1 - column)
            for j in range(channels):
                total = np.float32(0.0)
                for dy in range(top, bottom + 1):
                    near, next_ = discs[low, middle + dy], discs[low + 1, middle + dy]
                    source = x[j, row + dy]
                    for dx in range(left, right + 1):
                        weight = near[middle + dx] + share * (next_[middle + dx] - near[middle + dx])
                        total += weight * source[column + dx]
                blurred[j, i, column] = total
