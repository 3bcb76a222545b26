import numpy as np
import pytest

from paxel_design.patterns import LAYOUTS, LayoutRequest, colorants_of, make_pattern
from paxel_runtime.errors import InputError


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_indices_of_its_colorants_and_is_reproducible(layout):
    request = LayoutRequest(colorants_of(("black", "white")), (0.5, 0.5), seed=3)
    cells = LAYOUTS[layout](request)
    assert cells.dtype == np.uint8
    assert set(np.unique(cells)) == {0, 1}
    assert np.array_equal(cells, LAYOUTS[layout](request))


def test_on_a_checkerboard_every_cell_differs_from_its_four_neighbours_and_equals_its_diagonal_ones():
    cells = make_pattern("checkerboard", ("black", "white"), 0.75, 30, (60, 40)).cells
    for axis in (0, 1):
        assert np.all(cells != np.roll(cells, 1, axis))
    assert np.array_equal(cells, np.roll(cells, (1, 1), (0, 1)))


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, -12.5, 400.0])
def test_label_of_a_turned_checkerboard_is_the_parity_of_the_turned_cell(angle_deg):
    pattern = make_pattern("checkerboard", ("cyan", "red"), 0.75, angle_deg, (60, 40))
    u, v = np.meshgrid(np.arange(-9, 9), np.arange(-9, 9))
    u_mm, v_mm = 0.75 * (u + 0.5), 0.75 * (v + 0.5)
    a = np.deg2rad(angle_deg)
    labels = pattern.label(np.cos(a) * u_mm - np.sin(a) * v_mm, np.sin(a) * u_mm + np.cos(a) * v_mm)
    assert np.array_equal(labels, (u + v) % 2)  # cell (0, 0) has its lower left corner at the origin
    assert np.array_equal(pattern.shares(), [0.5, 0.5])


def test_label_is_bare_paper_beyond_the_area():
    pattern = make_pattern("checkerboard", ("black", "white"), 0.75, 30, (60, 40))
    assert pattern.label(np.array([30.1, 0.0, 29.9]), np.array([0.0, -20.1, 19.9])).tolist()[:2] == [255, 255]
    assert pattern.label(29.9, 19.9) != 255


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"layout": "hexagons"}, "layout must be one of checkerboard"),
        ({"colorants": ("black",)}, "2 to 12 colorants, got 1"),
        ({"colorants": ("red", "green", "blue")}, "exactly 2 colorants, got 3"),
        ({"colorants": ("black", "gold")}, "must be one of white, black.*got 'gold'"),
        ({"colorants": ("black", "black")}, "must be different"),
        ({"angle_deg": float("nan")}, "finite"),
        ({"dot_size_mm": 0.0}, "dot_size_mm must be > 0"),
        ({"size_mm": (60, -1)}, "size_mm must be > 0"),
    ],
)
def test_a_description_that_makes_no_pattern_is_named(change, text):
    description = {
        "layout": "checkerboard",
        "colorants": ("black", "white"),
        "dot_size_mm": 0.75,
        "angle_deg": 30.0,
        "size_mm": (600.0, 400.0),
    }
    with pytest.raises(InputError, match=text):
        make_pattern(**(description | change))


def test_colorants_come_in_the_order_of_their_names():
    assert [colorant.name for colorant in colorants_of(("yellow", "black"))] == ["yellow", "black"]
