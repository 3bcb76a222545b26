"""Bodies in CIELAB -> what the page's script draws: meshes as packed arrays, each once, and a still for the rest.

The still stands where there is no script, no WebGL, on paper, and until the reader comes by.
"""

from __future__ import annotations

import base64
import hashlib
import json
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_design.gamut.mesh_files import display_colors
from paxel_design.gamut.meshes import GamutMesh
from paxel_design.gamut.scenes import SceneBody, write_scene
from paxel_design.report.bodies import AZIMUTHS_DEG, colored
from paxel_design.report.content import Scene
from paxel_design.report.html.images import photo_uri
from paxel_runtime.errors import GamutError

__all__ = ["STILL_PX", "scene_data", "scene_stills"]

STILL_PX = (900, 600)

_GLASS = 0.3
"""Opacity of a body that has others inside."""


def scene_stills(scenes: Sequence[Scene]) -> dict[str, str]:
    """The first standard view of each scene as a data URI, by its name; equal scenes are drawn once.

    Empty where this machine cannot draw: the page says so, its script may draw all the same.
    """
    drawn: dict[str, str] = {}
    stills = {}
    for scene in scenes:
        bodies = colored(scene.bodies)
        key = " ".join(f"{_key(_packed(body.mesh))} {body.color}" for body in bodies)
        if key not in drawn:
            drawn[key] = _still(bodies)
        stills[scene.name] = drawn[key]
    return stills


def _still(bodies: Sequence[SceneBody]) -> str:
    nameless = [replace(body, label="") for body in bodies]  # the legend stands below, in HTML
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "still.png"
        try:
            write_scene(path, nameless, size_px=STILL_PX, azimuth_deg=AZIMUTHS_DEG[0])
        except GamutError:
            return ""
        with Image.open(path) as image:
            return photo_uri(image.convert("RGB"))


def scene_data(scenes: Sequence[Scene]) -> str:
    """All that the page's script needs, as JSON that can stand in a `script` element.

    ``{"azimuths": [deg, ...], "meshes": {id: mesh}, "scenes": {name: [body, ...]}}`` with mesh ``{"vertices": V,
    "Lab": float32 (3, V), "rgb": uint8 (V, 3), "faces": uint16 or uint32 (3, F), "wide": is it uint32}``, arrays
    little-endian in base64, and body ``{"mesh": id, "label", "color": "#rrggbb" or null, "opacity"}``.
    """
    meshes: dict[str, dict[str, Any]] = {}
    drawn: dict[str, list[dict[str, Any]]] = {}
    for scene in scenes:
        bodies = colored(scene.bodies)
        drawn[scene.name] = []
        for k, body in enumerate(bodies):
            packed = _packed(body.mesh)
            key = _key(packed)
            meshes[key] = packed
            opacity = _GLASS if k + 1 < len(bodies) else 1.0
            drawn[scene.name].append({"mesh": key, "label": body.label, "color": body.color, "opacity": opacity})
    data = {"azimuths": AZIMUTHS_DEG, "meshes": meshes, "scenes": drawn}
    return json.dumps(data, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")


def _key(packed: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(packed).encode()).hexdigest()[:12]


def _packed(mesh: GamutMesh) -> dict[str, Any]:
    wide = len(mesh.Lab) > np.iinfo(np.uint16).max + 1
    return {
        "vertices": len(mesh.Lab),
        "Lab": _base64(mesh.Lab.T, "<f4"),
        "rgb": _base64(display_colors(mesh), "u1"),
        "faces": _base64(mesh.faces.T, "<u4" if wide else "<u2"),
        "wide": wide,
    }


def _base64(array: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode()
