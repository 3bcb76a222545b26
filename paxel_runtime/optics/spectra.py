"""Spectra of the virtual bench: primaries, response curves, inks as transmittances, what camera and eye make of them.

Light passes the ink twice. With T the transmittance of the ink at each point of the wall, R the reflectance of the
paper under it, s the spread of light inside the paper, and L_j the light of projector channel j with spectrum P_j, the
radiance is

    sum_j P_j R T [s * (T L_j)]     (J. A. C. Yule, W. J. Nielsen 1951, as a convolution: optical dot gain emerges)

and since T = 1 + sum_i a_i (t_i - 1), with a_i the coverage of ink i and t_i = sqrt(R_i / R) from its solid patch, a
sensor sees ``sum_jkl G[j, k, l] a_k [s * (a_l L_j)]`` with a_0 = 1. `pair_factors` makes G, once, for any sensor; the
other modules of the bench (`paxel_runtime.optics`) compute the spatial part.

The bench shares nothing with the estimators but plain colorimetry: its response curves are its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.fluorescence import EXCITATION_NM
from paxel_runtime.optics.fluorescence import uv_line

__all__ = [
    "PROJECTORS",
    "RESPONSES",
    "ambient_spectrum",
    "camera_sensitivities",
    "excitation_spectra",
    "ink_terms",
    "pair_factors",
    "pair_spectra",
    "patch_factors",
    "primaries",
    "response",
    "response_table",
    "sensor_factors",
    "shift_of_level",
    "shift_spectra",
]

PROJECTORS = ("dlp", "rgbw")
"""Projectors whose measured spectra the bench has."""

RESPONSES = ("linear", "power", "srgb", "red-preset", "green-preset", "blue-preset", "rgbw")
"""Response curves of `response` by name; the presets are the bench's own of the first three channels."""

NO_SPECTRA: Mapping[str, NDArray[np.float64]] = MappingProxyType({})
"""No channels of one's own."""

_Real = TypeVar("_Real", np.float32, np.float64)

_GAMMA = (1.9, 2.2, 2.5)
_S_SHARE = (0.35, 0.20, 0.12)
_SENSITIVITY_NM = ((602.0, 34.0), (537.0, 41.0), (458.0, 29.0))


def primaries(
    channels: tuple[str, ...], projector: str = "dlp", own: Mapping[str, NDArray[np.float64]] = NO_SPECTRA
) -> NDArray[np.float64]:
    """Spectral power of projector channels at full, (N, 81), on `WAVELENGTHS_NM`, per nm.

    Of ``"dlp"``, ``"red"``, ``"green"``, ``"blue"`` are measured DLP-LED primaries whose sum is D65 with Y = 1;
    ``"white"`` is their sum (a white-light projector of one channel). Of ``"rgbw"``, the four are measured primaries
    whose sum has Y = 1. ``"uv"`` is, with each, what the eye might see of a 365 nm LED of the power of full white. In
    `own`, spectra (97,) on `EXCITATION_NM` of further channels, which come before those.

    Raises
    ------
    InputError
        For an unknown projector, or a channel without a spectrum.
    """
    if projector not in PROJECTORS:
        raise InputError(f"the virtual bench has spectra of the projectors {', '.join(PROJECTORS)}; got {projector!r}")
    table = {**_projector_spectra(projector), **own}
    unknown = [name for name in channels if name not in table]
    if unknown:
        raise InputError(f"the virtual bench has spectra for the channels {', '.join(table)}; got {', '.join(unknown)}")
    return np.array([table[name][-len(WAVELENGTHS_NM) :] for name in channels])


def excitation_spectra(
    channels: tuple[str, ...], projector: str = "dlp", own: Mapping[str, NDArray[np.float64]] = NO_SPECTRA
) -> NDArray[np.float64]:
    """`primaries` with the ultraviolet, (N, 97), on `EXCITATION_NM`, per nm."""
    table = {**_projector_spectra(projector), **own}
    rows = [table[name] for name in channels]
    return np.array([np.concatenate((np.zeros(len(EXCITATION_NM) - len(row)), row)) for row in rows])


def shift_spectra(channels: tuple[str, ...]) -> NDArray[np.float64]:
    """What the channels of ``"rgbw"`` add to their spectra at full, (N, 97), times `shift_of_level`; signed, per nm.

    Measured: the shape of a channel's spectrum changes with its level, by 3 to 9 % of its light. Channels that were not
    measured keep theirs.
    """
    wavelengths_nm, table = _read_columns("rgbw_shift.csv")
    assert np.array_equal(wavelengths_nm, WAVELENGTHS_NM)
    spectra = np.zeros((len(channels), len(EXCITATION_NM)))
    for row, name in zip(spectra, channels, strict=True):
        row[-len(WAVELENGTHS_NM) :] = table.get(name, 0.0)
    return spectra


def shift_of_level(x: NDArray[np.float32], channels: tuple[str, ...]) -> NDArray[np.float32]:
    """How much of `shift_spectra` each channel adds at linear intensities x, (N, ...) -> (N, ...): 0 at 0 and at 1."""
    _, responses = _read_columns("rgbw_response.csv")
    _, curves = _read_columns("rgbw_shift_response.csv")
    shift = np.zeros_like(x)
    for j, name in enumerate(channels):
        if name in curves:
            shift[j] = np.interp(x[j], responses[name], curves[name])
    return shift


@cache
def _projector_spectra(projector: str) -> dict[str, NDArray[np.float64]]:
    wavelengths_nm, spectra = _read_columns(f"{projector}.csv")
    assert np.array_equal(wavelengths_nm, WAVELENGTHS_NM)
    full = np.sum(list(spectra.values()), axis=0)
    step_nm = WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]
    return {"white": full} | spectra | {"uv": uv_line() * full.sum() * step_nm}


@cache
def _read_columns(name: str) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """First column, and the others by name, of a table of numbers."""
    with (files("paxel_runtime") / "data" / name).open(encoding="utf-8") as file:
        lines = [line for line in file.read().splitlines() if not line.startswith("#")]
    columns = np.array([line.split(",") for line in lines[1:]], np.float64).T
    return columns[0], dict(zip(lines[0].split(",")[1:], columns[1:], strict=True))


@cache
def ambient_spectrum() -> NDArray[np.float64]:
    """Spectral power of D65 with Y = 1 on `EXCITATION_NM`, (97,), per nm: its ultraviolet excites what fluoresces."""
    with (files("paxel_runtime") / "data" / "cie_d65_5nm.csv").open(encoding="utf-8") as file:
        table = np.loadtxt(file, delimiter=",", comments="#")
    D65 = np.interp(EXCITATION_NM, *table.T)
    return D65 / spectra_to_XYZ(D65[-len(WAVELENGTHS_NM) :])[1]


def response(P: ArrayLike, channel: int, curve: str = "", name: str = "white") -> NDArray[np.float64]:
    """Linear intensity x of a device value P (0..1) on the bench's projector; 0 -> 0, 1 -> 1, rising.

    x = (1 - m) P^g + m (1 + tanh(4 P - 2) / tanh 2) / 2: a power law with a share of an S curve, such as picture
    presets of real projectors add. Exponent g and share m differ by channel: no gamma fits, nor one curve for all.

    Parameters
    ----------
    P : array_like
    channel : int
        Number of the channel, which has a curve of its own unless `curve` says another.
    curve : str
        One of `RESPONSES`: ``"power"`` is P^2.2, ``"rgbw"`` the measured curve of the channel's name.
    name : str
        Of the channel, for ``"rgbw"``; one that was not measured has that of white.
    """
    P = np.asarray(P, np.float64)
    if curve == "linear":
        return P.copy()
    if curve == "power":
        return np.asarray(P**2.2)
    if curve == "srgb":
        return np.asarray(np.where(P <= 0.04045, P / 12.92, ((P + 0.055) / 1.055) ** 2.4))
    if curve == "rgbw":
        levels, measured = _read_columns("rgbw_response.csv")
        return np.asarray(PchipInterpolator(levels, measured.get(name, measured["white"]))(P))
    number = RESPONSES.index(curve) - RESPONSES.index("red-preset") if curve else channel % 3
    gamma, share = _GAMMA[number], _S_SHARE[number]
    return (1 - share) * P**gamma + share * 0.5 * (1 + np.tanh(4 * P - 2) / np.tanh(2.0))


def response_table(
    channels: int, bits: int, curves: tuple[str, ...] = (), names: tuple[str, ...] = ()
) -> NDArray[np.float32]:
    """Linear intensities of all device codes, (N, 2**bits); `curves` and `names` as in `response`, or empty."""
    P = np.arange(2**bits) / (2**bits - 1)
    curves, names = curves or ("",) * channels, names or ("white",) * channels
    rows = [response(P, j, curve, name) for j, (curve, name) in enumerate(zip(curves, names, strict=True))]
    return np.array(rows, dtype=np.float32)


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
    return sensor_factors(sensitivities, pair_spectra(spectra, paper, terms))


def sensor_factors(sensitivities: NDArray[np.float64], of_pairs: NDArray[np.float64]) -> NDArray[np.float32]:
    """What each sensor makes of radiances of pairs (N, 1 + L, 1 + L, 81): G, (sensors, N, 1 + L, 1 + L)."""
    step_nm = WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]
    factors = np.einsum("sw,jklw->sjkl", sensitivities, of_pairs) * step_nm
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
