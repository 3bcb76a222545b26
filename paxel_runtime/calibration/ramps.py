"""Ramps -> response curves: black-subtracted, as a share of full light, monotone (paper: IV-C1; design: section 7).

A step of a ramp is a spectrum, or a picture. Pure functions; the plan of the ramps stands in ``captures/exposures.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression, least_squares

from paxel_runtime.errors import CalibrationError

__all__ = ["Curve", "fit_curve", "picture_shares", "spectral_shares"]

Curve = Literal["measured", "gamma"]
"""A curve through the measured points, or offset, gain and exponent fitted to them."""

_LEAST_STEPS = 3
_FALL = 0.03
"""Fall from one step to a later one, share of full, beyond any meter's noise."""
_CLIPPED = 0.99
"""Share of full light that a curve must not reach a tenth before the end."""
_GAMMA_POINTS = 1025


def spectral_shares(spectra: NDArray[np.float64]) -> NDArray[np.float64]:
    """Light of each step of a ramp as a share of the last one's, black-subtracted, (m,).

    Parameters
    ----------
    spectra : (m, w) array
        From dark to full. The share is that of the full spectrum in the step's (least squares), so that every band
        counts with its light.
    """
    light = spectra - spectra[0]
    energy = float(light[-1] @ light[-1])
    return light @ light[-1] / energy if energy > 0 else np.zeros(len(spectra))


def picture_shares(step: Callable[[int], NDArray[np.number]], count: int) -> NDArray[np.float64]:
    """The same from pictures of one plane: the share of the full picture in each, over the pixels that are well lit.

    Parameters
    ----------
    step : callable
        Gives picture k of `count`, from dark to full, (h, w); asked for one at a time.
    """
    dark = step(0).astype(np.float64)
    full = step(count - 1) - dark
    lit = full > 0.5 * full.max()
    weight = full[lit]
    energy = float(weight @ weight)
    if not energy > 0:
        return np.zeros(count)
    shares = [((step(k)[lit] - dark[lit]) @ weight) / energy for k in range(1, count - 1)]
    return np.array([0.0, *shares, 1.0])


def fit_curve(
    code: NDArray[np.float64],
    shares: NDArray[np.float64],
    names: Sequence[str],
    channel: str,
    curve: Curve = "measured",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (code, linear) of a response curve, from (0, 0) to (1, 1) without falling.

    Parameters
    ----------
    code : (m,) array
        Device values of the steps, 0 to 1, rising.
    shares : (m,) array
        Light of each step as a share of full, 0 at the first.
    names : sequence of str
        What each step is called in an error.
    channel : str
    curve : "measured" | "gamma"
        ``"measured"``: the measured steps, small falls by noise evened out (isotonic regression). ``"gamma"``: x =
        ((P - offset) / (1 - offset))^exponent, fitted to the square root of light, where dark steps count.

    Raises
    ------
    CalibrationError
        If there are too few steps, no light, or the ramp falls, jumps or is clipped.
    """
    if len(code) < _LEAST_STEPS:
        raise CalibrationError(
            f"the {channel} ramp must have at least {_LEAST_STEPS} steps from dark to full, got {len(code)}: "
            "measure its ramp again"
        )
    if not np.all(np.isfinite(shares)) or not shares[-1] > 0:
        raise CalibrationError(f"the {channel} ramp gives no light: is the channel connected and the meter aimed?")
    _check_shape(code, shares, names, channel)
    if curve == "gamma":
        return _gamma_points(code, shares)
    linear = np.clip(isotonic_regression(shares).x, 0.0, 1.0)
    linear[0], linear[-1] = 0.0, 1.0
    return np.array(code, np.float64), linear


def _check_shape(code: NDArray[np.float64], shares: NDArray[np.float64], names: Sequence[str], channel: str) -> None:
    highest = np.maximum.accumulate(shares)
    falls = highest - shares
    if falls.max() > _FALL:
        low = int(np.argmax(falls))
        high = int(np.argmax(shares[: low + 1]))
        raise CalibrationError(
            f"the {channel} ramp must rise: {names[low]} ({shares[low]:.1%} of full light) is darker than "
            f"{names[high]} ({shares[high]:.1%}) before it; are rows mixed up, or did the light change? "
            "Measure this ramp again"
        )
    early = int(np.searchsorted(code, 0.9))
    if early < len(code) - 1 and shares[early] > _CLIPPED:
        raise CalibrationError(
            f"the {channel} ramp is clipped: {names[early]} (code {code[early]:.2f}) has {shares[early]:.1%} of full "
            "light already; lower the projector's contrast, or the meter's or camera's exposure, and measure it again"
        )


def _gamma_points(
    code: NDArray[np.float64], shares: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    def linear(offset: float, exponent: float, P: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.clip((P - offset) / (1.0 - offset), 0.0, 1.0) ** exponent)

    target = np.sqrt(np.maximum(shares, 0.0))

    def misfit(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sqrt(linear(float(parameters[0]), float(parameters[1]), code)) - target

    best = least_squares(misfit, (0.01, 2.2), bounds=((0.0, 0.3), (0.5, 6.0)), xtol=1e-12, ftol=1e-14)
    P = np.linspace(0.0, 1.0, _GAMMA_POINTS)
    return P, linear(float(best.x[0]), float(best.x[1]), P)
