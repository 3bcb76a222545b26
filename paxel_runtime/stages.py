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

from paxel_runtime.acquisition import load_captures
from paxel_runtime.calibration import field_ratios, fit_model, prediction_error
from paxel_runtime.clustering import label_picture
from paxel_runtime.devices.base import Devices
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB
from paxel_runtime.model.effects import Effect
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.pattern_json import pattern_from_json_dict
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SubGamut
from paxel_runtime.observer import eye_sigma_mm, view_figures, view_to_sRGB
from paxel_runtime.pictures import load_picture
from paxel_runtime.projection import make_projection, picture_surfaces
from paxel_runtime.storage import (
    file_sha256,
    load_model,
    model_to_dict,
    read_image,
    read_json,
    read_npz,
    read_tiff,
    write_image,
    write_json,
    write_npz,
    write_text,
)

__all__ = [
    "calibrate",
    "load_pattern",
    "load_sub_gamut",
    "open_bench",
    "open_devices",
    "preview",
    "project",
    "projection_inputs",
]

Progress = Callable[[str, int, int], None]


def load_pattern(installation: Installation) -> Pattern:
    """The pattern as it was printed.

    Raises
    ------
    InstallationError
        If a file of the print stage is missing, or ``cells.png`` is not the one ``pattern.json`` was written with.
    """
    folder = installation.folder("print")
    description = read_json(folder / "pattern.json")
    if description.get("cells", {}).get("sha256") != file_sha256(folder / "cells.png"):
        raise InstallationError(
            f"{folder / 'cells.png'} is not the one that pattern.json describes; "
            f"run: paxel pattern {installation.path} --force"
        )
    return pattern_from_json_dict(description, read_image(folder / "cells.png"))


def open_bench(installation: Installation) -> VirtualBench:
    """The virtual bench with this installation's print on it."""
    s = installation.settings
    return VirtualBench(
        BenchSetup(
            pattern=load_pattern(installation),
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


def open_devices(installation: Installation) -> Devices:
    """The devices that ``[devices] kind`` names."""
    bench = open_bench(installation)
    return Devices(projector=bench, camera=bench, meter=bench, operator=bench)


def calibrate(installation: Installation) -> dict[str, Any]:
    """Fit the prediction model and test it; writes ``calibration/`` and returns ``accuracy.json``."""
    captures = load_captures(installation)
    channels = installation.settings.projector.channels
    K = installation.settings.clusters.count
    models, errors = {}, {}
    for count in captures.labels:
        names = tuple(captures.facts["clusters"][str(count)]["names"])
        models[count] = fit_model(captures.readings, captures.plan, channels, names)
        errors[count] = prediction_error(models[count], captures.readings, captures.plan)
    own = {surface: errors[K][surface] for surface in models[K].surfaces}
    accuracy = {
        "n": errors[K]["n"],
        "model": "linear",
        "measured_on": captures.facts["bench"],
        **own,
        "linear": own,
        "other_K": {
            str(count): {surface: errors[count][surface] for surface in models[count].surfaces}
            for count in models
            if count != K
        },
    }
    ratios = field_ratios(
        lambda name: read_tiff(installation.folder("captures") / f"{name}.tif"),
        captures.plan,
        channels,
        captures.camera_xy,
        captures.labels[K] != 255,
        models[K].clusters,
    )
    with installation.writing("calibration") as folder:
        write_json(folder / "accuracy.json", accuracy)
        write_json(folder / "model.json", model_to_dict(models[K]))
        write_text(folder / "response.csv", _response_table(models[K]))
        write_npz(
            folder / "registration.npz",
            valid=captures.valid,
            **{f"camera_xy_{name}": table for name, table in captures.camera_xy.items()},
        )
        names = models[K].clusters
        write_image(folder / "clusters.png", captures.labels[K])
        write_image(folder / "cluster-map.png", label_picture(captures.labels[K], names))
        write_image(folder / "nodal.png", _nodal_picture(captures.nodal))
        write_json(
            folder / "calibration.json",
            {
                "inputs": installation.inputs("calibration"),
                "accuracy": accuracy,
                "registration": captures.facts["registration"],
                "clusters": captures.facts["clusters"],
                "field_ratios": ratios,
            },
        )
    return accuracy


def load_sub_gamut(folder: Path, effect: Effect, surface: str) -> SubGamut:
    """A sub-gamut that the design side wrote into ``gamut/``."""
    data = read_npz(folder / f"{effect.name}.on-{surface}.npz")
    return SubGamut(effect.name, surface, data["normals"], data["offsets"], data["white_point"])


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
        write_image(folder / f"{name}.png", projection.codes.astype(np.uint8))
        write_npz(folder / f"{name}.npz", **{f"Lab_{surface}": Lab for surface, Lab in projection.Lab.items()})
        write_json(folder / f"{name}.json", record)
    return record


def preview(installation: Installation, name: str, bench: VirtualBench) -> dict[str, Any]:
    """Look at one projection on both surfaces of the virtual bench; writes ``preview/`` and returns the record."""
    source = installation.folder("projection")
    record = read_json(source / f"{name}.json")
    codes = read_image(source / f"{name}.png")
    mapped = {key.removeprefix("Lab_"): Lab for key, Lab in read_npz(source / f"{name}.npz").items() if key != "writer"}
    model = load_model(installation.folder("calibration") / "model.json")
    settings = installation.settings
    mm_per_px = settings.projector.width_mm / settings.projector.resolution[0]
    sigma_px = eye_sigma_mm(settings.viewing.distance_mm) / mm_per_px
    labels = read_image(installation.folder("calibration") / "clusters.png")
    white_view = bench.view_XYZ(np.full_like(codes, 2**settings.projector.bits - 1), "white")

    figures: dict[str, Any] = {}
    with installation.writing("preview", keep=True) as folder:
        for surface, other in (("pattern", "white"), ("white", "pattern")):
            view = bench.view_XYZ(codes, surface)
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


def _response_table(model: PredictionModel) -> str:
    """``response.csv``: device value and linear intensity of every measured step, two columns a channel."""
    header = [f"{name}_{kind}" for name in model.channels for kind in ("P", "x")]
    columns = [column for pair in zip(model.response.code, model.response.linear, strict=True) for column in pair]
    rows = [",".join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([",".join(header), *rows]) + "\n"


def _nodal_picture(nodal: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The nodal images as one sRGB picture."""
    return np.rint(255 * np.clip(linear_sRGB_to_sRGB(np.nan_to_num(nodal)), 0, 1)).astype(np.uint8)
