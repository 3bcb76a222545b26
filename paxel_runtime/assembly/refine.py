"""Refined assembly: Eq. 6, corrected until the eye sees the wanted light on both surfaces (design: section 10).

Starts with `dither`; then a few times e = G * (wanted - A(a) p), p <- clip(p + B(a) e): G is the eye's blur, A(a) each
pixel's own response with its coverage a, B(a) = A(a)^T (mean A A^T)^-1. Wanted is what the model shows for the inputs x
as if every pixel lit all clusters, A x; black level, and a correction at x, are in both and cancel. Errors vary
slowly: they are gathered, blurred and handed out on a raster of half the resolution. Knows models, labels and
coverages; nothing of colours wanted or of codes.

Memory, besides x, coverages and the result: a raster of 6 float32 values at half the columns, some on the half raster,
and the inputs there: 60 byte a pixel and n more (3840 x 2160, n = 9: 0.6 GB).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.assembly.coverage import cluster_coverage
from paxel_runtime.assembly.dither import dither, inside_pattern
from paxel_runtime.assembly.own_response import OwnResponse, own_response
from paxel_runtime.assembly.refine_kernels import (
    correct,
    gather_inputs,
    gather_rows,
    horizontal_blur,
    vertical_blur,
)
from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["LEAST_SIGMA_DOTS", "STEPS", "refine", "sigma_of"]

STEPS = (3.06, 1.94, 1.28, 1.03)
"""Length of each round's step: of an error that the blur leaves a share s of, a step corrects s times its length; these
four, 1 over the Chebyshev points of 0.3..1, together correct as much as eight steps of length 1. The longest comes
first: what it makes of the pattern's own texture, where that passes the blur, the shorter ones put right."""
LEAST_SIGMA_DOTS = 0.8
"""Least sigma of the blur, in dots, for two colorants: a sharper eye sees the pattern, and to correct that would fight
the effect."""

_CUT_SIGMAS = 3.0
_WEAKEST = 1e-4
"""Eigenvalue of mean A A^T, over the largest, below which a direction of light is left alone."""
_LEAST_HALVED_PX = 2.0
_INTERPOLATION_PX2 = 0.75
"""Variance of linear interpolation from cells of 2 px: 3/4 at half a pixel, 1/4 at one and a half."""
_BAND_CELLS = 64
_LEAST_COUNT = np.float32(1e-3)


def sigma_of(eye_px: float, dot_px: float, colorants: int = 2) -> tuple[float, str]:
    """Sigma of the blur to correct under, pixels, and a message where the eye's own is too sharp for the pattern.

    The least is `LEAST_SIGMA_DOTS` for two colorants; patterns of more repeat after more dots.
    """
    least_dots = LEAST_SIGMA_DOTS * math.sqrt(max(colorants - 1, 1))
    least = least_dots * dot_px
    if eye_px >= least:
        return eye_px, ""
    return least, (
        f"at viewing.distance_mm the eye blurs by {eye_px:.2f} px, less than {least_dots:.2g} dots, and begins to see "
        f"the pattern: assembled for {least:.2f} px instead"
    )


def refine(
    x: NDArray[np.float32],
    labels: NDArray[np.uint8],
    model: PredictionModel,
    coverage: NDArray[np.uint8],
    sigma_px: float,
    *,
    spot_px: float = math.inf,
    steps: Sequence[float] = STEPS,
) -> NDArray[np.float32]:
    """Intensities (H, W, N) that show A x through the eye, each pixel's own response taken into account.

    Parameters
    ----------
    x : (H, W, n) float32 array
        Linear inputs 0..1 that each pixel's neighbourhood should get; may be a memory map.
    labels : (H, W) or (H, W, N) uint8 array
        Cluster of each pixel (in each channel), 255 = outside the pattern.
    model : PredictionModel
        Spectral or image-based; one or two surfaces.
    coverage : (H, W, C, M) uint8 array
        Share of each colorant in what a pixel lights, 255 = all; C = 1, or N where channels differ.
    sigma_px : float
        Standard deviation of the eye's blur, projector pixels; see `sigma_of`.
    spot_px : float
        Diameter of the spot in the middle of the frame where the model was measured; infinite: everywhere. What the
        clusters cover is taken from there.
    steps : sequence of float
        Length of the step of each round; none is `dither`.

    Returns
    -------
    (H, W, N) float32 array
        0 outside the pattern.

    Raises
    ------
    InputError
        If shapes do not fit, or sigma is not positive.
    """
    N = len(model.channels)
    _check(x, labels, model, coverage, sigma_px)
    p = dither(x, labels, N)
    spot = _spot(labels.shape[0], labels.shape[1], spot_px)
    planes = (labels if labels.ndim == 3 else labels[..., None])[spot]
    own = own_response(model, *cluster_coverage(coverage[spot], planes, len(model.clusters)))
    inside = inside_pattern(labels)
    step = 2 if sigma_px >= _LEAST_HALVED_PX else 1
    sums, counts = _gather(x, inside, step)
    target = _wanted_light(sums, own, step)
    del sums
    weights = _blur_weights(sigma_px, step)
    scale = _blur(counts[..., None], weights)
    scale = np.where(scale > _LEAST_COUNT, 1 / np.maximum(scale, _LEAST_COUNT), 0).astype(np.float32)
    Q = _inverse(own, coverage, inside)
    rows = np.empty((len(p), *target.shape[1:]), np.float32)
    light, w = np.empty_like(target), np.zeros_like(target)
    for length in (*steps, 0.0):
        # the first pass gathers the light of `dither`, as w is 0; the last one's light is not looked at
        correct_rows = partial(
            correct, p, inside, coverage, own.on_colorants, own.on_second, own.block_px, step, w, rows
        )
        in_bands(correct_rows, len(w))
        if length:
            in_bands(partial(gather_rows, rows, step, light), len(light))
            w = (_blur(target - light, weights) * scale) @ (np.float32(length) * Q.T)
    return p


def _check(
    x: NDArray[np.float32],
    labels: NDArray[np.uint8],
    model: PredictionModel,
    coverage: NDArray[np.uint8],
    sigma_px: float,
) -> None:
    N = len(model.channels)
    if x.shape[-1] != model.n:
        raise InputError(f"assembly needs x with the model's {model.n} inputs a pixel, got {x.shape}")
    if coverage.dtype != np.uint8 or coverage.ndim != 4 or coverage.shape[:2] != x.shape[:2]:
        raise InputError(
            f"coverages must be (H, W, 1 or N, M) uint8 on {x.shape[:2]} pixels, got {coverage.shape} {coverage.dtype}"
        )
    if coverage.shape[2] not in (1, N):
        raise InputError(f"coverages must be one for all, or one for each of the {N} channels; got {coverage.shape[2]}")
    if not (sigma_px > 0 and math.isfinite(sigma_px)):
        raise InputError(f"the eye's blur must be > 0 px, got {sigma_px}")


def _spot(height: int, width: int, spot_px: float) -> tuple[slice, slice]:
    """The square in a frame's middle that a round spot of this diameter has the area of."""
    side = 0.5 * math.sqrt(math.pi)
    halves = [min(0.5 * side * spot_px, 0.5 * length) for length in (height, width)]
    rows, columns = (
        slice(math.floor(0.5 * length - half), math.ceil(0.5 * length + half))
        for length, half in zip((height, width), halves, strict=True)
    )
    return rows, columns


def _gather(
    x: NDArray[np.float32], inside: NDArray[np.bool_], step: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sums of x and counts of pixels inside on the coarse raster; x is read in bands."""
    height, width = inside.shape
    rows, columns = -(-height // step), -(-width // step)
    sums, counts = np.empty((rows, columns, x.shape[2]), np.float32), np.empty((rows, columns), np.float32)

    def work(start: int, stop: int) -> None:
        for first in range(start, stop, _BAND_CELLS):
            cells = slice(first, min(first + _BAND_CELLS, stop))
            pixels = slice(max(0, (first - 1) * step), (cells.stop + 1) * step)
            x_band = np.ascontiguousarray(x[pixels], np.float32)
            size = (height, rows, step)
            gather_inputs(x_band, inside[pixels], pixels.start, first, size, sums[cells], counts[cells])

    in_bands(work, rows)
    return sums, counts


def _wanted_light(sums: NDArray[np.float32], own: OwnResponse, step: int) -> NDArray[np.float32]:
    """Sums of A x over the pixels of each cell, (h, w, 6)."""
    if own.A.shape[:2] == (1, 1):
        return sums @ own.A[0, 0].T
    wanted = np.empty((*sums.shape[:2], 6), np.float32)
    columns = np.arange(sums.shape[1]) * step // own.block_px
    for i, line in enumerate(sums):
        np.einsum("wcn,wn->wc", own.A[i * step // own.block_px][columns], line, out=wanted[i])
    return wanted


def _inverse(own: OwnResponse, coverage: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Q = (mean A A^T)^-1 over the pattern, (6, 6); 0 for directions of light that no pixel can give."""
    stride = max(1, int(math.sqrt(inside.size / 200_000)))
    share = coverage[::stride, ::stride][inside[::stride, ::stride]].astype(np.float64) / 255.0  # (pixels, C, M)
    A = own.on_colorants.mean(axis=(0, 1)).astype(np.float64)  # (N, M, 3)
    N = len(A)
    share = np.broadcast_to(share, (len(share), N, share.shape[2]))
    columns = np.zeros((len(share), N, 6))
    columns[..., :3] = np.einsum("qnm,nmc->qnc", share, A)
    columns[..., 3:] = own.on_second.mean(axis=(0, 1))
    mean = np.einsum("qnc,qnd->cd", columns, columns) / max(len(share), 1)
    values, vectors = np.linalg.eigh(mean)
    inverse = np.where(values > _WEAKEST * values[-1], 1.0 / np.maximum(values, 1e-300), 0.0)
    return ((vectors * inverse) @ vectors.T).astype(np.float32)


def _blur_weights(sigma_px: float, step: int) -> NDArray[np.float32]:
    """Gaussian on the coarse raster; what giving to cells and taking from them blur by themselves is taken off."""
    variance = sigma_px**2 if step == 1 else (sigma_px**2 - 2 * _INTERPOLATION_PX2) / step**2
    sigma = math.sqrt(variance)
    reach = max(1, math.ceil(_CUT_SIGMAS * sigma))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    return (weights / weights.sum()).astype(np.float32)


def _blur(planes: NDArray[np.float32], weights: NDArray[np.float32]) -> NDArray[np.float32]:
    across, both = np.empty_like(planes), np.empty_like(planes)
    in_bands(lambda first, stop: horizontal_blur(planes[first:stop], weights, across[first:stop]), len(planes))
    in_bands(partial(vertical_blur, across, weights, both), len(planes))
    return both
