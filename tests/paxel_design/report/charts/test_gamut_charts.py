"""Charts and maps of gamuts and pictures: what is drawn is what was given, and gray print keeps its order."""

import io

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from paxel_design.report.charts.chromaticity import chromaticity_chart
from paxel_design.report.charts.hue import hue_chart
from paxel_design.report.charts.lightness import lightness_chart
from paxel_design.report.charts.maps import (
    MOST_GHOST_L,
    MOST_MOVED_DE00,
    ghost_picture,
    moved_map,
    scales_chart,
)
from paxel_design.report.charts.style import style
from paxel_runtime.model.colorimetry import sRGB_to_Lab

TRIANGLE = np.array([[10.0, 20.0], [60.0, 60.0], [15.0, 80.0]])


def _svg(figure: Figure) -> str:
    file = io.StringIO()
    with matplotlib.rc_context(style()):
        figure.savefig(file, format="svg")
    return file.getvalue()


def test_the_lightness_chart_draws_the_area_and_its_rectangle() -> None:
    figure = lightness_chart(TRIANGLE, (20.0, 30.0), (40.0, 55.0), "gray sheet")
    (axes,) = figure.axes
    drawn = [np.asarray(patch.get_xy()) for patch in axes.patches if hasattr(patch, "get_closed")]
    assert any(TRIANGLE.shape[0] + 1 <= len(xy) and np.allclose(xy[:3], TRIANGLE) for xy in drawn)
    assert any({(20.0, 40.0), (30.0, 55.0)} <= set(map(tuple, xy.tolist())) for xy in drawn)
    svg = _svg(figure)
    assert "L* on the gray sheet" in svg
    assert "<pattern" in svg  # a hatch: told apart without colour


def test_the_hue_chart_has_one_panel_an_angle_and_room_for_all() -> None:
    figure = hue_chart({45.0: (TRIANGLE, TRIANGLE / 3), 180.0: (TRIANGLE / 2, TRIANGLE / 5)})
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == ["hue turned by 45°", "hue turned by 180°"]
    for axes in figure.axes:
        assert axes.get_xlim()[1] > np.hypot(*TRIANGLE.T).max()
    assert "any: at some lightnesses" in _svg(figure)


def test_the_chromaticity_chart_names_the_primaries() -> None:
    svg = _svg(
        chromaticity_chart(
            {"uv-red": (0.6, 0.33), "uv-green": (0.24, 0.57), "uv-blue": (0.18, 0.1)},
            {"D65": (0.3127, 0.329)},
            (0.32, 0.31),
        )
    )
    assert all(words in svg for words in ("uv-red", "uv-green", "uv-blue", "white D65", "sRGB"))


@pytest.mark.parametrize(("picture", "low", "high", "darker"), [
    (moved_map, 0.0, MOST_MOVED_DE00, True),
    (ghost_picture, -MOST_GHOST_L, MOST_GHOST_L, False),
])  # fmt: skip
def test_scales_keep_their_order_in_gray_print(picture, low: float, high: float, darker: bool) -> None:  # type: ignore[no-untyped-def]
    values = np.linspace(low, high, 33)[None]
    L = sRGB_to_Lab(picture(values)[0] / 255)[:, 0]
    assert np.all(np.diff(-L if darker else L) > 0.3)  # each step is lighter or darker than the last
    beyond = picture(np.array([[low - 100, high + 100]]))
    np.testing.assert_array_equal(beyond, picture(np.array([[low, high]])))


def test_nothing_left_is_mid_gray_and_the_scales_say_what_they_are() -> None:
    np.testing.assert_array_equal(ghost_picture(np.zeros((1, 1))), np.full((1, 1, 3), 128))
    assert "what is left of the other picture" in _svg(scales_chart(ghosts=True))
    assert "what is left of the other picture" not in _svg(scales_chart(ghosts=False))
