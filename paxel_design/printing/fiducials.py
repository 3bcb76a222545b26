"""Four square markers at the corners of a pattern, from which a picture of the sheet is measured.

They are the markers 0..3 of OpenCV's dictionary DICT_4X4_50. The bits stand here as data, so that neither making
nor describing a sheet needs OpenCV. Geometry as `Pattern`: millimetres from its centre, +x right, +y up.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["DICTIONARY", "FIDUCIAL_GAP_MM", "FIDUCIAL_MM", "FIDUCIAL_MODULES", "Fiducial", "fiducials_of"]

DICTIONARY = "DICT_4X4_50"
"""Name of the dictionary in OpenCV (``cv2.aruco``)."""

FIDUCIAL_MM = 18.0
"""Edge of a marker, its black rim included."""

FIDUCIAL_GAP_MM = 4.0
"""Bare paper between a marker and the lines that prolong the edges of the pattern: more than one module (3 mm)."""

# Rows from the top, "#" black; the rim of one module included
FIDUCIAL_MODULES = (
    ("######", "#.#..#", "##.#.#", "###..#", "###.##", "######"),
    ("######", "######", "#....#", "#.##.#", "#.#.##", "######"),
    ("######", "###..#", "###..#", "###.##", "#..#.#", "######"),
    ("######", "#.##.#", "#.##.#", "##.###", "##..##", "######"),
)
"""The modules of the markers 0..3, rows from the top, ``#`` is black."""


@dataclass(frozen=True)
class Fiducial:
    """One marker on the sheet.

    Attributes
    ----------
    id : int
        Its number in the dictionary: 0 at the upper left corner of the pattern, then clockwise.
    corners_mm : four (float, float)
        Upper left, upper right, lower right, lower left corner of the black rim, in OpenCV's order.
    """

    id: int
    corners_mm: tuple[tuple[float, float], ...]


def fiducials_of(size_mm: tuple[float, float]) -> tuple[Fiducial, ...]:
    """The four markers of a pattern of a given width and height, each diagonally beyond a corner of it."""
    near_x, near_y = (side_mm / 2 + FIDUCIAL_GAP_MM for side_mm in size_mm)
    lefts = (-near_x - FIDUCIAL_MM, near_x, near_x, -near_x - FIDUCIAL_MM)
    tops = (near_y + FIDUCIAL_MM, near_y + FIDUCIAL_MM, -near_y, -near_y)
    return tuple(
        Fiducial(i, ((x, y), (x + FIDUCIAL_MM, y), (x + FIDUCIAL_MM, y - FIDUCIAL_MM), (x, y - FIDUCIAL_MM)))
        for i, (x, y) in enumerate(zip(lefts, tops, strict=True))
    )
