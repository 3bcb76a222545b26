import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_design.patterns.snapping import (
    ANGLE_TOLERANCE_DEG,
    SIZE_TOLERANCE,
    check_dots,
    snap_to_printer,
)
from paxel_runtime.errors import InputError


def test_the_tangent_of_a_third_at_1440_dpi_is_27_and_9_pixels():
    snapped = snap_to_printer(0.5, np.rad2deg(np.arctan(1 / 3)), 1440)
    assert snapped.step_px == (27, 9)
    assert snapped.angle_deg == pytest.approx(np.rad2deg(np.arctan(1 / 3)), abs=1e-12)
    assert snapped.dot_size_mm == pytest.approx(np.hypot(27, 9) * 25.4 / 1440, abs=1e-12)


@given(
    st.floats(0.3, 2.0),
    st.floats(-360, 360),
    st.sampled_from([360, 600, 720, 1200, 1440, 2400]),
)
def test_every_cell_is_made_of_the_same_pixels_and_the_move_is_small(dot_size_mm, angle_deg, dpi):
    try:
        snapped = snap_to_printer(dot_size_mm, angle_deg, dpi)
    except InputError:  # what it says is tested below
        return
    assert abs(snapped.angle_deg - angle_deg) <= ANGLE_TOLERANCE_DEG + 1e-9
    assert abs(snapped.dot_size_mm / dot_size_mm - 1) <= SIZE_TOLERANCE + 1e-9
    # both edges of a cell are whole pixels, so every cell is the first one moved by whole pixels
    angle, length_px = np.deg2rad(snapped.angle_deg), snapped.dot_size_mm * dpi / 25.4
    edges_px = length_px * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    assert np.abs(edges_px - np.rint(edges_px)).max() < 1e-9
    assert np.rint(edges_px[0]).tolist() == list(snapped.step_px)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 45.0, 200.0])
def test_no_other_step_lies_nearer(angle_deg):
    dpi, dot = 1440, 1.0
    snapped = snap_to_printer(dot, angle_deg, dpi)

    def cost(size_mm, angle):
        turn = (angle - angle_deg + 180) % 360 - 180
        return np.maximum(abs(turn) / ANGLE_TOLERANCE_DEG, abs(size_mm / dot - 1) / SIZE_TOLERANCE)

    a, b = np.meshgrid(np.arange(-70, 71), np.arange(-70, 71))
    every = cost(np.hypot(a, b) * 25.4 / dpi, np.rad2deg(np.arctan2(b, a)))
    assert cost(snapped.dot_size_mm, snapped.angle_deg) == pytest.approx(every.min(), abs=1e-9)


def test_the_printers_grid_of_2400_dpi_holds_every_angle_of_the_papers_dots():
    # at 70 pixels a dot steps lie 0.8 degrees apart at most, so one is always within half a degree
    for angle_deg in np.arange(0, 90, 1.0):
        snap_to_printer(0.75, angle_deg, 2400)


@pytest.mark.parametrize(("dot_size_mm", "angle_deg", "dpi"), [(0.75, 30, 360), (0.5, 30, 720), (0.2, 17, 1440)])
def test_what_cannot_be_snapped_is_told_with_what_would_work(dot_size_mm, angle_deg, dpi):
    with pytest.raises(InputError, match="snap must find a lattice") as error:
        snap_to_printer(dot_size_mm, angle_deg, dpi)
    text = str(error.value)
    assert "snap = false" in text
    words = text.split("set ")[1].replace(",", " ").split()
    values = {word: float(words[i + 2]) for i, word in enumerate(words) if word in ("angle_deg", "printer.dpi")}
    sizes = [float(words[i + 2]) for i, word in enumerate(words) if word == "dot_size_mm"]
    alone = [float(words[i + 2]) for i, word in enumerate(words) if word == "dot_size_mm" and words[i + 3] == "alone"]
    assert values or sizes
    for size in alone:
        snap_to_printer(size, angle_deg, dpi)
    if "with angle_deg" in text:
        both = text.split("dot_size_mm = ")[1].split(" with angle_deg = ")
        snap_to_printer(float(both[0]), float(both[1].split(",")[0]), dpi)
    if "printer.dpi" in values:
        snap_to_printer(dot_size_mm, angle_deg, values["printer.dpi"])


def test_a_dot_needs_three_pixels():
    check_dots(0.0530, 1440)
    with pytest.raises(InputError, match=r"at least 3 dots of the printer, got 2.83 .*0.053 mm or 1524 dpi"):
        check_dots(0.05, 1440)
    with pytest.raises(InputError, match="dot_size_mm must be > 0"):
        snap_to_printer(0.0, 30, 1440)


def test_every_snapped_cell_has_the_same_number_of_pixels():
    snapped = snap_to_printer(0.5, 18, 1440)
    x, y = np.meshgrid(np.arange(-400, 400) + 0.63, np.arange(-400, 400) + 0.57)  # no centre lies on an edge
    angle = np.deg2rad(snapped.angle_deg)
    dot_px = np.hypot(*snapped.step_px)
    column = np.floor((np.cos(angle) * x + np.sin(angle) * y) / dot_px).astype(int)
    row = np.floor((np.cos(angle) * y - np.sin(angle) * x) / dot_px).astype(int)
    inner = (abs(column) < 9) & (abs(row) < 9)
    counts = np.unique(column[inner] * 100 + row[inner], return_counts=True)[1]
    assert set(counts) == {snapped.step_px[0] ** 2 + snapped.step_px[1] ** 2}
