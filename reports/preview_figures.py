"""What viewers see, in figures: each way of assembly, near and far, the sheet held freely, the print moved.

Pairs of photographs (of scikit-image's wheel) and a pair of texts as dual images, on the virtual bench: dE00 to the
mapped picture, ghosting, coherent gain, local contrast and least distance at 4 m and at 2.7 m; on a white sheet held
20 mm before the wall and turned by 10 degrees; with the print moved by 0.1, 0.3 and 0.5 projector pixels; and, with
``--planted-mark``, the ghost of a mark planted in the other picture. Figures: reports/reference/preview_figures.json,
under the name of the set-up. Run from a checkout (minutes a set-up)::

    python -m reports.preview_figures FOLDER [--quality ideal] [--clusters 2] [--full] [--assembly refine]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.projection import make_previews
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import DualImage
from paxel_runtime.observer import preview_words
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from paxel_runtime.stages import looks_of, project
from paxel_runtime.storage import write_image
from reports.gallery import FULL_SIZE
from reports.shared_installations import finish, photographs

REFERENCE = Path(__file__).parent / "reference" / "preview_figures.json"
PAIRS = {
    "people": ("astronaut.png", "coffee.png"),
    "animals": ("chelsea.png", "motorcycle_left.png"),
    "text": ("text-a.png", "text-b.png"),
}
METHODS = ("refine", "dither", "combine")
DISTANCE_MM, SHEET_MM, TILT_DEG, SHIFTS_PX = 2700.0, 20.0, 10.0, (0.1, 0.3, 0.5)
TEXTS = {
    "text-a.png": "One projection,\ntwo surfaces:\nthis is what the\nprint shows.",
    "text-b.png": "Somebody who\nholds a sheet of\nwhite paper there\nreads this.",
}
SHOWN = (
    "dE00_mean",
    "dE00_p95",
    "ghosting_percent",
    "ghosting_fine_percent",
    "ghost_L",
    "texture_ghost_percent",
    "coherent_gain",
    "local_contrast_kept",
    "minimum_distance_mm",
)


def write_text(path: Path, text: str) -> None:
    """Black letters on white, 16 : 9."""
    image = Image.new("L", (1280, 720), 255)
    ImageDraw.Draw(image).multiline_text((60, 60), text, 0, ImageFont.load_default(130), spacing=20)
    write_image(path, np.asarray(image.convert("RGB")))


def make_show(folder: Path, settings: dict[str, Any]) -> Installation:
    """An installation of the bench with its calibration and sub-gamuts, made or finished."""
    if (folder / "paxel.toml").is_file():
        installation = Installation.open(folder)
    else:
        installation = Installation.create(folder, make_settings("bw-checkerboard", settings))
    finish(installation, lambda message, *_: print(message, flush=True))
    if next(s.state for s in installation.status() if s.stage.name == "gamut") != "done":
        make_gamut(installation, DualImage(), "pattern", lambda *_: None)
    return installation


def rounded(value: Any) -> Any:
    """Figures with four digits."""
    if isinstance(value, dict):
        return {key: rounded(v) for key, v in value.items() if key not in ("inputs", "writer")}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def line(tag: str, surface: str, figures: dict[str, Any]) -> str:
    """One view's figures."""
    parts = [f"{key} {figures[key]:.3g}" for key in SHOWN if figures.get(key) is not None]
    return f"  {tag or 'as usual':24} {surface:10} {'  '.join(parts)}"


def main() -> None:
    """Make the projections, look at them, write the figures."""
    options = argparse.ArgumentParser(description="What viewers see")
    options.add_argument("folder", type=Path)
    options.add_argument("--quality", default="realistic")
    options.add_argument("--clusters", type=int, default=3)
    options.add_argument("--full", action="store_true", help="1920 x 1080 on 281 mm instead of half of both")
    options.add_argument("--assembly", choices=METHODS, nargs="*", default=METHODS)
    options.add_argument("--pairs", choices=tuple(PAIRS), nargs="*", default=tuple(PAIRS))
    options.add_argument("--planted-mark", action="store_true")
    chosen = options.parse_args()
    name = f"{chosen.quality}-K{chosen.clusters}-{'1080p' if chosen.full else '540p'}"
    size = FULL_SIZE if chosen.full else DEMO_OVERRIDES
    installation = make_show(
        chosen.folder / name, size | {"bench.quality": chosen.quality, "clusters.count": chosen.clusters}
    )
    sources = photographs(chosen.folder / "photographs")
    for file, text in TEXTS.items():
        sources[file] = chosen.folder / "photographs" / file
        write_text(sources[file], text)
    looks = [
        *looks_of(installation, (DISTANCE_MM,)),
        *looks_of(installation, (), SHEET_MM, TILT_DEG, SHIFTS_PX),
    ]
    figures: dict[str, Any] = {}
    for pair in chosen.pairs:
        pictures = dict(zip(DualImage.pictures, (sources[file] for file in PAIRS[pair]), strict=True))
        for method in chosen.assembly:
            title = f"{pair}-{method}"
            project(installation, DualImage(), pictures, name=title, assembly=method)
            records, _ = make_previews(installation, [title], looks=looks, plant=chosen.planted_mark)
            record = records[f"{title}.json"]
            figures[title] = rounded(record)
            print(preview_words(record)[0])
            for tag, look in {"": record, **record["views"]}.items():
                for surface in ("on_pattern", "on_white"):
                    if surface in look:
                        print(line(tag, surface, look[surface]), flush=True)
    known = json.loads(REFERENCE.read_text(encoding="utf-8")) if REFERENCE.is_file() else {}
    known[name] = known.get(name, {}) | figures
    REFERENCE.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
