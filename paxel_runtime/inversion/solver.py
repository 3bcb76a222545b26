"""Wanted colours on both surfaces -> linear inputs x (Eqs. 5 and 7 of the paper).

Minimises w_p dE00(pattern)^2 + w_w dE00(white)^2 over 0 <= x <= 1, pixel by pixel, in three stages (design,
section 9); each takes only the pixels the one before it left:

1. *Linear solve* about x = 1/2. In the box: both colours are met exactly.
2. Where inputs outnumber equations, the x *in the box* nearest to 1/2 that meets both colours, if there is one. It is
   unique and moves continuously with the wanted colours, so noise in a picture stays noise of the same size in x.
3. Out of gamut: *Newton's method* on dE00^2 + dE00^2 with exact Hessians. XYZ is linear in x, so each step is a
   quadratic programme in 6 values of XYZ, whatever the number of inputs, and its answer is the nearest one to 1/2.

A model with a measured correction c(x) is solved for wanted XYZ - c(x) a few times over (*polish*): c is small and
smooth, so x settles quickly. An image-based model has another A at each pixel: stage 2 takes the place of stage 1.

Pictures stream through in chunks, shared by threads. Nothing here knows files, clusters' places or codes.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.inversion import kernels
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.correction import Correction
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = ["CAPPED", "EXACT", "OPTIMUM", "STATUS_NAMES", "Inversion", "invert"]

EXACT = kernels.EXACT
"""Both colours are within the gamut and x gives them."""
OPTIMUM = kernels.OPTIMUM
"""Out of gamut: x is a minimum of the objective."""
CAPPED = kernels.CAPPED
"""Out of gamut, and the bound of iterations was met: x is the best found, near a minimum."""

STATUS_NAMES = {EXACT: "exact", OPTIMUM: "optimum", CAPPED: "capped"}

_LARGEST_LAB = 1000.0
_POLISH_ROUNDS = 8
_SETTLED_DE00 = 0.005  # polishing a corrected colour stops here
_MET_DE00 = 0.01  # and this near it counts as met
_CHUNK = 16384  # pixels: a few MB of work space a thread, some 10 ms of work


@dataclass(frozen=True, eq=False)
class Inversion:
    """The inputs that show wanted colours, and how near they come.

    Attributes
    ----------
    x : (..., n) float32 or float64 array
        Linear inputs, 0..1; x[i * N + j] is channel j on cluster i.
    dE_pattern : (...) array
        dE00 (or dE76, if that was asked for) on the pattern between the wanted colour and the colour of x, recomputed
        from x.
    dE_white : (...) array or None
        The same on the white surface; None with one surface.
    status : (...) uint8 array
        `EXACT`, `OPTIMUM` or `CAPPED`.
    """

    x: NDArray[np.floating]
    dE_pattern: NDArray[np.floating]
    dE_white: NDArray[np.floating] | None
    status: NDArray[np.uint8]

    def counts(self) -> dict[str, int]:
        """Number of pixels of each status, by name."""
        return {name: int(np.count_nonzero(self.status == value)) for value, name in STATUS_NAMES.items()}


@dataclass(frozen=True, eq=False)
class _System:
    """The model as the kernels want it: 6 equations, those of an absent surface zero."""

    surfaces: int
    AT: NDArray[np.float64]  # (n, 6), or (pixels, n, 6) of an image-based model's chunk
    black: NDArray[np.float64]  # (6,) or (pixels, 6)
    white: NDArray[np.float64]
    weights: NDArray[np.float64]
    euclidean: bool
    right_inverse: NDArray[np.float64] | None  # None where A has no full row rank: XYZ that no x gives
    correction: Correction | None

    @property
    def is_unique(self) -> bool:
        """Whether a colour pair has one x at most: then one outside the box means out of gamut."""
        return self.right_inverse is not None and len(self.AT) == 3 * self.surfaces


def invert(
    Lab_pattern: ArrayLike,
    Lab_white: ArrayLike | None,
    model: PredictionModel,
    *,
    weights: tuple[float, float] = (1.0, 1.0),
    metric: str = "dE00",
    progress: Callable[[int, int], None] | None = None,
) -> Inversion:
    """Find the linear inputs that show one colour on the pattern and another on the white surface.

    Parameters
    ----------
    Lab_pattern : (..., 3) array
        Wanted CIELAB on the pattern, relative to the model's white point.
    Lab_white : (..., 3) array or None
        Wanted CIELAB on the second surface, of the same shape; None to ask for the pattern alone (Eq. 7).
    model : PredictionModel
        A (3, n) on each surface; or an image-based one, A (H, W, 3, n), for pictures of (H, W) pixels. Its correction,
        if it has one, is part of what is solved.
    weights : (float, float)
        Weights of dE00^2 on the pattern and on the white surface, > 0; only their ratio matters.
    metric : "dE00" | "dE76"
        Colour difference that is minimised and reported; dE76 is the plain distance in CIELAB.
    progress : callable, optional
        Called as ``progress(pixels_done, pixels)`` after each chunk, from the calling thread.

    Returns
    -------
    Inversion
        float32 where every wanted colour came as float32, else float64. An `OPTIMUM` includes a regulariser of
        1e-4 |x - 1/2|^2, which picks one x among equals and costs at most 2.5e-5 n in dE00^2.

    Raises
    ------
    InputError
        If a picture is not (..., 3), empty or not finite, the two differ in shape, a second picture is asked of a
        model with one surface, an image-based model is of another size, the model has no positive white point, or a
        weight is not positive.
    """
    pattern = _picture(Lab_pattern, "Lab_pattern")
    white = None if Lab_white is None else _picture(Lab_white, "Lab_white")
    system_of = _systems(model, Lab_white is not None, weights, metric, pattern.shape[:-1])
    if white is not None and white.shape != pattern.shape:
        raise InputError(
            f"invert: Lab_pattern and Lab_white must have one shape, got {pattern.shape} and {white.shape}"
        )
    shape = pattern.shape[:-1]
    given = [pattern] if white is None else [pattern, white]
    dtype = np.float32 if all(Lab.dtype == np.float32 for Lab in given) else np.float64
    rows = [Lab.reshape(-1, 3) for Lab in given]
    pixels = len(rows[0])
    x = np.empty((pixels, model.n), dtype)
    dE = np.empty((len(given), pixels), dtype)
    status = np.empty(pixels, np.uint8)

    def solve(chunk: slice) -> int:
        x[chunk], dE[:, chunk], status[chunk] = _invert_chunk([Lab[chunk] for Lab in rows], system_of(chunk), dtype)
        return chunk.stop - chunk.start

    _each_chunk(solve, pixels, progress)
    return Inversion(
        x=x.reshape(*shape, model.n),
        dE_pattern=dE[0].reshape(shape),
        dE_white=None if white is None else dE[1].reshape(shape),
        status=status.reshape(shape),
    )


def _invert_chunk(
    rows: list[NDArray[np.floating]], system: _System, dtype: type[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.uint8]]:
    """All stages for a few thousand pixels; x (m, n), dE (surfaces, m), status (m,)."""
    Lab = np.zeros((len(rows[0]), 6))  # L* = 0 for an absent surface: XYZ = 0, as its zero rows of A give
    for s, picture in enumerate(rows):
        Lab[:, 3 * s : 3 * s + 3] = picture
    x, status = _solve(Lab, system)
    if system.correction is not None:
        x, status = _polish(Lab, x, status, system)
    x_out = x.astype(dtype)
    return x_out, _errors(x_out.astype(np.float64), Lab, system).T, status


def _solve(Lab: NDArray[np.float64], system: _System) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """The three stages on A x + black; x (m, n), status (m,)."""
    AT, black, white = system.AT, system.black, system.white
    x = np.empty((len(Lab), AT.shape[-2]))
    status = np.full(len(Lab), kernels.PENDING, np.uint8)
    if system.right_inverse is not None:
        kernels.solve_linear(Lab, AT, system.right_inverse, black, white, x, status)
    if not system.is_unique:
        queue = np.flatnonzero(status == kernels.PENDING)
        kernels.solve_in_box(Lab, queue, AT, black, white, x, status)
    queue = np.flatnonzero(status == kernels.PENDING)
    kernels.newton(Lab, queue, system.surfaces, AT, black, white, system.weights, system.euclidean, x, status)
    return x, status


def _polish(
    Lab: NDArray[np.float64], x: NDArray[np.float64], status: NDArray[np.uint8], system: _System
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Solve again for the wanted XYZ less the correction at the x so far; keep what comes nearer, pixel by pixel."""
    white = np.tile(system.white, 2)
    wanted = np.concatenate([Lab_to_XYZ(Lab[:, s : s + 3], system.white) for s in (0, 3)], axis=1)
    dE = _errors(x, Lab, system)
    todo = np.flatnonzero(dE.max(axis=1) > _SETTLED_DE00)
    for _ in range(_POLISH_ROUNDS):
        if not len(todo):
            break
        aim = wanted[todo] - _more_XYZ(x[todo], system)
        aim_Lab = np.concatenate([XYZ_to_Lab(aim[:, s : s + 3], white[:3]) for s in (0, 3)], axis=1)
        tried, tried_status = _solve(aim_Lab, system)
        tried_dE = _errors(tried, Lab[todo], system)
        nearer = tried_dE**2 @ system.weights[: system.surfaces] < dE[todo] ** 2 @ system.weights[: system.surfaces]
        x[todo[nearer]], status[todo[nearer]], dE[todo[nearer]] = tried[nearer], tried_status[nearer], tried_dE[nearer]
        todo = todo[nearer & (tried_dE.max(axis=1) > _SETTLED_DE00)]
    met = dE.max(axis=1) <= _MET_DE00
    return x, np.where(met, kernels.EXACT, np.where(status == kernels.EXACT, kernels.OPTIMUM, status)).astype(np.uint8)


def _more_XYZ(x: NDArray[np.float64], system: _System) -> NDArray[np.float64]:
    """What the correction adds at x on both surfaces, (m, 6)."""
    more = np.zeros((len(x), 6))
    if system.correction is not None:
        more[:, : 3 * system.surfaces] = system.correction.XYZ(x)[:, : system.surfaces].reshape(len(x), -1)
    return more


def _errors(x: NDArray[np.float64], Lab: NDArray[np.float64], system: _System) -> NDArray[np.float64]:
    """dE00 on each surface of what x really shows, correction included, (m, surfaces)."""
    black = system.black if system.correction is None else system.black + _more_XYZ(x, system)
    dE = np.empty((len(x), system.surfaces))
    kernels.evaluate(x, Lab, system.surfaces, system.AT, black, system.white, system.euclidean, dE)
    return dE


def _each_chunk(solve: Callable[[slice], int], pixels: int, progress: Callable[[int, int], None] | None) -> None:
    """Run `solve` on every chunk, on as many threads as numba may use; a failure or Ctrl-C drops what is left."""
    threads = numba.config.NUMBA_NUM_THREADS
    size = max(min(_CHUNK, -(-pixels // threads)), 1024)
    chunks = [slice(first, min(first + size, pixels)) for first in range(0, pixels, size)]
    done = 0
    if min(len(chunks), threads) == 1:
        for chunk in chunks:
            done += solve(chunk)
            if progress is not None:
                progress(done, pixels)
        return
    pool = ThreadPoolExecutor(threads)
    try:
        for future in as_completed([pool.submit(solve, chunk) for chunk in chunks]):
            done += future.result()
            if progress is not None:
                progress(done, pixels)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _picture(Lab: ArrayLike, name: str) -> NDArray[np.floating]:
    array = np.asarray(Lab)
    if array.dtype != np.float32:
        array = array.astype(np.float64, copy=False)
    if array.shape[-1:] != (3,):
        raise InputError(f"invert: {name} must be CIELAB of shape (..., 3), got {array.shape}")
    if array.size == 0:
        raise InputError(f"invert: {name} must hold at least one colour, got {array.shape}")
    wrong = int(np.count_nonzero(~(np.abs(array) <= _LARGEST_LAB).all(axis=-1)))
    if wrong:
        raise InputError(
            f"invert: {name} must be finite CIELAB within {_LARGEST_LAB:.0f}, got {wrong} pixels with NaN, infinity or "
            "larger values; fill them, or convert the picture to CIELAB, before inverting"
        )
    return array


def _systems(
    model: PredictionModel, two: bool, weights: tuple[float, float], metric: str, shape: tuple[int, ...]
) -> Callable[[slice], _System]:
    """The system of a chunk of pixels: one for all, or each pixel's own, read as it is asked for."""
    if two and model.white is None:
        raise InputError("invert: the model has one surface; give Lab_white = None, or a model with a white surface")
    surfaces = [surface for surface in (model.pattern, model.white if two else None) if surface is not None]
    white = np.asarray(model.white_point, np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or not np.all(white > 0):
        raise InputError(f"invert: the model's white_point must be 3 positive XYZ values, got {model.white_point}")
    if len(weights) != 2 or not all(np.isfinite(w) and w > 0 for w in weights):
        raise InputError(f"invert: weights must be two numbers > 0, got {weights}")
    if metric not in ("dE00", "dE76"):
        raise InputError(f"invert: metric must be dE00 or dE76, got {metric!r}")
    euclidean = metric == "dE76"
    share = np.array(weights[: len(surfaces)] + (1.0,) * (2 - len(surfaces)), np.float64)
    share /= share[: len(surfaces)].mean()
    if surfaces[0].A.ndim > 2:
        return _local_systems(model, surfaces, white, share, euclidean, shape)
    AT, black = _equations([surface.A for surface in surfaces], [surface.black for surface in surfaces])
    if not (np.isfinite(AT).all() and np.isfinite(black).all()):
        raise InputError("invert: the model's A and black must be finite; calibrate anew: paxel calibrate --force")
    rows = 3 * len(surfaces)
    # Below 1e-6 of the largest singular value A is singular for measured data, and a linear solve is not exact.
    singular_values = np.linalg.svd(AT[:, :rows], compute_uv=False)
    inverse = None
    if model.n >= rows and singular_values[-1] > 1e-6 * singular_values[0]:
        inverse = np.zeros((model.n, 6))
        inverse[:, :rows] = np.linalg.pinv(AT[:, :rows].T)
    system = _System(len(surfaces), AT, black, white, share, euclidean, inverse, model.correction)
    return lambda chunk: system


def _local_systems(
    model: PredictionModel,
    surfaces: list[SurfaceModel],
    white: NDArray[np.float64],
    share: NDArray[np.float64],
    euclidean: bool,
    shape: tuple[int, ...],
) -> Callable[[slice], _System]:
    """Each pixel's own equations, a chunk at a time; A may be memory-mapped."""
    for name, surface in zip(("pattern", "white"), surfaces, strict=False):
        if surface.A.shape[:-2] != shape:
            raise InputError(
                f"invert: an image-based model of {surface.A.shape[:-2]} pixels ({name}) needs pictures of that size, "
                f"got {shape}"
            )
    A = [surface.A.reshape(-1, 3, model.n) for surface in surfaces]
    dark = [np.broadcast_to(surface.black, (*shape, 3)).reshape(-1, 3) for surface in surfaces]

    def system_of(chunk: slice) -> _System:
        AT, black = _equations([a[chunk] for a in A], [b[chunk] for b in dark])
        # where the camera saw nothing no light arrives: x stays in the middle
        unseen = ~(np.isfinite(AT).all(axis=(1, 2)) & np.isfinite(black).all(axis=1))
        AT[unseen], black[unseen] = 0.0, 0.0
        return _System(len(surfaces), AT, black, white, share, euclidean, None, model.correction)

    return system_of


def _equations(
    A: list[NDArray[np.floating]], black: list[NDArray[np.floating]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A^T (..., n, 6) and black (..., 6) of both surfaces, zero where there is none."""
    *pixels, _, n = A[0].shape
    AT, dark = np.zeros((*pixels, n, 6)), np.zeros((*pixels, 6))
    for s, (a, b) in enumerate(zip(A, black, strict=True)):
        AT[..., 3 * s : 3 * s + 3] = np.swapaxes(a, -1, -2)
        dark[..., 3 * s : 3 * s + 3] = b
    return AT, dark
