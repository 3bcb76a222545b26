"""Registration: one channel's decoded structured light -> the table that says where the camera sees each projector
pixel, and pictures warped by it (paper: IV-A, *nodal images*; design: section 7).

The table is not the pixels' own measurements (each is pulled by the ink it looks at) but a smooth sheet through all of
them: a polynomial plus a smooth residual field. Knows nothing of captures, files or how the coordinates were measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates, uniform_filter

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.numba_options import KERNEL
from paxel_runtime.registration import fit
from paxel_runtime.registration import start as begin
from paxel_runtime.registration.delaunay import fill_holes, pixel_means
from paxel_runtime.registration.plane import plane_figures
from paxel_runtime.registration.residuals import Residuals, measure_residuals
from paxel_runtime.structured_light import Decoded

__all__ = ["TABLES", "ChannelRegistration", "fit_registration", "per_pixel_registration", "warp_to_nodal"]

_SAMPLES = 40_000
"""Camera pixels of the first fit; the later ones use all."""
_LEAST_POINTS = 500
_LOOSE = 1.0
"""Projector pixels that a point may be off the first fit."""
_REACH_PX = 4.0
"""Projector pixels from the nearest measured one up to which the table is trusted."""


@dataclass(frozen=True, eq=False)
class ChannelRegistration:
    """Where the camera sees each projector pixel, in one channel.

    Attributes
    ----------
    camera_xy : (H, W, 2) float32 array
        Camera column and row of each projector pixel's centre; an integer is the centre of a camera pixel. Finite
        everywhere: holes and what the camera does not see are extrapolated.
    valid : (H, W) bool array
        Where the table rests on measurements near by and lies in the camera's picture.
    figures : dict
        ``degree`` of the polynomial; ``sigma_px`` of the residual field in projector pixels, None where it has none;
        ``points``, and ``outliers``, the share of them that is off by a projector pixel or more;
        ``residual_rms_px``, ``residual_p95_px``, ``residual_max_px`` of the others, in camera pixels, None without
        any; ``ink_px2``, see `fit.ink_shift`; ``coverage``, share of valid projector pixels; ``measured``, share of
        them that a point fell on; ``plane_rms_px`` and ``plane_max_px``, see `plane.plane_figures`.
    residuals : Residuals
        Of all points.
    """

    camera_xy: NDArray[np.float32]
    valid: NDArray[np.bool_]
    figures: dict[str, float | None]
    residuals: Residuals


def fit_registration(decoded: Decoded, width: int, height: int, *, seed: int = 0) -> ChannelRegistration:
    """Fit the lookup table of one channel.

    Named steps: a robust start on a sample (RANSAC homography, Tukey weights x signal^2, the shift by ink), all points
    gathered on the projector's pixels, degree by cross-validation, residual field of cross-validated width.

    Parameters
    ----------
    decoded : Decoded
    width, height : int
        Resolution of the projector.
    seed : int
        Of the samples and the folds.

    Raises
    ------
    CalibrationError
        If there are too few decoded pixels, or they do not lie on one sheet.
    """
    rows, columns = np.nonzero(decoded.reason == 0)
    if rows.size < _LEAST_POINTS:
        raise CalibrationError(
            f"a registration needs at least {_LEAST_POINTS} decoded camera pixels, got {rows.size}: check exposure and "
            "focus of the structured-light captures"
        )
    samples = _draw(decoded, rows, columns, seed)
    start = begin.fit_start(samples, width, height, seed)
    weight = (samples.signal / np.median(samples.signal)) ** 2
    projector_xy, signal = np.ascontiguousarray(decoded.projector_xy), np.ascontiguousarray(decoded.signal)
    points = projector_xy, signal, float(np.median(samples.signal))
    table = begin.polynomial_grid(start.coefficients, width, height)
    # what the first polynomial cannot follow is no outlier yet
    sums, _ = fit.gather(*points, table, start.ink_px2, max(start.cutoff_px, _LOOSE * _pitch(table)))
    coefficients, sums = fit.choose_degree(sums, start.coefficients, width, height, seed)
    sigma_px = fit.choose_sigma(sums, seed)
    table = begin.polynomial_grid(coefficients, width, height)
    table += fit.blocks_to_pixels(fit.smooth_blocks(sums, sigma_px), width, height)
    residual = _residual(samples, table, start.ink_px2)
    _, cutoff_px = begin.tukey(residual, weight, np.hypot(*residual.T) < _pitch(table))
    sums, hit = fit.gather(*points, table, start.ink_px2, cutoff_px)
    if math.isfinite(sigma_px):
        table += fit.blocks_to_pixels(fit.smooth_blocks(sums, sigma_px), width, height)
    shape = {
        "degree": begin.degree_of(coefficients),
        "sigma_px": sigma_px if math.isfinite(sigma_px) else None,
        "ink_px2": start.ink_px2,
    }
    return _registration(decoded, samples, table, hit, start.ink_px2, shape)


def per_pixel_registration(decoded: Decoded, width: int, height: int, *, seed: int = 0) -> ChannelRegistration:
    """The paper's lookup table of one channel: means of the pixels' own measurements, gaps filled (paper: IV-A).

    Parameters, result and errors as of `fit_registration`; the figures that belong to its fits are None.
    """
    means = pixel_means(decoded, width, height)
    hit = np.isfinite(means[..., 0])
    table = np.ascontiguousarray(np.moveaxis(fill_holes(means), -1, 0), np.float64)
    rows, columns = np.nonzero(decoded.reason == 0)
    samples = _draw(decoded, rows, columns, seed)
    return _registration(decoded, samples, table, hit, 0.0, {"degree": None, "sigma_px": None, "ink_px2": None})


TABLES = {"fit": fit_registration, "per-pixel": per_pixel_registration}
"""Ways to make a lookup table by the names of ``[registration] table``, the default first."""


def _registration(
    decoded: Decoded,
    samples: begin.Samples,
    table: NDArray[np.float64],
    hit: NDArray[np.bool_],
    ink_px2: float,
    shape: Mapping[str, float | None],
) -> ChannelRegistration:
    """A table (2, H, W) with its valid part and its figures."""
    camera_xy = np.ascontiguousarray(np.moveaxis(table, 0, -1), np.float32)
    valid = _supported(hit) & _in_picture(camera_xy, decoded.reason.shape)
    pitch_px = _pitch(table)
    figures: dict[str, float | None] = {
        **shape,
        "points": int(np.count_nonzero(decoded.reason == 0)),
        **_scatter(_residual(samples, table, ink_px2), pitch_px),
        "coverage": float(np.mean(valid)),
        "measured": float(np.mean(hit)),
        **plane_figures(camera_xy, valid),
    }
    places, signal = np.ascontiguousarray(decoded.projector_xy), np.ascontiguousarray(decoded.signal)
    return ChannelRegistration(camera_xy, valid, figures, measure_residuals(places, signal, table, ink_px2, pitch_px))


def _draw(decoded: Decoded, rows: NDArray[np.int64], columns: NDArray[np.int64], seed: int) -> begin.Samples:
    """A random choice of decoded camera pixels."""
    chosen = np.random.default_rng(seed).choice(rows.size, min(_SAMPLES, rows.size), replace=False, shuffle=False)
    rows, columns = rows[chosen], columns[chosen]
    uv = decoded.projector_xy[rows, columns].astype(np.float64)
    xy = np.column_stack([columns, rows]).astype(np.float64)
    signal = decoded.signal[rows, columns].astype(np.float64)
    return begin.Samples(
        uv[:, 0], uv[:, 1], xy, signal, fit.ink_shift(np.ascontiguousarray(decoded.signal), rows, columns)
    )


def _pitch(table: NDArray[np.float64]) -> float:
    """Camera pixels from one projector pixel to the next (median)."""
    return float(np.median(np.hypot(*np.diff(table, axis=2))))


def _supported(hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Projector pixels with measurements within `_REACH_PX`; lone ones (chance survivors in a hole) do not count."""
    density = uniform_filter(hit.astype(np.float32), 9)
    measured = hit & (density > 0.25 * float(np.median(density[hit])))
    return np.asarray(distance_transform_edt(~measured) <= _REACH_PX)


def _in_picture(camera_xy: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    x, y = camera_xy[..., 0], camera_xy[..., 1]
    return (x >= 0) & (x <= shape[1] - 1) & (y >= 0) & (y <= shape[0] - 1)


def _residual(samples: begin.Samples, table: NDArray[np.float64], ink_px2: float) -> NDArray[np.float64]:
    """Residuals (n, 2) of the sampled points, camera pixels."""
    fitted = np.stack([map_coordinates(plane, [samples.v, samples.u], order=1, mode="nearest") for plane in table], -1)
    return samples.xy + ink_px2 * samples.gradient - fitted


def _scatter(residual: NDArray[np.float64], pitch_px: float) -> dict[str, float | None]:
    """Figures of the residuals; those of a projector pixel or more are outliers."""
    size = np.hypot(*residual.T)
    near = size[size < pitch_px]
    return {
        "outliers": 1.0 - near.size / size.size,
        "residual_rms_px": float(np.sqrt(np.mean(near**2))) if near.size else None,
        "residual_p95_px": float(np.percentile(near, 95)) if near.size else None,
        "residual_max_px": float(np.max(near)) if near.size else None,
    }


def warp_to_nodal(picture: NDArray[np.number], camera_xy: NDArray[np.floating]) -> NDArray[np.float32]:
    """Nodal image: the picture as the projector would see it, bilinear at each projector pixel's centre.

    Parameters
    ----------
    picture : (h, w) or (h, w, c) array
    camera_xy : (H, W, 2) array
        Camera column and row of each projector pixel.

    Returns
    -------
    (H, W) or (H, W, c) float32 array
        NaN where a place lies outside the picture's pixels (more than half a pixel beyond the outer centres).

    Raises
    ------
    InputError
        If a shape does not fit.
    """
    if picture.ndim not in (2, 3) or camera_xy.ndim != 3 or camera_xy.shape[-1] != 2:
        raise InputError(
            f"warping needs a picture (h, w) or (h, w, c) and a table (H, W, 2), got {picture.shape} and "
            f"{camera_xy.shape}"
        )
    # one kind of array whatever comes in, so that the kernel compiles once; float32 holds 16 bits exactly
    planes = np.ascontiguousarray(picture if picture.ndim == 3 else picture[..., None], np.float32)
    nodal = np.full((*camera_xy.shape[:2], planes.shape[2]), np.nan, np.float32)
    _bilinear(planes, np.ascontiguousarray(camera_xy, np.float32), nodal)
    return nodal if picture.ndim == 3 else nodal[..., 0]


@nb.njit(**KERNEL)
def _bilinear(planes: NDArray[np.float32], camera_xy: NDArray[np.float32], nodal: NDArray[np.float32]) -> None:
    h, w, channels = planes.shape
    for row in range(camera_xy.shape[0]):
        for column in range(camera_xy.shape[1]):
            x = float(camera_xy[row, column, 0])
            y = float(camera_xy[row, column, 1])
            if not (-0.5 <= x <= w - 0.5 and -0.5 <= y <= h - 0.5):
                continue
            x = min(max(x, 0.0), w - 1.0)
            y = min(max(y, 0.0), h - 1.0)
            left = min(int(x), max(w - 2, 0))
            top = min(int(y), max(h - 2, 0))
            right = min(left + 1, w - 1)
            low = min(top + 1, h - 1)
            fx = x - left
            fy = y - top
            for c in range(channels):
                upper = planes[top, left, c] * (1.0 - fx) + planes[top, right, c] * fx
                lower = planes[low, left, c] * (1.0 - fx) + planes[low, right, c] * fx
                nodal[row, column, c] = upper * (1.0 - fy) + lower * fy
