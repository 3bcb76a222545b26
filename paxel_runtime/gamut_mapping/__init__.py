"""Gamut mapping: a picture's colours -> colours that a sub-gamut holds (paper: section V-A1)."""

from paxel_runtime.gamut_mapping.static import CHROMA_KNEES, Mapped, map_to_subgamut

__all__ = ["CHROMA_KNEES", "Mapped", "map_to_subgamut"]
