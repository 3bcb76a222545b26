"""The measured correction: what extra readings of random projections teach beyond the readings of single clusters.

First A itself is refined by least squares over all readings, then terms are added to it (`model.correction`). Which
terms, and how strongly they are held back, is decided by predicting each extra reading without it (leave-one-out
cross-validation); what does not help is not used. No law of any projector is known here: the candidates are a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from paxel_runtime.calibration.accuracy import relative_XYZ
from paxel_runtime.calibration.ridge import dE00_roots, fit_ridge
from paxel_runtime.captures.exposures import Exposure
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.correction import Correction, Term, residual_values, term_values
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = [
    "CANDIDATES",
    "LEAST_READINGS",
    "Samples",
    "correct_model",
    "fit_correction",
    "read_samples",
    "refine_linear",
]

LEAST_READINGS = 20
"""Extra readings on each surface below which nothing is fitted: they could not tell a law from noise."""

_RIDGES = (1e-3, 1e-2, 1e-1)
_RESIDUAL_SCALES = (0.1, 0.3, 1.0)
_RESIDUAL_WORTH = 0.9
"""Mean squared dE00 with a residual over that without, below which it is taken: it costs more than all terms."""
_LEAST_GAIN = 0.02
"""dE00 below which an improvement is not worth a more complicated model: nobody sees it, no meter repeats it."""
_JITTER = 1e-9


@dataclass(frozen=True, eq=False)
class Samples:
    """Readings of one surface that a correction is fitted to.

    Attributes
    ----------
    x : (T, n) array
        Linear inputs.
    XYZ : (T, 3) array
        As read, Y = 1 for the white point.
    extra : (T,) bool array
        Random projections, which cross-validation leaves out one by one; the others (single clusters, full white) are
        always kept, so that the edges of the inputs' range stay known.
    """

    x: NDArray[np.float64]
    XYZ: NDArray[np.float64]
    extra: NDArray[np.bool_]


def correct_model(
    model: PredictionModel,
    readings: Mapping[str, NDArray[np.float64]],
    plan: Iterable[Exposure],
    *,
    linear_only: bool = False,
) -> tuple[PredictionModel, dict[str, Any] | None]:
    """Refine A and add a correction, each if it helps, from the readings ``extra-<surface>-K<k>-<i>``.

    Parameters
    ----------
    model : PredictionModel
        From `fit_model`.
    readings : dict of exposure name -> (81,) array
    plan : iterable of Exposure
    linear_only : bool
        Refine A and add no correction: for an image-based model, since a correction is measured at one spot only.

    Returns
    -------
    model : PredictionModel
        The same object if nothing helps, or there are fewer than `LEAST_READINGS` extra readings on a surface.
    figures : dict or None
        What was tried, taken and won, as JSON; None without extra readings.
    """
    samples = read_samples(model, readings, plan)
    count = min(int(s.extra.sum()) for s in samples.values())
    if count < LEAST_READINGS:
        return model, None
    model, refined = refine_linear(model, samples)
    figures = {"readings": count, "refined_A": refined}
    if linear_only:
        return model, figures
    model, corrected = fit_correction(model, samples)
    return model, figures | {"correction": corrected}


def read_samples(
    model: PredictionModel, readings: Mapping[str, NDArray[np.float64]], plan: Iterable[Exposure]
) -> dict[str, Samples]:
    """The readings of this model's K on each surface: extra projections, single clusters and full white."""
    plan, K = list(plan), len(model.clusters)
    samples = {}
    for surface in model.surfaces:
        white = f"read-{surface}-white"
        of_K = [e for e in plan if e.device == "meter" and e.surface == surface and e.clusters == K]
        kept = [e for e in of_K if e.name.startswith(("extra-", "read-")) and e.name in readings]
        x = model.response.P_to_x(np.array([e.P for e in kept]).reshape(len(kept), K, -1)).reshape(len(kept), model.n)
        samples[surface] = Samples(
            x=np.vstack([x, np.ones((1, model.n))]),
            XYZ=relative_XYZ(readings, [*(e.name for e in kept), white]),
            extra=np.array([*(e.name.startswith("extra-") for e in kept), False]),
        )
    return samples


# Candidates ---------------------------------------------------------------------------------------------------------


def _linear(K: int, N: int) -> list[Term]:
    return [Term("linear", a, a) for a in range(K * N)]


def _channels(K: int, N: int) -> list[Term]:
    """Products of two channels on the same cluster."""
    return [Term("product", i * N + j, i * N + m) for i in range(K) for j, m in combinations(range(N), 2)]


def _differences(*kinds: str) -> Callable[[int, int], list[Term]]:
    """Powers of the difference of a channel's inputs on two clusters."""

    def terms(K: int, N: int) -> list[Term]:
        pairs = list(combinations(range(K), 2))
        return [Term(kind, i * N + j, m * N + j) for kind in kinds for i, m in pairs for j in range(N)]

    return terms


def _products(K: int, N: int) -> list[Term]:
    return [Term("product", a, b) for a, b in combinations_with_replacement(range(K * N), 2)]


CANDIDATES: dict[str, tuple[Callable[[int, int], list[Term]], ...]] = {
    "linear": (_linear,),
    "channel products": (_linear, _channels),
    "channel products, |differences|": (_linear, _channels, _differences("absolute")),
    "channel products, squared differences": (_linear, _channels, _differences("square")),
    "channel products, |differences| and their squares": (
        _linear,
        _channels,
        _differences("absolute", "square", "signed-square"),
    ),
    "all products": (_linear, _products),
}
"""Sets of terms that cross-validation chooses from: what makes them for K clusters and N channels."""


class _Choice(NamedTuple):
    """One candidate as cross-validation sees it: a basis of functions, and how much it is held back."""

    name: str
    terms: tuple[Term, ...]
    residual_scale: float
    ridge: float


class _Fit(NamedTuple):
    """Coefficients of a surface's terms and residual, and dE00 of each extra reading when it is left out."""

    coefficients: NDArray[np.float64]
    weights: NDArray[np.float64]
    left_out_dE00: NDArray[np.float64]


# Fits ---------------------------------------------------------------------------------------------------------------


def refine_linear(model: PredictionModel, samples: Mapping[str, Samples]) -> tuple[PredictionModel, dict[str, Any]]:
    """A by least squares in dE00 over all readings, held to the measured columns by a ridge; if that helps.

    A cluster lit alone has dark neighbours, which pictures seldom do: the best A for pictures differs.

    Returns
    -------
    model : PredictionModel
        With another A on each surface, or the same object.
    figures : dict
        ``{"used", "ridge", "gain_dE00", "standard_error", "pattern": {"dE00_mean_before", "dE00_mean_after"}, ...}``.
    """
    terms = tuple(_linear(len(model.clusters), len(model.channels)))
    choice, fits, _ = _best(model, samples, [_Choice("linear", terms, 0.0, ridge) for ridge in _RIDGES])
    figures = _gain(model, samples, fits) | {"ridge": choice.ridge}
    if not figures["used"]:
        return model, figures
    surfaces = {
        name: SurfaceModel(surface.A + fit.coefficients, surface.black)
        for (name, surface), fit in zip(model.surfaces.items(), fits, strict=True)
    }
    return replace(model, pattern=surfaces["pattern"], white=surfaces.get("white")), figures


def fit_correction(model: PredictionModel, samples: Mapping[str, Samples]) -> tuple[PredictionModel, dict[str, Any]]:
    """The correction with the least root mean square dE00 of left-out readings over both surfaces; if it helps.

    Returns
    -------
    model : PredictionModel
        With a correction, or the same object.
    figures : dict
        As `refine_linear`'s, and ``"terms"`` (a key of `CANDIDATES`), ``"residual"`` (whether a polyharmonic residual
        is part of it).
    """
    K, N = len(model.clusters), len(model.channels)
    rows = min(len(s.x) for s in samples.values())
    tables = {name: tuple(t for make in makers for t in make(K, N)) for name, makers in CANDIDATES.items()}
    fitting = {name: terms for name, terms in tables.items() if len(terms) < rows or name == "linear"}
    choices = [_Choice(name, terms, 0.0, ridge) for name, terms in fitting.items() for ridge in _RIDGES]
    choice, fits, score = _best(model, samples, choices)
    with_residual = [choice._replace(residual_scale=scale) for scale in _RESIDUAL_SCALES]
    smooth, smooth_fits, smooth_score = _best(model, samples, with_residual)
    residual = smooth_score < _RESIDUAL_WORTH * score
    if residual:
        choice, fits = smooth, smooth_fits
    figures = _gain(model, samples, fits) | {"terms": choice.name, "residual": residual, "ridge": choice.ridge}
    if not figures["used"]:
        return model, figures
    correction = Correction(
        n=model.n,
        terms=choice.terms,
        coefficients=np.stack([fit.coefficients for fit in fits]),
        centres=_centres(samples) if residual else np.empty((0, model.n)),
        weights=np.stack([fit.weights for fit in fits]),
    )
    return replace(model, correction=correction), figures


def _best(
    model: PredictionModel, samples: Mapping[str, Samples], choices: Iterable[_Choice]
) -> tuple[_Choice, list[_Fit], float]:
    """The choice whose left-out readings have the least mean squared dE00, the first of equals; its fits; that mean."""
    roots = {name: dE00_roots(s.XYZ, model.white_point) for name, s in samples.items()}
    best: tuple[_Choice, list[_Fit], float] | None = None
    for choice in choices:
        fits = [_fit(model, name, samples, roots[name], choice) for name in samples]
        score = float(np.mean([np.mean(fit.left_out_dE00**2) for fit in fits]))
        if best is None or score < best[2]:
            best = choice, fits, score
    assert best is not None
    return best


def _fit(
    model: PredictionModel, surface: str, samples: Mapping[str, Samples], roots: NDArray[np.float64], choice: _Choice
) -> _Fit:
    own, m = samples[surface], len(choice.terms)
    centres = _centres(samples) if choice.residual_scale else np.empty((0, model.n))
    # g(centres) = L L^T: under functions g L^-T the spline's penalty is the sum of squared coefficients
    factor = np.linalg.cholesky(residual_values(centres, centres) + _JITTER * np.eye(len(centres)))
    spline = solve_triangular(factor, residual_values(centres, own.x).T, lower=True).T
    unexplained = own.XYZ - model.surfaces[surface].predict_XYZ(own.x)
    coefficients, left_out = fit_ridge(
        term_values(choice.terms, own.x), spline, unexplained, roots, choice.ridge, choice.residual_scale
    )
    weights = solve_triangular(factor, coefficients[:, m:].T, lower=True, trans="T").T
    measured = own.XYZ[own.extra]
    return _Fit(coefficients[:, :m], weights, _errors(measured, measured - left_out[own.extra], model))


def _centres(samples: Mapping[str, Samples]) -> NDArray[np.float64]:
    """Every measured input of any surface once: the surfaces share the functions of the residual."""
    return np.unique(np.vstack([s.x for s in samples.values()]), axis=0)


def _errors(measured: NDArray[np.floating], predicted: NDArray[np.floating], model: PredictionModel) -> NDArray[Any]:
    return np.asarray(dE00(XYZ_to_Lab(measured, model.white_point), XYZ_to_Lab(predicted, model.white_point)))


def _gain(model: PredictionModel, samples: Mapping[str, Samples], fits: Iterable[_Fit]) -> dict[str, Any]:
    """What a fit improves on the extra readings when each is left out, its standard error, and whether it is used.

    It is, if the mean gain over the surfaces is above twice its standard error and `_LEAST_GAIN`, and no surface
    loses more than its own standard error.
    """
    gains, errors, figures = [], [], {}
    for (name, s), fit in zip(samples.items(), fits, strict=True):
        before = _errors(s.XYZ[s.extra], model.surfaces[name].predict_XYZ(s.x[s.extra]), model)
        better = before - fit.left_out_dE00
        gains.append(float(better.mean()))
        errors.append(float(better.std(ddof=1) / np.sqrt(len(better))))
        figures[name] = {
            "dE00_mean_before": float(before.mean()),
            "dE00_mean_after": float(fit.left_out_dE00.mean()),
            "dE00_max_after": float(fit.left_out_dE00.max()),
        }
    gain, error = float(np.mean(gains)), float(np.hypot.reduce(errors) / len(errors))
    harmless = all(g > -e for g, e in zip(gains, errors, strict=True))
    used = harmless and gain > max(2 * error, _LEAST_GAIN)
    return {"used": used, "gain_dE00": gain, "standard_error": error, **figures}
