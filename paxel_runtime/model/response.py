"""Response curves of a projector: device values P (0..1) <-> linear intensities x (0..1), one curve a channel.

Curves are monotone (PCHIP through the measured points), black-subtracted and normalised to 1 at full; the inverse
is a table of 4097 entries (design: section 7, *Response*). Nothing here measures anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from paxel_runtime.errors import InputError

__all__ = ["ProjectorResponse"]

_TABLE = np.linspace(0.0, 1.0, 4097)


@dataclass(frozen=True, eq=False)
class ProjectorResponse:
    """One response curve a channel, f in x = f(P) (Eq. 2).

    Attributes
    ----------
    code : (N, m) float64 array
        Device values of the measured points, from 0 to 1, rising.
    linear : (N, m) float64 array
        Linear intensity at each point, from 0 to 1, never falling.

    Raises
    ------
    InputError
        If a curve does not run from (0, 0) to (1, 1), or falls.
    """

    code: NDArray[np.float64]
    linear: NDArray[np.float64]

    def __post_init__(self) -> None:
        ends = np.array([[0.0, 1.0]])
        if self.code.ndim != 2 or self.code.shape != self.linear.shape or self.code.shape[1] < 2:
            raise InputError(f"a response needs code and linear of one shape (N, m), got {self.code.shape}")
        for name, values, rising in (("code", self.code, True), ("linear", self.linear, False)):
            steps = np.diff(values, axis=1)
            if np.any(np.abs(values[:, [0, -1]] - ends) > 1e-9) or np.any(steps <= 0 if rising else steps < 0):
                raise InputError(f"a response's {name} values must run from 0 to 1 without falling, got {values}")

    @cached_property
    def _forward(self) -> NDArray[np.float64]:
        """(N, 4097) table of f on a uniform grid of P."""
        return np.array([PchipInterpolator(c, v)(_TABLE) for c, v in zip(self.code, self.linear, strict=True)])

    @cached_property
    def _inverse(self) -> NDArray[np.float64]:
        """(N, 4097) table of the inverse of f on a uniform grid of x; the lowest P where f is flat."""
        tables = []
        for forward in self._forward:
            keep = np.concatenate(([True], np.diff(np.maximum.accumulate(forward)) > 0))
            tables.append(np.interp(_TABLE, forward[keep], _TABLE[keep]))
        return np.array(tables)

    def P_to_x(self, P: ArrayLike) -> NDArray[np.float64]:
        """Linear intensities of device values; (..., N) -> (..., N), channels last."""
        return self._look_up(self._forward, P)

    def x_to_P(self, x: ArrayLike) -> NDArray[np.float64]:
        """Device values that give linear intensities; (..., N) -> (..., N), channels last."""
        return self._look_up(self._inverse, x)

    def _look_up(self, tables: NDArray[np.float64], values: ArrayLike) -> NDArray[np.float64]:
        values = np.asarray(values)
        if values.shape[-1] != len(tables):
            raise InputError(f"a response of {len(tables)} channels needs (..., {len(tables)}), got {values.shape}")
        return np.stack([np.interp(values[..., j], _TABLE, table) for j, table in enumerate(tables)], axis=-1)
