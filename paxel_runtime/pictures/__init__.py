"""Source pictures: any common file -> CIELAB on the projector's raster (paper: section V-A3)."""

from paxel_runtime.pictures.reading import PLACEMENTS, load_picture, place, resample

__all__ = ["PLACEMENTS", "load_picture", "place", "resample"]
