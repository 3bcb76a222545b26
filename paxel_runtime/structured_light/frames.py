"""The frames of structured light: complementary Gray code, then shifted lines (paper: IV-A; design: section 7).

Gray code down to stripes of 4 pixels names the place, 8 shifted lines of period 8 refine it. Knows the projector's
raster; must not know captures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.structured_light.checks import LINE_PERIOD, gray_name, line_name

__all__ = ["AXES", "LightFrame", "bits_of", "plan_frames"]

AXES: tuple[Literal["x", "y"], ...] = ("x", "y")
"""Axes of the projector that structured light runs along, in the order of the plan."""


@dataclass(frozen=True, eq=False)
class LightFrame:
    """One frame of structured light: a profile along one axis, constant along the other.

    Attributes
    ----------
    name : str
        Unique in a plan, fit for file names: ``white``, ``gray-x-3``, ``gray-x-3-inverse``, ``line-y-0``.
    axis : "x" | "y"
        Axis along which the profile runs.
    profile : (W,) or (H,) bool array
        Lit pixels along that axis.
    """

    name: str
    axis: Literal["x", "y"]
    profile: NDArray[np.bool_]

    def pixels(self, width: int, height: int) -> NDArray[np.bool_]:
        """The frame, (height, width) bool; True is lit.

        Raises
        ------
        InputError
            If the frame was planned for another size.
        """
        length = width if self.axis == "x" else height
        if len(self.profile) != length:
            raise InputError(
                f"frame {self.name} was planned for {len(self.profile)} pixels along {self.axis}, asked for {length}"
            )
        profile = self.profile[None, :] if self.axis == "x" else self.profile[:, None]
        return np.broadcast_to(profile, (height, width))


def plan_frames(width: int, height: int, *, coarse: bool = True) -> tuple[LightFrame, ...]:
    """Frames to show, in order.

    Parameters
    ----------
    width, height : int
        Resolution of the projector, 16 to 65536 each; no power of two is asked for.
    coarse : bool
        With white, black and the Gray code. Without, the 16 shifted lines alone: `decode` then needs the result of a
        channel that was decoded in full.

    Returns
    -------
    tuple of LightFrame
        ``2 + 2 (bits_x + bits_y) + 16`` frames, or 16; bits = ceil(log2(length / 2)).

    Raises
    ------
    InputError
        If the resolution is out of range.
    """
    if not (16 <= width <= 65536 and 16 <= height <= 65536):
        raise InputError(f"structured light needs a projector of 16 to 65536 pixels a side, got {width} x {height}")
    lengths = {"x": width, "y": height}
    frames = []
    if coarse:
        frames = [LightFrame("white", "x", np.ones(width, bool)), LightFrame("black", "x", np.zeros(width, bool))]
        for axis in AXES:
            index = np.arange(lengths[axis]) >> 1
            for bit in reversed(range(bits_of(lengths[axis]))):
                lit = ((index ^ (index >> 1)) >> bit & 1).astype(bool)
                name = gray_name(axis, bit)
                frames += [LightFrame(name, axis, lit), LightFrame(f"{name}-inverse", axis, ~lit)]
    for axis in AXES:
        place = np.arange(lengths[axis]) % LINE_PERIOD
        frames += [LightFrame(line_name(axis, shift), axis, place == shift) for shift in range(LINE_PERIOD)]
    return tuple(frames)


def bits_of(length: int) -> int:
    """Bits of Gray code that tell bins of 2 pixels apart: its finest stripes are 4 pixels wide."""
    return ((length + 1) // 2 - 1).bit_length()
