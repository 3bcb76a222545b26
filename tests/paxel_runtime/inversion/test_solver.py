"""The inversion against scipy, against random inputs that must come back, and against itself under noise."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear, minimize

from paxel_runtime.errors import InputError
from paxel_runtime.inversion import EXACT, OPTIMUM, Inversion, box_qp, invert, solver
from paxel_runtime.inversion.lanes import LANES
from paxel_runtime.inversion.newton import newton
from paxel_runtime.inversion.system import systems
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_Lab, linear_sRGB_to_XYZ, sRGB_to_Lab
from paxel_runtime.model.delta_e import TRUE_dE00, dE00, squared_dE00_jet
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

Floats = NDArray[np.float64]


def _model(reflectances: list[list[float]] | Floats, surfaces: int = 2) -> PredictionModel:
    """sRGB primaries on K colorants of equal shares, each (3,) a reflectance for each channel.

    15 % of the light of a cluster falls on the others; black level 1/1000.
    """
    own = np.asarray(reflectances, np.float64)
    K = len(own)
    spill = 0.85 * np.eye(K) + 0.15 * (np.ones((K, K)) - np.eye(K)) / max(K - 1, 1)
    primaries = linear_sRGB_to_XYZ(np.eye(3)).T / K  # columns
    pattern = np.concatenate([primaries * seen for seen in spill @ own], axis=1)
    white = np.concatenate([primaries] * K, axis=1)
    level = 1e-3
    return PredictionModel(
        channels=("red", "green", "blue"),
        clusters=tuple(f"cluster {i}" for i in range(K)),
        pattern=SurfaceModel((1 - level) * pattern, level * own.mean() * D65_XYZ),
        white=SurfaceModel((1 - level) * white, level * D65_XYZ) if surfaces == 2 else None,
        white_point=D65_XYZ,
        response=ProjectorResponse(np.tile([0.0, 1.0], (3, 1)), np.tile([0.0, 1.0], (3, 1))),
    )


BLACK, GRAY, WHITE = [0.04, 0.04, 0.04], [0.42, 0.45, 0.40], [0.90, 0.89, 0.88]
MODELS = {
    2: _model([BLACK, WHITE]),
    3: _model([BLACK, GRAY, WHITE]),
    6: _model(np.random.default_rng(8).uniform(0.05, 0.9, (6, 3))),
}
FLUORESCENT = PredictionModel(  # one channel excites three inks: 3 inputs, one surface
    channels=("uv",),
    clusters=("red", "green", "blue"),
    pattern=SurfaceModel(
        linear_sRGB_to_XYZ(np.array([[0.8, 0.1, 0.05], [0.1, 0.7, 0.1], [0.05, 0.1, 0.6]])).T, 0.002 * D65_XYZ
    ),
    white=None,
    white_point=linear_sRGB_to_XYZ(np.array([0.95, 0.9, 0.75])) + 0.002 * D65_XYZ,
    response=ProjectorResponse(np.array([[0.0, 1.0]]), np.array([[0.0, 1.0]])),
)


def _pictures(n: int, seed: int) -> tuple[Floats, Floats]:
    """Colours of photographs, mapped lightly: about three quarters are out of gamut (L* x 0.43 + 12, x 0.45 + 40)."""
    rng = np.random.default_rng(seed)
    both = []
    for gain, offset in ((0.43, 12.0), (0.45, 40.0)):
        chroma, hue = 20.0 * rng.random(n) ** 0.7, rng.uniform(0.0, 2.0 * np.pi, n)
        both.append(
            np.column_stack((gain * rng.uniform(0, 100, n) + offset, chroma * np.cos(hue), chroma * np.sin(hue)))
        )
    return both[0], both[1]


def _objective(result: Inversion) -> Floats:
    value = np.asarray(result.dE_pattern, np.float64) ** 2
    return value if result.dE_white is None else value + np.asarray(result.dE_white, np.float64) ** 2


# --- reachable colours -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("K", [2, 3, 6])
def test_colours_of_random_inputs_come_back(K: int) -> None:
    model = MODELS[K]
    x = np.random.default_rng(K).random((40, 50, model.n))
    Lab_pattern, Lab_white = model.predict(x)
    result = invert(Lab_pattern, Lab_white, model)
    assert result.x.shape == x.shape
    assert result.dE_white is not None
    assert result.counts() == {"exact": 2000, "optimum": 0, "capped": 0}
    assert max(result.dE_pattern.max(), result.dE_white.max()) < 1e-4
    if K == 2:  # as many inputs as equations: the x itself; 1e-9 is rounding times the condition of A
        np.testing.assert_allclose(result.x, x, atol=1e-9)
    else:  # of all x, the one nearest to mid-gray
        assert np.all(((result.x - 0.5) ** 2).sum(axis=-1) <= ((x - 0.5) ** 2).sum(axis=-1) + 1e-9)


def test_saturated_inputs_come_back() -> None:
    """The corners of the box are the boundary of the gamut: rounding must not throw them out."""
    model = MODELS[2]
    x = np.array(np.meshgrid(*[[0.0, 1.0]] * model.n)).reshape(model.n, -1).T
    result = invert(*model.predict(x), model)
    assert np.all(result.status == EXACT)
    np.testing.assert_allclose(result.x, x, atol=1e-9)  # rounding times the condition of A


@pytest.mark.parametrize("K", [3, 6])
def test_the_edge_of_the_gamut_is_sharp(K: int) -> None:
    """Corners of the joint gamut (x = 0 or 1 by the sign of A^T d) are met; what lies beyond them in d is not."""
    model = MODELS[K]
    assert model.white is not None
    A = np.concatenate([model.pattern.A, model.white.A])
    black = np.concatenate([model.pattern.black, model.white.black])
    d = np.random.default_rng(K).normal(size=(400, 6))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    corner = (d @ A > 0.0) @ A.T + black

    def answer(XYZ: Floats) -> Inversion:
        Lab = [XYZ_to_Lab(XYZ[:, s : s + 3], D65_XYZ) for s in (0, 3)]
        return invert(Lab[0], Lab[1], model)

    # Rounding may put a corner outside; then it is an optimum, which the regulariser's 2.5e-5 n in dE00^2 holds off.
    met = answer(corner)
    assert np.mean(met.status == EXACT) > 0.98
    assert _objective(met).max() < 2.5e-5 * model.n
    assert np.all(answer(corner + 1e-5 * d).status == OPTIMUM)  # far above the 1e-8 that count as met


@pytest.mark.parametrize(("K", "N"), [(1, 2), (2, 4), (5, 1)])
def test_any_number_of_channels(K: int, N: int) -> None:
    """Random columns: 2, 8 and 5 inputs for 6 equations."""
    rng = np.random.default_rng(N)
    white = rng.uniform(0.2, 1.0, (3, K * N))
    white /= white.sum(axis=1, keepdims=True)
    ramp = np.tile([0.0, 1.0], (N, 1))
    model = PredictionModel(
        channels=tuple(f"channel {j}" for j in range(N)),
        clusters=tuple(f"cluster {i}" for i in range(K)),
        pattern=SurfaceModel(white * rng.uniform(0.05, 0.9, white.shape), np.full(3, 1e-3)),
        white=SurfaceModel(white, np.full(3, 2e-3)),
        white_point=np.ones(3),
        response=ProjectorResponse(ramp, ramp),
    )
    result = invert(*model.predict(rng.random((300, model.n))), model)
    assert np.all(result.status == EXACT)
    assert _objective(result).max() < 1e-8
    far = invert(*_pictures(300, N), model)
    assert far.counts()["optimum"] > 200
    assert np.isfinite(_objective(far)).all()


def test_float32_pictures_give_float32() -> None:
    model = MODELS[3]
    Lab_pattern, Lab_white = model.predict(np.random.default_rng(1).random((500, model.n)))
    assert Lab_white is not None
    result = invert(Lab_pattern.astype(np.float32), Lab_white.astype(np.float32), model)
    assert result.x.dtype == np.float32
    assert result.dE_pattern.dtype == np.float32
    # x rounded to 6e-8 moves XYZ by as much, and Lab by up to 900 times that in the dark.
    assert result.dE_pattern.max() < 1e-3
    assert np.all(result.status == EXACT)


def test_dE_is_that_of_the_returned_x() -> None:
    model = MODELS[2]
    wanted = [Lab.astype(np.float32) for Lab in _pictures(2000, 4)]
    result = invert(wanted[0], wanted[1], model)
    shown = model.predict(result.x.astype(np.float64))
    assert shown[1] is not None
    for dE, want, show in zip((result.dE_pattern, result.dE_white), wanted, shown, strict=True):
        np.testing.assert_allclose(dE, dE00(want, show), rtol=1e-6, atol=1e-6)  # dE is stored as float32


def test_noise_in_the_wanted_colours_stays_noise_in_x() -> None:
    """Moving the targets by 0.02 Lab moves x by at most 0.02 (the project's own figure for K = 3)."""
    rng = np.random.default_rng(5)
    model = MODELS[3]
    reachable = model.predict(rng.random((5000, model.n)))
    assert reachable[1] is not None
    for wanted in ((reachable[0], reachable[1]), _pictures(5000, 6)):
        noise = rng.normal(size=(2, 5000, 3))
        noise *= 0.02 / np.linalg.norm(noise, axis=-1, keepdims=True)
        before = invert(*wanted, model)
        after = invert(wanted[0] + noise[0], wanted[1] + noise[1], model)
        assert np.abs(after.x - before.x).max() <= 0.02


def test_x_is_continuous_where_the_gamut_ends() -> None:
    """Along a line of colours from inside to far outside, x and dE have no jump (1000 steps of 0.05 Lab)."""
    model = MODELS[3]
    t = np.linspace(0.0, 50.0, 1001)[:, None]
    start = model.predict(np.full(model.n, 0.4))
    assert start[1] is not None
    result = invert(start[0] + t * [0.2, 0.9, 0.4], start[1] + t * [0.1, -0.5, 0.8], model)
    assert set(np.unique(result.status)) == {EXACT, OPTIMUM}
    assert np.abs(np.diff(result.x, axis=0)).max() < 0.05
    assert np.abs(np.diff(result.dE_pattern)).max() < 0.1


# --- the quadratic programme ------------------------------------------------------------------------------------------


def _solve_qp(A: Floats, z: Floats, S: Floats) -> tuple[Floats, Floats]:
    """x (LANES, n) and the done flags of `qp_steps` for z (LANES, 6) and S (LANES, 2, 3, 3)."""
    lanes, n = LANES, A.shape[1]
    w, u, v = np.zeros(box_qp.ROWS * lanes), np.empty(n * lanes), np.empty(n * lanes)
    w[box_qp.Z : box_qp.Z + 6 * lanes] = z.T.ravel()
    w[box_qp.S_FIRST : box_qp.S_FIRST + 6 * lanes] = S[:, :, 0].reshape(lanes, 6).T.ravel()
    w[box_qp.S_REST : box_qp.S_REST + 6 * lanes] = S[:, :, [1, 1, 2], [1, 2, 2]].reshape(lanes, 6).T.ravel()
    box_qp.qp_steps(w, u, v, np.ascontiguousarray(A.T), (0, 1), 1e-12, 1e300, 60)
    return np.clip(u.reshape(n, lanes).T, 0.0, 1.0), w[box_qp.DONE : box_qp.DONE + lanes]


@pytest.mark.parametrize("n", [3, 6, 9, 18])
@pytest.mark.parametrize("compliance", [1e-2, 1e-6])
def test_box_qp_agrees_with_scipy(n: int, compliance: float) -> None:
    rng = np.random.default_rng(n)
    A = rng.uniform(0.0, 1.0, (6, n)) / n
    z = rng.uniform(-0.5, 1.5, (LANES, n)) @ A.T
    roots = rng.normal(size=(LANES, 2, 3, 3))
    S = compliance * (roots @ roots.swapaxes(-1, -2) + 0.1 * np.eye(3))
    x, done = _solve_qp(A, z, S)
    assert np.all(done == 1.0)
    for lane in range(LANES):
        whole = np.zeros((6, 6))
        whole[:3, :3], whole[3:, 3:] = S[lane]
        W = np.linalg.cholesky(np.linalg.inv(whole)).T
        scale = np.sqrt(compliance)  # keeps scipy's problem near 1
        reference = lsq_linear(
            scale * np.vstack((W @ A, np.eye(n))),
            scale * np.concatenate((W @ z[lane], np.full(n, 0.5))),
            (0.0, 1.0),
            method="bvls",
            tol=1e-14,
        )
        # both solve to rounding, amplified by the condition 1 / compliance
        np.testing.assert_allclose(x[lane], reference.x, atol=1e-13 / compliance)


# --- colours out of reach ---------------------------------------------------------------------------------------------


@njit(error_model="numpy")
def _jet(Lab1: Floats, Lab2: Floats) -> tuple[float, float, float, float, float, float, float, float]:
    return squared_dE00_jet(Lab1[0], Lab1[1], Lab1[2], Lab2[0], Lab2[1], Lab2[2], TRUE_dE00)


def _reference_objective(x: Floats, Lab: Floats, A: Floats, black: Floats, white: Floats) -> tuple[float, Floats]:
    """Eq. 5 or 7 and its gradient, the plain way."""
    value, gradient = 0.0, np.zeros(x.size)
    for s in range(0, Lab.size, 3):
        t = (A[s : s + 3] @ x + black[s : s + 3]) / white
        root = np.cbrt(t)
        linear = t <= (6 / 29) ** 3
        f = np.where(linear, t * (29 / 6) ** 2 / 3 + 4 / 29, root)
        slope = np.where(linear, (29 / 6) ** 2 / 3, 1 / (3 * root * root))
        shown = np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])
        dE2, gL, ga, gb = _jet(Lab[s : s + 3], shown)[:4]
        value += dE2
        gradient += (np.array([500 * ga, 116 * gL - 500 * ga + 200 * gb, -200 * gb]) * slope / white) @ A[s : s + 3]
    return value, gradient


def _best_of_scipy(model: PredictionModel, Lab: Floats, x: Floats, rng: np.random.Generator, starts: int) -> float:
    surfaces = list(model.surfaces.values())
    A = np.concatenate([surface.A for surface in surfaces])
    black = np.concatenate([surface.black for surface in surfaces])
    best = np.inf
    for start in [x, *rng.random((starts, model.n))]:
        found = minimize(
            _reference_objective,
            start,
            args=(Lab, A, black, model.white_point),
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, 1.0)] * model.n,
            options={"ftol": 1e-10, "gtol": 1e-6, "maxiter": 200},
        )
        best = min(best, found.fun)
    return best


@pytest.mark.parametrize("K", [2, 3, 6])
def test_optimum_is_as_good_as_scipy_from_many_starts(K: int) -> None:
    model, rng = MODELS[K], np.random.default_rng(7)
    Lab_pattern, Lab_white = _pictures(60, 7)
    result = invert(Lab_pattern, Lab_white, model)
    assert result.counts()["capped"] == 0
    out = np.flatnonzero(result.status == OPTIMUM)[: 96 // model.n]
    assert len(out) == 96 // model.n
    for pixel in out:
        Lab = np.concatenate((Lab_pattern[pixel], Lab_white[pixel]))
        # 1e-3 in dE00^2: below what the regulariser may cost for 40 inputs, and far below what can be seen
        assert _objective(result)[pixel] <= _best_of_scipy(model, Lab, result.x[pixel], rng, 3) + 1e-3


@pytest.mark.parametrize("K", [2, 3])
def test_pairs_with_several_minima_get_the_lowest(K: int) -> None:
    """Saturated colours of other hues on the two surfaces: 20 random starts hardly find a lower minimum."""
    rng, model = np.random.default_rng(17), MODELS[K]
    Lab = sRGB_to_Lab(rng.random((2, 400, 3)))
    result = invert(Lab[0], Lab[1], model)
    system = systems(model, True, (1.0, 1.0), "dE00", (400,))(slice(None))
    both = np.concatenate(Lab, axis=1)
    every, value = np.arange(400), np.empty((20, 400))
    x, status = np.empty((400, model.n)), np.empty(400, np.uint8)
    for k in range(20):
        start = rng.random(x.shape) @ system.AT + system.black
        arguments = (system.surfaces, system.AT, system.black, system.white, system.weights, False)
        newton(both, start, every, *arguments, x, value[k], status)
    missed_by_one = np.mean(value > value.min(axis=0) + 1e-3)
    assert missed_by_one > 0.1, "there are several minima"
    # a tenth of what one start misses is what several are for
    assert np.mean(_objective(result) > value.min(axis=0) + 1e-3) <= 0.1 * missed_by_one


def test_one_surface_out_of_gamut() -> None:
    rng = np.random.default_rng(9)
    Lab = sRGB_to_Lab(rng.random((2000, 3)))
    result = invert(Lab, None, FLUORESCENT)
    assert result.dE_white is None
    assert result.counts()["capped"] == 0
    assert min(result.counts()["exact"], result.counts()["optimum"]) > 100
    for pixel in np.flatnonzero(result.status == OPTIMUM)[:24]:
        best = _best_of_scipy(FLUORESCENT, Lab[pixel], result.x[pixel], rng, 3)
        assert _objective(result)[pixel] <= best + 1e-3


def test_one_surface_comes_back() -> None:
    x = np.random.default_rng(10).random((1000, 3))
    result = invert(FLUORESCENT.predict(x)[0], None, FLUORESCENT)
    assert np.all(result.status == EXACT)
    np.testing.assert_allclose(result.x, x, atol=1e-9)  # rounding times the condition of A
    pattern_alone = invert(MODELS[3].predict(np.full(9, 0.3))[0], None, MODELS[3])
    assert pattern_alone.dE_white is None
    assert pattern_alone.status == EXACT


def test_every_colour_of_srgb_finds_its_optimum() -> None:
    """Saturated pairs, black, white and gray included: no pixel meets the bound of iterations."""
    levels = np.linspace(0.0, 1.0, 5)
    cube = sRGB_to_Lab(np.array(np.meshgrid(levels, levels, levels)).reshape(3, -1).T)
    rng = np.random.default_rng(11)
    for model in MODELS.values():
        result = invert(np.tile(cube, (8, 1)), rng.permutation(np.tile(cube, (8, 1))), model)
        assert result.counts()["capped"] == 0
        assert np.isfinite(result.x).all()


def test_the_plain_distance_is_minimised_when_asked_for() -> None:
    """dE76 against scipy's bounded least squares of the same objective, from our answer and from the middle."""
    model = MODELS[2]
    pattern, white = _pictures(40, seed=11)
    result = invert(pattern, white, model, metric="dE76")
    other = invert(pattern, white, model)
    for p in np.flatnonzero(result.status == OPTIMUM)[:12]:

        def residuals(x: Floats, p: int = p) -> Floats:
            seen = model.predict(x)
            return np.concatenate([seen[0] - pattern[p], seen[1] - white[p]])

        own = float(np.sum(residuals(result.x[p]) ** 2))
        np.testing.assert_allclose(own, result.dE_pattern[p] ** 2 + result.dE_white[p] ** 2, rtol=1e-9)
        best = min(
            2 * float(least_squares(residuals, start, bounds=(0, 1), xtol=1e-12, ftol=1e-12).cost)
            for start in (np.clip(result.x[p], 1e-6, 1 - 1e-6), np.full(model.n, 0.5))
        )
        assert own <= best + 2e-3  # the regulariser's 2.5e-5 n, and scipy's own end
        assert own <= float(np.sum(residuals(other.x[p]) ** 2)) + 2e-3
    with pytest.raises(InputError, match="metric"):
        invert(pattern, white, model, metric="dE94")


def test_weights_trade_one_surface_for_the_other() -> None:
    Lab_pattern, Lab_white = _pictures(500, 12)
    even = invert(Lab_pattern, Lab_white, MODELS[2])
    pattern = invert(Lab_pattern, Lab_white, MODELS[2], weights=(10.0, 1.0))
    assert even.dE_white is not None
    assert pattern.dE_white is not None
    assert pattern.dE_pattern.mean() < 0.6 * even.dE_pattern.mean()
    assert pattern.dE_white.mean() > even.dE_white.mean()
    same = invert(Lab_pattern, Lab_white, MODELS[2], weights=(7.0, 7.0))
    np.testing.assert_array_equal(same.x, even.x)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-1000.0, 1000.0), min_size=6, max_size=6), st.sampled_from([2, 3]))
def test_any_numbers_give_inputs_in_the_box(Lab: list[float], K: int) -> None:
    result = invert(np.array(Lab[:3]), np.array(Lab[3:]), MODELS[K])
    assert np.isfinite(result.x).all()
    assert result.x.min() >= 0.0
    assert result.x.max() <= 1.0
    assert np.isfinite(_objective(result)).all()


# --- unusual models ---------------------------------------------------------------------------------------------------


def test_equal_clusters_share_the_work() -> None:
    """Two equal colorants make equal columns: A is singular, x is still unique, and equal for both."""
    model = _model([BLACK, WHITE, WHITE])
    x = np.random.default_rng(13).random((300, model.n))
    result = invert(*model.predict(x), model)
    assert np.all(result.status == EXACT)
    assert _objective(result).max() < 1e-8
    np.testing.assert_allclose(result.x[:, 3:6], result.x[:, 6:9], atol=1e-6)  # the compliance of an exact solution


def test_a_model_that_cannot_tell_the_surfaces_apart() -> None:
    """One cluster: 3 inputs for 6 equations. Colours of one x come back; others find their optimum."""
    model = _model([WHITE])
    x = np.random.default_rng(14).random((200, 3))
    result = invert(*model.predict(x), model)
    assert result.dE_white is not None
    assert np.all(result.status == EXACT)
    assert max(result.dE_pattern.max(), result.dE_white.max()) < 1e-4
    out = invert(*_pictures(200, 15), model)
    assert np.all(out.status == OPTIMUM)


# --- streaming and errors ---------------------------------------------------------------------------------------------


def test_chunks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """A picture larger than a chunk gives what its pixels give alone, and reports progress to the end."""
    monkeypatch.setattr(solver, "_CHUNK", 1024)
    Lab_pattern, Lab_white = _pictures(5000, 16)
    calls: list[tuple[int, int]] = []
    whole = invert(Lab_pattern, Lab_white, MODELS[2], progress=lambda done, total: calls.append((done, total)))
    assert len(calls) > 1
    assert calls[-1] == (5000, 5000)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)
    some = slice(3000, 3050)
    alone = invert(Lab_pattern[some], Lab_white[some], MODELS[2])
    np.testing.assert_array_equal(alone.x, whole.x[some])


def test_wrong_arguments_are_named() -> None:
    model, one = MODELS[2], FLUORESCENT
    good = np.full((4, 3), 50.0)
    with pytest.raises(InputError, match="one shape"):
        invert(good, good[:2], model)
    with pytest.raises(InputError, match="one surface"):
        invert(good, good, one)
    with pytest.raises(InputError, match=r"\(\.\.\., 3\)"):
        invert(good[:, :2], good[:, :2], model)
    for wrong in (np.nan, np.inf, -np.inf):
        with pytest.raises(InputError, match="1 pixels with NaN"):
            invert(np.where(np.arange(12).reshape(4, 3) == 5, wrong, good), good, model, progress=_no_work)
        with pytest.raises(InputError, match="Lab_white must be finite"):
            invert(good, np.float32(good * [1.0, wrong, 1.0]), model, progress=_no_work)
    with pytest.raises(InputError, match="at least one"):
        invert(good[:0], good[:0], model)
    with pytest.raises(InputError, match="weights"):
        invert(good, good, model, weights=(1.0, 0.0))
    with pytest.raises(InputError, match="at least one"):
        invert(np.zeros((0, 5, 3), np.float32), None, model)
    for white in ([0.9, 0.0, 1.0], [0.9, np.nan, 1.0], [0.9, 1.0]):
        with pytest.raises(InputError, match="white_point"):
            invert(good, good, dataclasses.replace(model, white_point=np.array(white)), progress=_no_work)
    unmeasured = SurfaceModel(np.where(np.arange(6) == 2, np.nan, model.pattern.A), model.pattern.black)
    with pytest.raises(InputError, match="A and black must be finite"):
        invert(good, good, dataclasses.replace(model, pattern=unmeasured), progress=_no_work)


def _no_work(done: int, total: int) -> None:
    raise AssertionError("the error comes before any work")
