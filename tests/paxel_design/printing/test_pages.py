"""Sheets on pages: every place is on a page, neighbours overlap, and what a page shows is the sheet."""

import io
import subprocess
import sys
from shutil import which

import numpy as np
import pikepdf
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from paxel_design.patterns import make_pattern
from paxel_design.printing import write_pattern_pdf
from paxel_design.printing.page_plan import LARGEST_PAGE_MM, MARGIN_MM, PAPERS_MM, paper_mm, plan_pages
from paxel_design.printing.pages import lay_on_pages
from paxel_runtime.errors import InputError
from paxel_runtime.settings import PAPERS

MM = 72 / 25.4


def test_settings_name_the_papers_there_are():
    assert set(PAPERS) == set(PAPERS_MM)


@settings(deadline=None)
@given(
    st.tuples(st.floats(250, 3000), st.floats(250, 3000)),
    st.sampled_from(["A4", "A3", "letter", (300.0, 500.0)]),
    st.sampled_from([0.0, 5.0, 15.0]),
)
def test_tiles_cover_the_sheet_without_gap_and_neighbours_share_the_overlap(sheet_mm, page, overlap_mm):
    plan = plan_pages(sheet_mm, page, overlap_mm)
    if not plan.tiled:
        assert plan.page_mm[0] >= sheet_mm[0]
        assert plan.page_mm[1] >= sheet_mm[1]
        return
    tiles = list(plan.tiles())
    width, height = plan.tile_mm
    lefts = sorted({round(tile.left_mm, 6) for tile in tiles})
    bottoms = sorted({round(tile.bottom_mm, 6) for tile in tiles})
    assert (len(bottoms), len(lefts)) == (plan.rows, plan.columns)
    assert plan.pages == plan.rows * plan.columns + 1
    for starts, side, whole in ((lefts, width, sheet_mm[0]), (bottoms, height, sheet_mm[1])):
        assert starts[0] <= 1e-6
        assert starts[-1] + side >= whole - 1e-6
        assert np.allclose(np.diff(starts), side - overlap_mm, atol=1e-5)  # starts are rounded to 6 digits
        # one page less in a row would not do
        assert len(starts) == 1 or (len(starts) - 1) * (side - overlap_mm) + overlap_mm < whole + 1e-6
    assert tiles[0].row == tiles[0].column == 0
    assert tiles[0].bottom_mm == max(tile.bottom_mm for tile in tiles)  # row 1 is the upper one
    assert [plan.number_of(tile) for tile in tiles] == list(range(1, len(tiles) + 1))


def test_named_paper_is_turned_where_that_saves_pages_and_given_paper_is_not():
    assert plan_pages((1000, 200), "A3").page_mm == (420.0, 297.0)
    assert plan_pages((200, 1000), "A3").page_mm == (297.0, 420.0)
    assert plan_pages((1000, 200), (297.0, 420.0)).page_mm == (297.0, 420.0)


def test_a_sheet_that_fits_is_one_page():
    plan = plan_pages((280, 200), "A4")
    assert (plan.page_mm, plan.pages, plan.tiled) == ((297.0, 210.0), 1, False)
    assert plan_pages((280, 200), "auto").page_mm == (280, 200)


@pytest.mark.parametrize(
    ("sheet_mm", "page", "overlap_mm", "text"),
    [
        ((6000, 500), "auto", 10, "at most 5080 mm on each side.*set printer.page"),
        ((500, 500), "A9", 10, "must be \"auto\", A0, .*got 'A9'"),
        ((500, 500), (6000.0, 100.0), 10, "at most 5080 mm"),
        ((500, 500), (50.0, 100.0), 10, "at least 40 mm of the sheet"),
        ((500, 500), "A4", 150, "overlap by at most half"),
        ((500, 500), "A4", -1, "overlap by at most half"),
        ((500, 500), "A4", float("nan"), "overlap by at most half"),
        ((5e4, 5e4), "A4", 10, "at most 2000 pages"),
    ],
)
def test_pages_that_cannot_be_are_named(sheet_mm, page, overlap_mm, text):
    with pytest.raises(InputError, match=text):
        plan_pages(sheet_mm, page, overlap_mm)


def test_a_wall_larger_than_a_page_may_be_is_fine_in_tiles():
    plan = plan_pages((8000, 4000), "A0")
    assert max(plan.page_mm) <= LARGEST_PAGE_MM
    assert paper_mm((914.0, 2000.0)) == (914.0, 2000.0)


@pytest.fixture(scope="module")
def sheet_bytes(tmp_path_factory):
    path = tmp_path_factory.mktemp("sheet") / "sheet.pdf"
    pattern = make_pattern("tiles", ("black", "white", "red"), 1.0, 30, (260, 190), 3)
    figures = write_pattern_pdf(pattern, path)
    return path.read_bytes(), figures.sheet_mm


def laid(content, plan, tmp_path, name):
    path = tmp_path / name
    with pikepdf.open(io.BytesIO(content)) as pdf:
        lay_on_pages(pdf, plan)
        pdf.save(path)
    return path


def test_pages_share_their_images_and_name_only_those_they_show(sheet_bytes, tmp_path):
    content, sheet_mm = sheet_bytes
    plan = plan_pages(sheet_mm, "A4")
    path = laid(content, plan, tmp_path, "a4.pdf")
    assert path.stat().st_size < len(content) + 6000 * plan.pages  # ticks and labels and a subset of the typeface
    with pikepdf.open(path) as pdf:
        assert len(pdf.pages) == plan.pages
        images = [o for o in pdf.objects if isinstance(o, pikepdf.Stream) and o.get("/Subtype") == "/Image"]
        with pikepdf.open(io.BytesIO(content)) as one:
            assert len(images) == sum(
                isinstance(o, pikepdf.Stream) and o.get("/Subtype") == "/Image" for o in one.objects
            )
            whole = one.pages[0].Contents.read_bytes().count(b" Do")
        drawn = [page.Resources.XObject.Sheet.read_bytes().count(b" Do") for page in list(pdf.pages)[:-1]]
        assert max(drawn) < whole
        for page in pdf.pages:
            assert page.mediabox == page.trimbox == page.bleedbox
            width, height = (float(v) / MM for v in page.mediabox[2:])
            assert (width, height) == pytest.approx(plan.page_mm, abs=1e-3)  # reportlab writes 4 digits of a point


@pytest.mark.skipif(which("gs") is None, reason="needs Ghostscript")
def test_every_page_shows_its_part_of_the_sheet(tmp_path):
    pattern = make_pattern("tiles", ("black", "white", "red"), 2.0, 30, (120, 80), 3)
    sheet_mm = write_pattern_pdf(pattern, tmp_path / "one.pdf").sheet_mm
    plan = plan_pages(sheet_mm, (150.0, 150.0), 12.0)
    assert (plan.rows, plan.columns) == (2, 2)
    tiled = laid((tmp_path / "one.pdf").read_bytes(), plan, tmp_path, "tiled.pdf")
    dpi = 72.0
    render(tmp_path / "one.pdf", dpi, tmp_path / "one-%d.png")
    render(tiled, dpi, tmp_path / "tiled-%d.png")
    sheet = np.asarray(Image.open(tmp_path / "one-1.png").convert("L")).astype(int)
    for tile in plan.tiles():
        page = np.asarray(Image.open(tmp_path / f"tiled-{plan.number_of(tile)}.png").convert("L")).astype(int)
        step = 25.4 / dpi
        inner_mm = np.arange(MARGIN_MM + 2, MARGIN_MM + plan.tile_mm[0] - 2, 2.0)
        inner_y_mm = np.arange(MARGIN_MM + 2, MARGIN_MM + plan.tile_mm[1] - 2, 2.0)
        x, y = np.meshgrid(inner_mm, inner_y_mm)
        on_x, on_y = x - MARGIN_MM + tile.left_mm, y - MARGIN_MM + tile.bottom_mm
        on_sheet = (on_x > 1) & (on_y > 1) & (on_x < sheet_mm[0] - 1) & (on_y < sheet_mm[1] - 1)
        here = page[row_of(y, page, step), (x / step).astype(int)]
        rows = row_of(on_y, sheet, step).clip(0, sheet.shape[0] - 1)
        there = sheet[rows, (on_x / step).astype(int).clip(0, sheet.shape[1] - 1)]
        # page and sheet have other pixels of 0.35 mm, so edges differ: half a pixel of 2 mm; cells moved by one: 4 of 9
        assert np.mean(abs(here - there)[on_sheet] > 60) < 0.2
        beyond = (on_x < -1) | (on_y < -1) | (on_x > sheet_mm[0] + 1) | (on_y > sheet_mm[1] + 1)
        assert np.all(here[beyond] == 255)
    assert len(list(tmp_path.glob("tiled-*.png"))) == 5


def row_of(y_mm, picture, step):
    return (picture.shape[0] - 1 - np.floor(y_mm / step)).astype(int)


def render(path, dpi, pattern):
    subprocess.run(
        [
            "gs",
            "-q",
            "-dNOPAUSE",
            "-dBATCH",
            "-dSAFER",
            "-sDEVICE=pnggray",
            f"-r{dpi}",
            f"-sOutputFile={pattern}",
            path,
        ],
        check=True,
    )


def test_a_sheet_that_fits_is_moved_to_the_middle_of_its_page(sheet_bytes, tmp_path):
    content, sheet_mm = sheet_bytes
    with pikepdf.open(io.BytesIO(content)) as one:
        trim = [float(v) for v in one.pages[0].trimbox]
    with pikepdf.open(laid(content, plan_pages(sheet_mm, "A2"), tmp_path, "a2.pdf")) as pdf:
        (page,) = pdf.pages
        assert [float(v) / MM for v in page.mediabox[2:]] == pytest.approx([420, 594], abs=1e-3)
        moved = [float(v) for v in page.trimbox]
    assert moved[0] - trim[0] == pytest.approx((420 - sheet_mm[0]) / 2 * MM, abs=1e-3)
    assert moved[3] - trim[3] == pytest.approx((594 - sheet_mm[1]) / 2 * MM, abs=1e-3)
    same = laid(content, plan_pages(sheet_mm, "auto"), tmp_path, "same.pdf")
    with pikepdf.open(same) as pdf:
        assert [float(v) for v in pdf.pages[0].trimbox] == trim


def test_a_plan_of_another_sheet_is_refused(sheet_bytes):
    content, sheet_mm = sheet_bytes
    with pikepdf.open(io.BytesIO(content)) as pdf, pytest.raises(InputError, match="laid on one sheet of"):
        lay_on_pages(pdf, plan_pages((sheet_mm[0] + 1, sheet_mm[1]), "A4"))


def test_vector_cells_are_left_out_of_the_pages_they_do_not_reach_too(tmp_path):
    pattern = make_pattern("checkerboard", ("black", "white"), 2.0, 30, (600, 400))
    figures = write_pattern_pdf(pattern, tmp_path / "v.pdf", page="A4", vector=True)
    with pikepdf.open(tmp_path / "v.pdf") as pdf:
        first, middle = (pdf.pages[i].Resources.XObject.Sheet.read_bytes().count(b"Cells") for i in (0, 6))
    assert figures.pages > 8
    assert first < middle


WALL = """
import resource, sys, time
from pathlib import Path
from paxel_design.patterns import make_pattern
from paxel_design.printing import write_pattern_pdf
start = time.process_time()
pattern = make_pattern(sys.argv[2], ("black", "white"), float(sys.argv[3]), 30, (4000, 3000), blue_noise="zhou-fang")
figures = write_pattern_pdf(pattern, sys.argv[1], page="A4")
print(time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, figures.bytes)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("layout", "dot_mm"), [("checkerboard", 0.75), ("blue-noise", 2.0)])
def test_a_wall_in_tiles_takes_seconds_and_little_memory(layout, dot_mm, tmp_path):
    command = [sys.executable, "-c", WALL, str(tmp_path / "wall.pdf"), layout, str(dot_mm)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    seconds, megabytes, size = (float(v) for v in done.stdout.split())
    assert seconds < 20  # measured: 2 and 6
    assert megabytes < 500  # measured: 150 and 230
    assert size < 4e6  # measured: 0.6 and 1.8 MB
