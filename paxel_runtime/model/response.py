"""Response curves of a projector: device values P (0..1) <-> linear intensities x (0..1), one curve a channel.

Curves are monotone (PCHIP through the measured points), black-subtracted and normalised to 1 at full, tabulated at 4097
device values; the inverse is that table read backwards, so that it undoes the curve to rounding. Nothing here measures
anything.
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
    code : tuple of N (m,) float64 arrays
        Device values of each channel's measured points, from 0 to 1, rising; m may differ between channels.
    linear : tuple of N (m,) float64 arrays
        Linear intensity at each point, from 0 to 1, never falling.

    Raises
    ------
    InputError
        If a curve does not run from (0, 0) to (1, 1), or falls.
    """

    code: tuple[NDArray[np.float64], ...]
    linear: tuple[NDArray[np.float64], ...]

    def __post_init__(self) -> None:
        for code, linear in zip(self.code, self.linear, strict=True):
            if code.ndim != 1 or code.shape != linear.shape or len(code) < 2:
                raise InputError(
                    f"a response curve needs as many code as linear values, 2 or more, got {code.shape}, {linear.shape}"
                )
            for name, values, smallest_step in (("code", code, 1e-9), ("linear", linear, 0.0)):
                runs = abs(values[0]) < 1e-9 and abs(values[-1] - 1) < 1e-9
                if not runs or not np.all(np.diff(values) >= smallest_step):
                    raise InputError(
                        f"a response curve's {name} values must run from 0 to 1 without falling, got {values.tolist()}"
                    )

    @cached_property
    def _forward(self) -> NDArray[np.float64]:
        """(N, 4097) table of f on a uniform grid of P; rounding of the interpolation never makes it fall."""
        curves = [PchipInterpolator(c, v)(_TABLE) for c, v in zip(self.code, self.linear, strict=True)]
        return np.clip(np.maximum.accumulate(curves, axis=1), 0.0, 1.0)

    def P_to_x(self, P: ArrayLike) -> NDArray[np.float64]:
        """Linear intensities of device values; (..., N) -> (..., N), channels last."""
        values = self._checked(P)
        return np.stack([np.interp(values[..., j], _TABLE, f) for j, f in enumerate(self._forward)], axis=-1)

    def x_to_P(self, x: ArrayLike) -> NDArray[np.float64]:
        """Device values that give linear intensities, the lowest where f is flat; (..., N) -> (..., N)."""
        values = self._checked(x)
        return np.stack([np.interp(values[..., j], *inverse) for j, inverse in enumerate(self._inverse)], axis=-1)

    def shown_x(self, x: ArrayLike, bits: int) -> NDArray[np.float64]:
        """Linear intensities that a device of whole codes of `bits` bits shows when asked for x, (..., N)."""
        top = 2**bits - 1
        return self.P_to_x(np.rint(self.x_to_P(x) * top) / top)

    @cached_property
    def _inverse(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """The points of each table of f at which it rises: x, and the lowest P that gives it."""
        rises = [np.concatenate(([True], np.diff(forward) > 0)) for forward in self._forward]
        return [(forward[keep], _TABLE[keep]) for forward, keep in zip(self._forward, rises, strict=True)]

    @cached_property
    def inverse_tables(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """x and P of the inverse's points, (N, m) each, for kernels; shorter tables end in x = infinity, P = 1."""
        m = max(len(x) for x, _ in self._inverse)
        tables = np.full((len(self._inverse), m), np.inf), np.ones((len(self._inverse), m))
        for j, points in enumerate(self._inverse):
            for table, values in zip(tables, points, strict=True):
                table[j, : len(values)] = values
        return tables

    def _checked(self, values: ArrayLike) -> NDArray[np.floating]:
        values = np.asarray(values)
        if values.shape[-1] != len(self.code):
            raise InputError(
                f"a response of {len(self.code)} channels needs (..., {len(self.code)}), got {values.shape}"
            )
        return values
