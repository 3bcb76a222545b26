"""The recipe: pictures -> colours both surfaces can show -> inputs x -> projection image (paper: V-A1 to V-A3, V-B).

A list of named steps over the parts that do them; no files, no devices:

1. *wanted*: which picture goes to which surface, and what the effect asks of the surface without one (`effects`);
2. *mapping*: colours -> colours that can be shown there at once (`gamut_mapping`);
3. *inversion*: inputs x for every pixel, and the pair of colours that x shows (`inversion`): what lies outside the
   joint gamut is moved into it, and how far is reported;
4. *assembly*: every pixel takes what its own cluster is to show (`assembly`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.assembly import AssemblyOptions, assemble
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping import (
    AdaptiveOptions,
    MappingOptions,
    local_white,
    luminance_relation,
    map_pair,
    map_to_subgamut,
    map_with_partner,
    seen_from,
    under_light,
)
from paxel_runtime.inversion import Inversion, invert
from paxel_runtime.model.effects import EFFECTS, Effect, Neutralize, Partner
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SURFACES, PairGamut, SubGamut

__all__ = ["Projection", "make_projection", "picture_surfaces", "require_surfaces"]


REACHED_DE00 = 0.01
"""A pixel whose colours differ less than this from the wanted ones on every surface counts as in gamut."""

_ROWS_AT_ONCE = 128

Pictures = dict[str, NDArray[np.float32]]
"""CIELAB (H, W, 3) by surface."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Projection:
    """A projection image and what it is meant to show.

    Attributes
    ----------
    codes : (H, W, N) uint8 or uint16 array
        The projection image, device codes.
    Lab : dict of surface -> (H, W, 3) float32 array
        The target of each surface: the mapped picture, moved into the joint gamut where it was outside; a surface
        that is left free is absent.
    figures : dict
        What mapping and inversion did, for the record.
    """

    codes: NDArray[np.unsignedinteger]
    Lab: Pictures
    figures: dict[str, Any]


def picture_surfaces(effect: Effect, shown_on: str) -> dict[str, str]:
    """Surface on which each picture of an effect is shown, ``{"image": "pattern"}`` or one picture a surface.

    A mark is no picture of its own: it changes what the other surface shows.
    """
    if "image" in effect.pictures:
        return {"image": shown_on}
    return {name: name.removeprefix("on_") for name in effect.pictures}


def require_surfaces(effect: Effect, shown_on: str, model: PredictionModel) -> None:
    """Check that a model has the surfaces that an effect needs.

    Raises
    ------
    InputError
        Naming the effects that it is enough for.
    """
    if shown_on not in model.surfaces or len(model.surfaces) < effect.surfaces:
        able = ", ".join(key for key, row in EFFECTS.items() if row.surfaces <= len(model.surfaces))
        raise InputError(
            f"effect {effect.key} shown on {shown_on!r} needs the surfaces pattern and white; the model has "
            f"{', '.join(model.surfaces)}, which is enough for: {able}"
        )


def make_projection(
    effect: Effect,
    pictures: Mapping[str, NDArray[np.float32]],
    sub_gamuts: Mapping[str, SubGamut],
    model: PredictionModel,
    labels: NDArray[np.uint8],
    *,
    pairs: PairGamut | None = None,
    shown_on: str = "pattern",
    bits: int = 8,
    local: PredictionModel | None = None,
    mapping: MappingOptions | None = None,
    adaptive: AdaptiveOptions | None = None,
    assembly: AssemblyOptions | None = None,
    progress: Progress | None = None,
) -> Projection:
    """Turn pictures into the projection image of an effect, at native projector resolution.

    Parameters
    ----------
    effect : Effect
    pictures : dict of picture name -> (H, W, 3) float32 array
        CIELAB of the source pictures on the projector's raster; the names are those of ``effect.pictures``.
    sub_gamuts : dict of surface -> SubGamut
        Where each shown picture's colours must lie, where ``effect.in_sub_gamut``.
    model : PredictionModel
    labels : (H, W) uint8 array
        Cluster of each projector pixel, 255 = outside the pattern.
    pairs : PairGamut, optional
        The joint gamut; effects with a partner and adaptive mapping need it.
    shown_on : "pattern" | "white"
        Surface of the picture, for effects with one.
    bits : int
        Bits of a device code.
    local : PredictionModel, optional
        The image-based form of `model`, which is then its median: each pixel is solved with its own A, under its own
        light.
    mapping : MappingOptions, optional
    adaptive : AdaptiveOptions, optional
        Map two pictures together where that gains contrast; None = each for itself.
    assembly : AssemblyOptions, optional
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
    # 1. What is wanted: a picture on each surface that has one, and what the effect asks of the other.
    _check(effect, pictures, model, labels, shown_on)
    wanted = {surface: pictures[name] for name, surface in picture_surfaces(effect, shown_on).items()}
    # 2. Mapping (V-A1): each surface's target.
    options = mapping or MappingOptions()
    if effect.partner is not None:
        mark = pictures["mark"][..., 0] if "mark" in effect.pictures else None
        sub_gamut = sub_gamuts[shown_on] if effect.in_sub_gamut else None
        targets, mapped = _map_with_partner(effect.partner, wanted, mark, sub_gamut, pairs, model, options)
    else:
        targets, mapped = _map_pictures(effect, wanted, sub_gamuts, options, pairs, adaptive, _shown(labels))
    # 3. Inversion (Eqs. 5, 7): inputs for every pixel, and the pairs of colours that they show.
    if local is None:
        inversion = _invert(targets, model, progress)
        targets, moved = _reachable(targets, inversion, model)
    else:
        shares, white = local_white(local, model), model.white_point
        lit = {surface: under_light(Lab, shares, white) for surface, Lab in targets.items()}
        inversion = _invert(lit, local, progress)
        lit, moved = _reachable(lit, inversion, local)
        targets = {surface: under_light(Lab, 1 / shares, white) for surface, Lab in lit.items()}
    # 4. Assembly (Eq. 6).
    seen = model if local is None else local
    if len(targets) == 1:
        seen = seen.alone(next(iter(targets)))
    codes, assembled = assemble(inversion.x, labels, seen, bits, assembly or AssemblyOptions())
    figures = {"mapping": mapped, **_inversion_figures(inversion), "targets_moved": moved, "assembly": assembled}
    return Projection(codes, targets, figures)


def _check(
    effect: Effect,
    pictures: Mapping[str, NDArray[np.float32]],
    model: PredictionModel,
    labels: NDArray[np.uint8],
    shown_on: str,
) -> None:
    require_surfaces(effect, shown_on, model)
    missing = [name for name in effect.pictures if name not in pictures]
    if missing:
        raise InputError(f"effect {effect.key} needs the pictures {', '.join(effect.pictures)}; missing: {missing}")
    for name in effect.pictures:
        if pictures[name].shape != (*labels.shape[:2], 3):
            raise InputError(
                f"picture {name} must be on the projector's raster {(*labels.shape[:2], 3)}, got {pictures[name].shape}"
            )


def _shown(labels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Pixels that light the pattern in some channel, (H, W)."""
    return np.asarray(np.any(np.atleast_3d(labels) != 255, axis=2))


def _map_pictures(
    effect: Effect,
    wanted: Pictures,
    sub_gamuts: Mapping[str, SubGamut],
    options: MappingOptions,
    pairs: PairGamut | None,
    adaptive: AdaptiveOptions | None,
    shown: NDArray[np.bool_],
) -> tuple[Pictures, dict[str, Any]]:
    """Each picture in the sub-gamut of its surface, or two pictures together; a uniform colour where one hides."""
    mapped = {surface: map_to_subgamut(picture, sub_gamuts[surface], options) for surface, picture in wanted.items()}
    targets = {surface: one.Lab for surface, one in mapped.items()}
    figures: dict[str, Any] = {surface: one.figures for surface, one in mapped.items()}
    if len(wanted) == 2 and adaptive is None:
        figures |= {"method": "static", "why": "as asked"}
    elif len(wanted) == 2 and adaptive is not None:
        if pairs is None:
            raise InputError("adaptive mapping needs the joint gamut: make_projection(..., pairs=...)")
        on_pattern, on_white = SURFACES
        pair = map_pair(
            (wanted[on_pattern], wanted[on_white]), (mapped[on_pattern], mapped[on_white]), pairs, adaptive, mask=shown
        )
        targets = dict(zip(SURFACES, pair.Lab, strict=True))
        figures |= {"method": pair.method, "why": pair.why, "adaptive": pair.figures}
    if isinstance(effect, Neutralize):
        ((shown_on, picture),) = wanted.items()
        targets[_other(shown_on)] = np.broadcast_to(np.array(effect.Lab, np.float32), picture.shape)
    return targets, figures


def _map_with_partner(
    partner: Partner,
    wanted: Pictures,
    mark: NDArray[np.float32] | None,
    sub_gamut: SubGamut | None,
    pairs: PairGamut | None,
    model: PredictionModel,
    options: MappingOptions,
) -> tuple[Pictures, dict[str, Any]]:
    """The picture and its partner, whose pairs of colours lie in the joint gamut; and the mapping's figures."""
    if pairs is None:
        raise InputError("an effect with a partner needs the joint gamut: make_projection(..., pairs=...)")
    ((shown_on, picture),) = wanted.items()
    relation = luminance_relation(model.surfaces[shown_on], model.surfaces[_other(shown_on)])
    seen = seen_from(pairs, shown_on, sub_gamut)
    mapped = map_with_partner(picture, partner, seen, relation, options, mark=mark)
    return {shown_on: mapped.Lab, _other(shown_on): mapped.Lab_other}, {shown_on: mapped.figures}


def _other(surface: str) -> str:
    return SURFACES[1 - SURFACES.index(surface)]


def _invert(targets: Pictures, model: PredictionModel, progress: Progress | None) -> Inversion:
    """Both surfaces where both have a target; else the one that has, as a model of one surface."""
    if len(targets) == 2:
        return invert(targets["pattern"], targets["white"], model, progress=progress)
    ((surface, Lab),) = targets.items()
    return invert(Lab, None, model.alone(surface), progress=progress)


def _reachable(
    targets: Pictures, inversion: Inversion, model: PredictionModel
) -> tuple[Pictures, dict[str, dict[str, float]]]:
    """The targets moved into the joint gamut: what x shows where it misses the wanted colours; and how far they moved.

    Targets that x meets stay as they are, so that rounding in x does not get into them.
    """
    if len(targets) == 1:
        (surface,) = targets
        model, dE = model.alone(surface), {surface: inversion.dE_pattern}
    else:
        assert inversion.dE_white is not None
        dE = {"pattern": inversion.dE_pattern, "white": inversion.dE_white}
    missed = np.maximum.reduce(list(dE.values())) >= REACHED_DE00
    reached = {surface: np.array(targets[surface]) for surface in dE} if np.any(missed) else targets
    for first in range(0, len(missed), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        if not np.any(missed[rows]):
            continue
        shown = model.at((rows, slice(None))).predict(inversion.x[rows])
        for surface, Lab in zip(dE, shown, strict=False):
            assert Lab is not None
            reached[surface][rows][missed[rows]] = Lab[missed[rows]]
    return reached, {surface: _moved_figures(values) for surface, values in dE.items()}


def _moved_figures(dE: NDArray[np.floating]) -> dict[str, float]:
    """How far the targets of one surface lay outside the joint gamut, dE00."""
    return {
        "pixels": float(np.mean(dE >= REACHED_DE00)),
        "dE00_mean": float(np.mean(dE, dtype=np.float64)),
        "dE00_p95": float(np.quantile(dE, 0.95)),
        "dE00_max": float(np.max(dE)),
    }


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
