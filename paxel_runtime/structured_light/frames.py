"""The frames of structured light: complementary Gray code, then shifted lines (paper: IV-A; design: section 7).

Gray code down to stripes of 4 pixels names the place, 8 shifted lines of period 8 refine it, or (method "phase") 8
shifted sinusoids of period 16: no sharper, but half of the frame is lit, for cameras that want light. Knows the
projector's raster; must not know captures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.structured_light.checks import LINE_PERIOD, PHASE_PERIOD, SHIFTS, fine_name, gray_name

__all__ = [
    "AXES",
    "PERIODS_PX",
    "LightFrame",
    "Method",
    "bits_of",
    "bits_to_pixel",
    "plan_frames",
    "plan_gray_sequence",
]

AXES: tuple[Literal["x", "y"], ...] = ("x", "y")
"""Axes of the projector that structured light runs along, in the order of the plan."""

Method = Literal["lines", "phase"]
"""What refines the Gray code."""

PERIODS_PX: dict[Method, int] = {"lines": LINE_PERIOD, "phase": PHASE_PERIOD}
"""Projector pixels after which the shifted frames of each method repeat."""


@dataclass(frozen=True, eq=False)
class LightFrame:
    """One frame of structured light: a profile along one axis, constant along the other.

    Attributes
    ----------
    name : str
        Unique in a plan, fit for file names: ``white``, ``gray-x-3``, ``gray-x-3-inverse``, ``line-y-0``.
    axis : "x" | "y"
        Axis along which the profile runs.
    profile : (W,) or (H,) array
        Light along that axis: bool, lit or not; float32 device values 0..1 for sinusoids.
    """

    name: str
    axis: Literal["x", "y"]
    profile: NDArray[np.bool_ | np.float32]

    def pixels(self, width: int, height: int) -> NDArray[np.bool_ | np.float32]:
        """The frame, (height, width), of the profile's kind.

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


def plan_frames(width: int, height: int, *, coarse: bool = True, method: Method = "lines") -> tuple[LightFrame, ...]:
    """Frames to show, in order.

    Parameters
    ----------
    width, height : int
        Resolution of the projector, 16 to 65536 each; no power of two is asked for.
    coarse : bool
        With white, black and the Gray code. Without, the 16 shifted frames alone: `decode` then needs the result of a
        channel that was decoded in full.
    method : "lines" | "phase"
        What refines the Gray code.

    Returns
    -------
    tuple of LightFrame
        ``2 + 2 (bits_x + bits_y) + 16`` frames, or 16; bits = ceil(log2(length / 2)).

    Raises
    ------
    InputError
        If the resolution is out of range.
    """
    lengths = _lengths(width, height)
    frames = []
    if coarse:
        frames = [LightFrame("white", "x", np.ones(width, bool)), LightFrame("black", "x", np.zeros(width, bool))]
        for axis in AXES:
            frames += _gray_pairs(axis, np.arange(lengths[axis]) >> 1, bits_of(lengths[axis]))
    for axis in AXES:
        place = np.arange(lengths[axis])
        for shift in range(SHIFTS):
            if method == "lines":
                profile = place % LINE_PERIOD == shift
            else:
                angle = 2.0 * np.pi * (place / PHASE_PERIOD - shift / SHIFTS)
                profile = (0.5 + 0.5 * np.cos(angle)).astype(np.float32)
            frames.append(LightFrame(fine_name(method, axis, shift), axis, profile))
    return tuple(frames)


def plan_gray_sequence(width: int, height: int) -> tuple[LightFrame, ...]:
    """Gray code alone, down to single pixels, as OpenCV's ``GrayCodePattern`` orders it: columns, rows, white, black.

    Each bit is followed by its inverse, most significant bit first; ``2 (bits_x + bits_y) + 2`` frames with
    bits = ceil(log2(length)).

    Raises
    ------
    InputError
        If the resolution is out of range.
    """
    lengths = _lengths(width, height)
    pairs = [_gray_pairs(axis, np.arange(lengths[axis]), bits_to_pixel(lengths[axis])) for axis in AXES]
    full = np.ones(width, bool)
    return (*pairs[0], *pairs[1], LightFrame("white", "x", full), LightFrame("black", "x", ~full))


def _lengths(width: int, height: int) -> dict[str, int]:
    if not (16 <= width <= 65536 and 16 <= height <= 65536):
        raise InputError(f"structured light needs a projector of 16 to 65536 pixels a side, got {width} x {height}")
    return {"x": width, "y": height}


def _gray_pairs(axis: Literal["x", "y"], index: NDArray[np.integer], bits: int) -> list[LightFrame]:
    """Each bit of the Gray code of `index`, the most significant first, and its inverse."""
    frames = []
    for bit in reversed(range(bits)):
        lit = ((index ^ (index >> 1)) >> bit & 1).astype(bool)
        name = gray_name(axis, bit)
        frames += [LightFrame(name, axis, lit), LightFrame(f"{name}-inverse", axis, ~lit)]
    return frames


def bits_of(length: int) -> int:
    """Bits of Gray code that tell bins of 2 pixels apart: its finest stripes are 4 pixels wide."""
    return ((length + 1) // 2 - 1).bit_length()


def bits_to_pixel(length: int) -> int:
    """Bits of Gray code that tell single pixels apart: its finest stripes are 2 pixels wide."""
    return (length - 1).bit_length()
