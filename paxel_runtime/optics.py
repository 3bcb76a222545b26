"""Spectra of the virtual bench: primaries, response curves, inks as transmittances, what camera and eye make of them.

Light passes the ink twice. With T the transmittance of the ink at each point of the wall, R the reflectance of the
paper under it, s the spread of light inside the paper, and L_j the light of projector channel j with spectrum P_j, the
radiance is

    sum_j P_j R T [s * (T L_j)]     (J. A. C. Yule, W. J. Nielsen 1951, as a convolution: optical dot gain emerges)

and since T = 1 + sum_i a_i (t_i - 1), with a_i the coverage of ink i and t_i = sqrt(R_i / R) from its solid patch, a
sensor sees ``sum_jkl G[j, k, l] a_k [s * (a_l L_j)]`` with a_0 = 1. `pair_factors` makes G, once, for any sensor; the
other modules of the bench (``optics_*``) compute the spatial part.

The bench shares nothing with the estimators but plain colorimetry: its response curves are its own.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM

__all__ = [
    "camera_sensitivities",
    "ink_terms",
    "pair_factors",
    "pair_spectra",
    "patch_factors",
    "primaries",
    "response",
    "response_table",
]

_Real = TypeVar("_Real", np.float32, np.float64)

_GAMMA = (1.9, 2.2, 2.5)
_S_SHARE = (0.35, 0.20, 0.12)
_SENSITIVITY_NM = ((602.0, 34.0), (537.0, 41.0), (458.0, 29.0))


def primaries(channels: tuple[str, ...]) -> NDArray[np.float64]:
    """Spectral power of projector channels at full, (N, 81), on `WAVELENGTHS_NM`, per nm.

    ``"red"``, ``"green"``, ``"blue"`` are measured DLP-LED primaries whose sum is D65 with Y = 1; ``"white"`` is their
    sum (a white-light projector of one channel).

    Raises
    ------
    InputError
        For a channel without a spectrum.
    """
    table = _dlp_spectra()
    unknown = [name for name in channels if name not in table]
    if unknown:
        raise InputError(f"the virtual bench has spectra for the channels {', '.join(table)}; got {', '.join(unknown)}")
    return np.array([table[name] for name in channels])


@cache
def _dlp_spectra() -> dict[str, NDArray[np.float64]]:
    with (files("paxel_runtime") / "data" / "dlp.csv").open(encoding="utf-8") as file:
        lines = [line for line in file.read().splitlines() if not line.startswith("#")]
    columns = np.array([line.split(",") for line in lines[1:]], np.float64).T
    assert np.array_equal(columns[0], WAVELENGTHS_NM)
    spectra = dict(zip(lines[0].split(",")[1:], columns[1:], strict=True))
    return spectra | {"white": np.sum(list(spectra.values()), axis=0)}


def response(P: ArrayLike, channel: int) -> NDArray[np.float64]:
    """Linear intensity x of a device value P (0..1) on the bench's projector; 0 -> 0, 1 -> 1, rising.

    x = (1 - m) P^g + m (1 + tanh(4 P - 2) / tanh 2) / 2: a power law with a share of an S curve, such as picture
    presets of real projectors add. Exponent g and share m differ by channel: no gamma fits, nor one curve for all.
    """
    P = np.asarray(P, np.float64)
    gamma, share = _GAMMA[channel % 3], _S_SHARE[channel % 3]
    return (1 - share) * P**gamma + share * 0.5 * (1 + np.tanh(4 * P - 2) / np.tanh(2.0))


def response_table(channels: int, bits: int) -> NDArray[np.float32]:
    """Linear intensities of all device codes, (N, 2**bits)."""
    P = np.arange(2**bits) / (2**bits - 1)
    return np.array([response(P, channel) for channel in range(channels)], dtype=np.float32)


def camera_sensitivities() -> NDArray[np.float64]:
    """Spectral sensitivities of the bench's camera, (3, 81), red, green, blue: Gaussian bells with peak 1."""
    peak, width = np.array(_SENSITIVITY_NM).T[..., None]
    return np.exp(-0.5 * ((WAVELENGTHS_NM - peak) / width) ** 2)


def ink_terms(paper: NDArray[np.float64], inks: NDArray[np.float64]) -> NDArray[np.float64]:
    """Terms of the transmittance T = sum_k a_k terms[k], (1 + L, 81): 1 for the paper, t_i - 1 for each ink.

    Parameters
    ----------
    paper : (81,) array
        Reflectance of the bare paper.
    inks : (L, 81) array
        Reflectance of the solid patch of each ink; its light has passed the ink twice, so t_i = sqrt(R_i / R).
    """
    return np.concatenate((np.ones((1, len(paper))), np.sqrt(inks / paper) - 1.0))


def pair_spectra(
    spectra: NDArray[np.float64], paper: NDArray[np.float64], terms: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Spectral radiance of unit light for each channel and pair of passages, (N, 1 + L, 1 + L, 81)."""
    return np.einsum("jw,w,kw,lw->jklw", spectra, paper, terms, terms)


def pair_factors(
    sensitivities: NDArray[np.float64],
    spectra: NDArray[np.float64],
    paper: NDArray[np.float64],
    terms: NDArray[np.float64],
) -> NDArray[np.float32]:
    """What each sensor makes of `pair_spectra`: G, (sensors, N, 1 + L, 1 + L), integrated over wavelength.

    Parameters
    ----------
    sensitivities : (sensors, 81) array
    spectra : (N, 81) array
        Primaries.
    paper : (81,) array
    terms : (1 + L, 81) array
        From `ink_terms`.
    """
    step_nm = WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]
    factors = np.einsum("sw,jklw->sjkl", sensitivities, pair_spectra(spectra, paper, terms)) * step_nm
    return factors.astype(np.float32)


def patch_factors(factors: NDArray[_Real]) -> NDArray[_Real]:
    """`pair_factors` for paper without scattering: light leaves where it entered (Murray-Davies).

    Both passages then lie in one point, where one ink decides: the pairs collapse to terms [0, 0] for the paper and
    [k, 0] for ink k, the rest is 0.
    """
    collapsed = np.zeros_like(factors)
    collapsed[..., 0, 0] = factors[..., 0, 0]
    for k in range(1, factors.shape[-1]):
        collapsed[..., k, 0] = factors[..., k, k] + factors[..., k, 0] + factors[..., 0, k]
    return collapsed
