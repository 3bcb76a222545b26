"""The contact sheet: every picture is on it as it should be, nothing overlaps, nothing is cut off."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from paxel_design.contact_sheet import (
    EffectTiles,
    Group,
    SurfaceTiles,
    Text,
    Tile,
    demo_sheet,
    write_contact_sheet,
)
from paxel_runtime.errors import InputError
from paxel_runtime.version import WRITER


def _plain(color: tuple[int, int, int], shape: tuple[int, int] = (90, 160)) -> NDArray[np.uint8]:
    return np.full((*shape, 3), color, np.uint8)


def _read(path: Path) -> NDArray[np.uint8]:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def _area(sheet: NDArray[np.uint8], color: tuple[int, int, int]) -> NDArray[np.bool_]:
    return np.all(sheet == color, axis=-1)


def test_every_tile_is_whole_and_in_its_order(tmp_path: Path) -> None:
    colors = [[(201, 1, 1), (1, 202, 1)], [(1, 1, 203), (204, 204, 1)]]
    rows = tuple(tuple(Tile(_plain(c), f"tile {c}", "a note") for c in row) for row in colors)
    write_contact_sheet(tmp_path / "a.png", [Group("heading", rows)], "title", "notes")
    sheet = _read(tmp_path / "a.png")
    centres = []
    for color in (c for row in colors for c in row):
        ys, xs = np.nonzero(_area(sheet, color))
        # 160 x 90 fits twice into a cell: enlarged by 2, a full rectangle.
        assert (np.ptp(ys) + 1, np.ptp(xs) + 1) == (180, 320)
        assert len(ys) == 180 * 320
        centres.append((ys.mean(), xs.mean()))
    (a, b), (c, d) = centres[:2], centres[2:]
    assert a[0] == b[0] < c[0] == d[0]
    assert a[1] == c[1] < b[1] == d[1]


def test_a_large_picture_shrinks_in_linear_light(tmp_path: Path) -> None:
    checker = ((np.indices((1080, 1920)).sum(axis=0) % 2) * 255).astype(np.uint8)[..., None].repeat(3, axis=2)
    write_contact_sheet(tmp_path / "a.png", [Group("", ((Tile(checker, ""),),))], "")
    # Half the light is code 188 (sRGB of 0.5); one of rounding.
    assert (np.abs(_read(tmp_path / "a.png").astype(int) - 188).max(axis=-1) <= 1).sum() > 400 * 200


def test_a_crop_shows_the_middle_pixel_by_pixel(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 256, (540, 960, 3), dtype=np.uint8)
    write_contact_sheet(tmp_path / "a.png", [Group("", ((Tile(picture, "", cropped=True),),))], "")
    sheet = _read(tmp_path / "a.png")
    y, x = np.argwhere(np.all(sheet == picture[270, 480], axis=-1))[0]
    np.testing.assert_array_equal(sheet[y - 50 : y + 50, x - 50 : x + 50], picture[220:320, 430:530])


def test_the_sheet_names_its_writer_and_the_virtual_bench(tmp_path: Path) -> None:
    write_contact_sheet(tmp_path / "a.png", [Group("", ((Tile(_plain((9, 9, 9)), ""), Text(("line",), 1)),))], "Title")
    with Image.open(tmp_path / "a.png") as image:
        assert image.text["Software"] == WRITER  # type: ignore[attr-defined]
        assert "virtual bench" in image.text["Title"]  # type: ignore[attr-defined]
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]  # no temporary file is left


def test_long_words_stay_inside_their_tile(tmp_path: Path) -> None:
    long = Tile(_plain((9, 9, 9)), "a label that is much longer than its tile is wide " * 3, "so is its note " * 9)
    write_contact_sheet(tmp_path / "a.png", [Group("", ((long, Tile(_plain((250, 249, 246)), "")),))], "")
    sheet = _read(tmp_path / "a.png")
    xs = np.nonzero(_area(sheet, (9, 9, 9)))[1]
    right_half = sheet[sheet.shape[0] // 2 - 140 :, xs.max() + 80 : -60]
    assert np.all(right_half.min(axis=(0, 1)) > 180)  # paper, panel, rule: no ink of the neighbour's words


@pytest.mark.parametrize("surfaces", [1, 2])
def test_the_demo_sheet_holds_all_pictures(tmp_path: Path, surfaces: int) -> None:
    shades = iter(range(10, 250))

    def picture() -> NDArray[np.uint8]:
        shade = next(shades)
        return _plain((shade, 255 - shade, 7), (270, 480))

    views = [SurfaceTiles(picture(), picture(), picture(), picture(), "dE00 0.5") for _ in range(surfaces)]
    effects = [EffectTiles("an effect", picture(), views[0], views[1] if surfaces == 2 else None)]
    labels = np.random.default_rng(0).integers(0, 3, (270, 480)).astype(np.uint8)
    pattern = picture()
    demo_sheet(
        tmp_path / "demo.png",
        pattern=pattern,
        labels=labels,
        cluster_names=("black", "white", "black+white"),
        effects=effects,
        notes="setup",
    )
    sheet = _read(tmp_path / "demo.png")
    tiles = [pattern, effects[0].projection, *(p for v in views for p in (v.source, v.mapped, v.seen, v.seen_adapted))]
    for tile in tiles:
        # Shrunk to the cell in linear light: a code of rounding.
        assert (np.abs(sheet.astype(int) - tile[0, 0]).max(axis=-1) <= 1).sum() > 90_000


def test_what_cannot_be_drawn(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least one row"):
        write_contact_sheet(tmp_path / "a.png", [], "title")
    with pytest.raises(InputError, match=r"'gray' must be \(h, w, 3\) uint8"):
        write_contact_sheet(tmp_path / "a.png", [Group("", ((Tile(np.zeros((4, 4), np.uint8), "gray"),),))], "title")
    assert not list(tmp_path.iterdir())
