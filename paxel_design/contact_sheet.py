"""The contact sheet: pictures side by side with labels, readable at one glance (``demo.png``).

`write_contact_sheet` draws any groups of labelled tiles; `demo_sheet` composes the sheet of a whole run. Knows
pictures (uint8 sRGB) and words; computes no colour and no figure.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo

from paxel_runtime.clustering import cluster_colors, label_picture
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB, sRGB_to_linear_sRGB
from paxel_runtime.pictures import resample
from paxel_runtime.storage import write_atomically
from paxel_runtime.version import WRITER

__all__ = ["EffectTiles", "Group", "SurfaceTiles", "Text", "Tile", "demo_sheet", "write_contact_sheet"]

sRGB8 = NDArray[np.uint8]
"""(h, w, 3) sRGB codes."""

_TILE = (416, 234)
_GAP, _MARGIN = 22, 48
_LABEL_PX, _NOTE_PX, _TEXT_PX, _HEADING_PX, _TITLE_PX = 23, 20, 24, 36, 56
_PAPER, _PANEL = (250, 249, 246), (238, 236, 230)
_INK, _SOFT_INK, _ACCENT = (28, 28, 30), (98, 98, 102), (186, 60, 32)
_CLUSTER_ZOOM = 4


@dataclass(frozen=True, eq=False)
class Tile:
    """One picture of the sheet.

    Attributes
    ----------
    picture : (h, w, 3) uint8 array
        sRGB. Shrunk in linear light to fit its cell; a smaller one is enlarged by a whole factor, pixels kept.
    label : str
        What it is; stands above it.
    note : str
        Figures or an explanation; stands below it.
    emphasis : bool
        Framed: this is what to look at.
    cropped : bool
        Show the middle at 100 %, a pixel of the picture a pixel of the sheet, instead of the whole.
    """

    picture: sRGB8
    label: str
    note: str = ""
    emphasis: bool = False
    cropped: bool = False


@dataclass(frozen=True)
class Text:
    """A paragraph in the place of tiles: `lines` are wrapped, an empty one makes room; `columns` cells wide.

    A line that starts with a cluster's colour is written as ``(colour, text)``, colour a uint8 triple.
    """

    lines: tuple[str | tuple[tuple[int, int, int], str], ...]
    columns: int


@dataclass(frozen=True)
class Group:
    """Rows of tiles under a heading."""

    heading: str
    rows: tuple[tuple[Tile | Text, ...], ...]


@dataclass(frozen=True, eq=False)
class SurfaceTiles:
    """What one surface should show and shows; all (H, W, 3) uint8 sRGB.

    Attributes
    ----------
    source : array
        The picture that was wanted.
    mapped : array
        The same in the colours of the sub-gamut.
    seen, seen_adapted : array
        The view at fixed exposure, and exposed as a camera or the eye adapts.
    note : str
        Figures of the view.
    """

    source: sRGB8
    mapped: sRGB8
    seen: sRGB8
    seen_adapted: sRGB8
    note: str = ""


@dataclass(frozen=True, eq=False)
class EffectTiles:
    """One projection and what it shows on each surface.

    Attributes
    ----------
    heading : str
        The effect in words.
    projection : (H, W, 3) uint8 array
        The projection image.
    on_pattern, on_white : SurfaceTiles or None
        None where the effect leaves the surface free.
    """

    heading: str
    projection: sRGB8
    on_pattern: SurfaceTiles | None
    on_white: SurfaceTiles | None


def demo_sheet(
    path: Path,
    *,
    pattern: sRGB8,
    labels: NDArray[np.uint8],
    cluster_names: Sequence[str],
    effects: Sequence[EffectTiles],
    explanation: Sequence[str] = (),
    notes: str = "",
) -> None:
    """Write the contact sheet of a demo run: the print, its clusters, and every projection with what it shows.

    Each effect takes a row a surface: on the left the projection image, whole and its middle at 100 %; then the
    wanted picture, the same in the colours that the sub-gamut holds, and what is seen, as a camera exposes it and
    at its true brightness beside full white.

    Parameters
    ----------
    path : path of the PNG
    pattern : (h, w, 3) uint8 array
        Piece of the print, as a preview shows it.
    labels : (H, W) uint8 array
        Cluster labels on the projector's raster; its middle is shown enlarged.
    cluster_names : sequence of str
    effects : sequence of EffectTiles
    explanation : sequence of str
        Lines for the reader, beside the pattern; by default three that say how it works.
    notes : str
        One line under the title: setup, resolution, distance.
    """
    one_surface = all(effect.on_white is None for effect in effects)
    h, w = _TILE[1] // _CLUSTER_ZOOM, _TILE[0] // _CLUSTER_ZOOM
    cluster_map = _middle(label_picture(labels, cluster_names), w, h)
    lines: list[str | tuple[tuple[int, int, int], str]] = [
        *(explanation or (_HOW_ONE_CHANNEL_WORKS if one_surface else _HOW_IT_WORKS)),
        "",
    ]
    for name, color in zip(cluster_names, cluster_colors(cluster_names), strict=True):
        lines.append((tuple(int(v) for v in color), _cluster_words(name)))  # type: ignore[arg-type]
    setup = Group(
        "The print, and which part of it each projector pixel lights",
        (
            (
                Tile(_in_tile_shape(pattern), "the printed pattern (detail)"),
                Tile(cluster_map, f"clusters of projector pixels, {_CLUSTER_ZOOM}00 %"),
                Text(tuple(lines), 3),
            ),
        ),
    )
    groups = [setup, *(_effect_group(effect) for effect in effects)]
    title = "Paxel: colour from the print" if one_surface else "Paxel: one projection, two surfaces"
    write_contact_sheet(path, groups, title, notes)


def write_contact_sheet(path: Path, groups: Sequence[Group], title: str, notes: str = "") -> None:
    """Draw labelled groups of tiles into a PNG, "virtual bench" in its title bar.

    Parameters
    ----------
    path : path of the PNG
    groups : sequence of Group
        Drawn one below the other; the sheet is as wide as the widest row.
    title, notes : str
        The title bar: a line large, a line small.

    Raises
    ------
    InputError
        If there is nothing to draw, or a picture is not (h, w, 3) uint8.
    """
    rows = [row for group in groups for row in group.rows]
    if not rows:
        raise InputError("a contact sheet needs at least one row of tiles, got none")
    for tile in (cell for row in rows for cell in row if isinstance(cell, Tile)):
        if tile.picture.dtype != np.uint8 or tile.picture.ndim != 3 or tile.picture.shape[2] != 3:
            raise InputError(
                f"picture {tile.label!r} must be (h, w, 3) uint8, got {tile.picture.shape} of {tile.picture.dtype}"
            )
    columns = max(sum(cell.columns if isinstance(cell, Text) else 1 for cell in row) for row in rows)
    width = 2 * _MARGIN + columns * _TILE[0] + (columns - 1) * _GAP
    heights = [_group_height(group) for group in groups]
    title_height = _MARGIN + int(1.3 * _TITLE_PX) + (int(1.8 * _TEXT_PX) if notes else 0)
    sheet = Image.new("RGB", (width, title_height + sum(heights) + _MARGIN // 2), _PAPER)
    draw = ImageDraw.Draw(sheet)
    _draw_title(draw, width, title, notes)
    y = title_height
    for group, height in zip(groups, heights, strict=True):
        _draw_group(sheet, draw, group, y, width)
        y += height
    info = PngInfo()
    info.add_text("Software", WRITER)
    info.add_text("Title", f"{title} (virtual bench)")
    write_atomically(path, lambda p: sheet.save(p, format="PNG", pnginfo=info, compress_level=7))


_TEXT_INDENT = 36

_HOW_IT_WORKS = (
    "A projector pixel lights one spot of the print. Sorted by the ink they hit, the pixels form clusters.",
    "Ink swallows light that white paper returns in full: so one projection can be two pictures, one on the print and "
    "another on a white sheet held in front of it.",
)

_HOW_ONE_CHANNEL_WORKS = (
    "A projector pixel lights one spot of the print. Sorted by the ink they hit, the pixels form clusters.",
    "Each cluster has the colour of its ink, so a projector of one channel shows pictures in full colour: from a "
    "distance the eye mixes the dots.",
)


def _cluster_words(name: str) -> str:
    base = re.sub(r"-\d+$", "", name)
    return f"pixels on {base}" if "+" not in base else f"pixels on the edges of {base.replace('+', ' and ')} ({name})"


def _effect_group(effect: EffectTiles) -> Group:
    """A row for each surface that has a picture; the projection image stands at the left of them."""
    left = [
        Tile(effect.projection, "the projection image"),
        Tile(effect.projection, "its middle at 100 %", cropped=True),
    ]
    alone = effect.on_pattern is None or effect.on_white is None
    rows: list[tuple[Tile | Text, ...]] = []
    for surface, words in ((effect.on_pattern, "on the print"), (effect.on_white, "on the white sheet")):
        if surface is not None:
            wanted = Tile(surface.source, f"wanted {words}")
            mapped = Tile(surface.mapped, "in colours the print allows" if alone else "in colours both surfaces allow")
            seen = Tile(surface.seen, "seen, true brightness")
            adapted = Tile(surface.seen_adapted, f"seen {words}, eye adapted", surface.note, emphasis=True)
            rows.append((*left, wanted, mapped, adapted) if alone else (left[len(rows)], wanted, mapped, seen, adapted))
    return Group(effect.heading, tuple(rows))


@cache
def _font(size_px: int) -> ImageFont.FreeTypeFont:
    font = ImageFont.load_default(size_px)
    assert isinstance(font, ImageFont.FreeTypeFont)  # Pillow's wheels have FreeType
    return font


def _label_height() -> int:
    return int(1.75 * _LABEL_PX)


def _row_height(row: Sequence[Tile | Text]) -> int:
    note = any(isinstance(cell, Tile) and cell.note for cell in row)
    tiles = _TILE[1] + (int(1.5 * _NOTE_PX) if note else 0)
    texts = [sum(step for _, _, step in _text_lines(cell)) for cell in row if isinstance(cell, Text)]
    return _label_height() + max([tiles, *texts]) + _GAP


def _group_height(group: Group) -> int:
    return int(2.2 * _HEADING_PX) + sum(_row_height(row) for row in group.rows)


def _draw_title(draw: ImageDraw.ImageDraw, width: int, title: str, notes: str) -> None:
    y = _MARGIN - 10
    draw.text((_MARGIN, y), title, _INK, _font(_TITLE_PX), stroke_width=1, stroke_fill=_INK)
    badge = "virtual bench"
    badge_width = int(_font(_HEADING_PX).getlength(badge)) + 44
    box = (width - _MARGIN - badge_width, y, width - _MARGIN, y + int(1.2 * _TITLE_PX))
    draw.rounded_rectangle(box, radius=12, fill=_ACCENT)
    draw.text(((box[0] + box[2]) / 2, (box[1] + box[3]) / 2), badge, (255, 255, 255), _font(_HEADING_PX), anchor="mm")
    if notes:
        draw.text((_MARGIN, y + int(1.45 * _TITLE_PX)), notes, _SOFT_INK, _font(_TEXT_PX))


def _draw_group(sheet: Image.Image, draw: ImageDraw.ImageDraw, group: Group, y: int, width: int) -> None:
    y += int(0.4 * _HEADING_PX)
    draw.line((_MARGIN, y, width - _MARGIN, y), fill=(205, 202, 194), width=2)
    draw.text((_MARGIN, y + 12), group.heading, _INK, _font(_HEADING_PX))
    y += int(1.8 * _HEADING_PX)
    for row in group.rows:
        x = _MARGIN
        for cell in row:
            columns = cell.columns if isinstance(cell, Text) else 1
            if isinstance(cell, Text):
                _draw_text(draw, cell, x, y + _label_height())
            else:
                _draw_tile(sheet, draw, cell, x, y)
            x += columns * (_TILE[0] + _GAP)
        y += _row_height(row)


def _draw_tile(sheet: Image.Image, draw: ImageDraw.ImageDraw, tile: Tile, x: int, y: int) -> None:
    ink = _ACCENT if tile.emphasis else _INK
    draw.text((x, y + 2), _fit(tile.label, _LABEL_PX, _TILE[0]), ink, _font(_LABEL_PX))
    y += _label_height()
    picture = _middle(tile.picture, *_TILE) if tile.cropped else _scaled(tile.picture)
    left, top = x + (_TILE[0] - picture.shape[1]) // 2, y + (_TILE[1] - picture.shape[0]) // 2
    draw.rectangle((x, y, x + _TILE[0] - 1, y + _TILE[1] - 1), fill=_PANEL)
    sheet.paste(Image.fromarray(picture), (left, top))
    if tile.emphasis:
        draw.rectangle((x - 4, y - 4, x + _TILE[0] + 3, y + _TILE[1] + 3), outline=_ACCENT, width=4)
    if tile.note:
        draw.text((x, y + _TILE[1] + 9), _fit(tile.note, _NOTE_PX, _TILE[0]), _SOFT_INK, _font(_NOTE_PX))


def _draw_text(draw: ImageDraw.ImageDraw, text: Text, x: int, y: int) -> None:
    for color, part, step in _text_lines(text):
        if isinstance(color, tuple):
            draw.rectangle((x, y + 4, x + 22, y + 26), fill=color, outline=_INK)
        draw.text((x if color is None else x + _TEXT_INDENT, y), part, _INK, _font(_TEXT_PX))
        y += step


def _text_lines(text: Text) -> list[tuple[tuple[int, int, int] | str | None, str, int]]:
    """The wrapped lines of a paragraph: colour of the mark before it ("" = indented without one), words, height."""
    width = text.columns * _TILE[0] + (text.columns - 1) * _GAP
    step = int(1.35 * _TEXT_PX)
    lines: list[tuple[tuple[int, int, int] | str | None, str, int]] = []
    for line in text.lines:
        mark, words = line if isinstance(line, tuple) else (None, line)
        parts = _wrap(words, _TEXT_PX, width - (_TEXT_INDENT if mark else 0)) if words else [""]
        for k, part in enumerate(parts):
            lines.append((mark if k == 0 else mark and "", part, step if part else step // 3))
    return lines


def _wrap(text: str, size_px: int, width: int) -> list[str]:
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if _font(size_px).getlength(longer) <= width or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def _fit(text: str, size_px: int, width: int) -> str:
    """The text, cut with an ellipsis where it is wider than its tile."""
    if _font(size_px).getlength(text) <= width:
        return text
    while text and _font(size_px).getlength(text + "…") > width:
        text = text[:-1]
    return text.rstrip() + "…"


def _middle(picture: sRGB8, width: int, height: int) -> sRGB8:
    top, left = max(0, (picture.shape[0] - height) // 2), max(0, (picture.shape[1] - width) // 2)
    return picture[top : top + height, left : left + width]


def _in_tile_shape(picture: sRGB8) -> sRGB8:
    """The middle of a picture in the shape of a tile, as large as there is."""
    height, width = picture.shape[:2]
    return _middle(picture, min(width, height * _TILE[0] // _TILE[1]), min(height, width * _TILE[1] // _TILE[0]))


def _scaled(picture: sRGB8) -> sRGB8:
    """Fit a picture into a tile: enlarged by a whole factor with its pixels kept, or shrunk in linear light."""
    height, width = picture.shape[:2]
    scale = min(_TILE[0] / width, _TILE[1] / height)
    if scale >= 1:
        return picture.repeat(int(scale), axis=0).repeat(int(scale), axis=1)
    linear = sRGB_to_linear_sRGB(np.arange(256) / 255).astype(np.float32)[picture]
    small = resample(linear, max(1, round(width * scale)), max(1, round(height * scale)))
    return np.rint(255 * linear_sRGB_to_sRGB(small)).astype(np.uint8)
