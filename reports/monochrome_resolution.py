"""What three times the frame rate costs: resolution and light of one-channel colour against a sequential projector.

A gray-scale projector that shows three colour fields one after the other needs three frames a picture; on a print of
red, green and blue dots one frame is enough (paper: III-C, VII). Paid for it: fine detail of one primary is sampled by
that primary's dots, and the inks swallow light. Gratings of white and of each primary are projected on the virtual
bench; *modulation* is what is left of a grating's contrast in luminance (the same grating on white paper, pixel by
pixel, is what the sequential projector shows), *alias* the strongest component of lower frequency than the grating that
the dots add, through the eye, over the grating itself. Figures go to reports/reference/monochrome_resolution.json.

Run from a checkout (two minutes)::

    python -m reports.monochrome_resolution
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.stages.print_sheet import make_print
from paxel_runtime.assembly import assemble
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.observer import eye_sigma_mm
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibrate, open_bench, open_devices
from paxel_runtime.storage import load_model, read_image

RESULT = Path(__file__).parent / "reference" / "monochrome_resolution.json"
SIZE = {
    "projector.resolution": [480, 270],
    "projector.width_mm": 70.3,
    "pattern.size_mm": [80, 50],
    "camera.resolution": [1024, 768],
}
FREQUENCIES = (0.06, 0.11, 0.17, 0.23, 0.34, 0.46, 0.68)
"""Cycles per millimetre; whole numbers of periods in the frame, about."""
MODULATION = 0.8
PICTURES = 3
"""Fields of a time-sequential colour picture."""


def grating(height: int, width: int, mm_per_px: float, frequency: float) -> NDArray[np.float32]:
    """(H, W) values 0..1 of a sine along x."""
    x_mm = np.arange(width) * mm_per_px
    wave = 0.5 * (1 + MODULATION * np.cos(2 * np.pi * frequency * x_mm))
    return np.broadcast_to(wave, (height, width)).astype(np.float32)


def spectrum(Y: NDArray[np.floating], mm_per_px: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Amplitudes over the mean by frequency (cycles/mm) of a windowed view, both (H, W)."""
    height, width = Y.shape
    window = np.hanning(height)[:, None] * np.hanning(width)[None]
    amplitude = 2 * np.abs(np.fft.fft2((Y - Y.mean()) * window)) / window.sum() / Y.mean()
    radius = np.hypot(np.fft.fftfreq(height, mm_per_px)[:, None], np.fft.fftfreq(width, mm_per_px)[None])
    return radius, amplitude


def seen(Y: NDArray[np.floating], mm_per_px: float, frequency: float, sigma_mm: float) -> tuple[float, float]:
    """Contrast of a grating over the one that was wanted, and of the strongest slower component through the eye."""
    height, width = Y.shape
    window = np.hanning(height)[:, None] * np.hanning(width)[None]
    wave = np.exp(-2j * np.pi * frequency * np.arange(width) * mm_per_px)
    contrast = 2 * abs(np.sum(Y * window * wave)) / np.sum(Y * window)
    radius, amplitude = spectrum(Y, mm_per_px)
    eye = np.exp(-2 * (np.pi * sigma_mm * radius) ** 2)
    slower = (radius > 3 / (width * mm_per_px)) & (radius < frequency - 3 / (height * mm_per_px))
    alias = float((amplitude * eye)[slower].max()) if slower.any() else 0.0
    through = contrast * float(np.exp(-2 * (np.pi * sigma_mm * frequency) ** 2))
    return float(contrast / MODULATION), alias / through


def measure(bench: VirtualBench, model: PredictionModel, labels: NDArray[np.uint8], mm_per_px: float) -> dict[str, Any]:
    """Modulation and alias by frequency, of white and of each primary, on the print and of the sequential picture."""
    height, width = labels.shape
    eye_mm = eye_sigma_mm(4000.0)
    lit = {"white": np.ones(3, np.float32)} | {
        name: np.eye(3, dtype=np.float32)[i] for i, name in enumerate(model.clusters)
    }
    rows = []
    for frequency in FREQUENCIES:
        wave = grating(height, width, mm_per_px, frequency)
        row: dict[str, Any] = {"cycles_per_mm": frequency}
        sequential = assemble(wave[..., None], np.zeros_like(labels), model.response, 8)
        Y = bench.view_XYZ(sequential, "white")[..., 1]
        row["sequential"] = {"modulation": seen(Y, mm_per_px, frequency, eye_mm)[0]}
        for name, inputs in lit.items():
            codes = assemble(wave[..., None] * inputs, labels, model.response, 8)
            modulation, alias = seen(bench.view_XYZ(codes, "pattern")[..., 1], mm_per_px, frequency, eye_mm)
            row[name] = {"modulation": modulation, "alias": alias}
        rows.append(row)
    return {"gratings": rows, "light": light_kept(bench, labels.shape)}


def light_kept(bench: VirtualBench, shape: tuple[int, ...]) -> dict[str, float]:
    """Luminance of full white on the print, over white paper, and over a sequential picture of one field in three."""
    full = np.full((*shape, 1), 255, np.uint8)
    inner = (slice(shape[0] // 4, -shape[0] // 4), slice(shape[1] // 4, -shape[1] // 4), 1)
    on_print, on_white = (float(bench.view_XYZ(full, surface)[inner].mean()) for surface in ("pattern", "white"))
    share = on_print / on_white
    return {"over_white_paper": share, "over_time_sequential": PICTURES * share}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        installation = Installation.create(Path(folder) / "rgb", make_settings("rgb", SIZE))
        make_print(installation)
        capture(installation, open_devices(installation), lambda *_: None)
        calibrate(installation)
        settings = installation.settings
        result = measure(
            open_bench(installation),
            load_model(installation.folder("calibration") / "model.json"),
            read_image(installation.folder("calibration") / "clusters.png"),
            settings.projector.width_mm / settings.projector.resolution[0],
        )
    tile_mm = settings.pattern.dot_size_mm * np.sqrt(len(settings.pattern.colorants))
    result = {
        "measured_on": f"virtual bench, {settings.bench.quality}",
        "dot_size_mm": settings.pattern.dot_size_mm,
        "limit_of_one_primary_cycles_per_mm": float(0.5 / tile_mm),
        "distance_mm": 4000.0,
        **result,
    }
    RESULT.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    for row in result["gratings"]:
        print({k: v if isinstance(v, float) else {a: round(float(b), 3) for a, b in v.items()} for k, v in row.items()})
    print(result["light"])


if __name__ == "__main__":
    main()
