"""The prediction model is linear in x, and response curves are monotone and inverted."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.model.correction import Correction, Term
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

CODE = np.linspace(0, 1, 33)


def _response(gamma: float = 2.2) -> ProjectorResponse:
    return ProjectorResponse((CODE,) * 2, (CODE**gamma, CODE))


@given(st.floats(1.0, 3.0), st.integers(0, 99))
def test_response_and_inverse_undo_each_other(gamma: float, seed: int) -> None:
    response = _response(gamma)
    x = np.random.default_rng(seed).random((50, 2))
    # 3e-4: the curve bends inside a step of the 4097-entry table, most near 0
    assert response.P_to_x(response.x_to_P(x)) == pytest.approx(x, abs=3e-4)


def test_a_flat_start_is_inverted_to_a_code_that_gives_the_light() -> None:
    linear = np.maximum(0, (CODE - 0.2) / 0.8)
    response = ProjectorResponse((CODE,), (linear,))
    x = np.linspace(0, 1, 101)[:, None]
    assert response.P_to_x(response.x_to_P(x)) == pytest.approx(x, abs=1e-3)


def test_a_falling_curve_is_refused() -> None:
    with pytest.raises(InputError, match="without falling"):
        ProjectorResponse((CODE,), (np.where(CODE[5] == CODE, 0.9, CODE),))


@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 99))
def test_light_adds_up(K: int, N: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    surface = SurfaceModel(rng.random((3, K * N)), rng.random(3))
    a, b = rng.random((2, 7, K * N)) / 2
    both = surface.predict_XYZ(a + b) + surface.black
    assert both == pytest.approx(surface.predict_XYZ(a) + surface.predict_XYZ(b), abs=1e-12)


def test_one_equation_serves_the_spectral_and_the_image_based_model() -> None:
    rng = np.random.default_rng(0)
    A = rng.random((3, 6))
    x = rng.random((4, 5, 6))
    spectral = SurfaceModel(A, np.zeros(3)).predict_XYZ(x)
    image_based = SurfaceModel(np.broadcast_to(A, (4, 5, 3, 6)), np.zeros((4, 5, 3))).predict_XYZ(x)
    assert image_based == pytest.approx(spectral, abs=1e-12)


def test_full_white_is_100_0_0() -> None:
    A = np.random.default_rng(0).random((3, 2))
    white = SurfaceModel(A, np.full(3, 0.01))
    model = PredictionModel(("w",), ("a", "b"), white, None, A.sum(axis=1) + 0.01, ProjectorResponse((CODE,), (CODE,)))
    Lab, nothing = model.predict(np.ones(2))
    assert Lab == pytest.approx([100, 0, 0], abs=1e-9)
    assert nothing is None


def test_a_model_whose_columns_do_not_fit_is_refused() -> None:
    surface = SurfaceModel(np.ones((3, 5)), np.zeros(3))
    with pytest.raises(InputError, match=r"pattern\.A must have 6 columns \(2 clusters x 3 channels\), got 5"):
        PredictionModel(("r", "g", "b"), ("a", "b"), surface, None, np.ones(3), _response())


def _corrected(K: int, N: int, seed: int) -> PredictionModel:
    rng = np.random.default_rng(seed)
    n = K * N
    correction = Correction(
        n=n,
        terms=(Term("product", 0, n - 1), Term("absolute", 0, N)),
        coefficients=0.01 * rng.standard_normal((2, 3, 2)),
        centres=rng.random((2, n)),
        weights=0.01 * rng.standard_normal((2, 3, 2)),
    )
    surfaces = [SurfaceModel(rng.random((3, n)), rng.random(3)) for _ in range(2)]
    response = ProjectorResponse((CODE,) * N, (CODE,) * N)
    return PredictionModel(("r", "g"), ("a", "b"), surfaces[0], surfaces[1], np.ones(3), response, correction)


def test_a_correction_is_added_to_the_linear_prediction_and_left_out_of_its_surfaces() -> None:
    model, x = _corrected(2, 2, 0), np.random.default_rng(1).random((5, 4))
    assert model.correction is not None
    pattern, white = model.predict_XYZ(x)
    assert white is not None
    more = model.correction.XYZ(x)
    assert pattern == pytest.approx(model.pattern.predict_XYZ(x) + more[:, 0])
    assert white == pytest.approx(x @ model.surfaces["white"].A.T + model.surfaces["white"].black + more[:, 1])
    assert model.linear.correction is None
    assert model.linear.predict_XYZ(x)[0] == pytest.approx(model.pattern.predict_XYZ(x))


def test_the_jacobian_is_that_of_the_prediction() -> None:
    model, x = _corrected(2, 2, 2), np.random.default_rng(3).random(4)
    for m in (model, model.linear):
        XYZ, J = m.predict_XYZ_and_jacobian(x)
        assert pytest.approx(np.stack(m.predict_XYZ(x))) == XYZ  # type: ignore[arg-type]
        step = 1e-7 * np.eye(4)
        numeric = [(np.stack(m.predict_XYZ(x + h)) - np.stack(m.predict_XYZ(x - h))) / 2e-7 for h in step]  # type: ignore[arg-type]
        assert pytest.approx(np.moveaxis(numeric, 0, -1), abs=1e-6) == J  # central differences of smooth functions


def test_a_correction_of_another_size_is_refused() -> None:
    model = _corrected(2, 2, 0)
    with pytest.raises(InputError, match="4 inputs and 1 surface"):
        replace(model, white=None)


def test_an_image_based_model_gives_the_model_of_some_pixels() -> None:
    rng = np.random.default_rng(0)
    A, black = rng.random((4, 5, 3, 6)).astype(np.float16), rng.random((4, 5, 3)).astype(np.float16)
    model = PredictionModel(
        ("r", "g", "b"),
        ("a", "b"),
        SurfaceModel(A, black),
        None,
        np.ones(3),
        ProjectorResponse((CODE,) * 3, (CODE,) * 3),
    )
    rows, columns = np.array([0, 3]), np.array([1, 4])
    some = model.at((rows, columns))
    assert some.pattern.A.dtype == np.float64
    x = rng.random((2, 6))
    assert some.pattern.predict_XYZ(x) == pytest.approx(
        np.einsum("pcn,pn->pc", A[rows, columns].astype(float), x) + black[rows, columns]
    )
    assert model.at((slice(1, 3), slice(None))).pattern.A.shape == (2, 5, 3, 6)
    spectral = some.at((1,))
    assert pytest.approx(spectral.pattern.A) == spectral.at((0,)).pattern.A
