"""Matrices of small installations on the virtual bench, for benchmarks that need models: reference/bench_models.json.

Each is measured as calibration measures it, a cluster and a channel at a time, on the quality ``realistic``; projector
pixels are sorted by the bench's own truth, so that nothing depends on registration. XYZ with Y = 1 for the white point.

Run from a checkout (a minute)::

    python -m reports.bench_models
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns import make_pattern
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

RESULT = Path(__file__).parent / "reference" / "bench_models.json"
SIZE = (320, 180)
PITCH_MM = 140.6 / 960  # the demonstration's
RGB = ("red", "green", "blue")
SETUPS: dict[str, tuple[tuple[str, ...], tuple[str, ...], int]] = {
    "K=2": (("black", "white"), RGB, 2),
    "K=3": (("black", "white"), RGB, 3),
    "single channel": (("red", "green", "blue"), ("white",), 3),
    "K=6": (("cyan", "magenta", "yellow", "red", "green", "blue"), RGB, 6),
}
"""Colorants, channels and number of clusters."""


def small_bench(colorants: tuple[str, ...], channels: tuple[str, ...]) -> VirtualBench:
    """The virtual bench at `SIZE`, `realistic`: black and white as a checkerboard, other inks as tiles."""
    layout = "checkerboard" if len(colorants) == 2 else "tiles"
    return VirtualBench(
        BenchSetup(
            pattern=make_pattern(layout, colorants, 0.75, 30.0, (160.0, 100.0)),
            resolution=SIZE,
            width_mm=SIZE[0] * PITCH_MM,
            channels=channels,
            bits=8,
            camera_resolution=(320, 240),
            camera_bits=14,
            aperture_mm=20.0,
            quality="realistic",
            seed=0,
        )
    )


def measure(colorants: tuple[str, ...], channels: tuple[str, ...], K: int) -> dict[str, Any]:
    """The matrices of one installation, ready for JSON."""
    bench = small_bench(colorants, channels)
    coverage = bench.truth.coverage()[..., : len(colorants)]
    labels = (
        np.argmax(coverage, axis=-1) if len(colorants) == K else np.minimum((coverage[..., 0] * K).astype(int), K - 1)
    )
    surfaces: dict[str, Any] = {}
    scale = 1.0
    for surface in ("white", "pattern") if len(channels) > 1 else ("pattern",):
        bench.place(surface)  # type: ignore[arg-type]
        black = read_XYZ(bench, np.zeros((K, len(channels))), labels)
        ones = np.eye(K * len(channels)).reshape(-1, K, len(channels))
        A = np.array([read_XYZ(bench, one, labels) - black for one in ones]).T
        if not surfaces:
            white_point = black + A.sum(axis=1)
            scale = 1.0 / white_point[1]
        surfaces[surface] = {"A": (scale * A).tolist(), "black": (scale * black).tolist()}
    return {
        "channels": channels,
        "clusters": [f"cluster {i}" for i in range(K)],
        "white_point_XYZ": (scale * white_point).tolist(),
        "surfaces": surfaces,
    }


def read_XYZ(bench: VirtualBench, P: NDArray[np.float64], labels: NDArray[np.int_]) -> NDArray[np.float64]:
    """Reading with device values P (K, N) on the clusters."""
    bench.show(np.rint(255 * P).astype(np.uint8)[labels])
    return spectra_to_XYZ(bench.measure())


def bench_model(name: str) -> PredictionModel:
    """One of `SETUPS` as it stands in the file."""
    entry = json.loads(RESULT.read_text(encoding="utf-8"))[name]
    surfaces = {key: SurfaceModel(np.array(s["A"]), np.array(s["black"])) for key, s in entry["surfaces"].items()}
    ramp = np.tile([0.0, 1.0], (len(entry["channels"]), 1))
    return PredictionModel(
        channels=tuple(entry["channels"]),
        clusters=tuple(entry["clusters"]),
        pattern=surfaces["pattern"],
        white=surfaces.get("white"),
        white_point=np.array(entry["white_point_XYZ"]),
        response=ProjectorResponse(ramp, ramp),
    )


def main() -> None:
    """Measure every setup and write the file."""
    models: dict[str, Any] = {"what": "virtual bench, quality realistic: A and black of small installations"}
    models |= {name: _rounded(measure(*setup)) for name, setup in SETUPS.items()}
    RESULT.write_text(json.dumps(models, indent=1) + "\n", encoding="utf-8")


def _rounded(value: Any) -> Any:
    """The same with 7 significant digits."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.7g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
