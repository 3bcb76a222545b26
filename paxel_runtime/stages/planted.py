"""A mark planted in one picture of a projection, and the projection made once more: how ghosts are measured as such.

Everything is done as it was for the projection itself, by the stage that made it, in a folder of its own that goes
away again; the installation is only read.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from paxel_runtime.frame_files import read_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import Lab_to_sRGB, sRGB_to_Lab
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.observer import plant_mark, planted_mark
from paxel_runtime.stages.projection import project

__all__ = ["codes_with_mark"]

_NOT_BORROWED = ("projection", "preview", "report")
"""What a mark's projection makes for itself, and what comes after it."""


def codes_with_mark(
    installation: Installation, record: Mapping[str, Any], picture: str, px_per_degree: float
) -> NDArray[np.unsignedinteger]:
    """The projection image (H, W, N) with a mark in one of its source pictures.

    Parameters
    ----------
    installation : Installation
    record : mapping
        Of the projection, ``projection/<name>.json``.
    picture : str
        The one that gets the mark, a key of ``record["pictures"]``.
    px_per_degree : float
        Projector pixels in one degree of the viewer's field; the picture is taken to fill the projection's width.
    """
    with tempfile.TemporaryDirectory() as scratch:
        beside = Installation(Path(scratch), installation.settings)
        _borrow(installation, beside)
        pictures = {name: Path(path) for name, path in record["pictures"].items()}
        marked = beside.path / "marked.png"
        _write_marked(pictures[picture], marked, px_per_degree / installation.settings.projector.resolution[0])
        effect = parse_effect(record["effect"])
        method = record.get("assembly", {}).get("method", "")
        everything = pictures | {picture: marked}
        project(beside, effect, everything, name="marked", shown_on=record["shown_on"], assembly=method)
        return read_frame(beside.folder("projection") / "marked.png", installation.settings.projector.bits)


def _borrow(installation: Installation, beside: Installation) -> None:
    """What a projection is made from, seen from another folder too."""
    for entry in installation.path.resolve().iterdir():
        if entry.name in _NOT_BORROWED or entry.name.startswith("."):
            continue
        try:
            (beside.path / entry.name).symlink_to(entry, target_is_directory=entry.is_dir())
        except OSError:  # a system that lets nobody link
            if entry.is_dir():
                shutil.copytree(entry, beside.path / entry.name)
            else:
                shutil.copy2(entry, beside.path / entry.name)


def _write_marked(source: Path, target: Path, widths_per_degree: float) -> None:
    """The picture with the mark in it, as sRGB; a profile it has stays with it."""
    with Image.open(source) as file:
        image = ImageOps.exif_transpose(file)
        profile = image.info.get("icc_profile")
        encoded = np.asarray(image.convert("RGB"), np.float32) / 255
    mark = planted_mark(encoded.shape[:2], widths_per_degree * encoded.shape[1])
    marked = Lab_to_sRGB(plant_mark(sRGB_to_Lab(encoded), mark))
    image = Image.fromarray(np.rint(255 * np.clip(np.where(mark[..., None], marked, encoded), 0, 1)).astype(np.uint8))
    image.save(target, icc_profile=profile)
