"""Exact sets that ask for grays, against linear programming over inputs: what they hold has one, and nothing else."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from paxel_design.gamut import JointGamut, lightness_area, sub_gamut
from paxel_design.gamut.gray_sets import gray_relation
from paxel_design.gamut.polytopes import polytope
from paxel_design.gamut.tolerances import ball_about, balls_along_grays, tube_about_grays
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_LCh, Lab_to_XYZ, XYZ_to_Lab
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
    slope, base = gray_relation(joint, shown_on)

    def shown(XYZ: Array) -> bool:
        if lightness == "free":
            return has_input(model, shown_on, XYZ, np.zeros(3), model.white_point)
        return has_input(model, shown_on, XYZ, (slope * XYZ[1] + base) * model.white_point, np.zeros(3))

    assert all(shown(XYZ) for XYZ in inside)
    assert not any(shown(XYZ) for XYZ in outside)


def test_the_relation_takes_black_to_black_and_white_to_white(measured_model: Models) -> None:
    model = measured_model(0, 3)
    assert model.white is not None
    slope, base = gray_relation(JointGamut(model), "pattern")
    for x in (np.zeros(model.n), np.ones(model.n)):
        pattern, white = model.pattern.predict_XYZ(x), model.white.predict_XYZ(x)
        assert slope * pattern[1] + base == pytest.approx(white[1], rel=1e-12)


def test_the_same_lightness_is_empty_beside_a_white_sheet_and_says_what_to_do(measured_model: Models) -> None:
    with pytest.raises(GamutError, match=r"decolorize:same.*empty.*decolorize:free"):
        sub_gamut(measured_model(0, 2), "decolorize:same")


@pytest.mark.parametrize("effect", ["decolorize:free", "neutralize:50,0,0"])
def test_a_tolerance_widens_a_set_by_partners_within_it(measured_model: Models, effect: str) -> None:
    """Each corner has an input whose partner, by HiGHS, lies within the tolerance of a gray that the effect allows."""
    model = measured_model(1, 2)
    assert model.white is not None
    joint = JointGamut(model)
    white_point = model.white_point
    exact, wide = sub_gamut(joint, effect), sub_gamut(joint, f"{effect},2")
    inner = polytope(exact.normals, exact.offsets).vertices
    # The body about the grays is the hull of points a few units apart on its surface: its ends fall short by 1e-4.
    assert wide.slack(inner).min() > -2e-4
    corners = probes(wide, 15)[0]
    assert exact.slack(corners).min() < -1e-3, "some are outside the exact set"
    for XYZ in corners:
        # Points within the tolerance of the grays allowed; some mixture of them must be a partner.
        if effect == "neutralize:50,0,0":
            grays = np.array([[50.0, 0, 0]])
        else:
            grays = np.stack((np.linspace(1, 99, 50), np.zeros(50), np.zeros(50)), axis=-1)
        body = np.concatenate([ball_about(gray, 2.15, white_point) for gray in grays])
        one = np.ones((1, len(body)))
        result = linprog(
            np.zeros(model.n + len(body)),
            A_eq=np.block(
                [
                    [model.pattern.A, np.zeros((3, len(body)))],
                    [model.white.A, -body.T],
                    [np.zeros((1, model.n)), one],
                ]
            ),
            b_eq=np.concatenate((XYZ - model.pattern.black, -model.white.black, [1.0])),
            bounds=[(0, 1)] * (model.n + len(body)),
            method="highs",
        )
        # 2.15: the polytope about each ball is up to 5 % smaller than the ball (30 degrees between its points).
        assert result.status == 0
        partner = np.asarray(XYZ_to_Lab(model.white.predict_XYZ(result.x[: model.n]), white_point))
        nearest = partner * [1, 0, 0] if effect == "decolorize:free" else grays[0]
        assert dE00(partner, nearest) < 2.25, "2.15, and what mixing grays far apart adds"


@pytest.mark.parametrize("shown_on", SURFACES)
def test_full_change_reaches_black_white_and_the_complement(measured_model: Models, shown_on: str) -> None:
    model = measured_model(3, 3)
    joint = JointGamut(model)
    other = SURFACES[1 - SURFACES.index(shown_on)]
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
    # The complement, at the colour's own luminance, has the opposite hue: within 25 degrees for chroma up to 40,
    # because CIELAB bends the straight line through gray, and the nearer the smaller the chroma.
    complement = XYZ_to_Lab(2 * inside[:, 1:2] * model.white_point - inside, model.white_point)
    own = Lab_to_LCh(XYZ_to_Lab(inside, model.white_point))
    turned = np.abs((Lab_to_LCh(complement)[:, 2] - own[:, 2]) % 360 - 180)
    assert np.all(turned[(own[:, 1] > 2) & (own[:, 1] < 40)] < 25)
    assert other in model.surfaces


def test_grays_out_of_reach_are_told(measured_model: Models) -> None:
    with pytest.raises(GamutError, match=r"full-change:1,99.*in reach"):
        sub_gamut(measured_model(0, 2), "full-change:1,99")


def test_tolerances_are_dE00(measured_model: Models) -> None:
    white_point = measured_model(0).white_point
    ball = XYZ_to_Lab(ball_about(np.array([50.0, 20, -10]), 2.0, white_point), white_point)
    # 1e-6: forty halvings of twenty tolerances.
    np.testing.assert_allclose(dE00(ball, np.array([50.0, 20, -10])), 2.0, atol=1e-6)
    tube = np.asarray(XYZ_to_Lab(tube_about_grays((0.05, 0.9), 2.0, white_point), white_point))
    np.testing.assert_allclose(dE00(tube, tube * [1, 0, 0]), 2.0, atol=1e-6)
    body, place = balls_along_grays((0.05, 0.9), 2.0, white_point)
    gray = XYZ_to_Lab(place[:, None] * white_point, white_point)
    dE = dE00(XYZ_to_Lab(body, white_point), gray)
    assert dE.max() < 2 + 1e-6
    assert dE.min() > 1, "lightness counts up to 1.75 times less at the ends of the scale"


def test_a_tolerance_about_related_grays_widens_the_set_and_its_partners_are_near(measured_model: Models) -> None:
    joint = JointGamut(measured_model(1, 2))
    exact, wide = sub_gamut(joint, "decolorize:relative"), sub_gamut(joint, "decolorize:relative,2")
    inner = polytope(exact.normals, exact.offsets).vertices
    # The body about the grays is the hull of points a few units apart on its surface: its ends fall short by 1e-4.
    assert wide.slack(inner).min() > -2e-4
    outer = polytope(wide.normals, wide.offsets).vertices
    # A tolerance of 2 moves no colour by more than a few units.
    assert -0.1 < exact.slack(outer).min() < -1e-3
