"""Views as pictures for a screen: the way pictures came in, and one gain."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_sRGB, Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.observer import view_to_sRGB

WHITE = np.array([0.94, 1.0, 1.12])


def _smooth_Lab(seed: int, L_mean: float = 50.0, L_range: float = 8.0) -> NDArray[np.float64]:
    blobs = gaussian_filter(np.random.default_rng(seed).normal(size=(80, 120, 3)), (6, 6, 0))
    blobs /= blobs.std(axis=(0, 1))
    return blobs * (L_range, 4, 4) + (L_mean, 0, 0)


def test_a_fixed_exposure_goes_back_the_way_pictures_come_in() -> None:
    Lab = _smooth_Lab(4)
    picture = view_to_sRGB(Lab_to_XYZ(Lab, WHITE), "fixed", WHITE)
    expected = np.rint(255 * np.clip(Lab_to_sRGB(Lab), 0, 1))
    assert picture.dtype == np.uint8
    assert np.max(np.abs(picture - expected)) <= 1  # float32 beside a rounding edge
    assert np.all(view_to_sRGB(WHITE[None, None], "fixed", WHITE) == 255)


def test_auto_exposure_is_one_gain() -> None:
    view = Lab_to_XYZ(_smooth_Lab(5, L_mean=25, L_range=4), WHITE)
    picture = view_to_sRGB(view, "auto", WHITE)
    bright = np.percentile(view[..., 1], 99.5)
    expected = view_to_sRGB(view * 0.9 / bright, "fixed", WHITE)
    assert np.max(np.abs(picture.astype(int) - expected)) <= 1  # float32 beside a rounding edge
    assert np.array_equal(view_to_sRGB(0.3 * view, "auto", WHITE), picture)
    assert not view_to_sRGB(0 * view, "auto", WHITE).any()
    with pytest.raises(InputError, match="fixed or auto"):
        view_to_sRGB(view, "bright", WHITE)


def test_the_wall_around_the_picture_does_not_set_the_exposure() -> None:
    view = Lab_to_XYZ(_smooth_Lab(5, L_mean=25, L_range=4), WHITE)
    alone = view_to_sRGB(view[:, 40:], "auto", WHITE)
    view[:, :40] = WHITE
    mask = np.broadcast_to(np.arange(120) >= 40, (80, 120))
    assert np.array_equal(view_to_sRGB(view, "auto", WHITE, mask=mask)[:, 40:], alone)
    assert np.array_equal(
        view_to_sRGB(view, "auto", WHITE, mask=~mask)[:, :1], view_to_sRGB(view, "auto", WHITE)[:, :1]
    )


def test_a_preview_goes_through_the_eye() -> None:
    dots = (np.indices((60, 60)).sum(axis=0) % 2)[..., None] * WHITE
    picture = view_to_sRGB(dots, "fixed", WHITE, sigma_px=3.0)[15:-15, 15:-15]  # the border is repeated: 0 0 1 0 1
    L = XYZ_to_Lab(0.5 * WHITE, WHITE)[0]
    assert np.all(picture == np.rint(255 * Lab_to_sRGB(np.array([L, 0, 0]))))
