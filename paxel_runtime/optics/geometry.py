"""Where light goes on the virtual bench: projector raster -> wall -> camera, and back.

raster -> radial distortion -> homography -> wall, plus the displacement of a wavy sheet; wall -> homography -> radial
distortion -> camera pixels. The camera looks at the print nearly at right angles, so that a wave of the sheet does
not move the print in its picture; the projector's rays are oblique, so that they land displaced. Hence one smooth
displacement of where the projector's light falls on the print, seen by the camera too. It belongs to the wall: a
white sheet laid on follows it. Coordinates as in the design: wall in mm, +y up; rasters with row 0 at the top.

This file knows no light, no ink and no noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import CALLED, KERNEL
from paxel_runtime.optics.grid import FineGrid, bspline_weights, correlated_noise, in_bands

__all__ = [
    "LATTICE_PX",
    "BenchMaps",
    "CameraPose",
    "camera_to_fine_grid",
    "make_maps",
    "raster_of_channel",
    "raster_to_wall",
    "wall_to_camera",
]

_WAVE_STEP_PX = 12.0
_CAMERA_MARGIN = 0.03
LATTICE_PX = 4
"""Step of the camera pixels whose view `camera_to_fine_grid` gives."""


class BenchMaps(NamedTuple):
    """The bench's geometry.

    Attributes
    ----------
    raster_centre : (2,) float64 array
        Optical axis of the projector, raster px; its radius unit is `radius_px` (centre to corner).
    distortion : (2,) float64 array
        Coefficients k of r (1 + k r^2) of projector and camera.
    raster_to_wall, wall_to_raster : (3, 3) float64 arrays
        Homography from the distorted raster in units of `radius_px` to mm, and its inverse.
    wall_to_camera, camera_to_wall : (3, 3) float64 arrays
        Homography from mm to the undistorted camera plane, and its inverse.
    camera_frame : (3,) float64 array
        Pixels per unit of the distorted camera plane, and the pixel (x, y) of its origin.
    wave_mm : (2, rows, columns) float64 array
        Cubic B-spline coefficients of the displacement in x and y, every 12 raster pixels; empty where it is flat.
    magnification : (N,) float64 array
        Of each channel about the optical axis (lateral chromatic aberration).
    """

    raster_centre: NDArray[np.float64]
    radius_px: float
    distortion: NDArray[np.float64]
    raster_to_wall: NDArray[np.float64]
    wall_to_raster: NDArray[np.float64]
    wall_to_camera: NDArray[np.float64]
    camera_to_wall: NDArray[np.float64]
    camera_frame: NDArray[np.float64]
    wave_mm: NDArray[np.float64]
    magnification: NDArray[np.float64]

    @property
    def camera_px_mm(self) -> float:
        """Size of a camera pixel on the wall, at the middle of its picture."""
        return float(1.0 / (self.camera_frame[0] * np.sqrt(abs(np.linalg.det(self.wall_to_camera[:2, :2])))))


@dataclass(frozen=True)
class CameraPose:
    """How the bench's camera is aimed, from the pose that just holds the projection.

    Attributes
    ----------
    pan : (float, float)
        Shift of the projection in the picture, right and down, as a share of the picture's size.
    zoom : float
        Magnification, > 0.
    roll_deg : float
        Turn about the optical axis.
    slant : (float, float)
        Change of scale from the middle of the projection to its corner along x and y, -0.3..0.3: a camera that does
        not look at right angles.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    pan: tuple[float, float] = (0.0, 0.0)
    zoom: float = 1.0
    roll_deg: float = 0.0
    slant: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not (self.zoom > 0 and np.isfinite((self.zoom, self.roll_deg, *self.pan)).all()):
            raise InputError(f"a camera's zoom must be > 0, and zoom, pan and roll_deg finite, got {self}")
        if not max(map(abs, self.slant)) <= 0.3:
            raise InputError(f"a camera's slant must be -0.3 to 0.3, got {self.slant}")


def make_maps(
    resolution: tuple[int, int],
    width_mm: float,
    camera_resolution: tuple[int, int],
    channels: int,
    chromatic_shift_camera_px: float,
    wave_camera_px: float,
    wave_correlation_px: float,
    seed: int,
    pose: CameraPose | None = None,
) -> BenchMaps:
    """Aim a projector and a camera at the wall, each a little off, as hands would.

    The projection is `width_mm` wide and misses the middle of the pattern by up to 0.6 % of that, is turned by up to
    0.6 degrees, and is up to 1.2 % wider on one side; lenses distort by up to 0.5 %. The camera's picture holds the
    projection with a margin of 3 %, if `pose` does not say otherwise.

    Parameters
    ----------
    resolution, camera_resolution : (width, height)
    channels : int
        Number of the projector's channels; the first is shifted outwards and the last inwards at the corner.
    chromatic_shift_camera_px : float
        That shift, camera pixels.
    wave_camera_px : float
        Rms of the sheet's displacement along each axis, camera pixels.
    wave_correlation_px : float
        Projector pixels at which its correlation has fallen to 1/e.
    seed : int
    pose : CameraPose, optional

    Raises
    ------
    InputError
        If the camera sees no pixel of the projection.
    """
    pose = pose or CameraPose()
    rng = np.random.default_rng((seed, 1))
    width, height = resolution
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    radius_px = float(np.hypot(width, height) / 2)
    radius_mm = radius_px * width_mm / width
    distortion = rng.uniform((0.002, -0.005), (0.005, -0.002))
    shift_mm = rng.uniform(-0.006, 0.006, 2) * width_mm
    to_wall = _similarity(rng.uniform(-0.6, 0.6), radius_mm, shift_mm) @ _keystone(rng.uniform(-0.012, 0.012, 2))
    to_camera = _keystone(rng.uniform(-0.008, 0.008, 2)) @ _similarity(rng.uniform(-0.5, 0.5), 1 / radius_mm, (0, 0))
    if pose.roll_deg or any(pose.slant):
        to_camera = _keystone(np.array(pose.slant)) @ _similarity(pose.roll_deg, 1.0, (0.0, 0.0)) @ to_camera
    flat = BenchMaps(
        raster_centre=centre,
        radius_px=radius_px,
        distortion=distortion,
        raster_to_wall=to_wall,
        wall_to_raster=np.linalg.inv(to_wall).astype(np.float64),
        wall_to_camera=to_camera,
        camera_to_wall=np.linalg.inv(to_camera).astype(np.float64),
        camera_frame=np.array([1.0, 0.0, 0.0]),
        wave_mm=np.empty((2, 0, 0)),
        magnification=np.ones(channels),
    )
    framed = flat._replace(camera_frame=_frame_projection(flat, resolution, camera_resolution))
    if pose.zoom != 1 or any(pose.pan):
        framed = framed._replace(camera_frame=_moved_frame(framed.camera_frame, camera_resolution, pose))
        _require_in_view(framed, resolution, camera_resolution, pose)
    camera_px_mm = framed.camera_px_mm
    shift = chromatic_shift_camera_px * camera_px_mm / radius_mm
    return framed._replace(
        magnification=1.0 + shift * (np.linspace(1, -1, channels) if channels > 1 else np.zeros(1)),
        wave_mm=_make_wave(resolution, wave_camera_px * camera_px_mm, wave_correlation_px, seed),
    )


def _similarity(
    angle_deg: float, scale: float, shift: NDArray[np.float64] | tuple[float, float]
) -> NDArray[np.float64]:
    c, s = scale * np.cos(np.deg2rad(angle_deg)), scale * np.sin(np.deg2rad(angle_deg))
    return np.array([[c, -s, shift[0]], [s, c, shift[1]], [0.0, 0.0, 1.0]])


def _keystone(slope: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [slope[0], slope[1], 1.0]])


def _frame_projection(
    maps: BenchMaps, resolution: tuple[int, int], camera_resolution: tuple[int, int]
) -> NDArray[np.float64]:
    """Scale and origin that put the rim of the projection inside the camera's picture."""
    x, y = np.linspace(-0.5, resolution[0] - 0.5, 65), np.linspace(-0.5, resolution[1] - 0.5, 65)
    rim = np.concatenate([np.stack(np.broadcast_arrays(a, b), -1) for a, b in
                          ((x, y[0]), (x, y[-1]), (x[0], y), (x[-1], y))])  # fmt: skip
    seen = wall_to_camera(maps, raster_to_wall(maps, rim))
    low, high = seen.min(axis=0), seen.max(axis=0)
    size = np.array(camera_resolution, np.float64)
    scale = float(np.min(size * (1 - 2 * _CAMERA_MARGIN) / (high - low)))
    return np.array([scale, *((size - 1) / 2 - scale * (low + high) / 2)])


def _moved_frame(
    frame: NDArray[np.float64], camera_resolution: tuple[int, int], pose: CameraPose
) -> NDArray[np.float64]:
    """The frame zoomed about the picture's middle, and the projection moved by a share of the picture's size."""
    size = np.array(camera_resolution, np.float64)
    middle = (size - 1) / 2
    return np.array([frame[0] * pose.zoom, *(middle + pose.zoom * (frame[1:] - middle) + np.array(pose.pan) * size)])


def _require_in_view(
    maps: BenchMaps, resolution: tuple[int, int], camera_resolution: tuple[int, int], pose: CameraPose
) -> None:
    x, y = np.meshgrid(np.linspace(0, resolution[0] - 1, 65), np.linspace(0, resolution[1] - 1, 65))
    seen = wall_to_camera(maps, raster_to_wall(maps, np.stack((x, y), axis=-1)))
    if not np.any(np.all((seen >= 0) & (seen <= np.array(camera_resolution) - 1), axis=-1)):
        raise InputError(
            f"the camera must see some of the projection, and sees none with {pose}: pan less, or zoom below "
            f"{pose.zoom:g}"
        )


def _make_wave(resolution: tuple[int, int], rms_mm: float, correlation_px: float, seed: int) -> NDArray[np.float64]:
    """B-spline coefficients of a displacement with the wanted rms along each axis."""
    if rms_mm == 0:
        return np.empty((2, 0, 0))
    rng = np.random.default_rng((seed, 2))
    shape = (int(resolution[1] / _WAVE_STEP_PX) + 8, int(resolution[0] / _WAVE_STEP_PX) + 8)
    fields = np.stack([correlated_noise(shape, correlation_px / _WAVE_STEP_PX, rng) for _ in range(2)])
    values = fields  # of the spline at its nodes: they, not the coefficients, get the rms
    for axis in (1, 2):
        values = (4 * values + np.roll(values, 1, axis) + np.roll(values, -1, axis)) / 6
    return fields * (rms_mm / values.std(axis=(1, 2), keepdims=True))


def raster_to_wall(maps: BenchMaps, uv: NDArray[np.floating]) -> NDArray[np.float64]:
    """Wall position in mm, (..., 2), of raster positions (..., 2) of the middle channel."""
    points = np.ascontiguousarray(uv, np.float64)
    return _points_to_wall(points.reshape(-1, 2), maps).reshape(points.shape)


def wall_to_camera(maps: BenchMaps, xy_mm: NDArray[np.floating]) -> NDArray[np.float64]:
    """Camera pixel (x, y), (..., 2), of wall positions (..., 2) in mm."""
    scale, x0, y0 = maps.camera_frame
    h = maps.wall_to_camera
    plane = np.asarray(xy_mm, np.float64) @ h[:, :2].T + h[:, 2]
    plane = plane[..., :2] / plane[..., 2:]
    plane = plane * (1.0 + maps.distortion[1] * (plane**2).sum(axis=-1, keepdims=True))
    return np.stack((x0 + scale * plane[..., 0], y0 - scale * plane[..., 1]), axis=-1)


def raster_of_channel(maps: BenchMaps, channel: int, uv: NDArray[np.floating]) -> NDArray[np.float64]:
    """Raster position of the middle channel that falls where position `uv` (..., 2) of a channel falls."""
    return maps.raster_centre + (np.asarray(uv) - maps.raster_centre) * maps.magnification[channel]


def camera_to_fine_grid(maps: BenchMaps, grid: FineGrid, camera_resolution: tuple[int, int]) -> NDArray[np.float64]:
    """Sample of the fine grid (x, y) that every 4th camera pixel sees, (rows, columns, 2), in x and y.

    Node [j, i] belongs to camera pixel (4 i, 4 j); the last nodes lie at or beyond the picture's rim. The maps bend so
    little that linear interpolation between nodes is true to 1e-3 camera pixels (rms 1e-4).
    """
    columns, rows = (-(-(size - 1) // LATTICE_PX) + 1 for size in camera_resolution)
    nodes = np.empty((rows, columns, 2))

    def work(start: int, stop: int) -> None:
        _camera_nodes_to_raster(start, maps, nodes[start:stop])

    in_bands(work, rows, 32)
    return grid.to_sample(nodes)


@njit(**CALLED)
def _wave_at(u: float, v: float, wave_mm: NDArray[np.float64]) -> tuple[float, float]:
    """Displacement in mm of the light of raster position (u, v); the nearest known value beyond the raster."""
    rows, columns = wave_mm.shape[1], wave_mm.shape[2]
    if rows == 0:
        return 0.0, 0.0
    gx = min(max(u / _WAVE_STEP_PX + 3.0, 1.0), columns - 3.001)
    gy = min(max(v / _WAVE_STEP_PX + 3.0, 1.0), rows - 3.001)
    ix, iy = int(gx), int(gy)
    weights_x, weights_y = bspline_weights(gx - ix), bspline_weights(gy - iy)
    dx = dy = 0.0
    for j in range(4):
        for i in range(4):
            weight = weights_y[j] * weights_x[i]
            dx += weight * wave_mm[0, iy + j - 1, ix + i - 1]
            dy += weight * wave_mm[1, iy + j - 1, ix + i - 1]
    return dx, dy


@njit(**CALLED)
def _to_wall(u: float, v: float, maps: BenchMaps) -> tuple[float, float]:
    """`raster_to_wall` of one point."""
    nx, ny = (u - maps.raster_centre[0]) / maps.radius_px, (maps.raster_centre[1] - v) / maps.radius_px
    stretch = 1.0 + maps.distortion[0] * (nx * nx + ny * ny)
    x, y = _project(maps.raster_to_wall, nx * stretch, ny * stretch)
    dx, dy = _wave_at(u, v, maps.wave_mm)
    return x + dx, y + dy


@njit(**CALLED)
def _project(h: NDArray[np.float64], x: float, y: float) -> tuple[float, float]:
    w = h[2, 0] * x + h[2, 1] * y + h[2, 2]
    return (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / w, (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / w


@njit(**CALLED)
def _undistortion(x: float, y: float, k: float) -> float:
    """Factor that undoes r (1 + k r^2): Newton's method, error (k r^2)^8: below 1e-13 for |k| r^2 < 0.02."""
    r2 = x * x + y * y
    factor = 1.0
    for _ in range(3):
        factor -= (factor * (1.0 + k * r2 * factor * factor) - 1.0) / (1.0 + 3.0 * k * r2 * factor * factor)
    return factor


@njit(**KERNEL)
def _points_to_wall(points: NDArray[np.float64], maps: BenchMaps) -> NDArray[np.float64]:
    wall = np.empty_like(points)
    for i in range(len(points)):
        wall[i, 0], wall[i, 1] = _to_wall(points[i, 0], points[i, 1], maps)
    return wall


@njit(**KERNEL)
def _camera_nodes_to_raster(first_row: int, maps: BenchMaps, nodes: NDArray[np.float64]) -> None:
    scale, x0, y0 = maps.camera_frame
    for j in range(nodes.shape[0]):
        for i in range(nodes.shape[1]):
            px, py = (LATTICE_PX * i - x0) / scale, (y0 - LATTICE_PX * (first_row + j)) / scale
            factor = _undistortion(px, py, maps.distortion[1])
            x, y = _project(maps.camera_to_wall, px * factor, py * factor)
            u = v = dx = dy = 0.0
            for _ in range(5 if maps.wave_mm.shape[1] else 1):  # a contraction: the wave's slope is below 0.01
                qx, qy = _project(maps.wall_to_raster, x - dx, y - dy)
                factor = _undistortion(qx, qy, maps.distortion[0])
                u = maps.raster_centre[0] + maps.radius_px * qx * factor
                v = maps.raster_centre[1] - maps.radius_px * qy * factor
                dx, dy = _wave_at(u, v, maps.wave_mm)
            nodes[j, i, 0] = u
            nodes[j, i, 1] = v
