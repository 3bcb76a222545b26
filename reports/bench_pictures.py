"""Pictures to look at: what the virtual bench's camera takes and what a viewer sees, as PNG in a folder.

Captures of a stripe and of full white on the pattern with crops at 100 %, and a photograph shown on both surfaces as
an observer at 0.5 m and at 5 m sees it, at fixed exposure and adapted. Run from a checkout (half a minute)::

    python -m reports.bench_pictures FOLDER
    python -m reports.bench_pictures FOLDER --paper-devices    # a stripe at 4K and 50 megapixels as well: 3 GB

"""

from __future__ import annotations

import argparse
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB
from paxel_runtime.observer import eye_sigma_mm, view_to_sRGB
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from reports.bench_floors import bench_of
from reports.benchmark_bench import SIZES

DISTANCES_MM = (500.0, 5000.0)
CROP_PX = 480
SMALL_PX = 1200


def camera_pictures(bench: VirtualBench, folder: Path, name: str) -> None:
    """A stripe in green and full white on the pattern: the whole picture made small, and its middle at 100 %."""
    height, width = bench.truth.grid.height, bench.truth.grid.width
    stripes = np.zeros((height, width, 3), np.uint8)
    stripes[..., 1] = 255 * (np.arange(width) // 4 % 2)
    bench.place("pattern")
    for what, codes, channel in (("stripe", stripes, "green"), ("white", np.full_like(stripes, 255), None)):
        bench.show(codes)
        raw = bench.capture(channel)
        step = max(1, raw.shape[1] // SMALL_PX)
        rows, columns = raw.shape[0] // step * step, raw.shape[1] // step * step
        blocks = raw[:rows, :columns].reshape(rows // step, step, columns // step, step, -1)
        _write(folder / f"{name}-{what}.png", _developed(blocks.mean(axis=(1, 3))))
        top, left = (raw.shape[0] - CROP_PX) // 2, (raw.shape[1] - CROP_PX) // 2
        _write(folder / f"{name}-{what}-crop.png", _developed(raw[top : top + CROP_PX, left : left + CROP_PX]))


def observer_pictures(bench: VirtualBench, folder: Path, pitch_mm: float) -> None:
    """A photograph on both surfaces from two distances; the white of every picture is full white on the white sheet."""
    size = bench.truth.grid.width, bench.truth.grid.height
    with (files("skimage") / "data" / "astronaut.png").open("rb") as file, Image.open(file) as image:
        codes = np.asarray(image.convert("RGB").crop((0, 12, 512, 300)).resize(size, Image.Resampling.LANCZOS))
    middle = tuple(slice(n // 2 - n // 32, n // 2 + n // 32) for n in size[::-1])
    white_point = bench.view_XYZ(np.full_like(codes, 255), "white")[middle].mean(axis=(0, 1))
    for surface in ("pattern", "white"):
        view = bench.view_XYZ(codes, surface)
        for distance_mm in DISTANCES_MM:
            sigma_px = eye_sigma_mm(distance_mm) / pitch_mm
            for exposure in ("fixed", "auto"):
                seen = view_to_sRGB(view, exposure, white_point, sigma_px)
                _write(folder / f"seen-{surface}-{distance_mm / 1000:g}m-{exposure}.png", seen)


def _developed(raw: NDArray[np.floating] | NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Raw values as 8-bit sRGB, 80 % of saturation as white."""
    sRGB = linear_sRGB_to_sRGB(np.clip(raw / (0.8 * 65535), 0, 1))
    return np.rint(255 * sRGB).astype(np.uint8).squeeze()


def _write(path: Path, picture: NDArray[np.uint8]) -> None:
    Image.fromarray(picture).save(path)
    print(path)


def main() -> None:
    """Write the pictures."""
    options = argparse.ArgumentParser(description="Pictures of the virtual bench")
    options.add_argument("folder", type=Path)
    options.add_argument("--quality", default="realistic")
    options.add_argument("--paper-devices", action="store_true", help="a 4K projector and 50 megapixels as well")
    chosen = options.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    settings = make_settings("bw-checkerboard", DEMO_OVERRIDES)
    bench = bench_of(settings, chosen.quality)
    camera_pictures(bench, chosen.folder, "camera")
    observer_pictures(bench, chosen.folder, settings.projector.width_mm / settings.projector.resolution[0])
    if chosen.paper_devices:
        large = make_settings("bw-checkerboard", SIZES["4K, 50 megapixels (the paper's devices)"])
        camera_pictures(bench_of(large, chosen.quality), chosen.folder, "paper-devices")


if __name__ == "__main__":
    main()
