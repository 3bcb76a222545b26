"""What an effect did between two surfaces: turns and ratios that were put in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.model.colorimetry import LCh_to_Lab
from paxel_runtime.observer import change_figures

ALL = np.ones((30, 40), bool)


def _picture(C: float = 20.0) -> np.ndarray:
    hue = np.random.default_rng(0).uniform(0, 360, ALL.shape)
    return np.stack([np.full(ALL.shape, 50.0), np.full(ALL.shape, C), hue], axis=-1)


@given(st.floats(-179, 179), st.floats(0.4, 3))
def test_a_turn_and_a_ratio_are_read_over_the_seam(turn: float, ratio: float) -> None:
    shown = _picture()
    figures = change_figures(LCh_to_Lab(shown), LCh_to_Lab(shown * (1, ratio, 1) + (9, 0, turn)), ALL)
    assert figures["hue_turn_deg"] == pytest.approx(turn, abs=1e-6)
    assert figures["hue_turn_sd_deg"] == pytest.approx(0, abs=1e-6)
    assert figures["chroma_ratio"] == pytest.approx(ratio, rel=1e-9)
    assert figures["hue_pixels"] == 1


def test_turns_spread_about_their_mean() -> None:
    shown = _picture()
    turns = 170 + np.random.default_rng(1).normal(0, 8, ALL.shape)  # a few beyond 180
    figures = change_figures(LCh_to_Lab(shown), LCh_to_Lab(shown + turns[..., None] * (0, 0, 1)), ALL)
    assert figures["hue_turn_deg"] == pytest.approx(turns.mean(), abs=0.1)
    assert figures["hue_turn_sd_deg"] == pytest.approx(turns.std(), rel=0.01)


def test_gray_has_no_hue() -> None:
    shown, gray = _picture(), _picture(C=1.0)
    figures = change_figures(LCh_to_Lab(shown), LCh_to_Lab(gray), ALL)
    assert figures["hue_turn_deg"] is None
    assert figures["chroma_ratio"] == pytest.approx(0.05)
    assert change_figures(LCh_to_Lab(0 * gray), LCh_to_Lab(shown), ALL)["chroma_ratio"] is None
