"""Each kind of block -> HTML. Captions are numbered as in the PDF: Fig. 1, Fig. 2, ... and Table 1, Table 2, ..."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from paxel_design.report.bodies import colored
from paxel_design.report.content import (
    Bullets,
    Chart,
    Heading,
    Paragraph,
    Picture,
    Pictures,
    Scene,
    Table,
    Verdict,
    Verdicts,
)
from paxel_design.report.html.charts import chart_svg
from paxel_design.report.html.images import picture_uri
from paxel_design.report.html.markup import Wording, tag
from paxel_design.report.html.scenes import STILL_PX
from paxel_runtime.errors import InputError

__all__ = ["BLOCKS", "Setting", "heading_anchor"]

_MARKS = {"good": "●", "usable": "◐", "weak": "○"}
"""Verdicts differ in shape and word, not only in colour."""


@dataclass(frozen=True)
class Setting:
    """What a block needs to know of the report that it stands in.

    Attributes
    ----------
    wording : Wording
    labels : mapping of str to str
        Name of a figure or table -> "Fig. 3", "Table 1".
    stills : mapping of str to str
        Name of a scene -> its still as a data URI, or empty.
    sections : tuple of str
        Keys of all sections.
    section : str
        Key of the section that it stands in.
    """

    wording: Wording
    labels: Mapping[str, str]
    stills: Mapping[str, str]
    sections: tuple[str, ...]
    section: str


def heading_anchor(section: str, heading: Heading) -> str:
    """``gamut--lightness-area`` of the heading "Lightness area" in section gamut; no block's name has two dashes."""
    return f"{section}--{re.sub(r'[^a-z0-9]+', '-', heading.text.lower()).strip('-')}"


def _heading(block: Heading, setting: Setting) -> str:
    return tag("h3", setting.wording.markup(block.text), id=heading_anchor(setting.section, block))


def _paragraph(block: Paragraph, setting: Setting) -> str:
    return tag("p", setting.wording.markup(block.text), class_="small" if block.small else None)


def _bullets(block: Bullets, setting: Setting) -> str:
    return tag("ul", *(tag("li", setting.wording.markup(item)) for item in block.items))


def _table(block: Table, setting: Setting) -> str:
    if any(len(row) != len(block.header) for row in block.rows):
        raise InputError(f"the table {block.name!r} of the report has rows of another length than its header")
    words = setting.wording.markup
    rows = [tag("th", words(row[0]), scope="row") + "".join(tag("td", words(c)) for c in row[1:]) for row in block.rows]
    return _rows(block, block.header, rows, setting, "words" if block.words else "numbers")


def _verdicts(block: Verdicts, setting: Setting) -> str:
    header = ["Verdict", "About", "Value", "Threshold"]
    advised = any(verdict.advice for verdict in block.verdicts)
    if advised:
        header.append("What it means, what to do")
    rows = [_verdict(verdict, setting, advised=advised) for verdict in block.verdicts]
    return _rows(block, header, rows, setting, "words verdicts")


def _verdict(verdict: Verdict, setting: Setting, *, advised: bool) -> str:
    """A verdict on a quantity of another section leads there."""
    words = setting.wording.markup
    shape = tag("span", _MARKS[verdict.judgement], class_="shape", aria_hidden="true")
    name, home = words(verdict.name), verdict.quantity.split(".")[0]
    if home != setting.section and home in setting.sections:
        name = tag("a", name, href=f"#{home}")
    cells = [
        tag("td", tag("span", shape, verdict.judgement, class_=f"verdict {verdict.judgement}")),
        tag("th", name, scope="row"),
        tag("td", setting.wording.value(verdict.quantity), class_="value"),
        tag("td", words(verdict.rule)),
    ]
    if advised:
        cells.append(tag("td", words(verdict.advice)))
    return "".join(cells)


def _rows(block: Table | Verdicts, header: Sequence[str], rows: Sequence[str], setting: Setting, look: str) -> str:
    """A table under its caption, in a box that scrolls sideways where it is too wide."""
    head = tag("thead", tag("tr", *(tag("th", setting.wording.markup(text), scope="col") for text in header)))
    body = tag("tbody", *(tag("tr", row) for row in rows or [tag("td", "none", colspan=str(len(header)))]))
    caption = _caption(block.name, block.caption, setting)
    table = tag("table", head, body, class_=look)
    region = tag("div", table, class_="scroll", role="region", aria_labelledby=f"{block.name}--caption")
    return tag("figure", caption, region, id=block.name, class_="tabular")


def _chart(block: Chart, setting: Setting) -> str:
    svg = chart_svg(block.figure, block.name, setting.wording.plain(block.caption))
    return tag("figure", svg, _caption(block.name, block.caption, setting), id=block.name)


def _pictures(block: Pictures, setting: Setting) -> str:
    measured = any(picture.width_mm is not None for picture in block.pictures)
    pictures = (_picture(picture, len(block.pictures), setting.wording) for picture in block.pictures)
    row = tag("div", *pictures, class_="row measured" if measured else "row")
    return tag("figure", row, _caption(block.name, block.caption, setting), id=block.name)


def _picture(picture: Picture, abreast: int, wording: Wording) -> str:
    height, width = picture.picture.shape[:2]
    width_mm = picture.width_mm
    label, note = wording.plain(picture.label), wording.markup(picture.note)
    image = tag(
        "img",
        src=picture_uri(picture.picture, exact=width_mm is not None or picture.pixelated, abreast=abreast),
        alt=label,
        width=str(width),
        height=str(height),
        class_="pixelated" if picture.pixelated else None,
        style=None if width_mm is None else f"width:{width_mm:g}mm",
        decoding="async",
    )
    if width_mm is None:
        image = tag("button", image, type="button", class_="enlarge", aria_label=f"Enlarge: {label}", disabled=True)
    else:
        scale = f"{width_mm:g} mm wide, true scale on paper; screens differ: hold a ruler to it."
        image = tag("div", image, class_="scroll") + tag("p", scale, class_="note")
    heading = tag("p", wording.markup(picture.label), class_="label")
    look = "picture" if width_mm is None else "picture true-scale"
    return tag("div", heading, image, tag("p", note, class_="note"), class_=look)


def _scene(block: Scene, setting: Setting) -> str:
    """A still, over which the page's script draws; its tools stay hidden without the script."""
    caption = setting.wording.plain(block.caption)
    if uri := setting.stills[block.name]:
        still = tag("img", src=uri, alt=caption, width=str(STILL_PX[0]), height=str(STILL_PX[1]))
    else:
        still = tag("p", "No still picture: the machine that wrote this report cannot draw one.", class_="missing")
    live = tag("div", class_="live", role="application", tabindex="0", hidden=True, aria_label=f"{caption} {_KEYS}")
    say = tag("p", class_="missing", role="status", hidden=True)
    noscript = tag("noscript", tag("p", _NO_SCRIPT, class_="missing"))
    parts = (tag("div", still, live, class_="stage"), _legend(block, setting), _TOOLS, say, noscript)
    return tag("figure", *parts, _caption(block.name, block.caption, setting), id=block.name, class_="scene")


_KEYS = "Arrow keys turn it, plus and minus zoom."
_NO_SCRIPT = "Scripts are off, so the bodies cannot be turned here; the picture shows the front view."

_TOOLS = tag(
    "div",
    *(
        tag("button", words, type="button", data_do=action)
        for action, words in {
            "start": "Turn it in 3-D",
            "view-0": "Front view",
            "view-1": "Back view",
            "closer": "Closer",
            "further": "Further",
            "colors": "Displayed colours",
            "save": "Save picture",
            "stop": "Stop",
        }.items()
    ),
    class_="tools",
    hidden=True,
)


def _legend(block: Scene, setting: Setting) -> str:
    """A button for each named body; the script lets it hide and show the body."""
    buttons = [
        tag(
            "button",
            tag("span", class_="swatch" if body.color else "swatch rainbow", style=_background(body.color)),
            setting.wording.markup(body.label),
            type="button",
            data_body=str(k),
            aria_pressed="true",
            disabled=True,
        )
        for k, body in enumerate(colored(block.bodies))
        if body.label
    ]
    return tag("div", *buttons, class_="legend", role="group", aria_label="Bodies to show") if buttons else ""


def _background(color: str | None) -> str | None:
    return f"background:{color}" if color else None


def _caption(name: str, caption: str, setting: Setting) -> str:
    label = tag("a", setting.labels[name], href=f"#{name}", class_="label")
    return tag("figcaption", label, " ", setting.wording.markup(caption), id=f"{name}--caption")


BLOCKS: MappingProxyType[type, Callable[[Any, Setting], str]] = MappingProxyType(
    {
        Heading: _heading,
        Paragraph: _paragraph,
        Bullets: _bullets,
        Table: _table,
        Verdicts: _verdicts,
        Chart: _chart,
        Pictures: _pictures,
        Scene: _scene,
    }
)
"""Kind of block -> what sets it."""
