"""How well colours are predicted (Table I), on the virtual bench: reports/reference/accuracy.json and accuracy-*.png.

1. A black-and-white checkerboard at 30 degrees, pixels sorted by k-means, K = 2 and 3, each quality: dE00 on 100 random
   projections of the linear model as the paper fits it (single clusters), of A refined with all readings, and of the
   measured correction from 60 and from 200 extra readings. The paper's figures stand beside them; they were measured
   on hardware.
2. `realistic` with the fall-off and blur of `harsh`: the image-based model over the whole field (Eq. 4), its colours
   scaled to the meter's readings or taken for an RGB space as in the paper, and the spectral model at the corners.

Run from a checkout (six minutes; ``--quick``: two, one quality, and nothing is written)::

    python -m reports.accuracy
"""

from __future__ import annotations

import argparse
import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter

from paxel_runtime.calibration import (
    accuracy_picture,
    compare_colors,
    correct_model,
    error_figures,
    fit_model,
    kernel_sigma_px,
    noise_floor,
    prediction_error,
)
from paxel_runtime.calibration.drift import correct_drift
from paxel_runtime.captures.acquisition import capture, load_captures
from paxel_runtime.captures.exposures import Exposure, frame_codes, plan_readings
from paxel_runtime.devices.base import Devices
from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model_image import load_image_model
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibrate
from reports.bench_floors import TABLE_I, rounded

REFERENCE = Path(__file__).parent / "reference"
SMALL = {
    "projector.resolution": [480, 270],
    "projector.width_mm": 70.3,
    "pattern.size_mm": [90.0, 60.0],
    "camera.resolution": [1448, 1086],
    "clusters.count": 2,
}
COUNTS = (2, 3)
EXTRA = (60, 200)
FIELD_PROJECTIONS = 12
CORNER_PX = 24


def captured(
    folder: Path, quality: str, own: BenchQuality | None = None, **keys: str
) -> tuple[Installation, VirtualBench]:
    """An installation with its captures, and the bench they were taken on."""
    from paxel_design.stages.print_sheet import make_print

    settings = make_settings("bw-checkerboard", SMALL | {f"model.{k}": v for k, v in keys.items()})
    installation = Installation.create(folder, settings)
    make_print(installation)
    from paxel_runtime.printed import load_pattern

    p = settings.projector
    setup = BenchSetup(
        pattern=load_pattern(installation),
        resolution=p.resolution,
        width_mm=p.width_mm,
        channels=p.channels,
        bits=p.bits,
        camera_resolution=settings.camera.resolution,
        camera_bits=settings.camera.bits,
        aperture_mm=settings.meter.aperture_mm,
        quality=quality,
        seed=settings.bench.seed,
    )
    bench = VirtualBench(setup, own)
    capture(installation, Devices(bench, bench, bench, bench), lambda *_: None)
    return installation, bench


def take(
    bench: VirtualBench, plan: list[Exposure], labels: dict[int, NDArray[np.uint8]]
) -> dict[str, NDArray[np.float64]]:
    """Readings of a plan."""
    height, width = next(iter(labels.values())).shape
    readings = {}
    for e in plan:
        bench.place(e.surface)
        bench.show(frame_codes(e, ("red", "green", "blue"), (width, height), 8, labels))
        readings[e.name] = bench.measure()
    return readings


def table_I(quality: str, counts: tuple[int, ...], extras: tuple[int, ...], pictures: bool) -> dict[str, Any]:
    """Errors of every model on one quality, for each K."""
    with tempfile.TemporaryDirectory() as folder:
        installation, bench = captured(Path(folder) / "show", quality)
        labels = load_captures(installation).labels
    channels, result = ("red", "green", "blue"), {}
    for K in counts:
        plan = plan_readings(channels, (K,), bits=8, seed=0, surfaces=("pattern", "white"), extra=max(extras))
        plan = [e for e in plan if e.device == "meter"]
        readings, _ = correct_drift(take(bench, plan, labels), plan)
        linear = fit_model(readings, plan, channels, tuple(f"cluster {i}" for i in range(K)))
        rows: dict[str, Any] = {"single clusters": _pair(linear, readings, plan)}
        for count in extras:
            fewer = [e for e in plan if not e.name.startswith("extra-") or int(e.name[-3:]) < count]
            model, figures = correct_model(linear, readings, fewer)
            rows[f"A refined, {count} extra"] = _pair(model.linear, readings, plan)
            rows[f"corrected, {count} extra"] = _pair(model, readings, plan) | {"fit": figures}
            if pictures and count == extras[0]:
                _draw(f"virtual bench, {quality}, K = {K}, {count} extra readings", linear, model, readings, plan)
        rows["noise floor"] = noise_floor(linear, readings, plan)
        result[f"K={K}"] = rows
        for name, row in rows.items():
            if "noise" not in name:
                print(f"virtual bench, {quality}, K={K}, {name}: {_words(row)}", flush=True)
    return result


def _pair(model: PredictionModel, readings: dict[str, NDArray[np.float64]], plan: list[Exposure]) -> dict[str, Any]:
    errors = prediction_error(model, readings, plan)
    return {surface: errors[surface] for surface in ("pattern", "white")}


def _words(row: dict[str, Any]) -> str:
    parts = [
        f"{s} {row[s]['dE00_mean']:.2f} / {row[s]['dE00_p95']:.2f} / {row[s]['dE00_max']:.2f}"
        for s in ("pattern", "white")
    ]
    return "mean / 95 % / max  " + "  ".join(parts)


def _draw(title: str, linear: PredictionModel, model: PredictionModel, readings: Any, plan: list[Exposure]) -> None:
    tested, plain = (compare_colors(m, readings, plan) for m in (model, linear))
    picture = accuracy_picture(title, tested, plain, noise_floor(model, readings, plan))
    name = title.replace("virtual bench, ", "").split(" extra")[0].replace(", ", "-").replace(" = ", "")
    Image.fromarray(picture).save(REFERENCE / f"accuracy-{name}.png")


def field_errors(methods: tuple[str, ...]) -> dict[str, Any]:
    """The image-based model against the bench's own light over the whole field, averaged as the model averages."""
    harsh = QUALITIES["harsh"]
    poor_lens = replace(
        QUALITIES["realistic"],
        fall_off=harsh.fall_off,
        blur_centre_px=harsh.blur_centre_px,
        blur_corner_px=harsh.blur_corner_px,
    )
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        installation, bench = captured(Path(folder) / "show", "realistic", poor_lens, kind="image")
        labels = load_captures(installation).labels[2]
        s = installation.settings
        sigma_px = kernel_sigma_px(s.pattern.dot_size_mm * s.projector.resolution[0] / s.projector.width_mm, 2)
        codes = np.random.default_rng(9).integers(0, 256, (FIELD_PROJECTIONS, 2, 3)).astype(np.uint8)
        seen = {
            surface: [
                blurred(bench.view_XYZ(np.vstack([one, np.zeros((254, 3), np.uint8)])[labels], surface), sigma_px)
                for one in codes
            ]
            for surface in ("pattern", "white")
        }
        spectral: PredictionModel | None = None
        for method in methods:
            values = s.model_copy(update={"model": s.model.model_copy(update={"camera_to_XYZ": method})})
            installation = replace(installation, settings=values)
            calibrate(installation)
            model = load_image_model(installation.folder("calibration"))
            if spectral is None:  # at the meter's spot, "readings" is the spectral model
                spectral = spectral_model(installation)
            result[f"image-based, {method}"] = compare_fields(model, codes, seen, spectral.white_point)
        assert spectral is not None
        result["spectral"] = compare_fields(spectral, codes, seen, spectral.white_point)
    for name, row in result.items():
        corners = ", ".join(f"{row[s]['corner_dE00_mean']:.2f}" for s in ("pattern", "white"))
        print(f"virtual bench, realistic with a poor lens, {name}: {_words(row)}  corners {corners}", flush=True)
    return result


def spectral_model(installation: Installation) -> PredictionModel:
    """The model of the meter's spot alone, from the same captures."""
    captures = load_captures(installation)
    readings, _ = correct_drift(captures.readings, captures.plan)
    model = fit_model(readings, captures.plan, ("red", "green", "blue"), ("black", "white"))
    return correct_model(model, readings, captures.plan, linear_only=True)[0]


def blurred(view: NDArray[np.float32], sigma_px: float) -> NDArray[np.float64]:
    """Gaussian mean of a view, (H, W, 3)."""
    weights = gaussian_filter(np.ones(view.shape[:2]), sigma_px, mode="constant")
    planes = [
        gaussian_filter(plane.astype(np.float64), sigma_px, mode="constant") for plane in np.moveaxis(view, -1, 0)
    ]
    return np.stack([plane / weights for plane in planes], axis=-1)


def compare_fields(
    model: PredictionModel,
    codes: NDArray[np.uint8],
    seen: dict[str, list[NDArray[np.float64]]],
    white: NDArray[np.float64],
) -> dict[str, Any]:
    """dE00 of a model at every pixel, each side under its own white, and in the corners."""
    result = {}
    for surface, views in seen.items():
        errors = []
        for one, view in zip(codes, views, strict=True):
            x = model.response.P_to_x(one / 255).ravel()
            own = model.at((slice(None), slice(None))).surfaces[surface].predict_XYZ(x)
            errors.append(
                dE00(XYZ_to_Lab(view, white), XYZ_to_Lab(np.broadcast_to(own, view.shape), model.white_point))
            )
        dE = np.array(errors)
        ends = [slice(0, CORNER_PX), slice(-CORNER_PX, None)]
        corners = np.mean([dE[:, rows, columns].mean() for rows in ends for columns in ends])
        result[surface] = error_figures(dE) | {"corner_dE00_mean": float(corners)}
    return result


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one quality, K = 2, 60 extra readings; write nothing")
    quick = parser.parse_args().quick
    qualities = ("realistic",) if quick else ("realistic", "harsh")
    table: dict[str, Any] = {
        "what": "dE00 between prediction and measurement",
        "measured_on": "virtual bench",
        "projector": SMALL["projector.resolution"],
        "paper": TABLE_I,
    }
    for quality in qualities:
        table[quality] = table_I(quality, COUNTS[:1] if quick else COUNTS, EXTRA[:1] if quick else EXTRA, not quick)
    methods = ("readings",) if quick else ("readings", "sRGB", "AdobeRGB")
    table["realistic with the fall-off and blur of harsh, whole field"] = field_errors(methods)
    if not quick:
        (REFERENCE / "accuracy.json").write_text(json.dumps(rounded(table), indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
