"""Dot size and angle moved so that every corner of the lattice falls on a device pixel of the printer.

A cell's edge becomes a whole number of pixels across and a whole number up, so that all dots are made of the same
pixels: a rational tangent, as in the screens of offset print. Images are exact without it, on average; with it, dot
for dot. Knows millimetres, degrees and dots per inch; knows no layout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError

__all__ = ["ANGLE_TOLERANCE_DEG", "FEWEST_PIXELS", "SIZE_TOLERANCE", "Snapped", "check_dots", "snap_to_printer"]

ANGLE_TOLERANCE_DEG = 0.5
SIZE_TOLERANCE = 0.01
"""How far snapping may move the angle, and the dot size as a share of it."""

FEWEST_PIXELS = 3.0
"""Device pixels along a dot: fewer print no dot."""

_MM_PER_INCH = 25.4
_COMMON_DPI = (360, 600, 720, 1200, 1440, 2400)
_SEARCH = 0.25  # of the dot size, how far suggestions are looked for


@dataclass(frozen=True)
class Snapped:
    """A lattice on the printer's grid.

    Attributes
    ----------
    dot_size_mm, angle_deg : float
        Edge and rotation of a cell, as they are now.
    step_px : (int, int)
        The lower edge of a cell in device pixels, across and up.
    asked_dot_size_mm, asked_angle_deg : float
        What was asked for.
    """

    dot_size_mm: float
    angle_deg: float
    step_px: tuple[int, int]
    asked_dot_size_mm: float
    asked_angle_deg: float


def check_dots(dot_size_mm: float, dpi: float) -> None:
    """Check that a dot is made of enough device pixels.

    Raises
    ------
    InputError
        If it is less than `FEWEST_PIXELS` wide.
    """
    if not dot_size_mm > 0:
        raise InputError(f"a pattern's dot_size_mm must be > 0, got {dot_size_mm}")
    pixels = dot_size_mm * dpi / _MM_PER_INCH
    if pixels < FEWEST_PIXELS:
        raise InputError(
            f"a dot must be at least {FEWEST_PIXELS:g} dots of the printer, got {pixels:.2f} ({dot_size_mm:g} mm at "
            f"{dpi:g} dpi): use at least {FEWEST_PIXELS * _MM_PER_INCH / dpi:.3f} mm or "
            f"{np.ceil(FEWEST_PIXELS * _MM_PER_INCH / dot_size_mm):.0f} dpi"
        )


def snap_to_printer(dot_size_mm: float, angle_deg: float, dpi: float) -> Snapped:
    """The lattice of the printer's grid nearest to the one asked for.

    Parameters
    ----------
    dot_size_mm, angle_deg : float
        Edge and rotation of a cell.
    dpi : float
        Device pixels per inch, the same in x and y.

    Raises
    ------
    InputError
        If a dot has too few device pixels, or no lattice lies within `ANGLE_TOLERANCE_DEG` and `SIZE_TOLERANCE`; then
        the nearest dot size, angle and resolution that would do.
    """
    check_dots(dot_size_mm, dpi)
    steps, angles_deg, sizes_mm = _lattices(dot_size_mm, angle_deg, dpi)
    turn, growth = angles_deg - angle_deg, sizes_mm / dot_size_mm - 1
    cost = np.maximum(np.abs(turn) / ANGLE_TOLERANCE_DEG, np.abs(growth) / SIZE_TOLERANCE)
    # the least of the largest is not unique where it is 0, and rounding should not decide between mirror images
    best = int(np.lexsort((np.abs(steps[:, 1]), np.abs(growth), np.round(cost, 9)))[0])
    if cost[best] > 1:
        raise InputError(_advice(dot_size_mm, angle_deg, dpi, angles_deg, sizes_mm))
    across, up = (int(v) for v in steps[best])
    return Snapped(float(sizes_mm[best]), float(angles_deg[best]), (across, up), float(dot_size_mm), float(angle_deg))


def _lattices(
    dot_size_mm: float, angle_deg: float, dpi: float
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Steps (n, 2) in pixels near the one asked for, their angles about the asked one, and their lengths in mm."""
    length_px = dot_size_mm * dpi / _MM_PER_INCH
    angle = np.deg2rad(angle_deg)
    centre = np.rint([length_px * np.cos(angle), length_px * np.sin(angle)]).astype(np.int64)
    reach = int(np.ceil(_SEARCH * length_px)) + 1
    offsets = np.arange(-reach, reach + 1)
    steps = np.stack(np.meshgrid(offsets, offsets, indexing="ij"), axis=-1).reshape(-1, 2) + centre
    steps = steps[(steps != 0).any(axis=1)]
    turn = np.rad2deg(np.arctan2(steps[:, 1], steps[:, 0])) - angle_deg
    turn -= 360 * np.round(turn / 360)
    return steps, angle_deg + turn, np.hypot(steps[:, 0], steps[:, 1]) * _MM_PER_INCH / dpi


def _advice(
    dot_size_mm: float,
    angle_deg: float,
    dpi: float,
    angles_deg: NDArray[np.float64],
    sizes_mm: NDArray[np.float64],
) -> str:
    """What cannot be done, and the nearest dot size, angle and resolution that can."""
    turn, growth = np.abs(angles_deg - angle_deg), np.abs(sizes_mm / dot_size_mm - 1)
    nearest = int(np.argmin(np.maximum(turn / ANGLE_TOLERANCE_DEG, growth / SIZE_TOLERANCE)))
    cures = []
    if turn[nearest] > ANGLE_TOLERANCE_DEG:
        cures.append(f"dot_size_mm = {sizes_mm[nearest]:.4f} with angle_deg = {angles_deg[nearest]:.2f}")
    at_angle = np.flatnonzero(turn <= ANGLE_TOLERANCE_DEG)
    if at_angle.size:
        cures.append(f"dot_size_mm = {sizes_mm[at_angle[np.argmin(growth[at_angle])]]:.4f} alone")
    at_size = np.flatnonzero(growth <= SIZE_TOLERANCE)
    if at_size.size:
        cures.append(f"angle_deg = {angles_deg[at_size[np.argmin(turn[at_size])]]:.2f} alone")
    for other in _COMMON_DPI:
        _, angles, sizes = _lattices(dot_size_mm, angle_deg, other)
        near = (np.abs(angles - angle_deg) <= ANGLE_TOLERANCE_DEG) & (np.abs(sizes / dot_size_mm - 1) <= SIZE_TOLERANCE)
        if other > dpi and near.any():
            cures.append(f"printer.dpi = {other}")
            break
    return (
        f"pattern.snap must find a lattice of the printer's grid within {ANGLE_TOLERANCE_DEG:g} degrees and "
        f"{SIZE_TOLERANCE:.0%}, got dots of {dot_size_mm:g} mm at {angle_deg:g} degrees, "
        f"{dot_size_mm * dpi / _MM_PER_INCH:.1f} pixels at {dpi:g} dpi: set {', or '.join([*cures, 'snap = false'])}"
    )
