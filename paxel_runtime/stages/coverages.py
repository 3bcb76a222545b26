"""``calibration/coverages.npz``: what assembly has to know about every single pixel, from the captures on disk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration.coverage import channels_differ, coverage_from_nodal
from paxel_runtime.calibration.point_spread import line_blur, line_captures
from paxel_runtime.captures.acquisition import CaptureFolder
from paxel_runtime.installation import Installation
from paxel_runtime.storage import read_tiff

__all__ = ["coverage_of_pixels", "coverages_and_figures", "point_spread_of"]


def coverages_and_figures(
    installation: Installation, captures: CaptureFolder
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays of ``coverages.npz`` and what to record of them.

    Returns
    -------
    arrays : dict
        ``coverage`` (H, W, 1 or N, M) uint8, 255 = all; ``point_spread`` (N, 6) float64, variance in projector px^2 as
        `assembly.spread_coverage` takes it, zeros where it is not known.
    figures : dict
    """
    coverage = captures.coverage
    if coverage is None:
        labels = captures.labels[installation.settings.clusters.count]
        coverage = coverage_of_pixels(installation, captures.nodal, labels, captures.camera_xy, captures.valid)
    spread = point_spread_of(installation, captures)
    figures = {
        "from": "nodal images" if captures.coverage is None else "design",
        "planes": coverage.shape[2],
        "point_spread": "not measured" if spread is None else spread.tolist(),
    }
    channels = len(installation.settings.projector.channels)
    return {"coverage": coverage, "point_spread": np.zeros((channels, 6)) if spread is None else spread}, figures


def coverage_of_pixels(
    installation: Installation,
    nodal: NDArray[np.float32],
    labels: NDArray[np.uint8],
    camera_xy: Mapping[str, NDArray[np.float32]],
    valid: NDArray[np.bool_],
) -> NDArray[np.uint8]:
    """Coverage read off nodal images, where the printed design is not registered."""
    tables = list(camera_xy.values())
    by_channel = len(tables) > 1 and channels_differ(tables, valid)
    return coverage_from_nodal(nodal, labels, len(installation.settings.pattern.colorants), by_channel=by_channel)


def point_spread_of(installation: Installation, captures: CaptureFolder) -> NDArray[np.float64] | None:
    """Variance of the projector's blur in each channel, (N, 6); None where no shifted lines were captured.

    What the lines' blur has from camera and paper is the same everywhere. It is known where the design was registered;
    else it is taken as what there is in the middle: nodal images are about as blurred by it as pixels by the projector.
    """
    folder, channels = installation.folder("captures"), installation.settings.projector.channels
    rows = []
    for j, channel in enumerate(channels):
        if not all((folder / f"{name}.tif").is_file() for name in line_captures(channel)):
            return None
        table = captures.camera_xy[channel]
        row = line_blur(lambda name: read_tiff(folder / f"{name}.tif"), channel, table, captures.nodal[..., j])
        if not np.all(np.isfinite(row)):
            return None
        row[0] -= row[0] if captures.coverage is None else _static_variance(installation, captures, table)
        rows.append(row)
    return np.array(rows)


def _static_variance(installation: Installation, captures: CaptureFolder, camera_xy: NDArray[np.float32]) -> float:
    """What camera and paper add to the variance of a line, projector px^2, as the registered design tells."""
    projector, figures = installation.settings.projector, captures.facts["design"]
    pitch_px = float(np.nanmedian(np.hypot(*np.moveaxis(np.diff(camera_xy, axis=1), -1, 0))))
    scattering_px = figures["scattering_um"] / 1000 * projector.resolution[0] / projector.width_mm
    return float((figures["camera_blur_px"] / pitch_px) ** 2 + scattering_px**2)
