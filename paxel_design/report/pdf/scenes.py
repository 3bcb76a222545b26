"""Bodies in CIELAB as pictures from two sides; what each body is, stands below them in words.

Knows `gamut.scenes`, which draws off screen. Equal bodies are drawn once in a document.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_design.gamut.scenes import SceneBody, write_scene
from paxel_design.report.bodies import AZIMUTHS_DEG, colored
from paxel_design.report.content import Picture, Scene

__all__ = ["SceneDrawer"]

_SIZE_PX = (720, 610)
"""The numbers along the axes are 15 of these pixels high: 6 points where the picture is half the text's width."""

_MARGIN_PX = 6


class SceneDrawer:
    """Draws the scenes of one document."""

    def __init__(self) -> None:
        self._drawn: dict[str, tuple[Picture, ...]] = {}

    def pictures(self, scene: Scene) -> tuple[Picture, ...]:
        """A scene from its sides, the pictures equally large.

        Raises
        ------
        GamutError
            If there is no body, or no picture can be drawn on this machine.
        """
        bodies = colored(scene.bodies)
        key = _digest(bodies)
        if key not in self._drawn:
            with TemporaryDirectory() as folder:
                sides = [_drawn(Path(folder) / f"{k}.png", bodies, side) for k, side in enumerate(AZIMUTHS_DEG)]
            box = _common_box(sides)
            self._drawn[key] = tuple(Picture(np.ascontiguousarray(side[box]), "") for side in sides)
        return self._drawn[key]


def _digest(bodies: tuple[SceneBody, ...]) -> str:
    digest = hashlib.sha256()
    for body in bodies:
        digest.update(f"{body.color} {body.mesh.Lab.shape} {body.mesh.faces.shape}".encode())
        digest.update(np.ascontiguousarray(body.mesh.Lab).tobytes())
        digest.update(np.ascontiguousarray(body.mesh.faces).tobytes())
    return digest.hexdigest()


def _drawn(path: Path, bodies: tuple[SceneBody, ...], azimuth_deg: float) -> NDArray[np.uint8]:
    """One picture; the names of the bodies are the page's, where they can be found and are not cut off."""
    nameless = [replace(body, label="") for body in bodies]
    write_scene(path, nameless, size_px=_SIZE_PX, azimuth_deg=azimuth_deg)
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def _common_box(sides: list[NDArray[np.uint8]]) -> tuple[slice, slice]:
    """Rows and columns of what is drawn in any of the pictures, which are white elsewhere."""
    drawn = np.any([np.any(side < 250, axis=2) for side in sides], axis=0)
    slices = []
    for axis, length in enumerate(drawn.shape):
        places = np.flatnonzero(drawn.any(axis=1 - axis))
        first, last = (places[0], places[-1]) if len(places) else (0, length - 1)
        slices.append(slice(max(0, first - _MARGIN_PX), last + 1 + _MARGIN_PX))
    return slices[0], slices[1]
