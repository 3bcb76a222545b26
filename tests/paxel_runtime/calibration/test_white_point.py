"""The white of one surface: brightest light of a chromaticity, and the model under it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.calibration.white_point import WHITES, brightest_of_chromaticity, with_white_point
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import D65_XYZ
from paxel_runtime.model.correction import Correction, Term
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

PRIMARIES = np.array([[0.40, 0.20, 0.18], [0.22, 0.62, 0.10], [0.03, 0.12, 0.95]]) / 0.94
LINE = np.linspace(0, 1, 3)


def one_surface(A: np.ndarray = PRIMARIES, black: float = 0.0, correction: Correction | None = None) -> PredictionModel:
    n = A.shape[1]
    return PredictionModel(
        channels=("uv",),
        clusters=tuple(f"ink-{i}" for i in range(n)),
        pattern=SurfaceModel(A, np.full(3, black)),
        white=None,
        white_point=A.sum(axis=1) + black,
        response=ProjectorResponse((LINE,), (LINE,)),
        correction=correction,
    )


def test_the_named_whites_are_the_illuminants() -> None:
    assert np.allclose(WHITES["D65"], (D65_XYZ / D65_XYZ.sum())[:2], atol=1e-4)  # both are rounded to 4-5 digits


@pytest.mark.parametrize("name", sorted(WHITES))
def test_three_primaries_give_the_closed_form(name: str) -> None:
    XYZ, x = brightest_of_chromaticity(one_surface(), WHITES[name])
    xy = np.array(WHITES[name])
    expected = np.linalg.solve(PRIMARIES, [xy[0] / xy[1], 1.0, (1 - xy.sum()) / xy[1]])
    assert np.allclose(x, expected / expected.max(), atol=1e-9)
    assert np.allclose(XYZ, PRIMARIES @ x, atol=1e-9)
    assert np.allclose(XYZ[:2] / XYZ.sum(), xy, atol=1e-9)


@given(st.lists(st.floats(0.05, 1), min_size=4, max_size=4), st.floats(0, 0.02))
def test_no_inputs_give_more_of_that_chromaticity(inputs: list[float], black: float) -> None:
    """Any reachable light is not brighter than the brightest of its own chromaticity."""
    A = np.column_stack([PRIMARIES, [0.3, 0.4, 0.1]])
    light = A @ np.array(inputs) + black
    XYZ, x = brightest_of_chromaticity(one_surface(A, black), light[:2] / light.sum())
    assert XYZ[1] >= light[1] - 1e-9
    assert x.min() >= -1e-9
    assert x.max() <= 1 + 1e-9
    assert np.allclose(A @ x + black, XYZ, atol=1e-8)


def test_a_colour_beyond_the_inks_is_no_white() -> None:
    with pytest.raises(CalibrationError, match=r"can show, got 0\.7, 0\.29"):
        brightest_of_chromaticity(one_surface(), (0.70, 0.29))


def test_another_white_is_another_scale_and_nothing_else() -> None:
    rng = np.random.default_rng(3)
    bent = Correction(3, (Term("product", 0, 1),), rng.random((1, 3, 1)), rng.random((2, 3)), rng.random((1, 3, 2)))
    model = one_surface(correction=bent)
    white = brightest_of_chromaticity(model, WHITES["D65"])[0]
    moved, x = with_white_point(model, white), rng.random((20, 3))
    assert np.allclose(moved.predict_XYZ(x)[0], model.predict_XYZ(x)[0] / white[1], atol=1e-12)
    assert moved.white_point[1] == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(with_white_point(moved, model.white_point / white[1]).pattern.A, model.pattern.A)
