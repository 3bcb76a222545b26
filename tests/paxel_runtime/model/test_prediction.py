"""The prediction model is linear in x, and response curves are monotone and inverted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
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
