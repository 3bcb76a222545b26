"""Models of other light and other sheets, exactly: what follows from the measured matrices by multiplication.

Ambient light, the projector's black and a neutral second sheet change XYZ = A x + b in closed form; nothing is
simulated here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = ["black_level", "with_black", "with_columns", "with_second_sheet"]


def black_level(model: PredictionModel) -> float:
    """Luminance with every input at 0 over that of full white: on the second surface, or on the only one."""
    surface = model.white or model.pattern
    return float(surface.black[1] / (surface.black[1] + surface.A[1].sum()))


def with_black(model: PredictionModel, factor: float = 1.0, ambient: float = 0.0) -> PredictionModel:
    """The model where light at input 0 is another: the measured times a factor, and more light from outside.

    Parameters
    ----------
    factor : float
        Of the measured black: what the projector leaks and what falls into the room cannot be told apart in it.
    ambient : float
        Light of the colour of full white that falls on everything besides, as a share of full white.

    Raises
    ------
    InputError
        If a number is negative.
    """
    if factor < 0 or ambient < 0:
        raise InputError(f"a black level needs factor >= 0 and ambient >= 0, got {factor} and {ambient}")

    def lit(surface: SurfaceModel) -> SurfaceModel:
        return SurfaceModel(surface.A, factor * surface.black + ambient * surface.A.sum(axis=-1))

    return _rescaled(model, {name: lit(surface) for name, surface in model.linear.surfaces.items()})


def with_second_sheet(model: PredictionModel, luminance: float) -> PredictionModel:
    """The model with a neutral second sheet that shows full white as this luminance, 1 being the white paper.

    Raises
    ------
    InputError
        If the model has one surface, or the luminance is not in 0..1.
    """
    if model.white is None or not 0 < luminance <= 1:
        raise InputError(f"another second sheet needs a model of two surfaces and a luminance 0..1, got {luminance}")
    sheet = model.white
    share = luminance / float(sheet.black[1] + sheet.A[1].sum())
    return replace(model.linear, white=SurfaceModel(sheet.A * share, sheet.black * share))


def with_columns(model: PredictionModel, factors: np.ndarray) -> PredictionModel:
    """The model whose pattern returns other shares of each input's light.

    Parameters
    ----------
    factors : array that multiplies A (3, n) of the pattern
        Black is multiplied by what becomes of all inputs together.
    """
    A = model.pattern.A * factors
    black = model.pattern.black * A.sum(axis=-1) / model.pattern.A.sum(axis=-1)
    if model.white is None:
        return _rescaled(model, {"pattern": SurfaceModel(A, black)})
    return replace(model.linear, pattern=SurfaceModel(A, black))


def _rescaled(model: PredictionModel, surfaces: dict[str, SurfaceModel]) -> PredictionModel:
    """The model with other surfaces, everything relative to the white paper, whose full white has Y = 1 again."""
    name = list(surfaces)[-1]
    before, after = model.surfaces[name], surfaces[name]
    full = before.A.sum(axis=-1) + before.black
    paper = model.white_point * (after.A.sum(axis=-1) + after.black) / full
    scaled = {key: SurfaceModel(s.A / paper[1], s.black / paper[1]) for key, s in surfaces.items()}
    return replace(model.linear, pattern=scaled["pattern"], white=scaled.get("white"), white_point=paper / paper[1])
