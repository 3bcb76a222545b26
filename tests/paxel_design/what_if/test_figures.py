"""Contrast and volume of a model, against the figures that `paxel gamut` and `paxel advise` give."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from paxel_design.advice import effect_size
from paxel_design.gamut import gamut_mesh, sub_gamut
from paxel_design.what_if.figures import Room, common_range, room_of
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.effects import Full
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse


@pytest.mark.parametrize("K", [2, 3])
def test_two_surfaces_have_the_figures_of_an_advice(bw_model: Callable[[int], PredictionModel], K: int) -> None:
    room, effect = room_of(bw_model(K)), effect_size(bw_model(K))
    assert effect.volume_pattern is not None
    assert effect.volume_white is not None
    assert room.contrast == pytest.approx(effect.lightness, rel=1e-9)
    # coarser triangles of the same bodies
    assert room.volume == pytest.approx(np.sqrt(effect.volume_pattern * effect.volume_white), rel=2e-3)


def test_one_surface_has_its_grays_and_its_gamut(bw_model: Callable[[int], PredictionModel]) -> None:
    model = bw_model(2).alone("white")
    room = room_of(model)
    black_L = float(XYZ_to_Lab(model.pattern.black, model.white_point)[0])
    assert room.contrast == pytest.approx(100 - black_L, abs=1e-6)
    assert room.volume == pytest.approx(gamut_mesh(sub_gamut(model, Full())).volume, rel=2e-3)


def test_surfaces_without_common_grays_have_no_room(bw_model: Callable[[int], PredictionModel]) -> None:
    model = bw_model(2)
    assert model.white is not None
    # one cluster alone: both surfaces always show the same, in proportion
    one = replace(
        model,
        clusters=("black",),
        pattern=SurfaceModel(model.pattern.A[:, :3], model.pattern.black),
        white=SurfaceModel(model.white.A[:, :3], model.white.black),
    )
    assert room_of(one) == Room(0.0, 0.0)
    assert common_range(one) is None


def test_colours_in_a_plane_have_no_room(bw_model: Callable[[int], PredictionModel]) -> None:
    model = bw_model(2).alone("pattern")
    gray = replace(
        model,
        channels=("white",),
        pattern=SurfaceModel(np.outer(model.white_point, [0.1, 0.9]), np.zeros(3)),
        response=ProjectorResponse((np.linspace(0, 1, 2),), (np.linspace(0, 1, 2),)),
    )
    assert room_of(gray) == Room(0.0, 0.0)
