"""Local means and deviations in a mask, against the sum itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.observer.smoothing import high_passed, local_deviation, local_mean


def _mean_at(
    values: NDArray[np.float64], mask: NDArray[np.bool_], sigma: float, row: int, column: int
) -> tuple[float, float]:
    """Mean and standard deviation in the window, as they are defined."""
    y, x = np.indices(values.shape)
    weights = mask * np.exp(-((y - row) ** 2 + (x - column) ** 2) / (2 * sigma**2))
    mean = (weights * values).sum() / weights.sum()
    return mean, float(np.sqrt((weights * (values - mean) ** 2).sum() / weights.sum()))


@settings(max_examples=12)
@given(st.integers(0, 99), st.sampled_from([1.5, 6.0, 9.0, 17.0, 30.0]))
def test_a_local_mean_is_the_weighted_sum(seed: int, sigma: float) -> None:
    rng = np.random.default_rng(seed)
    y, x = np.indices((83, 121))
    values = 50 + 10 * np.sin(x / 9 + rng.uniform(0, 6)) * np.cos(y / 7) + rng.normal(0, 2, y.shape)
    mask = (x > 20) & ~((y - 40) ** 2 + (x - 70) ** 2 < 15**2)
    mean, deviation = local_mean(values, mask, sigma), local_deviation(values, mask, sigma)
    for row, column in ((5, 25), (40, 45), (70, 110), (82, 120)):
        expected = _mean_at(values, mask, sigma, row, column)
        # Blocks of an eighth of sigma and the cut at 4 sigma, of values that spread by 5.
        assert mean[row, column] == pytest.approx(expected[0], abs=0.1)
        assert deviation[row, column] == pytest.approx(expected[1], rel=0.03)


def test_a_uniform_picture_stays_and_what_is_masked_does_not_count() -> None:
    values, mask = np.full((60, 70), 42.0), np.ones((60, 70), bool)
    values[:, :20], mask[:, :20] = np.nan, False
    for sigma in (2.0, 30.0):
        np.testing.assert_allclose(local_mean(values, mask, sigma)[mask], 42.0, rtol=1e-12)
        assert not local_deviation(values, mask, sigma)[mask].any()
    assert not local_mean(values, np.zeros_like(mask), 3.0).any()


@pytest.mark.parametrize(("cycles_per_degree", "kept"), [(1.0, 0.5), (4.0, 1.0), (0.1, 0.007)])
def test_one_cycle_per_degree_keeps_half_of_its_amplitude(cycles_per_degree: float, kept: float) -> None:
    px_per_degree, x = 60.0, np.arange(1200)
    grating = np.broadcast_to(10 * np.cos(2 * np.pi * cycles_per_degree * x / px_per_degree), (40, 1200))
    passed = high_passed(grating, np.ones(grating.shape, bool), px_per_degree)[20, 200:1000]
    assert np.std(passed) * np.sqrt(2) == pytest.approx(10 * kept, abs=0.05)  # cut at 4 sigma


def test_what_cannot_be_smoothed_is_told() -> None:
    values, mask = np.zeros((5, 6)), np.ones((5, 6), bool)
    with pytest.raises(InputError, match="one shape"):
        local_mean(values, mask[1:], 2.0)
    with pytest.raises(InputError, match="> 0 pixels"):
        local_mean(values, mask, 0.0)
