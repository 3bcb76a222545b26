"""The set report: a sound file, everything on its page, nothing over anything, links that lead somewhere."""

import ctypes
import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pikepdf
import pypdfium2
import pypdfium2.raw as pdfium
import pytest

from paxel_design.report.content import Paragraph, Picture, Pictures, Quantity, Section, Table, Verdict, Verdicts
from paxel_design.report.pdf import write_pdf
from paxel_design.report.pdf.document import set_document
from paxel_design.report.pdf.layout import LEFT_PT, LOWER_PT, PAGE_HEIGHT_PT, PT_PER_MM, TEXT_WIDTH_PT, Box, Layout
from paxel_runtime.errors import InputError

Sections = tuple[Section, ...]
Words = dict[str, str]

WORDS: Words = {
    "title": "Gamut analysis of an invented installation",
    "subtitle": "black/white checkerboard, 3 clusters",
    "bench": "virtual bench, realistic",
    "writer": "paxel-toolkit 0.0",
    "date": "2026-11-22",
}


@pytest.fixture(scope="module")
def document(invented_report: Callable[[int], Sections]) -> tuple[bytes, Layout]:
    return set_document(invented_report(70), **WORDS)


@pytest.fixture(scope="module")
def pdf(document: tuple[bytes, Layout]) -> Iterator[pikepdf.Pdf]:
    with pikepdf.open(io.BytesIO(document[0])) as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(document: tuple[bytes, Layout]) -> list[str]:
    """Text of every page, as a reader's clipboard gets it."""
    opened = pypdfium2.PdfDocument(document[0])
    texts = [page.get_textpage().get_text_range().replace("\r\n", "\n") for page in opened]
    opened.close()
    return texts


def test_the_file_is_sound(pdf: pikepdf.Pdf) -> None:
    assert pdf.check_pdf_syntax() == []
    assert pdf.Root.Lang == "en"
    assert pdf.docinfo.Title == WORDS["title"]
    assert pdf.docinfo.Author == WORDS["writer"]
    assert pdf.docinfo.CreationDate == "D:20261122000000Z"
    assert pdf.Root.PageLabels.Nums[1].S == "/D"
    with pdf.open_metadata() as metadata:
        assert metadata["dc:title"] == WORDS["title"]


def test_all_fonts_are_embedded_and_those_of_charts_once(pdf: pikepdf.Pdf) -> None:
    fonts = [o for o in pdf.objects if isinstance(o, pikepdf.Dictionary) and o.get("/Type") == "/Font"]
    assert fonts
    for font in fonts:
        if "/DescendantFonts" in font:
            assert "/ToUnicode" in font
            font = font.DescendantFonts[0]
        descriptor = font.FontDescriptor
        assert any(key in descriptor for key in ("/FontFile", "/FontFile2", "/FontFile3")), font
        if font.Subtype == "/TrueType":
            assert "/ToUnicode" in font
    # Two faces in the text; matplotlib numbers the glyphs of a font anew for rare characters: two subsets at most.
    files = {o.objgen for o in pdf.objects if isinstance(o, pikepdf.Stream) and "/Length1" in o}
    assert len(files) <= 4, "two charts share their fonts"


def test_text_comes_out_in_reading_order(pages: list[str]) -> None:
    first = " ".join(pages[0].split())
    order = [WORDS["title"], WORDS["subtitle"], "Summary", "833 500 cubic units & 2 < 3", "picture 0", "Fig. 1"]
    order += ["Table 1", "● good", "◐ usable", "○ weak", WORDS["writer"], "page 1 of"]
    places = [first.find(words) for words in order]
    assert min(places) >= 0, [words for words, place in zip(order, places, strict=True) if place < 0]
    assert places == sorted(places)
    text = "\n".join(pages)
    assert "reachable 2" in text, "a chart's words are text"
    assert "L* on the pattern" in text
    assert ". . ." not in text, "leaders are drawn, not written"
    chart_page = next(page for page in pages if "reachable 2" in page)
    assert chart_page.find("Curves") < chart_page.find("reachable 2") < chart_page.find("Curves (virtual bench)")


def test_furniture_stands_on_every_page(pages: list[str], document: tuple[bytes, Layout]) -> None:
    assert document[1].total == len(pages)
    for number, text in enumerate(pages, start=1):
        assert f"page {number} of {len(pages)}" in text
        assert WORDS["bench"] in text
        assert WORDS["date"] in text
    head = pages[document[1].pages["gamut/"]]  # the page after the section's first
    assert head.startswith("Gamuts")


def test_hardware_has_no_badge(invented_report: Callable[[int], Sections]) -> None:
    content, _ = set_document(invented_report(3)[3:], **{**WORDS, "bench": ""})
    opened = pypdfium2.PdfDocument(content)
    assert "bench" not in "".join(page.get_textpage().get_text_range() for page in opened)
    opened.close()


def _overlap(one: Box, other: Box) -> float:
    """Width times height of what two boxes share, each dimension at least 0."""
    width = min(one.x + one.width, other.x + other.width) - max(one.x, other.x)
    height = min(one.y + one.height, other.y + other.height) - max(one.y, other.y)
    return max(0.0, width) * max(0.0, height)


def test_no_block_leaves_the_margins_or_lies_on_another(document: tuple[bytes, Layout]) -> None:
    layout = document[1]
    inner = ("text", "cell", "object")
    for number in range(1, layout.total + 1):
        on_page = [box for box in layout.boxes if box.page == number]
        top = PAGE_HEIGHT_PT - (15 if number == 1 else 24) * PT_PER_MM
        for box in on_page:  # 0.01 pt: what reportlab rounds
            assert box.x >= LEFT_PT - 0.01, box
            assert box.x + box.width <= LEFT_PT + TEXT_WIDTH_PT + 0.01, box
            assert box.y >= LOWER_PT - 0.01, box
            assert box.y + box.height <= top + 0.01, box
        for parts in ([b for b in on_page if b.kind.split()[0] in inner], [b for b in on_page if b.kind[0].isupper()]):
            for k, box in enumerate(parts):
                assert all(_overlap(box, other) < 0.01 for other in parts[:k]), box
        blocks = [b for b in on_page if b.kind in ("Figure", "TableFlowable")]
        for box in on_page:
            if box.kind.split()[0] in inner:
                within = [_overlap(box, block) / (box.width * box.height) for block in blocks if box.height > 0]
                assert not within or max(within) > 0.999, f"{box} is part of no block"


def test_what_a_reader_draws_keeps_the_margins_too(document: tuple[bytes, Layout]) -> None:
    """Independent of our own record: boxes of texts and pictures as pdfium finds them."""
    opened = pypdfium2.PdfDocument(document[0])
    for page in opened:
        width, height = page.get_size()
        text = page.get_textpage()
        boxes = [text.get_rect(k) for k in range(text.count_rects())]
        boxes += [item.get_bounds() for item in page.get_objects(filter=[pdfium.FPDF_PAGEOBJ_IMAGE])]
        for left, bottom, right, upper in boxes:
            assert left >= LEFT_PT - 1  # 1 pt: side bearings of glyphs
            assert right <= width - LEFT_PT + 1
            assert bottom >= 9 * PT_PER_MM
            assert upper <= height - 9 * PT_PER_MM
        lines = np.array(sorted(text.get_rect(k) for k in range(text.count_rects())))
        for k, (left, bottom, right, upper) in enumerate(lines):
            other = lines[:k]
            wide = np.minimum(other[:, 2], right) - np.maximum(other[:, 0], left)
            high = np.minimum(other[:, 3], upper) - np.maximum(other[:, 1], bottom)
            # Letters of neighbouring lines may touch; half a letter over another may not be.
            assert not np.any((wide > 1) & (high > 0.4 * (upper - bottom)) & (high > 1.5)), (left, bottom, right, upper)
    opened.close()


def test_every_caption_stands_on_the_page_of_its_figure(
    document: tuple[bytes, Layout], pages: list[str], invented_report: Callable[[int], Sections]
) -> None:
    layout = document[1]
    captions = {
        block.name: block.caption for s in invented_report(3) for block in s.blocks if hasattr(block, "caption")
    }
    for name, caption in captions.items():
        text = pages[layout.pages[name] - 1]
        assert re.search(rf"(Fig\.|Table) \d+ +{re.escape(caption)}", text), (name, text)
    for number, text in enumerate(pages, start=1):
        objects = [box for box in layout.boxes if box.page == number and box.kind.startswith("object")]
        figures = [box for box in layout.boxes if box.page == number and box.kind == "Figure"]
        assert bool(objects) <= bool(figures)
        assert len(figures) == len(re.findall(r"^Fig\. \d+(?: \(continued\))?  ?\w", text, re.MULTILINE)) or number == 2


def test_parts_of_a_table_repeat_its_header(pages: list[str]) -> None:
    parts = [text for text in pages if "effect volume share change" in text]
    assert len(parts) == 2
    assert "Table 4 Volumes" in parts[0]
    assert "Table 4 (continued) Volumes" in parts[1]
    rows = re.findall(r"effect (\d+) ", "".join(parts))
    assert rows == [str(k) for k in range(70)], "every row once, in order"


def _character_places(page: Any) -> list[tuple[str, float, float]]:
    text = page.get_textpage()
    places = []
    for k in range(text.count_chars()):
        x, y = ctypes.c_double(), ctypes.c_double()
        pdfium.FPDFText_GetCharOrigin(text, k, x, y)
        places.append((chr(pdfium.FPDFText_GetUnicode(text, k)), x.value, y.value))
    return places


def test_numbers_stand_on_their_decimal_points() -> None:
    rows = (("a", "0.124"), ("b", "12.3"), ("c", "1 234.56 mm"), ("d", "-0.5 %"), ("e", "none"))
    section = Section("summary", "Summary", (Table("numbers", "Numbers", ("name", "number"), rows),))
    opened = pypdfium2.PdfDocument(set_document((section,), **{**WORDS, "subtitle": "", "date": "", "writer": ""})[0])
    points = [
        x for character, x, y in _character_places(opened[0]) if character == "." and x < LEFT_PT + 150 and y < 740
    ]
    opened.close()
    assert len(points) == 4
    assert np.ptp(points) < 0.02  # points; a digit is 4.8 wide


def test_true_scale_is_exact(document: tuple[bytes, Layout]) -> None:
    opened = pypdfium2.PdfDocument(document[0])
    page = opened[document[1].pages["crops"] - 1]
    bounds = [item.get_bounds() for item in page.get_objects(filter=[pdfium.FPDF_PAGEOBJ_IMAGE])]
    widths_mm = sorted((right - left) / PT_PER_MM for left, _, right, _ in bounds)
    heights_mm = sorted((upper - lower) / PT_PER_MM for _, lower, _, upper in bounds)
    opened.close()
    assert widths_mm[:2] == pytest.approx([42.0, 42.0], abs=0.01)
    assert heights_mm[:2] == pytest.approx([30.0, 30.0], abs=0.01)


def test_pictures_of_a_row_are_equally_high(document: tuple[bytes, Layout]) -> None:
    layout = document[1]
    page = layout.pages["three"]
    objects = [box for box in layout.boxes if box.page == page and box.kind.startswith("object")]
    assert len(objects) == 3
    assert len({(round(box.height, 6), round(box.y, 6)) for box in objects}) == 1


def test_links_lead_to_their_targets(pdf: pikepdf.Pdf, document: tuple[bytes, Layout], pages: list[str]) -> None:
    layout = document[1]
    numbers = {page.obj.objgen: k for k, page in enumerate(pdf.pages, start=1)}
    links = {
        number: [numbers[note.Dest[0].objgen] for note in page.obj.get("/Annots", [])]
        for number, page in enumerate(pdf.pages, start=1)
    }
    captions, verdicts = [2, 2], [layout.pages[key] for key in ("gamut/", "gamut/", "pattern/")]
    assert sorted(links[1]) == sorted(captions + verdicts)
    ends = [int(line.split()[-1]) for line in _contents_lines(pages[1])]
    assert ends == links[2]
    assert len(ends) == len(layout.pages) - 1, "every anchor but the contents' own"
    assert sum(len(targets) for number, targets in links.items() if number > 2) == 13, "a caption, or its continuation"
    with pdf.open_outline() as outline:
        titles = [item.title for item in outline.root]
    assert titles[:2] == ["Summary", "Contents"]
    assert titles[-1] == "Provenance"


def _contents_lines(text: str) -> list[str]:
    """Lines of the page of contents that end with a page's number; pdfium may part a line before it."""
    joined = re.sub(r"\s*\n(?=\d+(\n|$))", " ", text[text.rindex("Contents") :])
    return [
        line.strip()
        for line in joined.split("\n")
        if re.search(r" \d+\s*$", line) and not re.search(r"page \d+ of", line)
    ]


def test_equal_input_gives_equal_bytes(
    document: tuple[bytes, Layout], invented_report: Callable[[int], Sections]
) -> None:
    assert set_document(invented_report(70), **WORDS)[0] == document[0]


def test_verdicts_are_told_apart_in_gray_print(document: tuple[bytes, Layout]) -> None:
    opened = pypdfium2.PdfDocument(document[0])
    page = opened[0]
    gray = np.asarray(page.render(scale=8, grayscale=True).to_numpy(), dtype=np.float64)
    gray = gray.reshape(gray.shape[0], gray.shape[1], -1)[..., 0]
    text = page.get_textpage()
    ink = {}
    for k in range(text.count_chars()):
        character = chr(pdfium.FPDFText_GetUnicode(text, k))
        if character in "●◐○":
            left, bottom, right, upper = (8 * v for v in text.get_charbox(k))
            mark = gray[int(gray.shape[0] - upper) : int(gray.shape[0] - bottom), int(left) : int(right)]
            ink[character] = float(np.mean(mark < 192))
    opened.close()
    # A disc fills pi / 4 of its square; half of it, and a rim, are clearly less even in a coarse print.
    assert ink["●"] > ink["◐"] + 0.15
    assert ink["◐"] > ink["○"] + 0.1


def test_a_long_summary_stays_on_one_page_in_smaller_type() -> None:
    words = Paragraph("A sentence of some length that says what this installation can show. " * 12)

    def contents_page(paragraphs: int) -> int:
        return set_document((Section("summary", "Summary", (words,) * paragraphs),), **WORDS)[1].pages["contents/"]

    assert contents_page(5) == 2
    assert contents_page(8) == 2, "more than a page in the usual size"
    assert contents_page(20) > 2, "no smaller than can be read"


def test_what_the_typeface_lacks_is_marked(invented_report: Callable[[int], Sections]) -> None:
    section = Section("summary", "資 summary <b>&\x00", (Paragraph("Δ × ² ³ ° – ≤ → ● ◐ ○ 資 {not a quantity} {{"),))
    opened = pypdfium2.PdfDocument(set_document((section,), **WORDS)[0])
    text = opened[0].get_textpage().get_text_range()
    opened.close()
    assert "\ufffd summary <b>&" in text
    assert "Δ × ² ³ ° – ≤ → ● ◐ ○ \ufffd {not a quantity} {{" in text


_PIXELS = np.zeros((10, 20, 3), dtype=np.uint8)


@pytest.mark.parametrize(
    ("sections", "told"),
    [
        ((), "one section or more"),
        ((Section("a", "A", ()), Section("a", "B", ())), "key 'a'"),
        ((Section("a", "A", (Pictures("x", "", ()), Pictures("x", "", ()))),), "name 'x'"),
        ((Section("a", "A", (Paragraph("{nowhere}"),)),), "'nowhere'"),
        ((Section("a", "A", (Table("t", "", ("a", "b"), (("1",),)),)),), "'t'.*length"),
        ((Section("a", "A", (Pictures("p", "", (Picture(_PIXELS, "wide", width_mm=180.0),)),)),), "'wide'.*crop"),
        ((Section("a", "A", (Pictures("p", "", (Picture(_PIXELS[:0], "no"),)),)),), "no pixels"),
        ((Section("a", "A", (Verdicts("v", "", (Verdict("it", "q", "good", "r"),)),)),), "'it'.*'q'"),
    ],
)
def test_what_cannot_be_set_is_told_and_leaves_the_file(sections: Sections, told: str, tmp_path: Path) -> None:
    path = tmp_path / "report.pdf"
    path.write_text("before")
    with pytest.raises(InputError, match=told):
        write_pdf(path, sections, **WORDS)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_is_written(tmp_path: Path) -> None:
    section = Section("summary", "Summary", (Paragraph("{summary.n} and no more"),), {"summary.n": Quantity(12345.0)})
    write_pdf(tmp_path / "report.pdf", [section], **{**WORDS, "date": "today"})
    with pikepdf.open(tmp_path / "report.pdf") as written:
        assert "/CreationDate" not in written.docinfo
        assert len(written.pages) == 2
