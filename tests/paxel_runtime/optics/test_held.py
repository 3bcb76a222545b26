"""A sheet in front of the wall: geometry against rays traced one by one, blur against its moments."""

from __future__ import annotations

import numpy as np
import pytest

from paxel_runtime.optics.geometry import BenchMaps, camera_to_fine_grid, make_maps, raster_to_wall, wall_to_camera
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.held import defocus, defocus_reach_px, hold_sheet, largest_disc_px, lens_positions_mm

SIZE, WIDTH_MM = (96, 64), 60.0
RIM = 6


def maps_of(wave: float = 0.0) -> BenchMaps:
    return make_maps(SIZE, WIDTH_MM, (240, 180), 3, 0.0, wave, 30.0, 4)


@pytest.mark.parametrize(("distance", "tilt"), [(5.0, (0.0, 0.0)), (20.0, (12.0, -20.0)), (50.0, (-20.0, 7.0))])
def test_rays_meet_the_sheet_where_the_homography_says(distance: float, tilt: tuple[float, float]) -> None:
    maps = maps_of()
    held = hold_sheet(maps, SIZE, WIDTH_MM, distance, tilt, RIM)
    largest = largest_disc_px(SIZE, WIDTH_MM, distance, tilt)
    assert 2 * np.sqrt(held.defocus_px2[RIM:-RIM, RIM:-RIM].max()) <= 0.51 * largest  # half of it, and float32
    projector, camera = lens_positions_mm(SIZE, WIDTH_MM)
    a, b = np.deg2rad(tilt)
    turn_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    turn_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    normal = turn_y @ turn_x @ [0, 0, 1]
    step = 0.01

    def on_sheet(uv: np.ndarray) -> np.ndarray:
        wall = np.append(raster_to_wall(maps, uv), 0.0)
        t = normal @ ([0, 0, distance] - projector) / (normal @ (wall - projector))
        return projector + t * (wall - projector)

    for uv in np.array([[0.0, 0.0], [95, 0], [40, 30], [95, 63]]):
        point = on_sheet(uv)
        seen = camera + (point - camera) * camera[2] / (camera[2] - point[2])
        np.testing.assert_allclose(raster_to_wall(held.maps, uv), seen[:2], atol=1e-9)
        sides = [on_sheet(uv + step * e) - point for e in np.eye(2)]
        flat = [raster_to_wall(maps, uv + step * e) - raster_to_wall(maps, uv) for e in np.eye(2)]
        areas = np.linalg.norm(np.cross(*sides)), abs(flat[0][0] * flat[1][1] - flat[0][1] * flat[1][0])
        u, v = uv.astype(int)
        # Areas by differences over 0.01 px, whose error is their curvature.
        assert held.irradiance[v + RIM, u + RIM] == pytest.approx(areas[1] / areas[0], rel=1e-3)


def test_the_camera_finds_the_moved_picture() -> None:
    maps = maps_of(wave=0.3)
    held = hold_sheet(maps, SIZE, WIDTH_MM, 6.0, (10.0, 5.0), RIM).maps
    grid = FineGrid(*SIZE, 4)
    nodes = camera_to_fine_grid(held, grid, (240, 180))
    inner = nodes[15:30, 20:40]
    there = wall_to_camera(held, raster_to_wall(held, grid.to_raster(inner)))
    rows, columns = np.indices(nodes.shape[:2]) * 4
    np.testing.assert_allclose(there, np.stack((columns, rows), -1)[15:30, 20:40], atol=1e-4)  # 5 rounds


def test_defocus_keeps_light_and_adds_variance() -> None:
    x = np.zeros((2, 41, 51), np.float32)
    x[:, 20, 25] = (1.0, 0.5)
    rows, columns = np.indices(x.shape[1:])
    for variance in (0.0, 0.02, 0.33, 2.5):
        blurred = defocus(x, np.full(x.shape[1:], variance, np.float32)).astype(float)
        np.testing.assert_allclose(blurred.sum(axis=(1, 2)), (1.0, 0.5), rtol=1e-6)  # float32
        np.testing.assert_allclose((blurred[0] * (rows - 20) ** 2).sum(), variance, rtol=1e-5, atol=1e-7)
        np.testing.assert_allclose((blurred[0] * (columns - 25) ** 2).sum(), variance, rtol=1e-5, atol=1e-7)
    np.testing.assert_array_equal(defocus(x, np.zeros(x.shape[1:], np.float32)), x)
    uneven = np.random.default_rng(0).uniform(0, 1.5, x.shape[1:]).astype(np.float32)
    flat = defocus(np.ones_like(x), uneven)
    np.testing.assert_allclose(flat[:, 8:-8, 8:-8], 1.0, rtol=1e-6)


def test_a_defocused_point_is_a_disc() -> None:
    radius = 5.3
    x = np.zeros((1, 33, 33), np.float32)
    x[0, 16, 16] = 1.0
    blurred = defocus(x, np.full(x.shape[1:], radius**2 / 4, np.float32))[0] * np.pi * radius**2
    rows, columns = np.indices(blurred.shape) - 16
    distance = np.hypot(rows, columns)
    # On the raster's squares a disc gains a variance of 1/12: the one drawn is smaller, r^2 - 1/3, by 0.03 px.
    np.testing.assert_allclose(blurred[distance < radius - 1], 1.0, atol=0.03)
    assert not blurred[distance > radius + 1].any()
    assert defocus_reach_px(np.full((2, 2), radius**2 / 4, np.float32)) == 5


def test_a_part_of_a_held_sheet_is_lit_as_the_whole() -> None:
    rng = np.random.default_rng(1)
    x, variance = rng.random((2, 40, 50), np.float32), rng.uniform(0, 2, (40, 50)).astype(np.float32)
    reach = defocus_reach_px(variance)
    part = (slice(12 - reach, 20 + reach), slice(15 - reach, 30 + reach))
    near = defocus(np.ascontiguousarray(x[:, *part]), np.ascontiguousarray(variance[part]))
    np.testing.assert_array_equal(near[:, reach:-reach, reach:-reach], defocus(x, variance)[:, 12:20, 15:30])
