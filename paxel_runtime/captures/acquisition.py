"""The loop that shows, captures, saves and resumes: the only file with devices AND files.

Every finished picture and reading is kept at once; an interrupted session goes on where it stopped. The geometry is
decoded as soon as its pictures are there, because the readings light single clusters, and because a person should
hear that the projector moved before an hour of readings, not after.

Memory bound: one picture and one frame at a time, plus what decoding needs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration import sort_pixels
from paxel_runtime.calibration.nodal import Normalise
from paxel_runtime.captures.exposures import (
    EXTRA_COUNT,
    Exposure,
    Surface,
    cluster_counts,
    exposure_from_dict,
    exposure_to_dict,
    frame_codes,
    guide_channel,
    plan_geometry,
    plan_readings,
)
from paxel_runtime.captures.honesty import plan_honesty
from paxel_runtime.captures.measurements import append_measurement, read_measurements
from paxel_runtime.captures.meter_positions import at_positions, meter_positions_mm
from paxel_runtime.captures.tethering import FolderDevices, FolderSession, frame_file, load_folder_readings
from paxel_runtime.clustering import cluster_figures
from paxel_runtime.devices.base import Devices
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_linear_sRGB, linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.model.pattern import Colorant
from paxel_runtime.printed import printed_fiducials, printed_pattern
from paxel_runtime.registration import registration_report
from paxel_runtime.settings import Settings
from paxel_runtime.storage import (
    read_image,
    read_json,
    read_npz,
    read_tiff,
    write_image,
    write_json,
    write_npz,
    write_tiff,
)

__all__ = ["CaptureFolder", "capture", "load_captures", "plan_exposures"]

Progress = Callable[[str, int, int], None]

_SURFACES: dict[str, tuple[Surface, ...]] = {
    "white": ("pattern", "white"),
    "gray": ("pattern", "white", "paper"),
    "none": ("pattern",),
}
"""What is looked at, by ``[model] second_surface``."""


@dataclass(frozen=True, eq=False)
class CaptureFolder:
    """A finished session of captures, as `calibrate` reads it.

    Attributes
    ----------
    plan : list of Exposure
    readings : dict of exposure name -> (81,) float64 array
    camera_xy : dict of channel name -> (H, W, 2) float32 array
    valid : (H, W) bool array
    nodal : (H, W, N) float32 array
        Reflectance factor of what each pixel lights, NaN where it is not registered.
    labels : dict of K -> (H, W) uint8 array
    facts : dict
        ``complete.json``: figures of registration and clusters.
    coverage : (H, W, 1 or N, M) uint8 array, optional
        Share of each colorant in each pixel, 255 = all, where pixels were sorted by the printed design.
    """

    plan: list[Exposure]
    readings: dict[str, NDArray[np.float64]]
    camera_xy: dict[str, NDArray[np.float32]]
    valid: NDArray[np.bool_]
    nodal: NDArray[np.float32]
    labels: dict[int, NDArray[np.uint8]]
    facts: dict[str, Any]
    coverage: NDArray[np.uint8] | None = None


def plan_exposures(installation: Installation) -> list[Exposure]:
    """Every exposure of an installation, in the order of capture: geometry first."""
    settings = installation.settings
    counts = cluster_counts(settings.clusters.count, len(settings.pattern.colorants))
    surfaces = _SURFACES[settings.model.second_surface]
    channels, bits = settings.projector.channels, settings.projector.bits
    readings = plan_readings(
        channels,
        counts,
        bits=bits,
        seed=settings.bench.seed,
        surfaces=surfaces,
        extra=EXTRA_COUNT if settings.model.correction == "auto" else 0,
        ramps=settings.model.ramps,
    )
    readings = at_positions(readings, settings.meter.positions, settings.clusters.count)
    width, height = settings.projector.resolution
    shorter_mm = settings.projector.width_mm * min(1.0, height / width)
    uniform: Surface = "white" if "white" in surfaces else "pattern"
    honesty = plan_honesty(channels, uniform, bits=bits, spot_share=settings.meter.aperture_mm / shorter_mm)
    place = next(i for i, e in enumerate(readings) if e.surface == uniform)
    geometry = plan_geometry(channels, (width, height), surfaces, settings.light.method)
    return [*geometry, *readings[:place], *honesty, *readings[place:]]


def capture(
    installation: Installation, devices: Devices | FolderDevices, progress: Progress, *, force: bool = False
) -> dict[str, Any]:
    """Show, capture and save every exposure that is not there yet.

    Parameters
    ----------
    devices : Devices or FolderDevices
        What shows and looks; a session is not continued with the other kind, but started anew.
    progress : callable
        Told what is done, and how much of how much.
    force : bool
        Start anew although nothing changed; the old captures are kept as ``captures-<n>``.

    Returns
    -------
    dict
        Figures of the session, as in ``captures/complete.json``.
    """
    folder = installation.folder("captures")
    inputs = installation.inputs("captures")
    plan = plan_exposures(installation)
    by_folder = isinstance(devices, FolderDevices)
    record = folder / "exposures.json"
    described = {"inputs": inputs, "device": "folder" if by_folder else "virtual"}
    if folder.is_dir() and (force or not record.is_file() or not _is_same(read_json(record), described)):
        folder.rename(_free_name(folder))
    folder.mkdir(exist_ok=True)
    frames = {"frames": [f"{frame_file(n, e)}.png" for n, e in enumerate(plan, 1)]} if by_folder else {}
    write_json(record, {**described, "exposures": [exposure_to_dict(e) for e in plan], **frames})

    geometry = [e for e in plan if e.device == "camera" and not e.clusters and not e.mask]
    readings = [e for e in plan if e.device == "meter" or e.clusters or e.mask]
    session: FolderSession | _Session
    if isinstance(devices, FolderDevices):
        session = FolderSession(installation, devices, folder, progress, plan)
    else:
        session = _Session(installation, devices, folder, progress, len(plan))
    session.take(geometry, labels={})
    sorting = _sort(installation, folder, lambda message: progress(message, session.done, len(plan)))
    session.take(readings, labels={int(K): read_image(folder / f"clusters-K{K}.png") for K in sorting["clusters"]})

    facts = {
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "pictures": sum(e.device == "camera" for e in plan),
        "readings": sum(e.device == "meter" for e in plan),
        "bench": "own devices" if by_folder else f"virtual bench, {installation.settings.bench.quality}",
        "registration": sorting["registration"],
        "registration_report": sorting.get("registration_report", {}),
        "clusters": sorting["clusters"],
        "design": sorting["design"],
        "cross_check": sorting["cross_check"],
    }
    write_json(folder / "complete.json", facts)
    return facts


def load_captures(installation: Installation) -> CaptureFolder:
    """Read what a finished session left.

    Raises
    ------
    InstallationError
        If a file is missing or damaged.
    """
    folder = installation.folder("captures")
    facts = read_json(folder / "complete.json")
    record = read_json(folder / "exposures.json")
    plan = [exposure_from_dict(e) for e in record["exposures"]]
    coverage = folder / "coverages.npz"
    by_folder, table = record.get("device") == "folder", folder / "measurements.csv"
    tables = read_npz(folder / "registration.npz")
    prefix = "camera_xy_"
    return CaptureFolder(
        plan=plan,
        readings=load_folder_readings(table, plan) if by_folder else read_measurements(table),
        camera_xy={name.removeprefix(prefix): a for name, a in tables.items() if name.startswith(prefix)},
        valid=tables["valid"],
        nodal=tables["nodal"],
        labels={int(K): read_image(folder / f"clusters-K{K}.png") for K in facts["clusters"]},
        facts=facts,
        coverage=read_npz(coverage)["coverage"] if coverage.is_file() else None,
    )


class _Session:
    """One run through the plan: skips what is saved, saves what it takes, counts for the progress bar."""

    def __init__(
        self, installation: Installation, devices: Devices, folder: Path, progress: Progress, total: int
    ) -> None:
        self.settings = installation.settings
        self.devices = devices
        self.folder = folder
        self.progress = progress
        self.total = total
        self.done = 0
        self.surface = ""
        self.position: int | None = None  # of a session that goes on, nobody knows where the meter was left
        self.positions_mm = meter_positions_mm(installation.settings)
        self.measurements = folder / "measurements.csv"
        self.measured = set(read_measurements(self.measurements))

    def take(self, exposures: Iterable[Exposure], labels: dict[int, NDArray[np.uint8]]) -> None:
        """Take every exposure that is not saved yet."""
        for exposure in exposures:
            if not self._is_saved(exposure):
                self._show(exposure, labels)
                self._save(exposure)
            self.done += 1
            self.progress(f"{exposure.surface}: {exposure.device}", self.done, self.total)

    def _is_saved(self, exposure: Exposure) -> bool:
        if exposure.device == "meter":
            return exposure.name in self.measured
        return (self.folder / f"{exposure.name}.tif").is_file()

    def _show(self, exposure: Exposure, labels: dict[int, NDArray[np.uint8]]) -> None:
        if exposure.surface != self.surface:
            self.devices.operator.place(exposure.surface)
            self.surface = exposure.surface
        projector = self.settings.projector
        codes = frame_codes(exposure, projector.channels, projector.resolution, projector.bits, labels)
        self.devices.projector.show(codes)

    def _save(self, exposure: Exposure) -> None:
        if exposure.device == "meter":
            if exposure.position != self.position:
                self.devices.operator.aim(self.positions_mm[exposure.position])
                self.position = exposure.position
            append_measurement(self.measurements, exposure.name, exposure.surface, self.devices.meter.measure())
            self.measured.add(exposure.name)
        else:
            picture = self.devices.camera.capture(exposure.channel or None)
            write_tiff(self.folder / f"{exposure.name}.tif", picture)


def _sort(installation: Installation, folder: Path, progress: Callable[[str], None]) -> dict[str, Any]:
    """Sort the pixels once, and keep the result beside the captures: the readings that follow are made with it.

    Returns the figures, as in ``captures/sorting.json``.
    """
    record = folder / "sorting.json"
    if record.is_file():
        return read_json(record)
    settings = installation.settings
    projector, pattern = settings.projector, printed_pattern(installation)
    sorting = sort_pixels(
        lambda name: read_tiff(folder / f"{name}.tif"),
        projector.channels,
        projector.resolution,
        _expected_colors(settings, pattern.library),
        cluster_counts(settings.clusters.count, len(settings.pattern.colorants)),
        pattern.dot_size_mm * float(np.mean(pattern.print_scale)) * projector.resolution[0] / projector.width_mm,
        progress,
        normalise=_normalisation(settings),
        space=settings.clusters.space,
        pattern=pattern if settings.clusters.method == "design" else None,
        method=settings.light.method,
        table=settings.registration.table,
        corners_px=settings.clusters.corners_px,
        fiducials=printed_fiducials(installation),
    )
    report, pictures = registration_report(sorting.registration, sorting.verdicts, guide_channel(projector.channels))
    for name, picture in pictures.items():
        write_image(folder / f"{name}.png", picture)
    write_npz(
        folder / "registration.npz",
        valid=sorting.valid,
        nodal=sorting.nodal,
        **{f"camera_xy_{name}": table.camera_xy for name, table in sorting.registration.items()},
        **{f"residual_rms_px_{name}": table.residuals.rms_px for name, table in sorting.registration.items()},
    )
    if sorting.coverage is not None:
        write_npz(folder / "coverages.npz", coverage=sorting.coverage)
    for K, clusters in sorting.clusters.items():
        write_image(folder / f"clusters-K{K}.png", clusters.labels)
    figures = {
        "registration": {
            name: {"verdict": ": ".join(sorting.verdicts[name]), **table.figures}
            for name, table in sorting.registration.items()
        },
        "registration_report": report,
        "clusters": {str(K): cluster_figures(c, settings.pattern.colorants) for K, c in sorting.clusters.items()},
        "design": sorting.design,
        "cross_check": {
            str(K): {"agreement": a.share, "matrix": a.matrix.tolist(), "both": a.both}
            for K, a in sorting.cross_check.items()
        },
    }
    write_json(record, figures)
    return figures


def _expected_colors(settings: Settings, library: Mapping[str, Colorant]) -> dict[str, NDArray[np.float64]]:
    """XYZ of each colorant as `_normalisation` leaves it: a reflectance, or each plane's light over its brightest."""
    inks = {name: library[name] for name in settings.pattern.colorants}
    if _normalisation(settings) != "field":
        white_Y = spectra_to_XYZ(library["white"].reflectance)[1]
        return {name: spectra_to_XYZ(ink.reflectance) / white_Y * D65_XYZ for name, ink in inks.items()}
    if set(settings.projector.channels) == {"uv"}:
        light = [
            np.zeros_like(ink.reflectance) if ink.fluorescence is None else ink.fluorescence.emission
            for ink in inks.values()
        ]
    else:
        light = [ink.reflectance for ink in inks.values()]
    planes = np.maximum(XYZ_to_linear_sRGB(spectra_to_XYZ(np.array(light))), 0.0)
    planes /= np.maximum(planes.max(axis=0), 1e-12)
    return dict(zip(inks, linear_sRGB_to_XYZ(planes).astype(np.float64), strict=True))


def _normalisation(settings: Settings) -> Normalise:
    """What nodal images are divided by: white paper, unless there is none or it does not shine under the light."""
    if settings.model.second_surface == "none" or set(settings.projector.channels) == {"uv"}:
        return "field"
    return "paper" if settings.model.second_surface == "gray" else "white"


def _is_same(before: dict[str, Any], now: dict[str, Any]) -> bool:
    """Whether a session was started from the same inputs with the same kind of devices."""
    return before.get("inputs") == now["inputs"] and before.get("device", "virtual") == now["device"]


def _free_name(folder: Path) -> Path:
    """``captures-<n>`` with the first free n."""
    n = 1
    while (free := folder.with_name(f"{folder.name}-{n}")).exists():
        n += 1
    return free
