"""The runtime's stages: read the folder, call the pure functions, write the stage's folder as a whole.

`calibrate`, `project` and `preview` as they stand behind the commands of the same name; `capture` is in
``acquisition.py``. Each returns the figures it wrote. What is up to date is decided by the caller.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration_stage import calibrate
from paxel_runtime.devices.base import Devices
from paxel_runtime.devices.bench_spectra import read_projector_spectra
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import InputError, UsageError
from paxel_runtime.frame_files import read_frame, write_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import observer
from paxel_runtime.model.effects import Effect
from paxel_runtime.model.subgamut import SubGamut, subgamut_from_arrays
from paxel_runtime.observer import eye_sigma_mm, view_figures, view_to_sRGB
from paxel_runtime.optics.geometry import CameraPose
from paxel_runtime.optics.spectra import PROJECTORS
from paxel_runtime.pictures import load_picture
from paxel_runtime.printed import load_pattern
from paxel_runtime.projection import make_projection, picture_surfaces
from paxel_runtime.storage import (
    load_model,
    read_image,
    read_json,
    read_npz,
    write_image,
    write_json,
    write_npz,
)
from paxel_runtime.tethering import FolderDevices

__all__ = [
    "calibrate",
    "load_sub_gamut",
    "open_bench",
    "open_devices",
    "preview",
    "project",
    "projection_inputs",
]

Progress = Callable[[str, int, int], None]


def open_bench(installation: Installation) -> VirtualBench:
    """The virtual bench with this installation's print on it."""
    s, p, b = installation.settings, installation.settings.projector, installation.settings.bench
    builtin = p.spectra in PROJECTORS
    return VirtualBench(
        BenchSetup(
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


def load_sub_gamut(folder: Path, effect: Effect, surface: str) -> SubGamut:
    """A sub-gamut that the design side wrote into ``gamut/``."""
    return subgamut_from_arrays(read_npz(folder / f"{effect.name}.on-{surface}.npz"))


def projection_inputs(installation: Installation, pictures: Mapping[str, Path]) -> dict[str, Any]:
    """What a projection of these source pictures is made from.

    Raises
    ------
    InputError
        If a picture is not there.
    """
    for name, path in pictures.items():
        if not path.is_file():
            raise InputError(f"--{name.replace('_', '-')}: there is no picture {path}")
    return installation.inputs("projection", extra_files={f"picture {name}": p for name, p in pictures.items()})


def project(
    installation: Installation,
    effect: Effect,
    pictures: Mapping[str, Path],
    *,
    name: str = "",
    shown_on: str = "pattern",
    progress: Progress = lambda message, done, total: None,
) -> dict[str, Any]:
    """Make one projection image; writes ``projection/<name>.png`` and its record, and returns the record."""
    name = name or effect.key
    if Path(name).name != name or name.startswith("."):
        raise InputError(f"--name must be a plain file name without folders, got {name!r}; write for example evening-2")
    settings = installation.settings
    width, height = settings.projector.resolution
    surfaces = picture_surfaces(effect, shown_on)
    inputs = projection_inputs(installation, {key: pictures[key] for key in surfaces})
    progress("read pictures", 0, 1)
    projection = make_projection(
        effect,
        {key: load_picture(pictures[key], width, height, settings.mapping.placement) for key in surfaces},
        {surface: load_sub_gamut(installation.folder("gamut"), effect, surface) for surface in surfaces.values()},
        load_model(installation.folder("calibration") / "model.json"),
        read_image(installation.folder("calibration") / "clusters.png"),
        shown_on=shown_on,
        bits=settings.projector.bits,
        chroma=settings.mapping.chroma,
        outside=settings.assembly.outside,
        progress=lambda done, total: progress("solve", done, total),
    )
    record = {
        "name": name,
        "effect": effect.text,
        "shown_on": shown_on,
        "pictures": {key: str(pictures[key]) for key in surfaces},
        "assembly": "dither",
        **projection.figures,
        "inputs": inputs,
    }
    with installation.writing("projection", keep=True) as folder:
        write_frame(folder / f"{name}.png", projection.codes, settings.projector.bits)
        write_npz(folder / f"{name}.npz", **{f"Lab_{surface}": Lab for surface, Lab in projection.Lab.items()})
        write_json(folder / f"{name}.json", record)
    return record


def preview(installation: Installation, name: str, bench: VirtualBench) -> dict[str, Any]:
    """Look at one projection on both surfaces of the virtual bench; writes ``preview/`` and returns the record."""
    source = installation.folder("projection")
    record = read_json(source / f"{name}.json")
    codes = read_frame(source / f"{name}.png", installation.settings.projector.bits)
    mapped = {key.removeprefix("Lab_"): Lab for key, Lab in read_npz(source / f"{name}.npz").items() if key != "writer"}
    model = load_model(installation.folder("calibration") / "model.json")
    settings = installation.settings
    mm_per_px = settings.projector.width_mm / settings.projector.resolution[0]
    sigma_px = eye_sigma_mm(settings.viewing.distance_mm) / mm_per_px
    labels = read_image(installation.folder("calibration") / "clusters.png")

    def seen(frame: NDArray[np.unsignedinteger], surface: str) -> NDArray[np.float32]:
        with observer(settings.model.observer_deg):
            return bench.view_XYZ(frame, surface)

    white_view = seen(np.full_like(codes, 2**settings.projector.bits - 1), "white")

    figures: dict[str, Any] = {}
    with installation.writing("preview", keep=True) as folder:
        for surface, other in (("pattern", "white"), ("white", "pattern")):
            view = seen(codes, surface)
            for suffix, exposure in (("", "fixed"), (".auto", "auto")):
                picture = view_to_sRGB(view, exposure, model.white_point, sigma_px)
                write_image(folder / f"{name}.on-{surface}{suffix}.png", picture)
            if surface in mapped:
                figures[f"on_{surface}"] = view_figures(
                    view,
                    white_view,
                    mapped[surface],
                    _other_picture(mapped, other),
                    model.white_point,
                    sigma_px,
                    labels != 255,
                )
        result = {
            "name": name,
            "effect": record["effect"],
            "seen_on": f"virtual bench, {settings.bench.quality}",
            "distance_mm": settings.viewing.distance_mm,
            **figures,
            "inputs": installation.inputs("preview", stem=name),
        }
        write_json(folder / f"{name}.json", result)
    return result


def _other_picture(mapped: Mapping[str, NDArray[np.float32]], other: str) -> NDArray[np.float32] | None:
    """The picture that may ghost: the other surface's, where it has one that is not a single lightness."""
    return mapped[other] if other in mapped and np.ptp(mapped[other][..., 0]) > 0 else None
