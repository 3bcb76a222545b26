"""Sub-gamuts by their definitions: what they hold can be shown, what lies outside cannot."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut, lightness_area, product_pair, sub_gamut, subgamuts
from paxel_design.gamut.polytopes import polytope
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import EFFECTS, Neutralize
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SubGamut

Models = Callable[..., PredictionModel]
Oracle = Callable[[PredictionModel, NDArray[np.float64]], bool]
SURFACES = ("pattern", "white")


def corners(gamut: SubGamut) -> NDArray[np.float64]:
    return polytope(gamut.normals, gamut.offsets).vertices


def test_every_effect_of_the_table_is_made(bw_model: Models) -> None:
    joint = JointGamut(bw_model(2))
    assert set(subgamuts._EXACT) | set(subgamuts._MARGINS) == set(EFFECTS.values())
    for key, effect in EFFECTS.items():
        for surface in SURFACES:
            gamut = sub_gamut(joint, key, surface, step=8.0)
            assert (gamut.effect, gamut.shown_on) == (effect().name, surface)
            np.testing.assert_array_equal(gamut.white_point, joint.model.white_point)


@pytest.mark.parametrize("shown_on", SURFACES)
def test_the_full_gamut_holds_every_input_and_its_corners_are_inputs(measured_model: Models, shown_on: str) -> None:
    model = measured_model(2, 3)
    gamut = sub_gamut(model, "full", shown_on)
    surface = model.surfaces[shown_on]
    x = np.random.default_rng(0).integers(0, 2, (5000, model.n))
    assert np.all(gamut.contains(surface.predict_XYZ(x)))
    grid = surface.predict_XYZ((np.arange(2**model.n)[:, None] >> np.arange(model.n)) & 1)
    for corner in corners(gamut):
        # 1e-10: measured generators of one channel are within 0.3 % of parallel, which multiplies rounding.
        assert np.abs(grid - corner).max(axis=1).min() < 1e-10, "a vertex of a zonotope is a binary input"


@pytest.mark.parametrize("shown_on", SURFACES)
@pytest.mark.parametrize("K", [2, 3])
def test_neutralized_colours_have_an_input_and_half_a_unit_outside_they_have_none(
    measured_model: Models, is_reachable: Oracle, K: int, shown_on: str
) -> None:
    model = measured_model(K, K)
    hidden_Lab = (50.0, 3.0, -2.0)
    gamut = sub_gamut(model, Neutralize(hidden_Lab), shown_on)
    hidden = Lab_to_XYZ(hidden_Lab, model.white_point)

    def shown(XYZ: NDArray[np.floating]) -> bool:
        return is_reachable(model, np.concatenate((XYZ, hidden) if shown_on == "pattern" else (hidden, XYZ)))

    vertices = corners(gamut)
    outwards = XYZ_to_Lab(vertices, model.white_point) - XYZ_to_Lab(vertices.mean(axis=0), model.white_point)
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    outside = Lab_to_XYZ(XYZ_to_Lab(vertices, model.white_point) + 0.5 * outwards, model.white_point)
    assert all(shown(XYZ) for XYZ in vertices)
    assert not any(shown(XYZ) for XYZ in outside[gamut.slack(outside) < 0])
    assert np.mean(gamut.slack(outside) < 0) > 0.9, "outwards in CIELAB is outwards in XYZ but for blunt corners"


@pytest.mark.parametrize("make", ["bw 2", "bw 3", "measured 3", "coloured 3", "coloured 6"])
def test_any_two_colours_of_a_product_pair_can_be_shown_together(
    bw_model: Models, measured_model: Models, is_reachable: Oracle, make: str
) -> None:
    kind, K = make.split()
    model = bw_model(int(K)) if kind == "bw" else measured_model(4, int(K), colored=kind == "coloured")
    joint = JointGamut(model)
    on_pattern, on_white = product_pair(joint)
    assert (on_pattern.shown_on, on_white.shown_on) == SURFACES
    P, W = corners(on_pattern), corners(on_white)
    # Convexity: when all pairs of corners can be shown, all pairs can. 1e-12: rounding of colours below 1.
    assert joint.slack(P[:, None], W[None]).min() > -1e-12
    rng = np.random.default_rng(0)
    for p, w in zip(
        rng.dirichlet(np.full(len(P), 0.3), 12) @ P, rng.dirichlet(np.full(len(W), 0.3), 12) @ W, strict=True
    ):
        assert is_reachable(model, np.concatenate((p, w)))


@pytest.mark.parametrize("seed", range(2))
def test_a_product_pair_is_maximal_and_holds_the_rectangle(measured_model: Models, seed: int) -> None:
    model = measured_model(seed, 3, colored=seed % 2 == 1)
    joint = JointGamut(model)
    lightness = lightness_area(joint)
    sides = dict(zip(SURFACES, product_pair(joint), strict=True))
    for shown_on, other, L_range in (
        ("pattern", "white", lightness.L_pattern),
        ("white", "pattern", lightness.L_white),
    ):
        # 1e-6 in L*: grays at the end of the rectangle lie on facets.
        assert sides[shown_on].gray_range() == pytest.approx(L_range, abs=1e-6)
        largest = joint.erode(corners(sides[other]), shown_on)
        # E(S) of the other side is this side: nothing can be added. 1e-12: rounding.
        assert sides[shown_on].slack(largest.vertices).min() > -1e-12


def test_effects_that_need_two_surfaces_say_so(bw_model: Models) -> None:
    model = bw_model(2)
    alone = PredictionModel(model.channels, model.clusters, model.pattern, None, model.white_point, model.response)
    assert sub_gamut(alone, "full").shown_on == "pattern"
    for text in ("dual-image", "neutralize"):
        with pytest.raises(InputError, match=f"{text}.*two surfaces"):
            sub_gamut(alone, text)
    with pytest.raises(InputError, match="two surfaces"):
        product_pair(JointGamut(alone))
    with pytest.raises(InputError, match="one of pattern; got 'white'"):
        sub_gamut(alone, "full", "white")
    with pytest.raises(InputError, match="neutralize"):
        sub_gamut(model, "neutral")


@pytest.mark.parametrize("shown_on", SURFACES)
def test_a_colour_that_cannot_be_held_names_the_grays_that_can(bw_model: Models, shown_on: str) -> None:
    model = bw_model(2)
    with pytest.raises(GamutError, match=r"neutralize:50,90,0.*L\* from [\d.]+ to [\d.]+ is in reach") as caught:
        sub_gamut(model, "neutralize:50,90,0", shown_on)
    low, high = (float(word) for word in str(caught.value).split("L* from ")[1].split(" is")[0].split(" to "))
    sub_gamut(model, f"neutralize:{(low + high) / 2},0,0", shown_on)


def test_a_flat_full_gamut_is_still_data(model_of: Models) -> None:
    """Two colorants under one channel: a parallelogram in XYZ."""
    gamut = sub_gamut(model_of(np.array([[0.3, 0.1], [0.2, 0.4], [0.1, 0.3]]), None, 2), "full")
    inside = np.array([0.2, 0.3, 0.2]) / 0.6 * 0.9
    across = np.cross([0.3, 0.2, 0.1], [0.1, 0.4, 0.3])
    assert gamut.contains(inside)
    assert not gamut.contains(inside + 1e-6 * across / np.linalg.norm(across))
