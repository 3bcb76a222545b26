"""The colour-prediction model: XYZ_s = A_s x + b_s on each surface (Eqs. 1-4, with the black level).

``x`` are linear intensities in [0, 1]; **input x[i * N + j] is channel j on cluster i** (K clusters, N channels,
n = K N). ``A`` is (..., 3, n): (3, n) for the spectral model, (H, W, 3, n) for the image-based one.
Data and closed formulas only; how a model is measured stands in ``calibration.py``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.response import ProjectorResponse

__all__ = ["PredictionModel", "SurfaceModel"]


@dataclass(frozen=True, eq=False)
class SurfaceModel:
    """Colour of one surface as a linear function of the inputs.

    Attributes
    ----------
    A : (3, n) float64 array
        XYZ that each input adds at full intensity, Y = 1 for the white point.
    black : (3,) float64 array
        XYZ with every input at 0: the projector's black level and ambient light.
    """

    A: NDArray[np.float64]
    black: NDArray[np.float64]

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
    """

    channels: tuple[str, ...]
    clusters: tuple[str, ...]
    pattern: SurfaceModel
    white: SurfaceModel | None
    white_point: NDArray[np.float64]
    response: ProjectorResponse

    def __post_init__(self) -> None:
        for name, surface in (("pattern", self.pattern), ("white", self.white)):
            if surface is not None and surface.A.shape[-1] != self.n:
                raise InputError(
                    f"model: surfaces.{name}.A must have {self.n} columns "
                    f"({len(self.clusters)} clusters x {len(self.channels)} channels), got {surface.A.shape[-1]}"
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

    def predict(self, x: ArrayLike) -> tuple[NDArray[np.floating], NDArray[np.floating] | None]:
        """CIELAB on the pattern and on the white surface.

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
        Lab_pattern = XYZ_to_Lab(self.pattern.predict_XYZ(x), self.white_point)
        if self.white is None:
            return Lab_pattern, None
        return Lab_pattern, XYZ_to_Lab(self.white.predict_XYZ(x), self.white_point)
