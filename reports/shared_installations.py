"""Installations on the virtual bench that several scripts use: made once, under reports/build/installations/.

`shared` opens one by its name and makes or finishes what is missing; what is up to date is not made again. After a
change of the code call ``python -m reports.build --fresh``: an installation does not know which code made it. `show`
makes a projection and what is seen of it; `seen_row` is its row of a contact sheet.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from paxel_design.contact_sheet import Group, Tile, write_contact_sheet
from paxel_design.stages.print_sheet import make_print
from paxel_design.stages.projection import make_previews, make_projection_stage
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.errors import UsageError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.settings import DEMO_OVERRIDES, Settings, make_settings
from paxel_runtime.stages import calibrate, open_devices
from paxel_runtime.storage import read_image, write_image
from reports.paper import BUILD

FULL: dict[str, Any] = DEMO_OVERRIDES
"""960 x 540 on 140.6 mm: the pixel pitch of 1920 x 1080 on 281 mm, on a quarter of its area."""

QUICK: dict[str, Any] = FULL | {
    "projector.resolution": [480, 270],
    "projector.width_mm": 70.3,
    "camera.resolution": [1024, 768],
}
"""The same pitch on a sixteenth; what `.ci/run` demonstrates, so that a build can use that installation."""

SMALL: dict[str, Any] = {
    "pattern.size_mm": [48.0, 32.0],
    "projector.resolution": [240, 135],
    "projector.width_mm": 35.15,
    "camera.resolution": [512, 384],
    "meter.aperture_mm": 15.0,
}
"""The same pitch again, as small as the meter's spot allows."""

SHARED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "bw-checkerboard": (FULL, QUICK),
    "cmyrgb": (FULL, SMALL | {"model.correction": "off"}),
    "uv-rgb": (FULL, QUICK | {"pattern.size_mm": [84.0, 52.0]}),
}
"""Presets, and what the full and the quick size change in them."""

PARTS = {
    "astronaut.png": (0, 12, 512, 300),
    "chelsea.png": (0, 20, 451, 274),
    "coffee.png": (0, 20, 600, 358),
    "motorcycle_left.png": (0, 60, 741, 477),
    "rocket.jpg": (0, 67, 640, 427),
}
"""Photographs of scikit-image's wheel, all free to use, and the part of each that is shown: left, upper, right, lower
(16 : 9)."""

_RIM = 0.02
"""Of a view, cut off on each side: at the frame's rim the dots have no neighbours."""

Progress = Callable[[str, int, int], None]


def settings_of(name: str, quick: bool) -> Settings:
    """Settings of a shared installation."""
    return make_settings(name, SHARED[name][quick])


def place_of(name: str, quick: bool) -> Path:
    """Its folder; a link where `adopt` put another in its place."""
    return BUILD / "installations" / ("quick" if quick else "full") / name


def shared(name: str, quick: bool, progress: Progress = lambda *_: None) -> Installation:
    """A shared installation with print, captures and calibration, made or finished.

    Raises
    ------
    UsageError
        If its folder holds other settings than today's.
    """
    place, wanted = place_of(name, quick), settings_of(name, quick)
    if place.is_symlink() and not place.exists():  # adopted once, and gone since
        place.unlink()
    if (place / "paxel.toml").is_file():
        installation = Installation.open(place)
        if installation.settings != wanted:
            raise UsageError(f"{place} was made with other settings; make it anew: python -m reports.build --fresh")
    else:
        installation = Installation.create(place, wanted)
    return finish(installation, progress)


def finish(installation: Installation, progress: Progress = lambda *_: None) -> Installation:
    """Make what is missing or out of date up to the calibration."""
    for stage, run in (
        ("print", lambda: make_print(installation)),
        ("captures", lambda: capture(installation, open_devices(installation), progress)),
        ("calibration", lambda: calibrate(installation)),
    ):
        if next(s.state for s in installation.status() if s.stage.name == stage) != "done":
            progress(f"{installation.path.name}: {stage}", 0, 1)
            run()
    return installation


def adopt(folder: Path, quick: bool) -> str:
    """Use a ready installation as the shared one of the same settings; returns that one's name.

    Raises
    ------
    UsageError
        If no shared installation has these settings, or another one stands in its place.
    """
    settings = Installation.open(folder).settings
    for name in SHARED:
        if settings == settings_of(name, quick):
            place = place_of(name, quick)
            if place.is_symlink():
                place.unlink()
            elif place.exists():
                raise UsageError(f"{place} is there already; leave --installation out, or remove that folder")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.symlink_to(folder.resolve(), target_is_directory=True)
            return name
    size = "quick" if quick else "full"
    raise UsageError(f"{folder} has the settings of none of the {size} installations: {', '.join(SHARED)}")


def photographs(folder: Path) -> dict[str, Path]:
    """The photographs as files, by name: the part of each that is shown."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for name, box in PARTS.items():
        paths[name] = (folder / name).with_suffix(".png")
        if not paths[name].is_file():
            with (files("skimage") / "data" / name).open("rb") as file, Image.open(file) as image:
                write_image(paths[name], np.asarray(image.convert("RGB").crop(box)))
    return paths


@cache
def photograph(name: str) -> Path:
    """One of them, named without its ending, in the build's folder."""
    return next(path for path in photographs(BUILD / "photographs").values() if path.stem == name)


@dataclass(frozen=True)
class Shown:
    """A projection and what is seen of it: the records of both stages, and their pictures."""

    installation: Installation
    name: str
    sources: Mapping[str, Path]
    projection: Mapping[str, Any]
    preview: Mapping[str, Any]

    def picture(self, surface: str) -> np.ndarray:
        """The view of a surface (h, w, 3) uint8, exposed as a camera or the eye adapts, without the frame's rim."""
        view = read_image(self.installation.folder("preview") / f"{self.name}.on-{surface}.auto.png")
        y, x = (round(_RIM * size) for size in view.shape[:2])
        return view[y : view.shape[0] - y, x : view.shape[1] - x]


def show(installation: Installation, effect: str, photographs: tuple[str, ...], name: str, assembly: str = "") -> Shown:
    """Project photographs with an effect (as text, pictures in its order) and look at both surfaces."""
    return show_all(installation, {name: (effect, photographs)}, assembly)[name]


def show_all(
    installation: Installation, wanted: Mapping[str, tuple[str, tuple[str, ...]]], assembly: str = ""
) -> dict[str, Shown]:
    """The same for several projections by name, each ``(effect, photographs)``, looked at on one bench."""
    made = {}
    for name, (text, photographs) in wanted.items():
        effect = parse_effect(text)
        sources = dict(zip(effect.pictures, (photograph(one) for one in photographs), strict=True))
        record, _ = make_projection_stage(
            installation, effect, sources, name=name, shown_on="pattern", assembly=assembly
        )
        made[name] = (sources, record)
    records, _ = make_previews(installation, list(wanted))
    return {name: Shown(installation, name, *made[name], records[f"{name}.json"]) for name in wanted}


def seen_row(shown: Shown, words: str) -> tuple[Tile, ...]:
    """Source pictures, then both views with their figures."""
    tiles = [Tile(read_image(path), f"source: {path.stem.replace('_', ' ')}") for path in shown.sources.values()]
    for surface, where in (("pattern", "on the print"), ("white", "on the white sheet")):
        if f"on_{surface}" in shown.preview:
            tiles.append(Tile(shown.picture(surface), f"{words}, {where}", view_note(shown, surface), emphasis=True))
    return tuple(tiles)


def view_note(shown: Shown, surface: str) -> str:
    """Figures of a view in a line."""
    view = shown.preview[f"on_{surface}"]
    ghost = "" if view["ghosting_percent"] is None else f", ghosting {view['ghosting_percent']:.1f} %"
    low, high = view["L_range"]
    return f"dE00 {view['dE00_mean']:.2f}{ghost}, L* {low:.0f}-{high:.0f}, C* {view['chroma_mean']:.0f}"


def write_sheet(path: Path, groups: list[Group], title: str, notes: str) -> None:
    """A contact sheet: ``.png`` as it is, ``.jpg`` at half its size, fit for a page of photographs."""
    if path.suffix == ".png":
        write_contact_sheet(path, groups, title, notes)
        return
    full = path.with_name(f".{path.stem}.png")
    write_contact_sheet(full, groups, title, notes)
    with Image.open(full) as sheet:
        half = sheet.convert("RGB").resize((sheet.width // 2, sheet.height // 2), Image.Resampling.LANCZOS)
    half.save(path, quality=85)
    full.unlink()
