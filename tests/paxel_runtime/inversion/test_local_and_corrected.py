"""The inversion of image-based models (another A at each pixel) and of models with a measured correction."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.inversion import EXACT, invert
from paxel_runtime.model.correction import Correction, Term
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

Models = Callable[[int], PredictionModel]
SHAPE = (6, 40)


def _image_based(model: PredictionModel, spread: float, dtype: type = np.float64) -> PredictionModel:
    """The model with A and black dimmed towards one side, (H, W, 3, n)."""
    gain = np.linspace(1.0, 1.0 - spread, SHAPE[1])[None, :, None] * np.ones((SHAPE[0], 1, 1))

    def local(surface: SurfaceModel) -> SurfaceModel:
        return SurfaceModel((gain[..., None] * surface.A).astype(dtype), (gain * surface.black).astype(dtype))

    assert model.white is not None
    return dataclasses.replace(model, pattern=local(model.pattern), white=local(model.white))


def _wanted(model: PredictionModel, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Half of them colours of random inputs, half arbitrary."""
    rng = np.random.default_rng(seed)
    pair = model.predict(rng.random((*SHAPE, model.n)) * 0.7)
    assert pair[1] is not None
    for Lab, L in zip(pair, (40.0, 70.0), strict=True):
        Lab[: SHAPE[0] // 2] = rng.normal([L, 0, 0], [12, 15, 15], (SHAPE[0] // 2, SHAPE[1], 3))
    return pair[0], pair[1]


@pytest.mark.parametrize("K", [2, 3])
def test_one_A_everywhere_gives_the_answers_of_the_spectral_model(bw_model: Models, K: int) -> None:
    model = bw_model(K)
    wanted = _wanted(model, K)
    spectral, local = invert(*wanted, model), invert(*wanted, _image_based(model, 0.0))
    # 1e-6: exact colours are met to 1e-8 in XYZ by stage 2, times the condition of A
    np.testing.assert_allclose(local.x, spectral.x, atol=1e-6)
    np.testing.assert_array_equal(local.status, spectral.status)


def test_each_pixel_is_solved_with_its_own_A(bw_model: Models) -> None:
    local = _image_based(bw_model(3), 0.4)
    wanted = _wanted(bw_model(3), 7)
    result = invert(*wanted, local)
    for at in [(0, 0), (1, 13), (2, 39), (4, 5), (5, 39)]:
        own = invert(wanted[0][at], wanted[1][at], local.at(at))
        np.testing.assert_allclose(result.x[at], own.x, atol=1e-6)
        seen = local.at(at).predict(result.x[at])
        np.testing.assert_allclose(result.dE_pattern[at], dE00(seen[0], wanted[0][at]), atol=1e-9)
        np.testing.assert_allclose(result.dE_white[at], dE00(seen[1], wanted[1][at]), atol=1e-9)  # type: ignore[index]


def test_half_precision_fields_and_float32_pictures_are_read_as_they_are(bw_model: Models) -> None:
    model = _image_based(bw_model(2), 0.2, np.float16)
    pattern, white = (Lab.astype(np.float32) for Lab in _wanted(bw_model(2), 3))
    result = invert(pattern, white, model)
    assert result.x.dtype == np.float32
    assert np.isfinite(result.x).all()


def test_a_pixel_that_the_camera_did_not_see_keeps_the_picture_whole(bw_model: Models) -> None:
    model = _image_based(bw_model(2), 0.1)
    model.pattern.A[2, 3] = np.nan
    result = invert(*_wanted(bw_model(2), 1), model)
    assert np.isfinite(result.x).all()
    assert np.isfinite(result.dE_pattern).all()


def test_pictures_of_another_size_are_refused(bw_model: Models) -> None:
    Lab = np.full((4, 40, 3), 50.0)
    with pytest.raises(InputError, match="needs pictures of that size"):
        invert(Lab, Lab, _image_based(bw_model(2), 0.1))


def _corrected(model: PredictionModel, size: float) -> PredictionModel:
    """Channels of one cluster that take light from each other, and clusters that do: not in the linear model."""
    terms = (*(Term("product", j, j + 1) for j in range(model.n - 1)), Term("absolute", 0, 3))
    rng = np.random.default_rng(0)
    assert model.white is not None
    A = np.stack([model.pattern.A, model.white.A])
    rows = np.concatenate([A[..., :-1] * A[..., 1:] / A.sum(axis=-1, keepdims=True), A[..., :1]], axis=-1)
    coefficients = -size * rows * rng.uniform(0.5, 1.5, rows.shape)
    nothing = np.zeros((0, model.n)), np.zeros((2, 3, 0))
    return dataclasses.replace(model, correction=Correction(model.n, terms, coefficients, *nothing))


@pytest.mark.parametrize("K", [2, 3])
def test_colours_of_a_corrected_model_come_back(bw_model: Models, K: int) -> None:
    model = _corrected(bw_model(K), 0.3)
    x = np.random.default_rng(K).uniform(0.2, 0.8, (500, model.n))
    wanted = model.predict(x)
    plain, polished = invert(*wanted, model.linear), invert(*wanted, model)
    off = dE00(model.predict(plain.x)[0], wanted[0])
    assert np.mean(off) > 0.5, "without the correction the colours are off"
    assert polished.dE_white is not None
    assert np.quantile(np.maximum(polished.dE_pattern, polished.dE_white), 0.95) < 0.05
    assert np.mean(polished.status == EXACT) > 0.9
    np.testing.assert_allclose(polished.dE_pattern, dE00(model.predict(polished.x)[0], wanted[0]), atol=1e-9)


def test_polishing_never_makes_a_colour_worse(bw_model: Models) -> None:
    model = _corrected(bw_model(3), 0.1)
    wanted = _wanted(model, 9)
    plain, polished = invert(*wanted, model.linear), invert(*wanted, model)
    before = sum(dE00(seen, Lab) ** 2 for seen, Lab in zip(model.predict(plain.x), wanted, strict=True))
    assert polished.dE_white is not None
    after = polished.dE_pattern**2 + polished.dE_white**2
    assert np.all(after <= before + 1e-9)
    assert np.mean(after < before - 1e-4) > 0.5


def test_a_surface_alone_keeps_its_own_correction(bw_model: Models) -> None:
    model = _corrected(bw_model(2), 0.3)
    x = np.random.default_rng(4).uniform(0.2, 0.8, (50, model.n))
    both = model.predict(x)
    np.testing.assert_array_equal(model.alone("pattern").predict(x)[0], both[0])
    assert both[1] is not None
    np.testing.assert_array_equal(model.alone("white").predict(x)[0], both[1])
    found = invert(both[1], None, model.alone("white"))
    # 0.02: the polish stops at 0.01, and the last look is in the dtype of the answer
    assert np.quantile(found.dE_pattern, 0.95) < 0.02
