"""What stands in the page: escaped, anchored, numbered, self-contained, the same each time."""

import base64
import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from paxel_design.gamut.scenes import SceneBody
from paxel_design.report.content import (
    Bullets,
    Chart,
    Heading,
    Paragraph,
    Pictures,
    Quantity,
    Scene,
    Section,
    Table,
    Verdicts,
)
from paxel_design.report.html.images import picture_uri
from paxel_design.report.html.page import page_html, write_html
from paxel_design.report.html.scenes import scene_data
from paxel_runtime.errors import InputError

Sections = Callable[[], list[Section]]

ABOUT = {
    "title": "Report <1>",
    "subtitle": "a & b",
    "bench": "virtual bench",
    "writer": "paxel 1",
    "date": "2026-11-22",
}

VOID = {"img", "link", "meta", "br"}


class Page(HTMLParser):
    """Elements with their attributes, texts by element, and whether every end tag fits."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open, tag
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append((self.open[-1] if self.open else "", data))

    def text(self) -> str:
        return "".join(text for tag, text in self.texts if tag not in {"script", "style", "title"})

    def attributes(self, *names: str) -> list[str]:
        return [value for _, attrs in self.elements for name in names if (value := attrs.get(name)) is not None]


def without_scenes(sections: list[Section]) -> list[Section]:
    """For tests of the rest: no stills are drawn."""
    return [replace(s, blocks=tuple(b for b in s.blocks if not isinstance(b, Scene))) for s in sections]


@pytest.fixture(scope="module")
def plain(sections: Sections) -> Page:
    return Page(page_html(without_scenes(sections()), **ABOUT))


def test_texts_are_escaped_and_quantities_written_with_their_sources(plain: Page) -> None:
    assert not plain.open, "every element is closed"
    text = plain.text()
    assert 'Error 0.124 dE00 of 833\u00a0512 for <b>"A & B"</b>, <script>alert(1)</script>.' in text
    assert "833\u00a0512 CIELAB³" in text, "a verdict's value has its unit"
    assert "19.0 to 42.0 L*" in text
    titles = {attrs["title"] for tag, attrs in plain.elements if tag == "span" and "title" in attrs}
    assert "summary.dE: calibration/accuracy.json#/pattern/dE00_mean" in titles
    assert ("title", "Report <1> – a & b") in plain.texts
    assert "virtual bench" in text


def test_figures_and_tables_are_numbered_apart_and_everything_linked_is_there(plain: Page) -> None:
    labels = re.findall(r"(?:Fig\.|Table) \d+", "|".join(text for tag, text in plain.texts if tag == "a"))
    assert labels == ["Table 1", "Table 2", "Fig. 1", "Table 3", "Fig. 2"]
    ids = plain.attributes("id")
    assert len(ids) == len(set(ids))
    links = [link for link in plain.attributes("href", "xlink:href") if link.startswith("#")]
    assert {"#summary", "#gamut", "#gamut--the-bodies", "#gamut--words", "#curve", "#verdicts"} <= set(links)
    assert {link[1:] for link in links} <= set(ids)
    described = plain.attributes("aria-labelledby", "aria-controls")
    assert set(described) <= set(ids)


def test_a_page_without_bodies_has_no_plotly(plain: Page, sections: Sections) -> None:
    assert "scene-data" not in plain.attributes("id")
    assert len(page_html(without_scenes(sections()), **ABOUT)) < 100_000


def test_every_picture_has_a_text_and_nothing_comes_from_elsewhere(plain: Page) -> None:
    for tag, attrs in plain.elements:
        assert tag != "img" or attrs["alt"]
        assert tag != "svg" or attrs["aria-label"] == "A chart with <signs>"
    addresses = plain.attributes("src", "href", "xlink:href", "srcset", "poster", "action")
    assert all(address.startswith(("#", "data:")) for address in addresses)
    styles = "".join(text for tag, text in plain.texts if tag == "style") + "".join(plain.attributes("style"))
    assert "@import" not in styles
    assert set(re.findall(r"url\((.)", styles)) <= {"#"}
    html = next(attrs for tag, attrs in plain.elements if tag == "html")
    assert html == {"lang": "en"}


def test_the_policy_names_the_hash_of_every_script_that_runs(sections: Sections, monkeypatch: Any) -> None:
    monkeypatch.setattr("paxel_design.report.html.scenes._still", lambda bodies: "")  # seconds, and not looked at here
    text = page_html(sections(), **ABOUT)
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    directives = dict(part.strip().split(" ", 1) for part in policy.group(1).replace("&#x27;", "'").split(";"))
    assert directives["default-src"] == "'none'"
    assert directives["img-src"] == "data: blob:"
    scripts = re.findall(r"<script( [^>]*)?>(.*?)</script>", text, re.DOTALL)
    run = [script for attributes, script in scripts if "json" not in attributes]
    assert len(run) == 4
    hashes = {f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'" for script in run}
    assert set(directives["script-src"].split()) == hashes
    assert "Licensed under the MIT license" in run[0][:300], "plotly's licence stays with it"
    assert "cannot draw one" in text, "where no still could be drawn the page says so"


def test_the_same_sections_give_the_same_bytes(sections: Sections, tmp_path: Path) -> None:
    pages = []
    for name in ("a.html", "b.html"):
        one_scene = sections()
        one_scene[1] = replace(one_scene[1], blocks=(one_scene[1].blocks[1], *one_scene[1].blocks[-3:]))
        write_html(tmp_path / name, one_scene, **ABOUT)
        pages.append((tmp_path / name).read_bytes())
    assert b"scene-0" in pages[0]
    assert pages[0] == pages[1]


def test_meshes_are_packed_once_and_whole(sections: Sections) -> None:
    scenes = [block for block in sections()[1].blocks if isinstance(block, Scene)]
    data = json.loads(scene_data(scenes))
    assert len(data["meshes"]) == 2, "four scenes of two bodies"
    bodies = data["scenes"]["scene-0"]
    assert [body["label"] for body in bodies] == ["full gamut", "<sub> & gamut"], "the largest first"
    assert [body["opacity"] < 1 for body in bodies] == [True, False], "the outer one is glassy"
    assert data["scenes"]["scene-1"][0]["color"] is None, "alone, a body has the colours of its vertices"
    mesh = max((body for body in scenes[0].bodies), key=lambda body: body.mesh.mesh_volume).mesh
    packed = data["meshes"][bodies[0]["mesh"]]
    Lab = np.frombuffer(base64.b64decode(packed["Lab"]), "<f4").reshape(3, -1).T
    faces = np.frombuffer(base64.b64decode(packed["faces"]), "<u2").reshape(3, -1).T
    assert np.array_equal(Lab, mesh.Lab.astype(np.float32))
    assert np.array_equal(faces, mesh.faces)
    assert not packed["wide"]


def test_more_vertices_than_16_bits_count_take_32(sections: Sections) -> None:
    small = next(block for block in sections()[1].blocks if isinstance(block, Scene)).bodies[0]
    Lab = np.zeros((70_000, 3))
    Lab[:6] = small.mesh.Lab
    faces = np.array([*small.mesh.faces.tolist(), (0, 1, 69_999)])
    wide = SceneBody(replace(small.mesh, Lab=Lab, faces=faces))
    (packed,) = json.loads(scene_data([Scene("s", "c", (wide,))]))["meshes"].values()
    assert packed["wide"]
    assert np.frombuffer(base64.b64decode(packed["faces"]), "<u4").max() == 69_999


def test_pixels_that_are_looked_at_one_by_one_are_kept() -> None:
    noise = np.random.default_rng(0).integers(0, 256, (300, 1700, 3), dtype=np.uint8)

    def decoded(uri: str) -> Image.Image:
        return Image.open(BytesIO(base64.b64decode(uri.split(",")[1])))

    exact = decoded(picture_uri(noise, exact=True))
    assert np.array_equal(np.asarray(exact), noise)
    photograph = decoded(picture_uri(noise, exact=False))
    assert photograph.format == "JPEG"
    assert photograph.size == (1600, 282), "at most 1600 px wide"
    flat = decoded(picture_uri(np.full((40, 50, 3), 7, np.uint8), exact=False))
    assert flat.format == "PNG", "small without losses"


def test_bad_sections_leave_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text("before")
    twice = [Section("a", "A", (Heading("One"), Heading("One"))), Section("b", "B", ())]
    unknown = [Section("a", "A", (Paragraph("{no.such}"),))]
    ragged = [Section("a", "A", (Table("t", "c", ("x", "y"), (("1",),)),))]
    for sections, words in ((twice, "stand twice: a--one"), (unknown, r"no\.such"), (ragged, "'t'.*another length")):
        with pytest.raises(InputError, match=words):
            write_html(path, sections, **ABOUT)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_verdict_on_another_section_leads_there() -> None:
    from paxel_design.report.content import Verdict

    summary = Section("summary", "S", (Verdicts("v", "c", (Verdict("Colours", "gamut.n", "weak", "r"),)),))
    gamut = Section("gamut", "G", (Bullets(()),), {"gamut.n": Quantity(3)})
    page = page_html([summary, gamut], **ABOUT)
    assert '<a href="#gamut">Colours</a>' in page
    assert "What it means" not in page, "no column without a word in it"
    assert "○" in page
    assert "weak</span>" in page


def test_charts_of_one_page_share_no_id_and_keep_their_text(sections: Sections) -> None:
    chart = next(block for block in sections()[1].blocks if isinstance(block, Chart))
    both = [Section("a", "A", (replace(chart, name="one"), replace(chart, name="two")))]
    page = Page(page_html(both, **ABOUT))
    ids = page.attributes("id")
    assert len(ids) == len(set(ids))
    drawn = "".join(text for tag, text in page.texts if tag == "text")
    assert drawn.count("a < b & c") == 4, "texts are texts, in two panels of two charts"
    referred = [r for v in page.attributes("clip-path", "style") for r in re.findall(r"url\(#([^)]*)\)", v)]
    assert referred
    assert set(referred) <= set(ids)


def test_no_bench_no_badge(sections: Sections) -> None:
    assert "badge" not in Page(page_html([Section("a", "A", ())], **{**ABOUT, "bench": ""})).attributes("class")


def test_pictures_at_true_scale_say_so(plain: Page, sections: Sections) -> None:
    assert any(isinstance(block, Pictures) for block in sections()[1].blocks)
    assert any(style == "width:60mm" for style in plain.attributes("style"))
    assert "60 mm wide, true scale on paper; screens differ" in plain.text()
