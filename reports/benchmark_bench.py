"""Time and memory of the virtual bench: reports/reference/benchmark_bench.json.

Each size runs in a process of its own, so that its peak memory is its own, twice: with an empty cache on disk and with
what the first run left there. Kernels are compiled before the clock starts. Run from a checkout, on a machine that does
nothing else (two minutes)::

    python -m reports.benchmark_bench            # writes the file
    python -m reports.benchmark_bench --quick    # the demonstration's size only; writes nothing
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from reports.bench_floors import bench_of

RESULT = Path(__file__).parent / "reference" / "benchmark_bench.json"
GIB = 2**30
SIZES: dict[str, dict[str, Any]] = {
    "demonstration": DEMO_OVERRIDES,
    "full HD, 12 megapixels": {},
    "4K, 50 megapixels (the paper's devices)": {
        "projector.resolution": [3840, 2160],
        "projector.width_mm": 562.0,
        "camera.resolution": [8688, 5792],
    },
}
LIMITS = {
    "full HD, 12 megapixels": {"stripe_s": 1.2, "rgb_s": 5.0, "peak_GiB": 2.5},
    "4K, 50 megapixels (the paper's devices)": {"peak_GiB": 6.0},
}
COMPILE = {"projector.resolution": [320, 180], "projector.width_mm": 46.9, "camera.resolution": [320, 240]}


def measure_size(overrides: dict[str, Any]) -> dict[str, Any]:
    """Figures of one size, in this process: wall-clock seconds, and processor seconds a core."""
    _measure_steady(bench_of(make_settings("bw-checkerboard", COMPILE), "realistic"))
    settings = make_settings("bw-checkerboard", overrides)
    began = time.perf_counter()
    bench = bench_of(settings, "realistic")
    bench.capture("green")
    first_s = round(time.perf_counter() - began, 2)
    return {
        "projector": settings.projector.resolution,
        "camera": settings.camera.resolution,
        "first_picture_s": first_s,
        **_measure_steady(bench),
        "peak_GiB": round(_peak_bytes() / GIB, 2),
    }


def _measure_steady(bench: VirtualBench) -> dict[str, float]:
    """A stripe in one channel, any RGB picture, a reading and a view, all set-up done."""
    height, width = bench.truth.grid.height, bench.truth.grid.width
    stripes = np.zeros((height, width, 3), np.uint8)
    stripes[..., 1] = 255 * (np.arange(width) // 4 % 2)
    noise = np.random.default_rng(0).integers(0, 256, stripes.shape, dtype=np.uint8)
    return {
        **_best_of(3, "stripe", lambda: (bench.show(stripes), bench.capture("green"))),
        **_best_of(3, "reading", lambda: (bench.show(stripes), bench.measure())),
        **_best_of(2, "rgb", lambda: (bench.show(noise), bench.capture())),
        **_best_of(1, "view", lambda: bench.view_XYZ(noise, "pattern")),
    }


def _best_of(times: int, name: str, work: Callable[[], object]) -> dict[str, float]:
    wall, processor = [], []
    for _ in range(times):
        began, busy = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - began)
        processor.append((time.process_time() - busy) / (os.cpu_count() or 1))
    return {f"{name}_s": round(min(wall), 3), f"{name}_processor_s": round(min(processor), 3)}


def _peak_bytes() -> int:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def _in_a_process(name: str, cache: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "reports.benchmark_bench", "--only", name]
    environment = {**os.environ, "PAXEL_CACHE_DIR": cache}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    figures: dict[str, Any] = json.loads(done.stdout)
    return figures


def main() -> None:
    """Run the sizes and say which limits hold."""
    options = argparse.ArgumentParser(description="Time and memory of the virtual bench")
    options.add_argument("--quick", action="store_true", help="the demonstration's size only; writes nothing")
    options.add_argument("--only", choices=SIZES, help="one size, in this process, as JSON")
    chosen = options.parse_args()
    if chosen.only:
        print(json.dumps(measure_size(SIZES[chosen.only])))
        return
    table: dict[str, Any] = {
        "what": "virtual bench, quality realistic; seconds by the clock, and processor seconds divided by the cores",
        "cores": os.cpu_count(),
        "others_load_at_start": round(os.getloadavg()[0], 2),
    }
    for name in list(SIZES)[: 1 if chosen.quick else None]:
        with tempfile.TemporaryDirectory() as cache:
            cold, warm = _in_a_process(name, cache), _in_a_process(name, cache)
        figures = cold | {"first_picture_from_cache_s": warm["first_picture_s"], "limits": LIMITS.get(name, {})}
        table[name] = figures
        print(name, figures)
        for key, limit in figures["limits"].items():
            print(f"  {key} {figures[key]} of {limit}: {'kept' if figures[key] <= limit else 'BROKEN'}")
    if not chosen.quick:
        RESULT.parent.mkdir(exist_ok=True)
        RESULT.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
