"""The stage behind `paxel project`: source pictures and a sub-gamut -> a projection image; writes ``projection/``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from paxel_runtime.errors import InputError
from paxel_runtime.frame_files import write_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import Effect
from paxel_runtime.model.subgamut import SubGamut, subgamut_from_arrays
from paxel_runtime.pictures import load_picture
from paxel_runtime.projection import make_projection, picture_surfaces
from paxel_runtime.storage import load_model, read_image, read_npz, write_json, write_npz

__all__ = ["load_sub_gamut", "project", "projection_inputs"]

Progress = Callable[[str, int, int], None]


def load_sub_gamut(folder: Path, effect: Effect, surface: str) -> SubGamut:
    """A sub-gamut that the design side wrote into ``gamut/``."""
    return subgamut_from_arrays(read_npz(folder / f"{effect.name}.on-{surface}.npz"))


def projection_inputs(installation: Installation, pictures: Mapping[str, Path]) -> dict[str, Any]:
    """What a projection of these source pictures is made from.

    Raises
    ------
    InputError
        If a picture is not there.
    """
    for name, path in pictures.items():
        if not path.is_file():
            raise InputError(f"--{name.replace('_', '-')}: there is no picture {path}")
    return installation.inputs("projection", extra_files={f"picture {name}": p for name, p in pictures.items()})


def project(
    installation: Installation,
    effect: Effect,
    pictures: Mapping[str, Path],
    *,
    name: str = "",
    shown_on: str = "pattern",
    progress: Progress = lambda message, done, total: None,
) -> dict[str, Any]:
    """Make one projection image; writes ``projection/<name>.png`` and its record, and returns the record."""
    name = name or effect.key
    if Path(name).name != name or name.startswith("."):
        raise InputError(f"--name must be a plain file name without folders, got {name!r}; write for example evening-2")
    settings = installation.settings
    width, height = settings.projector.resolution
    surfaces = picture_surfaces(effect, shown_on)
    inputs = projection_inputs(installation, {key: pictures[key] for key in surfaces})
    progress("read pictures", 0, 1)
    projection = make_projection(
        effect,
        {key: load_picture(pictures[key], width, height, settings.mapping.placement) for key in surfaces},
        {surface: load_sub_gamut(installation.folder("gamut"), effect, surface) for surface in surfaces.values()},
        load_model(installation.folder("calibration") / "model.json"),
        read_image(installation.folder("calibration") / "clusters.png"),
        shown_on=shown_on,
        bits=settings.projector.bits,
        chroma=settings.mapping.chroma,
        outside=settings.assembly.outside,
        progress=lambda done, total: progress("solve", done, total),
    )
    record = {
        "name": name,
        "effect": effect.text,
        "shown_on": shown_on,
        "pictures": {key: str(pictures[key]) for key in surfaces},
        "assembly": "dither",
        **projection.figures,
        "inputs": inputs,
    }
    with installation.writing("projection", keep=True) as folder:
        write_frame(folder / f"{name}.png", projection.codes, settings.projector.bits)
        write_npz(folder / f"{name}.npz", **{f"Lab_{surface}": Lab for surface, Lab in projection.Lab.items()})
        write_json(folder / f"{name}.json", record)
    return record
