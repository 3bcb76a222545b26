"""Exact sets that ask for grays, against linear programming over inputs: what they hold has one, and nothing else."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog, minimize

from paxel_design.gamut import JointGamut, lightness_area, sub_gamut
from paxel_design.gamut.polytopes import polytope
from paxel_design.gamut.tolerances import ball_about, tube_about_grays
from paxel_runtime.errors import GamutError
from paxel_runtime.gamut_mapping import luminance_relation
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_LCh, Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SubGamut

Models = Callable[..., PredictionModel]
Array = NDArray[np.float64]
SURFACES = ("pattern", "white")


def probes(gamut: SubGamut, count: int, seed: int = 0) -> tuple[Array, Array]:
    """Corners pulled in by 1e-6, and points 0.5 Lab beyond them as seen from the middle."""
    corners = polytope(gamut.normals, gamut.offsets).vertices
    corners = corners[np.random.default_rng(seed).permutation(len(corners))[:count]]
    middle = corners.mean(axis=0)
    outwards = XYZ_to_Lab(corners, gamut.white_point) - XYZ_to_Lab(middle, gamut.white_point)
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    beyond = np.asarray(Lab_to_XYZ(XYZ_to_Lab(corners, gamut.white_point) + 0.5 * outwards, gamut.white_point))
    return corners + 1e-6 * (middle - corners), beyond[gamut.slack(beyond) < 0]


def has_input(model: PredictionModel, shown_on: str, XYZ: Array, partner: Array, along: Array) -> bool:
    """Whether some x and t give XYZ on one surface and partner + t along on the other."""
    own, other = (model.surfaces[s] for s in (shown_on, SURFACES[1 - SURFACES.index(shown_on)]))
    A = np.block([[own.A, np.zeros((3, 1))], [other.A, -along[:, None]]])
    wanted = np.concatenate((XYZ - own.black, partner - other.black))
    one = np.ones((6, 1))
    result = linprog(
        np.append(np.zeros(model.n + 1), 1.0),
        A_ub=np.block([[A, -one], [-A, -one]]),
        b_ub=np.append(wanted, -wanted),
        bounds=[(0, 1)] * model.n + [(-10, 10), (0, None)],
        method="highs",
    )
    return bool(result.fun < 1e-7)  # HiGHS keeps its constraints to 1e-7


@pytest.mark.parametrize("shown_on", SURFACES)
@pytest.mark.parametrize(("K", "lightness"), [(2, "free"), (3, "free"), (2, "relative"), (3, "relative")])
def test_decolorized_colours_have_a_gray_partner_and_half_a_unit_outside_they_have_none(
    measured_model: Models, K: int, lightness: str, shown_on: str
) -> None:
    model = measured_model(K, K)
    joint = JointGamut(model)
    gamut = sub_gamut(joint, f"decolorize:{lightness}", shown_on)
    inside, outside = probes(gamut, 15)
    assert len(outside) >= 8
    surfaces = model.surfaces
    slope, base = luminance_relation(surfaces[shown_on], surfaces[SURFACES[1 - SURFACES.index(shown_on)]])

    def shown(XYZ: Array) -> bool:
        if lightness == "free":
            return has_input(model, shown_on, XYZ, np.zeros(3), model.white_point)
        return has_input(model, shown_on, XYZ, (slope * XYZ[1] + base) * model.white_point, np.zeros(3))

    assert all(shown(XYZ) for XYZ in inside)
    assert not any(shown(XYZ) for XYZ in outside)


def test_the_relation_takes_black_to_black_and_white_to_white(measured_model: Models) -> None:
    model = measured_model(0, 3)
    assert model.white is not None
    slope, base = luminance_relation(model.pattern, model.white)
    for x in (np.zeros(model.n), np.ones(model.n)):
        pattern, white = model.pattern.predict_XYZ(x), model.white.predict_XYZ(x)
        assert slope * pattern[1] + base == pytest.approx(white[1], rel=1e-12)


def test_the_same_lightness_is_empty_beside_a_white_sheet_and_says_what_to_do(measured_model: Models) -> None:
    with pytest.raises(GamutError, match=r"decolorize:same.*empty.*decolorize:free"):
        sub_gamut(measured_model(0, 2), "decolorize:same")


def nearest_partner(model: PredictionModel, XYZ: Array, gray: Array | None) -> float:
    """Least dE00 that a partner on the white surface can have from a gray (3,), Lab, or from its own gray: SLSQP.

    The input is checked to give `XYZ` on the pattern, so what is found can be shown; that less cannot, is not proven.
    """
    assert model.white is not None
    own, other, white_point = model.pattern, model.white, model.white_point
    x = linprog(np.zeros(model.n), A_eq=own.A, b_eq=XYZ - own.black, bounds=[(0, 1)] * model.n, method="highs").x

    def dE_squared(x: Array) -> float:
        partner = np.asarray(XYZ_to_Lab(other.predict_XYZ(x), white_point))
        return float(dE00(partner, partner * [1, 0, 0] if gray is None else gray)) ** 2

    shows = {"type": "eq", "fun": lambda x: 100 * (own.predict_XYZ(x) - XYZ), "jac": lambda x: 100 * own.A}
    found = minimize(dE_squared, x, method="SLSQP", bounds=[(0, 1)] * model.n, constraints=[shows])
    assert np.abs(own.predict_XYZ(found.x) - XYZ).max() < 1e-7
    return float(np.sqrt(found.fun))


def partner_in(model: PredictionModel, XYZ: Array, body: Array) -> bool:
    """Whether a partner can lie in the hull of `body` (v, 3), by HiGHS."""
    assert model.white is not None
    v = len(body)
    result = linprog(
        np.zeros(model.n + v),
        A_eq=np.block([[model.pattern.A, np.zeros((3, v))], [model.white.A, -body.T], [np.zeros(model.n), np.ones(v)]]),
        b_eq=np.concatenate((XYZ - model.pattern.black, -model.white.black, [1.0])),
        bounds=[(0, 1)] * (model.n + v),
        method="highs",
    )
    assert result.status in (0, 2), "found, or proven that there is none"
    return bool(result.status == 0)


@pytest.mark.parametrize("effect", ["decolorize:free", "neutralize:50,0,0"])
def test_a_tolerance_of_2_lets_partners_be_2_off_and_no_more(measured_model: Models, effect: str) -> None:
    model = measured_model(1, 2)
    joint, white_point = JointGamut(model), model.white_point
    exact, wide = sub_gamut(joint, effect), sub_gamut(joint, f"{effect},2")
    inner = polytope(exact.normals, exact.offsets).vertices
    # 2e-5: twice what is left open beyond a facet when its corners are searched.
    assert wide.slack(inner).min() > -2e-5
    inside, outside = probes(wide, 20)
    assert exact.slack(inside).min() < -1e-3, "some are outside the exact set"
    gray = np.array([50.0, 0, 0]) if effect.startswith("neutralize") else None
    dE = np.array([nearest_partner(model, XYZ, gray) for XYZ in inside])
    assert dE.max() < 2 + 1e-3, "1e-3: where the search stops"
    # A body of points on a sphere about 2 falls short of it by up to 3 % (see `tolerances`); corners of a set whose
    # partners lie in a corner of the joint gamut may come nearer.
    assert np.median(dE) > 2 * 0.97
    body = tube_about_grays(1.2, 2.1, white_point) if gray is None else ball_about(gray, 2.1, white_point)
    # A body of 2.1 holds all that is within 2.1 * 0.97 > 2.
    assert len(outside) >= 8
    assert not any(partner_in(model, XYZ, body) for XYZ in outside)


@pytest.mark.parametrize("shown_on", SURFACES)
def test_full_change_reaches_black_white_and_the_complement(measured_model: Models, shown_on: str) -> None:
    model = measured_model(3, 3)
    joint = JointGamut(model)
    lightness = lightness_area(joint)
    ends = lightness.L_white if shown_on == "pattern" else lightness.L_pattern
    gamut = sub_gamut(joint, "full-change", shown_on)
    given = sub_gamut(joint, f"full-change:{ends[0]!r},{ends[1]!r}", shown_on)
    np.testing.assert_allclose(gamut.offsets, given.offsets, atol=1e-9)
    inside, outside = probes(gamut, 12)
    nothing = np.zeros(3)
    black, white = np.asarray(Lab_to_XYZ([(L, 0.0, 0.0) for L in ends], model.white_point))

    def shown(XYZ: Array) -> list[bool]:
        return [
            has_input(model, shown_on, XYZ, black, nothing),
            has_input(model, shown_on, XYZ, white, nothing),
            has_input(model, shown_on, XYZ, -XYZ, model.white_point),
        ]

    assert all(all(shown(XYZ)) for XYZ in inside)
    assert not any(all(shown(XYZ)) for XYZ in outside)


@given(st.floats(0.05, 0.9), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_the_complement_has_the_opposite_hue_but_for_the_bend_of_the_cube_root(Y: float, rx: float, rz: float) -> None:
    """What `fully_changing` states about a colour and its complement of the same luminance, gray (1 + r) and (1 - r).

    a* of both are (1 + r)^(1/3) - 1 and (1 - r)^(1/3) - 1 times the same, and so is b*: shares -u and -v of each other.
    A vector (a, b) and (u a, v b) differ in angle by at most asin(|u - v| / (u + v)). u is 1 + 2 r / 3 to first order
    and convex, which up to |r| = 1/2 keeps that below half the sum of both |r|.
    """
    share = np.array([1 + rx, 1.0, 1 + rz])
    own, complement = (np.asarray(XYZ_to_Lab(Y * s * D65_XYZ, D65_XYZ)) for s in (share, 2 - share))
    if np.hypot(*own[1:]) < 1e-6:
        return
    turn = np.abs((Lab_to_LCh(complement)[2] - Lab_to_LCh(own)[2]) % 360 - 180)
    assert turn <= np.rad2deg(np.arcsin(min((abs(rx) + abs(rz)) / 2, 1))) + 1e-9


def test_grays_out_of_reach_are_told(measured_model: Models) -> None:
    with pytest.raises(GamutError, match=r"full-change:1,99.*in reach"):
        sub_gamut(measured_model(0, 2), "full-change:1,99")


def test_tolerances_are_dE00(measured_model: Models) -> None:
    white_point = measured_model(0).white_point
    ball = XYZ_to_Lab(ball_about(np.array([50.0, 20, -10]), 2.0, white_point), white_point)
    # 1e-6: forty halvings of twenty tolerances.
    np.testing.assert_allclose(dE00(ball, np.array([50.0, 20, -10])), 2.0, atol=1e-6)
    tube = np.asarray(XYZ_to_Lab(tube_about_grays(0.9, 2.0, white_point), white_point))
    np.testing.assert_allclose(tube[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(dE00(tube[1:], tube[1:] * [1, 0, 0]), 2.0, atol=1e-6)
