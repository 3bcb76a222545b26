"""Nodal images: reflectance whatever the light falls off to, whichever way they are normalised."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.calibration.nodal import nodal_reflectance, nodal_to_linear_sRGB, reflectance_picture
from paxel_runtime.registration import ChannelRegistration

W, H = 120, 80
DOT_PX = 5.0
RGB = ("red", "green", "blue")
FALL_OFF = (1 - 0.5 * ((np.arange(W) / W - 0.5) ** 2 + (np.arange(H)[:, None] / H - 0.5) ** 2)).astype(np.float64)
ROW, COLUMN = np.mgrid[:H, :W]
INK = np.where((ROW // 5 + COLUMN // 5) % 2 == 0, 0.05, 1.0)


def _tables(channels: tuple[str, ...]) -> dict[str, ChannelRegistration]:
    xy = np.stack([COLUMN, ROW], axis=-1).astype(np.float32)  # the camera sees with the projector's eyes
    table = SimpleNamespace(camera_xy=xy, valid=np.ones((H, W), bool))  # what a registration is asked for here
    return cast(dict[str, ChannelRegistration], dict.fromkeys(channels, table))


def _captures(white: float = 1.0) -> Callable[[str], NDArray[np.uint16]]:
    """Pictures of the pattern and of a sheet of a given reflectance; black level 500."""

    def capture(name: str) -> NDArray[np.uint16]:
        lit = "dark" not in name and "black" not in name
        on = INK if name.startswith(("pattern", "light")) else np.full((H, W), white)
        plane = np.rint(500 + 40_000 * lit * on * FALL_OFF).astype(np.uint16)
        three = name.endswith(("-white", "-black")) and not name.startswith("light")
        return np.stack([plane] * 3, axis=-1) if three else plane

    return capture


def test_white_paper_takes_out_fall_off_and_black() -> None:
    nodal = nodal_reflectance(_captures(), RGB, _tables(RGB))
    assert nodal.shape == (H, W, 3)
    assert nodal.dtype == np.float32
    np.testing.assert_allclose(nodal[..., 1], INK, atol=5e-5)  # whole numbers of 40,000
    assert np.array_equal(nodal_to_linear_sRGB(nodal, ("blue", "red", "green")), nodal[..., [1, 2, 0]])


def test_a_gray_sheet_would_double_it_and_paper_does_not() -> None:
    gray, tables = _captures(0.5), _tables(RGB)
    np.testing.assert_allclose(nodal_reflectance(gray, RGB, tables)[..., 0], 2 * INK, atol=2e-4)
    paper = lambda name: _captures()(name) if name.startswith("paper") else gray(name)  # noqa: E731
    np.testing.assert_allclose(nodal_reflectance(paper, RGB, tables, normalise="paper")[..., 0], INK, atol=5e-5)


@pytest.mark.parametrize("channels", [RGB, ("uv",)])
def test_light_without_a_white_sheet_is_divided_by_its_own_field(channels: tuple[str, ...]) -> None:
    def no_sheet(name: str) -> NDArray[np.uint16]:
        assert name.startswith(("pattern", "light"))
        return _captures()(name)

    nodal = nodal_reflectance(no_sheet, channels, _tables(channels), normalise="field", dot_px=DOT_PX)
    assert nodal.shape == (H, W, 3)  # of one channel the camera's planes
    assert nodal_to_linear_sRGB(nodal, channels).shape == (H, W, 3)
    inner = (slice(15, -15), slice(15, -15))
    bright = nodal[inner][INK[inner] == 1]
    # The mean is taken over six dots (30 px), over which this fall-off changes by some percent.
    assert bright.mean() == pytest.approx(1.0, abs=0.05)
    assert bright.std() < 0.03
    np.testing.assert_allclose(nodal[inner][INK[inner] != 1].mean(), 0.05, atol=0.01)


def test_where_no_light_falls_nothing_is_known() -> None:
    def half(name: str) -> NDArray[np.uint16]:
        picture = _captures()(name).copy()
        picture[:, : W // 2] = 500
        return picture

    nodal = nodal_reflectance(half, RGB, _tables(RGB))
    assert np.isnan(nodal[:, : W // 2 - 1]).all()
    assert np.isfinite(nodal[:, W // 2 :]).all()


def test_the_print_over_the_sheet_in_the_cameras_raster() -> None:
    picture = reflectance_picture(_captures(), "white")
    assert picture.shape == (H, W, 3)
    np.testing.assert_allclose(picture, np.repeat(INK[..., None], 3, axis=-1), atol=5e-5)
