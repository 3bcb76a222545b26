"""Is the sheet a plane, and were both lenses straight? The best homography of a lookup table, and what it leaves.

Knows tables; must not know captures. Places in camera pixels, (u, v) in projector pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["fit_homography", "homography_places", "plane_figures"]

_SAMPLES = 20_000
_ROUNDS = 8


def fit_homography(uv: NDArray[np.floating], xy: NDArray[np.floating]) -> NDArray[np.float64]:
    """Homography (3, 3) from (n, 2) to (n, 2) places: least squares of the places, Tukey's weights, 4 pairs or more.

    Both sides are normalised first (Hartley 1997); each round divides by the depth of the one before, so that what is
    minimised ends as a distance in the second picture.
    """
    from_uv, to_xy = _normalising(uv), _normalising(xy)
    a, b = homography_places(from_uv, uv), homography_places(to_xy, xy)
    n = len(a)
    ones, zeros = np.ones((n, 1)), np.zeros((n, 3))
    rows = np.vstack(
        [
            np.hstack([a, ones, zeros, -a * b[:, :1], -b[:, :1]]),
            np.hstack([zeros, a, ones, -a * b[:, 1:], -b[:, 1:]]),
        ]
    )
    weight, matrix = np.ones(n), np.eye(3, dtype=np.float64)
    for _ in range(_ROUNDS):
        depth = a @ matrix[2, :2] + matrix[2, 2]
        scaled = rows * np.tile(weight / depth, 2)[:, None]
        # the smallest singular vector, by the 9 x 9 products: plenty for data normalised to order 1
        matrix = np.linalg.eigh(scaled.T @ scaled)[1][:, 0].reshape(3, 3)
        matrix = np.asarray(matrix / matrix[2, 2], np.float64)
        off = np.hypot(*(homography_places(matrix, a) - b).T)
        cutoff = 4.7 * max(1.4826 * float(np.median(off)), 1e-9)
        weight = np.where(off < cutoff, 1.0 - (off / cutoff) ** 2, 0.0)
    both = np.linalg.inv(to_xy) @ matrix @ from_uv
    return np.asarray(both / both[2, 2], np.float64)


def homography_places(homography: NDArray[np.float64], uv: NDArray[np.floating]) -> NDArray[np.float64]:
    """Places (..., 2) that a homography takes places (..., 2) to."""
    plane = np.asarray(uv, np.float64) @ homography[:, :2].T + homography[:, 2]
    return np.asarray(plane[..., :2] / plane[..., 2:], np.float64)


def _normalising(places: NDArray[np.floating]) -> NDArray[np.float64]:
    """Similarity that takes places to mean 0 and mean square radius 2."""
    middle = np.asarray(np.mean(places, axis=0), np.float64)
    scale = np.sqrt(2.0 / max(float(np.mean(np.sum((places - middle) ** 2, axis=1))), 1e-30))
    return np.array([[scale, 0.0, -scale * middle[0]], [0.0, scale, -scale * middle[1]], [0.0, 0.0, 1.0]])


def plane_figures(camera_xy: NDArray[np.float32], valid: NDArray[np.bool_], seed: int = 0) -> dict[str, float]:
    """How far a lookup table is from that of a plane seen through straight lenses.

    Returns
    -------
    dict
        ``plane_rms_px``, ``plane_max_px``: distance of the table's places from the best homography, camera pixels:
        the lenses' distortion and the sheet's waves together. Empty where fewer than 8 pixels are valid.
    """
    rows, columns = np.nonzero(valid)
    if rows.size < 8:
        return {}
    chosen = np.random.default_rng(seed).choice(rows.size, min(_SAMPLES, rows.size), replace=False)
    uv = np.column_stack([columns[chosen], rows[chosen]]).astype(np.float64)
    xy = camera_xy[rows[chosen], columns[chosen]].astype(np.float64)
    off = np.hypot(*(homography_places(fit_homography(uv, xy), uv) - xy).T)
    return {"plane_rms_px": float(np.sqrt(np.mean(off**2))), "plane_max_px": float(off.max())}
