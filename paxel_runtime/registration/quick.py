"""A bumped projector: the old lookup table, warped to where one picture of one frame shows the light (paper: VII).

On a plane, whatever moved, projector or camera, the light's new places in the picture are a homography of the old
ones. It is fitted to one picture of a frame of random blocks over the old picture of full white. Where that does not
suffice (a sheet that bent, a zoom that turned) the residual displacement says so. Knows arrays; must not know devices
or files.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.registration.table import warp_to_nodal

__all__ = ["QuickRegistration", "quick_frame", "register_quick"]

_BLOCKS_PX = (64, 16, 4)
"""Edges of the random blocks that the frame is made of, projector pixels: each scale leads to the next."""
_SIGMAS_PX = (6.0, 3.0, 1.5, 0.8, 0.8, 0.8)
"""Blur of both pictures at each step of the fit."""
_CHECK_PX = 48
"""Edge of the blocks that the residual displacement is measured in."""
_LEAST_CORRELATION = 0.35
_ENOUGH_PX = 0.15
"""Residual displacement, projector pixels (95 % of the blocks), up to which the warp suffices: 0.1 px ghosts by 0.3 %,
0.2 px by 1.3 % (design: section 10)."""
_LEAST_LIGHT = 0.02


@dataclass(frozen=True, eq=False)
class QuickRegistration:
    """How the light moved in the camera's picture.

    Attributes
    ----------
    homography : (3, 3) float64 array
        Old camera place to new one.
    figures : dict
        ``moved_px``, rms way of the projector's pixels in the picture, camera pixels; ``correlation`` of picture and
        frame after the warp; ``residual_rms_px`` and ``residual_p95_px``, displacements that the warp leaves in
        blocks of the projection, projector pixels; ``kind``, "affine" or "homography"; ``suffices``.
    """

    homography: NDArray[np.float64]
    figures: dict[str, float | str | bool]

    def moved(self, camera_xy: NDArray[np.floating]) -> NDArray[np.float32]:
        """New camera places (H, W, 2) of old ones."""
        return _apply(self.homography, np.asarray(camera_xy, np.float64)).astype(np.float32)


def quick_frame(width: int, height: int, seed: int = 0) -> NDArray[np.bool_]:
    """Frame of random blocks at several scales, (height, width); half of it is lit."""
    rng = np.random.default_rng(seed)
    total = np.zeros((height, width))
    for edge in _BLOCKS_PX:
        blocks = rng.choice([-1.0, 1.0], (-(-height // edge), -(-width // edge)))
        total += np.kron(blocks, np.ones((edge, edge)))[:height, :width]
    return np.asarray(total > 0)


def register_quick(
    picture: NDArray[np.floating],
    white: NDArray[np.floating],
    camera_xy: NDArray[np.float32],
    valid: NDArray[np.bool_],
    seed: int = 0,
) -> QuickRegistration:
    """Find the homography of the picture that takes the old lookup table to a new one.

    Parameters
    ----------
    picture : (h, w) array
        The frame `quick_frame` on the print, now, black-subtracted.
    white : (h, w) array
        Full white on it in the same channel, as captured for the old table, black-subtracted.
    camera_xy : (H, W, 2) float32 array
        Old lookup table.
    valid : (H, W) bool array
        Its measured part.
    seed : int
        Of the frame.

    Raises
    ------
    InputError
        If shapes do not fit.
    CalibrationError
        If the frame is not found in the picture.
    """
    if picture.ndim != 2 or picture.shape != white.shape or camera_xy.shape != (*valid.shape, 2):
        raise InputError(
            "re-registration needs two pictures (h, w) of one size, a table (H, W, 2) and valid (H, W), got "
            f"{picture.shape}, {white.shape}, {camera_xy.shape} and {valid.shape}"
        )
    H, W = valid.shape
    frame = quick_frame(W, H, seed).astype(np.float32)
    lit = white > _LEAST_LIGHT * float(np.percentile(white, 99))
    ratio = np.where(lit, np.clip(picture / np.where(lit, white, 1.0), -0.5, 2.0), np.nan).astype(np.float32)
    table = camera_xy.astype(np.float64)
    homography = _shift_start(ratio, table, valid, frame)
    jacobian = _inverse_jacobian(table)
    for step, sigma_px in enumerate(_SIGMAS_PX):
        free = 6 if step < 2 else 8
        homography = _refine(homography, ratio, table, valid, frame, jacobian, sigma_px, free)
    affine = _refine(homography, ratio, table, valid, frame, jacobian, _SIGMAS_PX[-1], 6)
    both = {"affine": affine, "homography": homography}
    checks = {kind: _check(matrix, ratio, table, valid, frame) for kind, matrix in both.items()}
    better = checks["homography"]["residual_rms_px"] < 0.98 * checks["affine"]["residual_rms_px"]
    kind = "homography" if better else "affine"
    figures: dict[str, float | str | bool] = {**checks[kind], "kind": kind}
    if checks[kind]["correlation"] < _LEAST_CORRELATION:
        raise CalibrationError(
            f"the frame of blocks must be found in the picture with a correlation of {_LEAST_CORRELATION} or more, "
            f"got {checks[kind]['correlation']:.2f}: is the projection still in the camera's picture, and no more than "
            "a quarter of it away from where it was? Otherwise run: paxel capture --force"
        )
    way = _apply(both[kind], table) - table
    figures["moved_px"] = float(np.sqrt(np.mean(np.sum(way**2, axis=-1))))
    figures["suffices"] = bool(checks[kind]["residual_p95_px"] <= _ENOUGH_PX)
    return QuickRegistration(both[kind], figures)


def _apply(homography: NDArray[np.float64], xy: NDArray[np.float64]) -> NDArray[np.float64]:
    plane = xy @ homography[:, :2].T + homography[:, 2]
    return np.asarray(plane[..., :2] / plane[..., 2:], np.float64)


def _seen(
    homography: NDArray[np.float64], ratio: NDArray[np.float32], table: NDArray[np.float64], valid: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The frame as the warped table finds it in the picture, and where it is known."""
    nodal = warp_to_nodal(ratio, _apply(homography, table))
    known = valid & np.isfinite(nodal)
    return np.where(known, nodal, np.float32(0)), known


def _shift_start(
    ratio: NDArray[np.float32], table: NDArray[np.float64], valid: NDArray[np.bool_], frame: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Shift of the picture by the correlation of the whole frame, at the scale of its middle blocks."""
    seen, known = _seen(np.eye(3), ratio, table, valid)
    low = gaussian_filter(np.where(known, seen - seen[known].mean(), 0.0), 3.0)
    wanted = gaussian_filter(frame - frame.mean(), 3.0)
    shape = tuple(2 * length for length in low.shape)
    cross = np.fft.irfft2(np.conj(np.fft.rfft2(low, shape)) * np.fft.rfft2(wanted, shape), s=shape)
    row, column = (int(i) for i in np.unravel_index(int(np.argmax(cross)), shape))
    dv, du = (at - size if at > size // 2 else at for at, size in ((row, shape[0]), (column, shape[1])))
    # content of pixel (u + du, v + dv) is seen where the old table has (u, v): new(u) = old(u - d)
    middle = np.s_[table.shape[0] // 4 : -(table.shape[0] // 4), table.shape[1] // 4 : -(table.shape[1] // 4)]
    across = np.gradient(table, axis=1)[middle].mean(axis=(0, 1))
    down = np.gradient(table, axis=0)[middle].mean(axis=(0, 1))
    homography = np.eye(3)
    homography[:2, 2] = -du * across - dv * down
    return homography


def _inverse_jacobian(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Projector pixels a camera pixel, (H, W, 2 projector, 2 camera)."""
    forward = np.stack([np.gradient(table, axis=1), np.gradient(table, axis=0)], axis=-1)
    return np.asarray(np.linalg.inv(forward), np.float64)


def _refine(
    homography: NDArray[np.float64],
    ratio: NDArray[np.float32],
    table: NDArray[np.float64],
    valid: NDArray[np.bool_],
    frame: NDArray[np.float32],
    jacobian: NDArray[np.float64],
    sigma_px: float,
    free: int,
) -> NDArray[np.float64]:
    """A few Gauss-Newton steps of the first `free` of the 8 numbers: affine, then perspective."""
    wanted = gaussian_filter(frame, sigma_px)
    slope = np.stack(np.gradient(wanted)[::-1], axis=-1)
    for _ in range(3):
        seen, known = _seen(homography, ratio, table, valid)
        share = np.maximum(gaussian_filter(known.astype(np.float32), sigma_px), 1e-3)
        seen = gaussian_filter(seen, sigma_px) / share
        use = known & (share > 0.9)
        if np.count_nonzero(use) < 1000:
            return homography
        moved = _apply(homography, table)[use]
        size = np.array(ratio.shape[::-1], np.float64)
        x, y = ((moved - 0.5 * size) / size.max()).T
        along = np.einsum("ni,nij->nj", slope[use], jacobian[use])  # change of the frame's value a camera pixel
        ax, ay = along.T
        columns = [ax, ay, ax * x, ax * y, ay * x, ay * y, (ax * x + ay * y) * x, (ax * x + ay * y) * y][:free]
        design = np.column_stack([*columns, wanted[use], np.ones(len(x))])
        solved = np.linalg.lstsq(design, seen[use].astype(np.float64), rcond=None)[0]
        # seen = gain (frame(u) - along . way) + level, with the way that the light is off, in camera pixels
        homography = _moved(homography, -solved[:free] / max(float(solved[free]), 1e-3), size)
    return homography


def _moved(
    homography: NDArray[np.float64], change: NDArray[np.float64], size: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The homography followed by a small one, whose 8 numbers are about the picture's middle in units of its width."""
    a, b, c, d, e, f, g, h = np.append(change, np.zeros(8 - len(change)))
    unit = float(size.max())
    to_unit = np.array(
        [[1 / unit, 0.0, -0.5 * size[0] / unit], [0.0, 1 / unit, -0.5 * size[1] / unit], [0.0, 0.0, 1.0]]
    )
    small = np.array(
        [[1 + c / unit, d / unit, a / unit], [e / unit, 1 + f / unit, b / unit], [-g / unit, -h / unit, 1]]
    )
    both = np.linalg.inv(to_unit) @ small @ to_unit @ homography
    return np.asarray(both / both[2, 2], np.float64)


def _check(
    homography: NDArray[np.float64],
    ratio: NDArray[np.float32],
    table: NDArray[np.float64],
    valid: NDArray[np.bool_],
    frame: NDArray[np.float32],
) -> dict[str, float]:
    """Correlation with the frame, and the displacement left in blocks (Lucas and Kanade), projector pixels."""
    seen, known = _seen(homography, ratio, table, valid)
    sigma_px = _SIGMAS_PX[-1]
    wanted = gaussian_filter(frame, sigma_px)
    low = gaussian_filter(seen, sigma_px)
    use = known & (gaussian_filter(known.astype(np.float32), 2.0) > 0.99)
    correlation = float(np.corrcoef(wanted[use], low[use])[0, 1]) if np.count_nonzero(use) > 1000 else 0.0
    slope_v, slope_u = np.gradient(wanted)
    off = []
    for top in range(0, frame.shape[0], _CHECK_PX):
        for left in range(0, frame.shape[1], _CHECK_PX):
            block = np.s_[top : top + _CHECK_PX, left : left + _CHECK_PX]
            inside = use[block]
            if np.count_nonzero(inside) < _CHECK_PX**2 // 2:
                continue
            design = np.column_stack(
                [
                    slope_u[block][inside],
                    slope_v[block][inside],
                    wanted[block][inside],
                    np.ones(np.count_nonzero(inside)),
                ]
            )
            solved = np.linalg.lstsq(design, low[block][inside], rcond=None)[0]
            off.append(np.hypot(solved[0], solved[1]) / max(abs(float(solved[2])), 1e-3))
    size = np.array(off) if off else np.array([np.inf])
    return {
        "correlation": correlation,
        "residual_rms_px": float(np.sqrt(np.mean(size**2))),
        "residual_p95_px": float(np.percentile(size, 95)),
    }
