"""The colour-prediction model: XYZ_s = A_s x + b_s on each surface (Eqs. 1-4, with the black level), and a correction.

``x`` are linear intensities in [0, 1]; **input x[i * N + j] is channel j on cluster i** (K clusters, N channels,
n = K N). ``A`` is (..., 3, n): (3, n) for the spectral model, (H, W, 3, n) for the image-based one. A measured
`Correction` may add what light does beyond that; gamuts and solvers build on the linear part.
Data and closed formulas only; how a model is measured stands in ``calibration/``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.correction import Correction
from paxel_runtime.model.response import ProjectorResponse

__all__ = ["PredictionModel", "SurfaceModel"]


@dataclass(frozen=True, eq=False)
class SurfaceModel:
    """Colour of one surface as a linear function of the inputs.

    Attributes
    ----------
    A : (3, n) float64 array, or (H, W, 3, n) of any float type
        XYZ that each input adds at full intensity, Y = 1 for the white point.
    black : (3,) float64 array, or (H, W, 3)
        XYZ with every input at 0: the projector's black level and ambient light.
    """

    A: NDArray[np.floating]
    black: NDArray[np.floating]

    def __post_init__(self) -> None:
        if self.A.shape[-2] != 3 or self.black.shape[-1] != 3:
            raise InputError(f"a surface needs A (3, n) and black (3,), got {self.A.shape} and {self.black.shape}")

    def predict_XYZ(self, x: ArrayLike) -> NDArray[np.floating]:
        """(..., 3) XYZ = A x + black for linear inputs x (..., n) (Eqs. 3 and 4)."""
        return np.einsum("...cn,...n->...c", self.A, np.asarray(x)) + self.black


@dataclass(frozen=True, eq=False)
class PredictionModel:
    """What a calibrated installation shows for any input.

    Attributes
    ----------
    channels, clusters : tuple of str
        Names, N and K of them; input ``x[i * N + j]`` is channel j on cluster i.
    pattern : SurfaceModel
        The printed pattern.
    white : SurfaceModel or None
        The second surface; None where there is one surface (monochrome to colour).
    white_point : (3,) float64 array
        XYZ of full white on the white paper, Y = 1; the reference of every CIELAB value.
    response : ProjectorResponse
        Device values P <-> linear x of each channel.
    correction : Correction, optional
        What the surfaces show beyond A x + black, where that was measured; `predict` and `predict_XYZ` contain it,
        `pattern` and `white` do not.
    """

    channels: tuple[str, ...]
    clusters: tuple[str, ...]
    pattern: SurfaceModel
    white: SurfaceModel | None
    white_point: NDArray[np.float64]
    response: ProjectorResponse
    correction: Correction | None = None

    def __post_init__(self) -> None:
        for name, surface in (("pattern", self.pattern), ("white", self.white)):
            if surface is not None and surface.A.shape[-1] != self.n:
                raise InputError(
                    f"model: surfaces.{name}.A must have {self.n} columns "
                    f"({len(self.clusters)} clusters x {len(self.channels)} channels), got {surface.A.shape[-1]}"
                )
        c, surfaces = self.correction, len(self.surfaces)
        if c is not None and (c.n, c.surfaces) != (self.n, surfaces):
            raise InputError(
                f"model: the correction must have {self.n} inputs and {surfaces} surface(s), got {c.n} and {c.surfaces}"
            )

    @property
    def n(self) -> int:
        """Number of inputs, K N."""
        return len(self.clusters) * len(self.channels)

    @property
    def surfaces(self) -> dict[str, SurfaceModel]:
        """The surfaces that exist, by name, the pattern first."""
        both = {"pattern": self.pattern, "white": self.white}
        return {name: surface for name, surface in both.items() if surface is not None}

    @property
    def linear(self) -> PredictionModel:
        """The same model without its correction."""
        return replace(self, correction=None)

    def alone(self, surface: str) -> PredictionModel:
        """The same model with one of its surfaces, as if it were the pattern."""
        correction = self.correction
        if correction is not None:
            correction = correction.alone(list(self.surfaces).index(surface))
        return replace(self, pattern=self.surfaces[surface], white=None, correction=correction)

    def at(self, index: Any) -> PredictionModel:
        """The model of some pixels: A[index] and black[index], in memory as float64, where the model is image-based.

        Parameters
        ----------
        index : numpy index of pixels
            Such as ``(row, column)``, ``(slice(0, 64), slice(None))`` or ``(rows, columns)`` arrays. A spectral model
            is the same everywhere.
        """

        def local(surface: SurfaceModel) -> SurfaceModel:
            if surface.A.ndim == 2:
                return surface
            return SurfaceModel(np.asarray(surface.A[index], np.float64), np.asarray(surface.black[index], np.float64))

        return replace(self, pattern=local(self.pattern), white=None if self.white is None else local(self.white))

    def predict_XYZ(self, x: ArrayLike) -> tuple[NDArray[np.floating], NDArray[np.floating] | None]:
        """XYZ on the pattern and on the white surface (None where there is one), with the correction.

        Parameters
        ----------
        x : (..., n) array
            Linear intensities, 0..1.
        """
        XYZ = [surface.predict_XYZ(x) for surface in self.surfaces.values()]
        if self.correction is not None:
            XYZ = [linear + more for linear, more in zip(XYZ, np.moveaxis(self.correction.XYZ(x), -2, 0), strict=True)]
        return XYZ[0], XYZ[1] if len(XYZ) > 1 else None

    def predict_XYZ_and_jacobian(self, x: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """All surfaces at once, with the correction: what a solver that polishes an answer needs.

        Parameters
        ----------
        x : (..., n) array

        Returns
        -------
        XYZ : (..., S, 3) float64 array
            The pattern first; S = 1 or 2.
        J : (..., S, 3, n) float64 array
            Derivatives by the inputs.
        """
        surfaces = list(self.surfaces.values())
        XYZ = np.stack([np.asarray(s.predict_XYZ(x), np.float64) for s in surfaces], axis=-2)
        J = np.stack([np.asarray(s.A, np.float64) for s in surfaces], axis=-3)
        J = np.broadcast_to(J, (*XYZ.shape, self.n))
        if self.correction is None:
            return XYZ, J
        more, slopes = self.correction.XYZ_and_jacobian(x)
        return XYZ + more, J + slopes

    def predict(self, x: ArrayLike) -> tuple[NDArray[np.floating], NDArray[np.floating] | None]:
        """CIELAB on the pattern and on the white surface, with the correction.

        Parameters
        ----------
        x : (..., n) array
            Linear intensities, 0..1.

        Returns
        -------
        Lab_pattern : (..., 3) array
        Lab_white : (..., 3) array or None
            None where the model has one surface.
        """
        XYZ_pattern, XYZ_white = self.predict_XYZ(x)
        Lab_pattern = XYZ_to_Lab(XYZ_pattern, self.white_point)
        return Lab_pattern, None if XYZ_white is None else XYZ_to_Lab(XYZ_white, self.white_point)
