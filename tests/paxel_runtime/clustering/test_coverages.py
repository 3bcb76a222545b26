"""Clusters from coverages, the cross-check of two sortings, and the suggestion for K."""

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.clustering import OUTSIDE, agreement, cluster, cluster_coverages, cluster_figures, suggest_count
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import D65_XYZ

WHITE = D65_XYZ
NAMES = ("red", "green", "blue")
COLORS = np.array([[0.4, 0.2, 0.05], [0.3, 0.6, 0.1], [0.2, 0.1, 0.9]])


def _coverage(seed: int, shape: tuple[int, int] = (60, 90)) -> NDArray[np.float32]:
    return np.random.default_rng(seed).dirichlet([0.25] * 3, shape).astype(np.float32)


def _sort(coverage: NDArray[np.float32], count: int, names: tuple[str, ...] = NAMES):  # type: ignore[no-untyped-def]
    XYZ = (coverage @ COLORS[: coverage.shape[2]]).astype(np.float32)
    return cluster_coverages(coverage, np.ones(coverage.shape[:2], bool), names, count, XYZ, WHITE)


def test_a_pixel_belongs_to_what_covers_most_of_it() -> None:
    coverage = _coverage(0)
    result = _sort(coverage, 3)
    assert np.array_equal(result.labels, coverage.argmax(axis=-1))
    assert result.names == NAMES
    np.testing.assert_allclose(result.shares, np.bincount(result.labels.ravel()) / result.labels.size)
    true = np.array([coverage[result.labels == k].mean(axis=0) for k in range(3)])
    np.testing.assert_allclose(result.purity, true, atol=1e-6)  # float32 coverages


def test_edge_clusters_lie_between_two_colorants() -> None:
    rng = np.random.default_rng(1)
    share = np.clip(rng.uniform(-1.5, 2.5, (80, 100)), 0, 1).astype(np.float32)
    result = _sort(np.stack([1 - share, share], axis=-1), 3, ("red", "green"))
    assert result.names == ("red", "green", "red+green")
    edge = share[result.labels == 2]
    # Two thirds of the pixels are pure and a third uniform: k-means divides the middle near a fifth and four fifths.
    assert 0.1 < edge.min() < 0.35
    assert 0.65 < edge.max() < 0.9
    assert share[result.labels == 0].max() <= edge.min()
    assert share[result.labels == 1].min() >= edge.max()


def test_pixels_outside_are_not_sorted_and_may_hold_anything() -> None:
    coverage = _coverage(2)
    valid = np.random.default_rng(0).random(coverage.shape[:2]) < 0.7
    coverage[~valid] = np.nan
    XYZ = (np.nan_to_num(coverage) @ COLORS).astype(np.float32)
    labels = cluster_coverages(coverage, valid, NAMES, 3, XYZ, WHITE).labels
    assert np.array_equal(labels == OUTSIDE, ~valid)
    assert np.array_equal(labels[valid], coverage[valid].argmax(axis=-1))


def test_both_methods_agree_where_nothing_blurs() -> None:
    coverage = _coverage(3)
    XYZ = (coverage @ COLORS).astype(np.float32)
    valid = np.ones(coverage.shape[:2], bool)
    by_color = cluster(XYZ, valid, dict(zip(NAMES, COLORS, strict=True)), 3, WHITE)
    both = agreement(by_color.labels, _sort(coverage, 3).labels, 3)
    # Mixtures of all three, a sixth of the pixels here, are what two colorants cannot explain.
    assert both.share > 0.85
    assert both.both == 1.0
    assert both.matrix.sum() == pytest.approx(1.0)


def test_agreement_counts_what_both_sort() -> None:
    one = np.array([[0, 0, 1, 1, 255, 255]], np.uint8)
    other = np.array([[0, 1, 1, 1, 0, 255]], np.uint8)
    result = agreement(one, other, 2)
    assert result.share == pytest.approx(3 / 4)
    assert result.both == pytest.approx(4 / 5)
    np.testing.assert_allclose(result.matrix, [[0.25, 0.25], [0, 0.5]])
    with pytest.raises(InputError, match="one size"):
        agreement(one, other[:, 1:], 2)
    with pytest.raises(InputError, match="some pixel in common"):
        agreement(one, np.full_like(one, 255), 2)


def test_the_suggestion_counts_edges_that_many_pixels_lie_on() -> None:
    share = np.clip(np.random.default_rng(1).uniform(-0.3, 1.3, (80, 100)), 0, 1).astype(np.float32)
    result = _sort(np.stack([1 - share, share], axis=-1), 2, ("red", "green"))
    count, reason = suggest_count(result, ("red", "green"))
    assert count == 3
    assert "red and green 31%" in reason  # half of the uniform part, which is 1 of 1.6
    figures = cluster_figures(result, ("red", "green"))
    assert figures["suggested_count"] == 3
    # Half of the pixels of a cluster: pure for 0.3 of 0.8, and three quarters pure on average for the rest.
    assert figures["purity"]["red"]["red"] == pytest.approx((0.3 + 0.75 * 0.5) / 0.8, abs=0.02)
    crisp = _sort(np.stack([share < 0.5, share >= 0.5], axis=-1).astype(np.float32), 2, ("red", "green"))
    assert suggest_count(crisp, ("red", "green"))[0] == 2


def test_errors_say_what_is_wrong() -> None:
    coverage = _coverage(4)
    with pytest.raises(InputError, match="coverages of 4 colorants"):
        _sort(coverage, 3, ("red", "green", "blue", "cyan"))
    with pytest.raises(InputError, match="at least the number of colorants"):
        _sort(coverage, 2)
    with pytest.raises(InputError, match="coverages must be finite"):
        _sort(coverage * np.float32(np.nan), 3)
    one = np.zeros_like(coverage)
    one[..., 0] = 1
    with pytest.raises(CalibrationError, match=r"lower clusters\.count"):
        _sort(one, 3)
