"""What the print does beyond its design (ragged edges), from what a picture of it differs from the design's rendering.

Every bit of ink too many or too few changes the light of its surroundings by a known sum, whatever the scattering and
the blur do; a small filter gathers it back into its projector pixel. Knows arrays; must not know how the design was
fitted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate, maximum_filter

from paxel_runtime.registration.print_fit import PrintFit, Scene
from paxel_runtime.registration.print_view import PrintOptics, Windows, lay_ink, view
from paxel_runtime.registration.table import warp_to_nodal

__all__ = ["gathering_filter", "refine_coverage", "residual_picture"]

_HALF_PX = 24
_BATCH = 100
"""Windows rendered at a time: about 20 MB a channel."""
_SUBSAMPLES = 3
_RADIUS = 2
"""Of the gathering filter, projector pixels."""
_ALIASES = 3
_GRID = 32


def residual_picture(fit: PrintFit, scene: Scene) -> NDArray[np.float32]:
    """Picture minus rendering, (h, w, C) float32, rendered in windows side by side, some at a time."""
    h, w = scene.shape
    k = 2 * _HALF_PX + 1
    columns, rows = np.meshgrid(np.arange(_HALF_PX, w + _HALF_PX, k), np.arange(_HALF_PX, h + _HALF_PX, k))
    middle = np.stack([columns.ravel(), rows.ravel()], axis=-1)
    residual = scene.picture.copy()
    for some in np.array_split(middle, max(1, len(middle) // _BATCH)):
        windows = Windows.fitting(some, _HALF_PX, scene.px_mm, scene.dot_mm)
        ink = lay_ink(windows, fit.coefficients, scene.shape, fit.optics, scene.tables)
        for (x, y), window in zip(some, view(windows, ink, fit.optics), strict=True):
            part = residual[y - _HALF_PX : y + _HALF_PX + 1, x - _HALF_PX : x + _HALF_PX + 1]
            part -= np.moveaxis(window, 0, -1)[: part.shape[0], : part.shape[1]]
    return residual


def refine_coverage(
    coverage: NDArray[np.float32],
    residual: NDArray[np.float32],
    camera_xy: NDArray[np.float32],
    signals: NDArray[np.float64],
    optics: PrintOptics,
    px_mm: float,
) -> tuple[NDArray[np.float32], dict[str, float]]:
    """Coverage by the design, corrected by what the picture differs from the design.

    Only the two colorants that share a pixel and its neighbours most may trade area, and only where there is an edge.

    Parameters
    ----------
    coverage : (H, W, M) float32 array
        Shares of the colorants by the design.
    residual : (h, w, C) float32 array
        See `residual_picture`.
    camera_xy : (H, W, 2) float32 array
    signals : (M, C) float64 array
        Signal of a solid of each colorant.
    optics : PrintOptics
    px_mm : float
        Size of a camera pixel.

    Returns
    -------
    coverage : (H, W, M) float32 array
    figures : dict
        ``edge_rms``: rms of the correction, share of a pixel's area.
    """
    seen = _pixel_means(residual, camera_xy)
    pitch_px = float(np.median(np.hypot(*np.moveaxis(np.diff(camera_xy, axis=1), -1, 0))))
    around = maximum_filter(coverage, size=(3, 3, 1))
    order = np.argsort(-around, axis=-1, kind="stable")
    most, next_most = order[..., 0], order[..., 1]
    edge = np.take_along_axis(around, next_most[..., None], -1)[..., 0] > 0.0
    noise = np.array([_spread_of(plane[~edge]) for plane in np.moveaxis(seen, -1, 0)])
    gathered = np.empty_like(seen)
    for c in range(seen.shape[2]):
        total = float(np.mean(seen[..., c][edge] ** 2)) if edge.any() else 0.0
        ratio = noise[c] ** 2 / max(total - noise[c] ** 2, 1e-12)
        kernel = gathering_filter(optics.blur_px / pitch_px, optics.scattering_mm / px_mm / pitch_px, ratio)
        gathered[..., c] = correlate(seen[..., c], kernel.astype(np.float32), mode="nearest")
    contrast = (signals[next_most] - signals[most]).astype(np.float32) / np.maximum(noise, 1e-4).astype(np.float32)
    gain = np.sum(contrast * gathered / np.maximum(noise, 1e-4).astype(np.float32), axis=-1)
    gain /= np.maximum(np.sum(contrast**2, axis=-1), 1e-6)
    own, other = (np.take_along_axis(coverage, index[..., None], -1)[..., 0] for index in (most, next_most))
    gain = np.where(edge, np.clip(gain, -other, own), np.float32(0))
    refined = coverage.copy()
    np.put_along_axis(refined, next_most[..., None], (other + gain)[..., None], -1)
    np.put_along_axis(refined, most[..., None], (own - gain)[..., None], -1)
    return refined, {"edge_rms": float(np.sqrt(np.mean(gain**2)))}


def _pixel_means(residual: NDArray[np.float32], camera_xy: NDArray[np.float32]) -> NDArray[np.float32]:
    """Mean of a picture (h, w, C) over the area of each projector pixel, (H, W, C); 0 where it is not seen."""
    across, down = np.gradient(camera_xy, axis=1), np.gradient(camera_xy, axis=0)
    places = (np.arange(_SUBSAMPLES) + 0.5) / _SUBSAMPLES - 0.5
    total = np.zeros((*camera_xy.shape[:2], residual.shape[2]), np.float32)
    for right in places:
        for low in places:
            total += np.nan_to_num(warp_to_nodal(residual, camera_xy + right * across + low * down))
    return np.asarray(total / len(places) ** 2, np.float32)


def _spread_of(values: NDArray[np.float32]) -> float:
    """Standard deviation by the median of absolute values."""
    return 1.4826 * float(np.median(np.abs(values))) if values.size else 0.0


def gathering_filter(blur_px: float, scattering_px: float, noise: float) -> NDArray[np.float64]:
    """Least-squares filter (5, 5) from blurred, sampled differences back to the area of ink in each pixel.

    Differences are taken as uncorrelated from point to point (Wiener filter with the aliases that sampling by pixels
    brings). Half of a difference's effect is spread by scattering: that of the light's first passage.

    Parameters
    ----------
    blur_px, scattering_px : float
        Standard deviations, projector pixels.
    noise : float
        Variance of the noise over that of the differences' effect.
    """
    base = np.fft.fftfreq(_GRID)
    across, own, both = np.zeros((_GRID, _GRID)), 0.0, np.zeros((_GRID, _GRID))
    for i in range(-_ALIASES, _ALIASES + 1):
        for j in range(-_ALIASES, _ALIASES + 1):
            fy, fx = np.meshgrid(base + i, base + j, indexing="ij")
            turn = 2.0 * np.pi**2 * (fx**2 + fy**2)
            box = np.sinc(fx) * np.sinc(fy)
            seen = box * np.exp(-turn * blur_px**2) * 0.5 * (1.0 + np.exp(-turn * scattering_px**2))
            across += box * seen
            both += seen**2
    own = float(np.mean(both))
    kernel = np.real(np.fft.ifft2(across / (both + noise * own)))
    place = np.arange(-_RADIUS, _RADIUS + 1)
    return np.asarray(kernel[np.ix_(place, place)], np.float64)
