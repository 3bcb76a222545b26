"""The stage behind `paxel calibrate`: reads ``captures/``, calls the pure functions, writes ``calibration/`` whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration import (
    CameraToXYZ,
    ComparedColors,
    NodalImages,
    accuracy_picture,
    camera_to_XYZ,
    compare_colors,
    correct_model,
    error_by_input,
    field_ratios,
    fit_model,
    image_fields,
    kernel_sigma_px,
    moved_to_mean,
    nodal_to_linear_sRGB,
    noise_floor,
    position_spread,
    prediction_error,
    spot_of_meter,
)
from paxel_runtime.calibration.checks import aperture_warning
from paxel_runtime.calibration.drift import correct_drift
from paxel_runtime.calibration.white_point import WHITES, brightest_of_chromaticity, with_white_point
from paxel_runtime.captures.acquisition import CaptureFolder, load_captures
from paxel_runtime.captures.exposures import guide_channel
from paxel_runtime.captures.honesty import honesty_figures, judge
from paxel_runtime.captures.meter_positions import meter_positions_mm
from paxel_runtime.captures.readings import load_readings, match_to_plan
from paxel_runtime.clustering import label_detail, label_picture
from paxel_runtime.installation import Installation
from paxel_runtime.model.cam16 import CAM16_UCS_difference
from paxel_runtime.model.colorimetry import Lab_to_XYZ, linear_sRGB_to_sRGB, observer
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model_image import FOLDER, median_model, write_model_image
from paxel_runtime.stages.coverages import coverages_and_figures
from paxel_runtime.storage import model_to_dict, read_image, read_tiff, write_image, write_json, write_npz, write_text

__all__ = ["calibrate"]

_OUTSIDE = 255

Progress = Callable[[str], None]


def calibrate(
    installation: Installation, progress: Progress = lambda message: None, *, readings_file: Path | None = None
) -> dict[str, Any]:
    """Fit the prediction model and test it; writes ``calibration/`` and returns ``accuracy.json``.

    Parameters
    ----------
    readings_file : Path, optional
        Readings that take the place of those of the same name in the captures, in any format of `load_readings`.
    progress : callable, optional
        Told what is being done.
    """
    with observer(installation.settings.model.observer_deg):
        return _calibrate(installation, progress, readings_file)


def _calibrate(installation: Installation, progress: Progress, readings_file: Path | None) -> dict[str, Any]:
    captures = load_captures(installation)
    settings = installation.settings
    aperture = aperture_warning(
        settings.meter.aperture_mm, settings.pattern.dot_size_mm, len(settings.pattern.colorants)
    )
    as_read = captures.readings
    if readings_file is not None:
        as_read = as_read | match_to_plan(load_readings(readings_file), captures.plan)
    readings, drift = correct_drift(as_read, captures.plan)
    captures = replace(captures, readings=readings)
    K, image_based = settings.clusters.count, settings.model.kind == "image"
    progress("fit the model")
    fits = {count: _fit(captures, installation, count) for count in captures.labels}
    model, fitted = fits.pop(K), None
    centre = model
    if settings.model.correction == "auto":
        progress("fit the correction")
        model, fitted = correct_model(model, captures.readings, captures.plan, linear_only=image_based)
    if settings.meter.positions > 1 and not image_based:  # pictures tell themselves how the field differs
        model = moved_to_mean(model, centre, _fit(captures, installation, K, everywhere=True))
    images, conversion, measured_white = _images(installation, captures, model), None, model.white_point
    if image_based:
        progress("relate the camera to XYZ")
        conversion = camera_to_XYZ(images, settings.model.camera_to_XYZ, _spot(installation, images), model)
        model = replace(
            model,
            pattern=conversion.spot["pattern"],
            white=conversion.spot.get("white"),
            white_point=conversion.white_point,
        )
    accuracy = _accuracy(captures, model, fits, settings.model.kind, measured_white)
    if fitted is not None:
        accuracy["extra_readings"] = fitted
    findings = judge(
        as_read,
        model.channels,
        "pattern" if model.white is None else "white",
        images.captures if any(e.name == "honest-columns" for e in captures.plan) else None,
        captures.camera_xy[guide_channel(model.channels)],
    )
    progress("look at the field")
    ratios = field_ratios(
        images.captures, captures.plan, model.channels, captures.camera_xy, images.inside, model.clusters
    )
    progress("look at the pixels")
    coverages, of_pixels = coverages_and_figures(installation, captures)
    with installation.writing("calibration") as folder:
        write_npz(folder / "coverages.npz", **coverages)
        description = model_to_dict(_under_white(model, settings.model.white))
        if conversion is not None:
            description = _write_model_image(installation, images, conversion, model, folder, progress)
        write_json(folder / "model.json", description)
        write_json(folder / "accuracy.json", accuracy)
        write_image(folder / "accuracy.png", _accuracy_picture(captures, model, measured_white))
        write_text(folder / "response.csv", _response_table(model))
        write_npz(
            folder / "registration.npz",
            valid=captures.valid,
            **{f"camera_xy_{name}": table for name, table in captures.camera_xy.items()},
        )
        if (picture := installation.folder("captures") / "registration.png").is_file():
            write_image(folder / "registration.png", read_image(picture))
        write_image(folder / "clusters.png", captures.labels[K])
        write_image(folder / "cluster-map.png", label_picture(captures.labels[K], model.clusters))
        write_image(folder / "cluster-map-detail.png", label_detail(captures.labels[K], model.clusters))
        write_image(folder / "nodal.png", _nodal_picture(nodal_to_linear_sRGB(captures.nodal, model.channels)))
        write_json(
            folder / "calibration.json",
            {
                "inputs": installation.inputs("calibration"),
                "accuracy": accuracy,
                "registration": captures.facts["registration"],
                "registration_report": captures.facts.get("registration_report", {}),
                "clusters": captures.facts["clusters"],
                "coverages": of_pixels,
                "cross_check": captures.facts.get("cross_check", {}),
                "field_ratios": ratios,
                "honesty": honesty_figures(findings),
                "drift": drift,
                "positions": position_spread(
                    captures.readings, captures.plan, model.channels, K, meter_positions_mm(settings)
                ),
                "readings_from": str(readings_file) if readings_file else "captures/measurements.csv",
                "warnings": [text for text in [aperture] if text],
            },
        )
    return accuracy


def _under_white(model: PredictionModel, white: str | tuple[float, float]) -> PredictionModel:
    """The model under the white that ``[model] white`` names."""
    if white == "full":
        return model
    xy = WHITES[white] if isinstance(white, str) else white
    return with_white_point(model, brightest_of_chromaticity(model, xy)[0])


def _fit(
    captures: CaptureFolder, installation: Installation, count: int, *, everywhere: bool = False
) -> PredictionModel:
    """The linear model of one K, of the centre or of all positions of the meter."""
    names = tuple(captures.facts["clusters"][str(count)]["names"])
    folder = installation.folder("captures")
    return fit_model(
        captures.readings,
        [e for e in captures.plan if everywhere or e.position == 0],
        installation.settings.projector.channels,
        names,
        curve=installation.settings.model.response,
        captures=lambda name: read_tiff(folder / f"{name}.tif"),
    )


def _accuracy(
    captures: CaptureFolder,
    model: PredictionModel,
    others: dict[int, PredictionModel],
    kind: str,
    measured_white: NDArray[np.float64],
) -> dict[str, Any]:
    """``accuracy.json`` (design: section 4), and beside it what `prediction_error` knows more."""
    tested = compare_colors(model, captures.readings, captures.plan, measured_white)
    errors = prediction_error(model, captures.readings, captures.plan, measured_white)
    linear = prediction_error(model.linear, captures.readings, captures.plan, measured_white)
    return {
        "n": errors["n"],
        "model": "linear" if model.correction is None else "corrected",
        "kind": kind,
        "measured_on": captures.facts["bench"],
        **{surface: errors[surface] for surface in model.surfaces},
        "linear": {surface: linear[surface] for surface in model.surfaces},
        "CAM16_UCS": {surface: _CAM16_figures(colors, measured_white) for surface, colors in tested.items()},
        "by_input": error_by_input(model, tested),
        "noise_floor": noise_floor(model, captures.readings, captures.plan),
        "other_K": {str(count): _other(captures, other) for count, other in others.items()},
    }


def _CAM16_figures(colors: ComparedColors, white_point: NDArray[np.float64]) -> dict[str, float]:
    """The same errors in CAM16-UCS, a second opinion beside dE00."""
    XYZ = [Lab_to_XYZ(Lab, white_point) for Lab in (colors.measured_Lab, colors.predicted_Lab)]
    dE = CAM16_UCS_difference(XYZ[0], XYZ[1], white_point)
    return {"dE_mean": float(dE.mean()), "dE_p95": float(np.quantile(dE, 0.95)), "dE_max": float(dE.max())}


def _other(captures: CaptureFolder, model: PredictionModel) -> dict[str, Any]:
    errors = prediction_error(model, captures.readings, captures.plan)
    return {surface: errors[surface] for surface in model.surfaces}


def _images(installation: Installation, captures: CaptureFolder, model: PredictionModel) -> NodalImages:
    folder = installation.folder("captures")
    return NodalImages(
        lambda name: read_tiff(folder / f"{name}.tif"),
        tuple(captures.plan),
        model.channels,
        model.clusters,
        captures.camera_xy,
        captures.labels[len(model.clusters)] != _OUTSIDE,
    )


def _px_per_mm(installation: Installation) -> float:
    projector = installation.settings.projector
    return projector.resolution[0] / projector.width_mm


def _spot(installation: Installation, images: NodalImages) -> tuple[tuple[slice, slice], NDArray[np.float64]]:
    height, width = images.inside.shape
    return spot_of_meter((height, width), installation.settings.meter.aperture_mm * _px_per_mm(installation))


def _write_model_image(
    installation: Installation,
    images: NodalImages,
    conversion: CameraToXYZ,
    model: PredictionModel,
    folder: Path,
    progress: Progress,
) -> dict[str, Any]:
    """``model-image/``; returns what ``model.json`` holds beside it: the median over the pattern."""
    pattern = installation.settings.pattern
    sigma_px = kernel_sigma_px(pattern.dot_size_mm * _px_per_mm(installation), len(pattern.colorants))
    write_model_image(folder, image_fields(images, conversion, sigma_px, progress), model.n)
    return model_to_dict(median_model(model, folder, images.inside)) | {
        "image": FOLDER,
        "camera_to_XYZ": installation.settings.model.camera_to_XYZ,
        "kernel_sigma_px": sigma_px,
    }


def _accuracy_picture(
    captures: CaptureFolder, model: PredictionModel, measured_white: NDArray[np.float64]
) -> NDArray[np.uint8]:
    return accuracy_picture(
        f"prediction and measurement, K = {len(model.clusters)}, {captures.facts['bench']}",
        compare_colors(model, captures.readings, captures.plan, measured_white),
        compare_colors(model.linear, captures.readings, captures.plan, measured_white),
        noise_floor(model, captures.readings, captures.plan),
    )


def _response_table(model: PredictionModel) -> str:
    """``response.csv``: device value and linear intensity of every measured step, two columns a channel."""
    header = [f"{name}_{kind}" for name in model.channels for kind in ("P", "x")]
    columns = [column for pair in zip(model.response.code, model.response.linear, strict=True) for column in pair]
    rows = [",".join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([",".join(header), *rows]) + "\n"


def _nodal_picture(nodal: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The nodal images as one sRGB picture."""
    return np.rint(255 * np.clip(linear_sRGB_to_sRGB(np.nan_to_num(nodal)), 0, 1)).astype(np.uint8)
