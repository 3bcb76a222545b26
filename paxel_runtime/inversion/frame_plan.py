"""Pictures -> projection codes at video speed, through one prepared plan (design: section 9, *FramePlan*).

Where every pair of colours can be reached, the inversion is linear in XYZ: x = 1/2 + G (y - A / 2) with the right
inverse G of A, and a pixel needs only its own cluster's N rows of it. With more inputs than equations (n > 6) half of
the reachable pairs have that x outside the box; *clip and correct* follows, x <- clip(x) + 1.6 G (y - A clip(x)), which
is continuous in the colours. G A = 1 - N N^T, with N an orthonormal basis of what A does not see; so a round is
x <- 1.6 G y - 0.6 clip(x) + 1.6 N (N^T clip(x)), at K = 3 half of the multiplications (the other form is taken where N
has more columns than A has rows).

A mapping is affine, or a table of one. Colours out of gamut are not looked after: the mapping given has to keep them
inside, or their x is just clipped (`invert` finds their optimum).

Knows pictures as 8-bit sRGB; nothing of files or displays. Memory is the frame itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.inversion.frame_kernels import STEP, fill_codes
from paxel_runtime.inversion.table import MappingTable
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, sRGB_to_linear_sRGB
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["AffineMapping", "FramePlan", "frame_to_codes", "plan_frame"]

Floats = NDArray[np.float32]

_TABLE = 4097
_NO_TABLE = np.zeros((0, 3), np.float32)


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
    affine : (surfaces, 3) float32 array
        Offset, gain and chroma factor of CIELAB's f(Y), f(X) - f(Y) and f(Y) - f(Z); not used where there is a table.
    tables : 2 (nodes^3, 3) float32 arrays
        CIELAB's f(X), f(Y), f(Z) of the wanted colour, by picture colour, for each surface; empty where the mapping is
        affine.
    nodes : (int, int)
        Nodes an axis of the tables; 0 where there is none.
    to_t : (3, 3) float32 array
        Linear sRGB -> XYZ over the picture's white.
    white : (3,) float32 array
        White point of the model.
    G : (m, 3 surfaces) float32 array
        Right inverse of A, with rows of zeros up to a multiple of 3.
    base : (m,) float32 array
        x = base + G XYZ.
    keep, U, V, rest : float, (m, r), (r, m), (m,) float32 arrays
        A round of clip and correct: x <- g + keep clip(x) + U (V clip(x)), g = 1.6 (base + G XYZ - rest); r = 0 where n
        is the number of equations.
    codes : (N, 4097) float32 array
        Device codes over a uniform grid of the square root of x.
    outside : int
        Code of pixels outside the pattern.
    """

    labels: NDArray[np.uint8]
    light: Floats
    affine: Floats
    tables: tuple[Floats, Floats]
    nodes: tuple[int, int]
    to_t: Floats
    white: Floats
    G: Floats
    base: Floats
    keep: np.float32
    U: Floats
    V: Floats
    rest: Floats
    codes: Floats
    outside: int

    @property
    def surfaces(self) -> int:
        """1 or 2."""
        return len(self.affine)


def plan_frame(
    model: PredictionModel,
    labels: NDArray[np.uint8],
    on_pattern: AffineMapping | MappingTable,
    on_white: AffineMapping | MappingTable | None = None,
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
    on_pattern, on_white : AffineMapping or MappingTable
        What becomes of the colours of each picture; without `on_white` the pattern alone is asked for.
    bits : int
        Bits of a device code, 1..16.
    outside : "black" | "white"

    Raises
    ------
    InputError
        If the model is image-based, has no second surface to ask for or cannot show every colour near its middle
        (rank), or labels and model do not fit.
    """
    if on_white is not None and model.white is None:
        raise InputError("a frame plan for two pictures needs a model with two surfaces; leave on_white out")
    if model.pattern.A.ndim != 2:
        raise InputError("a frame plan needs one A for all pixels, this model is image-based: use paxel_runtime.invert")
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
    G = np.linalg.pinv(A)
    unseen = np.linalg.svd(A)[2][len(A) :]  # N^T
    if len(unseen) <= len(A):
        keep, U, V = 1.0 - STEP, STEP * unseen.T, unseen
    else:
        keep, U, V = 1.0, -STEP * G, A
    full = 2**bits - 1
    grid = np.linspace(0.0, 1.0, _TABLE) ** 2  # of the square root of x: responses are steep near black
    codes = model.response.x_to_P(np.repeat(grid[:, None], len(model.channels), axis=1)).T * full
    mappings = [on_pattern] + ([on_white] if on_white is not None else [])
    tables = [_table_of_f(mapping) for mapping in mappings] + [_NO_TABLE]
    return FramePlan(
        labels=np.ascontiguousarray(labels),
        light=sRGB_to_linear_sRGB(np.arange(256) / 255).astype(np.float32),
        affine=np.array([_affine_in_f(mapping) for mapping in mappings], np.float32),
        tables=(tables[0], tables[1]),
        nodes=(_nodes(tables[0]), _nodes(tables[1])),
        to_t=(linear_sRGB_to_XYZ(np.eye(3)).T / D65_XYZ[:, None]).astype(np.float32),
        white=model.white_point.astype(np.float32),
        G=_filled_up(G),
        base=_filled_up(0.5 - G @ (black + A.sum(axis=1) / 2)),
        keep=np.float32(keep),
        U=_filled_up(U),
        V=_filled_up(V),
        rest=_filled_up(0.5 - (G @ A).sum(axis=1) / 2),
        codes=np.ascontiguousarray(codes, np.float32),
        outside=full if outside == "white" else 0,
    )


def _filled_up(values: NDArray[np.float64]) -> Floats:
    """With zeros up to multiples of 3, as the kernel walks."""
    return np.ascontiguousarray(np.pad(values, [(0, -size % 3) for size in values.shape]), np.float32)


def _affine_in_f(mapping: AffineMapping | MappingTable) -> tuple[float, float, float]:
    """f(Y) = (L* + 16) / 116, so L* -> gain L* + offset is affine in f(Y)."""
    if isinstance(mapping, MappingTable):
        return 0.0, 0.0, 0.0
    return (16 + mapping.L_offset - 16 * mapping.L_gain) / 116, mapping.L_gain, mapping.chroma_scale


def _table_of_f(mapping: AffineMapping | MappingTable) -> Floats:
    """f of X, Y and Z over the white point, in which CIELAB is linear: (nodes^3, 3)."""
    if isinstance(mapping, AffineMapping):
        return _NO_TABLE
    L, a, b = np.moveaxis(mapping.Lab.reshape(-1, 3).astype(np.float64), -1, 0)
    fy = (L + 16) / 116
    return np.stack([fy + a / 500, fy, fy - b / 200], axis=-1).astype(np.float32)


def _nodes(table: Floats) -> int:
    return round(len(table) ** (1 / 3))


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
    dtype = np.uint8 if plan.codes[:, -1].max() < 255.5 else np.uint16
    out = np.empty((*plan.labels.shape, len(plan.codes)), dtype)
    first, second = np.ascontiguousarray(pictures[0]), np.ascontiguousarray(pictures[-1])
    p = plan

    def work(top: int, end: int) -> None:
        rows = (first[top:end].reshape(-1, 3), second[top:end].reshape(-1, 3))
        fill_codes(
            rows, p.labels[top:end].ravel(), p.light, p.affine, p.tables, p.nodes, p.to_t, p.white, p.G, p.base,
            p.keep, p.U, p.V, p.rest, p.codes, p.outside, out[top:end].reshape(-1, out.shape[-1]),
        )  # fmt: skip

    in_bands(work, len(out))
    return out
