"""Pictures on the projector's raster: which part goes where, resampled in linear light, straight on the wall if asked.

The Lab of a picture is taken as numbers and used as the target under the installation's own white. Knows rasters;
nothing of files, gamuts or patterns.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.pictures.reading import SourcePicture, read_picture

__all__ = ["PLACEMENTS", "Frame", "load_picture", "place", "place_picture", "resample"]

PLACEMENTS = ("fill", "fit", "stretch")
"""How a picture of another shape meets the frame: cropped to fill it, whole between black bars, or distorted."""

Box = tuple[float, float, float, float]
"""(left, top, right, bottom), in pixels from the corner."""

_ROWS_AT_ONCE = 256
_STRAIGHT_PX = 0.05
"""A wall that the raster meets nearer than this is met as it is."""


@dataclass(frozen=True, eq=False)
class Frame:
    """Where pictures go.

    Attributes
    ----------
    width, height : int
        The projector's raster, pixels.
    placement : "fill" | "fit" | "stretch"
        Crop to fill the frame, fit between black bars, or stretch.
    align : (float, float)
        Across and down, 0..1: which part is kept where a picture is cropped, and where it stands between bars; 0 is
        left and top, 0.5 the middle.
    to_wall : (3, 3) float64 array, optional
        Homography from (column, row) of the raster to upright places on the wall, x right and y down, in pixels of
        about the projector's size: pictures are then straight there, and a circle is round. Without it they are
        straight on the raster.
    """

    width: int
    height: int
    placement: str = "fill"
    align: tuple[float, float] = (0.5, 0.5)
    to_wall: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if self.placement not in PLACEMENTS:
            raise InputError(f"mapping.placement must be one of {', '.join(PLACEMENTS)}; got {self.placement!r}")


def load_picture(path: str | os.PathLike[str], width: int, height: int, placement: str = "fill") -> NDArray[np.float32]:
    """Read a picture file as CIELAB on the projector's raster: `read_picture`, then `place_picture`.

    Parameters
    ----------
    path : path
    width, height : int
        The projector's raster, pixels.
    placement : "fill" | "fit" | "stretch"

    Returns
    -------
    (height, width, 3) float32 array
        CIELAB under the white of the picture's own space: D65 for sRGB, D50 with a profile.

    Raises
    ------
    InputError
        As of `read_picture`, and if the placement is unknown.
    """
    frame = Frame(width, height, placement)
    return place_picture(read_picture(path, (width, height)), frame)


def place_picture(picture: SourcePicture, frame: Frame) -> NDArray[np.float32]:
    """Lay a picture on the raster, resampled with antialiasing in linear light; black where it does not reach.

    Parameters
    ----------
    picture : SourcePicture
    frame : Frame

    Returns
    -------
    (height, width, 3) float32 array
        CIELAB under the white of the picture's own space.
    """
    if frame.to_wall is None or _is_straight(frame):
        source, box = place(picture.size, (frame.width, frame.height), frame.placement, frame.align)
        shrunk = picture.linear.shape[1] / picture.size[0], picture.linear.shape[0] / picture.size[1]
        used = (source[0] * shrunk[0], source[1] * shrunk[1], source[2] * shrunk[0], source[3] * shrunk[1])
        used = (used[0], used[1], min(used[2], picture.linear.shape[1]), min(used[3], picture.linear.shape[0]))
        placed = resample(picture.linear, box[2] - box[0], box[3] - box[1], used)
    else:
        placed, box = _on_wall(picture, frame), (0, 0, frame.width, frame.height)
    Lab = np.zeros((frame.height, frame.width, 3), np.float32)
    for row in range(0, len(placed), _ROWS_AT_ONCE):
        tile = placed[row : row + _ROWS_AT_ONCE]
        top = box[1] + row
        XYZ = tile @ picture.space.to_XYZ.T.astype(np.float32)
        Lab[top : top + len(tile), box[0] : box[2]] = XYZ_to_Lab(XYZ, picture.space.white_XYZ)
    return Lab


def place(
    picture_size: tuple[int, int],
    frame_size: tuple[int, int],
    placement: str,
    align: tuple[float, float] = (0.5, 0.5),
) -> tuple[Box, tuple[int, int, int, int]]:
    """Which part of a picture goes where in a frame.

    Parameters
    ----------
    picture_size, frame_size : (width, height)
    placement : "fill" | "fit" | "stretch"
    align : (float, float)
        As of `Frame`.

    Returns
    -------
    source : (left, top, right, bottom) floats
        The part of the picture that is used.
    frame : (left, top, right, bottom) ints
        Where it lies in the frame; the rest of the frame stays black.
    """
    if placement not in PLACEMENTS:
        raise InputError(f"mapping.placement must be one of {', '.join(PLACEMENTS)}; got {placement!r}")
    (w, h), (W, H) = picture_size, frame_size
    if placement == "fill":
        used_w, used_h = min(w, h * W / H), min(h, w * H / W)
        left, top = (w - used_w) * align[0], (h - used_h) * align[1]
        return (left, top, left + used_w, top + used_h), (0, 0, W, H)
    if placement == "fit":
        used_W, used_H = max(1, min(W, round(w * H / h))), max(1, min(H, round(h * W / w)))
        x, y = int((W - used_W) * align[0]), int((H - used_H) * align[1])
        return (0.0, 0.0, float(w), float(h)), (x, y, x + used_W, y + used_H)
    return (0.0, 0.0, float(w), float(h)), (0, 0, W, H)


def resample(linear: NDArray[np.float32], width: int, height: int, box: Box | None = None) -> NDArray[np.float32]:
    """Resample linear values (h, w, C), 0..1, to (height, width, C), antialiased, clipped to 0..1 again.

    Bicubic (a = -0.5, widened when shrinking): of Pillow's filters the sharp one that rings least, and in linear
    light ringing shows beside every dark edge.
    """
    bands = [
        np.asarray(
            Image.fromarray(np.ascontiguousarray(linear[..., c])).resize(
                (width, height), Image.Resampling.BICUBIC, box=box
            )
        )
        for c in range(linear.shape[2])
    ]
    return np.clip(np.stack(bands, axis=-1), 0.0, 1.0)


def _corners_on_wall(frame: Frame) -> NDArray[np.float64]:
    """The raster's outer corners on the wall, (4, 2): clockwise from the upper left."""
    right, bottom = frame.width - 0.5, frame.height - 0.5
    return _through(frame.to_wall, np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]]))


def _through(homography: NDArray[np.float64] | None, places: NDArray[np.float64]) -> NDArray[np.float64]:
    assert homography is not None
    plane = places @ homography[:, :2].T + homography[:, 2]
    return np.asarray(plane[..., :2] / plane[..., 2:])


def _is_straight(frame: Frame) -> bool:
    """Whether the wall's places are the raster's own, up to a shift and a scale."""
    corners = _corners_on_wall(frame)
    left, top = corners[[0, 3], 0], corners[[0, 1], 1]
    right, bottom = corners[[1, 2], 0], corners[[2, 3], 1]
    aspect = (right.mean() - left.mean()) / (bottom.mean() - top.mean()) * frame.height / frame.width
    ends = np.ptp([left, top, right, bottom], axis=1)
    return bool(ends.max() < _STRAIGHT_PX and abs(aspect - 1) * frame.width < _STRAIGHT_PX)


def _on_wall(picture: SourcePicture, frame: Frame) -> NDArray[np.float32]:
    """The picture upright on the wall, as the raster must show it, (height, width, 3) in linear light.

    It fills the raster's upright bounding box there, or fits into the largest upright box inside; it is first scaled
    to the raster's size of a pixel, so that sampling it at the raster's places does not alias.
    """
    corners = _corners_on_wall(frame)
    if frame.placement == "fit":
        left, top = corners[[0, 3], 0].max(), corners[[0, 1], 1].max()
        right, bottom = corners[[1, 2], 0].min(), corners[[2, 3], 1].min()
    else:
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
    W, H = max(1, round(right - left)), max(1, round(bottom - top))
    flat = Frame(W, H, frame.placement, frame.align)
    source, box = place(picture.size, (W, H), flat.placement, flat.align)
    shrunk = picture.linear.shape[1] / picture.size[0], picture.linear.shape[0] / picture.size[1]
    used = tuple(value * shrunk[k % 2] for k, value in enumerate(source))
    ends = picture.linear.shape[1], picture.linear.shape[0]
    upright = resample(
        picture.linear,
        box[2] - box[0],
        box[3] - box[1],
        (used[0], used[1], min(used[2], ends[0]), min(used[3], ends[1])),
    )
    # From the raster's pixels (Pillow counts from their corners) to those of the upright picture.
    onto = np.array([[1.0, 0.0, -left - box[0]], [0.0, 1.0, -top - box[1]], [0.0, 0.0, 1.0]])
    from_corner = np.array([[1.0, 0.0, -0.5], [0.0, 1.0, -0.5], [0.0, 0.0, 1.0]])
    matrix = onto @ frame.to_wall @ from_corner
    coefficients = tuple((matrix / matrix[2, 2]).ravel()[:8])
    bands = [
        np.asarray(
            Image.fromarray(np.ascontiguousarray(upright[..., c])).transform(
                (frame.width, frame.height), Image.Transform.PERSPECTIVE, coefficients, Image.Resampling.BICUBIC
            )
        )
        for c in range(3)
    ]
    return np.clip(np.stack(bands, axis=-1), 0.0, 1.0)
