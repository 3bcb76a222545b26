"""Effect -> sub-gamut: the colours of a surface that an effect can use, exact, as half-spaces (design: section 8).

The definitions:

- *full*: every colour of the surface, whatever the other surface then shows;
- *neutralize* (to c): colours that can be shown while the other surface shows c. ``shown_on`` is the surface of the
  picture; it vanishes on the other one;
- *dual-image*: one side of the product pair (`product_pair`).

How a set of colours becomes half-spaces stands in `joint`, meshes of them in `meshes`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.lightness import lightness_area
from paxel_design.gamut.meshes import exact_volume
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.effects import DualImage, Effect, Full, Neutralize, parse_effect
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SURFACES, SubGamut

__all__ = ["product_pair", "sub_gamut"]


def sub_gamut(model: PredictionModel | JointGamut, effect: Effect | str, shown_on: str = "pattern") -> SubGamut:
    """The colours of one surface that an effect can use.

    Parameters
    ----------
    model : PredictionModel or JointGamut
        The second saves making the joint gamut anew for each of several effects.
    effect : Effect or str
        An effect, or its text such as ``"neutralize:50,0,0"``.
    shown_on : {"pattern", "white"}
        The surface these colours are shown on.

    Raises
    ------
    InputError
        If the effect or the surface is unknown, or the effect needs two surfaces and the model has one.
    GamutError
        If no colour, or too few to have a volume, can be used (the full gamut may be flat).
    """
    joint = model if isinstance(model, JointGamut) else JointGamut(model)
    effect = parse_effect(effect) if isinstance(effect, str) else effect
    if shown_on not in joint.model.surfaces:
        raise InputError(f"shown_on must be one of {', '.join(joint.model.surfaces)}; got {shown_on!r}")
    if joint.model.white is None and not isinstance(effect, Full):
        raise InputError(f"effect {effect.text} needs a model of two surfaces, got one; with one surface use: full")
    return _MAKERS[type(effect)](joint, effect, shown_on)


def product_pair(joint: JointGamut) -> tuple[SubGamut, SubGamut]:
    """Two sets of colours, one a surface, in which any two pictures can be shown together.

    Begins with the grays of one side of the largest lightness rectangle, takes all colours of the other surface that
    go with them, E(S) = {p : (p, w) in J for all w in S}, and then all colours of the first that go with those. The
    pair is maximal: no colour can be added to either side, and both hold the grays of the rectangle. Of the two
    beginnings, the one with the larger product of volumes in CIELAB is taken.

    Returns
    -------
    on_pattern, on_white : SubGamut

    Raises
    ------
    InputError
        If the model has one surface.
    GamutError
        If the surfaces share no grays to begin with.
    """
    lightness = lightness_area(joint)
    grays = {"pattern": lightness.L_pattern, "white": lightness.L_white}
    pairs = [_closure(joint, grays[begin_on], begin_on) for begin_on in SURFACES]
    return max(pairs, key=lambda pair: exact_volume(pair[0]) * exact_volume(pair[1]))


def _closure(joint: JointGamut, L_range: tuple[float, float], begin_on: str) -> tuple[SubGamut, SubGamut]:
    """The maximal pair that begins with the grays of `L_range` on one surface, the pattern's side first."""
    other = _other(begin_on)
    white_point = joint.model.white_point
    begin = Lab_to_XYZ([(L, 0.0, 0.0) for L in L_range], white_point)
    try:
        partners = joint.erode(begin, other)
        closed = joint.erode(partners.vertices, begin_on)
    except GamutError as error:
        raise GamutError(
            f"the surfaces have no two sets of colours that can always be shown together: {error}; their common "
            f"grays are L* {L_range[0]:.1f} to {L_range[1]:.1f} on the {begin_on}"
        ) from error
    sides = {
        on: SubGamut(DualImage().name, on, side.normals, side.offsets, white_point)
        for on, side in ((begin_on, closed), (other, partners))
    }
    return sides["pattern"], sides["white"]


def _full(joint: JointGamut, effect: Full, shown_on: str) -> SubGamut:
    return SubGamut(effect.name, shown_on, *joint.surface(shown_on), joint.model.white_point)


def _dual_image(joint: JointGamut, effect: DualImage, shown_on: str) -> SubGamut:
    return product_pair(joint)[SURFACES.index(shown_on)]


def _neutralize(joint: JointGamut, effect: Neutralize, shown_on: str) -> SubGamut:
    white_point = joint.model.white_point
    try:
        colors = joint.section(Lab_to_XYZ(effect.Lab, white_point), shown_on)
    except GamutError as error:
        raise GamutError(
            f"effect {effect.text}: no volume of colours on the {shown_on} goes with that colour on the "
            f"{_other(shown_on)} surface: {error}; {_reachable_grays(joint, _other(shown_on))}"
        ) from error
    return SubGamut(effect.name, shown_on, colors.normals, colors.offsets, white_point)


def _reachable_grays(joint: JointGamut, surface: str) -> str:
    """The cure for a colour that cannot be held on a surface: which grays can."""
    try:
        L = lightness_area(joint).polygon[:, SURFACES.index(surface)]
    except GamutError:
        return "no gray is in reach there beside a gray on the other surface"
    return f"beside grays, L* from {L.min():.1f} to {L.max():.1f} is in reach there"


def _other(surface: str) -> str:
    return SURFACES[1 - SURFACES.index(surface)]


_MAKERS: dict[type[Effect], Callable[[JointGamut, Any, str], SubGamut]] = {
    Full: _full,
    DualImage: _dual_image,
    Neutralize: _neutralize,
}
