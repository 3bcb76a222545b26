"""Ghosts of known size: a regression that reads what was put in, and a mark that is found as itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.observer import ghost_L, ghosting_percent, picture_correlation, plant_mark, planted_mark
from paxel_runtime.observer.ghosting import coefficient_of_other

SHAPE = (120, 160)
ALL = np.ones(SHAPE, bool)
PX_PER_DEGREE = 40.0


def blobs(seed: int, sigma_px: float = 4.0) -> NDArray[np.float64]:
    """L* of a picture of blobs, of standard deviation 10 about 50; independent of one of another seed."""
    picture = gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), sigma_px, mode="wrap")
    return 50 + 10 * picture / picture.std()


@settings(max_examples=20)
@given(st.integers(0, 99), st.floats(-0.1, 0.1), st.floats(-0.3, 0.3), st.floats(-9, 9))
def test_a_planted_share_is_read_whatever_the_gain_and_the_offset(
    seed: int, share: float, gain: float, offset: float
) -> None:
    """Less contrast of its own, or another lightness, is no ghost; other keeps its correlation with own."""
    own, other = blobs(seed), blobs(seed + 1000)
    other = 0.9 * other + 0.4 * own  # correlated by about 0.4
    view = own + gain * (own - 50) + share * other + offset
    assert ghosting_percent(view, own, other, ALL) == pytest.approx(100 * abs(share), abs=1e-6)
    # High-passing is linear: the same share, but for float64 sums.
    assert ghosting_percent(view, own, other, ALL, PX_PER_DEGREE) == pytest.approx(100 * abs(share), abs=1e-6)


def test_three_percent_reads_three_percent_under_noise() -> None:
    own, other = blobs(0), blobs(1)
    noise = np.random.default_rng(2).normal(0, 1, SHAPE)
    assert ghosting_percent(own + 0.03 * other + noise, own, other, ALL) == pytest.approx(3, abs=0.2)
    # 19200 pixels of sd 10 hold the share to 1 / (10 sqrt(19200)) = 0.07 %; three of those


def test_a_slow_ghost_is_not_one_of_detail() -> None:
    own, other = blobs(0), blobs(1)
    y = np.indices(SHAPE)[0] / SHAPE[0]
    slow = 20 * np.cos(np.pi * y)  # 1/6 cycle per degree
    view, ghost = own + 0.05 * slow, other + slow
    plain, fine = (ghosting_percent(view, own, ghost, ALL, px) for px in (None, PX_PER_DEGREE))
    assert plain is not None
    assert fine is not None
    assert plain > 2
    assert fine < 0.2 * plain


def test_a_picture_of_one_lightness_cannot_ghost_and_a_hidden_one_can() -> None:
    own, flat = blobs(3), np.full(SHAPE, 50.0)
    assert ghosting_percent(own, own, flat, ALL) is None
    assert picture_correlation(own, flat, ALL) is None
    # The hiding surface is uniform itself; what is left of the hidden picture in it is found.
    assert ghosting_percent(flat + 0.03 * (own - 50), flat, own, ALL) == pytest.approx(3, abs=1e-9)


def test_the_same_picture_twice_has_no_ghost_of_its_own() -> None:
    own = blobs(4)
    assert ghosting_percent(1.1 * own, own, own, ALL) == 0
    assert picture_correlation(own, 2 * own - 7, ALL) == pytest.approx(1)
    assert abs(picture_correlation(own, blobs(5), ALL) or 1) < 0.2


def test_pixels_that_do_not_count_do_not() -> None:
    own, other = blobs(0), blobs(1)
    inner = ALL.copy()
    inner[:, :40] = False
    view = own + 0.02 * other
    view[:, :40] = 1e3
    assert ghosting_percent(view, own, other, inner) == pytest.approx(2, abs=1e-6)
    assert ghosting_percent(view, own, other, inner, PX_PER_DEGREE) == pytest.approx(2, abs=1e-6)


@settings(max_examples=20)
@given(st.integers(0, 99))
def test_the_coefficient_is_that_of_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    own, other, response = rng.normal(size=(3, 200)) * [[3], [0.1], [20]] + [[50], [1], [-7]]
    columns = np.stack([np.ones(200), own, other], axis=1)
    expected = np.linalg.lstsq(columns, response, rcond=None)[0][2]
    assert coefficient_of_other(response, own, other) == pytest.approx(expected, rel=1e-9)


def test_the_mark_lies_everywhere_and_leaves_room() -> None:
    mark = planted_mark((300, 500), 100.0)
    assert mark.mean() == pytest.approx(np.pi / 16, rel=0.05)  # discs half as wide as their lattice's pitch
    assert np.array_equal(mark, mark[::-1, ::-1])
    Lab = np.broadcast_to([[[20.0, 5, -5]], [[90.0, 5, -5]]], (2, 1, 3)).repeat(20, axis=1)
    marked = plant_mark(Lab, np.ones((2, 20), bool))
    assert marked[:, 0, 0].tolist() == [40, 70]
    assert np.array_equal(marked[..., 1:], Lab[..., 1:])
    assert np.array_equal(plant_mark(Lab, np.zeros((2, 20), bool)), Lab)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.05])
def test_a_ghost_of_the_mark_is_read_in_lightness(share: float) -> None:
    own, mark = blobs(6), planted_mark(SHAPE, PX_PER_DEGREE)
    ghost = ghost_L(own, own + share * 20 * mark, ALL, PX_PER_DEGREE)
    # 20 L* of mark times its share, less the part of the discs that is slower than one cycle per degree.
    assert 0.6 * 20 * share <= ghost <= 20 * share + 1e-9


def test_a_slow_difference_is_no_ghost() -> None:
    own, y = blobs(7), np.indices(SHAPE)[0] / SHAPE[0]
    assert ghost_L(own, own + 2 * np.cos(np.pi * y), ALL, PX_PER_DEGREE) < 0.2  # 1/6 cycle per degree; a tenth of it
