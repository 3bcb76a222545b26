"""Gamut mapping: pictures' colours -> colours that a sub-gamut, or the joint gamut, holds (paper: section V-A1)."""

from paxel_runtime.gamut_mapping.adaptive import (
    AdaptiveOptions,
    AdaptivePair,
    PairCurves,
    apply_pair_curves,
    fit_pair_curves,
    map_pair,
)
from paxel_runtime.gamut_mapping.gray_path import luminance_relation
from paxel_runtime.gamut_mapping.local_light import local_white, under_light
from paxel_runtime.gamut_mapping.moved import moved_picture
from paxel_runtime.gamut_mapping.options import CHROMA_KNEES, LIGHTNESSES, MappingOptions
from paxel_runtime.gamut_mapping.partners import MappedPair, map_with_partner, seen_from
from paxel_runtime.gamut_mapping.static import Mapped, map_to_subgamut

__all__ = [
    "CHROMA_KNEES",
    "LIGHTNESSES",
    "AdaptiveOptions",
    "AdaptivePair",
    "Mapped",
    "MappedPair",
    "MappingOptions",
    "PairCurves",
    "apply_pair_curves",
    "fit_pair_curves",
    "local_white",
    "luminance_relation",
    "map_pair",
    "map_to_subgamut",
    "map_with_partner",
    "moved_picture",
    "seen_from",
    "under_light",
]
