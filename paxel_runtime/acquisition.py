"""The loop that shows, captures, saves and resumes: the only file with devices AND files.

Every finished picture and reading is kept at once; an interrupted session goes on where it stopped. The geometry is
decoded as soon as its pictures are there, because the readings light single clusters, and because a person should
hear that the projector moved before an hour of readings, not after.

Memory bound: one picture and one frame at a time, plus what decoding needs.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration import sort_pixels
from paxel_runtime.devices.base import Devices
from paxel_runtime.errors import InstallationError
from paxel_runtime.exposures import (
    Exposure,
    cluster_counts,
    exposure_from_dict,
    exposure_to_dict,
    frame_codes,
    plan_geometry,
    plan_readings,
)
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.storage import (
    read_image,
    read_json,
    read_npz,
    read_tiff,
    write_atomically,
    write_image,
    write_json,
    write_npz,
    write_tiff,
)

__all__ = ["CaptureFolder", "capture", "load_captures", "plan_exposures"]

Progress = Callable[[str, int, int], None]


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
    """

    plan: list[Exposure]
    readings: dict[str, NDArray[np.float64]]
    camera_xy: dict[str, NDArray[np.float32]]
    valid: NDArray[np.bool_]
    nodal: NDArray[np.float32]
    labels: dict[int, NDArray[np.uint8]]
    facts: dict[str, Any]


def plan_exposures(installation: Installation) -> list[Exposure]:
    """Every exposure of an installation, in the order of capture: geometry first."""
    settings = installation.settings
    counts = cluster_counts(settings.clusters.count, len(settings.pattern.colorants))
    return plan_geometry(settings.projector.channels, settings.projector.resolution) + plan_readings(
        settings.projector.channels,
        counts,
        bits=settings.projector.bits,
        seed=settings.bench.seed,
        surfaces=("pattern", "white"),
    )


def capture(installation: Installation, devices: Devices, progress: Progress, *, force: bool = False) -> dict[str, Any]:
    """Show, capture and save every exposure that is not there yet.

    Parameters
    ----------
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
    record = folder / "exposures.json"
    if folder.is_dir() and (force or not record.is_file() or read_json(record).get("inputs") != inputs):
        folder.rename(_free_name(folder))
    folder.mkdir(exist_ok=True)
    write_json(record, {"inputs": inputs, "exposures": [exposure_to_dict(e) for e in plan]})

    geometry = [e for e in plan if e.device == "camera" and not e.clusters]
    readings = [e for e in plan if e.device == "meter" or e.clusters]
    session = _Session(installation, devices, folder, progress, len(plan))
    session.take(geometry, labels={})
    sorting = _sort(installation, folder, lambda message: progress(message, session.done, len(plan)))
    session.take(readings, labels={int(K): read_image(folder / f"clusters-K{K}.png") for K in sorting["clusters"]})

    facts = {
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "pictures": sum(e.device == "camera" for e in plan),
        "readings": sum(e.device == "meter" for e in plan),
        "bench": f"virtual bench, {installation.settings.bench.quality}",
        "registration": sorting["registration"],
        "clusters": sorting["clusters"],
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
    plan = [exposure_from_dict(e) for e in read_json(folder / "exposures.json")["exposures"]]
    tables = read_npz(folder / "registration.npz")
    prefix = "camera_xy_"
    return CaptureFolder(
        plan=plan,
        readings=_read_measurements(folder / "measurements.csv"),
        camera_xy={name.removeprefix(prefix): a for name, a in tables.items() if name.startswith(prefix)},
        valid=tables["valid"],
        nodal=tables["nodal"],
        labels={int(K): read_image(folder / f"clusters-K{K}.png") for K in facts["clusters"]},
        facts=facts,
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
        self.measurements = folder / "measurements.csv"
        self.measured = set(_read_measurements(self.measurements))

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
            _append_measurement(self.measurements, exposure, self.devices.meter.measure())
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
    colorants = colorant_library()
    white_Y = spectra_to_XYZ(colorants["white"].reflectance)[1]
    sorting = sort_pixels(
        lambda name: read_tiff(folder / f"{name}.tif"),
        settings.projector.channels,
        settings.projector.resolution,
        {name: spectra_to_XYZ(colorants[name].reflectance) / white_Y * D65_XYZ for name in settings.pattern.colorants},
        cluster_counts(settings.clusters.count, len(settings.pattern.colorants)),
        settings.pattern.dot_size_mm * settings.projector.resolution[0] / settings.projector.width_mm,
        progress,
    )
    write_npz(
        folder / "registration.npz",
        valid=sorting.valid,
        nodal=sorting.nodal,
        **{f"camera_xy_{name}": table.camera_xy for name, table in sorting.registration.items()},
    )
    for K, clusters in sorting.clusters.items():
        write_image(folder / f"clusters-K{K}.png", clusters.labels)
    figures = {
        "registration": {
            name: {"verdict": ": ".join(sorting.verdicts[name]), **table.figures}
            for name, table in sorting.registration.items()
        },
        "clusters": {
            str(K): {"names": list(c.names), "shares": [float(s) for s in c.shares]}
            for K, c in sorting.clusters.items()
        },
    }
    write_json(record, figures)
    return figures


def _append_measurement(path: Path, exposure: Exposure, spectrum: NDArray[np.float64]) -> None:
    """Add one reading; a line that a kill cuts short is dropped when the file is read again."""
    if not path.exists():
        header = ["exposure", "surface", *(f"{w:g}" for w in WAVELENGTHS_NM)]
        write_atomically(path, lambda p: p.write_text(",".join(header) + "\n", encoding="utf-8"))
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(
        [exposure.name, exposure.surface, *(f"{value:.9g}" for value in spectrum)]
    )
    with path.open("a", encoding="utf-8") as file:
        file.write(line.getvalue())


def _read_measurements(path: Path) -> dict[str, NDArray[np.float64]]:
    """Readings by exposure name; an unfinished last line is cut off the file.

    Raises
    ------
    InstallationError
        If a finished line does not hold one number a wavelength.
    """
    if not path.is_file():
        return {}
    text = path.read_text(encoding="utf-8")
    if not text.endswith("\n"):
        text = text[: text.rfind("\n") + 1]
        write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))
    readings = {}
    for number, row in enumerate(csv.reader(text.splitlines()), 1):
        if number == 1:
            continue
        try:
            name, _, *values = row
            readings[name] = np.array(values, dtype=np.float64)
        except ValueError as error:
            raise InstallationError(f"{path}, line {number}: not a reading ({error})") from None
        if readings[name].shape != WAVELENGTHS_NM.shape:
            raise InstallationError(
                f"{path}, line {number}: a reading needs {len(WAVELENGTHS_NM)} numbers, got {len(values)}"
            )
    return readings


def _free_name(folder: Path) -> Path:
    """``captures-<n>`` with the first free n."""
    n = 1
    while (free := folder.with_name(f"{folder.name}-{n}")).exists():
        n += 1
    return free
