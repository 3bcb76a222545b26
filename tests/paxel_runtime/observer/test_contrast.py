"""Contrast of views whose gain is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from paxel_runtime.observer import coherent_gain, lightness_range, local_contrast

SHAPE = (120, 160)
ALL = np.ones(SHAPE, bool)


def _blobs(seed: int) -> np.ndarray:
    return 50 + 60 * gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 3, mode="wrap")


@settings(max_examples=20)
@given(st.integers(0, 99), st.floats(0.1, 1.5), st.floats(-20, 20))
def test_a_known_gain_reads_that_gain(seed: int, gain: float, offset: float) -> None:
    target = _blobs(seed)
    assert coherent_gain(gain * target + offset, target, ALL) == pytest.approx(gain, rel=1e-9)


def test_what_does_not_belong_to_the_target_is_not_counted() -> None:
    target = _blobs(0)
    dots = 5 * (np.indices(SHAPE).sum(axis=0) % 2)
    assert coherent_gain(0.7 * target + dots, target, ALL) == pytest.approx(0.7, abs=0.02)  # a period of 2 px: edges
    assert coherent_gain(0.7 * target + 0.3 * _blobs(1), target, ALL) == pytest.approx(0.7, abs=0.05)  # 1000 blobs
    assert coherent_gain(target, np.full(SHAPE, 50.0), ALL) is None


def test_gradients_across_the_masks_edge_do_not_count() -> None:
    target = _blobs(2)
    inner = ALL.copy()
    inner[40:60, 50:90] = False
    view = np.where(inner, 0.8 * target, 500.0)
    assert coherent_gain(view, target, inner) == pytest.approx(0.8, rel=1e-9)


def test_the_contrast_of_a_grating_is_its_deviation() -> None:
    px_per_degree, x = 40.0, np.arange(400)
    grating = np.broadcast_to(50 + 10 * np.sin(2 * np.pi * x / 5), (100, 400))  # 8 cycles per degree
    mask = np.ones(grating.shape, bool)
    assert local_contrast(grating, mask, px_per_degree) == pytest.approx(10 / np.sqrt(2), rel=1e-3)  # window of 10 px
    assert local_contrast(0.3 * grating + 40, mask, px_per_degree) == pytest.approx(3 / np.sqrt(2), rel=1e-3)
    assert local_contrast(np.full((100, 400), 30.0), mask, px_per_degree) == 0


def test_slow_shading_is_no_local_contrast() -> None:
    px_per_degree = 40.0
    ramp = np.broadcast_to(np.linspace(0, 100, 400), (100, 400))  # 10 L* a degree
    inner = local_contrast(ramp, np.ones(ramp.shape, bool), px_per_degree)
    assert inner == pytest.approx(2.5, rel=0.06)  # sigma of 0.25 degree times the slope; less at both ends


def test_the_range_leaves_out_what_is_rare() -> None:
    L = np.tile(np.linspace(20, 60, 1000), (10, 1))
    L[0, :20] = 100.0
    assert lightness_range(L, np.ones(L.shape, bool)) == pytest.approx([20.2, 59.9], abs=0.15)
