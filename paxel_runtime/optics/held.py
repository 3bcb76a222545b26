"""A sheet held freely in front of the wall: where the projector's rays meet it, how bright and how sharp.

The projector's lens stands below the axis, the camera's on it (typical distances of a desktop set-up); both are
points, so that holding the sheet is one more homography between the projector's raster and what the camera sees.
Coordinates as in `geometry`, with z towards the viewer and the wall at z = 0. This file knows no ink.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import ive

from paxel_runtime.optics.geometry import BenchMaps, raster_to_wall
from paxel_runtime.optics.grid import in_bands

__all__ = ["HeldSheet", "defocus", "hold_sheet", "lens_positions_mm"]

_THROW, _LENS_DROP, _CAMERA_DISTANCE = 1.6, 0.5, 2.5
_PUPIL_MM = 8.0
_VARIANCE_STEP = 0.05
_REACH_SIGMAS = 4.5


class HeldSheet(NamedTuple):
    """What holding a sheet in front of the wall changes.

    Attributes
    ----------
    maps : BenchMaps
        The bench's geometry, in which ``raster_to_wall`` now gives the point of the wall that the sheet's lit point
        hides from the camera.
    irradiance : (H, W) float32 array
        Light on the sheet as a multiple of that on the wall, for each pixel.
    defocus_px2 : (H, W) float32 array
        Variance that the projector's blur gains along each axis, projector pixels squared.
    """

    maps: BenchMaps
    irradiance: NDArray[np.float32]
    defocus_px2: NDArray[np.float32]


def lens_positions_mm(resolution: tuple[int, int], width_mm: float) -> NDArray[np.float64]:
    """Positions (x, y, z) of the projector's and of the camera's lens in front of the wall, (2, 3).

    Throw ratio 1.6, the lens level with the picture's lower edge; the camera at 2.5 widths on the axis.
    """
    drop_mm = _LENS_DROP * width_mm * resolution[1] / resolution[0]
    return np.array([[0.0, -drop_mm, _THROW * width_mm], [0.0, 0.0, _CAMERA_DISTANCE * width_mm]])


def hold_sheet(
    maps: BenchMaps,
    resolution: tuple[int, int],
    width_mm: float,
    distance_mm: float,
    tilt_deg: tuple[float, float],
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

    pixels = np.stack(np.meshgrid(np.arange(resolution[0]), np.arange(resolution[1])), axis=-1).astype(np.float64)
    wall = raster_to_wall(maps, pixels)
    ray = wall @ to_wall[:, :2].T + to_wall[:, 2]
    t = beyond / (ray @ normal)
    z_mm = projector[2] * (1.0 - t)
    disc_px = _PUPIL_MM * np.abs(z_mm) / (projector[2] - z_mm) * resolution[0] / width_mm
    return HeldSheet(
        maps=maps._replace(raster_to_wall=raster_to_hidden, wall_to_raster=np.linalg.inv(raster_to_hidden)),
        irradiance=(-(ray @ normal) / (projector[2] * t**2)).astype(np.float32),
        defocus_px2=(disc_px**2 / 16.0).astype(np.float32),  # variance of a uniform disc along an axis
    )


def defocus(x: NDArray[np.float32], variance_px2: NDArray[np.float32]) -> NDArray[np.float32]:
    """Blur intensities by a Gaussian whose variance differs from pixel to pixel.

    The kernel is the discrete Gaussian exp(-t) I_n(t) (T. Lindeberg 1990), whose variance is t for every t >= 0, and
    t = 0 leaves the frame as it is. Light that leaves the frame at its rim is lost.

    Parameters
    ----------
    x : (N, H, W) float32 array
    variance_px2 : (H, W) float32 array

    Returns
    -------
    (N, H, W) float32 array
    """
    largest = float(variance_px2.max())
    reach = int(np.ceil(_REACH_SIGMAS * np.sqrt(largest))) + 2
    steps = np.arange(int(largest / _VARIANCE_STEP) + 2) * _VARIANCE_STEP
    table = ive(np.arange(reach + 1), steps[:, None]).astype(np.float32)
    along, result = np.empty_like(x), np.empty_like(x)

    def blur_rows(start: int, stop: int) -> None:
        _blur_rows(x, variance_px2, table, start, stop, along)

    def blur_columns(start: int, stop: int) -> None:
        _blur_columns(along, variance_px2, table, start, stop, result)

    in_bands(blur_rows, x.shape[1], 64)
    in_bands(blur_columns, x.shape[1], 64)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _blur_rows(
    x: NDArray[np.float32],
    variance_px2: NDArray[np.float32],
    table: NDArray[np.float32],
    start: int,
    stop: int,
    result: NDArray[np.float32],
) -> None:
    width, reach = x.shape[2], table.shape[1] - 1
    for row in range(start, stop):
        for column in range(width):
            place = variance_px2[row, column] / _VARIANCE_STEP
            low = int(place)
            share = place - low  # of the next kernel: mixtures have the mixed variance
            for j in range(x.shape[0]):
                total = 0.0
                for n in range(-min(reach, column), min(reach, width - 1 - column) + 1):
                    weight = table[low, abs(n)] + share * (table[low + 1, abs(n)] - table[low, abs(n)])
                    total += weight * x[j, row, column + n]
                result[j, row, column] = total


@njit(cache=True, nogil=True, error_model="numpy")
def _blur_columns(
    x: NDArray[np.float32],
    variance_px2: NDArray[np.float32],
    table: NDArray[np.float32],
    start: int,
    stop: int,
    result: NDArray[np.float32],
) -> None:
    height, reach = x.shape[1], table.shape[1] - 1
    for row in range(start, stop):
        for column in range(x.shape[2]):
            place = variance_px2[row, column] / _VARIANCE_STEP
            low = int(place)
            share = place - low
            for j in range(x.shape[0]):
                total = 0.0
                for n in range(-min(reach, row), min(reach, height - 1 - row) + 1):
                    weight = table[low, abs(n)] + share * (table[low + 1, abs(n)] - table[low, abs(n)])
                    total += weight * x[j, row + n, column]
                result[j, row, column] = total
