"""Light that differs over the wall: closed forms."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from paxel_runtime.gamut_mapping import local_white, under_light
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel


def test_the_local_white_is_that_of_the_white_surface_and_one_where_nothing_was_seen(
    bw_model: Callable[[int], PredictionModel],
) -> None:
    model = bw_model(2)
    light = np.linspace(0.4, 1.1, 12).reshape(3, 4, 1)
    surfaces = [
        SurfaceModel((light[..., None] * surface.A).astype(np.float16), (light * surface.black).astype(np.float16))
        for surface in (model.pattern, model.white)
        if surface is not None
    ]
    surfaces[1].A[0, 0] = np.nan
    local = replace(model, pattern=surfaces[0], white=surfaces[1])
    shares = local_white(local, model)
    assert (shares[0, 0] == 1).all()
    np.testing.assert_allclose(shares[1:], np.repeat(light[1:], 3, axis=2), rtol=2e-3)  # float16: 11 bits


def test_light_multiplies_XYZ() -> None:
    rng = np.random.default_rng(0)
    Lab = np.stack([rng.uniform(0, 100, (5, 7)), *rng.normal(0, 20, (2, 5, 7))], axis=-1).astype(np.float32)
    shares = rng.uniform(0.3, 1.0, (5, 7, 3))
    lit = under_light(Lab, shares, D65_XYZ)
    np.testing.assert_allclose(Lab_to_XYZ(lit, D65_XYZ), shares * Lab_to_XYZ(Lab, D65_XYZ), atol=1e-6)  # float32
