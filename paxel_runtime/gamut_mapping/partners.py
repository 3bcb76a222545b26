"""Pictures with a partner: each colour is mapped so that its partner on the other surface can be shown at once.

A colour (L, C, h) and its partner (L', chroma_scale C, h + turn) are compressed together: their lightnesses run along a
gray path, and C ends where the *pair* leaves the joint gamut. So the turn of hue is exact, both pictures keep the same
share of their chroma, and the partner moves as smoothly over a picture as the picture itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping.boundary import boundary_of_pairs, table_shape
from paxel_runtime.gamut_mapping.gray_path import gray_path
from paxel_runtime.gamut_mapping.options import MappingOptions, lightness_from
from paxel_runtime.gamut_mapping.static import checked_lightness, checked_picture, compress, mapping_figures
from paxel_runtime.model.effects import Partner
from paxel_runtime.model.subgamut import PairGamut, SubGamut

__all__ = ["MappedPair", "map_with_partner", "seen_from"]

_ROWS_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class MappedPair:
    """A picture and its partner on the other surface; every pair of colours can be shown at once.

    Attributes
    ----------
    Lab : (H, W, 3) float32 array
        The picture.
    Lab_other : (H, W, 3) float32 array
        Its partner.
    figures : dict
        As of `Mapped`, and ``L_to_other``: the partner's range of lightness without the mark.
    """

    Lab: NDArray[np.float32]
    Lab_other: NDArray[np.float32]
    figures: dict[str, Any]


def seen_from(pairs: PairGamut, shown_on: str, sub_gamut: SubGamut | None = None) -> PairGamut:
    """The same pairs with the surface of the picture first; only those whose colour there is in a sub-gamut, if given.

    Parameters
    ----------
    pairs : PairGamut
    shown_on : "pattern" | "white"
    sub_gamut : SubGamut, optional
        A polytope of colours of that surface.
    """
    normals, offsets = pairs.normals, pairs.offsets
    if shown_on == "white":
        normals = np.roll(normals, 3, axis=1)
    if sub_gamut is not None:
        normals = np.vstack([normals, np.hstack([sub_gamut.normals, np.zeros_like(sub_gamut.normals)])])
        offsets = np.concatenate([offsets, sub_gamut.offsets])
    return PairGamut(normals, offsets, pairs.white_point)


def map_with_partner(
    Lab: NDArray[np.float32],
    partner: Partner,
    pairs: PairGamut,
    relation: tuple[float, float],
    options: MappingOptions | None = None,
    *,
    mark: NDArray[np.float32] | None = None,
) -> MappedPair:
    """Map a picture and make its partner.

    Parameters
    ----------
    Lab : (H, W, 3) float32 array
        Source picture, CIELAB as numbers.
    partner : Partner
    pairs : PairGamut
        Its first surface is the picture's (`seen_from`).
    relation : (slope, base)
        Of `luminance_relation`.
    options : MappingOptions, optional
    mark : (H, W) float32 array, optional
        L* of the mark where the partner asks for one.

    Returns
    -------
    MappedPair

    Raises
    ------
    InputError
        If a picture is not finite or of another shape, or a mark is missing.
    GamutError
        If no grays have such partners.
    """
    options = options or MappingOptions()
    Lab = checked_picture(Lab)
    if (mark is not None) != (partner.mark_strength > 0) or (mark is not None and mark.shape != Lab.shape[:2]):
        raise InputError(f"a mark must be given for an effect with one, of the picture's size {Lab.shape[:2]}")
    added = (
        None if mark is None else (partner.mark_strength * (mark - np.mean(mark, dtype=np.float64))).astype(np.float32)
    )
    marks = (0.0, 0.0) if added is None else (float(added.min()), float(added.max()))

    path = gray_path(pairs, partner, relation, table_shape(len(pairs.offsets))[0], marks)
    boundary = np.minimum.reduce(
        [
            boundary_of_pairs(pairs, path.L_own, path.L_other + m, partner.chroma_scale, partner.turn_deg)
            for m in sorted(set(marks))
        ]
    )
    L_to = (float(path.L_own[0]), float(path.L_own[-1]))
    L_from = checked_lightness(lightness_from(Lab, L_to, options))
    mapped, counts = compress(Lab, boundary, L_from, L_to, options.knee, None, pairs.white_point)
    figures = mapping_figures(Lab, mapped, counts, L_from, L_to)
    figures["L_to_other"] = [float(path.L_other[0]), float(path.L_other[-1])]
    return MappedPair(mapped, _partners(mapped, partner, path.L_own, path.L_other, added), figures)


def _partners(
    Lab: NDArray[np.float32],
    partner: Partner,
    L_own: NDArray[np.float64],
    L_other: NDArray[np.float64],
    added: NDArray[np.float32] | None,
) -> NDArray[np.float32]:
    """The partner of every mapped colour."""
    turn = np.deg2rad(partner.turn_deg)
    matrix = partner.chroma_scale * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    other = np.empty_like(Lab)
    for first in range(0, len(Lab), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        other[rows, :, 0] = np.interp(Lab[rows, :, 0], L_own, L_other)
        other[rows, :, 1:] = Lab[rows, :, 1:] @ matrix
    if added is not None:
        other[..., 0] += added
    return other
