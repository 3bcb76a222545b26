"""The light of a projection on the bench's wall, in the model's unit and beside full white. Knows no viewer."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import observer
from paxel_runtime.observer import texture_window_px
from paxel_runtime.observer.smoothing import local_mean
from paxel_runtime.stages.projected import Projected

__all__ = ["Wall"]

_SAME_PAPER = 0.02
"""What a model may be off about full white on the white sheet."""


class Wall:
    """The light of a projection on the wall, for any viewer."""

    def __init__(self, bench: VirtualBench, projected: Projected, installation: Installation) -> None:
        s = installation.settings
        self._bench, self._projected, self._observer_deg = bench, projected, s.model.observer_deg
        self._full = np.full_like(projected.codes, 2**s.projector.bits - 1)
        self.mm_per_px = s.projector.width_mm / s.projector.resolution[0]
        self.window_px = texture_window_px(s.pattern.dot_size_mm / self.mm_per_px, len(s.pattern.colorants))
        self._views: dict[str, NDArray[np.float32]] = {}

    def view(self, surface: str) -> NDArray[np.float32]:
        """XYZ of the projection, Y = 1 for the white point."""
        if surface not in self._views:
            self._views[surface] = self.light(self._projected.codes, surface) / np.float32(self._unit)
        return self._views[surface]

    def reference(self, surface: str) -> NDArray[np.float32]:
        """XYZ of full white on white paper where this surface is: the fall-off that is no error of a picture."""
        if self._projected.model.white is None:
            # Under a white of one's choice full light is not white: of the print, the shape of the fall-off alone.
            to_white = self._projected.model.white_point / (self._unit * self._full_of_model)
            return (self._full_pattern * to_white).astype(np.float32)
        return self._full_paper if surface == "pattern" else self._full_white

    @cached_property
    def _full_paper(self) -> NDArray[np.float32]:
        return self.light(self._full, "paper")

    @cached_property
    def _full_white(self) -> NDArray[np.float32]:
        """A sheet held before the wall has its own fall-off; one of another paper is as bright as the model says."""
        model = self._projected.model
        of_paper = np.asarray(model.predict_XYZ(np.ones(model.n))[1]) / model.white_point
        full = self.light(self._full, "white")
        return full if np.allclose(of_paper, 1.0, atol=_SAME_PAPER) else (full / of_paper).astype(np.float32)

    @cached_property
    def _full_pattern(self) -> NDArray[np.float32]:
        """Full light on the print where there is no second surface, its dots smoothed away."""
        full, mask = self.light(self._full, "pattern"), self._projected.inside
        return np.stack([local_mean(full[..., c], mask, 4 * self.window_px) for c in range(3)], axis=-1).astype("f4")

    @cached_property
    def _unit(self) -> float:
        """The bench's Y of what the model calls 1, by the print at full, as measured in the middle of the projection.

        With a second surface both mean full white on white paper.
        """
        if self._projected.model.white is not None:
            return 1.0
        height, width = self._projected.inside.shape
        return float(self._full_pattern[height // 2, width // 2, 1] / self._full_of_model[1])

    @cached_property
    def _full_of_model(self) -> NDArray[np.float64]:
        """XYZ of the print with everything at full."""
        model = self._projected.model
        return np.asarray(model.predict_XYZ(np.ones(model.n))[0], np.float64)

    def light(self, codes: NDArray[np.unsignedinteger], surface: str) -> NDArray[np.float32]:
        """XYZ of any frame in the bench's unit, (H, W, 3)."""
        with observer(self._observer_deg):
            return self._bench.view_XYZ(codes, surface)
