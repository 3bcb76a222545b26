"""CIEDE2000: the one dE00 of the project, its gradient and its Hessian.

`dE00` is the public function. Kernels call `squared_dE00_jet`, which gives dE00^2 with its exact first and second
derivatives with respect to the second colour. Both run the same arithmetic: the compiler drops derivatives that
nobody asks for. This file knows two CIELAB colours and nothing else.

How it is made to run in SIMD lanes (no library call, no branch):

* dE00^2 splits into a term of L* and a term of (a*, b*). The second is carried as a *jet*: a tuple
  (value, d/da, d/db, d2/da2, d2/dadb, d2/db2).
* Hues enter as complex logarithms. With z = a' + i b, ln z = ln C' + i h', so the jets of C' and h' are the real and
  imaginary parts of one complex jet, and 2 exp((ln z2 + conj(ln z1)) / 2) has dH' as its imaginary part. No hue
  angle is ever formed, so none has to be wrapped.
* The rotation term sin(60 deg exp(-((h - 275) / 25)^2)) is a polynomial in 1 - cos((h - 275) / 2).

dE00^2 has no derivative where the second colour is exactly gray and the first is not (a cone), and jumps where the
hues are exactly opposite, and by about 1e-5 of itself where the mean hue is 0 (the standard's own seam); there the
jet is finite and belongs to one side.

References
----------
CIE 142-2001; G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula: implementation notes,
supplementary test data, and mathematical observations", Color Research and Application 30(1), 2005.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import INLINED

__all__ = ["TRUE_dE00", "dE00", "squared_dE00_jet"]

Jet: TypeAlias = tuple[float, float, float, float, float, float]
"""Value and derivatives (v, a, b, aa, ab, bb) of a function of (a*, b*)."""

TRUE_dE00 = 1e-28
"""Softness at which nothing divides by 0 at gray, and values move by less than 1e-13."""

_25_TO_7 = 25.0**7
_C6, _S6 = math.cos(math.radians(6.0)), math.sin(math.radians(6.0))
_C30, _S30 = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
_C63, _S63 = math.cos(math.radians(63.0)), math.sin(math.radians(63.0))
_C275, _S275 = math.cos(math.radians(275.0)), math.sin(math.radians(275.0))


def _polynomial(f_of_nodes: NDArray[np.float64], nodes: NDArray[np.float64], degree: int) -> tuple[float, ...]:
    fit = Chebyshev.fit(nodes, f_of_nodes, degree).convert(kind=Polynomial)
    return tuple(float(c) for c in fit.coef)


def _rotation_polynomial() -> tuple[float, ...]:
    """exp(-(d / 25 deg)^2 / 16) in w = 1 - cos(d / 2), for hue differences d up to 120 degrees, to 1e-12."""
    w = 0.25 - 0.25 * np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    d_deg = 2.0 * np.rad2deg(np.arccos(1.0 - w))
    return _polynomial(np.exp(-((d_deg / 25.0) ** 2) / 16.0), w, 9)


def _sine_polynomial() -> tuple[float, ...]:
    """sin(pi e / 3) / e in e^2, for e in 0..1, to 1e-15."""
    square = 0.5 - 0.5 * np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    return _polynomial(np.sin(np.pi / 3.0 * np.sqrt(square)) / np.sqrt(square), square, 6)


_Q = _rotation_polynomial()
_SIN = _sine_polynomial()


@njit(**INLINED)
def _scale(p: Jet, s: float) -> Jet:
    return p[0] * s, p[1] * s, p[2] * s, p[3] * s, p[4] * s, p[5] * s


@njit(**INLINED)
def _add(p: Jet, q: Jet) -> Jet:
    return p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3], p[4] + q[4], p[5] + q[5]


@njit(**INLINED)
def _multiply(p: Jet, q: Jet) -> Jet:
    return (
        p[0] * q[0],
        p[1] * q[0] + p[0] * q[1],
        p[2] * q[0] + p[0] * q[2],
        p[3] * q[0] + 2.0 * p[1] * q[1] + p[0] * q[3],
        p[4] * q[0] + p[1] * q[2] + p[2] * q[1] + p[0] * q[4],
        p[5] * q[0] + 2.0 * p[2] * q[2] + p[0] * q[5],
    )


@njit(**INLINED)
def _compose(p: Jet, f: float, f1: float, f2: float) -> Jet:
    """Jet of f(p) from f, f' and f'' at the value of p."""
    return (
        f,
        f1 * p[1],
        f1 * p[2],
        f2 * p[1] * p[1] + f1 * p[3],
        f2 * p[1] * p[2] + f1 * p[4],
        f2 * p[2] * p[2] + f1 * p[5],
    )


@njit(**INLINED)
def _reciprocal(p: Jet) -> Jet:
    r = 1.0 / p[0]
    return _compose(p, r, -r * r, 2.0 * r * r * r)


@njit(**INLINED)
def _chroma_weight(chroma: float) -> tuple[float, float, float]:
    """sqrt(C^7 / (C^7 + 25^7)) with its first and second derivative: the heart of G and of R_C."""
    c2 = chroma * chroma
    c7 = c2 * c2 * c2 * chroma
    both = 1.0 / (chroma * (c7 + _25_TO_7))  # one division for the two that are needed
    q, inverse = c7 * chroma * both, (c7 + _25_TO_7) * both
    r = math.sqrt(q)
    slope = 3.5 * r * (1.0 - q) * inverse
    return r, slope, slope * inverse * (2.5 - 10.5 * q)


@njit(**INLINED)
def _log_jets(x: Jet, y: float, y_b: float, softness: float) -> tuple[Jet, Jet]:
    """Real and imaginary jet of ln(x + i y), where y = y + y_b b is linear; the values themselves are left 0."""
    inverse = 1.0 / (x[0] * x[0] + y * y + softness)
    re, im = x[0] * inverse, -y * inverse  # 1 / z
    a_re, a_im = x[1] * re, x[1] * im
    b_re, b_im = x[2] * re - y_b * im, x[2] * im + y_b * re
    real = (
        0.0,
        a_re,
        b_re,
        x[3] * re - (a_re * a_re - a_im * a_im),
        x[4] * re - (a_re * b_re - a_im * b_im),
        x[5] * re - (b_re * b_re - b_im * b_im),
    )
    imaginary = (
        0.0,
        a_im,
        b_im,
        x[3] * im - 2.0 * a_re * a_im,
        x[4] * im - (a_re * b_im + a_im * b_re),
        x[5] * im - 2.0 * b_re * b_im,
    )
    return real, imaginary


@njit(**INLINED)
def _geometric_mean(a1: float, b1: float, a2: float, b2: float, C1: float, C2: float) -> tuple[float, float]:
    """2 sqrt(C1 C2) (cos, sin)(dh / 2), dh in -180..180 degrees: its imaginary part is dH' (Sharma, Eqs. 10, 11).

    The larger part comes from a sum without cancellation, the smaller from the product of the two, 2 a1 x a2.
    Exactly opposite hues turn the way of h2 - h1 with hues in 0..360.
    """
    dot = a1 * a2 + b1 * b2
    cross = a1 * b2 - b1 * a2
    large = math.sqrt(2.0 * (C1 * C2 + abs(dot)) + TRUE_dE00)
    first_is_lower = b1 > 0.0 or (b1 == 0.0 and a1 > 0.0)
    opposite = abs(cross) <= 1e-14 * C1 * C2
    turns_left = first_is_lower if opposite else cross > 0.0
    small = 2.0 * cross / large
    re = large if dot >= 0.0 else abs(small)
    im = small if dot >= 0.0 else (large if turns_left else -large)
    return re, im


@njit(**INLINED)
def _hue_weight(c: float, s: float) -> tuple[float, float, float]:
    """T of the mean hue (c, s) = (cos h, sin h) with two derivatives in h (Sharma, Eq. 15)."""
    c2, s2 = c * c - s * s, 2.0 * c * s
    c3, s3 = c * c2 - s * s2, s * c2 + c * s2
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * c2 * s2
    one = 0.17 * (c * _C30 + s * _S30)
    one_s = 0.17 * (s * _C30 - c * _S30)
    three = 0.32 * (c3 * _C6 - s3 * _S6)
    three_s = 0.32 * (s3 * _C6 + c3 * _S6)
    four = 0.20 * (c4 * _C63 + s4 * _S63)
    four_s = 0.20 * (s4 * _C63 - c4 * _S63)
    T = 1.0 - one + 0.24 * c2 + three - four
    first = one_s - 0.48 * s2 - 3.0 * three_s + 4.0 * four_s
    second = one - 0.96 * c2 - 9.0 * three + 16.0 * four
    return T, first, second


@njit(**INLINED)
def _horner(p: tuple[float, float, float], w: float, c: float) -> tuple[float, float, float]:
    """One step of Horner's rule for a polynomial, its first and half its second derivative."""
    return p[0] * w + c, p[1] * w + p[0], p[2] * w + p[1]


@njit(**INLINED)
def _rotation(c: float, s: float) -> tuple[float, float, float]:
    """sin(2 dTheta) of the mean hue (c, s) with two derivatives in h (Sharma, Eqs. 16, 19).

    The standard takes h - 275 with h in 0..360 and does not wrap it: from 360 to 0 the term steps from 1e-5 to 0.
    """
    wrapped = c > 0.0 and s >= 0.0
    cosine = c * _C275 + s * _S275
    cosine = -0.5 if cosine < -0.5 else cosine  # beyond 120 degrees the term is below 2e-10; max() is not SIMD
    sine = s * _C275 - c * _S275
    half_cosine = math.sqrt(0.5 + 0.5 * cosine)
    w = 1.0 - half_cosine
    p = _horner((_Q[9], 0.0, 0.0), w, _Q[8])
    p = _horner(p, w, _Q[7])
    p = _horner(p, w, _Q[6])
    p = _horner(p, w, _Q[5])
    p = _horner(p, w, _Q[4])
    p = _horner(p, w, _Q[3])
    p = _horner(p, w, _Q[2])
    p = _horner(p, w, _Q[1])
    p = _horner(p, w, _Q[0])
    both = 1.0 / (half_cosine * p[0])
    w1, w2, inverse = 0.25 * sine * p[0] * both, 0.25 * half_cosine, half_cosine * both
    log_slope = p[1] * w1 * inverse
    log_curve = (2.0 * p[2] * w1 * w1 + p[1] * w2) * inverse
    e = 0.0 if wrapped else p[0] * p[0]
    e = e * e
    e = e * e
    e = e * e  # the 16th power: exp(-((h - 275) / 25)^2)
    e1 = 16.0 * e * log_slope
    e2 = 16.0 * e * (log_curve + 15.0 * log_slope * log_slope)
    z = e * e
    R = e * (_SIN[0] + z * (_SIN[1] + z * (_SIN[2] + z * (_SIN[3] + z * (_SIN[4] + z * (_SIN[5] + z * _SIN[6]))))))
    R1 = (math.pi / 3.0) * math.sqrt(1.0 - R * R)
    return R, R1 * e1, R1 * e2 - (math.pi / 3.0) ** 2 * R * e1 * e1


@njit(**INLINED)
def _chromatic_jet(a1: float, b1: float, a2: float, b2: float, softness: float) -> Jet:
    """The part of dE00^2 that depends on (a*, b*), as a jet in (a2, b2)."""
    # G: how much a* is stretched near gray (Sharma, Eqs. 2-5)
    C1_ab = math.sqrt(a1 * a1 + b1 * b1 + softness)
    C2_ab = math.sqrt(a2 * a2 + b2 * b2 + softness)
    inverse = 1.0 / C2_ab
    u, v, half = a2 * inverse, b2 * inverse, 0.5 * inverse
    C_jet = (0.0, 0.5 * u, 0.5 * v, half * v * v, -half * u * v, half * u * u)
    r, r1, r2 = _chroma_weight(0.5 * (C1_ab + C2_ab))
    k = _compose(C_jet, 1.5 - 0.5 * r, -0.5 * r1, -0.5 * r2)
    A1 = _scale(k, a1)
    A2 = (k[0] * a2, k[1] * a2 + k[0], k[2] * a2, k[3] * a2 + 2.0 * k[1], k[4] * a2 + k[2], k[5] * a2)
    # chromas C' and, as complex logarithms, hues h'
    C1, C2 = math.sqrt(A1[0] * A1[0] + b1 * b1 + softness), math.sqrt(A2[0] * A2[0] + b2 * b2 + softness)
    ln_C1, h1 = _log_jets(A1, b1, 0.0, softness)
    ln_C2, h2 = _log_jets(A2, b2, 1.0, softness)
    C1_jet, C2_jet = _compose(ln_C1, C1, C1, C1), _compose(ln_C2, C2, C2, C2)
    mean_C = _scale(_add(C1_jet, C2_jet), 0.5)
    # dH' = Im E, E = 2 exp(f + i g); its second derivatives are E (W'' + W' W')
    re, im = _geometric_mean(A1[0], b1, A2[0], b2, C1, C2)
    f = _scale(_add(ln_C1, ln_C2), 0.5)
    g = _scale(_add(h2, _scale(h1, -1.0)), 0.5)
    dH = (
        im,
        im * f[1] + re * g[1],
        im * f[2] + re * g[2],
        im * (f[3] + f[1] * f[1] - g[1] * g[1]) + re * (g[3] + 2.0 * f[1] * g[1]),
        im * (f[4] + f[1] * f[2] - g[1] * g[2]) + re * (g[4] + f[1] * g[2] + f[2] * g[1]),
        im * (f[5] + f[2] * f[2] - g[2] * g[2]) + re * (g[5] + 2.0 * f[2] * g[2]),
    )
    # weights at the mean hue, whose unit vector is z1 E / |z1 E|
    norm = 1.0 / (C1 * math.sqrt(re * re + im * im))
    c, s = (A1[0] * re - b1 * im) * norm, (b1 * re + A1[0] * im) * norm
    h = _scale(_add(h1, h2), 0.5)
    T, T1, T2 = _hue_weight(c, s)
    S_H = _scale(_multiply(mean_C, _compose(h, T, T1, T2)), 0.015)
    S_C = _scale(mean_C, 0.045)
    R, R1, R2 = _rotation(c, s)
    q, q1, q2 = _chroma_weight(mean_C[0])
    R_T = _multiply(_compose(mean_C, -2.0 * q, -2.0 * q1, -2.0 * q2), _compose(h, R, R1, R2))
    dC = _add(C2_jet, _scale(C1_jet, -1.0))
    X = _multiply(dC, _reciprocal((1.0 + S_C[0], S_C[1], S_C[2], S_C[3], S_C[4], S_C[5])))
    Y = _multiply(dH, _reciprocal((1.0 + S_H[0], S_H[1], S_H[2], S_H[3], S_H[4], S_H[5])))
    # X^2 + Y^2 + R_T X Y (Sharma, Eq. 22)
    return _add(_multiply(X, X), _multiply(Y, _add(Y, _multiply(R_T, X))))


@njit(**INLINED)
def _lightness_jet(L1: float, L2: float) -> tuple[float, float, float]:
    """((L2 - L1) / S_L)^2 with two derivatives in L2 (Sharma, Eq. 13)."""
    m = 0.5 * (L1 + L2) - 50.0
    root = 1.0 / math.sqrt(20.0 + m * m)
    root3 = root * root * root
    S = 1.0 + 0.015 * m * m * root
    # d/dm of m^2 (20 + m^2)^-1/2 is m (40 + m^2) (20 + m^2)^-3/2; S depends on L2 through m = L2 / 2
    S1 = 0.0075 * m * (40.0 + m * m) * root3
    S2 = 0.00375 * ((40.0 + 3.0 * m * m) * root3 - 3.0 * m * m * (40.0 + m * m) * root3 * root * root)
    inverse = 1.0 / S
    x = (L2 - L1) * inverse
    x1 = (1.0 - x * S1) * inverse
    x2 = -(2.0 * x1 * S1 + x * S2) * inverse
    return x * x, 2.0 * x * x1, 2.0 * (x1 * x1 + x * x2)


@njit(**INLINED)
def squared_dE00_jet(
    L1: float, a1: float, b1: float, L2: float, a2: float, b2: float, softness: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """dE00^2 with its derivatives with respect to the second colour; for use inside numba kernels.

    Parameters
    ----------
    L1, a1, b1, L2, a2, b2 : float
        The two colours, CIELAB.
    softness : float
        Added to squared chromas: `TRUE_dE00` for the formula itself; more rounds off the tip of the cone at gray and
        bounds second derivatives by about dE00 / sqrt(softness).

    Returns
    -------
    tuple of 8 floats
        Value; gradient d/dL, d/da, d/db; Hessian LL, aa, ab, bb (the entries La and Lb are 0).
    """
    lightness, L_1, L_2 = _lightness_jet(L1, L2)
    v, a, b, aa, ab, bb = _chromatic_jet(a1, b1, a2, b2, softness)
    value = lightness + v
    return 0.0 if value < 0.0 else value, L_1, a, b, L_2, aa, ab, bb


@njit(cache=True, nogil=True, error_model="numpy")
def _dE00_rows(Lab1: NDArray[np.floating], Lab2: NDArray[np.floating], out: NDArray[np.float64]) -> None:
    for i in range(out.size):
        L1, a1, b1 = Lab1[i, 0], Lab1[i, 1], Lab1[i, 2]
        out[i] = math.sqrt(squared_dE00_jet(L1, a1, b1, Lab2[i, 0], Lab2[i, 1], Lab2[i, 2], TRUE_dE00)[0])


def dE00(Lab1: ArrayLike, Lab2: ArrayLike) -> NDArray[np.float64]:
    """Colour difference CIEDE2000 with k_L = k_C = k_H = 1.

    Parameters
    ----------
    Lab1, Lab2 : (..., 3) arrays
        CIELAB colours; leading shapes broadcast.

    Returns
    -------
    (...) float64 array
        dE00, >= 0; NaN where a colour is not finite.

    Raises
    ------
    InputError
        If the last axis of a colour is not 3, or the leading shapes do not broadcast.
    """
    first, second = np.asarray(Lab1, np.float64), np.asarray(Lab2, np.float64)
    if first.shape[-1:] != (3,) or second.shape[-1:] != (3,):
        raise InputError(f"dE00 needs CIELAB colours of shape (..., 3), got {first.shape} and {second.shape}")
    try:
        shape = np.broadcast_shapes(first.shape, second.shape)
    except ValueError as error:
        raise InputError(
            f"dE00 needs colours whose leading shapes broadcast, got {first.shape} and {second.shape}"
        ) from error
    rows1, rows2 = (np.ascontiguousarray(np.broadcast_to(Lab, shape)).reshape(-1, 3) for Lab in (first, second))
    out = np.empty(len(rows1))
    _dE00_rows(rows1, rows2, out)
    return out.reshape(shape[:-1])
