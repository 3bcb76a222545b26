"""The quadratic programme of three inputs against scipy's, lane by lane."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from paxel_runtime.inversion import box_qp
from paxel_runtime.inversion.lanes import LANES
from paxel_runtime.inversion.three_inputs import solve_three_inputs

Floats = NDArray[np.float64]


@njit
def _solve_in_lanes(w: Floats, u: Floats, AT: Floats) -> None:
    solve_three_inputs(w, u, AT)  # has no wrapper of its own for callers outside of numba


def _solve(A: Floats, z: Floats, S: Floats, start: Floats) -> tuple[Floats, Floats, Floats]:
    """x (LANES, 3), the multipliers (LANES, 3) and the done flags for z (LANES, 3) and S (LANES, 3, 3)."""
    w, u = np.zeros(box_qp.ROWS * LANES), start.T.ravel().copy()
    w[box_qp.Z : box_qp.Z + 3 * LANES] = z.T.ravel()
    w[box_qp.S_FIRST : box_qp.S_FIRST + 3 * LANES] = S[:, 0].T.ravel()
    w[box_qp.S_REST : box_qp.S_REST + 3 * LANES] = S[:, [1, 1, 2], [1, 2, 2]].T.ravel()
    AT = np.zeros((3, 6))
    AT[:, :3] = A.T
    for _ in range(60):  # as its caller does: nearly parallel columns of A take many rounds
        _solve_in_lanes(w, u, AT)
        if np.all(w[box_qp.DONE : box_qp.DONE + LANES] == 1.0):
            break
    nu = w[box_qp.NU : box_qp.NU + 3 * LANES].reshape(3, LANES).T
    return u.reshape(3, LANES).T, nu, w[box_qp.DONE : box_qp.DONE + LANES]


@pytest.mark.parametrize("compliance", [1e-2, 1e-6])
@pytest.mark.parametrize("seed", range(6))
def test_agrees_with_scipy_from_any_start(compliance: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.uniform(0.0, 1.0, (3, 3)) / 3
    z = rng.uniform(-0.5, 1.5, (LANES, 3)) @ A.T
    roots = rng.normal(size=(LANES, 3, 3))
    S = compliance * (roots @ roots.swapaxes(-1, -2) + 0.1 * np.eye(3))
    # corners, which the first descent has to leave, and points inside
    start = np.where(rng.random((LANES, 1)) < 0.5, rng.integers(0, 2, (LANES, 3)), rng.random((LANES, 3)))
    x, nu, done = _solve(A, z, S, start)
    assert np.all(done == 1.0)
    for lane in range(LANES):
        W = np.linalg.cholesky(np.linalg.inv(S[lane])).T
        scale = np.sqrt(compliance)  # keeps scipy's problem near 1
        reference = lsq_linear(
            scale * np.vstack((W @ A, np.eye(3))),
            scale * np.concatenate((W @ z[lane], np.full(3, 0.5))),
            (0.0, 1.0),
            method="bvls",
            tol=1e-14,
        )
        # both solve to rounding, amplified by the condition 1 / compliance
        np.testing.assert_allclose(x[lane], reference.x, atol=1e-13 / compliance)
    # the multipliers are those of the dual: A x = z - S nu to rounding, and x = clip(1/2 + A^T nu), where nu carries
    # rounding / compliance
    np.testing.assert_allclose(x @ A.T + np.einsum("lij,lj->li", S, nu), z, atol=1e-12)
    np.testing.assert_allclose(np.clip(0.5 + nu @ A, 0.0, 1.0), x, atol=1e-12 / compliance)
