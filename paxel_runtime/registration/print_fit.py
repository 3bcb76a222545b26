"""Gauss-Newton from camera to the known print: a polynomial map to millimetres, and how the print looks.

The map grows from a patch where it is known to all of the projection, degree by degree; then everything is fitted at
once on windows spread over the picture. Knows pictures and patterns as arrays; must not know captures or channels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.registration.print_view import (
    Ink,
    PrintOptics,
    Windows,
    camera_to_mm_jacobian,
    cut_windows,
    lay_ink,
    view,
    view_slope,
)
from paxel_runtime.registration.start import chebyshev_terms, degree_of, orders

__all__ = ["PrintFit", "Scene", "fit_print", "grow"]

_HALF_PX = 12
"""Half of a window, camera pixels."""
_LEAST_WINDOWS, _GROWING_WINDOWS = 9, 48
"""Windows looked at while the map grows."""
_MOST_DEGREE = 6
_ENOUGH = 0.999
"""A degree more must bring the misfit of windows left out below this share of the one before."""
_TINY_MM = 1e-3
_PRIORS = {
    "spread_mm": (0.0, 0.05),
    "scattering_mm": (0.05, 0.05),
    "blur_px": (0.6, 0.4),
    "offset_mm": (0.0, 0.05),
    "paper": (1.0, 0.05),
    "transmittance": (0.5, 0.5),
}
"""Expected value and its deviation: they matter only where the picture tells nothing (a
print without bare paper)."""


@dataclass(frozen=True, eq=False)
class Scene:
    """What does not change during the fit.

    Attributes
    ----------
    picture : (h, w, C) float32 array
        Camera's picture of the print over that of white paper.
    tables : see `print_kernels.ink_tables`
    dot_mm : float
    px_mm : float
        Nominal size of a camera pixel on the print.
    """

    picture: NDArray[np.float32]
    tables: tuple[NDArray[np.uint16], NDArray[np.float64]]
    dot_mm: float
    px_mm: float

    @property
    def shape(self) -> tuple[int, int]:
        """(h, w) of the picture."""
        return self.picture.shape[0], self.picture.shape[1]

    def windows(self, middle: NDArray[np.int64]) -> Windows:
        """Windows about these camera pixels; those that the picture's rim cuts are left out."""
        inner = np.all((middle >= _HALF_PX) & (middle < np.array(self.shape[::-1]) - _HALF_PX), axis=1)
        return Windows.fitting(middle[inner], _HALF_PX, self.px_mm, self.dot_mm)


@dataclass(frozen=True, eq=False)
class PrintFit:
    """The print as it lies in the camera's picture.

    Attributes
    ----------
    coefficients : (m, 2) float64 array
        Of `print_view.camera_to_mm`.
    optics : PrintOptics
    misfit : (C,) float64 array
        Rms difference between picture and rendering in each channel, share of paper white.
    """

    coefficients: NDArray[np.float64]
    optics: PrintOptics
    misfit: NDArray[np.float64]


def grow(
    fit: PrintFit, scene: Scene, middle: NDArray[np.int64], distance: NDArray[np.float64], reach_px: float
) -> PrintFit:
    """Extend a map that is known within `reach_px` of a place to all windows.

    Parameters
    ----------
    fit : PrintFit
        With an affine map.
    middle : (n, 2) int64 array
        Camera column and row of candidate windows, dense enough that several lie within reach.
    distance : (n,) float64 array
        Distance of each from the place, camera pixels.
    reach_px : float
    """
    far = float(distance.max())
    nearest = np.argsort(distance, kind="stable")
    while True:
        inside = max(int(np.sum(distance <= reach_px)), _LEAST_WINDOWS)
        few = nearest[:inside][:: max(1, inside // _GROWING_WINDOWS)]
        degree = 1 if reach_px < 0.2 * far else 2
        for _ in range(2):
            fit = _step(fit, scene, scene.windows(middle[few]), degree, optics=False)
        if reach_px >= far:
            return fit
        reach_px *= 1.5


def fit_print(fit: PrintFit, scene: Scene, middle: NDArray[np.int64]) -> PrintFit:
    """Fit map and optics on all windows, the map's terms released degree by degree while windows left out gain."""
    windows = scene.windows(middle)
    left_out = np.arange(len(windows.middle)) % 4 == 3
    kept = replace(windows, middle=windows.middle[~left_out])
    test = replace(windows, middle=windows.middle[left_out])
    for _ in range(2):
        fit = _step(fit, scene, kept, 2, optics=True)
    score = float(np.sum(_misfit(fit, scene, test) ** 2))
    for degree in range(3, _MOST_DEGREE + 1):
        finer = fit
        for _ in range(2):
            finer = _step(finer, scene, kept, degree, optics=False)
        finer_score = float(np.sum(_misfit(finer, scene, test) ** 2))
        if finer_score > _ENOUGH * score:
            break
        fit, score = finer, finer_score
    for _ in range(2):
        fit = _step(fit, scene, windows, degree_of(fit.coefficients), optics=True)
    return replace(fit, misfit=_misfit(fit, scene, windows))


def _misfit(fit: PrintFit, scene: Scene, windows: Windows) -> NDArray[np.float64]:
    seen = view(windows, lay_ink(windows, fit.coefficients, scene.shape, fit.optics, scene.tables), fit.optics)
    off = (cut_windows(scene.picture, windows) - seen).astype(np.float64)
    weight = _trust(off)
    return np.sqrt(np.einsum("n,ncij->c", weight, off**2) / (weight.sum() * off[0, 0].size))


def _trust(off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weight of each window: Tukey's, of its rms against the median; a window with something else in it has none."""
    rms = np.sqrt(np.mean(off**2, axis=(1, 2, 3)))
    part = np.clip((rms / max(float(np.median(rms)), 1e-9) - 1.0) / 3.0, 0.0, 1.0)
    return (1.0 - part**2) ** 2


def _step(fit: PrintFit, scene: Scene, windows: Windows, degree: int, *, optics: bool) -> PrintFit:
    """One Gauss-Newton step of the map, the signals of paper and inks and, if wanted, everything else."""
    coefficients = np.zeros((len(orders(degree)), 2))
    coefficients[: min(len(coefficients), len(fit.coefficients))] = fit.coefficients[: len(coefficients)]
    ink = lay_ink(windows, coefficients, scene.shape, fit.optics, scene.tables)
    seen, slope = view_slope(windows, ink, fit.optics)
    off = (cut_windows(scene.picture, windows) - seen).astype(np.float64)
    weight = np.repeat(_trust(off), off[0, 0].size)
    terms, along = _map_columns(coefficients, scene.shape, windows, slope)
    m, C = terms.shape[1], seen.shape[1]
    shared, own = _optics_columns(fit.optics, scene, windows, coefficients, ink, seen, optics)
    size = 2 * m + len(shared) + C * len(own)
    normal, right = np.zeros((size, size)), np.zeros(size)
    noise = [max(float(np.sqrt(np.mean(weight * off[:, c].ravel() ** 2))), 1e-5) for c in range(C)]
    for c in range(C):
        columns = [terms * along[c, :, :1], terms * along[c, :, 1:]]
        columns += [column[:, c].reshape(-1, 1) for column in (*shared, *own)]
        block = np.hstack(columns)
        index = np.concatenate([np.arange(2 * m + len(shared)), 2 * m + len(shared) + C * np.arange(len(own)) + c])
        weighted = block.T * (weight / noise[c] ** 2)
        normal[np.ix_(index, index)] += weighted @ block
        right[index] += weighted @ off[:, c].ravel()
    information, pull = _prior(fit.optics, len(shared))
    normal[np.arange(2 * m, size), np.arange(2 * m, size)] += information
    right[2 * m :] += information * pull
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    change = np.linalg.solve(normal / np.outer(scale, scale) + 1e-10 * np.eye(size), right / scale) / scale
    moved = coefficients + change[: 2 * m].reshape(2, m).T
    return PrintFit(moved, _changed(fit.optics, change[2 * m :], len(shared)), np.array(noise))


def _map_columns(
    coefficients: NDArray[np.float64], shape: tuple[int, int], windows: Windows, slope: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Terms of the map at every pixel, (N, m), and the signal's derivative by millimetres, (C, N, 2)."""
    offset = np.arange(-windows.half, windows.half + 1)
    x, y = np.broadcast_arrays(
        windows.middle[:, 0, None, None] + offset, windows.middle[:, 1, None, None] + offset[:, None]
    )
    terms = chebyshev_terms(
        x.ravel().astype(np.float64), y.ravel().astype(np.float64), shape[1], shape[0], degree_of(coefficients)
    )
    inverse = np.linalg.inv(np.asarray(camera_to_mm_jacobian(coefficients, windows.middle, shape)))
    along = np.einsum("kncij,nkm->cnijm", slope, inverse, optimize=True)
    return terms, along.reshape(len(along), -1, 2)


def _optics_columns(
    optics: PrintOptics,
    scene: Scene,
    windows: Windows,
    coefficients: NDArray[np.float64],
    ink: Ink,
    seen: NDArray[np.float32],
    everything: bool,
) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """Derivatives (n, C, k, k) by what all channels share, and by what each has of its own (paper, then each ink)."""

    def by(changed: PrintOptics, step: float, *, moved: bool = False) -> NDArray[np.float64]:
        laid = lay_ink(windows, coefficients, scene.shape, changed, scene.tables) if moved else ink
        return (view(windows, laid, changed) - seen).astype(np.float64) / step

    own = [seen.astype(np.float64) / optics.paper[:, None, None]]
    for k in range(len(optics.transmittance)):
        transmittance = optics.transmittance.copy()
        transmittance[k] += 0.01
        own.append(by(replace(optics, transmittance=transmittance), 0.01))
    shared = []
    if everything:
        shared = [
            by(replace(optics, spread_mm=optics.spread_mm + _TINY_MM), _TINY_MM, moved=True),
            by(replace(optics, scattering_mm=optics.scattering_mm + _TINY_MM), _TINY_MM),
            by(replace(optics, blur_px=optics.blur_px + 0.01), 0.01),
        ]
        for k in range(1, len(optics.offsets_mm)):
            for axis in (0, 1):
                offsets = optics.offsets_mm.copy()
                offsets[k, axis] += _TINY_MM
                shared.append(by(replace(optics, offsets_mm=offsets), _TINY_MM, moved=True))
    return shared, own


def _prior(optics: PrintOptics, shared: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information about each number of the optics, and distance to its expected value."""
    values = [optics.spread_mm, optics.scattering_mm, optics.blur_px, *optics.offsets_mm[1:].ravel()][:shared]
    expected = [_PRIORS["spread_mm"], _PRIORS["scattering_mm"], _PRIORS["blur_px"]]
    expected = (expected + [_PRIORS["offset_mm"]] * shared)[:shared]
    values += [*optics.paper, *optics.transmittance.ravel()]
    expected += [_PRIORS["paper"]] * len(optics.paper) + [_PRIORS["transmittance"]] * optics.transmittance.size
    middle, deviation = np.array(expected).T
    return 1.0 / deviation**2, middle - np.array(values)


def _changed(optics: PrintOptics, change: NDArray[np.float64], shared: int) -> PrintOptics:
    """The optics after a step, kept within what can be."""
    if shared:
        offsets = optics.offsets_mm.copy()
        offsets[1:] += change[3:shared].reshape(-1, 2)
        optics = replace(
            optics,
            spread_mm=float(np.clip(optics.spread_mm + change[0], -0.1, 0.1)),
            scattering_mm=float(np.clip(optics.scattering_mm + change[1], 0.005, 0.3)),
            blur_px=float(np.clip(optics.blur_px + change[2], 0.3, 3.0)),
            offsets_mm=np.clip(offsets, -0.2, 0.2),
        )
    C = len(optics.paper)
    own = change[shared:].reshape(-1, C)
    return replace(
        optics,
        paper=np.maximum(optics.paper + own[0], 0.05),
        transmittance=np.clip(optics.transmittance + own[1:], 0.0, 1.5),
    )
