"""The report as a PDF: passes over the sections until every page's number is known, then what reportlab lacks.

The one door to report.pdf. The first section stands on the first page with the title, the contents follow it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    CondPageBreak,
    Flowable,
    Frame,
    HRFlowable,
    NextPageTemplate,
    PageBreak,
    PageTemplate,
    Paragraph,
)

from paxel_design.report.content import Section, numbered
from paxel_design.report.pdf.contents import ContentsColumns, ContentsLine, Entry
from paxel_design.report.pdf.finish import finished
from paxel_design.report.pdf.furniture import Furniture, draw_foot, draw_head
from paxel_design.report.pdf.layout import (
    FIRST_TOP_PT,
    LEFT_PT,
    LOWER_PT,
    PAGE_HEIGHT_PT,
    PAGE_WIDTH_PT,
    TEXT_WIDTH_PT,
    TOP_PT,
    Box,
    Layout,
    set_anchor,
)
from paxel_design.report.pdf.objects import Objects
from paxel_design.report.pdf.scenes import SceneDrawer
from paxel_design.report.pdf.story import CONTENTS, Story, section_anchor, section_flowables
from paxel_design.report.pdf.typography import SOFT_INK, markup, typography
from paxel_runtime.errors import InputError
from paxel_runtime.storage import write_atomically

__all__ = ["set_document", "write_pdf"]

_SIZES = (1.0, 0.96, 0.92, 0.88, 0.84, 0.8, 0.76)
"""Sizes of type that are tried, the largest first, for the first section to stand on one page."""

_MOST_PASSES = 5
"""Pages' numbers settle in two passes, or in three where a number gets longer and a line breaks."""


def write_pdf(
    path: Path, sections: Sequence[Section], *, title: str, subtitle: str, bench: str, writer: str, date: str
) -> None:
    """Set the sections of a report as report.pdf, the same bytes for the same input.

    Parameters
    ----------
    path : Path
        Written whole or not at all.
    sections : sequence of Section
        The first one, the summary, gets the first page with the title; every other begins on a page of its own.
    title, subtitle : str
    bench : str
        Stands on every page; empty where figures were measured on hardware.
    writer, date : str
        Stand in the foot of every page.

    Raises
    ------
    InputError
        If there is no section, a name stands twice, a text names a quantity that is not there, or a picture at true
        scale is larger than a page.
    GamutError
        If bodies cannot be drawn on this machine.
    """
    content, _ = set_document(sections, title=title, subtitle=subtitle, bench=bench, writer=writer, date=date)
    write_atomically(path, lambda p: p.write_bytes(content))


def set_document(
    sections: Sequence[Section], *, title: str, subtitle: str, bench: str, writer: str, date: str
) -> tuple[bytes, Layout]:
    """The bytes of `write_pdf`, and where everything was set."""
    _check(sections)
    numbers, keys = numbered(sections), tuple(section.key for section in sections)
    quantities = {name: quantity for section in sections for name, quantity in section.quantities.items()}
    objects, scenes = Objects(), SceneDrawer()
    known = Layout()
    for _ in range(_MOST_PASSES):
        story = Story(quantities, numbers, keys, objects, scenes, known.pages)
        furniture = Furniture(title, bench, writer, date, known.total)
        content = _one_pass(sections, story, furniture, subtitle)
        settled = story.layout.pages == known.pages and story.layout.total == known.total
        known = story.layout
        if settled:
            break
    return finished(content, objects, known.objects, title=title, subject=subtitle, writer=writer, date=date), known


def _check(sections: Sequence[Section]) -> None:
    if not sections:
        raise InputError("a report needs one section or more, got none")
    seen = {CONTENTS.rstrip("/")}
    for section in sections:
        if section.key in seen:
            raise InputError(f"two sections of the report have the key {section.key!r}; give one of them another")
        seen.add(section.key)


class _RecordingFrame(Frame):
    """A frame that records what is set in it."""

    layout: Layout

    def add(self, flowable: Flowable, canvas: Canvas, trySplit: int = 0) -> int:
        done = int(super().add(flowable, canvas, trySplit))
        height = getattr(flowable, "height", 0) or 0
        if done and height and not isinstance(flowable, CondPageBreak):
            lower = self._y + flowable.getSpaceAfter()
            kind = type(flowable).__name__
            self.layout.boxes.append(Box(canvas.getPageNumber(), self._x1, lower, TEXT_WIDTH_PT, height, kind))
        return done


def _one_pass(sections: Sequence[Section], story: Story, furniture: Furniture, subtitle: str) -> bytes:
    buffer = io.BytesIO()
    document = BaseDocTemplate(
        buffer, pagesize=(PAGE_WIDTH_PT, PAGE_HEIGHT_PT), invariant=1, pageCompression=1, allowSplitting=1
    )
    first = _frame("first", FIRST_TOP_PT, story.layout)
    templates = [_template("first", first, furniture, "")]
    flowables, entries = _first_page(sections[0], story, furniture, subtitle, first)
    rest: list[Flowable] = []
    for section in sections[1:]:
        name = section_anchor(section.key)
        templates.append(_template(name, _frame(name, TOP_PT, story.layout), furniture, section.title))
        parts, further = section_flowables(section, story)
        rest += [NextPageTemplate(name), PageBreak(), *parts]
        entries += further
    templates.append(_template(CONTENTS, _frame(CONTENTS, TOP_PT, story.layout), furniture, "Contents"))
    document.addPageTemplates(templates)
    flowables += [NextPageTemplate(CONTENTS), PageBreak(), *_contents(entries, story), *rest]

    document.build(flowables, canvasmaker=_CanvasWithoutTimes)
    story.layout.total = document.page
    return buffer.getvalue()


class _CanvasWithoutTimes(Canvas):
    """The same bytes at any time of day, and no font but the embedded ones."""

    def __init__(self, filename: object, **settings: object) -> None:
        typography()
        super().__init__(filename, **{**settings, "invariant": 1, "initialFontName": typography().body.fontName})


def _frame(name: str, top: float, layout: Layout) -> _RecordingFrame:
    frame = _RecordingFrame(
        LEFT_PT, LOWER_PT, TEXT_WIDTH_PT, PAGE_HEIGHT_PT - top - LOWER_PT, 0, 0, 0, 0, id=name, showBoundary=0
    )
    frame.__dict__["layout"] = layout
    return frame


def _template(name: str, frame: Frame, furniture: Furniture, section: str) -> PageTemplate:
    return PageTemplate(
        id=name,
        frames=[frame],
        onPage=draw_head(furniture, section),
        onPageEnd=draw_foot(furniture),
        pagesize=(PAGE_WIDTH_PT, PAGE_HEIGHT_PT),
    )


def _first_page(
    section: Section, story: Story, furniture: Furniture, subtitle: str, frame: Frame
) -> tuple[list[Flowable], list[Entry]]:
    """Title and first section in the largest type in which they stand on one page; in the smallest they may run on."""
    for size in _SIZES:
        type_ = typography(size)
        flowables, entries = section_flowables(section, story, size)
        head = [Paragraph(markup(furniture.title), type_.title)]
        head += [Paragraph(markup(subtitle), type_.subtitle)] if subtitle else []
        head.append(HRFlowable("100%", 0.8, color=SOFT_INK, spaceBefore=3 * size, spaceAfter=9 * size))
        if _height([*head, *flowables]) <= frame._aH:
            break
    return [*head, *flowables], entries


def _height(flowables: Sequence[Flowable]) -> float:
    """Of flowables below each other, as a frame sets them."""
    total, after = 0.0, 0.0
    for k, flowable in enumerate(flowables):
        height = flowable.wrap(TEXT_WIDTH_PT, 1e6)[1]
        before = flowable.getSpaceBefore() if k else 0.0
        total += height + max(before, after)
        after = flowable.getSpaceAfter()
    return float(total)


class _ContentsTitle(Paragraph):
    def __init__(self, story: Story) -> None:
        super().__init__("Contents", typography().section)
        self._layout = story.layout

    def draw(self) -> None:
        set_anchor(self.canv, self._layout, CONTENTS, self.height)
        self.canv.addOutlineEntry("Contents", CONTENTS, 0, closed=False)
        super().draw()


def _contents(entries: Sequence[Entry], story: Story) -> list[Flowable]:
    type_ = typography()
    styles = (
        type_.head.clone("section's line", fontSize=9, leading=14),
        type_.cell.clone("line", fontSize=8.4, leading=12.4),
    )
    lines = [ContentsLine(entry, styles[entry.level], story.pages) for entry in entries if entry.level < 2]
    columns: list[Flowable] = [_ContentsTitle(story), ContentsColumns(lines)]
    small = type_.note.clone("figure's line", fontSize=7.0, leading=10.4)
    blocks = [Entry(entry.anchor, entry.text, 0) for entry in entries if entry.level == 2]
    for title, kind in (("Figures", "Fig."), ("Tables", "Table")):
        further = [ContentsLine(entry, small, story.pages) for entry in blocks if entry.text.startswith(kind)]
        if further:
            columns += [CondPageBreak(60), Paragraph(title, type_.heading), ContentsColumns(further)]
    return columns
