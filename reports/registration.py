"""How near the lookup table and the design registration come to the virtual bench's truth.

Run by hand: ``python -m reports.registration``. Each table stands beside the paper's (mean of each projector pixel's
own camera pixels) and, where OpenCV's contrib build is installed, beside its GrayCodePattern on the same captures.
Figures go to ``reports/reference/registration.json``. About ten minutes on two cores.
"""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns import make_pattern
from paxel_runtime.calibration import register
from paxel_runtime.captures.exposures import exposure_name, frame_codes, guide_channel, plan_geometry
from paxel_runtime.clustering import lloyd
from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.registration import TABLES, register_design
from paxel_runtime.structured_light import REASONS, Decoded, plan_frames

OUT = Path(__file__).parent / "reference" / "registration.json"
RESOLUTION, CAMERA = (480, 270), (1024, 600)
PITCH_MM = 281.0 / 1920.0
CHANNELS = ("red", "green", "blue")
REALISTIC = QUALITIES["realistic"]
CASES: dict[str, tuple[BenchQuality, int]] = {
    "realistic, flat": (replace(REALISTIC, wave_camera_px=0.0), 14),
    "realistic, flat, 8 bits": (replace(REALISTIC, wave_camera_px=0.0), 8),
    "realistic": (REALISTIC, 14),
    "harsh": (QUALITIES["harsh"], 14),
}


def photograph(quality: BenchQuality, bits: int, pattern: Any) -> tuple[dict[str, NDArray[np.uint16]], Any]:
    """All pictures of the geometry, and the truth."""
    setup = BenchSetup(pattern, RESOLUTION, RESOLUTION[0] * PITCH_MM, CHANNELS, 8, CAMERA, bits, 20.0, "realistic", 0)
    bench = VirtualBench(setup, quality)
    captures = {}
    for exposure in plan_geometry(CHANNELS, RESOLUTION):
        bench.place(exposure.surface)
        bench.show(frame_codes(exposure, CHANNELS, RESOLUTION, 8, {}))
        captures[exposure.name] = bench.capture(exposure.channel or None)
    return captures, bench.truth


def table_error(camera_xy: NDArray[np.floating], truth: NDArray[np.float64]) -> dict[str, float]:
    """Distances from the truth where there is an entry, camera pixels."""
    off = np.hypot(*np.moveaxis(camera_xy - truth, -1, 0))
    known = off[np.isfinite(off)]
    return {
        "rms_px": float(np.sqrt(np.mean(known**2))),
        "p99_px": float(np.percentile(known, 99)),
        "max_px": float(known.max()),
        "entries": float(np.mean(np.isfinite(off))),
    }


def opencv_table(captures: dict[str, NDArray[np.uint16]]) -> NDArray[np.float64] | None:
    """OpenCV's decode of the same Gray code, averaged a projector pixel; None without the contrib build."""
    try:
        import cv2

        # the full-depth code that OpenCV wants cannot be made of ours, whose finest bit is a stripe of 4 pixels: half
        # of the projector's pixels a side, each twice as wide
        coder = cv2.structured_light.GrayCodePattern.create(RESOLUTION[0] // 2, RESOLUTION[1] // 2)
    except (ImportError, AttributeError):
        return None
    guide = guide_channel(CHANNELS)
    names = [frame.name for frame in plan_frames(*RESOLUTION) if frame.name.startswith("gray")]
    eight = [(captures[f"light-{guide}-{name}"] >> 8).astype(np.uint8) for name in names]
    sums = np.zeros((RESOLUTION[1] // 2, RESOLUTION[0] // 2, 3))
    for row in range(CAMERA[1]):
        for column in range(CAMERA[0]):
            failed, place = coder.getProjPixel(eight, column, row)
            if not failed:
                sums[place[1], place[0]] += (column, row, 1.0)
    with np.errstate(invalid="ignore"):
        return sums[..., :2] / sums[..., 2:]


def damaged(decoded: Decoded, kind: str) -> Decoded:
    """Decoded pixels of which 30 % are random, or 16 % of the projection hidden."""
    places, reason, rng = decoded.projector_xy.copy(), decoded.reason.copy(), np.random.default_rng(0)
    known = reason == 0
    if kind == "30 % outliers":
        wrong = known & (rng.random(known.shape) < 0.3)
        places[wrong] = rng.uniform((0, 0), RESOLUTION, (int(wrong.sum()), 2))
    else:
        low, high = 0.3 * np.array(RESOLUTION), 0.7 * np.array(RESOLUTION)
        hidden = known & np.all((places > low) & (places < high), axis=-1)
        places[hidden] = np.nan
        reason[hidden] = REASONS.index("too dark")
    return replace(decoded, projector_xy=places, reason=reason)


def design_figures(captures: dict[str, NDArray[np.uint16]], truth: Any, table: Any, pattern: Any) -> dict[str, float]:
    """Coverage by the design, one channel."""
    light = {}
    guide = guide_channel(CHANNELS)
    for surface in ("pattern", "white"):
        full, dark = (captures[exposure_name(surface, level, guide, CHANNELS)] for level in ("full", "dark"))
        light[surface] = full.astype(np.float32) - dark
    seen = light["white"] > 0.01 * light["white"].max()
    picture = np.where(seen, light["pattern"] / np.where(seen, light["white"], 1), np.nan).astype(np.float32)
    start = time.process_time()
    design = register_design(picture, table.camera_xy, table.valid, pattern, PITCH_MM, np.array([[0.03], [1.0]]))
    seconds = time.process_time() - start
    wanted, found = truth.coverage()[..., 0], design.coverage[..., 0]
    starts = np.array([[1.0], [0.0], [0.5]])
    three = [lloyd(c.reshape(-1, 1).astype(np.float64), starts)[1] for c in (found, wanted)]
    return {
        "coverage_rms": float(np.sqrt(np.mean((found - wanted) ** 2))),
        "labels_K2": float(np.mean((found > 0.5) == (wanted > 0.5))),
        "labels_K3": float(np.mean(three[0] == three[1])),
        "cpu_s": seconds,
    }


def main() -> None:
    pattern = make_pattern("checkerboard", ("black", "white"), 0.75, 30.0, (110.0, 80.0))
    result: dict[str, Any] = {}
    for name, (quality, bits) in CASES.items():
        captures, truth = photograph(quality, bits, pattern)
        guide = guide_channel(CHANNELS)
        tables, decoded = register(captures.__getitem__, CHANNELS, RESOLUTION)
        wanted = truth.camera_xy(guide)
        row: dict[str, Any] = {
            method: table_error(make(decoded[guide], *RESOLUTION).camera_xy, wanted) for method, make in TABLES.items()
        }
        lit = np.count_nonzero(
            np.isin(decoded[guide].reason, [REASONS.index(r) for r in ("too dark", "outside the frame")])
        )
        row["decoded"] = float(np.mean(decoded[guide].reason == 0)) / (1.0 - lit / decoded[guide].reason.size)
        others = opencv_table(captures)
        if others is not None:
            coarse = wanted.reshape(RESOLUTION[1] // 2, 2, RESOLUTION[0] // 2, 2, 2).mean(axis=(1, 3))
            row["opencv"] = table_error(others, coarse)
        if name == "realistic, flat":
            for kind in ("30 % outliers", "16 % hole"):
                table = TABLES["fit"](damaged(decoded[guide], kind), *RESOLUTION)
                row[kind] = table_error(table.camera_xy, wanted)
        if name in ("realistic", "harsh"):
            row["design"] = design_figures(captures, truth, tables[guide], pattern)
        result[name] = row
        print(name, json.dumps(row, indent=1), flush=True)
    OUT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
