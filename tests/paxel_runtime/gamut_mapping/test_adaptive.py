"""Adaptive mapping of picture pairs: what it promises of every pixel, of the whole picture, and from frame to frame."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_design.gamut import JointGamut, sub_gamut
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.gamut_mapping import (
    AdaptiveOptions,
    AdaptivePair,
    Mapped,
    fit_pair_curves,
    map_pair,
    map_to_subgamut,
)
from paxel_runtime.gamut_mapping.chroma_room import LEAST_CHROMA, ChromaReturn
from paxel_runtime.gamut_mapping.pair_pull import deepest_grays, pull_inside
from paxel_runtime.gamut_mapping.spline_grid import SplineGrid
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import PairGamut, SubGamut

H, W = 72, 128
VIEWER = AdaptiveOptions(px_per_degree=32.0)
FLOAT32 = 1e-6
"""What rounding Lab to float32 may move a pair, XYZ."""

Picture = NDArray[np.float32]


def _photograph(seed: int, shape: tuple[int, int] = (H, W)) -> Picture:
    """Large light and dark areas with finer detail and some colour, as in a photograph."""
    rng = np.random.default_rng(seed)

    def noise(sigma: float) -> NDArray[np.float64]:
        values = gaussian_filter(rng.normal(size=shape), sigma, mode="wrap")
        return values / values.std()

    Lab = np.stack([50 + 22 * noise(14) + 9 * noise(2.5), 12 * noise(8), 14 * noise(11)], axis=-1)
    Lab[..., 0] = np.clip(Lab[..., 0], 2, 98)
    return Lab.astype(np.float32)


def _text(seed: int) -> Picture:
    """Black strokes on white everywhere, without relation between two seeds."""
    rng = np.random.default_rng(seed)
    strokes = np.kron(rng.random((H // 3, W // 4)) < 0.4, np.ones((3, 4)))
    Lab = np.zeros((H, W, 3), np.float32)
    Lab[..., 0] = np.where(strokes > 0, 5, 95)
    return Lab


Setup = tuple[PairGamut, SubGamut, SubGamut]


@pytest.fixture(scope="module")
def setup(bw_model: Callable[[int], PredictionModel]) -> Setup:
    model = bw_model(2)
    return (
        JointGamut(model).pairs,
        sub_gamut(model, "dual-image", shown_on="pattern"),
        sub_gamut(model, "dual-image", shown_on="white"),
    )


def _static(setup: Setup, sources: tuple[Picture, Picture]) -> tuple[Mapped, Mapped]:
    return map_to_subgamut(sources[0], setup[1]), map_to_subgamut(sources[1], setup[2])


def _slack(pairs: PairGamut, Lab: tuple[Picture, Picture]) -> NDArray[np.float64]:
    return pairs.slack(*(Lab_to_XYZ(picture.astype(np.float64), pairs.white_point) for picture in Lab))


@pytest.fixture(scope="module")
def mapped(setup: Setup) -> tuple[tuple[Picture, Picture], tuple[Mapped, Mapped], AdaptivePair]:
    sources = _photograph(0), _photograph(1)
    static = _static(setup, sources)
    return sources, static, map_pair(sources, static, setup[0], VIEWER)


def test_photographs_gain_contrast_and_keep_colour(mapped) -> None:  # type: ignore[no-untyped-def]
    *_, pair = mapped
    assert pair.method == "adaptive"
    assert pair.figures["gain"] > 1.3  # the target for photographs
    assert min(pair.figures["gain_pattern"], pair.figures["gain_white"]) > 1.2
    assert min(pair.figures["chroma_pattern"], pair.figures["chroma_white"]) > 0.85
    assert pair.figures["pixels_pulled"] < 0.01
    assert "times that of static mapping" in pair.why


def test_every_pair_can_be_shown(setup: Setup, mapped) -> None:  # type: ignore[no-untyped-def]
    assert _slack(setup[0], mapped[2].Lab).min() >= -FLOAT32


def test_lightness_rises_with_the_pixels_own_and_hue_stays(setup: Setup, mapped) -> None:  # type: ignore[no-untyped-def]
    sources, _, pair = mapped
    for s, curves in enumerate(pair.curves.tone):
        assert np.diff(curves.control, axis=2).min() >= 0
        L = curves.apply(sources[s][..., 0])
        untouched = np.abs(L - pair.Lab[s][..., 0]) < 1e-4  # not pulled
        assert untouched.mean() > 0.99
        before, after = sources[s][untouched], pair.Lab[s][untouched]
        cross = before[:, 1] * after[:, 2] - before[:, 2] * after[:, 1]
        size = np.hypot(before[:, 1], before[:, 2]) * np.hypot(after[:, 1], after[:, 2])
        assert np.all(np.abs(cross) <= 1e-5 * size + 1e-5)  # float32


def test_no_detail_of_the_other_picture_gets_in(setup: Setup, mapped) -> None:  # type: ignore[no-untyped-def]
    """This picture's pixels are what its own curves make of its own pixels, pulled ones apart."""
    sources, static, pair = mapped
    for s, curves in enumerate(pair.curves.tone):
        own = pair.curves.chroma[s].apply(sources[s], static[s].Lab, curves.apply(sources[s][..., 0]))
        same = np.all(np.abs(own - pair.Lab[s]) < 1e-4, axis=-1)
        assert same.mean() > 0.99


def test_text_over_text_stays_static_and_says_so(setup: Setup) -> None:
    sources = _text(0), _text(1)
    static = _static(setup, sources)
    pair = map_pair(sources, static, setup[0], VIEWER)
    assert pair.method == "static"
    assert "no room" in pair.why
    assert pair.Lab[0] is static[0].Lab
    assert pair.Lab[1] is static[1].Lab
    assert pair.figures["gain"] < 1.05


def test_a_uniform_picture_leaves_the_other_its_room(setup: Setup) -> None:
    gray = np.zeros((H, W, 3), np.float32)
    gray[..., 0] = 50
    sources = _photograph(2), gray
    pair = map_pair(sources, _static(setup, sources), setup[0], VIEWER)
    assert pair.figures["gain_white"] is None
    assert pair.figures["gain"] == pair.figures["gain_pattern"]
    assert pair.figures["gain"] > 1.5  # the whole height of the joint gamut instead of half
    assert _slack(setup[0], pair.Lab).min() >= -FLOAT32


def test_only_what_is_shown_counts(setup: Setup, mapped) -> None:  # type: ignore[no-untyped-def]
    """What lies outside the mask has no say in the curves, and is in the joint gamut all the same."""
    sources, static, _ = mapped
    mask = np.zeros((H, W), np.bool_)
    mask[:, : W // 2] = True
    spoilt = tuple(np.where(mask[..., None], source, source[::-1, ::-1]) for source in sources)
    spoilt_static = tuple(replace(one, Lab=np.where(mask[..., None], one.Lab, one.Lab[::-1, ::-1])) for one in static)
    of_half = map_pair(sources, static, setup[0], VIEWER, mask=mask)
    of_spoilt = map_pair(spoilt, spoilt_static, setup[0], VIEWER, mask=mask)
    np.testing.assert_allclose(of_spoilt.curves.tone[0].control, of_half.curves.tone[0].control, atol=1e-9)
    assert _slack(setup[0], of_spoilt.Lab).min() >= -FLOAT32


def _fit_with_noise(setup: Setup, sources: tuple[Picture, Picture], seed: int, **held):  # type: ignore[no-untyped-def]
    """Curves for pictures with noise of 1 L*, as of a camera's film."""
    noise = np.random.default_rng(seed).normal(size=(2, H, W)).astype(np.float32)
    noisy = sources[0].copy(), sources[1].copy()
    for s in range(2):
        noisy[s][..., 0] = np.clip(noisy[s][..., 0] + noise[s], 0, 100)
    return fit_pair_curves(noisy, _static(setup, noisy), setup[0], **held)


def test_steady_from_frame_to_frame(setup: Setup, mapped) -> None:  # type: ignore[no-untyped-def]
    """Two frames that differ in noise of 1 L* get nearly the same curves; persistence steadies these."""
    sources = mapped[0]

    def moved(one, two) -> float:  # type: ignore[no-untyped-def]
        """Mean change of the targets of the noiseless pictures, L*."""
        targets = [[curves.tone[s].apply(sources[s][..., 0]) for s in range(2)] for curves in (one, two)]
        return float(np.mean(np.abs(np.subtract(*targets))))

    before, after = (_fit_with_noise(setup, sources, seed, options=VIEWER) for seed in (5, 6))
    assert moved(before, after) < 0.4  # noise of 1 L* in, and less than half of it out: half of what is seen
    steady = replace(VIEWER, persistence=0.8)
    kept = _fit_with_noise(setup, sources, 6, options=steady, previous=before)
    # a fifth, but for the noise in the picture's own ends of lightness
    assert moved(before, kept) < 0.3 * moved(before, after)
    smaller = before.tone[0].grid.__class__(H, W, (1, 1), 8)
    with pytest.raises(InputError, match="the frame before"):
        shrunk = replace(before.tone[0], grid=smaller, control=np.zeros(smaller.shape))
        _fit_with_noise(setup, sources, 6, options=steady, previous=replace(before, tone=(shrunk, shrunk)))


def test_pulled_pairs_end_on_the_boundary_on_their_ray(setup: Setup) -> None:
    pairs, rng = setup[0], np.random.default_rng(3)
    white = pairs.white_point
    Lab = [rng.uniform((10, -20, -20), (90, 20, 20), (40, 50, 3)).astype(np.float32) for _ in range(2)]
    before = np.concatenate([Lab_to_XYZ(p.astype(np.float64), white) for p in Lab], axis=-1)
    outside = (before @ pairs.normals.T - pairs.offsets).max(axis=-1) > FLOAT32
    assert 0.2 < outside.mean() < 0.98
    anchor = deepest_grays(pairs)
    pulled = [p.copy() for p in Lab]
    moved = pull_inside(pulled[0], pulled[1], pairs, anchor)
    unclear = np.abs((before @ pairs.normals.T - pairs.offsets).max(axis=-1)) <= FLOAT32
    np.testing.assert_array_equal(moved[~unclear], outside[~unclear])
    for was, now in zip(Lab, pulled, strict=True):
        np.testing.assert_array_equal(now[~moved], was[~moved])
    after = np.concatenate([Lab_to_XYZ(p.astype(np.float64), white) for p in pulled], axis=-1)
    slack = pairs.offsets - after @ pairs.normals.T
    assert np.abs(slack.min(axis=-1)[moved]).max() < 2 * FLOAT32
    ray, way = (after - anchor)[moved], (before - anchor)[moved]
    share = np.sum(ray * way, axis=1) / np.sum(way * way, axis=1)
    np.testing.assert_allclose(ray, share[:, None] * way, atol=FLOAT32)


def test_the_deepest_grays_are_farthest_from_the_boundary(setup: Setup) -> None:
    pairs = setup[0]
    deepest = float(np.min(pairs.offsets - pairs.normals @ deepest_grays(pairs)))
    s, t = np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60))
    grid = pairs.slack(s[..., None] * pairs.white_point, t[..., None] * pairs.white_point)
    assert 0 < deepest - grid.max() < 0.02  # a step of the grid
    shut = PairGamut(pairs.normals, pairs.offsets - 1, pairs.white_point)
    with pytest.raises(GamutError, match="two pictures cannot be shown at once"):
        deepest_grays(shut)


def test_returns_of_chroma(mapped) -> None:  # type: ignore[no-untyped-def]
    """-1 is the least share of static mapping's chroma, 0 that chroma, 1 the source's."""
    sources, static, _ = mapped
    grid = SplineGrid(H, W, (2, 3))
    L = static[0].Lab[..., 0].copy()
    for u, wanted in (
        (-1.0, LEAST_CHROMA * static[0].Lab[..., 1:]),
        (0.0, static[0].Lab[..., 1:]),
        (1.0, sources[0][..., 1:]),
    ):
        target = ChromaReturn(grid, np.full(grid.shape, u)).apply(sources[0], static[0].Lab, L)
        np.testing.assert_array_equal(target[..., 0], L)
        np.testing.assert_allclose(target[..., 1:], wanted, atol=2e-4)  # float32, and hue of static mapping's


def test_what_cannot_be_mapped(setup: Setup, mapped) -> None:  # type: ignore[no-untyped-def]
    sources, static, _ = mapped
    with pytest.raises(InputError, match="one shape"):
        map_pair((sources[0], sources[1][:-1]), static, setup[0], VIEWER)
    with pytest.raises(InputError, match="mask"):
        map_pair(sources, static, setup[0], VIEWER, mask=np.zeros((H, W), np.bool_))
    with pytest.raises(InputError, match="pixels per degree"):
        AdaptiveOptions(0.0)
    with pytest.raises(InputError, match="persistence"):
        AdaptiveOptions(40.0, persistence=1.0)
