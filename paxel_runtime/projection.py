"""The recipe: pictures -> colours the sub-gamut holds -> inputs x -> projection image (paper: V-A1 to V-A3, V-B).

A list of named steps over the parts that do them; no files, no devices.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.assembly import assemble
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping import map_to_subgamut
from paxel_runtime.inversion import Inversion, invert
from paxel_runtime.model.effects import Effect, Neutralize, require_projectable
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SubGamut

__all__ = ["Projection", "make_projection", "picture_surfaces"]


REACHED_DE00 = 0.01
"""A pixel whose colours differ less than this from the wanted ones on every surface counts as in gamut."""


@dataclass(frozen=True, eq=False)
class Projection:
    """A projection image and what it is meant to show.

    Attributes
    ----------
    codes : (H, W, N) uint8 or uint16 array
        The projection image, device codes.
    Lab : dict of surface -> (H, W, 3) float32 array
        The mapped picture (target) of each surface; a surface that is left free is absent.
    figures : dict
        What mapping and inversion did, for the record.
    """

    codes: NDArray[np.unsignedinteger]
    Lab: dict[str, NDArray[np.float32]]
    figures: dict[str, Any]


def picture_surfaces(effect: Effect, shown_on: str) -> dict[str, str]:
    """Surface on which each picture of an effect is shown, ``{"image": "pattern"}`` or one picture a surface."""
    if effect.pictures == ("image",):
        return {"image": shown_on}
    return {name: name.removeprefix("on_") for name in effect.pictures}


def make_projection(
    effect: Effect,
    pictures: Mapping[str, NDArray[np.float32]],
    sub_gamuts: Mapping[str, SubGamut],
    model: PredictionModel,
    labels: NDArray[np.uint8],
    *,
    shown_on: str = "pattern",
    bits: int = 8,
    chroma: str = "soft",
    outside: str = "black",
    progress: Callable[[int, int], None] | None = None,
) -> Projection:
    """Turn pictures into the projection image of an effect, at native projector resolution.

    Parameters
    ----------
    effect : Effect
    pictures : dict of picture name -> (H, W, 3) float32 array
        CIELAB of the source pictures on the projector's raster; the names are those of ``effect.pictures``.
    sub_gamuts : dict of surface -> SubGamut
        Where each shown picture's colours must lie.
    model : PredictionModel
    labels : (H, W) uint8 array
        Cluster of each projector pixel, 255 = outside the pattern.
    shown_on : "pattern" | "white"
        Surface of the picture, for effects with one.
    bits : int
        Bits of a device code.
    chroma : "soft" | "clip"
    outside : "black" | "white"
    progress : callable, optional
        Told (pixels done, pixels in all).

    Returns
    -------
    Projection

    Raises
    ------
    InputError
        If a picture is missing or has another size than `labels`, or the model has no second surface.
    """
    _check(effect, pictures, model, labels, shown_on)

    # 1. Map each picture into the sub-gamut of its surface (V-A1).
    targets: dict[str, NDArray[np.float32]] = {}
    mapping = {}
    for name, surface in picture_surfaces(effect, shown_on).items():
        mapped = map_to_subgamut(pictures[name], sub_gamuts[surface], chroma=chroma)
        targets[surface], mapping[surface] = mapped.Lab, mapped.figures

    # 2. What the other surface is to show.
    if isinstance(effect, Neutralize):
        hidden_on = "white" if shown_on == "pattern" else "pattern"
        targets[hidden_on] = np.broadcast_to(np.array(effect.Lab, np.float32), (*labels.shape, 3))

    # 3. Inputs for every pixel (Eqs. 5, 7).
    inversion = _invert(targets, model, progress)

    # 4. Every pixel takes its own cluster's part (Eq. 6).
    codes = assemble(inversion.x, labels, model.response, bits, outside=outside)
    return Projection(codes, targets, {"mapping": mapping, **_inversion_figures(inversion)})


def _check(
    effect: Effect,
    pictures: Mapping[str, NDArray[np.float32]],
    model: PredictionModel,
    labels: NDArray[np.uint8],
    shown_on: str,
) -> None:
    require_projectable(effect)
    missing = [name for name in effect.pictures if name not in pictures]
    if missing:
        raise InputError(f"effect {effect.key} needs the pictures {', '.join(effect.pictures)}; missing: {missing}")
    for name in effect.pictures:
        if pictures[name].shape != (*labels.shape, 3):
            raise InputError(
                f"picture {name} must be on the projector's raster {(*labels.shape, 3)}, got {pictures[name].shape}"
            )
    if shown_on not in model.surfaces or (model.white is None and (len(effect.pictures) == 2 or effect.key != "full")):
        raise InputError(
            f"effect {effect.key} shown on {shown_on!r} needs the surfaces pattern and white; "
            f"the model has {', '.join(model.surfaces)}"
        )


def _invert(
    targets: Mapping[str, NDArray[np.float32]],
    model: PredictionModel,
    progress: Callable[[int, int], None] | None,
) -> Inversion:
    """Both surfaces where both have a target; else the one that has, as a model of one surface."""
    if len(targets) == 2:
        return invert(targets["pattern"], targets["white"], model, progress=progress)
    ((surface, Lab),) = targets.items()
    return invert(Lab, None, model.alone(surface), progress=progress)


def _inversion_figures(inversion: Inversion) -> dict[str, Any]:
    dE = inversion.dE_pattern
    if inversion.dE_white is not None:
        dE = np.maximum(dE, inversion.dE_white)
    return {
        "pixels_in_gamut": float(np.mean(dE < REACHED_DE00)),
        "status": inversion.counts(),
        "dE00_max": float(np.max(dE)),
        "dE00_p95": float(np.quantile(dE, 0.95)),
    }
