"""The small linear programmes against HiGHS."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from paxel_design.gamut.boxed_lp import INFEASIBLE, OPTIMAL, STALLED, solve_boxed_lp


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(0, 18), st.floats(0, 1), st.booleans())
def test_optimum_and_feasibility_are_those_of_highs(seed: int, r: int, more: int, reach: float, ties: bool) -> None:
    rng = np.random.default_rng(seed)
    m = r + more
    columns = np.round(rng.uniform(-1, 1, (r, m)), 1 if ties else 15)
    lower = rng.uniform(-1, 0, m)
    upper = lower + rng.choice([0.5, 1.0, 100.0], m)
    # From the middle of the box outwards, so that some have an answer and some do not.
    middle = (lower + upper) / 2 + reach * rng.uniform(-1, 1, m) * (upper - lower)
    rhs, cost = columns @ middle, np.round(rng.standard_normal(m), 1 if ties else 15)
    status, v, worth = solve_boxed_lp(columns, rhs, cost, lower, upper)
    expected = linprog(-cost, A_eq=columns, b_eq=rhs, bounds=np.stack((lower, upper), axis=1), method="highs")
    if np.linalg.matrix_rank(columns, tol=1e-8) < r:
        assert status in (STALLED, INFEASIBLE)
        return
    assert status == (OPTIMAL if expected.status == 0 else INFEASIBLE)
    if status == OPTIMAL:
        # 1e-7: what HiGHS keeps its constraints to, times the numbers in here.
        assert cost @ v == pytest.approx(-expected.fun, abs=1e-6, rel=1e-6)
        np.testing.assert_allclose(columns @ v, rhs, atol=1e-8)
        assert np.all((v >= lower) & (v <= upper))
        # Strong duality: what the rows are worth, and what the bounds are beyond that, make up the optimum.
        beyond = cost - worth @ columns
        bounds = np.where(beyond > 0, upper, lower) @ beyond
        assert worth @ rhs + bounds == pytest.approx(cost @ v, abs=1e-6, rel=1e-6)


def test_rows_that_depend_on_each_other_are_told() -> None:
    columns = np.array([[1.0, 2, 3], [2, 4, 6]])
    status, _, _ = solve_boxed_lp(columns, np.ones(2), np.ones(3), np.zeros(3), np.ones(3))
    assert status == STALLED
