"""Pictures -> projection codes at video speed, through one prepared plan (design: section 9, *FramePlan*).

Where every pair of colours can be reached, the inversion is linear in XYZ: x = 1/2 + G (y - A / 2) with a right inverse
G of A, and a pixel needs only its own cluster's N rows of it. With more inputs than equations (n > 6) half of the
reachable pairs have that x outside the box; *clip and correct* follows, x <- clip(x) + 1.6 G (y - A clip(x)), which is
continuous in the colours. Colours out of gamut are not looked after: the mapping given has to keep them inside, or
their x is just clipped (`invert` finds their optimum).

All in float32 and in SIMD lanes, rows of a frame shared by threads; memory is the frame itself. Knows pictures as
8-bit sRGB; nothing of files or displays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, sRGB_to_linear_sRGB
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.numba_options import INLINED

__all__ = ["AffineMapping", "FramePlan", "frame_to_codes", "plan_frame"]

Floats = NDArray[np.float32]

ROUNDS = 16
"""Of clip and correct: the worst of 20,000 reachable pairs is then 0.6 dE00 or better at K = 3."""

_LANE_LOOPS = {key: value for key, value in INLINED.items() if key != "forceinline"}
_LANES = 128
"""Pixels side by side: enough to hide what a loop costs to start, and few enough for the L1 cache."""
_TABLE = 4097
_STEP = np.float32(1.6)
_EPSILON = np.float32((6.0 / 29.0) ** 3)
_SLOPE = np.float32((29.0 / 6.0) ** 2 / 3.0)
_FOOT = np.float32(16.0 / 116.0)


@dataclass(frozen=True)
class AffineMapping:
    """Picture colours -> wanted colours on one surface: L* -> gain L* + offset, chroma times a factor.

    Attributes
    ----------
    L_gain, L_offset : float
        L* of black becomes `L_offset`, of white 100 `L_gain` + `L_offset`; both within 0..100.
    chroma_scale : float
        0..2; 0 is gray.
    """

    L_gain: float = 1.0
    L_offset: float = 0.0
    chroma_scale: float = 1.0

    def __post_init__(self) -> None:
        ends = (self.L_offset, self.L_offset + 100 * self.L_gain)
        if not all(0 <= L <= 100 for L in ends) or not 0 <= self.chroma_scale <= 2:
            raise InputError(
                "an affine mapping needs L_offset and 100 L_gain + L_offset in 0..100 and chroma_scale in 0..2, got "
                f"{self.L_gain}, {self.L_offset}, {self.chroma_scale}"
            )


@dataclass(frozen=True, eq=False)
class FramePlan:
    """Everything about an installation that does not change from frame to frame; made by `plan_frame`.

    Attributes
    ----------
    labels : (H, W) uint8 array
        Cluster of each projector pixel, 255 = outside the pattern.
    light : (256,) float32 array
        8-bit sRGB -> linear.
    mapping : (surfaces, 3) float32 array
        Offset, gain and chroma factor of CIELAB's f(Y), f(X) - f(Y) and f(Y) - f(Z).
    to_t : (3, 3) float32 array
        Linear sRGB -> XYZ over the picture's white.
    white : (surfaces, 3) float32 array
        White point of the model.
    G : (m, 3 surfaces) float32 array
        Right inverse of A.
    A : (3 surfaces, m) float32 array
        With columns of zeros up to a multiple of 3.
    base : (m,) float32 array
        x = base + G XYZ.
    black : (3 surfaces,) float32 array
    codes : (N, 4097) float32 array
        Device codes over a uniform grid of the square root of x.
    outside : int
        Code of pixels outside the pattern.
    """

    labels: NDArray[np.uint8]
    light: Floats
    mapping: Floats
    to_t: Floats
    white: Floats
    G: Floats
    A: Floats
    base: Floats
    black: Floats
    codes: Floats
    outside: int

    @property
    def surfaces(self) -> int:
        """1 or 2."""
        return len(self.mapping)


def plan_frame(
    model: PredictionModel,
    labels: NDArray[np.uint8],
    on_pattern: AffineMapping,
    on_white: AffineMapping | None = None,
    *,
    bits: int = 8,
    outside: str = "black",
) -> FramePlan:
    """Prepare what `frame_to_codes` needs.

    Parameters
    ----------
    model : PredictionModel
        Spectral and linear, with A of full row rank on the surfaces asked for.
    labels : (H, W) uint8 array
        Cluster of each projector pixel, 0..K-1; 255 = outside the pattern.
    on_pattern, on_white : AffineMapping
        What becomes of the colours of each picture; without `on_white` the pattern alone is asked for.
    bits : int
        Bits of a device code, 1..16.
    outside : "black" | "white"

    Raises
    ------
    InputError
        If the model has no second surface to ask for or cannot show every colour near its middle (rank), or labels
        and model do not fit.
    """
    if on_white is not None and model.white is None:
        raise InputError("a frame plan for two pictures needs a model with two surfaces; leave on_white out")
    surfaces = [model.pattern] + ([model.white] if on_white is not None and model.white is not None else [])
    A = np.concatenate([surface.A for surface in surfaces])
    values = np.linalg.svd(A, compute_uv=False)
    if A.shape[0] > model.n or values[-1] <= 1e-6 * values[0]:
        raise InputError(
            f"a frame plan needs {A.shape[0]} independent inputs or more, this model's {model.n} are not: "
            "use paxel_runtime.invert"
        )
    known = labels[labels != 255]
    if labels.ndim != 2 or labels.dtype != np.uint8 or (known.size and known.max() >= len(model.clusters)):
        raise InputError(
            f"cluster labels must be (H, W) uint8 below {len(model.clusters)} or 255, got {labels.dtype} "
            f"{labels.shape} up to {known.max() if known.size else 'none'}"
        )
    if not 1 <= bits <= 16 or outside not in ("black", "white"):
        raise InputError(f"bits must be 1..16 and outside black or white, got {bits} and {outside!r}")
    black = np.concatenate([surface.black for surface in surfaces])
    # inputs that light nothing fill up to a multiple of 3, as the kernel walks
    A = np.pad(A, ((0, 0), (0, -model.n % 3)))
    G = np.linalg.pinv(A)
    full = 2**bits - 1
    grid = np.linspace(0.0, 1.0, _TABLE) ** 2  # of the square root of x: responses are steep near black
    codes = model.response.x_to_P(np.repeat(grid[:, None], len(model.channels), axis=1)).T * full
    # f(Y) = (L* + 16) / 116, so L* -> gain L* + offset is affine in f(Y)
    mappings = [on_pattern] + ([on_white] if on_white is not None else [])
    rows = [((16 + m.L_offset - 16 * m.L_gain) / 116, m.L_gain, m.chroma_scale) for m in mappings]
    return FramePlan(
        labels=np.ascontiguousarray(labels),
        light=sRGB_to_linear_sRGB(np.arange(256) / 255).astype(np.float32),
        mapping=np.array(rows, np.float32),
        to_t=(linear_sRGB_to_XYZ(np.eye(3)).T / D65_XYZ[:, None]).astype(np.float32),
        white=np.tile(model.white_point, (len(surfaces), 1)).astype(np.float32),
        G=G.astype(np.float32),
        A=A.astype(np.float32),
        base=(0.5 - G @ (black + A.sum(axis=1) / 2)).astype(np.float32),
        black=black.astype(np.float32),
        codes=np.ascontiguousarray(codes, np.float32),
        outside=full if outside == "white" else 0,
    )


def frame_to_codes(
    plan: FramePlan, on_pattern: NDArray[np.uint8], on_white: NDArray[np.uint8] | None = None
) -> NDArray[np.unsignedinteger]:
    """Projection image of one frame (Eqs. 5 to 7 for colours inside the gamut).

    Parameters
    ----------
    plan : FramePlan
    on_pattern, on_white : (H, W, 3) uint8 arrays
        sRGB pictures on the projector's raster; `on_white` if the plan has two surfaces.

    Returns
    -------
    (H, W, N) uint8 (up to 8 bits) or uint16 array

    Raises
    ------
    InputError
        If a picture is missing, too many, or not 8-bit sRGB of the plan's size.
    """
    pictures = [on_pattern] + ([on_white] if on_white is not None else [])
    if len(pictures) != plan.surfaces:
        raise InputError(f"this frame plan needs {plan.surfaces} pictures, got {len(pictures)}")
    for picture in pictures:
        if picture.shape != (*plan.labels.shape, 3) or picture.dtype != np.uint8:
            raise InputError(
                f"a frame must be (H, W, 3) uint8 sRGB of {plan.labels.shape}, got {picture.dtype} {picture.shape}"
            )
    first, second = np.ascontiguousarray(pictures[0]), np.ascontiguousarray(pictures[-1])
    dtype = np.uint8 if plan.codes[:, -1].max() < 255.5 else np.uint16
    out = np.empty((*plan.labels.shape, len(plan.codes)), dtype)
    p = plan
    _fill_codes(
        first, second, p.labels, p.light, p.mapping, p.to_t, p.white, p.G, p.A, p.base, p.black, p.codes, p.outside, out
    )
    return out


@njit(**INLINED)
def _f(t: np.float32) -> np.float32:
    """CIELAB's f(t) for t in 0..1.1: a rational guess of t^(-1/3) and two steps of third order, to float32."""
    r = t if t > _EPSILON else _EPSILON
    z = (np.float32(6.45678683) + np.float32(90.25077234) * r) / (
        np.float32(1.0) + r * (np.float32(59.37364678) + np.float32(38.11441394) * r)
    )
    h = np.float32(1.0) - r * z * z * z
    z += z * h * (np.float32(1.0 / 3.0) + h * np.float32(2.0 / 9.0))
    h = np.float32(1.0) - r * z * z * z
    z += z * h * (np.float32(1.0 / 3.0) + h * np.float32(2.0 / 9.0))
    return r * z * z if t > _EPSILON else _SLOPE * t + _FOOT


@njit(**INLINED)
def _inverse_f(f: np.float32) -> np.float32:
    return f * f * f if f > np.float32(6.0 / 29.0) else (f - _FOOT) / _SLOPE


@njit(**INLINED)
def _clip(t: np.float32) -> np.float32:
    low = t if t > np.float32(0.0) else np.float32(0.0)
    return low if low < np.float32(1.0) else np.float32(1.0)


@njit(**_LANE_LOOPS)
def _wanted_XYZ(rgb: Floats, mapping: Floats, to_t: Floats, white: Floats, surface: int, y: Floats) -> None:
    """Rows 3 surface.. of y: XYZ that the mapping makes of linear sRGB, lane by lane."""
    foot, gain, chroma = mapping[surface, 0], mapping[surface, 1], mapping[surface, 2]
    m00, m01, m02 = to_t[0, 0], to_t[0, 1], to_t[0, 2]
    m10, m11, m12 = to_t[1, 0], to_t[1, 1], to_t[1, 2]
    m20, m21, m22 = to_t[2, 0], to_t[2, 1], to_t[2, 2]
    wx, wy, wz = white[surface, 0], white[surface, 1], white[surface, 2]
    for lane in range(_LANES):
        r, g, b = rgb[0, lane], rgb[1, lane], rgb[2, lane]
        fx = _f(m00 * r + m01 * g + m02 * b)
        fy = _f(m10 * r + m11 * g + m12 * b)
        fz = _f(m20 * r + m21 * g + m22 * b)
        to = foot + gain * fy
        y[3 * surface, lane] = wx * _inverse_f(to + chroma * (fx - fy))
        y[3 * surface + 1, lane] = wy * _inverse_f(to)
        y[3 * surface + 2, lane] = wz * _inverse_f(to - chroma * (fy - fz))


@njit(**_LANE_LOOPS)
def _add_products(M: Floats, y: Floats, x: Floats) -> None:
    """x += M y in every lane; M (rows, columns), y (columns, lanes), x (rows, lanes); columns a multiple of 3."""
    for i in range(M.shape[0]):
        for k in range(0, M.shape[1], 3):
            m0, m1, m2 = M[i, k], M[i, k + 1], M[i, k + 2]
            xi, y0, y1, y2 = x[i], y[k], y[k + 1], y[k + 2]
            for lane in range(_LANES):
                xi[lane] += m0 * y0[lane] + m1 * y1[lane] + m2 * y2[lane]


@njit(**_LANE_LOOPS)
def _clip_and_correct(G_step: Floats, A_minus: Floats, black: Floats, y: Floats, left: Floats, x: Floats) -> None:
    """x <- clip(x) + 1.6 G (y - black - A clip(x)), until all lanes are in the box or the rounds are over."""
    for _ in range(ROUNDS):
        outside = 0
        for j in range(x.shape[0]):
            xj = x[j]
            for lane in range(_LANES):
                inside = _clip(xj[lane])
                outside += 1 if abs(xj[lane] - inside) > np.float32(1e-5) else 0
                xj[lane] = inside
        if outside == 0:
            break
        for i in range(left.shape[0]):
            left_i, yi, dark = left[i], y[i], black[i]
            for lane in range(_LANES):
                left_i[lane] = yi[lane] - dark
        _add_products(A_minus, x, left)
        _add_products(G_step, left, x)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def _row_codes(
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    labels: NDArray[np.uint8],
    light: Floats,
    mapping: Floats,
    to_t: Floats,
    white: Floats,
    G: Floats,
    A_minus: Floats,
    base: Floats,
    black: Floats,
    table: Floats,
    outside: int,
    out: NDArray[np.unsignedinteger],
) -> None:
    """Codes of one row of the frame."""
    n, equations, channels = G.shape[0], G.shape[1], table.shape[0]
    last = table.shape[1] - 1
    G_step = _STEP * G
    rgb = np.empty((3, _LANES), np.float32)
    y = np.empty((equations, _LANES), np.float32)
    left = np.empty((equations, _LANES), np.float32)
    x = np.empty((n, _LANES), np.float32)
    for start in range(0, labels.size, _LANES):
        count = min(_LANES, labels.size - start)
        for s in range(equations // 3):
            picture = first if s == 0 else second
            for lane in range(count):
                rgb[0, lane] = light[picture[start + lane, 0]]
                rgb[1, lane] = light[picture[start + lane, 1]]
                rgb[2, lane] = light[picture[start + lane, 2]]
            for lane in range(count, _LANES):
                rgb[0, lane], rgb[1, lane], rgb[2, lane] = rgb[0, 0], rgb[1, 0], rgb[2, 0]
            _wanted_XYZ(rgb, mapping, to_t, white, s, y)
        for j in range(n):
            for lane in range(_LANES):
                x[j, lane] = base[j]
        _add_products(G, y, x)
        if n > equations:
            _clip_and_correct(G_step, A_minus, black, y, left, x)
        for lane in range(count):
            label = labels[start + lane]
            for j in range(channels):
                if label == 255:
                    out[start + lane, j] = outside
                else:
                    place = np.sqrt(_clip(x[label * channels + j, lane])) * np.float32(last)
                    i = min(np.int64(place), last - 1)
                    value = table[j, i] + (place - np.float32(i)) * (table[j, i + 1] - table[j, i])
                    out[start + lane, j] = np.int64(value + np.float32(0.5))


@njit(cache=True, parallel=True)
def _fill_codes(
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    labels: NDArray[np.uint8],
    light: Floats,
    mapping: Floats,
    to_t: Floats,
    white: Floats,
    G: Floats,
    A: Floats,
    base: Floats,
    black: Floats,
    table: Floats,
    outside: int,
    out: NDArray[np.unsignedinteger],
) -> None:
    """`out`: codes of every pixel's own cluster."""
    A_minus = -A
    for row in prange(labels.shape[0]):
        _row_codes(
            first[row],
            second[row],
            labels[row],
            light,
            mapping,
            to_t,
            white,
            G,
            A_minus,
            base,
            black,
            table,
            outside,
            out[row],
        )
