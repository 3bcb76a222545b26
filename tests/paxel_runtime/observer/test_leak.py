"""What the projection image gives away: pictures hidden in known ways."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import linear_sRGB_to_XYZ, sRGB_to_linear_sRGB
from paxel_runtime.observer import codes_to_Y, leak_figures

SHAPE = (200, 240)
ALL = np.ones(SHAPE, bool)
CHECKER = np.where(np.indices(SHAPE).sum(axis=0) // 2 % 2, 1.0, -1.0)


def _blobs(seed: int) -> np.ndarray:
    picture = gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 8, mode="wrap")
    return 50 + 10 * picture / picture.std()


def test_a_picture_in_plain_sight_is_found_blurred_and_one_in_the_dots_by_them() -> None:
    plain, hidden = _blobs(0), _blobs(1)
    Y = 0.3 * (0.9 + 0.002 * plain) ** 3 * (1 + 0.02 * (hidden - 20) * np.clip(CHECKER, -1, 1)).clip(0)
    for picture, other, key, free in ((plain, hidden, "blurred", "texture"), (hidden, plain, "texture", "blurred")):
        leak = leak_figures(Y, picture, other, ALL, 4.0, 4.0)
        assert leak[key] is not None
        assert leak[key] > 0.9  # type: ignore[operator]
        if picture is hidden:  # brighter places have stronger dots, so the plain picture is in both
            assert leak[free] < 0.1  # type: ignore[operator]


def test_noise_leaks_nothing_and_a_uniform_picture_has_nothing_to_leak() -> None:
    Y = np.random.default_rng(0).random(SHAPE)
    leak = leak_figures(Y, _blobs(2), None, ALL, 4.0, 4.0)
    assert max(v or 0 for v in leak.values()) < 0.2  # 700 windows of independent noise: 1 / sqrt(700), five times
    assert leak_figures(Y, np.full(SHAPE, 50.0), _blobs(2), ALL, 4.0, 4.0) == {"blurred": None, "texture": None}


def test_what_goes_with_the_other_picture_is_not_counted_twice() -> None:
    plain = _blobs(3)
    hidden = 0.6 * plain + 0.4 * _blobs(4)
    leak = leak_figures(0.2 * (plain / 50) ** 3, hidden, plain, ALL, 2.0, 4.0)
    assert leak["blurred"] is not None
    assert leak["blurred"] < 0.1  # alone it would be 0.8


def test_luminance_on_a_screen() -> None:
    codes = np.array([[[255, 255, 255], [0, 0, 0], [10, 200, 90]]], np.uint8)
    Y = codes_to_Y(codes, 8)
    np.testing.assert_allclose(Y, linear_sRGB_to_XYZ(sRGB_to_linear_sRGB(codes / 255))[..., 1], rtol=1e-5)
    assert codes_to_Y(np.full((1, 1, 1), 1023, np.uint16), 10) == pytest.approx(1)
    with pytest.raises(InputError, match="one shape"):
        leak_figures(Y, np.zeros((2, 2)), None, np.ones((1, 3), bool), 1.0, 1.0)
