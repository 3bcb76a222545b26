"""Sections as what reportlab sets: every kind of block as paragraphs, tables and figures, numbered and linked.

Pure arrangement: it opens no file and knows no PDF object.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from reportlab.platypus import CondPageBreak, Flowable, Paragraph

from paxel_design.report.bodies import colored
from paxel_design.report.content import (
    Block,
    Bullets,
    Chart,
    Heading,
    Judgement,
    Pictures,
    Quantity,
    Scene,
    Section,
    Table,
    Verdict,
    Verdicts,
    filled,
    quoted,
    unit_words,
)
from paxel_design.report.content import Paragraph as Text
from paxel_design.report.pdf.columns import Grid
from paxel_design.report.pdf.contents import Entry
from paxel_design.report.pdf.figures import GAP_PT, Cell, Figure
from paxel_design.report.pdf.layout import FRAME_HEIGHT_PT, PT_PER_MM, TEXT_WIDTH_PT, Layout, set_anchor
from paxel_design.report.pdf.objects import Objects
from paxel_design.report.pdf.rows import picture_lines
from paxel_design.report.pdf.scenes import SceneDrawer
from paxel_design.report.pdf.tables import TableFlowable
from paxel_design.report.pdf.typography import Typography, link, markup, typography
from paxel_runtime.errors import InputError

__all__ = ["CONTENTS", "Story", "section_anchor", "section_flowables"]

CONTENTS = "contents/"
"""Anchor of the contents, where every caption's number leads back to."""

_MARKS: dict[Judgement, tuple[str, str]] = {
    "good": ("●", "#1d6b3a"),
    "usable": ("◐", "#9a6a00"),
    "weak": ("○", "#b3261e"),
}
"""Mark and colour of a judgement; the mark tells it in gray print."""

_START_LINES = 3
"""Lines of a text that a heading must have below it on its page."""


@dataclass(eq=False)
class Story:
    """What all sections share while one pass arranges them.

    Attributes
    ----------
    quantities : mapping of str to Quantity
        Of all sections.
    numbers : mapping of str to str
        "Fig. 1", "Table 1" of every block that has a name.
    keys : tuple of str
        Of all sections.
    objects : Objects
    scenes : SceneDrawer
    pages : mapping of str to int
        Page of every anchor, as the pass before found it.
    layout : Layout
        The record of this pass.
    """

    quantities: Mapping[str, Quantity]
    numbers: Mapping[str, str]
    keys: tuple[str, ...]
    objects: Objects
    scenes: SceneDrawer
    pages: Mapping[str, int]
    layout: Layout = field(default_factory=Layout)


def section_anchor(key: str) -> str:
    """Anchor of a section; no block's, though a block may have the section's name."""
    return f"{key}/"


class _Titled(Paragraph):
    """A title of a section or a heading: a target of links, and an entry of the reader's outline."""

    def __init__(self, entry: Entry, type_: Typography, layout: Layout) -> None:
        super().__init__(markup(entry.text), type_.heading if entry.level else type_.section)
        self._entry, self._layout = entry, layout

    def draw(self) -> None:
        """Draw it and set its anchor."""
        set_anchor(self.canv, self._layout, self._entry.anchor, self.height)
        self.canv.addOutlineEntry(self._entry.text, self._entry.anchor, self._entry.level, closed=False)
        super().draw()


def section_flowables(section: Section, story: Story, size: float = 1.0) -> tuple[list[Flowable], list[Entry]]:
    """A section with its title, and its lines in the contents.

    Raises
    ------
    InputError
        If a text names a quantity that is not there, or a picture at true scale is larger than a page.
    """
    type_ = typography(size)
    title = Entry(section_anchor(section.key), section.title, 0)
    flowables: list[Flowable] = [_Titled(title, type_, story.layout)]
    entries = [title]
    parts = [_SETTERS[type(block)](block, section, story, type_) for block in section.blocks]
    for k, (block, part) in enumerate(zip(section.blocks, parts, strict=True)):
        if isinstance(block, Heading):
            entry = Entry(f"{section_anchor(section.key)}{k}", filled(block.text, story.quantities), 1)
            heading = _Titled(entry, type_, story.layout)
            following = next((p[0] for p in parts[k + 1 :] if p), None)
            need = heading.wrap(TEXT_WIDTH_PT, 0)[1] + type_.heading.spaceBefore + type_.heading.spaceAfter
            flowables += [CondPageBreak(need + _start_height(following)), heading]
            entries.append(entry)
        else:
            flowables += part
            if part and not isinstance(block, Text | Bullets):
                entries.append(_caption_entry(block, story))
    return flowables, entries


def _caption_entry(block: Block, story: Story) -> Entry:
    """A figure or a table, called by the first sentence of its caption."""
    assert not isinstance(block, Heading | Text | Bullets)
    caption = filled(block.caption, story.quantities).replace(" (virtual bench)", "")  # every page says it
    return Entry(block.name, f"{story.numbers[block.name]}  {caption.split('. ')[0].rstrip('.')}", 2)


def _start_height(flowable: Flowable | None) -> float:
    """The height that a block takes at least where it begins."""
    if flowable is None:
        return 0.0
    if isinstance(flowable, TableFlowable | Figure):
        return flowable.start_height + flowable.getSpaceBefore()
    height = float(flowable.wrap(TEXT_WIDTH_PT, FRAME_HEIGHT_PT)[1])
    if isinstance(flowable, Paragraph):
        height = min(height, _START_LINES * flowable.style.leading)
    return height + float(flowable.getSpaceBefore())


def _caption(name: str, text: str, story: Story, type_: Typography) -> Callable[[bool], Paragraph]:
    """Makes a block's caption, given whether it is a continuation; the number leads to the contents."""
    number = link(CONTENTS, f"<b>{markup(story.numbers[name])}</b>")

    def made(continued: bool) -> Paragraph:
        return Paragraph(
            f"{number}{' (continued)' if continued else ''}  {markup(text, story.quantities)}", type_.caption
        )

    return made


def _no_flowables(block: Heading, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    return []


def _text(block: Text, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    return [Paragraph(markup(block.text, story.quantities), type_.small if block.small else type_.body)]


def _bullets(block: Bullets, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    return [Paragraph(markup(item, story.quantities), type_.bullet, bulletText="•") for item in block.items]


def _table(block: Table, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    if any(len(row) != len(block.header) for row in block.rows):
        raise InputError(f"the table {block.name!r} of the report has rows of another length than its header")
    header = tuple(markup(head, story.quantities) for head in block.header)
    rows = tuple(tuple(markup(cell, story.quantities) for cell in row) for row in block.rows)
    rows = rows or (("none", *[""] * (len(header) - 1)),)
    numbers = (False, *[not block.words] * (len(header) - 1))
    caption = _caption(block.name, block.caption, story, type_)
    return [TableFlowable.of(Grid(header, rows, numbers), type_, caption, story.layout, block.name)]


def _verdicts(block: Verdicts, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    rows: tuple[tuple[str, ...], ...] = tuple(_verdict_row(verdict, section, story) for verdict in block.verdicts)
    header: tuple[str, ...] = ("Verdict", "About", "Value", "Threshold", "What it means, what to do")
    if not any(verdict.advice for verdict in block.verdicts):
        header, rows = header[:4], tuple(row[:4] for row in rows)
    rows = rows or (("none", *[""] * (len(header) - 1)),)
    grid = Grid(header, rows, (False,) * len(header))
    caption = _caption(block.name, block.caption, story, type_)
    return [TableFlowable.of(grid, type_, caption, story.layout, block.name)]


def _verdict_row(verdict: Verdict, section: Section, story: Story) -> tuple[str, ...]:
    """A verdict of another section leads there, and says where that is on paper."""
    if verdict.quantity not in story.quantities:
        raise InputError(f"the verdict {verdict.name!r} of the report is on the quantity {verdict.quantity!r}, unknown")
    quantity = story.quantities[verdict.quantity]
    mark, color = _MARKS[verdict.judgement]
    name, home = markup(verdict.name, story.quantities), verdict.quantity.split(".")[0]
    if home != section.key and home in story.keys:
        anchor = section_anchor(home)
        name = link(anchor, f"{name} (p.\u00a0{story.pages.get(anchor, 0)})")
    return (
        f'<font color="{color}">{mark}\u00a0<b>{verdict.judgement}</b></font>',
        name,
        markup(f"{quoted(quantity)} {unit_words(quantity.unit)}".strip()),
        markup(verdict.rule, story.quantities),
        markup(verdict.advice, story.quantities),
    )


def _chart(block: Chart, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    width, height = (72.0 * float(inches) for inches in block.figure.get_size_inches())
    scale = min(1.0, TEXT_WIDTH_PT / width, 0.85 * FRAME_HEIGHT_PT / height)
    cell = Cell(story.objects.chart(block.figure), scale * width, scale * height, scale * width)
    caption = _caption(block.name, block.caption, story, type_)
    return [Figure([[cell]], caption(False), story.layout, block.name)]


def _pictures(block: Pictures, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    lines = picture_lines(block.pictures, type_, story.objects, story.quantities)
    caption = _caption(block.name, block.caption, story, type_)
    pages: list[list[list[Cell]]] = [[]]
    for line in lines:
        trial = Figure([*pages[-1], line], caption(True), story.layout, "")
        if pages[-1] and trial.wrap(TEXT_WIDTH_PT, 0)[1] > FRAME_HEIGHT_PT:
            pages.append([])
        pages[-1].append(line)
    return [Figure(page, caption(k > 0), story.layout, "" if k else block.name) for k, page in enumerate(pages)]


def _scene(block: Scene, section: Section, story: Story, type_: Typography) -> list[Flowable]:
    sides = story.scenes.pictures(block)
    room = (TEXT_WIDTH_PT - GAP_PT) / 2
    h, w = sides[0].picture.shape[:2]
    width = min(room, 95 * PT_PER_MM * w / h) * type_.size
    cells = [Cell(story.objects.picture(side, width / PT_PER_MM), width, width * h / w, room) for side in sides]
    named = [
        f'<font color="{body.color}" size="{type_.note.fontSize + 2}">■</font>\u00a0{_unbroken(body.label, story)}'
        if body.color
        else markup(body.label, story.quantities)
        for body in colored(block.bodies)
        if body.label
    ]
    legend = Paragraph(" &nbsp; ".join(named), type_.note) if named else None
    caption = _caption(block.name, block.caption, story, type_)
    return [Figure([cells], caption(False), story.layout, block.name, legend)]


def _unbroken(text: str, story: Story) -> str:
    return markup(text, story.quantities).replace(" ", "\u00a0")


_SETTERS: dict[type, Callable[..., list[Flowable]]] = {
    Heading: _no_flowables,
    Text: _text,
    Bullets: _bullets,
    Table: _table,
    Verdicts: _verdicts,
    Chart: _chart,
    Pictures: _pictures,
    Scene: _scene,
}
