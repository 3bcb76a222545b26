"""Dots seen from too near: textures of known strength, and the least distance against the eye's blur itself."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import InputError
from paxel_runtime.observer import eye_blur, eye_sigma_mm, minimum_distance_mm, texture_ghost_percent, texture_window_px
from paxel_runtime.observer.texture import TEXTURE_SEEN_L

SHAPE = (200, 300)
ALL = np.ones(SHAPE, bool)
MM_PER_PX = 0.15


def _checker(dot_px: int) -> NDArray[np.float64]:
    y, x = np.indices(SHAPE) // dot_px
    return np.where((x + y) % 2, 1.0, -1.0)


def _blobs(seed: int) -> NDArray[np.float64]:
    picture = gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 15, mode="wrap")
    return 50 + 8 * picture / picture.std()


def test_the_window_grows_with_the_dots_and_the_colorants() -> None:
    assert texture_window_px(5.0, 2) == pytest.approx(7.5)
    assert texture_window_px(5.0, 6) == pytest.approx(22.5)
    with pytest.raises(InputError, match="dots > 0"):
        texture_window_px(0.0, 2)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2])
def test_texture_that_follows_the_other_picture_is_read(share: float) -> None:
    own, other = _blobs(0), _blobs(1)
    view = own + (8 + share * (other - 50)) * _checker(2)  # never below 0: 5 sigma
    percent = texture_ghost_percent(view, own, other, ALL, texture_window_px(2, 2))
    assert percent == pytest.approx(100 * share, abs=100 * 0.03 * share + 0.2)  # blobs change a little in a window
    assert texture_ghost_percent(view, own, np.full(SHAPE, 50.0), ALL, 3.0) is None


def test_texture_of_its_own_picture_is_no_ghost() -> None:
    own, other = _blobs(0), _blobs(1)
    view = own + 0.1 * (own - 20) * _checker(2)
    percent = texture_ghost_percent(view, own, other, ALL, texture_window_px(2, 2))
    assert percent is not None
    assert percent < 0.2


@pytest.mark.parametrize("dot_px", [4, 6])
def test_the_least_distance_is_where_the_blurred_dots_reach_the_limit(dot_px: int) -> None:
    """By the eye's own blur of the same dots, with the slope of L* at their mean: no spectrum."""
    Y = np.full(SHAPE, 0.2)
    view = Y + 0.12 * _checker(dot_px)
    distance_mm = minimum_distance_mm(view, Y, ALL, MM_PER_PX, texture_window_px(dot_px, 2))

    def texture_L(at_mm: float) -> float:
        rest = eye_blur(view - Y, eye_sigma_mm(at_mm) / MM_PER_PX)[30:-30, 30:-30]
        return float(np.std(rest)) * 116 / 3 * 0.2 ** (-2 / 3)

    # 3 %: the frame's edge, where dots have no neighbours, which only the spectrum sees
    assert texture_L(0.97 * distance_mm) > TEXTURE_SEEN_L > texture_L(1.01 * distance_mm)


def test_twice_the_dots_twice_the_distance() -> None:
    Y = np.full(SHAPE, 0.2)
    near, far = (minimum_distance_mm(Y + 0.1 * _checker(d), Y, ALL, MM_PER_PX, texture_window_px(d, 2)) for d in (3, 6))
    assert far / near == pytest.approx(2, rel=0.1)  # harmonics of the raster and the frame's edge differ
    assert minimum_distance_mm(Y, Y, ALL, MM_PER_PX, 5.0) == 100  # nothing to see from anywhere


def test_slow_errors_are_no_texture() -> None:
    Y, x = np.full(SHAPE, 0.2), np.indices(SHAPE)[1]
    slow = Y + 0.05 * np.sin(2 * np.pi * x / 150)
    assert minimum_distance_mm(slow, Y, ALL, MM_PER_PX, 5.0) < 600  # of 5 % in Y, as long as 22 mm; dots: metres
