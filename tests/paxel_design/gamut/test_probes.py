"""Random probes of exact sets and product pairs; reports/gamut_oracles.py makes 10,000 and 20,000 of them."""

import importlib.util
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from paxel_design.gamut import JointGamut, product_pair
from paxel_design.gamut.margins import hue_margins
from paxel_design.gamut.meshes import exact_volume
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import Lab_to_LCh, Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import CHROMA_FLOOR, HueShift
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]
SLOW = partial(pytest.param, marks=pytest.mark.slow)
REPORTS = Path(__file__).parents[3] / "reports"


@pytest.fixture(scope="module")
def oracles() -> ModuleType:
    """The report's judges: linear programming by HiGHS, and a proven search over partners."""
    sys.path.insert(0, str(REPORTS))
    try:
        spec = importlib.util.spec_from_file_location("gamut_oracles", REPORTS / "gamut_oracles.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(REPORTS))
    return module


@pytest.mark.parametrize("K", [2, SLOW(3), 6])
def test_corners_have_a_checked_input_and_half_a_unit_beyond_there_is_none(
    oracles: ModuleType, measured_model: Models, K: int
) -> None:
    told = oracles.exact_sets(JointGamut(measured_model(K, K, colored=K == 6)), 120)
    assert told["corners"] > 40
    assert told["beyond"] > 40
    # The 1e-6 of slack: HiGHS keeps its constraints to 1e-7.
    assert told["disagreements"] == 0
    assert told["worst_reached"] < 1e-6 < told["nearest_refused"]


@pytest.mark.parametrize("K", [2, SLOW(3)])
def test_random_pairs_of_a_product_pair_are_inverted(oracles: ModuleType, measured_model: Models, K: int) -> None:
    told = oracles.product_pairs(JointGamut(measured_model(K, K)), 150)
    assert told["share_below_1e-3"] == 1.0
    # HiGHS keeps its constraints to 1e-7.
    assert told["worst_distance"] < 1e-6


@pytest.mark.parametrize("angle", [SLOW(20), 45, SLOW(90), 135, SLOW(170)])
def test_beside_the_boundary_of_a_hue_set_a_partner_is_found_or_proven_to_be_none(
    oracles: ModuleType, measured_model: Models, angle: int
) -> None:
    model = measured_model(1, 2)
    joint, margins = JointGamut(model), hue_margins(model, HueShift(angle), "pattern")
    rng = np.random.default_rng(angle)
    XYZ = model.pattern.predict_XYZ(rng.beta(0.5, 0.5, (400, model.n)))
    XYZ = XYZ.mean(axis=0) + 0.99 * (XYZ - XYZ.mean(axis=0))
    # Near gray a hue says nothing: there the boundary is a needle along the axis.
    XYZ = XYZ[Lab_to_LCh(XYZ_to_Lab(XYZ, model.white_point))[:, 1] > 5]
    value = margins(XYZ)
    low, high = XYZ[rng.choice(np.flatnonzero(value > 0), 6)], XYZ[rng.choice(np.flatnonzero(value < 0), 6)]
    toward = XYZ_to_Lab(high, model.white_point) - XYZ_to_Lab(low, model.white_point)
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    for _ in range(30):
        middle = (low + high) / 2
        within = (margins(middle) >= 0)[:, None]
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    place = XYZ_to_Lab(low, model.white_point)
    # A tenth of a CIELAB unit: the limit.
    for inside, outside in zip(place - 0.1 * toward, place + 0.1 * toward, strict=True):
        partner = oracles.partner_of(joint, np.asarray(Lab_to_XYZ(inside, model.white_point)), angle)
        assert partner is not None
        Lab = XYZ_to_Lab(partner, model.white_point)
        result = invert(inside, Lab, model)
        assert max(result.dE_pattern, result.dE_white) < 1e-3
        (_, _, h), (_, C, h_partner) = Lab_to_LCh(inside), Lab_to_LCh(Lab)
        assert C >= CHROMA_FLOOR - 1e-9
        assert abs((h_partner - h + 180) % 360 - 180) >= angle - 1e-6
        assert oracles.partner_of(joint, np.asarray(Lab_to_XYZ(outside, model.white_point)), angle) is None


def test_a_lopsided_closure_gives_way_to_the_maximised_pair(four_channel_model: Models) -> None:
    """A measured print in yellow and blue under four measured channels: 18,287 on the pattern, 182 on white."""
    joint = JointGamut(four_channel_model("yellow", "blue"))
    closure, chosen = ([exact_volume(side) for side in product_pair(joint, pair)] for pair in ("closure", "auto"))
    assert min(closure) < 0.1 * max(closure)
    assert np.prod(chosen) > 2 * np.prod(closure)
    assert min(chosen) > min(closure)


@pytest.mark.parametrize("inks", [("black", "white"), ("yellow", "blue")])
def test_the_default_pair_is_no_smaller_than_the_closure(four_channel_model: Models, inks: tuple[str, str]) -> None:
    joint = JointGamut(four_channel_model(*inks))
    closure, chosen = ([exact_volume(side) for side in product_pair(joint, pair)] for pair in ("closure", "auto"))
    # 1e-3: what the search compares volumes to.
    assert np.prod(chosen) >= np.prod(closure) * (1 - 1e-3)
