"""What a projector and a print do beyond XYZ = A x + black, as measured: a sum of simple terms of the inputs, as data.

A term is a product of two inputs (channels that take light from each other), or a power of the difference of one
channel's inputs on two clusters (neighbouring pixels of different value); what such terms leave is a polyharmonic
residual about the measured inputs. Every term is zero at black. Data and closed formulas only; how a correction is
chosen and fitted stands in ``calibration/correction.py``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import KERNEL

__all__ = ["TERM_KINDS", "Correction", "Term", "residual_values", "term_values"]

TERM_KINDS: dict[str, str] = {
    "linear": "x_a",
    "product": "x_a x_b",
    "absolute": "|x_a - x_b|",
    "square": "(x_a - x_b)^2",
    "signed-square": "(x_a - x_b) |x_a - x_b|",
}
"""Terms by name, with their formulas; the kernel below takes their places in this table."""

_LINEAR, _PRODUCT, _ABSOLUTE, _SQUARE = range(4)


class Term(NamedTuple):
    """One function of the inputs.

    Attributes
    ----------
    kind : str
        A name in `TERM_KINDS`.
    a, b : int
        Places of the inputs in x; equal for "linear".
    """

    kind: str
    a: int
    b: int


@dataclass(frozen=True, eq=False)
class Correction:
    """XYZ to add to the linear model's on each surface: sum_t C_t term_t(x) + sum_k W_k g_k(x).

    The residual's functions are g_k(x) = |x| + |c_k| - |x - c_k| (polyharmonic of order 1, zero at black; the kernel
    of Levy's Brownian field, positive definite, so that smoothing needs no side condition).

    Attributes
    ----------
    n : int
        Number of inputs.
    terms : tuple of m Term
    coefficients : (S, 3, m) float64 array
        C: XYZ of each term on each of the S surfaces, the pattern first.
    centres : (q, n) float64 array
        c_k; q = 0 where there is no residual.
    weights : (S, 3, q) float64 array
        W.

    Raises
    ------
    InputError
        If a term is unknown, or shapes do not fit each other.
    """

    n: int
    terms: tuple[Term, ...]
    coefficients: NDArray[np.float64]
    centres: NDArray[np.float64]
    weights: NDArray[np.float64]

    def __post_init__(self) -> None:
        for term in self.terms:
            if term.kind not in TERM_KINDS:
                raise InputError(f"a correction's term must be one of {', '.join(TERM_KINDS)}, got {term.kind!r}")
            if not (0 <= term.a < self.n and 0 <= term.b < self.n):
                raise InputError(f"a correction's terms must name inputs 0 to {self.n - 1}, got {term.a} and {term.b}")
        for name, array, columns in (
            ("coefficients", self.coefficients, len(self.terms)),
            ("weights", self.weights, len(self.centres)),
        ):
            if array.ndim != 3 or array.shape[1:] != (3, columns):
                raise InputError(f"a correction's {name} must be (surfaces, 3, {columns}), got {array.shape}")
        if len(self.coefficients) != len(self.weights) or self.centres.shape[1:] != (self.n,):
            raise InputError(
                f"a correction of {len(self.coefficients)} surfaces and {self.n} inputs needs centres (q, {self.n}) "
                f"and weights of as many surfaces, got {self.centres.shape} and {self.weights.shape}"
            )

    @property
    def surfaces(self) -> int:
        """Number of surfaces, S."""
        return len(self.coefficients)

    def alone(self, surface: int) -> Correction:
        """The correction of one of its surfaces."""
        one = slice(surface, surface + 1)
        return replace(self, coefficients=self.coefficients[one], weights=self.weights[one])

    def XYZ(self, x: ArrayLike) -> NDArray[np.float64]:
        """(..., S, 3) XYZ to add for linear inputs x (..., n); zero at x = 0."""
        return self._evaluate(x, jacobian=False)[0]

    def XYZ_and_jacobian(self, x: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(..., S, 3) XYZ to add and its derivatives (..., S, 3, n) by the inputs.

        At a kink (equal inputs of an absolute difference; a centre) the derivative is the mean of both sides.
        """
        return self._evaluate(x, jacobian=True)

    def _evaluate(self, x: ArrayLike, *, jacobian: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        x = np.asarray(x, np.float64)
        if x.shape[-1:] != (self.n,):
            raise InputError(f"a correction of {self.n} inputs needs (..., {self.n}), got {x.shape}")
        points = np.ascontiguousarray(x.reshape(-1, self.n))
        rows = 3 * self.surfaces
        XYZ = np.zeros((len(points), rows))
        J = np.zeros((len(points), rows, self.n) if jacobian else (0, rows, self.n))
        _evaluate_terms(points, *self._term_arrays, XYZ, J)
        if len(self.centres):
            _evaluate_residual(points, self.centres, self._weight_rows, XYZ, J)
        leading = x.shape[:-1]
        XYZ = XYZ.reshape(*leading, self.surfaces, 3)
        return XYZ, J.reshape(*leading, self.surfaces, 3, self.n) if jacobian else J

    @cached_property
    def _term_arrays(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        return _table(self.terms), _rows(self.coefficients)

    @cached_property
    def _weight_rows(self) -> NDArray[np.float64]:
        return _rows(self.weights)


def term_values(terms: tuple[Term, ...], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, m) value of each term at inputs x (P, n)."""
    values = np.zeros((len(x), len(terms)))
    _evaluate_terms(np.ascontiguousarray(x), _table(terms), np.eye(len(terms)), values, np.empty((0, 0, 0)))
    return values


def residual_values(centres: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, q) value of the residual's function about each centre (q, n) at inputs x (P, n)."""
    values = np.zeros((len(x), len(centres)))
    _evaluate_residual(np.ascontiguousarray(x), centres, np.eye(len(centres)), values, np.empty((0, 0, 0)))
    return values


def _table(terms: tuple[Term, ...]) -> NDArray[np.int64]:
    """(m, 3): place of the kind in `TERM_KINDS`, a, b."""
    kinds = list(TERM_KINDS)
    return np.array([(kinds.index(t.kind), t.a, t.b) for t in terms], np.int64).reshape(-1, 3)


def _rows(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3 S) of (S, 3, m): what belongs to one function side by side."""
    return np.ascontiguousarray(values.reshape(-1, values.shape[-1]).T)


@njit(**KERNEL)
def _evaluate_terms(
    points: NDArray[np.float64],
    terms: NDArray[np.int64],
    coefficients: NDArray[np.float64],
    XYZ: NDArray[np.float64],
    J: NDArray[np.float64],
) -> None:
    """Add the terms to XYZ (P, rows) and, unless it is empty, their derivatives to J (P, rows, n)."""
    for p in range(len(points)):
        for t in range(len(terms)):
            kind, a, b = terms[t, 0], terms[t, 1], terms[t, 2]
            x_a, x_b = points[p, a], points[p, b]
            d = x_a - x_b
            if kind == _LINEAR:
                value, by_a, by_b = x_a, 1.0, 0.0
            elif kind == _PRODUCT:
                value, by_a, by_b = x_a * x_b, x_b, x_a
            elif kind == _ABSOLUTE:
                by_a = np.sign(d)
                value, by_b = abs(d), -by_a
            elif kind == _SQUARE:
                value, by_a, by_b = d * d, 2.0 * d, -2.0 * d
            else:
                by_a = 2.0 * abs(d)
                value, by_b = d * abs(d), -by_a
            for r in range(XYZ.shape[1]):
                XYZ[p, r] += coefficients[t, r] * value
            if len(J):
                for r in range(XYZ.shape[1]):
                    J[p, r, a] += coefficients[t, r] * by_a
                    J[p, r, b] += coefficients[t, r] * by_b


@njit(**KERNEL)
def _evaluate_residual(
    points: NDArray[np.float64],
    centres: NDArray[np.float64],
    weights: NDArray[np.float64],
    XYZ: NDArray[np.float64],
    J: NDArray[np.float64],
) -> None:
    """Add the polyharmonic residual and, unless J is empty, its derivatives."""
    n = points.shape[1]
    for p in range(len(points)):
        radius = 0.0
        for i in range(n):
            radius += points[p, i] ** 2
        radius = np.sqrt(radius)
        for k in range(len(centres)):
            own, apart = 0.0, 0.0
            for i in range(n):
                own += centres[k, i] ** 2
                apart += (points[p, i] - centres[k, i]) ** 2
            apart = np.sqrt(apart)
            value = radius + np.sqrt(own) - apart
            for r in range(XYZ.shape[1]):
                XYZ[p, r] += weights[k, r] * value
            if len(J):
                for i in range(n):
                    slope = points[p, i] / radius if radius > 0 else 0.0
                    slope -= (points[p, i] - centres[k, i]) / apart if apart > 0 else 0.0
                    for r in range(XYZ.shape[1]):
                        J[p, r, i] += weights[k, r] * slope
