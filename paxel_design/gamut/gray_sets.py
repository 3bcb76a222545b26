"""Exact sub-gamuts that ask the other surface for grays, for one colour, or for the complement (design: section 8).

Each is a `Polytope` of colours of one surface: linear conditions on the joint gamut. What each effect means stands in
``paxel_runtime.model.effects``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.polytopes import Polytope, polytope
from paxel_design.gamut.shadows import shadow_of_body, shadow_of_grays
from paxel_design.gamut.tolerances import ball_about, tube_about_grays
from paxel_runtime.gamut_mapping import luminance_relation
from paxel_runtime.model.prediction import SurfaceModel
from paxel_runtime.model.subgamut import SURFACES

__all__ = ["changing_to_gray", "changing_to_one_colour", "fully_changing"]


def changing_to_one_colour(
    joint: JointGamut, Lab: NDArray[np.float64], XYZ: NDArray[np.float64], tolerance: float, shown_on: str
) -> Polytope:
    """Colours of `shown_on` that go with one colour, (3,) `Lab` = `XYZ`, or with one within `tolerance` (dE00) of it.

    Raises
    ------
    GamutError
        If there are none, or too few to have a volume.
    """
    if not tolerance:
        return joint.section(XYZ, shown_on)
    own, other = _own_and_other(joint, shown_on)
    return shadow_of_body(own, other, ball_about(Lab, tolerance, joint.model.white_point))


def changing_to_gray(joint: JointGamut, lightness: str, tolerance: float, shown_on: str) -> Polytope:
    """Colours of `shown_on` that can turn gray on the other surface.

    Parameters
    ----------
    joint : JointGamut
    lightness : {"free", "relative", "same"}
    tolerance : float
        In dE00, with lightness free.
    shown_on : {"pattern", "white"}

    Raises
    ------
    GamutError
        If there are none, or too few to have a volume.
    """
    own, other = _own_and_other(joint, shown_on)
    white_point = joint.model.white_point
    if lightness == "free" and tolerance:
        brightest = max(float(other.black[1] + np.maximum(other.A[1], 0).sum()), 0.0)
        return shadow_of_body(own, other, tube_about_grays(1.1 * brightest, tolerance, white_point))
    if lightness == "free":
        return shadow_of_grays(own, other, white_point)
    slope, base = luminance_relation(own, other) if lightness == "relative" else (1.0, 0.0)
    normals = joint.rows_of(shown_on)
    # The gray's luminance is slope * Y + base of the colour's own: linear, so the section stays a polytope.
    on_gray = normals[:, 3:] @ white_point
    rows = normals[:, :3] + slope * on_gray[:, None] * np.array([0.0, 1.0, 0.0])
    return polytope(rows, joint.offsets - base * on_gray)


def fully_changing(
    joint: JointGamut, black: NDArray[np.float64], white: NDArray[np.float64], shown_on: str
) -> Polytope:
    """Colours of `shown_on` that go with `black`, with `white` (XYZ of the other surface), and with their complement.

    The complement's light and the colour's own add up to some gray: a linear condition. In CIELAB, which bends straight
    lines through gray, that is the opposite hue but for at most the arcsine of half the sum of the colour's relative
    differences from gray in X and Z: 3 degrees for 5 % of each.

    Raises
    ------
    GamutError
        If there are none, or too few to have a volume.
    """
    reachable = joint.erode(np.stack((black, white)), shown_on)
    opposite = shadow_of_grays(*_own_and_other(joint, shown_on), joint.model.white_point, together=True)
    return polytope(
        np.concatenate((reachable.normals, opposite.normals)), np.concatenate((reachable.offsets, opposite.offsets))
    )


def _own_and_other(joint: JointGamut, shown_on: str) -> tuple[SurfaceModel, SurfaceModel]:
    surfaces = joint.model.surfaces
    return surfaces[shown_on], surfaces[SURFACES[1 - SURFACES.index(shown_on)]]
