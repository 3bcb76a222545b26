"""A first, affine guess of where the known print lies in the camera's picture, for a patch in the middle.

From the print's own lattice; where a homography is known, from fiducials or the pattern's corners, the lattice only
sharpens it. Knows pictures, tables and the pattern; must not know files.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.registration.lattice import Patch, find_lattice, sharpen_lattice
from paxel_runtime.registration.plane import fit_homography, homography_places

__all__ = ["homography_from_corners", "homography_from_fiducials", "start_on_print"]

_PATCH_CELLS = 40.0
_STEPS_A_CELL = 6
_NEAR_PX = 8
"""Projector pixels around the middle that the table's slope is taken from."""


def start_on_print(
    picture: NDArray[np.float32],
    camera_xy: NDArray[np.float32],
    centre: tuple[int, int],
    pattern: Pattern,
    mm_per_px: float,
    colors: NDArray[np.float64],
    to_mm: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64], float, float]:
    """Affine map (2, 3) from camera to millimetres of the pattern, its correlation, and its reach in camera pixels.

    Parameters
    ----------
    centre : (int, int)
        Projector column and row in the middle of the patch.
    picture, camera_xy, pattern, mm_per_px, colors, to_mm : see `design.register_design`

    Raises
    ------
    CalibrationError
        If the pattern is not found there.
    """
    H, W = camera_xy.shape[:2]
    half_px = min(0.5 * _PATCH_CELLS * pattern.dot_size_mm / mm_per_px, 0.45 * H, 0.45 * W)
    step_mm = pattern.dot_size_mm / _STEPS_A_CELL
    steps = int(half_px * mm_per_px / step_mm)
    along = np.arange(-steps, steps + 1) * step_mm / mm_per_px
    rows, columns = np.meshgrid(centre[1] + along, centre[0] + along, indexing="ij")
    x, y = (
        map_coordinates(camera_xy[..., k].astype(np.float64), [rows, columns], order=1, mode="nearest") for k in (0, 1)
    )
    seen = [map_coordinates(plane, [y, x], order=1, mode="nearest") for plane in np.moveaxis(picture, -1, 0)]
    patch = Patch(np.stack(seen, axis=-1).astype(np.float64), step_mm)
    # nominal millimetres (+y up) by camera place, from the table around the middle
    near = (np.abs(rows - centre[1]) < _NEAR_PX) & (np.abs(columns - centre[0]) < _NEAR_PX)
    places = np.column_stack([x[near], y[near], np.ones(np.count_nonzero(near))])
    nominal = np.column_stack([columns[near] - centre[0], centre[1] - rows[near]]) * mm_per_px
    to_nominal = np.linalg.lstsq(places, nominal, rcond=None)[0].T
    if to_mm is None:
        similarity, score = find_lattice(patch, pattern, colors)
    else:
        on_print = homography_places(to_mm, places[:, :2])
        rough = np.linalg.lstsq(np.column_stack([nominal, np.ones(len(nominal))]), on_print, rcond=None)[0].T
        similarity, score = sharpen_lattice(patch, pattern, colors, np.asarray(rough, np.float64))
    affine = similarity[:, :2] @ to_nominal
    affine[:, 2] += similarity[:, 2]
    return affine, score, 0.5 * float(min(np.ptp(x), np.ptp(y)))


def homography_from_corners(corners_px: ArrayLike, size_mm: tuple[float, float]) -> NDArray[np.float64]:
    """Camera to millimetres, (3, 3), from where the picture shows the pattern's corners.

    Parameters
    ----------
    corners_px : (4, 2) array
        Camera column and row of the upper left, upper right, lower right and lower left corner of the pattern.
    size_mm : (float, float)
        Width and height of the pattern.

    Raises
    ------
    InputError
        If three corners lie on a line, or they do not run clockwise.
    """
    corners = np.asarray(corners_px, np.float64).reshape(-1, 2)
    sides = np.roll(corners, -1, axis=0) - corners
    behind = np.roll(sides, 1, axis=0)
    turns = behind[:, 0] * sides[:, 1] - behind[:, 1] * sides[:, 0]
    if len(corners) != 4 or not np.all(turns > 1e-3 * np.sum(sides**2, axis=1)):
        raise InputError(
            "clusters.corners_px must be the corners of the pattern in the camera's picture, clockwise from the upper "
            f"left, no three in a line; got {corners.tolist()}"
        )
    w, h = size_mm
    return fit_homography(corners, 0.5 * np.array([[-w, h], [w, h], [w, -h], [-w, -h]]))


def homography_from_fiducials(
    picture: NDArray[np.number], fiducials: Mapping[int, ArrayLike], dictionary: str
) -> NDArray[np.float64] | None:
    """Camera to millimetres, (3, 3), from the sheet's ArUco markers; None where fewer than two are seen.

    Parameters
    ----------
    picture : (h, w) array
        Of the sheet under white or room light.
    fiducials : mapping of id -> (4, 2) array
        Corners of each marker in millimetres of the pattern, in OpenCV's order.
    dictionary : str
        Its name in ``cv2.aruco``.
    """
    import cv2  # only here: a quarter of a second, and most installations do not need it

    low, high = np.percentile(picture, (1.0, 99.0))
    gray = np.clip((picture - low) / max(float(high - low), 1e-9), 0.0, 1.0) ** (1 / 2.2)  # raw values are linear
    detector = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)), cv2.aruco.DetectorParameters()
    )
    detector_parameters = detector.getDetectorParameters()
    detector_parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector.setDetectorParameters(detector_parameters)
    corners, found, _ = detector.detectMarkers(np.rint(255 * gray).astype(np.uint8))
    pairs = [
        (corner.reshape(4, 2), np.asarray(fiducials[int(marker)], np.float64))
        for corner, marker in zip(corners, [] if found is None else found.ravel(), strict=True)
        if int(marker) in fiducials
    ]
    if len(pairs) < 2:  # one marker does not tell where the other end of the sheet is
        return None
    seen, on_print = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return fit_homography(seen, on_print)
