"""The regression behind the correction: its weights are dE00, its left-out residuals those of refitting without."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.calibration.ridge import dE00_roots, fit_ridge
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00


@given(st.integers(0, 99))
def test_the_root_of_the_metric_measures_small_steps_in_dE00(seed: int) -> None:
    rng = np.random.default_rng(seed)
    XYZ = rng.uniform(0.05, 1.0, 3) * D65_XYZ
    step = 1e-4 * rng.standard_normal(3)
    expected = dE00(XYZ_to_Lab(XYZ, D65_XYZ), XYZ_to_Lab(XYZ + step, D65_XYZ))
    found = np.linalg.norm(dE00_roots(XYZ, D65_XYZ) @ step)
    # 2 %: dE00 is quadratic only to first order of the step, most of all near the gray axis
    assert found == pytest.approx(expected, rel=0.02, abs=1e-3)


@given(st.integers(0, 30), st.sampled_from([1e-3, 0.1]), st.sampled_from([0, 4]))
def test_left_out_residuals_are_those_of_a_fit_without_the_reading(seed: int, ridge: float, q: int) -> None:
    rng = np.random.default_rng(seed)
    T, m = 9, 3
    terms, spline = rng.standard_normal((T, m)), rng.standard_normal((T, q))
    XYZ, roots = rng.standard_normal((T, 3)), rng.standard_normal((T, 3, 3)) + 2 * np.eye(3)
    _, left_out = fit_ridge(terms, spline, XYZ, roots, ridge, 0.5)

    functions = np.hstack([terms, spline])
    design = np.einsum("tij,tm->timj", roots, functions)
    squares = np.mean(design.reshape(3 * T, m + q, 3) ** 2, axis=0)
    squares[m:] = squares[m:].sum(axis=0) / 0.25
    penalty = ridge * T * np.diag(squares.ravel())  # the scaling that the whole set defines
    for t in range(T):
        keep = np.arange(T) != t
        D = design[keep].reshape(3 * (T - 1), -1)
        y = np.einsum("tij,tj->ti", roots[keep], XYZ[keep]).ravel()
        C = np.linalg.solve(D.T @ D + penalty, D.T @ y).reshape(m + q, 3)
        assert left_out[t] == pytest.approx(XYZ[t] - functions[t] @ C, rel=1e-6, abs=1e-8)


def test_without_a_ridge_an_exact_law_is_found() -> None:
    rng = np.random.default_rng(0)
    terms, C = rng.standard_normal((20, 4)), rng.standard_normal((3, 4))
    roots = rng.standard_normal((20, 3, 3)) + 2 * np.eye(3)
    found, left_out = fit_ridge(terms, np.empty((20, 0)), terms @ C.T, roots, 1e-12, 1.0)
    assert found == pytest.approx(C, abs=1e-6)  # the ridge of 1e-12 is all that keeps it from 1e-12
    assert np.abs(left_out).max() < 1e-5
