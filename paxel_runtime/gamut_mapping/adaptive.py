"""Adaptive mapping of two pictures shown at once: every pair of pixels in the joint gamut, the room used for detail.

Static mapping holds for any two pictures; the two at hand need less. Local joint tone curves spend the joint gamut on
the local contrast of these two (`tone_fit`), colour takes what room is left (`chroma_room`), and the few pairs between
the samples that lie outside are pulled in (`pair_pull`). Knows pictures in CIELAB and half-spaces; nothing of models,
surfaces' names or files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping.chroma_room import LEAST_CHROMA, ChromaReturn, fit_chroma_return
from paxel_runtime.gamut_mapping.pair_pull import deepest_grays, pull_inside
from paxel_runtime.gamut_mapping.spline_grid import SplineGrid, spline_grid
from paxel_runtime.gamut_mapping.static import Mapped
from paxel_runtime.gamut_mapping.tone_curves import ToneCurves, linear_curves
from paxel_runtime.gamut_mapping.tone_fit import BINS, WINDOW_DEG, ReducedPicture, Samples, fit_tone_curves
from paxel_runtime.model.subgamut import PairGamut
from paxel_runtime.observer.smoothing import local_deviation

__all__ = ["AdaptiveOptions", "AdaptivePair", "PairCurves", "apply_pair_curves", "fit_pair_curves", "map_pair"]

_BLOCK_DEG = 1 / 60
"""Blocks over which lightness is averaged before its contrast is judged: a minute of arc, what the eye resolves."""
_SAMPLES = 26_000
_FLAT_L = 0.05

Pair = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Pictures (H, W, 3) for the pattern and for the white surface, CIELAB."""


@dataclass(frozen=True)
class AdaptiveOptions:
    """Who looks, and when adaptive mapping is worth it.

    Attributes
    ----------
    px_per_degree : float
        Pixels of the raster to a degree of the viewer's field, > 0.
    least_gain : float
        Local contrast over that of static mapping (geometric mean of the surfaces) from which on it is used.
    persistence : float
        In films, share of the curves of the frame before that stays, 0 to below 1.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    px_per_degree: float
    least_gain: float = 1.05
    persistence: float = 0.0

    def __post_init__(self) -> None:
        if not (self.px_per_degree > 0 and np.isfinite(self.px_per_degree)):
            raise InputError(f"adaptive mapping needs pixels per degree > 0, got {self.px_per_degree!r}")
        if not self.least_gain >= 0:
            raise InputError(f"least_gain must be >= 0, got {self.least_gain!r}")
        if not 0 <= self.persistence < 1:
            raise InputError(f"persistence must be 0 to below 1, got {self.persistence!r}")


@dataclass(frozen=True, eq=False)
class PairCurves:
    """How two pictures are mapped together: lightness and chroma on each surface, pattern first.

    Attributes
    ----------
    tone : (ToneCurves, ToneCurves)
    chroma : (ChromaReturn, ChromaReturn)
    """

    tone: tuple[ToneCurves, ToneCurves]
    chroma: tuple[ChromaReturn, ChromaReturn]


@dataclass(frozen=True, eq=False)
class AdaptivePair:
    """Two pictures mapped together.

    Attributes
    ----------
    Lab : two (H, W, 3) float32 arrays
        Targets on the pattern and on the white surface; every pair lies in the joint gamut.
    method : "adaptive" | "static"
        What is used.
    why : str
        In words for the record.
    curves : PairCurves
        What was found, whether it is used or not; `fit_pair_curves` of the next frame takes it.
    figures : dict
        ``gain_pattern``, ``gain_white`` and ``gain``: local contrast over that of static
        mapping on each surface (None where the source has none) and their geometric mean; ``chroma_pattern``,
        ``chroma_white``: mean chroma over static mapping's; ``pixels_pulled``: share of pairs pulled inside.
    """

    Lab: Pair
    method: str
    why: str
    curves: PairCurves
    figures: dict[str, Any]


def map_pair(
    sources: Pair,
    static: tuple[Mapped, Mapped],
    pairs: PairGamut,
    options: AdaptiveOptions,
    *,
    mask: NDArray[np.bool_] | None = None,
    previous: PairCurves | None = None,
) -> AdaptivePair:
    """Map two pictures together, where that gains contrast; else leave them as static mapping has them.

    Parameters
    ----------
    sources : two (H, W, 3) float32 arrays
        Pictures for the pattern and for the white surface, CIELAB.
    static : (Mapped, Mapped)
        The same mapped to the two sides of a product pair.
    pairs : PairGamut
        The joint gamut.
    options : AdaptiveOptions
    mask : (H, W) bool array, optional
        Pixels that are shown; the whole frame by default.
    previous : PairCurves, optional
        Of the frame before, on the same grid.

    Returns
    -------
    AdaptivePair

    Raises
    ------
    InputError
        If shapes differ, nothing is shown, or `previous` is of another grid.
    GamutError
        If no pair of grays lies in the joint gamut.
    """
    mask = _checked(sources, static, mask)
    curves = fit_pair_curves(sources, static, pairs, options, mask=mask, previous=previous)
    targets, pulled = apply_pair_curves(sources, (static[0].Lab, static[1].Lab), curves, pairs)
    gains = [
        _gain(*(reduced(Lab[..., 0], mask, options.px_per_degree) for Lab in (sources[s], static[s].Lab, targets[s])))
        for s in range(2)
    ]
    known = [gain for gain in gains if gain is not None]
    gain = float(np.exp(np.mean(np.log(known)))) if known else 1.0
    used = gain >= options.least_gain
    why = f"local contrast {gain:.2f} times that of static mapping"
    if not used:
        why += f", below {options.least_gain:g}: these two pictures leave no room"
    chroma = [_chroma_ratio(targets[s], static[s].Lab, mask) for s in range(2)]
    figures = {
        "gain_pattern": gains[0],
        "gain_white": gains[1],
        "gain": gain,
        "chroma_pattern": chroma[0],
        "chroma_white": chroma[1],
        "pixels_pulled": float(np.mean(pulled[mask])),
    }
    Lab = targets if used else (static[0].Lab, static[1].Lab)
    return AdaptivePair(Lab, "adaptive" if used else "static", why, curves, figures)


def fit_pair_curves(
    sources: Pair,
    static: tuple[Mapped, Mapped],
    pairs: PairGamut,
    options: AdaptiveOptions,
    *,
    mask: NDArray[np.bool_] | None = None,
    previous: PairCurves | None = None,
) -> PairCurves:
    """How two pictures are best mapped together; parameters and errors as `map_pair`."""
    mask = _checked(sources, static, mask)
    px_per_degree = options.px_per_degree
    height, width = mask.shape
    grid = spline_grid(height, width, px_per_degree, BINS)
    linear = tuple(linear_curves(grid, tuple(one.figures["L_from"]), tuple(one.figures["L_to"])) for one in static)
    rows, columns = _sample_pixels(mask)
    Lab = np.concatenate([one.Lab[rows, columns].astype(np.float64) for one in static], axis=1)
    chroma = [1, 2, 4, 5]
    L_sources = tuple(source[rows, columns, 0].astype(np.float64) for source in sources)
    kept = Lab.copy()
    kept[:, chroma] *= LEAST_CHROMA
    tone = fit_tone_curves(
        (linear[0], linear[1]),
        (
            reduced(sources[0][..., 0], mask, px_per_degree),
            reduced(sources[1][..., 0], mask, px_per_degree),
        ),
        (L_sources[0], L_sources[1]),
        Samples(rows, columns, kept),
        pairs,
    )
    L = np.stack(
        [t.sampled(rows, columns, own) @ grid.raveled(t.control) for t, own in zip(tone, L_sources, strict=True)], 1
    )
    ab = np.stack([source[rows, columns, 1:].astype(np.float64) for source in sources], axis=1)
    C = np.hypot(Lab[:, [1, 4]], Lab[:, [2, 5]])
    flat = SplineGrid(grid.height, grid.width, grid.cells)
    curves = PairCurves(tone, fit_chroma_return(flat, rows, columns, L, ab, C, pairs))
    return curves if previous is None else _blended(curves, previous, options.persistence)


def _blended(now: PairCurves, then: PairCurves, share: float) -> PairCurves:
    """Curves of which a share is those of the frame before; what rises in both rises in the blend."""

    def tone(s: int) -> ToneCurves:
        ends = [(1 - share) * a + share * b for a, b in zip(now.tone[s].L_from, then.tone[s].L_from, strict=True)]
        control = (1 - share) * now.tone[s].control + share * then.tone[s].control
        return ToneCurves(now.tone[s].grid, control, (ends[0], ends[1]))

    def chroma(s: int) -> ChromaReturn:
        control = (1 - share) * now.chroma[s].control + share * then.chroma[s].control
        return ChromaReturn(now.chroma[s].grid, control)

    if any(a.grid != b.grid for a, b in zip(now.tone, then.tone, strict=True)):
        raise InputError("the frame before must be of the same size and seen from the same distance")
    return PairCurves((tone(0), tone(1)), (chroma(0), chroma(1)))


def apply_pair_curves(
    sources: Pair, static: Pair, curves: PairCurves, pairs: PairGamut
) -> tuple[Pair, NDArray[np.bool_]]:
    """Targets (H, W, 3) of both pictures, every pair in the joint gamut, and which pixels were pulled in, (H, W)."""
    targets = tuple(
        curves.chroma[s].apply(sources[s], static[s], curves.tone[s].apply(sources[s][..., 0])) for s in range(2)
    )
    pulled = pull_inside(targets[0], targets[1], pairs, deepest_grays(pairs))
    return (targets[0], targets[1]), pulled


def reduced(L: NDArray[np.floating], mask: NDArray[np.bool_], px_per_degree: float) -> ReducedPicture:
    """Lightness averaged over blocks of about a minute of arc, (h, w); blocks more than half outside are masked."""
    block = min(max(1, round(_BLOCK_DEG * px_per_degree)), *L.shape)
    rows, columns = L.shape[0] // block, L.shape[1] // block

    def mean(values: NDArray[Any]) -> NDArray[np.float64]:
        tiles = values[: rows * block, : columns * block].reshape(rows, block, columns, block)
        return np.asarray(tiles.mean(axis=(1, 3), dtype=np.float64))

    shown = mean(mask)
    return ReducedPicture(mean(L), shown >= min(0.5, float(shown.max())), px_per_degree / block)


def _gain(source: ReducedPicture, static: ReducedPicture, target: ReducedPicture) -> float | None:
    """Local contrast of the target over that of static mapping; None where the source has none."""
    sigma = WINDOW_DEG * source.px_per_degree
    of_source, of_static, of_target = (
        float(local_deviation(p.L, p.mask, sigma)[p.mask].mean()) for p in (source, static, target)
    )
    return of_target / of_static if of_source > _FLAT_L and of_static > 0 else None


def _chroma_ratio(target: NDArray[np.float32], static: NDArray[np.float32], mask: NDArray[np.bool_]) -> float | None:
    """Mean chroma over static mapping's; None where that has none."""
    now, then = (float(np.hypot(Lab[..., 1], Lab[..., 2])[mask].mean(dtype=np.float64)) for Lab in (target, static))
    return now / then if then > _FLAT_L else None


def _sample_pixels(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """One pixel in each block of the frame that is shown, at the same places in every frame of a film."""
    block = max(1, int(np.sqrt(mask.size / _SAMPLES)))
    rows, columns = np.mgrid[0 : mask.shape[0] : block, 0 : mask.shape[1] : block]
    jitter = np.random.default_rng(0).integers(0, block, (2, *rows.shape))
    rows = np.minimum(rows + jitter[0], mask.shape[0] - 1).ravel()
    columns = np.minimum(columns + jitter[1], mask.shape[1] - 1).ravel()
    shown = mask[rows, columns]
    return rows[shown], columns[shown]


def _checked(sources: Pair, static: tuple[Mapped, Mapped], mask: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    shape = sources[0].shape
    shapes = {array.shape for array in (*sources, static[0].Lab, static[1].Lab)}
    if len(shape) != 3 or shape[2] != 3 or shapes != {shape}:
        raise InputError(f"adaptive mapping needs pictures (H, W, 3) of one shape, got {sorted(shapes)}")
    if mask is None:
        return np.ones(shape[:2], np.bool_)
    if mask.shape != shape[:2] or not mask.any():
        raise InputError(f"adaptive mapping needs a mask {shape[:2]} with a pixel that is shown, got {mask.shape}")
    return mask
