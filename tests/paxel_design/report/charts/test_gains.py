"""Bars of gains and ranges of gray sheets: what is drawn is what was given."""

from itertools import pairwise

import pytest

from paxel_design.report.charts.gains import GainBar, gains_chart, shared_ranges_chart

GROUPS = [
    ("For a larger effect", [GainBar("a change of many words that has to be wrapped into two lines", 12.3, 45.6)]),
    ("For less", [GainBar("b", 400.0), GainBar("c", -3.0)]),
]


def test_every_gain_is_a_bar_with_its_number() -> None:
    (axes,) = gains_chart(GROUPS).axes
    assert sorted(bar.get_width() for bar in axes.patches) == pytest.approx([-3.0, 12.3, 45.6, 100.0])
    words = {text.get_text() for text in axes.texts}
    assert {"+12 %", "+46 %", "+400 % (bar is cut)", "-3.0 %", "For a larger effect", "For less"} <= words
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels[1:] == ["b", "c"]
    assert "\n" in labels[0]


def test_bars_and_labels_stand_apart() -> None:
    (axes,) = gains_chart(GROUPS).axes
    edges = sorted((bar.get_y(), bar.get_y() + bar.get_height()) for bar in axes.patches)
    assert all(end < start for (_, end), (start, _) in pairwise(edges))


def test_volumes_are_hatched_for_gray_print() -> None:
    (axes,) = gains_chart(GROUPS).axes
    assert [bool(bar.get_hatch()) for bar in axes.patches] == [False, True, False, False]


def test_a_sheet_is_a_frame_over_its_range() -> None:
    (axes,) = shared_ranges_chart([("white", None), ("gray", (40.0, 55.0))]).axes
    frames = [patch for patch in axes.patches if not patch.get_fill()]
    assert [(frame.get_x(), frame.get_width()) for frame in frames] == [(40.0, 15.0)]
    assert {"none", "15.0 L*"} <= {text.get_text() for text in axes.texts}
