"""The page: head, contents, sections, scripts, in one file that asks the network for nothing.

A Content-Security-Policy in the page allows only what stands in it: pictures as data, its own scripts by their hashes.
"""

from __future__ import annotations

import base64
import hashlib
from collections import Counter
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from paxel_design.report.content import Heading, Quantity, Scene, Section, numbered
from paxel_design.report.html.blocks import BLOCKS, Setting, heading_anchor
from paxel_design.report.html.markup import Wording, escaped, tag, wording_of
from paxel_design.report.html.scenes import scene_data, scene_stills
from paxel_runtime.errors import InputError
from paxel_runtime.storage import write_text

__all__ = ["page_html", "write_html"]

_BENCH_NOTE = "Figures and pictures come from a simulation of projector, print and camera, not from hardware."


def write_html(
    path: Path, sections: Sequence[Section], *, title: str, subtitle: str, bench: str, writer: str, date: str
) -> None:
    """Write the report as one self-contained HTML file, whole or not at all.

    Parameters
    ----------
    path : Path
    sections : sequence of Section
    title, subtitle : str
    bench : str
        "virtual bench, realistic"; empty where the figures were measured on hardware.
    writer : str
        Package and version.
    date : str

    Raises
    ------
    InputError
        If a text names a quantity that no section has, or two blocks share a name.
    """
    write_text(path, page_html(sections, title=title, subtitle=subtitle, bench=bench, writer=writer, date=date))


def page_html(sections: Sequence[Section], *, title: str, subtitle: str, bench: str, writer: str, date: str) -> str:
    """The report as HTML; the same sections give the same text. Parameters as of `write_html`."""
    _check_anchors(sections)
    quantities: dict[str, Quantity] = {}
    for section in sections:
        quantities.update(section.quantities)
    wording = wording_of(quantities)
    labels, keys = numbered(sections), tuple(section.key for section in sections)
    scenes = [block for section in sections for block in section.blocks if isinstance(block, Scene)]
    stills = scene_stills(scenes)
    plotly = _plotly() if scenes else ""
    scripts = [_shipped(name) for name in ("page.js", *(("bodies.js", "scenes.js") if scenes else ()))]
    data = [
        tag("script", scene_data(scenes), type="application/json", id="scene-data"),
        tag("script", plotly, type="text/plain", id="plotly"),
    ]
    header = _header(title, subtitle, bench, ", ".join(part for part in (date, writer) if part))
    body = tag(
        "body",
        tag("a", "Skip to the report", href="#report", class_="skip"),
        _contents(sections, wording, bench),
        tag(
            "main",
            header,
            *(_section(section, Setting(wording, labels, stills, keys, section.key)) for section in sections),
            id="report",
            tabindex="-1",
        ),
        *(data if scenes else ()),
        *(tag("script", script) for script in scripts),
    )
    head = _head(title, subtitle, writer, [plotly, *scripts])
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en')}\n"


def _head(title: str, subtitle: str, writer: str, scripts: Sequence[str]) -> str:
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in scripts)
    policy = (
        "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; "
        f"script-src {hashes}; base-uri 'none'; form-action 'none'"
    )
    return tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", name="color-scheme", content="light dark"),
        tag("meta", name="generator", content=writer),
        tag("link", rel="icon", href="data:,"),
        tag("title", escaped(f"{title} – {subtitle}" if subtitle else title)),
        tag("style", _shipped("page.css")),
    )


def _header(title: str, subtitle: str, bench: str, made: str) -> str:
    return tag(
        "header",
        tag("h1", escaped(title)),
        tag("p", escaped(subtitle), class_="subtitle") if subtitle else "",
        tag("p", _badge(bench), " ", _BENCH_NOTE) if bench else "",
        tag("p", escaped(made), class_="made"),
    )


def _badge(bench: str) -> str:
    return tag("strong", escaped(bench), class_="badge")


def _contents(sections: Sequence[Section], wording: Wording, bench: str) -> str:
    """The contents: at the side of wide screens, folded behind a button on narrow ones."""
    entries = []
    for section in sections:
        headings = [block for block in section.blocks if isinstance(block, Heading)]
        inner = "".join(_entry(heading_anchor(section.key, h), wording.markup(h.text)) for h in headings)
        entries.append(_entry(section.key, wording.markup(section.title), tag("ol", inner) if inner else ""))
    return tag(
        "nav",
        tag("button", "Contents", type="button", class_="fold", aria_expanded="false", aria_controls="contents"),
        tag("ol", *entries, id="contents"),
        _badge(bench) if bench else "",
        aria_label="Contents",
    )


def _entry(anchor: str, words: str, inner: str = "") -> str:
    return tag("li", tag("a", words, href=f"#{anchor}"), inner)


def _section(section: Section, setting: Setting) -> str:
    title = tag("h2", setting.wording.markup(section.title), id=f"{section.key}--title")
    blocks = (BLOCKS[type(block)](block, setting) for block in section.blocks)
    return tag("section", title, *blocks, id=section.key, aria_labelledby=f"{section.key}--title")


def _plotly() -> str:
    """Plotly's script with its licence; the page runs it when the first scene is wanted.

    Raises
    ------
    InputError
        If it cannot stand in a page.
    """
    from plotly.offline import get_plotlyjs  # reads 5 MB

    script = str(get_plotlyjs())
    if "</script" in script.lower() or "<!--" in script:
        raise InputError(
            "this version of plotly cannot be put into a page: its script holds marks of HTML; try another"
        )
    return script


def _shipped(name: str) -> str:
    return files("paxel_design.report.html").joinpath(name).read_text(encoding="utf-8")


def _check_anchors(sections: Sequence[Section]) -> None:
    """Raise an InputError if two sections, headings or blocks would have one anchor."""
    anchors = [section.key for section in sections]
    for section in sections:
        for block in section.blocks:
            if isinstance(block, Heading):
                anchors.append(heading_anchor(section.key, block))
            elif name := getattr(block, "name", ""):
                anchors.append(name)
    twice = [anchor for anchor, count in Counter(anchors).items() if count > 1]
    if twice:
        raise InputError(f"names in a report must be unique, but these stand twice: {', '.join(twice)}")
