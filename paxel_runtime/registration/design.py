"""The known pattern: which colorant each projector pixel lights, read from the printed design, not from the picture.

The vector pattern is registered to the camera's picture (lattice or a given start, then Gauss-Newton from camera to
millimetres); the lookup table takes every projector pixel to the camera and so to the print, and its coverage is
computed there (design: section 7). Pure functions on arrays and a `Pattern`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.registration.print_fit import PrintFit, Scene, fit_print, grow
from paxel_runtime.registration.print_kernels import ink_tables, pixel_shares
from paxel_runtime.registration.print_residual import refine_coverage, residual_picture
from paxel_runtime.registration.print_start import start_on_print
from paxel_runtime.registration.print_view import PrintOptics, camera_to_mm
from paxel_runtime.registration.start import degree_of

__all__ = ["DesignRegistration", "register_design"]

_WINDOWS = 120
"""Windows of 25 x 25 camera pixels that the fit looks at."""
_PAPER = "white"
"""The colorant that is no ink."""


@dataclass(frozen=True, eq=False)
class DesignRegistration:
    """Where the printed design lies under the projection.

    Attributes
    ----------
    coverage : (H, W, M) float32 array
        Share of each of the pattern's colorants in the area of each projector pixel; the sum is 1 on the pattern, and
        less where the pixel reaches beyond it.
    of_channels : (H, W, 1 or C, M) uint8 array
        The same for the pixels of every channel asked for, 255 = all; one, that of `coverage`, if none was.
    coefficients : (m, 2) float64 array
        Camera place to millimetres of the nominal pattern, see `print_view.camera_to_mm`.
    figures : dict
        ``misfit``, rms of picture minus rendering, share of white paper; ``degree`` of the map; ``ink_spread_um``,
        ``scattering_um``, ``camera_blur_px``; ``score`` of the start; ``edge_rms``, what the picture corrected the
        design by, share of a pixel's area (ragged edges).
    """

    coverage: NDArray[np.float32]
    of_channels: NDArray[np.uint8]
    coefficients: NDArray[np.float64]
    figures: dict[str, Any]


def register_design(
    picture: NDArray[np.float32],
    camera_xy: NDArray[np.float32],
    valid: NDArray[np.bool_],
    pattern: Pattern,
    mm_per_px: float,
    colors: NDArray[np.float64],
    *,
    to_mm: NDArray[np.float64] | None = None,
    channel_xy: Sequence[NDArray[np.float32]] = (),
) -> DesignRegistration:
    """Register the printed pattern to a picture of it and compute what each projector pixel covers.

    Parameters
    ----------
    picture : (h, w, C) or (h, w) float32 array
        The print under full light over the white sheet under the same light, black-subtracted, in the camera's raster:
        1 on bare paper. NaN where that is unknown. One channel is enough for black and white.
    camera_xy : (H, W, 2) float32 array
        Lookup table of the channel whose pixels' areas are wanted: the guide channel's.
    valid : (H, W) bool array
    pattern : Pattern
    mm_per_px : float
        Nominal size of a projector pixel on the wall; right to 15 %.
    colors : (M, C) array
        Expected signal of each colorant in the picture's channels, 1 for bare paper; a rough guess will do.
    to_mm : (3, 3) float64 array, optional
        Homography from the camera's picture to millimetres of the pattern, right to about a dot: from fiducials or
        the pattern's corners (see `print_start`). Without it the print is found by its own lattice.
    channel_xy : sequence of (H, W, 2) float32 arrays
        Lookup tables of channels whose pixels' coverages are wanted as well, one at a time in memory.

    Raises
    ------
    InputError
        If shapes do not fit.
    CalibrationError
        If the pattern is not found in the picture.
    """
    picture = np.ascontiguousarray(np.nan_to_num(picture if picture.ndim == 3 else picture[..., None]), np.float32)
    colors = np.asarray(colors, np.float64).reshape(len(pattern.colorants), -1)
    if colors.shape[1] != picture.shape[2] or camera_xy.shape != (*valid.shape, 2):
        raise InputError(
            "the design registration needs a picture (h, w, C), colours (M, C), a table (H, W, 2) and valid (H, W), "
            f"got {picture.shape}, {colors.shape}, {camera_xy.shape} and {valid.shape}"
        )
    inks = sorted(
        (k for k, name in enumerate(pattern.colorants) if name != _PAPER), key=lambda k: float(colors[k].sum())
    )
    tables = ink_tables(pattern, inks)
    pitch_px = float(np.median(np.hypot(*np.moveaxis(np.diff(camera_xy, axis=1), -1, 0))))
    scene = Scene(picture, tables, pattern.dot_size_mm, mm_per_px / pitch_px)
    usable = minimum_filter(valid, 9) & valid
    if not usable.any():
        raise CalibrationError("no projector pixel has measured neighbours: see the verdict of the registration")
    centre = _middle_of(usable)
    affine, score, reach_px = start_on_print(picture, camera_xy, centre, pattern, mm_per_px, colors, to_mm)
    optics = PrintOptics(
        spread_mm=0.0,
        scattering_mm=0.05,
        blur_px=0.6,
        paper=np.ones(picture.shape[2]),
        transmittance=np.sqrt(np.clip(colors[inks], 0.02, 1.2)),
        offsets_mm=np.zeros((len(inks), 2)),
    )
    fit = PrintFit(_affine_coefficients(affine, scene.shape), optics, np.zeros(picture.shape[2]))
    dense = _spread(camera_xy, usable, 20 * _WINDOWS)
    distance = np.hypot(*(dense - camera_xy[centre[1], centre[0]]).T)
    fit = grow(fit, scene, dense, distance, reach_px)
    fit = fit_print(fit, scene, _spread(camera_xy, usable, _WINDOWS))
    signals = np.tile(fit.optics.paper, (len(pattern.colorants), 1))
    signals[inks] *= fit.optics.transmittance**2
    residual = residual_picture(fit, scene)

    def seen_at(xy: NDArray[np.float32]) -> tuple[NDArray[np.float32], dict[str, float]]:
        return refine_coverage(_coverage(fit, scene, xy, pattern, inks), residual, xy, signals, fit.optics, scene.px_mm)

    coverage, refined = seen_at(camera_xy)
    of_channels = np.empty((*valid.shape, max(len(channel_xy), 1), coverage.shape[2]), np.uint8)
    for j, xy in enumerate(channel_xy or [camera_xy]):
        shares = coverage if xy is camera_xy else seen_at(xy)[0]
        np.rint(255 * np.clip(shares, 0, 1), out=of_channels[:, :, j], casting="unsafe")
    figures = {
        **refined,
        "score": score,
        "misfit": [float(value) for value in fit.misfit],
        "degree": degree_of(fit.coefficients),
        "ink_spread_um": 1000.0 * fit.optics.spread_mm,
        "scattering_um": 1000.0 * fit.optics.scattering_mm,
        "camera_blur_px": fit.optics.blur_px,
    }
    return DesignRegistration(coverage, of_channels, fit.coefficients, figures)


def _middle_of(usable: NDArray[np.bool_]) -> tuple[int, int]:
    """Column and row of the usable projector pixel nearest to the middle of the frame."""
    rows, columns = np.nonzero(usable)
    off = (rows - 0.5 * usable.shape[0]) ** 2 + (columns - 0.5 * usable.shape[1]) ** 2
    best = int(np.argmin(off))
    return int(columns[best]), int(rows[best])


def _affine_coefficients(affine: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Chebyshev coefficients (3, 2), in the order of `start.orders`, of an affine map of the camera's picture."""
    h, w = shape
    middle = affine[:, :2] @ np.array([0.5 * (w - 1), 0.5 * (h - 1)]) + affine[:, 2]
    return np.stack([middle, 0.5 * h * affine[:, 1], 0.5 * w * affine[:, 0]])


def _spread(camera_xy: NDArray[np.float32], usable: NDArray[np.bool_], count: int) -> NDArray[np.int64]:
    """Camera pixels (n, 2) of about `count` usable projector pixels on a regular grid."""
    H, W = usable.shape
    step = max(1.0, (H * W / count) ** 0.5)
    rows = np.round(np.arange(0.5 * step, H, step) - 0.5).astype(np.int64).clip(0, H - 1)
    columns = np.round(np.arange(0.5 * step, W, step) - 0.5).astype(np.int64).clip(0, W - 1)
    grid = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[usable[grid[:, 0], grid[:, 1]]]
    return np.rint(camera_xy[grid[:, 0], grid[:, 1]]).astype(np.int64)


def _coverage(
    fit: PrintFit, scene: Scene, camera_xy: NDArray[np.float32], pattern: Pattern, inks: list[int]
) -> NDArray[np.float32]:
    """Shares of all colorants in each projector pixel."""
    bands = np.array_split(camera_xy, max(1, len(camera_xy) // 64))
    centres_mm = np.concatenate([camera_to_mm(fit.coefficients, band, scene.shape) for band in bands])
    shares = pixel_shares(centres_mm, *scene.tables, fit.optics.spread_mm, fit.optics.offsets_mm)
    coverage = np.zeros((*camera_xy.shape[:2], len(pattern.colorants)), np.float32)
    coverage[..., inks] = shares
    if _PAPER in pattern.colorants:
        inside = np.all(np.abs(centres_mm) <= 0.5 * np.array(pattern.size_mm), axis=-1)
        coverage[..., pattern.colorants.index(_PAPER)] = np.where(inside, 1.0 - shares.sum(axis=-1), 0.0)
    return coverage
