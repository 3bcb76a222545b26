"""Six effects in one picture, for the README: docs/gallery.jpg.

Real photographs (of scikit-image's wheel, all free to use) projected on the virtual bench, `realistic`, 1920 x 1080 on
281 mm, dots of 0.75 mm, as a viewer 4 m away sees both surfaces with adapted eyes: five on a black-and-white
checkerboard; one, from 6 m, on tiles of cyan, magenta, yellow, red, green and blue. The installations stay in FOLDER,
so that a second run makes only what is out of date. Run from a checkout (a quarter of an hour; ``--small``: 960 x 540,
five minutes)::

    python -m reports.gallery FOLDER [--small] [--out docs/gallery.jpg]
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from paxel_design.stages.projection import make_previews, make_projection_stage
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB, sRGB_to_linear_sRGB
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from paxel_runtime.storage import write_atomically
from reports.shared_installations import finish, photographs

LARGEST_BYTES = 400_000
OUT = Path(__file__).parent.parent / "docs" / "gallery.jpg"
FARTHER = {"cmyrgb": {"viewing.distance_mm": 6000.0}}
"""Six inks repeat after six dots, so their texture needs more distance to vanish."""
FULL_SIZE: dict[str, Any] = {"pattern.size_mm": [300.0, 180.0], "camera.resolution": [4000, 3000]}


@dataclass(frozen=True)
class Item:
    """One picture of the gallery: an effect, its photographs in the effect's order, and what it shows."""

    preset: str
    effect: str
    photographs: tuple[str, ...]
    title: str
    caption: str

    @property
    def name(self) -> str:
        """Of the projection."""
        return parse_effect(self.effect).name


ITEMS = (
    Item("bw-checkerboard", "hue-shift:90", ("coffee.png",), "Hue", "every hue turned by 90 degrees on white"),
    Item("bw-checkerboard", "chroma:0.3", ("motorcycle_left.png",), "Chroma", "30 % of the chroma on white"),
    Item("bw-checkerboard", "decolorize", ("astronaut.png",), "Decolorise", "colour on the print, gray on white"),
    Item("bw-checkerboard", "neutralize:50,0,0", ("chelsea.png",), "Hide", "on white nothing but gray"),
    Item("bw-checkerboard", "dual-image", ("astronaut.png", "coffee.png"), "Two pictures", "black-and-white print"),
    Item("cmyrgb", "dual-image", ("chelsea.png", "rocket.jpg"), "Two pictures", "tiles of six inks, seen from 6 m"),
)

_PICTURE = (400, 225)
_RIM = 0.02
"""Of a view, cut off on each side: at the frame's rim the dots have no neighbours."""
_GAP, _MARGIN, _BETWEEN = 6, 28, 36
_CAPTION_PX, _SMALL_PX, _TITLE_PX = 25, 18, 38
_PAPER, _INK, _SOFT, _ACCENT = (250, 249, 246), (28, 28, 30), (98, 98, 102), (186, 60, 32)


def make_show(folder: Path, preset: str, small: bool, progress: Callable[[str, int, int], None]) -> Installation:
    """An installation with its calibration, made or finished."""
    path, size = folder / preset, DEMO_OVERRIDES if small else FULL_SIZE
    if (path / "paxel.toml").is_file():
        installation = Installation.open(path)
    else:
        installation = Installation.create(path, make_settings(preset, size | FARTHER.get(preset, {})))
    return finish(installation, progress)


def views(folder: Path, small: bool, progress: Callable[[str, int, int], None]) -> list[tuple[Item, list[Path]]]:
    """The adapted views of every item, pattern and white sheet."""
    sources = photographs(folder / "photographs")
    made = []
    for preset in dict.fromkeys(item.preset for item in ITEMS):
        installation = make_show(folder, preset, small, progress)
        items = [item for item in ITEMS if item.preset == preset]
        for item in items:
            effect = parse_effect(item.effect)
            pictures = dict(zip(effect.pictures, (sources[name] for name in item.photographs), strict=True))
            make_projection_stage(installation, effect, pictures, name=item.name, shown_on="pattern", progress=progress)
        make_previews(installation, [item.name for item in items], progress=progress)
        for item in items:
            stem = installation.folder("preview") / f"{item.name}.on-"
            made.append((item, [Path(f"{stem}{surface}.auto.png") for surface in ("pattern", "white")]))
    return sorted(made, key=lambda pair: ITEMS.index(pair[0]))


def draw(shown: list[tuple[Item, list[Path]]]) -> Image.Image:
    """The gallery: two items a row, each the print's view beside the white sheet's, with words above."""
    width, height = _PICTURE
    cell = (2 * width + _GAP, int(1.5 * _CAPTION_PX) + height)
    rows = -(-len(shown) // 2)
    top = _MARGIN + int(1.3 * _TITLE_PX) + int(1.6 * _SMALL_PX)
    sheet = Image.new("RGB", (2 * (cell[0] + _MARGIN) + _BETWEEN, top + rows * (cell[1] + _MARGIN)), _PAPER)
    pen = ImageDraw.Draw(sheet)
    pen.text((_MARGIN, _MARGIN - 8), "One projection, two surfaces", _INK, _font(_TITLE_PX), stroke_width=1)
    words = "left: on the print; right: the same projection on a white sheet; seen from 4 m by eyes that adapt to each"
    pen.text((_MARGIN, _MARGIN + int(1.2 * _TITLE_PX)), words, _SOFT, _font(_SMALL_PX))
    badge = _font(_CAPTION_PX).getlength("virtual bench") + 36
    right = sheet.width - _MARGIN
    pen.rounded_rectangle((right - badge, _MARGIN, right, _MARGIN + 44), radius=10, fill=_ACCENT)
    pen.text((right - badge / 2, _MARGIN + 22), "virtual bench", (255, 255, 255), _font(_CAPTION_PX), anchor="mm")
    for k, (item, paths) in enumerate(shown):
        x, y = _MARGIN + k % 2 * (cell[0] + _BETWEEN), top + k // 2 * (cell[1] + _MARGIN)
        pen.text((x, y), item.title, _INK, _font(_CAPTION_PX), stroke_width=0.6, stroke_fill=_INK)
        after = x + _font(_CAPTION_PX).getlength(item.title) + 14
        pen.text((after, y + _CAPTION_PX - _SMALL_PX - 1), item.caption, _SOFT, _font(_SMALL_PX))
        for j, path in enumerate(paths):
            with Image.open(path) as picture:
                # In linear light, as the eye averages
                x_rim, y_rim = (round(_RIM * size) for size in picture.size)
                box = (x_rim, y_rim, picture.width - x_rim, picture.height - y_rim)
                inner = picture.convert("RGB").crop(box)
                linear = sRGB_to_linear_sRGB(np.asarray(inner, np.float32) / 255).astype(np.float32)
            bands = [Image.fromarray(linear[..., c]).resize(_PICTURE, Image.Resampling.LANCZOS) for c in range(3)]
            small = linear_sRGB_to_sRGB(np.stack([np.asarray(band) for band in bands], axis=-1))
            tile = Image.fromarray(np.rint(255 * np.clip(small, 0, 1)).astype(np.uint8))
            sheet.paste(tile, (x + j * (width + _GAP), y + int(1.5 * _CAPTION_PX)))
    return sheet


def _font(size_px: int) -> ImageFont.FreeTypeFont:
    font = ImageFont.load_default(size_px)
    assert isinstance(font, ImageFont.FreeTypeFont)
    return font


def write_jpg(sheet: Image.Image, path: Path) -> int:
    """The best JPEG below `LARGEST_BYTES`; returns its bytes."""
    for quality in range(92, 40, -3):
        buffer = io.BytesIO()
        sheet.save(buffer, "JPEG", quality=quality, optimize=True, progressive=True)
        if buffer.tell() <= LARGEST_BYTES:
            break
    write_atomically(path, lambda p: p.write_bytes(buffer.getvalue()))
    return buffer.tell()


def main() -> None:
    """Make the gallery."""
    options = argparse.ArgumentParser(description="The gallery of the README")
    options.add_argument("folder", type=Path)
    options.add_argument("--small", action="store_true", help="960 x 540 projector pixels")
    options.add_argument("--out", type=Path, default=OUT)
    chosen = options.parse_args()
    said: list[str] = []

    def progress(message: str, done: int, total: int) -> None:
        if said[-1:] != [message]:
            said.append(message)
            print(message, flush=True)

    size = write_jpg(draw(views(chosen.folder, chosen.small, progress)), chosen.out)
    print(f"{chosen.out}: {size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
