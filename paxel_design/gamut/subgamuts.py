"""Effect -> sub-gamut: the colours of a surface that an effect can use (design: section 8).

What each effect asks for is defined in ``paxel_runtime.model.effects``. All sets are exact polytopes but those of hue
shifts, of changes of chroma and of watermarks, which are level sets: a field on a grid. How a set is made stands in
`joint`, `gray_sets`, `products` and `level_sets`; the table at the end says which effect is made by which.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from paxel_design.gamut.gray_sets import changing_to_gray, changing_to_one_colour, fully_changing
from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.level_sets import STEP, LevelSet, level_set, level_set_mesh
from paxel_design.gamut.lightness import lightness_area
from paxel_design.gamut.margins import Margins, chroma_margins, hue_margins
from paxel_design.gamut.meshes import GamutMesh, gamut_mesh
from paxel_design.gamut.polytopes import Polytope
from paxel_design.gamut.products import product_pair
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.effects import (
    EFFECTS,
    Chroma,
    Decolorize,
    DualImage,
    Effect,
    Full,
    FullChange,
    HueShift,
    Monochrome,
    Neutralize,
    Watermark,
    parse_effect,
)
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SURFACES, SubGamut

__all__ = ["sub_gamut", "subgamut_and_mesh"]


def sub_gamut(
    model: PredictionModel | JointGamut, effect: Effect | str, shown_on: str = "pattern", *, step: float = STEP
) -> SubGamut:
    """The colours of one surface that an effect can use.

    Parameters
    ----------
    model : PredictionModel or JointGamut
        The second saves making the joint gamut anew for each of several effects.
    effect : Effect or str
        An effect, or its text such as ``"neutralize:50,0,0"``.
    shown_on : {"pattern", "white"}
        The surface these colours are shown on.
    step : float
        Distance of the nodes where a level set's margin is asked, CIELAB units; its field has half of that.

    Raises
    ------
    InputError
        If the effect or the surface is unknown, or the effect needs two surfaces and the model has one.
    GamutError
        If no colour, or too few to have a volume, can be used (the full gamut may be flat).
    """
    joint, effect = _checked(model, effect, shown_on)
    if type(effect) in _MARGINS:
        return _level_set(joint, effect, shown_on, step).gamut
    try:
        return _EXACT[type(effect)](joint, effect, shown_on)
    except GamutError as error:
        raise GamutError(f"effect {effect.text} shown on the {shown_on}: {error}") from error


def subgamut_and_mesh(
    model: PredictionModel | JointGamut, effect: Effect | str, shown_on: str = "pattern", *, step: float = STEP
) -> tuple[SubGamut, GamutMesh]:
    """A sub-gamut as `sub_gamut` makes it, and its closed surface; a level set's vertices lie on its true boundary.

    Raises
    ------
    InputError, GamutError
        As `sub_gamut`, and where the surface does not close.
    """
    joint, effect = _checked(model, effect, shown_on)
    if type(effect) in _MARGINS:
        level = _level_set(joint, effect, shown_on, step)
        return level.gamut, level_set_mesh(level)
    gamut = sub_gamut(joint, effect, shown_on, step=step)
    return gamut, gamut_mesh(gamut)


def _level_set(joint: JointGamut, effect: Effect, shown_on: str, step: float) -> LevelSet:
    margins = _MARGINS[type(effect)](joint.model, effect, shown_on)
    return level_set(_full(joint, Full(), shown_on), effect.name, margins, step)


def _checked(model: PredictionModel | JointGamut, effect: Effect | str, shown_on: str) -> tuple[JointGamut, Effect]:
    joint = model if isinstance(model, JointGamut) else JointGamut(model)
    effect = parse_effect(effect) if isinstance(effect, str) else effect
    if shown_on not in joint.model.surfaces:
        raise InputError(f"shown_on must be one of {', '.join(joint.model.surfaces)}; got {shown_on!r}")
    if effect.surfaces > len(joint.model.surfaces):
        able = ", ".join(key for key, row in EFFECTS.items() if row.surfaces == 1)
        raise InputError(f"effect {effect.text} needs a model of two surfaces, got one; with one surface use: {able}")
    return joint, effect


def _full(joint: JointGamut, effect: Full | Monochrome, shown_on: str) -> SubGamut:
    return SubGamut(effect.name, shown_on, *joint.surface(shown_on), joint.model.white_point)


def _dual_image(joint: JointGamut, effect: DualImage, shown_on: str) -> SubGamut:
    return product_pair(joint, effect.pair)[SURFACES.index(shown_on)]


def _decolorize(joint: JointGamut, effect: Decolorize, shown_on: str) -> SubGamut:
    try:
        return _named(joint, effect, shown_on, changing_to_gray(joint, effect.lightness, effect.tolerance, shown_on))
    except GamutError as error:
        if effect.lightness == "free":
            raise
        raise GamutError(f"{error}; with lightness free the gray may be darker or lighter: decolorize:free") from error


def _neutralize(joint: JointGamut, effect: Neutralize, shown_on: str) -> SubGamut:
    Lab = np.array(effect.Lab)
    XYZ = np.asarray(Lab_to_XYZ(Lab, joint.model.white_point), np.float64)
    try:
        return _named(joint, effect, shown_on, changing_to_one_colour(joint, Lab, XYZ, effect.tolerance, shown_on))
    except GamutError as error:
        raise GamutError(
            f"no volume of colours goes with that colour on the {_other(shown_on)} surface: {error}; "
            f"{_reachable_grays(joint, _other(shown_on))}"
        ) from error


def _full_change(joint: JointGamut, effect: FullChange, shown_on: str) -> SubGamut:
    if effect.L_black is not None and effect.L_white is not None:
        ends = (effect.L_black, effect.L_white)
    else:
        lightness = lightness_area(joint)
        ends = lightness.L_white if shown_on == "pattern" else lightness.L_pattern
    black, white = np.asarray(Lab_to_XYZ([(L, 0.0, 0.0) for L in ends], joint.model.white_point), np.float64)
    try:
        return _named(joint, effect, shown_on, fully_changing(joint, black, white, shown_on))
    except GamutError as error:
        raise GamutError(
            f"black L* {ends[0]:.1f} and white L* {ends[1]:.1f} on the {_other(shown_on)} surface leave no colours: "
            f"{error}; {_reachable_grays(joint, _other(shown_on))}"
        ) from error


def _named(joint: JointGamut, effect: Effect, shown_on: str, colors: Polytope) -> SubGamut:
    return SubGamut(effect.name, shown_on, colors.normals, colors.offsets, joint.model.white_point)


def _reachable_grays(joint: JointGamut, surface: str) -> str:
    """The cure for a colour that cannot be held on a surface: which grays can."""
    try:
        L = lightness_area(joint).polygon[:, SURFACES.index(surface)]
    except GamutError:
        return "no gray is in reach there beside a gray on the other surface"
    return f"beside grays, L* from {L.min():.1f} to {L.max():.1f} is in reach there"


def _other(surface: str) -> str:
    return SURFACES[1 - SURFACES.index(surface)]


_EXACT: dict[type[Effect], Callable[[JointGamut, Any, str], SubGamut]] = {
    Full: _full,
    Monochrome: _full,
    DualImage: _dual_image,
    Decolorize: _decolorize,
    Neutralize: _neutralize,
    FullChange: _full_change,
}
_MARGINS: dict[type[Effect], Callable[[PredictionModel, Any, str], Margins]] = {
    HueShift: hue_margins,
    Chroma: chroma_margins,
    Watermark: lambda model, effect, shown_on: chroma_margins(model, Chroma(scale=1.0), shown_on),
}
