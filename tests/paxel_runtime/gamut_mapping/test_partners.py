"""Pictures with a partner: the turn of hue is exact, every pair is in the joint gamut, and the path of grays rises."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.gamut_mapping import MappingOptions, luminance_relation, map_with_partner, seen_from
from paxel_runtime.gamut_mapping.boundary import boundary_of_pairs, pair_exits
from paxel_runtime.gamut_mapping.gray_path import gray_path
from paxel_runtime.model.colorimetry import Lab_to_LCh, Lab_to_XYZ, LCh_to_Lab
from paxel_runtime.model.effects import EFFECTS, Partner, parse_effect
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import PairGamut

SLACK = 3e-5
"""How far outside a pair may lie, XYZ: the table is asked at the middles of its cells only. dE00 1e-3 at L* 20."""


@pytest.fixture(scope="module")
def model(bw_model: Callable[[int], PredictionModel]) -> PredictionModel:
    return bw_model(3)


@pytest.fixture(scope="module")
def pairs(model: PredictionModel) -> PairGamut:
    return JointGamut(model).pairs


def _picture(shape: tuple[int, int] = (40, 60)) -> NDArray[np.float32]:
    rng = np.random.default_rng(0)
    LCh = np.stack([rng.uniform(0, 100, shape), rng.gamma(1.5, 20, shape), rng.uniform(0, 360, shape)], axis=-1)
    return LCh_to_Lab(LCh).astype(np.float32)


PICTURE = _picture()
MARK = np.tile(np.linspace(0, 100, 60, dtype=np.float32), (40, 1))
WITH_PARTNER = [key for key, row in EFFECTS.items() if row().partner is not None]


@pytest.mark.parametrize("shown_on", ["pattern", "white"])
@pytest.mark.parametrize(
    "text", [*WITH_PARTNER, "hue-shift:-120", "hue-shift:45,12", "decolorize:relative", "chroma:3"]
)
def test_every_pair_is_in_the_joint_gamut_and_is_what_the_effect_asks(
    text: str, shown_on: str, model: PredictionModel, pairs: PairGamut
) -> None:
    effect = parse_effect(text)
    assert effect.partner is not None
    surfaces = model.surfaces
    other = "white" if shown_on == "pattern" else "pattern"
    relation = luminance_relation(surfaces[shown_on], surfaces[other])
    seen = seen_from(pairs, shown_on)
    mark = MARK if effect.partner.mark_strength else None
    mapped = map_with_partner(PICTURE, effect.partner, seen, relation, MappingOptions("clip"), mark=mark)

    own, partner = (Lab.astype(np.float64) for Lab in (mapped.Lab, mapped.Lab_other))
    white = model.white_point
    slack = seen.slack(Lab_to_XYZ(own, white), Lab_to_XYZ(partner, white))
    assert slack.min() > -SLACK
    before, after, partners = Lab_to_LCh(PICTURE), Lab_to_LCh(own), Lab_to_LCh(partner)
    seen_hue = after[..., 1] > 1
    turned = (after[..., 2] - before[..., 2] + 180) % 360 - 180
    assert np.abs(turned[seen_hue]).max() < 0.01  # float32 of (a, b) at chroma 1
    np.testing.assert_allclose(partners[..., 1], effect.partner.chroma_scale * after[..., 1], atol=1e-3)
    if effect.partner.chroma_scale:
        shift = (partners[..., 2] - after[..., 2] - effect.partner.turn_deg + 180) % 360 - 180
        assert np.abs(shift[seen_hue]).max() < 0.01
    if effect.partner.lightness_band is not None:
        assert np.abs(partner[..., 0] - own[..., 0]).max() <= effect.partner.lightness_band + 1e-3
    # the partner's lightness is one rising curve of the picture's, with the mark on top
    bare = partner[..., 0] - (0 if mark is None else 0.1 * (mark - mark.mean()))
    order = np.argsort(own[..., 0], axis=None)
    assert np.diff(bare.ravel()[order]).min() > -1e-3
    # there is something to look at: this picture's mean chroma is 35, and a turn to the opposite leaves 8
    assert mapped.figures["chroma_kept"] > 0.15
    assert np.ptp(own[..., 0]) > 20


def test_the_mark_does_not_show_in_the_picture(model: PredictionModel, pairs: PairGamut) -> None:
    relation = luminance_relation(model.pattern, model.white)  # type: ignore[arg-type]  # two surfaces
    mapped = [
        map_with_partner(PICTURE, Partner(mark_strength=0.1), pairs, relation, mark=mark)
        for mark in (MARK, MARK[:, ::-1])
    ]
    np.testing.assert_array_equal(mapped[0].Lab, mapped[1].Lab)
    difference = mapped[0].Lab_other - mapped[1].Lab_other
    np.testing.assert_allclose(difference[..., 0], 0.1 * (MARK - MARK[:, ::-1]), atol=1e-4)  # float32
    assert not difference[..., 1:].any()


def test_the_free_path_leaves_more_room_than_the_relative_one(model: PredictionModel, pairs: PairGamut) -> None:
    relation = luminance_relation(model.pattern, model.white)  # type: ignore[arg-type]  # two surfaces
    room = {}
    for lightness in ("free", "relative"):
        path = gray_path(pairs, Partner(45.0, lightness=lightness), relation, 33)
        assert np.diff(path.L_other).min() >= 0
        assert np.ptp(path.L_other) > 70
        room[lightness] = boundary_of_pairs(pairs, path.L_own, path.L_other, 1.0, 45.0).mean()
    assert room["free"] > 1.1 * room["relative"]


def test_the_boundary_against_halvings(pairs: PairGamut) -> None:
    """Chroma at which a pair leaves the joint gamut, by 40 halvings with `PairGamut.slack`."""
    L_own, L_other = np.array([20.0, 40.0, 60.0]), np.array([45.0, 65.0, 80.0])
    exits = pair_exits(pairs, L_own, L_other, 0.7, 30.0, 8)
    hue_deg = np.arange(9) * 45.0  # of the diamond angle's even steps
    low, high = np.zeros((3, 9)), np.full((3, 9), 256.0)
    for _ in range(40):
        C = (low + high) / 2
        own = LCh_to_Lab(np.stack(np.broadcast_arrays(L_own[:, None], C, hue_deg), axis=-1))
        other = LCh_to_Lab(np.stack(np.broadcast_arrays(L_other[:, None], 0.7 * C, hue_deg + 30), axis=-1))
        inside = pairs.slack(Lab_to_XYZ(own, pairs.white_point), Lab_to_XYZ(other, pairs.white_point)) >= 0
        low, high = np.where(inside, C, low), np.where(inside, high, C)
    np.testing.assert_allclose(exits, low, atol=2e-4)  # the search ends at 1e-4


def test_what_cannot_be_is_said_with_the_cure(pairs: PairGamut) -> None:
    with pytest.raises(GamutError, match="weaker mark, lightness free"):
        map_with_partner(PICTURE, Partner(mark_strength=1.0), pairs, (1.0, 0.0), mark=100 * (MARK > 50))
    with pytest.raises(InputError, match="a mark must be given"):
        map_with_partner(PICTURE, Partner(mark_strength=0.1), pairs, (1.0, 0.0))
    with pytest.raises(InputError, match="finite"):
        map_with_partner(PICTURE * np.float32(np.nan), Partner(), pairs, (1.0, 0.0))
