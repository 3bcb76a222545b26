"""The devices of an installation: the virtual bench with its print on it, or a folder that a person serves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from paxel_runtime.captures.tethering import FolderDevices
from paxel_runtime.devices.base import Devices
from paxel_runtime.devices.bench_spectra import read_projector_spectra
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import UsageError
from paxel_runtime.installation import Installation
from paxel_runtime.optics.geometry import CameraPose
from paxel_runtime.optics.spectra import PROJECTORS
from paxel_runtime.printed import load_pattern
from paxel_runtime.storage import read_json

__all__ = ["open_bench", "open_devices"]


def open_bench(installation: Installation, **changes: Any) -> VirtualBench:
    """The virtual bench with this installation's print on it; `changes` are fields of `BenchSetup` for this time."""
    return VirtualBench(replace(_bench_setup(installation), **changes))


def _bench_setup(installation: Installation) -> BenchSetup:
    s, p, b = installation.settings, installation.settings.projector, installation.settings.bench
    builtin = p.spectra in PROJECTORS
    return BenchSetup(
        pattern=load_pattern(installation),
        resolution=p.resolution,
        width_mm=p.width_mm,
        channels=p.channels,
        bits=p.bits,
        camera_resolution=s.camera.resolution,
        camera_bits=s.camera.bits,
        aperture_mm=s.meter.aperture_mm,
        quality=b.quality,
        seed=b.seed,
        second_surface="gray" if s.model.second_surface == "gray" else b.white_sheet,
        sheet_distance_mm=b.sheet_distance_mm,
        sheet_tilt_deg=b.sheet_tilt_deg,
        ambient=b.ambient,
        level_spectra=b.level_spectra,
        brightener=b.brightener,
        overprint=b.overprint,
        channel_blur=b.channel_blur,
        responses=p.responses,
        exposure=b.exposure,
        bayer=b.bayer,
        camera_pose=CameraPose(b.camera_pan, b.camera_zoom, b.camera_roll_deg, b.camera_slant),
        projector=p.spectra if builtin else "dlp",
        spectra={} if builtin else read_projector_spectra(installation.path / p.spectra, p.channels),
    )


def open_devices(
    installation: Installation,
    tell: Callable[[str], None] = lambda message: None,
    kind: str = "",
    timeout_s: float | None = None,
) -> Devices | FolderDevices:
    """The devices that `kind` or else ``[devices] kind`` names.

    Parameters
    ----------
    tell : callable, optional
        Given messages for the person at the devices.
    kind : str, optional
        ``"virtual"`` or ``"folder"``; without it that of a session that is under way, or else the setting.
    timeout_s : float, optional
        Seconds to wait for a person before giving up; for ever without it.

    Raises
    ------
    UsageError
        If there is no such kind.
    """
    record = installation.folder("captures") / "exposures.json"
    if not kind and record.is_file() and not (record.parent / "complete.json").is_file():
        kind = read_json(record).get("device", "")
    kind = kind or installation.settings.devices.kind
    if kind == "folder":
        return FolderDevices(tell, timeout_s=timeout_s)
    if kind != "virtual":
        raise UsageError(f"--device must be virtual or folder, got {kind!r}")
    bench = open_bench(installation)
    return Devices(projector=bench, camera=bench, meter=bench, operator=bench)
