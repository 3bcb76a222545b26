"""Area shares of the colorants of a print that one channel turns into colour: neutral white, or the largest gamut.

Each colorant's light is proportional to its area (paper: V-B1), so shares follow from the solid colorants' colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from paxel_design.gamut.meshes import hull_volume
from paxel_design.gamut.primaries import neutral_shares
from paxel_design.patterns import colorants_of
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.calibration.white_point import WHITES
from paxel_runtime.errors import InputError

__all__ = ["proposed_shares"]

_LEAST_SHARE = 0.05
"""Of the area: less makes no tile."""

_EDGE = 16.0
"""Edge of the triangles by which volumes are compared, CIELAB: to a percent of them all alike."""

_FIRST_STEP = 0.5
"""Of the logarithms of shares."""

_MOST = 6


def proposed_shares(names: Sequence[str]) -> dict[str, Any]:
    """Shares that make white neutral (D65), and shares with the largest gamut, beside equal ones.

    Parameters
    ----------
    names : sequence of str
        Three to six colorants. Fluorescent ones by the light they give, others by what they reflect of D65.

    Returns
    -------
    dict
        ``equal``, ``neutral`` (None where the colorants' triangle lacks D65, or they are not three) and
        ``largest_gamut``: each with ``shares``, ``white_xy`` (all at full), ``white_Y`` (luminance over that of equal
        shares) and ``volume`` (cubic CIELAB units under its own white).

    Raises
    ------
    InputError
        If there are fewer colorants, or more, or one is unknown.
    """
    if not 3 <= len(names) <= _MOST:
        raise InputError(f"--monochrome needs three to {_MOST} --colorants, got {len(names)} ({', '.join(names)})")
    XYZ = colorants_to_XYZ(colorants_of(names)).T  # (3, M)
    equal = np.full(len(names), 1 / len(names))
    volume_of_equal = _volume(XYZ, equal)
    if not volume_of_equal > 0:
        raise InputError(f"--colorants {','.join(names)} must differ in colour, or one light makes no colours of them")
    proposals: dict[str, NDArray[np.float64] | None] = {
        "equal": equal,
        "neutral": neutral_shares(XYZ, np.ones(3), WHITES["D65"]) if len(names) == 3 else None,
        "largest_gamut": _largest(XYZ, equal),
    }
    reference_Y = float(XYZ[1] @ equal)
    return {
        key: None
        if shares is None
        else {
            "shares": dict(zip(names, (round(float(s), 4) for s in shares), strict=True)),
            "white_xy": [float(v) for v in (XYZ @ shares)[:2] / (XYZ @ shares).sum()],
            "white_Y": float(XYZ[1] @ shares) / reference_Y,
            "volume": _volume(XYZ, shares),
        }
        for key, shares in proposals.items()
    }


def _volume(XYZ: NDArray[np.float64], shares: NDArray[np.float64]) -> float:
    """Volume in CIELAB of all sums of the colorants' light, under their own white."""
    generators = XYZ * shares
    corners = np.array(list(product((0.0, 1.0), repeat=len(shares)))) @ generators.T
    white = generators.sum(axis=1)
    return hull_volume(corners / white[1], white / white[1], _EDGE)


def _largest(XYZ: NDArray[np.float64], start: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of the largest volume, each at least `_LEAST_SHARE`: a search without derivatives, one peak."""

    def shares_of(logits: NDArray[np.float64]) -> NDArray[np.float64]:
        power = np.exp(np.append(logits, 0.0) - max(0.0, float(np.max(logits))))
        return _LEAST_SHARE + (1 - _LEAST_SHARE * len(start)) * power / power.sum()

    begin = np.zeros((len(start), len(start) - 1))
    begin[1:] = _FIRST_STEP * np.eye(len(start) - 1)
    found = minimize(
        lambda logits: -_volume(XYZ, shares_of(logits)),
        begin[0],
        method="Nelder-Mead",
        options={"initial_simplex": begin, "xatol": 0.01, "fatol": 50.0, "maxfev": 300},
    )
    return shares_of(found.x)
