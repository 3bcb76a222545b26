"""How wrong the plain linear model is on the virtual bench: reports/reference/bench_floors.json.

The spectral model with black (the one that `paxel calibrate` fits) at the demonstration's size, each quality, K = 2 and
3, on 100 random projections. The projector pixels are sorted by the bench's truth, so that nothing but the model's own
assumptions is tested. The paper's Table I stands beside it; its figures were measured on hardware.

Run from a checkout (a minute)::

    python -m reports.bench_floors
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration import fit_model, prediction_error
from paxel_runtime.captures.exposures import RANDOM_COUNT, frame_codes, plan_readings
from paxel_runtime.devices.bench_qualities import QUALITIES
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.settings import DEMO_OVERRIDES, Settings, make_settings

RESULT = Path(__file__).parent / "reference" / "bench_floors.json"
COUNTS = (2, 3)
CHECKERBOARD = np.array([[0, 1], [1, 0]], np.uint8)
TABLE_I = {
    "measured_on": "hardware (the paper, Table I)",
    "K": 2,
    "pattern": {"dE00_mean": 1.9, "dE00_p95": 3.0, "dE00_max": 5.9},
    "white": {"dE00_mean": 2.36, "dE00_p95": 3.8, "dE00_max": 8.5},
}


def bench_of(settings: Settings, quality: str) -> VirtualBench:
    """The virtual bench of some settings, with a checkerboard on it."""
    p, projector = settings.pattern, settings.projector
    return VirtualBench(
        BenchSetup(
            pattern=Pattern("checkerboard", p.colorants, CHECKERBOARD, p.dot_size_mm, p.angle_deg, p.size_mm),
            resolution=projector.resolution,
            width_mm=projector.width_mm,
            channels=projector.channels,
            bits=projector.bits,
            camera_resolution=settings.camera.resolution,
            camera_bits=settings.camera.bits,
            aperture_mm=settings.meter.aperture_mm,
            quality=quality,
            seed=settings.bench.seed,
        )
    )


def true_labels(bench: VirtualBench, K: int) -> NDArray[np.uint8]:
    """Cluster of each projector pixel by its true share of the first colorant, in K equal steps; the darkest is 0."""
    share = bench.truth.coverage()[..., 0]
    return np.minimum(((1.0 - share) * K).astype(np.uint8), K - 1)


def linear_model_errors(settings: Settings, quality: str) -> dict[str, Any]:
    """`calibration.prediction_error` for every K, by its number."""
    bench, projector = bench_of(settings, quality), settings.projector
    labels = {K: true_labels(bench, K) for K in COUNTS}
    plan = plan_readings(
        projector.channels, COUNTS, bits=projector.bits, seed=settings.bench.seed, surfaces=("pattern", "white")
    )
    plan = [exposure for exposure in plan if exposure.device == "meter"]
    readings = {}
    for exposure in plan:
        bench.place(exposure.surface)
        bench.show(frame_codes(exposure, projector.channels, projector.resolution, projector.bits, labels))
        readings[exposure.name] = bench.measure()
    names = {K: tuple(f"cluster {i}" for i in range(K)) for K in COUNTS}
    models = {K: fit_model(readings, plan, projector.channels, names[K]) for K in COUNTS}
    return {f"K={K}": prediction_error(models[K], readings, plan) for K in COUNTS}


def main() -> None:
    """Measure every quality and write the table."""
    settings = make_settings("bw-checkerboard", DEMO_OVERRIDES)
    table: dict[str, Any] = {
        "what": "dE00 of the plain linear model with black, fitted and tested on the virtual bench",
        "measured_on": "virtual bench",
        "projector": settings.projector.resolution,
        "random_projections": RANDOM_COUNT,
        "seed": settings.bench.seed,
        "paper": TABLE_I,
    }
    for quality in QUALITIES:
        table[quality] = linear_model_errors(settings, quality)
        for K, errors in table[quality].items():
            figures = "  ".join(
                f"{s} {errors[s]['dE00_mean']:.2f} / {errors[s]['dE00_p95']:.2f} / {errors[s]['dE00_max']:.2f}"
                for s in ("pattern", "white")
            )
            print(f"virtual bench, {quality}, {K}: mean / 95 % / max  {figures}")
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps(rounded(table), indent=2) + "\n", encoding="utf-8")


def rounded(value: Any) -> Any:
    """The same with 4 digits behind the point."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return round(value, 4) if isinstance(value, float) else value


if __name__ == "__main__":
    main()
