"""A finished projection with what it is meant to show, read back from its folder for whoever looks at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import PaxelError
from paxel_runtime.frame_files import read_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.pictures import place_picture, read_picture
from paxel_runtime.projection import picture_surfaces
from paxel_runtime.stages.projection import picture_frame
from paxel_runtime.storage import file_sha256, load_model, read_image, read_json, read_npz

__all__ = ["SURFACES", "Projected", "load_projected", "other_surface"]

SURFACES = ("pattern", "white")


@dataclass(frozen=True, eq=False)
class Projected:
    """A projection with what it is meant to show.

    Attributes
    ----------
    name : str
    record : dict
        ``projection/<name>.json``.
    codes : (H, W, N) unsigned integer array
        The projection image, of `bits` bits.
    bits : int
    mapped : dict of surface -> (H, W, 3) float32 array
        CIELAB of the targets; a surface that is left free is absent.
    sources : dict of surface -> (H, W, 3) float32 array
        CIELAB of the source pictures where their files are still those that were projected.
    inside : (H, W) bool array
        Pixels on the pattern.
    shown : dict of surface -> (H, W) bool array
        Where a source picture lies, its letterbox apart; as `sources`.
    model : PredictionModel
    ghosts : bool
        Whether both surfaces have a picture or a colour of their own, so that one may be seen in the other.
    """

    name: str
    record: dict[str, Any]
    codes: NDArray[np.unsignedinteger]
    bits: int
    mapped: dict[str, NDArray[np.float32]]
    sources: dict[str, NDArray[np.float32]]
    inside: NDArray[np.bool_]
    shown: dict[str, NDArray[np.bool_]]
    model: PredictionModel
    ghosts: bool

    def other(self, surface: str) -> NDArray[np.float32] | None:
        """The picture that may ghost on a surface: the other one's, where that is one of its own."""
        pictured = picture_surfaces(parse_effect(self.record["effect"]), self.record["shown_on"]).values()
        if other_surface(surface) not in pictured:
            return None  # one colour all over, but for the fall-off of an image-based model
        other = self.mapped.get(other_surface(surface)) if self.ghosts else None
        return other if other is not None and np.ptp(other[..., 0]) > 0 else None

    def mask(self, surface: str) -> NDArray[np.bool_]:
        """Pixels of the pattern that show a surface's picture."""
        return self.inside & self.shown[surface] if surface in self.shown else self.inside


def other_surface(surface: str) -> str:
    """``"white"`` of ``"pattern"``, and the other way round."""
    return SURFACES[1 - SURFACES.index(surface)]


def load_projected(installation: Installation, name: str) -> Projected:
    """Read ``projection/<name>.*``, the model and the source pictures."""
    source, calibration = installation.folder("projection"), installation.folder("calibration")
    bits = installation.settings.projector.bits
    record = read_json(source / f"{name}.json")
    labels = read_image(calibration / "clusters.png")
    arrays = read_npz(source / f"{name}.npz")
    sources, shown = _sources(installation, record)
    return Projected(
        name,
        record,
        read_frame(source / f"{name}.png", bits),
        bits,
        {key.removeprefix("Lab_"): Lab for key, Lab in arrays.items() if key.startswith("Lab_")},
        sources,
        np.all(labels.reshape(*labels.shape[:2], -1) != 255, axis=-1),
        shown,
        load_model(calibration / "model.json"),
        parse_effect(record["effect"]).partner is None,
    )


def _sources(
    installation: Installation, record: Mapping[str, Any]
) -> tuple[dict[str, NDArray[np.float32]], dict[str, NDArray[np.bool_]]]:
    """The source pictures on the projector's raster by surface, those that are still what was projected; and where."""
    sources, shown = {}, {}
    hashes = record.get("inputs", {}).get("files", {})
    for picture, surface in picture_surfaces(parse_effect(record["effect"]), record["shown_on"]).items():
        path = Path(record["pictures"][picture])
        if path.is_file() and file_sha256(path) == hashes.get(f"picture {picture}"):
            try:
                frame = picture_frame(installation)
                read = read_picture(path, (frame.width, frame.height))
            except PaxelError:  # it could be read when it was projected: only figures to it are lost
                continue
            sources[surface] = place_picture(read, frame)
            white = replace(read, linear=np.ones_like(read.linear))
            shown[surface] = place_picture(white, frame)[..., 0] > _HALF_LIT_L
    return sources, shown


_HALF_LIT_L = 50.0
"""Between the black of a letterbox and a picture that is white all over."""
