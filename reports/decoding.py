"""Structured light decoded: how much, how well, how fast, beside OpenCV: reports/reference/decoding.json.

Three parts. *real*: a Gray-code capture of a printed board by others (``PAXEL_DATA``/structured_light; OpenCV's own
decode of it is part of the data). *bench*: our frames on the virtual bench, realistic and harsh, by lines and by phase,
against the truth. *time*: 54 pictures of 12 megapixels decoded and fitted, one process, with its peak of memory.

Run from a checkout (three minutes; the machine should have nothing else to do)::

    PAXEL_DATA=... python -m reports.decoding [real] [bench] [time]
"""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from paxel_runtime.captures.foreign import decode_folder, plane_figures
from paxel_runtime.devices.bench_setup import BenchSetup
from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.registration import fit_registration
from paxel_runtime.settings import DEMO_OVERRIDES, make_settings
from paxel_runtime.storage import read_tiff, write_tiff
from paxel_runtime.structured_light import Decoded, Method, decode, plan_frames

RESULT = Path(__file__).parent / "reference" / "decoding.json"
CAPTURE = Path("structured_light") / "procam_capture0_crop"
CHECKERBOARD = np.array([[0, 1], [1, 0]], np.uint8)


def real_capture(data: Path) -> dict[str, Any]:
    """Ours and OpenCV's decode of the real capture."""
    with tempfile.TemporaryDirectory() as name:
        for path in sorted((data / CAPTURE).glob("graycode_*.png")):
            (Path(name) / path.name).symlink_to(path)
        decoded, figures = decode_folder(Path(name), 1024, 768)
    with np.load(data / CAPTURE / "opencv_decode.npz") as arrays:
        opencv = np.stack([arrays["px"], arrays["py"]], axis=-1).astype(np.float32)
    known = np.all(opencv >= 0, axis=-1)
    share, rms_px = plane_figures(opencv, known)
    return {
        "ours": {key: figures[key] for key in ("decoded", "rejected", "plane", "confidence_median")},
        "opencv": {"decoded": float(np.mean(known)), "plane": {"within_2_px": share, "residual_rms_px": rms_px}},
        "equal_where_opencv_decodes": float(np.mean(np.all(np.rint(decoded.projector_xy) == opencv, axis=-1)[known])),
    }


def on_the_bench(quality: str, method: Method) -> dict[str, Any]:
    """Share of the camera's pixels decoded, and their error against the bench's truth, at the demonstration's size."""
    s = make_settings("bw-checkerboard", {**DEMO_OVERRIDES, "bench.quality": quality})
    bench = VirtualBench(
        BenchSetup(
            pattern=Pattern(
                "checkerboard",
                s.pattern.colorants,
                CHECKERBOARD,
                s.pattern.dot_size_mm,
                s.pattern.angle_deg,
                s.pattern.size_mm,
            ),
            resolution=s.projector.resolution,
            width_mm=s.projector.width_mm,
            channels=s.projector.channels,
            bits=s.projector.bits,
            camera_resolution=s.camera.resolution,
            camera_bits=s.camera.bits,
            aperture_mm=s.meter.aperture_mm,
            quality=s.bench.quality,
            seed=s.bench.seed,
        )
    )
    width, height = s.projector.resolution
    frames = {frame.name: frame for frame in plan_frames(width, height, method=method)}
    bench.place("pattern")

    def read(name: str) -> NDArray[np.uint16]:
        codes = np.zeros((height, width, 3), np.uint16)
        codes[..., 1] = np.rint(frames[name].pixels(width, height).astype(np.float32) * 255)
        bench.show(codes)
        return bench.capture("green")

    decoded = decode(read, width, height, method=method)
    return {"pictures": len(frames), **_against_truth(decoded, bench.truth.camera_xy("green"))}


def _against_truth(decoded: Decoded, camera_xy: NDArray[np.float64]) -> dict[str, Any]:
    """Error of the decoded places, taken at the camera pixel nearest to each projector pixel's true image.

    The true table is linear over so short a way: its local inverse turns the rest of the way into projector pixels.
    """
    h, w = decoded.reason.shape
    H, W = camera_xy.shape[:2]
    nearest = np.rint(camera_xy).astype(int)
    v, u = np.indices((H, W)).astype(np.float64)
    du, dv = np.gradient(camera_xy, axis=1), np.gradient(camera_xy, axis=0)
    inverse = np.linalg.inv(np.stack([du, dv], axis=-1))
    off = np.einsum("hwij,hwj->hwi", inverse, nearest - camera_xy)
    inside = (nearest >= 0).all(axis=-1) & (nearest[..., 0] < w) & (nearest[..., 1] < h)
    inside[:2], inside[-2:], inside[:, :2], inside[:, -2:] = False, False, False, False
    column, row = nearest[inside].T
    truth = (np.stack([u, v], axis=-1) + off)[inside]
    good = decoded.reason[row, column] == 0
    error = np.linalg.norm(decoded.projector_xy[row, column] - truth, axis=-1)[good]
    return {
        "decoded": float(np.mean(good)),
        "error_px": {
            "rms": float(np.sqrt(np.mean(error**2))),
            "median": float(np.median(error)),
            "p99": float(np.percentile(error, 99)),
        },
        "confidence_median": float(np.median(decoded.confidence[row, column][good])),
        "noise": {"read_variance": decoded.noise.read_variance, "gain": decoded.noise.gain},
    }


def timing(width: int = 960, height: int = 540, scale: float = 4.82) -> dict[str, Any]:
    """Seconds and memory to decode 54 captures of 12 megapixels from files, and to fit the lookup table."""
    h, w = int(height * scale), int(width * scale)
    frames = plan_frames(width, height)
    noise = np.random.default_rng(0)
    places = {"x": (np.arange(w) + 0.5) / scale - 0.5, "y": (np.arange(h) + 0.5) / scale - 0.5}
    with tempfile.TemporaryDirectory() as name:
        for frame in frames:
            light = gaussian_filter1d(frame.profile.repeat(16).astype(np.float64), 6.0, mode="nearest")
            level = np.interp(places[frame.axis], (np.arange(light.size) + 0.5) / 16 - 0.5, light)
            level = level[None, :] if frame.axis == "x" else level[:, None]
            picture = 300.0 + 30000.0 * level + noise.normal(0.0, 60.0, (h, w)).astype(np.float32)
            write_tiff(Path(name) / f"{frame.name}.tif", picture.astype(np.uint16))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        start, cpu = time.perf_counter(), time.process_time()
        decoded = decode(lambda frame: read_tiff(Path(name) / f"{frame}.tif"), width, height)
        between = time.perf_counter()
        fit_registration(decoded, width, height)
        end = time.perf_counter()
    return {
        "pictures": len(frames),
        "megapixels": w * h / 1e6,
        "decode_s": round(between - start, 1),
        "fit_s": round(end - between, 1),
        "cpu_s": round(time.process_time() - cpu, 1),
        "peak_memory_MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "memory_before_MB": round(before / 1024),
        "cpus": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
    }


def main() -> None:
    parts = sys.argv[1:] or ["real", "bench", "time"]
    results: dict[str, Any] = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.is_file() else {}
    if "real" in parts:
        results["real"] = real_capture(Path(os.environ["PAXEL_DATA"]))
    if "bench" in parts:
        methods: tuple[Method, ...] = ("lines", "phase")
        results["virtual bench"] = {
            f"{quality}, {method}": on_the_bench(quality, method)
            for quality in ("realistic", "harsh")
            for method in methods
        }
    if "time" in parts:
        timing(64, 64, 2.0)  # compiles
        results["time"] = timing()
    RESULT.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
