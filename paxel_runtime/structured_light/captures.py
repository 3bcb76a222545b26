"""Captures as decoding asks for them: one at a time, all of one size and kind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import CalibrationError

__all__ = ["Captures"]

_SAMPLE = 150_000
"""Camera pixels that statistics of whole captures are made from."""


class Captures:
    """Reads captures and refuses those of another size or kind than the first."""

    def __init__(self, read: Callable[[str], NDArray[np.uint16]]) -> None:
        self._read = read
        self.shape: tuple[int, ...] = ()

    def __call__(self, name: str) -> NDArray[np.uint16]:
        capture = self._read(name)
        if capture.ndim != 2 or capture.dtype != np.uint16:
            raise CalibrationError(
                f"capture {name} must be one plane of uint16, got {capture.dtype} of shape {capture.shape}"
            )
        self.shape = self.shape or capture.shape
        if capture.shape != self.shape:
            raise CalibrationError(
                f"capture {name} has {capture.shape[1]} x {capture.shape[0]} pixels, the others "
                f"{self.shape[1]} x {self.shape[0]}: take it again with the same camera setting"
            )
        # one layout, so that the kernels compile once
        return np.require(capture, requirements=["C", "W"])

    def stride(self) -> int:
        """Step along both axes that leaves about `_SAMPLE` pixels of a capture."""
        return max(1, int(np.sqrt(self.shape[0] * self.shape[1] / _SAMPLE)))
