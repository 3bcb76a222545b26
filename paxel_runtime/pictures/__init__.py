"""Source pictures: any common file -> CIELAB on the projector's raster (paper: section V-A3)."""

from paxel_runtime.pictures.placing import PLACEMENTS, Frame, load_picture, place, place_picture, resample
from paxel_runtime.pictures.reading import SourcePicture, read_picture
from paxel_runtime.pictures.wall import wall_homography

__all__ = [
    "PLACEMENTS",
    "Frame",
    "SourcePicture",
    "load_picture",
    "place",
    "place_picture",
    "read_picture",
    "resample",
    "wall_homography",
]
