"""The stage behind `paxel preview`: looks at a projection on both surfaces of the bench, writes ``preview/``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.frame_files import read_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import observer
from paxel_runtime.observer import eye_sigma_mm, view_figures, view_to_sRGB
from paxel_runtime.storage import load_model, read_image, read_json, read_npz, write_image, write_json

__all__ = ["preview"]


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
