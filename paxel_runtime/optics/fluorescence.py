"""Fluorescence on the virtual bench: what inks and brightened paper emit under light that excites them.

A fluorescent colorant is one product of the Donaldson matrix, emission(wavelength) x excitation(wavelength): its
emission has one spectrum whatever excites it (Kasha's rule). Bands of excitation reach from 300 nm, so that a UV
channel, which no eye sees, has a spectrum here. Emission arises where the excitation enters; it spreads in the paper
and leaves through the other inks as reflected light does, and adds to that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.pattern import Colorant, colorant_library

__all__ = [
    "EXCITATION_NM",
    "Fluorescence",
    "brightener",
    "donaldson_to_fluorescence",
    "emission_spectra",
    "fluorescent_inks",
    "uv_line",
]

_STEP_NM = float(WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0])
EXCITATION_NM: NDArray[np.float64] = np.arange(300.0, WAVELENGTHS_NM[-1] + 0.1, _STEP_NM)
"""Wavelengths of excitation, (97,): 300-780 nm by 5 nm."""

_UNSEEN = len(EXCITATION_NM) - len(WAVELENGTHS_NM)
_UV_PEAK_NM, _UV_SHORT_NM, _UV_LONG_NM = 365.0, 3.5, 5.0
_TRIAD_NM = {"red": (613.0, 14.0), "green": (520.0, 22.0), "blue": (445.0, 24.0)}
_YIELD = {"red": 0.35, "green": 0.40, "blue": 0.45}


@dataclass(frozen=True, eq=False)
class Fluorescence:
    """What a colorant emits.

    Attributes
    ----------
    emission : (81,) float64 array
        Spectrum on `WAVELENGTHS_NM`, per nm, its sum times 5 nm being 1; >= 0.
    excitation : (97,) float64 array
        Radiant power emitted in all per power that falls on a solid patch, on `EXCITATION_NM`; 0..1.

    Raises
    ------
    InputError
        If a spectrum has another length, a value out of its range, or the emission does not sum to 1.
    """

    emission: NDArray[np.float64]
    excitation: NDArray[np.float64]

    def __post_init__(self) -> None:
        shapes = (np.shape(self.emission), np.shape(self.excitation))
        if shapes != (WAVELENGTHS_NM.shape, EXCITATION_NM.shape):
            raise InputError(f"emission and excitation of a fluorescent ink must be (81,) and (97,), got {shapes}")
        area = float(np.sum(self.emission) * _STEP_NM)
        if not (np.min(self.emission) >= 0 and abs(area - 1) < 1e-6):
            raise InputError(f"the emission of a fluorescent ink must be >= 0 and have the area 1, got {area:g}")
        if not (np.min(self.excitation) >= 0 and np.max(self.excitation) <= 1):
            raise InputError("the excitation of a fluorescent ink must lie in 0..1: it cannot emit more than it gets")


def _bell(wavelengths_nm: NDArray[np.float64], peak_nm: float, short_nm: float, long_nm: float) -> NDArray[np.float64]:
    """Two half Gaussians, peak 1."""
    return np.exp(-0.5 * ((wavelengths_nm - peak_nm) / np.where(wavelengths_nm < peak_nm, short_nm, long_nm)) ** 2)


def uv_line() -> NDArray[np.float64]:
    """Spectral power of a 365 nm LED on `EXCITATION_NM`, per nm, its area being 1: 10 nm wide, the longer side wider.

    Less than 1 % of it is light above 380 nm.
    """
    line = _bell(EXCITATION_NM, _UV_PEAK_NM, _UV_SHORT_NM, _UV_LONG_NM)
    return line / (line.sum() * _STEP_NM)


def _uv_excited(peak_nm: float, width_nm: float, efficiency: float) -> Fluorescence:
    """A dye with the given emission whose excitation is flat in the UV and ends at 400 nm."""
    emission = _bell(WAVELENGTHS_NM, peak_nm, width_nm, 1.4 * width_nm)
    excitation = efficiency / (1.0 + np.exp((EXCITATION_NM - 392.0) / 5.0))
    return Fluorescence(emission / (emission.sum() * _STEP_NM), excitation)


def fluorescent_inks() -> dict[str, tuple[Colorant, Fluorescence]]:
    """Three inks that are colourless in visible light and shine red, green and blue under UV.

    Parametric: emission bells at 613, 520 and 445 nm, such as security inks have; ``"uv-red"``, ``"uv-green"``,
    ``"uv-blue"``. For `BenchSetup`: the first as `colorants`, the second as `fluorescence`.
    """
    paper = colorant_library()["white"].reflectance
    return {
        f"uv-{name}": (
            Colorant(f"uv-{name}", paper, (0.0, 0.0, 0.0, 0.0)),
            _uv_excited(*_TRIAD_NM[name], efficiency=_YIELD[name]),
        )
        for name in _TRIAD_NM
    }


def brightener() -> Fluorescence:
    """An optical brightener in paper: shines blue (435 nm) under UV; a fifth of the power comes back."""
    return _uv_excited(435.0, 18.0, 0.2)


def donaldson_to_fluorescence(matrix: ArrayLike, emission_nm: ArrayLike, excitation_nm: ArrayLike) -> Fluorescence:
    """The product that lies nearest a measured bispectral (Donaldson) matrix, reflection left out.

    Parameters
    ----------
    matrix : (emission, excitation) array
        Radiance factors per band of excitation: the diagonal is reflection, what lies at longer wavelengths is
        emission. Bands where excitation and emission are within 15 nm are left out; noise below 0 is cut.
    emission_nm, excitation_nm : 1-D arrays
        Their wavelengths, rising; the emission's in equal steps.
    """
    out, into = np.asarray(emission_nm, np.float64), np.asarray(excitation_nm, np.float64)
    emitted = np.where(out[:, None] - into > 15.0, np.maximum(np.asarray(matrix, np.float64), 0.0), 0.0)
    left, values, right = np.linalg.svd(emitted)
    emission = np.interp(WAVELENGTHS_NM, out, np.abs(left[:, 0]), left=0.0, right=0.0)
    area = float(np.abs(left[:, 0]).sum() * values[0])
    efficiency = np.interp(EXCITATION_NM, into, np.abs(right[0]) * area, left=0.0, right=0.0)
    return Fluorescence(emission / (emission.sum() * _STEP_NM), np.minimum(efficiency, 1.0))


def emission_spectra(
    excitation: NDArray[np.float64], terms: NDArray[np.float64], emitters: dict[int, Fluorescence]
) -> NDArray[np.float64]:
    """Spectral radiance that unit light excites, (N, 1 + L, 1 + L, 81), to be added to `optics.pair_spectra`.

    [j, k, l]: light of channel j that enters through term l and leaves through term k (term 0 the paper). An ink's
    emission is the measured one of its solid patch: it leaves undimmed where that ink is, through the others as
    through filters. The paper's own passes every ink on both ways; in the UV an ink's transmittance is that at 380 nm.

    Parameters
    ----------
    excitation : (N, 97) array
        Spectral power of the channels on `EXCITATION_NM`.
    terms : (1 + L, 81) array
        From `optics.ink_terms`.
    emitters : dict
        Fluorescence by number of the term: 0 the paper, 1 + i ink i.
    """
    count = len(terms)
    spectra = np.zeros((len(excitation), count, count, len(WAVELENGTHS_NM)))
    wide_terms = np.concatenate((np.repeat(terms[:, :1], _UNSEEN, axis=1), terms), axis=1)
    for source, fluorescence in emitters.items():
        if source == 0:
            taken = np.einsum("jm,lm,m->jl", excitation, wide_terms, fluorescence.excitation) * _STEP_NM
            spectra += np.einsum("jl,kw,w->jklw", taken, terms, fluorescence.emission)
        else:
            taken_by_ink = excitation @ fluorescence.excitation * _STEP_NM
            leaving = terms.copy()
            leaving[source] = 0.0
            spectra[:, :, source] += np.einsum("j,kw,w->jkw", taken_by_ink, leaving, fluorescence.emission)
    return spectra
