"""The primaries of a pattern that turns one channel into colour: which of them limits white, and what shares would do.

Each colorant's light is proportional to the area it has of the pattern, so what other shares would give follows from
the model that was measured (paper: V-B1, where red is too weak). Pure functions of a model; one channel, one surface.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.calibration.white_point import WHITES, brightest_of_chromaticity
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["has_primaries", "neutral_shares", "primaries_figures", "primaries_sentence"]


def has_primaries(model: PredictionModel) -> bool:
    """Whether `primaries_figures` says something of a model: one surface, one channel, three clusters."""
    return model.white is None and len(model.channels) == 1 and len(model.clusters) == 3


def neutral_shares(
    primaries: ArrayLike, shares: ArrayLike, xy: ArrayLike = WHITES["D65"]
) -> NDArray[np.float64] | None:
    """Area shares with which all three colorants at full give a chromaticity, so that no light is wasted.

    Parameters
    ----------
    primaries : (3, 3) array
        XYZ of each colorant at full (columns), as measured with the present shares.
    shares : (3,) array
        Present area shares, summing to 1.
    xy : (2,) array
        CIE 1931 chromaticity of the wanted white.

    Returns
    -------
    (3,) float64 array, or None
        Shares summing to 1; None if the chromaticity is outside the triangle of the colorants.
    """
    of_full_area = np.asarray(primaries, np.float64) / np.asarray(shares, np.float64)
    x, y = np.asarray(xy, np.float64)
    amounts = np.linalg.solve(of_full_area, [x / y, 1.0, (1.0 - x - y) / y])
    return None if np.any(amounts <= 0) else np.asarray(amounts / amounts.sum())


def primaries_figures(model: PredictionModel, shares: ArrayLike) -> dict[str, Any]:
    """What the primaries give together, which one limits a neutral white, and what other area shares would give.

    Parameters
    ----------
    model : PredictionModel
        One surface, one channel, three clusters.
    shares : (3,) array
        Area of each cluster's colorant, summing to 1.

    Returns
    -------
    dict
        ``full``: chromaticity of all clusters at full; ``primaries``: chromaticity and luminance of each at full, over
        that of all at full; ``whites``: for D65 and D50 the inputs that give the brightest white of that chromaticity,
        its luminance over that of all at full, the limiting primary, the shares with which no light is wasted, and the
        luminance with them; None for a white the pattern cannot show.

    Raises
    ------
    InputError
        If the model has two surfaces, several channels or not three clusters, or shares do not sum to 1.
    """
    share = np.asarray(shares, np.float64)
    if not has_primaries(model):
        raise InputError(
            f"primaries need one surface, one channel and three clusters; the model has {len(model.surfaces)}, "
            f"{len(model.channels)}, {len(model.clusters)}"
        )
    if share.shape != (3,) or not np.all(share > 0) or abs(share.sum() - 1) > 1e-6:
        raise InputError(f"shares must be three positive numbers that sum to 1, got {share.tolist()}")
    A, black = np.asarray(model.pattern.A, np.float64), np.asarray(model.pattern.black, np.float64)
    full = A.sum(axis=1) + black
    whites: dict[str, Any] = {}
    for name, xy in WHITES.items():
        try:
            XYZ, x = brightest_of_chromaticity(model, xy)
        except CalibrationError:
            whites[name] = None
            continue
        best = neutral_shares(A, share, xy)
        entry: dict[str, Any] = {
            "inputs": dict(zip(model.clusters, x.tolist(), strict=True)),
            "luminance": float(XYZ[1] / full[1]),
            "limiting": model.clusters[int(np.argmax(x))],
        }
        if best is not None:
            entry["shares"] = dict(zip(model.clusters, best.tolist(), strict=True))
            entry["luminance_with_shares"] = float((A[1] / share) @ best / full[1])
        whites[name] = entry
    return {
        "shares": dict(zip(model.clusters, share.tolist(), strict=True)),
        "full": {"xy": _chromaticity(full)},
        "primaries": {
            name: {"xy": _chromaticity(A[:, i]), "luminance": float(A[1, i] / full[1])}
            for i, name in enumerate(model.clusters)
        },
        "whites": whites,
    }


def primaries_sentence(figures: dict[str, Any], white: str = "D65") -> str:
    """What `primaries_figures` say of a white: the primary that limits it, and shares that would make it brighter."""
    found = figures["whites"][white]
    if found is None:
        return f"{white} is outside the triangle of the primaries: no area shares give that white"
    gain = 100 * (found["luminance_with_shares"] / found["luminance"] - 1)
    # Cells are counted in whole numbers: no print has its shares to a percent.
    if gain < 1:
        return f"white {white}: the area shares of the primaries fit, all give their full light"
    wanted = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found["shares"].items())
    given = ", ".join(f"{100 * share:.0f}" for share in figures["shares"].values())
    return (
        f"white {white} is limited by {found['limiting']}; printed with area shares {wanted} (now {given}) it would be "
        f"{gain:.0f} % brighter"
    )


def _chromaticity(XYZ: NDArray[np.float64]) -> list[float]:
    return [float(v) for v in XYZ[:2] / XYZ.sum()]
