"""Widths and heights of what is set: columns and lines of pictures that fit whatever they hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reportlab.platypus import Paragraph

from paxel_design.report.content import Picture
from paxel_design.report.pdf.columns import PAD_X_PT, Grid, columns_of
from paxel_design.report.pdf.contents import shortened
from paxel_design.report.pdf.figures import GAP_PT, Cell, Figure
from paxel_design.report.pdf.layout import FRAME_HEIGHT_PT, PT_PER_MM, TEXT_WIDTH_PT, Layout
from paxel_design.report.pdf.objects import Objects
from paxel_design.report.pdf.rows import picture_lines
from paxel_design.report.pdf.tables import TableFlowable
from paxel_design.report.pdf.typography import markup, typography


def _picture(height: int, width: int, width_mm: float | None = None) -> Picture:
    return Picture(np.zeros((height, width, 3), dtype=np.uint8), "a label", "a note", width_mm)


_SIDES = st.integers(1, 60)
_PICTURES = st.lists(
    st.builds(_picture, _SIDES, _SIDES, st.none()) | st.builds(_picture, st.just(4), st.just(6), st.floats(5.0, 174.0)),
    min_size=1,
    max_size=9,
)


@given(_PICTURES)
@settings(max_examples=25)
def test_lines_of_pictures_fit_the_text(pictures: list[Picture]) -> None:
    lines = picture_lines(pictures, typography(), Objects(), {})
    cells = [cell for line in lines for cell in line]
    assert len(cells) == len(pictures)
    for line in lines:
        assert sum(cell.room for cell in line) + GAP_PT * (len(line) - 1) <= TEXT_WIDTH_PT + 1e-3
        assert all(cell.width <= cell.room + 1e-9 for cell in line)
    heights = {round(c.height, 6) for c, p in zip(cells, pictures, strict=True) if p.width_mm is None}
    assert len(heights) <= 1, "equally high"
    for cell, picture in zip(cells, pictures, strict=True):
        h, w = picture.picture.shape[:2]
        assert cell.width / cell.height == pytest.approx(w / h)
        if picture.width_mm is not None:
            assert cell.width / PT_PER_MM == pytest.approx(picture.width_mm, abs=1e-9)


def test_three_pictures_share_a_line() -> None:
    lines = picture_lines([_picture(90, 160)] * 3, typography(), Objects(), {})
    assert [len(line) for line in lines] == [3]
    assert sum(cell.width for cell in lines[0]) + 2 * GAP_PT == pytest.approx(TEXT_WIDTH_PT, abs=1e-3)
    assert [len(line) for line in picture_lines([_picture(90, 160)] * 4, typography(), Objects(), {})] == [2, 2]


_WORDS = st.text("abc 123.", max_size=60) | st.sampled_from(["0.124", "1 234.5", "none", "x" * 300, "word " * 80])


@given(st.integers(1, 7).flatmap(lambda c: st.lists(st.lists(_WORDS, min_size=c, max_size=c), min_size=1, max_size=6)))
@settings(max_examples=25)
def test_tables_fit_the_text_and_part_where_they_may(rows: list[list[str]]) -> None:
    marked = tuple(tuple(markup(text) for text in row) for row in rows)
    grid = Grid(tuple("a head" for _ in rows[0]), marked, (False, *[True] * (len(rows[0]) - 1)))
    layout, type_ = Layout(), typography()
    table = TableFlowable.of(
        grid, type_, lambda again: Paragraph("more" if again else "one", type_.caption), layout, "t"
    )
    width, height = table.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)
    assert width <= TEXT_WIDTH_PT + 1e-6
    assert 0 < table.start_height <= min(height, FRAME_HEIGHT_PT)
    parts, rest, total = 0, table, 0.0
    while rest.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)[1] > FRAME_HEIGHT_PT:
        first, rest = rest.split(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)
        part_height = first.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)[1]
        assert 0 < part_height <= FRAME_HEIGHT_PT + 1e-6
        parts, total = parts + 1, total + part_height
    assert total + rest.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)[1] >= height - 1e-6, "no row is lost"


def test_a_short_table_is_not_parted() -> None:
    type_ = typography()
    grid = Grid(("a", "b"), (("one", "1"),) * 8, (False, True))
    table = TableFlowable.of(grid, type_, lambda again: Paragraph("caption", type_.caption), Layout(), "t")
    assert table.split(TEXT_WIDTH_PT, table.wrap(TEXT_WIDTH_PT, 0)[1] - 1) == []
    assert table.split(TEXT_WIDTH_PT, FRAME_HEIGHT_PT) == [table]


def _figure(cells: list[Cell]) -> Figure:
    return Figure([cells], Paragraph("caption", typography().caption), Layout(), "f")


def test_a_figure_shrinks_a_little_rather_than_leave_a_page_empty() -> None:
    figure = _figure([Cell("C0", 400.0, 200.0, 400.0)])
    whole = figure.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)[1]
    assert figure.wrap(TEXT_WIDTH_PT, whole - 30)[1] == pytest.approx(whole - 30)
    assert figure.start_height == pytest.approx(whole - 0.2 * 200)
    assert figure.wrap(TEXT_WIDTH_PT, whole - 50)[1] == pytest.approx(whole), "else it goes to the next page"


@pytest.mark.parametrize("exact", [True, False])
def test_true_scale_and_rows_of_pictures_never_shrink(exact: bool) -> None:
    cells = [Cell("P0", 100.0, 200.0, 100.0, framed=True, exact=exact)] * (1 if exact else 2)
    figure = _figure(cells)
    whole = figure.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)[1]
    assert figure.wrap(TEXT_WIDTH_PT, whole - 1)[1] == whole == figure.start_height


def test_heads_wrap_before_cells_do() -> None:
    grid = Grid(("one head that is long",) * 5, (("a cell of some length",) * 5,), (False,) * 5)
    columns = columns_of(grid, typography())
    assert columns.widths.sum() == pytest.approx(TEXT_WIDTH_PT)
    for cell, width in zip(columns.rows[0], columns.widths, strict=True):
        assert cell.wrap(width - 2 * PAD_X_PT, 0)[1] == typography().cell.leading, "one line"


def test_numbers_are_not_parted_and_powers_are_raised() -> None:
    assert markup("833 500 and 1 234 567 of 12 3 4567") == "833\u00a0500 and 1\u00a0234\u00a0567 of 12 3 4567"
    assert markup("12 % of 5 mm") == "12\u00a0% of 5 mm"
    assert markup("CIELAB^3, cd/m^2, x^25") == "CIELAB³, cd/m², x^25"


def test_long_titles_are_shortened_at_a_word() -> None:
    style = typography().body
    assert shortened("short", style, 100.0) == "short"
    assert shortened("some words that are too many", style, 80.0) == "some words …"
    assert shortened("x" * 100, style, 60.0).endswith("x …")
