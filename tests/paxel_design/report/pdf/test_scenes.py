"""Scenes: two sides, the names of the bodies in the page's text, equal scenes drawn once."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from PIL import Image

from paxel_design.gamut.meshes import GamutMesh
from paxel_design.gamut.scenes import SceneBody
from paxel_design.report.bodies import BODY_COLORS, colored
from paxel_design.report.content import Scene, Section
from paxel_design.report.pdf import scenes
from paxel_design.report.pdf.document import set_document
from paxel_runtime.errors import GamutError

WORDS = {"title": "t", "subtitle": "", "bench": "", "writer": "w", "date": ""}


def _tetrahedron(size: float) -> GamutMesh:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * size + [40.0, 0.0, 0.0]
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return GamutMesh(corners, faces, size**3 / 6, 0.0, size**3 / 6, 1, 0)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Azimuths of the pictures that were drawn: a black square in the middle of white."""
    azimuths: list[float] = []

    def draw(path: Path, bodies: Sequence[SceneBody], *, size_px: tuple[int, int], azimuth_deg: float) -> None:
        if not bodies:
            raise GamutError("a picture of gamuts needs one body or more, got none")
        assert not any(body.label for body in bodies), "names are set as text"
        azimuths.append(azimuth_deg)
        picture = np.full((size_px[1], size_px[0], 3), 255, dtype=np.uint8)
        picture[200:300, 100:500] = 0
        Image.fromarray(picture).save(path)

    monkeypatch.setattr(scenes, "write_scene", draw)
    return azimuths


def test_two_sides_are_drawn_once_and_named_in_words(drawn: list[float]) -> None:
    bodies = (SceneBody(_tetrahedron(20.0), "inner body"), SceneBody(_tetrahedron(60.0), "full gamut"))
    blocks = (Scene("one", "One", bodies), Scene("again", "Again", bodies[::-1]), Scene("alone", "Alone", bodies[:1]))
    content, layout = set_document((Section("summary", "Summary", blocks),), **WORDS)
    assert drawn == [-55.0, 125.0] * 2, "the same bodies in another order are the same scene"
    assert sum(box.kind.startswith("object") for box in layout.boxes) == 6
    opened = pypdfium2.PdfDocument(content)
    text = " ".join("".join(page.get_textpage().get_text_range() for page in opened).split())
    opened.close()
    assert "■ full gamut ■ inner body Fig. 1 One" in text
    assert "■" not in text[text.index("Fig. 2") :], "one body needs no colour to be told from others"


def test_pictures_are_cut_to_what_is_drawn(drawn: list[float]) -> None:
    pictures = scenes.SceneDrawer().pictures(Scene("one", "", (SceneBody(_tetrahedron(20.0)),)))
    assert {p.picture.shape for p in pictures} == {(112, 412, 3)}, "6 pixels of white about the square"


def test_bodies_have_colours_in_turn_the_largest_first() -> None:
    bodies = [SceneBody(_tetrahedron(size)) for size in (20.0, 60.0)]
    scene = Scene("one", "", (bodies[0], replace(bodies[0], color="#112233"), bodies[1]))
    assert [body.color for body in colored(scene.bodies)] == [BODY_COLORS[0], BODY_COLORS[1], "#112233"]
    assert colored(bodies[:1])[0].color is None


def test_a_scene_without_bodies_is_told(drawn: list[float]) -> None:
    with pytest.raises(GamutError, match="one body or more"):
        set_document((Section("summary", "Summary", (Scene("none", "", ()),)),), **WORDS)


def test_a_real_scene_fills_its_picture() -> None:
    pytest.importorskip("pyvista")
    pictures = scenes.SceneDrawer().pictures(Scene("one", "", (SceneBody(_tetrahedron(60.0)),)))
    assert len(pictures) == 2
    for picture in pictures:
        ink = np.any(picture.picture < 250, axis=2)
        assert 0.05 < ink.mean() < 0.9
        assert not np.any(ink[:3]), "nothing is cut off"
        assert not np.any(ink[:, -3:])
