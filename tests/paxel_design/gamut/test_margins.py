"""Margins of level sets against partners found by brute force."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut
from paxel_design.gamut.margins import chroma_margins, hue_margins
from paxel_runtime.model.colorimetry import Lab_to_LCh, Lab_to_XYZ, LCh_to_Lab, XYZ_to_Lab
from paxel_runtime.model.effects import CHROMA_FLOOR, Chroma, HueShift
from paxel_runtime.model.prediction import PredictionModel

SLOW = partial(pytest.param, marks=pytest.mark.slow)
Models = Callable[..., PredictionModel]


def reachable_partners(joint: JointGamut, XYZ: NDArray[np.float64], partners: NDArray[np.float64]) -> bool:
    """Whether any of the partners (k, 3), CIELAB on the white surface, goes with a colour (3,) of the pattern."""
    white = Lab_to_XYZ(partners, joint.model.white_point)
    return bool(np.any(joint.contains(np.broadcast_to(XYZ, white.shape), white)))


@pytest.mark.parametrize("angle", [20, SLOW(45), SLOW(90), 135, SLOW(170)])
def test_a_hue_margin_has_the_sign_of_a_dense_search(measured_model: Models, angle: int) -> None:
    model = measured_model(1, 2)
    joint = JointGamut(model)
    margins = hue_margins(model, HueShift(angle), "pattern")
    rng = np.random.default_rng(angle)
    XYZ = model.pattern.predict_XYZ(rng.beta(0.5, 0.5, (4000, model.n)))
    margin = margins(XYZ)
    order = np.argsort(np.abs(margin))  # where it is decided, as many of either side
    near = np.concatenate([order[margin[order] >= 0][:30], order[margin[order] < 0][:30]])
    assert len(near) == 60
    XYZ, margin = XYZ[near], margin[near]
    hues = np.asarray(Lab_to_LCh(XYZ_to_Lab(XYZ, model.white_point)))[:, 2]
    L, C = np.linspace(2, 100, 50), np.concatenate((np.linspace(CHROMA_FLOOR, 20, 6), np.arange(26.0, 90, 6)))
    # The extreme turns matter most: at first by 1 degree, then by 10.
    turn = np.concatenate((np.linspace(angle, min(angle + 5, 180), 4), np.arange(angle + 10.0, 180, 10)))
    turn = np.concatenate((turn, -turn))
    for color, value, hue in zip(XYZ, margin, hues, strict=True):
        LCh = np.stack(np.meshgrid(L, C, hue + turn, indexing="ij"), axis=-1).reshape(-1, 3)
        found = reachable_partners(joint, color, np.asarray(LCh_to_Lab(LCh)))
        # A margin >= 0 has a partner, which a grid may miss; where the grid finds one the margin must not be below
        # 0 by more than what straightening and the floor's tangents cost: 0.1.
        assert not found or value >= -0.1


@pytest.mark.parametrize(("K", "channels", "colored"), [(2, 3, False), (3, 3, True), (2, 4, False)])
@pytest.mark.parametrize("angle", [45, 135])
def test_every_colour_well_inside_has_a_partner(
    measured_model: Models, angle: int, K: int, channels: int, colored: bool
) -> None:
    """A fan of partners, steps of 2 in lightness and 3 in chroma, must hold one where the margin is that wide."""
    model = measured_model(2, K, channels, colored=colored)
    joint = JointGamut(model)
    rng = np.random.default_rng(0)
    XYZ = model.pattern.predict_XYZ(rng.beta(0.5, 0.5, (200, model.n)))
    margin = hue_margins(model, HueShift(angle), "pattern")(XYZ)
    clearly = XYZ[margin > 3.0][:8]
    assert len(clearly) == 8
    for color in clearly:
        hue = float(Lab_to_LCh(XYZ_to_Lab(color, model.white_point))[2])
        turn = np.linspace(angle, 360 - angle, 37)
        LCh = np.stack(np.meshgrid(np.linspace(2, 100, 50), np.arange(5.0, 50, 3), hue + turn), axis=-1)
        assert reachable_partners(joint, color, np.asarray(LCh_to_Lab(LCh.reshape(-1, 3))))


def test_hue_margins_fall_with_the_angle_and_rise_with_the_band(measured_model: Models) -> None:
    model = measured_model(4, 3)
    XYZ = model.pattern.predict_XYZ(np.random.default_rng(1).beta(0.6, 0.6, (400, model.n)))
    inside = [hue_margins(model, HueShift(angle), "pattern")(XYZ) >= 0 for angle in (20, 45, 90, 135, 170)]
    for wider, narrower in pairwise(inside):
        assert not np.any(narrower & ~wider)
    free, banded, narrow = (hue_margins(model, HueShift(45, band), "pattern")(XYZ) >= 0 for band in (None, 30.0, 10.0))
    assert not np.any(narrow & ~banded)
    assert not np.any(banded & ~free)
    assert narrow.sum() < free.sum()


@pytest.mark.parametrize("scale", [0.5, 1.5])
@pytest.mark.parametrize("shown_on", ["pattern", "white"])
def test_a_chroma_margin_has_the_sign_of_a_dense_search(measured_model: Models, scale: float, shown_on: str) -> None:
    model = measured_model(3, 2)
    joint = JointGamut(model)
    surface = model.surfaces[shown_on]
    XYZ = surface.predict_XYZ(np.random.default_rng(0).beta(0.7, 0.7, (300, model.n)))
    margin = chroma_margins(model, Chroma(scale), shown_on)(XYZ)
    Lab = np.asarray(XYZ_to_Lab(XYZ, model.white_point))
    L = np.linspace(0.5, 100, 2000)
    found = np.empty(len(XYZ), bool)
    for i, color in enumerate(Lab):
        partners = np.stack((L, np.full_like(L, scale * color[1]), np.full_like(L, scale * color[2])), axis=-1)
        other = np.asarray(Lab_to_XYZ(partners, model.white_point))
        own = np.broadcast_to(XYZ[i], other.shape)
        found[i] = np.any(joint.contains(own, other) if shown_on == "pattern" else joint.contains(other, own))
    assert 20 < found.sum() < 295
    # Steps of 0.05 in L* miss partners of colours within 0.1 of the boundary.
    clear = np.abs(margin) > 0.1
    np.testing.assert_array_equal((margin >= 0)[clear], found[clear])


def test_a_lightness_band_holds_the_partner(measured_model: Models) -> None:
    model = measured_model(3, 2)
    XYZ = model.pattern.predict_XYZ(np.random.default_rng(0).beta(0.7, 0.7, (300, model.n)))
    free, banded = (chroma_margins(model, Chroma(0.5, band), "pattern")(XYZ) for band in (None, 8.0))
    assert np.all(banded <= free + 1e-6)
    assert np.sum(banded >= 0) < np.sum(free >= 0)
    joint, L_own = JointGamut(model), np.asarray(XYZ_to_Lab(XYZ, model.white_point))
    for color, Lab in zip(XYZ[banded > 0.2][:20], L_own[banded > 0.2][:20], strict=True):
        L = Lab[0] + np.linspace(-8, 8, 400)
        assert reachable_partners(joint, color, np.stack((L, 0 * L + Lab[1] / 2, 0 * L + Lab[2] / 2), axis=-1))


@pytest.mark.parametrize("effect", ["hue-shift:45", "hue-shift:135", "band", "chroma:0.5", "chroma:1.5"])
def test_slopes_are_those_of_differences(measured_model: Models, effect: str) -> None:
    # Inputs of little likeness: others give margins a crease every few hundredths.
    model = measured_model(5, 3, noise=0.1)
    if effect == "band":
        margins = hue_margins(model, HueShift(45, 15.0), "pattern")
    else:
        kind, number = effect.split(":")
        makes = hue_margins if kind == "hue-shift" else chroma_margins
        margins = makes(model, (HueShift if kind == "hue-shift" else Chroma)(float(number)), "pattern")
    rng = np.random.default_rng(0)
    # Away from the gamut's surface: inputs that leave room on all sides.
    XYZ = model.pattern.predict_XYZ(0.1 + 0.8 * rng.beta(0.5, 0.5, (600, model.n)))
    values, slopes = margins.with_slopes(XYZ)
    near = np.argsort(np.abs(values))[:150]
    Lab, h = np.asarray(XYZ_to_Lab(XYZ[near], model.white_point)), 0.02
    ends = [[margins(np.asarray(Lab_to_XYZ(Lab + s * h * d, model.white_point))) for s in (1, -1)] for d in np.eye(3)]
    sides = np.array([[(high - values[near]) / h, (values[near] - low) / h] for high, low in ends])
    off = np.min(np.abs(slopes[near].T[:, None] - sides), axis=1) / np.maximum(1, np.abs(sides).max(axis=1))
    # A margin is smooth in pieces, and inside a set that of the first good partner: at a crease the slope may be of
    # neither side. Straightening ends at a gain of 0.001, 5 % of the difference's 0.02. A term left out would be wrong
    # nearly everywhere.
    assert np.mean(off < 0.05) > 0.75
