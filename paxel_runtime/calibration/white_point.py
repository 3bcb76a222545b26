"""The white of a scene that has no white surface: what all clusters at full give, or a chromaticity of one's choice.

With one surface nothing in the scene says what white is (design: section 4). Full light on every cluster is the
default; its tint is that of the inks' areas. Another chromaticity makes neutral pictures that colour, at the greatest
luminance that the inputs reach with it. Pure functions of a model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = ["WHITES", "brightest_of_chromaticity", "with_white_point"]

WHITES: dict[str, tuple[float, float]] = {"D50": (0.34567, 0.35850), "D65": (0.31272, 0.32903)}
"""Chromaticities (x, y) of the CIE 1931 observer by name."""


def brightest_of_chromaticity(model: PredictionModel, xy: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The brightest light of a chromaticity on the pattern, and the inputs that give it.

    A linear programme: the largest t with A x + black = t c and 0 <= x <= 1, c being the XYZ of the chromaticity. Among
    the solutions of more than three inputs any one is returned.

    Parameters
    ----------
    model : PredictionModel
    xy : (2,) array
        CIE 1931 chromaticity.

    Returns
    -------
    XYZ : (3,) float64 array
        In the model's scale.
    x : (n,) float64 array
        Linear intensities; those at 1 limit it.

    Raises
    ------
    CalibrationError
        If the pattern cannot show that chromaticity.
    """
    A, black = np.asarray(model.pattern.A, np.float64), np.asarray(model.pattern.black, np.float64)
    x, y = np.asarray(xy, np.float64)
    direction = np.array([x / y, 1.0, (1.0 - x - y) / y])
    found = linprog(
        np.append(np.zeros(model.n), -1.0),
        A_eq=np.column_stack([A, -direction]),
        b_eq=-black,
        bounds=[(0, 1)] * model.n + [(0, None)],
        method="highs",
    )
    if not found.success or found.x[-1] <= float(black[1]):
        raise CalibrationError(
            f"model.white must be a chromaticity that the pattern can show, got {x:.4g}, {y:.4g}: it lies outside the "
            'triangle of its inks; take "full", or one nearer to them'
        )
    return found.x[-1] * direction, found.x[:-1]


def with_white_point(model: PredictionModel, XYZ: ArrayLike) -> PredictionModel:
    """The same model under another white: all XYZ over its Y, so that Y = 1 for the new white point.

    Parameters
    ----------
    XYZ : (3,) array
        The new white in the model's present scale.
    """
    white = np.asarray(XYZ, np.float64)

    def scaled(surface: SurfaceModel) -> SurfaceModel:
        return SurfaceModel(surface.A / white[1], surface.black / white[1])

    correction = model.correction
    if correction is not None:
        correction = replace(
            correction, coefficients=correction.coefficients / white[1], weights=correction.weights / white[1]
        )
    return replace(
        model,
        pattern=scaled(model.pattern),
        white=None if model.white is None else scaled(model.white),
        white_point=white / white[1],
        correction=correction,
    )
