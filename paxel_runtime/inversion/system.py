"""The equations of an inversion: the model as the kernels want it, for all pixels or for a chunk of them.

Checks the model and what is asked of it, before any work. Knows surfaces, weights and A; no wanted colour.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.correction import Correction
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = ["System", "systems"]


@dataclass(frozen=True, eq=False)
class System:
    """6 equations, those of an absent surface zero.

    Attributes
    ----------
    surfaces : (0,) or (0, 1)
        One or two; the kernels are compiled for each.
    AT : (n, 6) or (pixels, n, 6) float64 array
        A transposed; each pixel's own in a chunk of an image-based model.
    black : (6,) or (pixels, 6) float64 array
        XYZ of both surfaces at x = 0.
    white : (3,) float64 array
        White point.
    weights : (2,) float64 array
        Of dE^2 on the surfaces; their mean over those that exist is 1.
    euclidean : bool
        dE76 instead of dE00.
    right_inverse : (n, 6) float64 array or None
        Of A; None where A has no full row rank, so that there are XYZ that no x gives, and for image-based models.
    correction : Correction or None
    """

    surfaces: tuple[int, ...]
    AT: NDArray[np.float64]
    black: NDArray[np.float64]
    white: NDArray[np.float64]
    weights: NDArray[np.float64]
    euclidean: bool
    right_inverse: NDArray[np.float64] | None
    correction: Correction | None

    @property
    def n(self) -> int:
        """Number of inputs."""
        return self.AT.shape[-2]

    @property
    def is_unique(self) -> bool:
        """Whether a colour pair has one x at most: then one outside the box means out of gamut."""
        return self.right_inverse is not None and len(self.AT) == 3 * len(self.surfaces)

    def of(self, pixels: NDArray[np.int64]) -> System:
        """The system of some pixels of the chunk."""
        if self.AT.ndim == 2:
            return self
        return replace(self, AT=self.AT[pixels], black=self.black[pixels])


def systems(
    model: PredictionModel, two: bool, weights: tuple[float, float], metric: str, shape: tuple[int, ...]
) -> Callable[[slice], System]:
    """The system of a chunk of pixels: one for all, or each pixel's own, read as it is asked for.

    Parameters
    ----------
    model : PredictionModel
    two : bool
        Whether a colour on the white surface is wanted too.
    weights, metric
        Those of `invert`.
    shape : tuple of int
        Leading shape of the pictures, which an image-based model must have.

    Returns
    -------
    callable
        ``slice of pixels -> System``.

    Raises
    ------
    InputError
        As `invert` does.
    """
    if two and model.white is None:
        raise InputError("invert: the model has one surface; give Lab_white = None, or a model with a white surface")
    surfaces = [surface for surface in (model.pattern, model.white if two else None) if surface is not None]
    white = np.asarray(model.white_point, np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or not np.all(white > 0):
        raise InputError(f"invert: the model's white_point must be 3 positive XYZ values, got {model.white_point}")
    if len(weights) != 2 or not all(np.isfinite(w) and w > 0 for w in weights):
        raise InputError(f"invert: weights must be two numbers > 0, got {weights}")
    if metric not in ("dE00", "dE76"):
        raise InputError(f"invert: metric must be dE00 or dE76, got {metric!r}")
    euclidean = metric == "dE76"
    share = np.array(weights[: len(surfaces)] + (1.0,) * (2 - len(surfaces)), np.float64)
    share /= share[: len(surfaces)].mean()
    if surfaces[0].A.ndim > 2:
        return _local_systems(model, surfaces, white, share, euclidean, shape)
    AT, black = _equations([surface.A for surface in surfaces], [surface.black for surface in surfaces])
    if not (np.isfinite(AT).all() and np.isfinite(black).all()):
        raise InputError("invert: the model's A and black must be finite; calibrate anew: paxel calibrate --force")
    rows = 3 * len(surfaces)
    # Below 1e-6 of the largest singular value A is singular for measured data, and a linear solve is not exact.
    singular_values = np.linalg.svd(AT[:, :rows], compute_uv=False)
    inverse = None
    if model.n >= rows and singular_values[-1] > 1e-6 * singular_values[0]:
        inverse = np.zeros((model.n, 6))
        inverse[:, :rows] = np.linalg.pinv(AT[:, :rows].T)
    system = System(tuple(range(len(surfaces))), AT, black, white, share, euclidean, inverse, model.correction)
    return lambda chunk: system


def _local_systems(
    model: PredictionModel,
    surfaces: list[SurfaceModel],
    white: NDArray[np.float64],
    share: NDArray[np.float64],
    euclidean: bool,
    shape: tuple[int, ...],
) -> Callable[[slice], System]:
    """Each pixel's own equations, a chunk at a time; A may be memory-mapped."""
    for name, surface in zip(("pattern", "white"), surfaces, strict=False):
        if surface.A.shape[:-2] != shape:
            raise InputError(
                f"invert: an image-based model of {surface.A.shape[:-2]} pixels ({name}) needs pictures of that size, "
                f"got {shape}"
            )
    A = [surface.A.reshape(-1, 3, model.n) for surface in surfaces]
    dark = [np.broadcast_to(surface.black, (*shape, 3)).reshape(-1, 3) for surface in surfaces]

    def system_of(chunk: slice) -> System:
        AT, black = _equations([a[chunk] for a in A], [b[chunk] for b in dark])
        # where the camera saw nothing no light arrives: x stays in the middle
        unseen = ~(np.isfinite(AT).all(axis=(1, 2)) & np.isfinite(black).all(axis=1))
        AT[unseen], black[unseen] = 0.0, 0.0
        return System(tuple(range(len(surfaces))), AT, black, white, share, euclidean, None, model.correction)

    return system_of


def _equations(
    A: list[NDArray[np.floating]], black: list[NDArray[np.floating]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A^T (..., n, 6) and black (..., 6) of both surfaces, zero where there is none."""
    *pixels, _, n = A[0].shape
    AT, dark = np.zeros((*pixels, n, 6)), np.zeros((*pixels, 6))
    for s, (a, b) in enumerate(zip(A, black, strict=True)):
        AT[..., 3 * s : 3 * s + 3] = np.swapaxes(a, -1, -2)
        dark[..., 3 * s : 3 * s + 3] = b
    return AT, dark
