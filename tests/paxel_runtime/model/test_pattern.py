"""The label function is the one truth of a pattern: a torus of cells, turned and scaled."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern, colorant_library

CELLS = np.array([[0, 1, 2], [2, 0, 1]], np.uint8)


def _pattern(dot_size_mm: float = 1.0, angle_deg: float = 0.0, cells: np.ndarray = CELLS) -> Pattern:
    return Pattern("test", ("a", "b", "c"), cells, dot_size_mm, angle_deg, (60.0, 40.0))


def test_without_rotation_the_cells_lie_row_0_lowest_from_the_centre() -> None:
    pattern = _pattern(dot_size_mm=2.0)
    for row in range(2):
        for column in range(3):
            assert pattern.label(2 * column + 1.0, 2 * row + 1.0) == CELLS[row, column]


@given(
    st.floats(0.1, 5),
    st.floats(-180, 180),
    st.floats(-15, 15),
    st.floats(-15, 15),
    st.integers(-2, 2),
    st.integers(-2, 2),
)
def test_it_repeats_along_its_own_axes(
    dot_size_mm: float, angle_deg: float, x_mm: float, y_mm: float, i: int, j: int
) -> None:
    pattern = _pattern(dot_size_mm, angle_deg)
    angle = np.deg2rad(angle_deg)
    u, v = 3 * i * dot_size_mm, 2 * j * dot_size_mm  # whole periods of the 2 x 3 torus
    along = (x_mm * np.cos(angle) + y_mm * np.sin(angle)) / dot_size_mm
    across = (y_mm * np.cos(angle) - x_mm * np.sin(angle)) / dot_size_mm
    moved = (x_mm + u * np.cos(angle) - v * np.sin(angle), y_mm + u * np.sin(angle) + v * np.cos(angle))
    inside = abs(moved[0]) < 30 and abs(moved[1]) < 20
    on_an_edge = min(abs(along - round(along)), abs(across - round(across))) < 1e-6
    if inside and not on_an_edge:
        assert pattern.label(x_mm, y_mm) == pattern.label(*moved)


def test_a_counter_clockwise_turn_carries_the_dots_with_it() -> None:
    x, y = np.meshgrid(np.linspace(-9.7, 9.6, 40) + 0.013, np.linspace(-9.7, 9.6, 40) + 0.017)  # no point on an edge
    c, s = np.cos(np.deg2rad(30)), np.sin(np.deg2rad(30))
    assert np.array_equal(_pattern().label(x, y), _pattern(angle_deg=30).label(c * x - s * y, s * x + c * y))


def test_beyond_its_size_lies_bare_paper() -> None:
    assert _pattern().label([30.1, 0.0, -29.9], [0.0, -20.1, 19.9]).tolist()[:2] == [255, 255]


def test_shares_are_the_areas() -> None:
    assert _pattern().shares() == pytest.approx([1 / 3] * 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dot_size_mm": 0.0}, "dot_size_mm must be > 0, got 0.0"),
        ({"cells": CELLS + np.uint8(1)}, "below its number of colorants"),
        ({"cells": CELLS.astype(int)}, "2-D uint8 array"),
    ],
)
def test_what_is_no_pattern_is_refused(change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _pattern(**change)


def test_the_library_holds_physical_reflectances() -> None:
    for colorant in colorant_library().values():
        assert np.all((colorant.reflectance >= 0) & (colorant.reflectance <= 1))
    Y = {name: spectra_to_XYZ(c.reflectance)[1] for name, c in colorant_library().items()}
    assert max(Y, key=Y.__getitem__) == "white"
    assert min(Y, key=Y.__getitem__) == "black"
    # FOGRA39L: Y 2.10 of black over 87.62 of paper under D50; under equal energy the ratio of two grays is the same
    assert Y["black"] / Y["white"] == pytest.approx(2.10 / 87.62, rel=0.05)
