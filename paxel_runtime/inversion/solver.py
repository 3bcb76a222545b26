"""Wanted colours on both surfaces -> linear inputs x (Eqs. 5 and 7 of the paper).

Minimises w_p dE00(pattern)^2 + w_w dE00(white)^2 over 0 <= x <= 1, pixel by pixel, in three stages (design,
section 9); each takes only the pixels the one before it left:

1. *Linear solve* about x = 1/2. In the box: both colours are met exactly.
2. Where inputs outnumber equations, the x *in the box* nearest to 1/2 that meets both colours, if there is one. It is
   unique and moves continuously with the wanted colours, so noise in a picture stays noise of the same size in x.
3. Out of gamut: *Newton's method* on dE00^2 + dE00^2 with exact Hessians. XYZ is linear in x, so each step is a
   quadratic programme in 6 values of XYZ, whatever the number of inputs, and its answer is the nearest one to 1/2.
   Several starts where the colours are so far out that there may be several minima (`search`).

A model with a measured correction c(x) is solved for wanted XYZ - c(x) a few times over (*polish*): c is small and
smooth, so x settles quickly. An image-based model has another A at each pixel: stage 2 takes the place of stage 1.

Pictures stream through in chunks, shared by threads. Nothing here knows files, clusters' places or codes.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.inversion.exact import EXACT, PENDING, solve_linear
from paxel_runtime.inversion.newton import CAPPED, OPTIMUM
from paxel_runtime.inversion.search import errors, search
from paxel_runtime.inversion.system import System, systems
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["CAPPED", "EXACT", "OPTIMUM", "STATUS_NAMES", "Inversion", "invert"]

STATUS_NAMES = {EXACT: "exact", OPTIMUM: "optimum", CAPPED: "capped"}
"""EXACT: both colours are within the gamut and x gives them. OPTIMUM: out of gamut, x is a minimum of the objective.
CAPPED: out of gamut, and the bound of iterations was met: x is the best found, near a minimum."""

_LARGEST_LAB = 1000.0
_POLISH_ROUNDS = 8
_SETTLED_DE00 = 0.005  # polishing a corrected colour stops here
_MET_DE00 = 0.01  # and this near it counts as met
_CHUNK = 16384  # pixels: a few MB of work space a thread, some 10 ms of work

Floats = NDArray[np.floating]


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

    x: Floats
    dE_pattern: Floats
    dE_white: Floats | None
    status: NDArray[np.uint8]

    def counts(self) -> dict[str, int]:
        """Number of pixels of each status, by name."""
        return {name: int(np.count_nonzero(self.status == value)) for value, name in STATUS_NAMES.items()}


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
    system_of = systems(model, Lab_white is not None, weights, metric, pattern.shape[:-1])
    if white is not None and white.shape != pattern.shape:
        raise InputError(
            f"invert: Lab_pattern and Lab_white must have one shape, got {pattern.shape} and {white.shape}"
        )
    shape = pattern.shape[:-1]
    given = [pattern] if white is None else [pattern, white]
    dtype: np.dtype[np.floating] = np.result_type(*given)
    rows = [Lab.reshape(-1, 3) for Lab in given]
    pixels = len(rows[0])
    x = np.empty((pixels, model.n), dtype)
    dE = [np.empty(pixels, dtype) for _ in given]
    status = np.empty(pixels, np.uint8)

    def solve(chunk: slice) -> int:
        wanted = [np.ascontiguousarray(Lab[chunk], dtype) for Lab in rows]
        found = Inversion(x[chunk], dE[0][chunk], dE[-1][chunk], status[chunk])
        system = system_of(chunk)
        if system.correction is None:
            _solve(wanted, system, found)
        else:
            _solve_corrected(wanted, system, found)
        return chunk.stop - chunk.start

    _each_chunk(solve, pixels, progress)
    return Inversion(
        x=x.reshape(*shape, model.n),
        dE_pattern=dE[0].reshape(shape),
        dE_white=None if white is None else dE[1].reshape(shape),
        status=status.reshape(shape),
    )


def _solve(wanted: list[Floats], system: System, found: Inversion) -> None:
    """The three stages on A x + black for a few thousand pixels; writes into the arrays of `found`."""
    AT, black, white, metric = system.AT, system.black, system.white, system.euclidean
    dE_pattern, dE_white = found.dE_pattern, found.dE_white
    if system.right_inverse is None:
        found.status[:] = PENDING
    else:
        inverse, to = system.right_inverse, (found.x, dE_pattern, dE_white, found.status)
        solve_linear(wanted[0], wanted[-1], system.surfaces, AT, inverse, black, white, metric, *to)
    left = np.flatnonzero(found.status == PENDING)
    if not len(left):
        return
    system = system.of(left)
    Lab = _six_equations(wanted, left)
    x, status = search(Lab, system)
    found.x[left], found.status[left] = x, status
    _write_errors(found, left, errors(found.x[left].astype(np.float64, copy=False), Lab, system))


def _write_errors(found: Inversion, pixels: NDArray[np.int64] | slice, dE: Floats) -> None:
    """dE (m, surfaces) of some pixels into the result."""
    found.dE_pattern[pixels] = dE[:, 0]
    if found.dE_white is not None:  # of one surface it is the same array
        found.dE_white[pixels] = dE[:, -1]


def _six_equations(wanted: list[Floats], pixels: NDArray[np.int64] | slice) -> NDArray[np.float64]:
    """Wanted colours of some pixels, (m, 6); L* = 0 on an absent surface: XYZ = 0, as its zero rows of A give."""
    chosen = [Lab[pixels] if isinstance(pixels, slice) else Lab.take(pixels, axis=0) for Lab in wanted]
    Lab = np.zeros((len(chosen[0]), 6))
    for s, of_surface in enumerate(chosen):
        Lab[:, 3 * s : 3 * s + 3] = of_surface
    return Lab


def _solve_corrected(wanted: list[Floats], system: System, found: Inversion) -> None:
    """Solve again for the wanted XYZ less the correction at the x so far; keep what comes nearer, pixel by pixel."""
    weights = system.weights[: len(system.surfaces)]
    Lab = _six_equations(wanted, slice(None))
    XYZ = [Lab_to_XYZ(Lab[:, s : s + 3], system.white) for s in (0, 3)]
    x, status = _solve_linear_model([Lab[:, s : s + 3] for s in (0, 3)], system)
    dE = errors(x, Lab, system, _more_XYZ(x, system))
    todo = np.flatnonzero(dE.max(axis=1) > _SETTLED_DE00)
    for _ in range(_POLISH_ROUNDS):
        if not len(todo):
            break
        part, more = system.of(todo), _more_XYZ(x[todo], system)
        aims = [XYZ_to_Lab(XYZ[s][todo] - more[:, 3 * s : 3 * s + 3], system.white) for s in (0, 1)]
        tried, tried_status = _solve_linear_model(aims, part)
        tried_dE = errors(tried, Lab[todo], part, _more_XYZ(tried, system))
        nearer = tried_dE**2 @ weights < dE[todo] ** 2 @ weights
        x[todo[nearer]], status[todo[nearer]], dE[todo[nearer]] = tried[nearer], tried_status[nearer], tried_dE[nearer]
        todo = todo[nearer & (tried_dE.max(axis=1) > _SETTLED_DE00)]
    met = dE.max(axis=1) <= _MET_DE00
    found.x[:] = x
    found.status[:] = np.where(met, EXACT, np.where(status == EXACT, OPTIMUM, status))
    shown = found.x.astype(np.float64, copy=False)
    _write_errors(found, slice(None), errors(shown, Lab, system, _more_XYZ(shown, system)))


def _solve_linear_model(aims: list[Floats], system: System) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """x and status of `_solve`, for colours that need not be those wanted."""
    m = len(aims[0])
    x, status = np.empty((m, system.n)), np.empty(m, np.uint8)
    found = Inversion(x, np.empty(m), np.empty(m), status)
    _solve([np.ascontiguousarray(aim) for aim in aims[: len(system.surfaces)]], replace(system, correction=None), found)
    return x, status


def _more_XYZ(x: NDArray[np.float64], system: System) -> NDArray[np.float64]:
    """What the correction adds at x on both surfaces, (m, 6)."""
    more = np.zeros((len(x), 6))
    if system.correction is not None:
        more[:, : 3 * len(system.surfaces)] = system.correction.XYZ(x)[:, : len(system.surfaces)].reshape(len(x), -1)
    return more


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
    if not (array.max() <= _LARGEST_LAB and array.min() >= -_LARGEST_LAB):  # NaN fails both
        wrong = int(np.count_nonzero(~(np.abs(array) <= _LARGEST_LAB).all(axis=-1)))
        raise InputError(
            f"invert: {name} must be finite CIELAB within {_LARGEST_LAB:.0f}, got {wrong} pixels with NaN, infinity or "
            "larger values; fill them, or convert the picture to CIELAB, before inverting"
        )
    return array
