"""`paxel demo`: every step from design to picture on the virtual bench, with real photographs, and a contact sheet.

It only calls the stages that the single commands call, and skips what is up to date.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.contact_sheet import EffectTiles, SurfaceTiles, demo_sheet
from paxel_design.printing.preview import pattern_detail
from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_design.stages.projection import make_previews, make_projection_stage
from paxel_runtime.acquisition import capture
from paxel_runtime.errors import UsageError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import Lab_to_sRGB
from paxel_runtime.model.effects import DualImage, Effect, Neutralize
from paxel_runtime.pictures import load_picture
from paxel_runtime.projection import picture_surfaces
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from paxel_runtime.stages import calibrate, load_pattern, open_devices
from paxel_runtime.storage import load_model, read_image, read_json, read_npz, write_atomically

__all__ = ["run_demo"]

Progress = Callable[[str, int, int], None]

PICTURES = {"on_pattern": "astronaut.png", "on_white": "coffee.png", "image": "chelsea.png"}
"""Photographs inside scikit-image's wheel: an astronaut (NASA), a cup of coffee, a cat (all free to use)."""


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
    for effect, pictures in _effects():
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
    return Installation.create(folder, settings)


def _effects() -> list[tuple[Effect, dict[str, Path]]]:
    """The demonstration's two projections with their pictures."""
    data = Path(str(files("skimage") / "data"))
    return [
        (effect, {name: data / PICTURES[name] for name in effect.pictures}) for effect in (DualImage(), Neutralize())
    ]


def _contact_sheet(installation: Installation, path: Path) -> None:
    """Collect the pictures of the sheet from the stages' folders."""
    settings = installation.settings
    effects = [_effect_tiles(installation, effect, sources) for effect, sources in _effects()]
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
    heading = f"{effect.key}: {effect.description}"
    return EffectTiles(heading, projection, tiles.get("pattern"), tiles.get("white"))


def _figures(installation: Installation, seconds: float | None) -> dict[str, Any]:
    """The figures of the run, for the table and the contact sheet."""
    calibration = read_json(installation.folder("calibration") / "calibration.json")
    accuracy = calibration["accuracy"]
    lightness = read_json(installation.folder("gamut") / "lightness.json")
    figures: dict[str, Any] = {
        "bench": accuracy["measured_on"],
        "prediction error (dE00 mean / 95 % / max)": {
            surface: " / ".join(f"{accuracy[surface][f'dE00_{k}']:.2f}" for k in ("mean", "p95", "max"))
            for surface in ("pattern", "white")
        },
        "lightness rectangle": {
            surface: "L* {:.1f} to {:.1f}".format(*lightness["rectangle"][f"L_{surface}"])
            for surface in ("pattern", "white")
        },
    }
    for effect, _ in _effects():
        projection = read_json(installation.folder("projection") / f"{effect.key}.json")
        preview = read_json(installation.folder("preview") / f"{effect.key}.json")
        figures[effect.key] = {
            "pixels in gamut": f"{100 * projection['pixels_in_gamut']:.2f} %",
            **{
                f"seen {key.replace('_', ' ')}": _view_text(preview[key])
                for key in ("on_pattern", "on_white")
                if key in preview
            },
        }
    if seconds is not None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2)
        size = sum(path.stat().st_size for path in installation.path.rglob("*") if path.is_file())
        figures |= {"wall time": f"{seconds:.1f} s", "peak memory": f"{peak:.0f} MB", "on disk": f"{size / 1e6:.0f} MB"}
    return figures


def _view_text(view: dict[str, Any]) -> str:
    ghost = "" if view["ghosting_percent"] is None else f", ghosting {view['ghosting_percent']:.1f} %"
    return f"dE00 mean {view['dE00_mean']:.2f}, 95 % {view['dE00_p95']:.2f}{ghost}"


def _files(installation: Installation) -> dict[str, str]:
    path = installation.path
    return {
        "contact sheet": str(path / "demo.png"),
        "print sheet": str(path / "print" / "pattern.pdf"),
        "captures": str(path / "captures"),
        "model": str(path / "calibration" / "model.json"),
        "gamuts": str(path / "gamut"),
        "projection images": str(path / "projection"),
        "simulated photographs": str(path / "preview"),
    }


def _to_uint8(sRGB: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.rint(255 * np.clip(sRGB, 0, 1)).astype(np.uint8)
