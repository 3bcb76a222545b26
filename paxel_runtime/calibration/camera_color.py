"""A camera's values to XYZ: scaled to the meter's readings, taken for an RGB space, or by a device matrix (IV-C2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.calibration.cluster_pictures import NodalImages, Window
from paxel_runtime.calibration.ridge import dE00_roots
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = [
    "CAMERA_MATRICES",
    "CameraToXYZ",
    "camera_to_XYZ",
    "fit_device_matrix",
    "sensitivity_matrix",
    "spot_of_meter",
]

_LEAST_LIGHT, _LEAST_BLACK = 2e-3, 1e-5
"""Camera values as shares of full white under which an input, or the black level, is not told from noise."""

_ADOBE_RGB_TO_XYZ = np.array(
    [
        [0.5766690429101305, 0.1855582379065463, 0.1882286462349947],
        [0.2973449752505360, 0.6273635662554661, 0.0752914584939978],
        [0.0270313613864123, 0.0706888525358272, 0.9913375368376388],
    ]
)
"""AdobeRGB (1998), linear, D65, to XYZ (Adobe RGB specification, version 2005-05, section 4.3.5.3)."""

CAMERA_MATRICES: dict[str, NDArray[np.floating] | None] = {
    "readings": None,
    "sRGB": linear_sRGB_to_XYZ(np.eye(3)).T,
    "AdobeRGB": _ADOBE_RGB_TO_XYZ,
}
"""How camera values become XYZ: scaled to the meter's readings of the same clusters at its spot, or taken for a colour
space's linear values, as the paper does (IV-C2)."""


def spot_of_meter(shape: tuple[int, int], diameter_px: float) -> tuple[Window, NDArray[np.float64]]:
    """The disc in the middle of the frame that the meter reads: a window of the frame, and weights in it, sum 1."""
    rows, columns = (np.arange(size) - (size - 1) / 2 for size in shape)
    inside = np.hypot(rows[:, None], columns) <= max(diameter_px / 2, 1.0)
    window = (_span(inside.any(axis=1)), _span(inside.any(axis=0)))
    return window, inside[window] / np.count_nonzero(inside)


def _span(flags: NDArray[np.bool_]) -> slice:
    places = np.flatnonzero(flags)
    return slice(int(places[0]), int(places[-1]) + 1)


@dataclass(frozen=True, eq=False)
class CameraToXYZ:
    """How camera values become XYZ, Y = 1 for full white on white paper at the meter's spot.

    Attributes
    ----------
    inputs : dict of surface -> (n, 3, planes) array
        A matrix for each input.
    black : dict of surface -> (N, 3, planes) array
        One for each channel's dark picture; the black level is their sum.
    spot : dict of surface -> SurfaceModel
        What they make of the mean over the spot.
    white_point : (3,) array
    """

    inputs: dict[str, NDArray[np.float64]]
    black: dict[str, NDArray[np.float64]]
    spot: dict[str, SurfaceModel]
    white_point: NDArray[np.float64]


def camera_to_XYZ(
    images: NodalImages,
    method: str | NDArray[np.floating],
    spot: tuple[Window, NDArray[np.float64]],
    model: PredictionModel | None = None,
) -> CameraToXYZ:
    """Fit the conversion of camera values to the mean over the meter's spot.

    Parameters
    ----------
    method : str, or (3, 3) or (3, N) array
        A name in `CAMERA_MATRICES`, or a matrix of your own (such as `fit_device_matrix` makes). Under "readings" the
        mean over the spot becomes the spectral model's A there: the meter tells the colours and the camera where they
        are. A colour space has its white where white paper is under full white. Where pictures have one plane, column
        j of a matrix is the XYZ of channel j at full on white paper; a matrix of your own is scaled to Y = 1 there.
    spot : (window, weights)
        From `spot_of_meter`.
    model : PredictionModel, optional
        The spectral model; for "readings".

    Raises
    ------
    InputError
        If the method is unknown, or the matrix does not fit the pictures.
    CalibrationError
        If a picture is not in the plan, or a channel gives no light.
    """
    if isinstance(method, str) and method not in CAMERA_MATRICES:
        raise InputError(f"model.camera_to_XYZ must be one of {', '.join(CAMERA_MATRICES)}, got {method!r}")
    K, N = len(images.clusters), len(images.channels)
    (window, weights), surfaces = spot, [s for s in ("pattern", "white") if _has(images, s)]

    def mean(nodal: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.einsum("uv,uvp->p", weights, nodal, dtype=np.float64)

    light = {s: np.array([mean(images.light(s, i, j, window)) for i in range(K) for j in range(N)]) for s in surfaces}
    dark = {s: np.array([mean(images.dark(s, j, window)) for j in range(N)]) for s in surfaces}
    # each channel on all clusters of the brightest sheet there is, and what is left without light
    full, left = light[surfaces[-1]].reshape(K, N, -1).sum(axis=0), dark[surfaces[-1]]
    if any(e.surface == "paper" and e.device == "camera" for e in images.plan):
        full = np.array([mean(images.full("paper", j, window)) for j in range(N)])
        left = np.array([mean(images.dark("paper", j, window)) for j in range(N)])
    if not np.all(full.sum(axis=1) > 0):
        dead = images.channels[int(np.argmin(full.sum(axis=1)))]
        raise CalibrationError(f"the camera sees no {dead} light at the meter's spot; run: paxel capture --force")
    space = CAMERA_MATRICES[method] if isinstance(method, str) else method
    if space is None:
        if model is None:
            raise InputError('model.camera_to_XYZ = "readings" needs the spectral model of this installation')
        own, each = model.surfaces, np.tile(full, (K, 1))
        inputs = {s: _scaled(own[s].A.T, light[s], _LEAST_LIGHT * each) for s in surfaces}
        black = {s: _scaled(np.broadcast_to(own[s].black / N, (N, 3)), dark[s], _LEAST_BLACK * full) for s in surfaces}
        white_point = model.white_point
    else:
        matrices = _space_matrices(np.asarray(space, np.float64), full + left / N)
        if not isinstance(method, str):
            matrices = matrices / np.einsum("jcp,jp->c", matrices, full + left / N)[1]
        inputs = {s: np.tile(matrices, (K, 1, 1)) for s in surfaces}
        black = dict.fromkeys(surfaces, matrices / N)
        white_point = np.einsum("jcp,jp->c", matrices, full + left / N)
    at_spot = {
        s: SurfaceModel(A=np.einsum("kcp,kp->ck", inputs[s], light[s]), black=np.einsum("jcp,jp->c", black[s], dark[s]))
        for s in surfaces
    }
    return CameraToXYZ(inputs, black, at_spot, white_point)


def _has(images: NodalImages, surface: str) -> bool:
    return any(e.device == "camera" and e.clusters and e.surface == surface for e in images.plan)


def _scaled(XYZ: NDArray[np.floating], values: NDArray[np.float64], least: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3, planes) matrices of rank one that take camera values (m, planes) to XYZ (m, 3).

    Values below `least` (m, planes) are noise: they are taken for less than their XYZ instead of being blown up.
    """
    energy = np.maximum(np.sum(values**2, axis=1), np.sum(least**2, axis=1))
    return XYZ[:, :, None] * (values / energy[:, None])[:, None, :]


def _space_matrices(space: NDArray[np.float64], white: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3, planes) from one matrix, for values of white paper under each channel (N, planes)."""
    N, planes = white.shape
    if planes == 1 and space.shape == (3, N):
        return (space / white[:, 0]).T[:, :, None]
    if planes == space.shape[1] == 3:
        return np.array(np.broadcast_to(space / white.sum(axis=0), (N, 3, 3)))
    raise InputError(
        f"pictures of {planes} plane(s) under {N} channel(s) need a matrix (3, {N if planes == 1 else planes}), "
        f'got {space.shape}; without one, set model.camera_to_XYZ = "readings"'
    )


def sensitivity_matrix(sensitivities: ArrayLike, light: ArrayLike, reflectances: ArrayLike) -> NDArray[np.float64]:
    """The device matrix that follows from a camera's spectral sensitivities, for some surfaces under the projector.

    Parameters
    ----------
    sensitivities : (planes, 81) array
        Relative, on `WAVELENGTHS_NM`.
    light : (81,) array
        Spectrum of the projector's full white.
    reflectances : (m, 81) array
        Of the surfaces that are to come out right, such as the pattern's inks and their mixtures.

    Returns
    -------
    (3, planes) float64 array
        For camera values and XYZ of which those of the perfect diffuser under that light are 1 and Y = 1.
    """
    S, lit = np.asarray(sensitivities, np.float64), np.asarray(reflectances, np.float64) * np.asarray(light)
    white = spectra_to_XYZ(light)
    camera_white = S @ np.asarray(light, np.float64)
    return fit_device_matrix(lit @ S.T / camera_white, spectra_to_XYZ(lit) / white[1], white / white[1])


def fit_device_matrix(camera: ArrayLike, XYZ: ArrayLike, white_point: ArrayLike) -> NDArray[np.float64]:
    """The matrix from a camera's linear values to XYZ with the least mean squared dE00 on some patches.

    Parameters
    ----------
    camera : (m, planes) array
        Linear values of m patches: measured, or integrals over the camera's spectral sensitivities.
    XYZ : (m, 3) array
        Their colours, Y = 1 for the white point.
    white_point : (3,) array

    Returns
    -------
    (3, planes) float64 array

    Raises
    ------
    InputError
        If there are fewer patches than planes, or their values do not tell the planes apart.
    """
    camera, XYZ = np.asarray(camera, np.float64), np.asarray(XYZ, np.float64)
    if camera.ndim != 2 or XYZ.shape != (len(camera), 3) or not np.all(np.isfinite(camera)):
        raise InputError(f"patches need camera (m, planes) and XYZ (m, 3), finite; got {camera.shape} and {XYZ.shape}")
    if np.linalg.matrix_rank(camera) < camera.shape[1]:
        raise InputError(
            f"{len(camera)} patches do not tell the camera's {camera.shape[1]} planes apart; "
            "measure patches of more different colours"
        )
    roots = dE00_roots(XYZ, white_point)
    design = np.einsum("tij,tp->tijp", roots, camera).reshape(3 * len(camera), -1)
    wanted = np.einsum("tij,tj->ti", roots, XYZ).ravel()
    return np.linalg.lstsq(design, wanted, rcond=None)[0].reshape(3, -1)
