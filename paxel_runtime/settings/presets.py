"""Whole installations by name: what they change from the defaults."""

from __future__ import annotations

from typing import Any

__all__ = ["DEMO_OVERRIDES", "PRESETS"]

_TILES_FROM_MM = 6000.0
"""From where tiles of three and more inks of 0.75 mm melt: their period is longer than a checkerboard's, which does
from 2.7 m."""

PRESETS: dict[str, dict[str, Any]] = {
    "bw-checkerboard": {},
    "bw-blue-noise": {"pattern.layout": "blue-noise"},
    "cmyrgb": {
        "pattern.layout": "tiles",
        "pattern.colorants": ["cyan", "magenta", "yellow", "red", "green", "blue"],
        "clusters.count": 6,
        "viewing.distance_mm": _TILES_FROM_MM,
    },
    "rgb": {
        "pattern.layout": "tiles",
        "pattern.colorants": ["red", "green", "blue"],
        "projector.channels": ["white"],
        "model.second_surface": "none",
        "viewing.distance_mm": _TILES_FROM_MM,
    },
    "uv-rgb": {
        "pattern.layout": "tiles",
        "pattern.colorants": ["uv-red", "uv-green", "uv-blue"],
        "projector.channels": ["uv"],
        "model.second_surface": "none",
        "viewing.distance_mm": _TILES_FROM_MM,
    },
}
"""Whole installations by name: what they change from the defaults."""

DEMO_OVERRIDES: dict[str, Any] = {
    "pattern.size_mm": [160.0, 100.0],
    "projector.resolution": [960, 540],
    "projector.width_mm": 140.6,
    "camera.resolution": [2048, 1536],
}
"""What `paxel demo` changes in any preset: fit for a laptop and an A4 sheet, never a whole number of pixels a dot."""
