"""Whether x moves smoothly with the wanted colours: reports/reference/inversion_continuity.json and .png.

Noise: reachable colours moved by 0.02 in CIELAB on both surfaces, and the largest move of an input. Picture: the inputs
of each cluster, shown as colours, over a smooth gradient of wanted pairs; K = 2, 3 and 6 from top to bottom. The hue on
the pattern turns once from left to right, its chroma grows from 5 to 30 and its lightness from bottom to top, so the
gradient crosses the edge of the gamut.

Run from a checkout (half a minute)::

    python -m reports.inversion_continuity
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB
from paxel_runtime.model.prediction import PredictionModel
from reports.inversion_benchmark import MODELS, reachable

RESULT = Path(__file__).parent / "reference" / "inversion_continuity"
TILE = (120, 180)
PIXELS, MOVE = 100_000, 0.02
BORDER = 4


def moves_under_noise(model: PredictionModel) -> dict[str, float]:
    """Largest and 99.9 % move of an input when both wanted colours move by 0.02."""
    rng = np.random.default_rng(1)
    wanted = reachable(model, PIXELS, 2)
    moved = []
    for Lab in wanted:
        assert Lab is not None
        noise = rng.normal(size=Lab.shape)
        moved.append(Lab + MOVE * noise / np.linalg.norm(noise, axis=-1, keepdims=True))
    move = np.abs(invert(*wanted, model).x - invert(moved[0], moved[1], model).x).max(axis=-1)
    return {"largest": float(move.max()), "p99.9": float(np.quantile(move, 0.999))}


def gradient(shape: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wanted pairs, (H, W, 3) each."""
    v, u = np.meshgrid(np.linspace(1.0, 0.0, shape[0]), np.linspace(0.0, 1.0, shape[1]), indexing="ij")
    chroma, hue = 5.0 + 25.0 * u, 2.0 * np.pi * u
    pattern = np.stack([25.0 + 25.0 * v, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    white = np.stack([62.0 + 10.0 * v, np.full(shape, 3.0), 12.0 * v - 6.0], axis=-1)
    return pattern, white


def tiles(model: PredictionModel) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """A row of pictures, one a cluster, and the largest step of an input between neighbouring pixels."""
    result = invert(*gradient(TILE), model)
    steps = [float(np.abs(np.diff(result.x, axis=axis)).max()) for axis in (0, 1)]
    x = result.x.reshape(*TILE, len(model.clusters), -1)
    shown = np.rint(255 * np.clip(linear_sRGB_to_sRGB(x), 0, 1)).astype(np.uint8)
    framed = [
        np.pad(shown[:, :, i], ((0, BORDER), (0, BORDER), (0, 0)), constant_values=255) for i in range(x.shape[2])
    ]
    return np.concatenate(framed, axis=1), {"status": result.counts(), "largest_step_between_pixels": max(steps)}


def main() -> None:
    """Write the figures and the picture."""
    figures: dict[str, Any] = {"what": "moves of x under 0.02 Lab of noise, and over a smooth gradient of wanted pairs"}
    rows = []
    for name in ("K=2", "K=3", "K=6"):
        model = MODELS[name]()
        row, steps = tiles(model)
        rows.append(row)
        figures[name] = {"noise": moves_under_noise(model), "gradient": steps}
        print(name, figures[name], flush=True)
    width = max(row.shape[1] for row in rows)
    sheet = [np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=255) for row in rows]
    Image.fromarray(np.concatenate(sheet)).save(RESULT.with_suffix(".png"), optimize=True)
    RESULT.with_suffix(".json").write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
