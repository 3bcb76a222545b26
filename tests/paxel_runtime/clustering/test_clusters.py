"""Clusters: against scipy's k-means, against known coverages, and for what must not change them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from paxel_runtime.clustering import OUTSIDE, cluster, cluster_colors, label_detail, label_picture, lloyd
from paxel_runtime.clustering.kernels import label_by_light
from paxel_runtime.clustering.mixtures import make_mixture_labels, names_of_clusters
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ, XYZ_to_Lab

WHITE = D65_XYZ
BW = {"black": 0.03 * WHITE, "white": WHITE}
CMYRGB = {
    name: Lab_to_XYZ(np.array(Lab), WHITE)
    for name, Lab in {
        "cyan": (55.0, -37.0, -50.0),
        "magenta": (48.0, 74.0, -3.0),
        "yellow": (89.0, -5.0, 93.0),
        "red": (47.0, 68.0, 48.0),
        "green": (50.0, -66.0, 27.0),
        "blue": (24.0, 22.0, -46.0),
    }.items()
}


def _coverage(seed: int, pixels_per_dot: float = 5.1, shape: tuple[int, int] = (150, 200)) -> NDArray[np.float64]:
    """Share of white in each pixel of a checkerboard at 30 degrees, by 8 x 8 samples a pixel."""
    phase = np.random.default_rng(seed).uniform(0, 10, 2)
    y, x = np.mgrid[0 : 8 * shape[0], 0 : 8 * shape[1]] / 8
    u = np.floor((0.866 * x + 0.5 * y + phase[0]) / pixels_per_dot)
    v = np.floor((-0.5 * x + 0.866 * y + phase[1]) / pixels_per_dot)
    return ((u + v) % 2).reshape(shape[0], 8, shape[1], 8).mean(axis=(1, 3))


def _bw_nodal(coverage: NDArray[np.float64], noise: float = 0.01, seed: int = 0) -> NDArray[np.float32]:
    grain = np.random.default_rng(seed).normal(1, noise, coverage.shape)
    return ((0.03 + 0.97 * coverage) * grain)[..., None].astype(np.float32) * WHITE.astype(np.float32)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_centres_are_a_fixed_point_of_scipys_kmeans(count: int) -> None:
    nodal = _bw_nodal(_coverage(1))
    result = cluster(nodal, np.ones(nodal.shape[:2], bool), BW, count, WHITE, boundary="nearest")
    Lab = XYZ_to_Lab(nodal.reshape(-1, 3).astype(np.float64), WHITE)
    centres, labels = kmeans2(Lab, result.centres_Lab.copy(), iter=1, minit="matrix", missing="raise")
    # All pixels are in the sample; both sums differ by rounding only.
    np.testing.assert_allclose(centres, result.centres_Lab, atol=1e-9)
    assert np.array_equal(labels, result.labels.ravel())


def test_the_boundary_moves_labels_and_not_centres() -> None:
    coverage = _coverage(1)
    nodal, valid = _bw_nodal(coverage, noise=0.0), np.ones(coverage.shape, bool)
    light, nearest = (cluster(nodal, valid, BW, 2, WHITE, boundary=boundary) for boundary in ("light", "nearest"))
    assert np.array_equal(light.centres_Lab, nearest.centres_Lab)
    # Without blur: half-way in light between the centres, and half-way in L*, which is at a fifth of the light.
    Y = Lab_to_XYZ(light.centres_Lab, WHITE)[:, 1]
    light_at = ((0.03 + 0.97 * coverage) - Y[0]) / (Y[1] - Y[0])
    assert np.array_equal(light.labels == 1, light_at > 0.5)
    assert nearest.labels[(light_at > 0.3) & (light_at < 0.45)].min() == 1


@pytest.mark.parametrize("perceptual", [True, False])
def test_the_kernel_finds_the_nearest_mixture_as_a_search_does(perceptual: bool) -> None:
    rng = np.random.default_rng(0)
    colorants = np.array(list(CMYRGB.values()))
    XYZ = (rng.dirichlet(np.full(6, 0.3), (20, 30)) @ colorants * rng.normal(1, 0.05, (20, 30, 1))).astype(np.float32)
    mixtures = make_mixture_labels(6, [(0, 3, 0.4)])
    centres_Lab = XYZ_to_Lab(np.vstack([colorants, 0.6 * colorants[0] + 0.4 * colorants[3]]), WHITE)
    labels, sizes, squares, shares, halves = label_by_light(
        XYZ, np.ones(XYZ.shape[:2], bool), WHITE, colorants, mixtures.pairs, mixtures.bounds, mixtures.labels,
        centres_Lab, perceptual, False,
    )  # fmt: skip
    t = np.linspace(0, 1, 401)[:, None]
    step = 1e-4 * WHITE
    for row, column in np.ndindex(*XYZ.shape[:2]):
        pixel = XYZ[row, column].astype(np.float64)
        to_Lab = np.array([(XYZ_to_Lab(pixel + d, WHITE) - XYZ_to_Lab(pixel - d, WHITE)) / 2e-4 for d in np.diag(step)])
        metric = to_Lab if perceptual else np.eye(3)
        away, found, slack = [], [], []
        for (p, q), bounds, pair_labels in zip(mixtures.pairs, mixtures.bounds, mixtures.labels, strict=True):
            points = ((1 - t) * colorants[p] + t * colorants[q] - pixel) / WHITE @ metric
            away.append(np.linalg.norm(points, axis=1))
            found.append(pair_labels[np.sum(t > bounds, axis=1)])
            slack.append(np.full(len(t), np.linalg.norm(points[-1] - points[0]) / 400))
        # The search's step is 1/400 of a pair: what lies nearer to the best than that may be either.
        near = np.array(found)[np.array(away) <= np.min(away) + np.array(slack)]
        assert labels[row, column] in near
    assert sizes.sum() == labels.size
    assert shares.sum() == pytest.approx(labels.size)
    assert np.all(halves <= labels.size)
    own = XYZ_to_Lab(XYZ.astype(np.float64), WHITE) - centres_Lab[labels]
    assert squares.sum() == pytest.approx(np.sum(own**2), rel=1e-9)  # 3e-14 in the kernel's cube root


def test_edge_clusters_divide_their_pair_half_way() -> None:
    edges = [(0, 1, 0.3), (0, 1, 0.8), (1, 2, 0.5)]
    mixtures = make_mixture_labels(3, edges)
    assert names_of_clusters("abc", edges) == ("a", "b", "c", "a+b", "a+b-2", "b+c")
    np.testing.assert_allclose(mixtures.bounds[0], [0.15, 0.55, 0.9])
    assert mixtures.labels[0].tolist() == [0, 3, 4, 1]
    assert mixtures.bounds[1].tolist() == [0.5, np.inf, np.inf]
    assert mixtures.labels[2, :3].tolist() == [1, 5, 2]


def test_linear_space_is_kmeans_on_light() -> None:
    coverage = _coverage(1)
    nodal = _bw_nodal(coverage)
    result = cluster(nodal, np.ones(coverage.shape, bool), BW, 3, WHITE, space="linear")
    ratio = nodal.reshape(-1, 3).astype(np.float64) / WHITE
    centres = Lab_to_XYZ(result.centres_Lab, WHITE) / WHITE
    again, labels = kmeans2(ratio, centres.copy(), iter=1, minit="matrix", missing="raise")
    np.testing.assert_allclose(again, centres, atol=1e-9)  # rounding of Lab and back
    # Grain moves a pixel off the line between black and white: the two rules differ at the boundary only.
    assert np.mean(labels == result.labels.ravel()) > 0.999


def test_purity_is_the_share_of_the_colorants_in_a_cluster() -> None:
    coverage = _coverage(2)
    result = cluster(_bw_nodal(coverage), np.ones(coverage.shape, bool), BW, 3, WHITE)
    np.testing.assert_allclose(result.purity.sum(axis=1), 1.0, atol=1e-12)
    true = np.array([coverage[result.labels == k].mean() for k in range(3)])
    # Shares are told between the centres, which are themselves some percent mixed.
    np.testing.assert_allclose(result.purity[:, 1], true, atol=0.05)


def test_lloyd_takes_the_way_of_scipys_kmeans() -> None:
    rng = np.random.default_rng(3)
    points, starts = rng.normal(size=(4000, 3)) * (30, 10, 10), rng.normal(size=(5, 3)) * 10
    centres, labels = lloyd(points, starts)
    expected_centres, expected_labels = kmeans2(points, starts, iter=300, minit="matrix", missing="raise")
    np.testing.assert_allclose(centres, expected_centres, atol=1e-9)  # order of summation
    assert np.array_equal(labels, expected_labels)


def test_labels_are_the_coverages_between_the_centres() -> None:
    """For black and white the label is a threshold on coverage: monotone, and pure pixels are never wrong."""
    coverage = _coverage(2)
    result = cluster(_bw_nodal(coverage, noise=0.0), np.ones(coverage.shape, bool), BW, 3, WHITE)
    assert result.names == ("black", "white", "black+white")
    rank = np.array([0, 2, 1])[result.labels]
    assert np.all(np.diff(rank.ravel()[np.argsort(coverage.ravel(), kind="stable")]) >= 0)
    assert np.all(result.labels[coverage < 0.02] == 0)
    assert np.all(result.labels[coverage > 0.9] == 1)


@pytest.mark.parametrize("gain", [0.4, 1.0, 1.6])
@pytest.mark.parametrize("count", [2, 3])
def test_blurred_nodal_images_of_wrong_exposure_keep_their_names(gain: float, count: int) -> None:
    """A continuum between 0.2 and 0.8 of coverage, and starts that are off by the gain: black stays the darker."""
    coverage = 0.2 + 0.6 * _coverage(4)
    result = cluster(_bw_nodal(coverage) * np.float32(gain), np.ones(coverage.shape, bool), BW, count, WHITE)
    L = result.centres_Lab[:, 0]
    assert result.names[:2] == ("black", "white")
    assert L[0] < L[1]
    assert np.all((L[2:] > L[0]) & (L[2:] < L[1]))
    assert result.shares.min() > 0.1


def test_six_colorants_and_the_edge_between_two_of_them() -> None:
    rng = np.random.default_rng(5)
    primaries = np.array(list(CMYRGB.values()))
    truth = rng.integers(0, 6, (90, 120))
    XYZ = primaries[truth]
    edge = rng.random(truth.shape) < 0.2
    XYZ[edge] = 0.5 * (primaries[2] + primaries[5])  # half yellow, half blue
    XYZ = (XYZ * rng.normal(1, 0.02, truth.shape)[..., None]).astype(np.float32)
    result = cluster(XYZ, np.ones(truth.shape, bool), CMYRGB, 7, WHITE)
    assert result.names == (*CMYRGB, "yellow+blue")
    assert np.array_equal(result.labels, np.where(edge, 6, truth))
    np.testing.assert_allclose(result.shares[6], edge.mean(), atol=1e-12)


def test_edges_of_the_same_parents_are_numbered_from_the_first_parent_to_the_second() -> None:
    coverage = _coverage(6)
    result = cluster(_bw_nodal(coverage), np.ones(coverage.shape, bool), BW, 4, WHITE)
    assert result.names == ("black", "white", "black+white", "black+white-2")
    assert result.centres_Lab[2, 0] < result.centres_Lab[3, 0]


def test_diagnostics_are_what_they_say() -> None:
    nodal = _bw_nodal(_coverage(7))
    valid = np.random.default_rng(0).random(nodal.shape[:2]) < 0.7
    result = cluster(nodal, valid, BW, 3, WHITE)
    assert np.array_equal(result.labels == OUTSIDE, ~valid)
    Lab = XYZ_to_Lab(nodal.astype(np.float64), WHITE)
    for k in range(3):
        own = Lab[result.labels == k]
        # 3e-14 relative in the kernel's cube root; both in float64.
        assert result.spread[k] == pytest.approx(np.sqrt(np.mean(np.sum((own - result.centres_Lab[k]) ** 2, -1))))
        assert result.shares[k] == pytest.approx(len(own) / valid.sum())
    assert result.centre_distances[0, 1] == pytest.approx(np.linalg.norm(result.centres_Lab[0] - result.centres_Lab[1]))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_pixels_that_are_not_valid_change_nothing(seed: int) -> None:
    nodal = _bw_nodal(_coverage(8, shape=(40, 50)))
    valid = np.random.default_rng(seed).random(nodal.shape[:2]) < 0.8
    garbage = np.where(valid[..., None], nodal, np.float32(np.nan))
    one, other = cluster(nodal, valid, BW, 2, WHITE), cluster(garbage, valid, BW, 2, WHITE)
    assert np.array_equal(one.labels, other.labels)
    assert np.array_equal(one.centres_Lab, other.centres_Lab)


def test_the_sample_finds_the_centres_of_all_pixels() -> None:
    nodal = np.tile(_bw_nodal(_coverage(9, shape=(135, 240))), (4, 4, 1))  # half a million pixels
    result = cluster(nodal, np.ones(nodal.shape[:2], bool), BW, 3, WHITE)
    whole, _ = lloyd(XYZ_to_Lab(nodal.reshape(-1, 3).astype(np.float64), WHITE), result.centres_Lab)
    # Sampling error of a mean of 50,000 pixels that spread by 12, three times over, and the slow last steps of Lloyd.
    np.testing.assert_allclose(result.centres_Lab, whole, atol=0.5)


def test_errors_say_what_to_do() -> None:
    nodal, valid = np.ones((8, 8, 3), np.float32), np.ones((8, 8), bool)
    with pytest.raises(CalibrationError, match=r"only 1 colours.*lower clusters\.count"):
        cluster(nodal, valid, BW, 2, WHITE)
    grain = np.random.default_rng(0).normal(0.8, 0.01, (8, 8, 1)).astype(np.float32)
    with pytest.raises(CalibrationError, match="black and on white must differ by at least 5"):
        cluster(grain * WHITE.astype(np.float32), valid, BW, 2, WHITE)
    with pytest.raises(CalibrationError, match="no projector pixel is registered"):
        cluster(nodal, ~valid, BW, 2, WHITE)
    with pytest.raises(InputError, match="at least the number of colorants"):
        cluster(nodal, valid, BW, 1, WHITE)
    with pytest.raises(InputError, match="finite where valid"):
        cluster(nodal * np.float32(np.nan), valid, BW, 2, WHITE)
    with pytest.raises(InputError, match="valid"):
        cluster(nodal, valid[1:], BW, 2, WHITE)


def test_the_map_is_coded_as_fig_3_and_by_the_colorants_else() -> None:
    labels = np.array([[0, 1, 2, 255]], np.uint8)
    picture = label_picture(labels, ("black", "white", "black+white"))
    assert picture.shape == (1, 4, 3)
    assert [int(np.argmax(picture[0, k])) for k in range(3)] == [0, 2, 1]  # red, blue, green
    red, green, edge = cluster_colors(("red", "green", "red+green")).astype(int)
    assert int(np.argmax(red)) == 0
    assert int(np.argmax(green)) == 1
    np.testing.assert_allclose(edge, (red + green) / 2, atol=1)  # whole codes
    named = cluster_colors(("ink-2", "ink", "ink+ink-2", "ink+ink-2-2"))  # a colorant may end in a number too
    assert np.array_equal(named[2], named[3])
    with pytest.raises(InputError, match="below 2"):
        label_picture(labels, ("black", "white"))


def test_the_detail_is_the_middle_enlarged() -> None:
    labels = np.random.default_rng(0).integers(0, 2, (50, 70)).astype(np.uint8)
    detail = label_detail(labels, ("black", "white"), size=(10, 6), zoom=3)
    assert detail.shape == (18, 30, 3)
    assert np.array_equal(detail[::3, ::3], label_picture(labels, ("black", "white"))[22:28, 30:40])
    assert label_detail(labels, ("black", "white"), zoom=1).shape == (50, 70, 3)
