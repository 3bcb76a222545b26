"""How a picture is fitted into a set of colours: which of its lightnesses become black and white, how chroma ends.

Knows CIELAB pictures; nothing of sets, surfaces or files.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError

__all__ = ["CHROMA_KNEES", "LIGHTNESSES", "MappingOptions", "lightness_from"]

CHROMA_KNEES = {"soft": 0.5, "clip": 1.0}
"""Share of the chroma at the boundary up to which a colour keeps its chroma, by the way chroma is treated."""

LIGHTNESSES = ("linear", "fixed", "clip")
"""What becomes of L*: the picture's own range, or 0..100, goes linearly onto the gray axis inside; or it stays as it is
and is clipped at the ends."""

_PIXELS = 1_000_000
_LEAST_RANGE = 1.0


@dataclass(frozen=True)
class MappingOptions:
    """Choices of gamut mapping.

    Attributes
    ----------
    chroma : "soft" | "clip"
    lightness : "linear" | "fixed" | "clip"
    black_percent, white_percent : float
        Share of the picture that becomes black, and white, with lightness linear: 0 to 49 %.

    Raises
    ------
    InputError
        If a choice is unknown or a share out of range.
    """

    chroma: str = "soft"
    lightness: str = "linear"
    black_percent: float = 0.5
    white_percent: float = 0.5

    def __post_init__(self) -> None:
        for name, choices in (("chroma", tuple(CHROMA_KNEES)), ("lightness", LIGHTNESSES)):
            if getattr(self, name) not in choices:
                raise InputError(f"mapping.{name} must be one of {', '.join(choices)}; got {getattr(self, name)!r}")
        for name in ("black_percent", "white_percent"):
            if not 0 <= getattr(self, name) < 50:
                raise InputError(f"mapping.{name} must be 0 to below 50, got {getattr(self, name)!r}")

    @property
    def knee(self) -> float:
        """Share of the boundary's chroma up to which chroma stays."""
        return CHROMA_KNEES[self.chroma]


def lightness_from(Lab: NDArray[np.float32], L_to: tuple[float, float], options: MappingOptions) -> tuple[float, float]:
    """The picture's L* that become the ends of the gray axis inside a set.

    Parameters
    ----------
    Lab : (H, W, 3) float32 array
        Of large pictures an even grid of a million pixels is looked at.
    L_to : (low, high)
        The gray axis inside the set.
    options : MappingOptions
    """
    if options.lightness == "clip":
        return L_to
    if options.lightness == "fixed":
        return 0.0, 100.0
    step = int(np.ceil(np.sqrt(max(1.0, Lab.shape[0] * Lab.shape[1] / _PIXELS))))
    low, high = np.percentile(Lab[::step, ::step, 0], [options.black_percent, 100 - options.white_percent])
    return (float(low), float(high)) if high - low >= _LEAST_RANGE else (0.0, 100.0)
