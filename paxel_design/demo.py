"""`paxel demo`: every step from design to picture on the virtual bench, with real photographs, and a contact sheet.

It only calls the stages that the single commands call, and skips what is up to date.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_design.contact_sheet import EffectTiles, SurfaceTiles, demo_sheet
from paxel_design.printing.preview import pattern_detail
from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_design.stages.projection import make_previews, make_projection_stage
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.errors import UsageError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import Lab_to_sRGB
from paxel_runtime.model.effects import DualImage, Effect, Monochrome, Neutralize
from paxel_runtime.pictures import load_picture
from paxel_runtime.printed import load_pattern
from paxel_runtime.projection import picture_surfaces
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from paxel_runtime.stages import calibrate, open_devices
from paxel_runtime.storage import load_model, read_image, read_json, read_npz, write_atomically, write_image

__all__ = ["run_demo"]

Progress = Callable[[str, int, int], None]

PICTURES = {
    "on_pattern": ("astronaut.png", (0, 12, 512, 300)),
    "on_white": ("coffee.png", (0, 20, 600, 358)),
    "image": ("chelsea.png", (0, 20, 451, 274)),
}
"""Photographs inside scikit-image's wheel, all free to use, and the part of each that is shown (left, upper, right,
lower; 16 : 9): an astronaut (NASA), a cup of coffee, a cat."""


def run_demo(
    folder: Path, preset: str, overrides: dict[str, Any], progress: Progress, say: Callable[[str], None]
) -> dict[str, Any]:
    """Run or finish the demonstration in `folder`.

    Returns
    -------
    dict
        ``{"figures": {...}, "files": {...}}``.

    Raises
    ------
    UsageError
        If the folder holds another installation.
    """
    start = time.perf_counter()
    installation = _open_or_new(folder, preset, overrides)
    for stage, run in (
        ("print", lambda: make_print(installation)),
        ("captures", lambda: capture(installation, open_devices(installation), progress)),
        ("calibration", lambda: calibrate(installation)),
        ("gamut", lambda: make_gamut(installation, None, "pattern", progress)),
    ):
        state = next(s.state for s in installation.status() if s.stage.name == stage)
        if state == "done":
            say(f"{stage}: up to date")
            continue
        progress(stage, 0, 1)
        began = time.perf_counter()
        run()
        say(f"{stage}: {time.perf_counter() - began:.1f} s")
    _write_pictures(installation.path / "pictures")
    for effect, pictures in _effects(installation):
        began = time.perf_counter()
        _, fresh = make_projection_stage(
            installation, effect, pictures, name=effect.key, shown_on="pattern", progress=progress
        )
        say(f"projection {effect.key}: " + (f"{time.perf_counter() - began:.1f} s" if fresh else "up to date"))
    began = time.perf_counter()
    _, fresh = make_previews(installation, [], progress=progress)
    say("preview: " + (f"{time.perf_counter() - began:.1f} s" if fresh else "up to date"))
    progress("contact sheet", 0, 1)
    sheet = installation.path / "demo.png"
    write_atomically(sheet, lambda path: _contact_sheet(installation, path))
    return {"figures": _figures(installation, time.perf_counter() - start), "files": _files(installation)}


def _open_or_new(folder: Path, preset: str, overrides: dict[str, Any]) -> Installation:
    settings = make_settings(preset, {**DEMO_OVERRIDES, **overrides})
    toml = folder / "paxel.toml"
    if toml.exists():
        installation = Installation.open(folder)
        if overrides and installation.settings != settings:
            raise UsageError(f"{toml} holds other settings than --set asks for; edit it, or choose another folder")
        return installation
    if folder.is_dir() and any(folder.iterdir()):
        raise UsageError(f"{folder} is not empty and holds no paxel.toml; choose another folder")
    return Installation.create(folder, settings)


def _write_pictures(folder: Path) -> None:
    """Put the source pictures beside the rest, so that the folder explains itself; once, so that nothing gets stale."""
    folder.mkdir(exist_ok=True)
    for name, box in PICTURES.values():
        if not (folder / name).is_file():
            with (files("skimage") / "data" / name).open("rb") as file, Image.open(file) as image:
                write_image(folder / name, np.asarray(image.convert("RGB").crop(box)))


def _effects(installation: Installation) -> list[tuple[Effect, dict[str, Path]]]:
    """The demonstration's projections with their pictures: two, or one where the pattern is the only surface."""
    folder = installation.path / "pictures"
    if installation.settings.model.second_surface == "none":
        return [(Monochrome(), {"image": folder / PICTURES["on_pattern"][0]})]
    return [
        (effect, {name: folder / PICTURES[name][0] for name in effect.pictures})
        for effect in (DualImage(), Neutralize())
    ]


def _contact_sheet(installation: Installation, path: Path) -> None:
    """Collect the pictures of the sheet from the stages' folders."""
    settings = installation.settings
    effects = [_effect_tiles(installation, effect, sources) for effect, sources in _effects(installation)]
    demo_sheet(
        path,
        pattern=pattern_detail(load_pattern(installation)),
        labels=read_image(installation.folder("calibration") / "clusters.png"),
        cluster_names=load_model(installation.folder("calibration") / "model.json").clusters,
        effects=effects,
        notes=(
            f"{settings.pattern.layout} at {settings.pattern.angle_deg:g} degrees, dots of "
            f"{settings.pattern.dot_size_mm:g} mm; projector {settings.projector.resolution[0]} x "
            f"{settings.projector.resolution[1]} pixels on {settings.projector.width_mm:g} mm; "
            f"{settings.clusters.count} clusters; virtual bench, {settings.bench.quality}; seen from "
            f"{settings.viewing.distance_mm / 1000:g} m"
        ),
    )


def _effect_tiles(installation: Installation, effect: Effect, sources: dict[str, Path]) -> EffectTiles:
    """The pictures of one effect; a surface without a picture of its own is one uniform colour."""
    width, height = installation.settings.projector.resolution
    mapped = read_npz(installation.folder("projection") / f"{effect.key}.npz")
    figures = read_json(installation.folder("preview") / f"{effect.key}.json")
    shown = {surface: name for name, surface in picture_surfaces(effect, "pattern").items()}
    tiles = {}
    for surface in ("pattern", "white"):
        if f"Lab_{surface}" not in mapped:
            continue
        wanted = mapped[f"Lab_{surface}"]
        if surface in shown:
            wanted = load_picture(sources[shown[surface]], width, height, installation.settings.mapping.placement)
        view = installation.folder("preview") / f"{effect.key}.on-{surface}"
        tiles[surface] = SurfaceTiles(
            source=_to_uint8(Lab_to_sRGB(wanted)),
            mapped=_to_uint8(Lab_to_sRGB(mapped[f"Lab_{surface}"])),
            seen=read_image(view.with_name(f"{view.name}.png")),
            seen_adapted=read_image(view.with_name(f"{view.name}.auto.png")),
            note=_view_text(figures[f"on_{surface}"]),
        )
    projection = read_image(installation.folder("projection") / f"{effect.key}.png")
    if projection.ndim == 2:  # one channel
        projection = np.repeat(projection[..., None], 3, axis=2)
    heading = f"{effect.description[0].upper()}{effect.description[1:]} ({effect.key})"
    return EffectTiles(heading, projection, tiles.get("pattern"), tiles.get("white"))


def _figures(installation: Installation, seconds: float) -> dict[str, Any]:
    """The figures of the run, collected from the stages' records."""
    accuracy = read_json(installation.folder("calibration") / "accuracy.json")
    lightness = installation.folder("gamut") / "lightness.json"
    figures: dict[str, Any] = {
        "measured_on": accuracy["measured_on"],
        "prediction": {surface: accuracy[surface] for surface in ("pattern", "white") if surface in accuracy},
        **({"lightness_rectangle": read_json(lightness)["rectangle"]} if lightness.is_file() else {}),
    }
    for effect, _ in _effects(installation):
        projection = read_json(installation.folder("projection") / f"{effect.key}.json")
        seen = read_json(installation.folder("preview") / f"{effect.key}.json")
        figures[effect.key] = {
            "pixels_in_gamut": projection["pixels_in_gamut"],
            **{f"seen_{key}": seen[key] for key in ("on_pattern", "on_white") if key in seen},
        }
    bytes_on_disk = sum(path.stat().st_size for path in installation.path.rglob("*") if path.is_file())
    return figures | {
        "wall_time_s": round(seconds, 1),
        "peak_memory_MB": _peak_memory_MB(),
        "on_disk_MB": round(bytes_on_disk / 1e6),
    }


def _peak_memory_MB() -> int | None:
    """Largest memory of this process so far; None on a system that does not tell."""
    try:
        import resource  # not on Windows
    except ImportError:
        return None
    unit = 1024**2 if sys.platform == "darwin" else 1024
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit)


def _view_text(view: dict[str, Any]) -> str:
    ghost = "" if view["ghosting_percent"] is None else f", ghosting {view['ghosting_percent']:.1f} %"
    return f"dE00 mean {view['dE00_mean']:.2f}, 95 % {view['dE00_p95']:.2f}{ghost}"


def _files(installation: Installation) -> dict[str, str]:
    path = installation.path
    return {
        "contact sheet": str(path / "demo.png"),
        "source pictures": str(path / "pictures"),
        "print sheet": str(path / "print" / "pattern.pdf"),
        "captures": str(path / "captures"),
        "model": str(path / "calibration" / "model.json"),
        "gamuts": str(path / "gamut"),
        "projection images": str(path / "projection"),
        "simulated photographs": str(path / "preview"),
    }


def _to_uint8(sRGB: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.rint(255 * np.clip(sRGB, 0, 1)).astype(np.uint8)
