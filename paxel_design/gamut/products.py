"""Product pairs: two sets of colours, one a surface, of which every colour of one goes with every colour of the other.

E(S) = {p : (p, w) in J for all w in S}. From any set S that has partners at all, (E(S), E(E(S))) is a pair that is
maximal: no colour can be added to either side. What differs is S. The *closure* begins with the grays of the largest
lightness rectangle. The *maximised* pairs search over the ends of the gray segment on one surface and a chroma about
it, for the largest product of both volumes or the largest smaller lightness range.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.lightness import lightness_area
from paxel_design.gamut.meshes import hull_volume
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.effects import DualImage
from paxel_runtime.model.subgamut import SURFACES, SubGamut

__all__ = ["product_pair"]

_LOPSIDED = 0.1
"""Smaller volume over larger below which the closure is no use for two pictures, and the search is made."""

_ROUNDS = 3
_SEARCH_EDGE = 16.0
"""Edge of the triangles by which the search compares volumes, CIELAB: to a percent."""

_FIRST_STEP_L, _FIRST_STEP_C = 6.0, 4.0
_LARGEST_CHROMA = 30.0

_MOVES = np.array(
    [
        (1, 0, 0),
        (-1, 0, 0),
        (0, 1, 0),
        (0, -1, 0),
        (0, 0, 1),
        (0, 0, -1),
        (1, 1, 0),
        (-1, -1, 0),
        (1, -1, 0),
        (-1, 1, 0),
    ]
)
"""Of (lower end, upper end, chroma), in steps: each alone, the segment as a whole, and narrower or wider."""


@dataclass(frozen=True, eq=False)
class _Pair:
    on_pattern: SubGamut
    on_white: SubGamut
    volumes: tuple[float, float]

    @property
    def contrast(self) -> float:
        """The smaller of both lightness ranges."""
        ranges = [side.gray_range() for side in (self.on_pattern, self.on_white)]
        return min(high - low for low, high in ranges)


_AIMS: dict[str, Callable[[_Pair], float]] = {
    "volume": lambda pair: pair.volumes[0] * pair.volumes[1],
    # Of equal contrasts the one with more colour.
    "contrast": lambda pair: pair.contrast + 1e-9 * float(np.sqrt(pair.volumes[0] * pair.volumes[1])),
}


def product_pair(joint: JointGamut, pair: str = "auto") -> tuple[SubGamut, SubGamut]:
    """Two sets of colours, one a surface, in which any two pictures can be shown together.

    Parameters
    ----------
    joint : JointGamut
    pair : {"auto", "closure", "volume", "contrast"}
        ``"closure"`` begins with the grays of the largest lightness rectangle, on the surface that gives the larger
        product of volumes; both sides hold the rectangle's grays. ``"volume"`` has the largest product of volumes in
        CIELAB that the search finds, ``"contrast"`` the largest smaller lightness range; neither is worse than the
        closure by its own measure. ``"auto"`` is the closure, but ``"volume"`` where the closure's smaller side is
        below a tenth of the larger.

    Returns
    -------
    on_pattern, on_white : SubGamut

    Raises
    ------
    InputError
        If the model has one surface, or `pair` is unknown.
    GamutError
        If the surfaces share no grays to begin with.
    """
    name = DualImage(pair).name
    closed = _closure_of_rectangle(joint, name)
    lopsided = min(closed.volumes) < _LOPSIDED * max(closed.volumes)
    if pair == "closure" or (pair == "auto" and not lopsided):
        return closed.on_pattern, closed.on_white
    best = _maximised(joint, name, closed, _AIMS["volume" if pair == "auto" else pair])
    return best.on_pattern, best.on_white


def _closure_of_rectangle(joint: JointGamut, name: str) -> _Pair:
    lightness = lightness_area(joint)
    grays = {"pattern": lightness.L_pattern, "white": lightness.L_white}
    pairs = []
    for begin_on in SURFACES:
        try:
            pairs.append(_closure(joint, name, _grays(joint, grays[begin_on], 0.0), begin_on))
        except GamutError as error:
            low, high = grays[begin_on]
            raise GamutError(
                f"the surfaces have no two sets of colours that can always be shown together: {error}; their common "
                f"grays are L* {low:.1f} to {high:.1f} on the {begin_on}"
            ) from error
    return max(pairs, key=_AIMS["volume"])


def _maximised(joint: JointGamut, name: str, start: _Pair, aim: Callable[[_Pair], float]) -> _Pair:
    """The best pair near `start`: ends of the gray segment and chroma, by ever smaller steps on each surface."""
    best, best_value = start, aim(start)
    for begin_on in SURFACES:
        at = np.append(getattr(start, f"on_{begin_on}").gray_range(), 0.0)
        value = -np.inf
        step = np.array([_FIRST_STEP_L, _FIRST_STEP_L, _FIRST_STEP_C])
        tried: set[tuple[float, ...]] = set()
        for _ in range(_ROUNDS):
            improved = True
            while improved:
                improved = False
                for move in _MOVES:
                    # On in the same direction, twice as far each time, as long as that gains.
                    stride = 1.0
                    there = at + move * step
                    while tuple(there) not in tried and _is_beginning(there):
                        tried.add(tuple(there))
                        try:
                            pair = _closure(joint, name, _grays(joint, (there[0], there[1]), there[2]), begin_on)
                            found = aim(pair)
                        except GamutError:  # nothing goes with all of that beginning
                            break
                        if found <= value:
                            break
                        at, value, improved = there, found, True
                        if found > best_value:
                            best, best_value = pair, found
                        stride *= 2
                        there = at + stride * move * step
            step /= 2
    return best


def _is_beginning(place: NDArray[np.float64]) -> bool:
    """Whether (lower end, upper end, chroma) is a segment and not too wide."""
    return bool(place[0] < place[1] and 0 <= place[2] <= _LARGEST_CHROMA)


def _grays(joint: JointGamut, L: tuple[float, float], chroma: float) -> NDArray[np.float64]:
    """Corners of a beginning (v, 3): the ends of a gray segment and, with chroma, a square about its middle."""
    Lab = [(L[0], 0.0, 0.0), (L[1], 0.0, 0.0)]
    if chroma:
        middle = (L[0] + L[1]) / 2
        Lab += [(middle, a * chroma, b * chroma) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    return np.asarray(Lab_to_XYZ(Lab, joint.model.white_point), np.float64)


def _closure(joint: JointGamut, name: str, begin: NDArray[np.float64], begin_on: str) -> _Pair:
    """The maximal pair that begins with the colours `begin` (v, 3) on one surface."""
    other = SURFACES[1 - SURFACES.index(begin_on)]
    partners = joint.erode(begin, other)
    closed = joint.erode(partners.vertices, begin_on)
    white_point = joint.model.white_point
    sides = {begin_on: closed, other: partners}
    pattern, white = (SubGamut(name, on, sides[on].normals, sides[on].offsets, white_point) for on in SURFACES)
    volumes = [hull_volume(sides[on].vertices, white_point, _SEARCH_EDGE) for on in SURFACES]
    return _Pair(pattern, white, (volumes[0], volumes[1]))
