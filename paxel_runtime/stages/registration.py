"""The stage behind `paxel register --quick`: one picture of one frame moves the lookup tables after a bump.

The print does not move in the camera's picture, so that what each camera pixel sees of it stays known: the captures on
disk, read at the light's new places, tell which colorant every projector pixel lights now.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration import nodal_reflectance, nodal_to_linear_sRGB, sort_by_design
from paxel_runtime.captures.acquisition import CaptureFolder, load_captures
from paxel_runtime.captures.exposures import exposure_name, guide_channel
from paxel_runtime.clustering import label_picture
from paxel_runtime.devices.base import Camera, Projector
from paxel_runtime.devices.photographs import read_photograph, to_one_plane
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.frame_files import write_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.printed import printed_pattern
from paxel_runtime.registration import ChannelRegistration, quick_frame, register_quick
from paxel_runtime.registration.residuals import no_residuals
from paxel_runtime.stages.coverages import coverage_of_pixels
from paxel_runtime.storage import read_npz, read_tiff, write_image, write_json, write_npz, write_tiff

__all__ = ["QUICK_FRAME", "quick_codes", "relabel", "run_quick_registration", "take_quick_picture", "write_quick_frame"]

QUICK_FRAME = "quick-frame.png"
"""The frame to photograph, in the installation's folder, where no device shows it."""
_OUTSIDE = 255


def quick_codes(installation: Installation) -> NDArray[np.uint16]:
    """Device codes (H, W, N) of the frame to show: random blocks in the guide channel."""
    projector = installation.settings.projector
    width, height = projector.resolution
    codes = np.zeros((height, width, len(projector.channels)), np.uint16)
    top = np.uint16(2**projector.bits - 1)
    codes[..., projector.channels.index(guide_channel(projector.channels))] = quick_frame(width, height) * top
    return codes


def take_quick_picture(installation: Installation, projector: Projector, camera: Camera) -> NDArray[np.uint16]:
    """Show the frame and take its picture, (h, w)."""
    projector.show(quick_codes(installation))
    return camera.capture(guide_channel(installation.settings.projector.channels))


def write_quick_frame(installation: Installation) -> Path:
    """Write the frame for a person to show and photograph, as for the structured light."""
    path = installation.path / QUICK_FRAME
    write_frame(path, quick_codes(installation), installation.settings.projector.bits)
    return path


def run_quick_registration(installation: Installation, picture: NDArray[np.uint16] | Path) -> dict[str, Any]:
    """Move the lookup tables to where a picture shows the light, and sort the pixels anew.

    Writes ``registration.npz``, ``coverages.npz``, ``clusters.png``, ``cluster-map.png``, ``quick.json`` and
    ``quick.tif`` into ``calibration/``; the model stays, as it speaks of clusters, not of places. Nothing is written
    unless the warp suffices.

    Parameters
    ----------
    picture : (h, w) uint16 array or Path
        Of the frame of `quick_codes`, from where the captures were taken, with the same exposure.

    Returns
    -------
    dict
        ``quick.json``: the figures of `QuickRegistration`, and ``relabelled``, the share of pixels that changed their
        cluster.

    Raises
    ------
    CalibrationError
        If the frame is not found, or the warp does not suffice.
    InputError
        If the picture's size is not that of the captures.
    """
    if isinstance(picture, Path):
        picture = to_one_plane(read_photograph(picture))
    captures = load_captures(installation)
    channels, folder = installation.settings.projector.channels, installation.folder("captures")
    guide = guide_channel(channels)
    full, dark = (
        read_tiff(folder / f"{exposure_name('pattern', level, guide, channels)}.tif").astype(np.float32)
        for level in ("full", "dark")
    )
    if picture.shape != full.shape:
        raise InputError(
            f"the picture must have the captures' {full.shape[1]} x {full.shape[0]} pixels, got "
            f"{' x '.join(str(length) for length in picture.shape[1::-1])}: use the same camera with the same setting"
        )
    quick = register_quick(picture - dark, full - dark, captures.camera_xy[guide], captures.valid)
    if not quick.figures["suffices"]:
        raise CalibrationError(
            f"a warp does not suffice: it leaves displacements of {quick.figures['residual_p95_px']:.2f} projector "
            "pixels (95 % of the blocks): did the camera move, the sheet bend, or the zoom turn? "
            f"Run: paxel capture {installation.path} --force"
        )
    moved = {name: quick.moved(table) for name, table in captures.camera_xy.items()}
    nodal, labels, coverage = _sort_moved(installation, captures, moved)
    K = installation.settings.clusters.count
    known = (labels != _OUTSIDE) & (captures.labels[K] != _OUTSIDE)
    figures = {**quick.figures, "relabelled": float(np.mean(labels[known] != captures.labels[K][known]))}
    names = tuple(captures.facts["clusters"][str(K)]["names"])
    with installation.writing("calibration", keep=True) as target:
        write_npz(
            target / "registration.npz",
            valid=np.asarray(np.isfinite(nodal).all(axis=-1)),
            **{f"camera_xy_{name}": table for name, table in moved.items()},
        )
        write_npz(target / "coverages.npz", coverage=coverage, point_spread=_known_spread(target, len(channels)))
        write_image(target / "clusters.png", labels)
        write_image(target / "cluster-map.png", label_picture(labels, names))
        write_tiff(target / "quick.tif", picture)
        write_json(target / "quick.json", figures)
    return figures


def _known_spread(calibration: Path, channels: int) -> NDArray[np.float64]:
    """The projector's point spread as calibration found it; a bump does not change it."""
    file = calibration / "coverages.npz"
    return read_npz(file)["point_spread"] if file.is_file() else np.zeros((channels, 6))


def _sort_moved(
    installation: Installation, captures: CaptureFolder, moved: Mapping[str, NDArray[np.float32]]
) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.uint8]]:
    """Nodal images, labels and coverages of the pixels at their new places, sorted as the installation sorts them."""
    settings, folder = installation.settings, installation.folder("captures")
    channels, K = settings.projector.channels, settings.clusters.count
    tables = {name: _table(table, captures.valid) for name, table in moved.items()}
    normalise: Literal["white", "paper"] = "paper" if settings.model.second_surface == "gray" else "white"

    def read(name: str) -> NDArray[np.uint16]:
        return read_tiff(folder / f"{name}.tif")

    nodal = nodal_reflectance(read, channels, tables, normalise=normalise)
    if settings.clusters.method != "design":
        labels = relabel(captures.nodal, captures.labels[K], nodal)
        return nodal, labels, coverage_of_pixels(installation, nodal, labels, moved, captures.valid)
    pattern = printed_pattern(installation)
    white_Y = spectra_to_XYZ(pattern.library["white"].reflectance)[1]
    clusters, _, coverage = sort_by_design(
        read,
        tables[guide_channel(channels)],
        captures.valid & np.isfinite(nodal).all(axis=-1),
        linear_sRGB_to_XYZ(nodal_to_linear_sRGB(nodal, channels)).astype(np.float32),
        {n: spectra_to_XYZ(pattern.library[n].reflectance) / white_Y * D65_XYZ for n in pattern.colorants},
        (K,),
        pattern.dot_size_mm
        * float(np.mean(pattern.print_scale))
        * settings.projector.resolution[0]
        / settings.projector.width_mm,
        pattern,
        normalise=normalise,
        corners_px=settings.clusters.corners_px,
        tables=[moved[name] for name in channels],
    )
    return nodal, clusters[K].labels, coverage


def _table(camera_xy: NDArray[np.float32], valid: NDArray[np.bool_]) -> ChannelRegistration:
    return ChannelRegistration(camera_xy, valid, {}, no_residuals())


def relabel(nodal: NDArray[np.float32], labels: NDArray[np.uint8], moved: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Labels of new nodal images by the clusters' mean signals in the old ones; 255 where a pixel is unknown.

    Parameters
    ----------
    nodal, moved : (H, W, C) float32 arrays
        Old and new nodal images, NaN where unknown.
    labels : (H, W) uint8 array
        Of the old ones, 255 outside.
    """
    # a square root spreads dark inks about as CIELAB does
    before, after = (np.sqrt(np.maximum(picture, 0.0)) for picture in (nodal, moved))
    centres = np.stack([before[labels == k].mean(axis=0) for k in range(int(labels[labels != _OUTSIDE].max()) + 1)])
    distance = np.stack([np.sum((after - centre) ** 2, axis=-1) for centre in centres])
    known = np.isfinite(moved).all(axis=-1)
    return np.where(known, np.argmin(np.where(known, distance, 0.0), axis=0), _OUTSIDE).astype(np.uint8)
