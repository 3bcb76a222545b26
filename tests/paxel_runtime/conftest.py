"""A plain projector, sheet and camera for structured light: blur, ink and noise, in a few lines and milliseconds."""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

Photograph = Callable[..., NDArray[np.uint16]]


def places(shape: tuple[int, int], turn_px: float = 0.0) -> NDArray[np.float64]:
    """Projector coordinates (h, w, 2) of a camera's pixels: two camera pixels each, turned by a degree, keystone."""
    y, x = np.indices(shape).astype(np.float64)
    x = x - turn_px
    z = 1.0 + 2e-4 * (x - 0.5 * shape[1])
    u = (0.5 * x + 0.008 * y + 1.0) / z
    v = (0.5 * y - 0.008 * x + 2.0) / z
    return np.stack([u, v], axis=-1)


@pytest.fixture(scope="session")
def photograph() -> Photograph:
    """Takes a photograph (h, w) uint16 of a frame (H, W) with light 0..1 on a printed checkerboard."""

    def take(
        frame: NDArray[np.generic],
        shape: tuple[int, int],
        *,
        ink: float = 0.08,
        gain: float = 1.0,
        turn_px: float = 0.0,
        blur_px: float = 0.45,
        noise: bool = True,
    ) -> NDArray[np.uint16]:
        fine = np.pad(frame.astype(np.float64), 4).repeat(4, axis=0).repeat(4, axis=1)
        light = gaussian_filter(fine, 4.0 * blur_px)
        uv = places(shape, turn_px)
        # a frame's pixel covers 4 fine ones; its centre lies between the second and the third
        lit = map_coordinates(light, [4.0 * (uv[..., 1] + 4.0) + 1.5, 4.0 * (uv[..., 0] + 4.0) + 1.5], order=1)
        dots = (np.floor(uv[..., 0] / 7.3) + np.floor(uv[..., 1] / 7.3)) % 2
        level = gain * (0.004 + 0.6 * np.where(dots == 0, ink, 1.0) * lit)
        if noise:
            electrons = level * 30000.0
            rng = np.random.default_rng(zlib.crc32(np.ascontiguousarray(frame).tobytes()))
            level = (electrons + np.sqrt(np.maximum(electrons, 0.0) + 25.0) * rng.normal(size=shape)) / 30000.0
        return np.rint(np.clip(level, 0.0, 1.0) * 65535).astype(np.uint16)

    return take


@pytest.fixture(scope="session")
def camera_places() -> Callable[..., NDArray[np.float64]]:
    """The truth of `photograph`."""
    return places
