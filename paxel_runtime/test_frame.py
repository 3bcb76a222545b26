"""A frame that shows at a glance whether the projector shows frames pixel for pixel.

Gratings of single lines and a checkerboard of single pixels are an even gray where every pixel of the frame is one of
the projector's; scaled, keystoned or cropped they turn into coarse stripes, and the border is no longer one pixel wide
all round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["one_to_one_frame"]


def one_to_one_frame(width: int, height: int, channels: int, bits: int) -> NDArray[np.uint16]:
    """Device codes (height, width, channels): a border of one pixel, and five fields of the finest patterns.

    Clockwise from the upper left: upright lines, level lines, the same of two pixels; in the middle a checkerboard.
    Each field is a quarter of the shorter side.
    """
    rows, columns = np.indices((height, width), np.int32)
    patterns = {
        (0.2, 0.25): columns % 2,
        (0.8, 0.25): rows % 2,
        (0.8, 0.75): columns // 2 % 2,
        (0.2, 0.75): rows // 2 % 2,
        (0.5, 0.5): (rows + columns) % 2,
    }
    half = min(width, height) // 8
    on = np.zeros((height, width), bool)
    for (across, down), pattern in patterns.items():
        middle = round(across * width), round(down * height)
        field = (np.abs(columns - middle[0]) < half) & (np.abs(rows - middle[1]) < half)
        on |= field & (pattern == 0)
    on[[0, -1]] = True
    on[:, [0, -1]] = True
    return np.repeat(on[..., None], channels, axis=2).astype(np.uint16) * np.uint16(2**bits - 1)
