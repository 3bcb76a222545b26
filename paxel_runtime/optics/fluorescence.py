"""Fluorescence on the virtual bench: what light a UV lamp gives, and what inks and brightened paper make of any light.

Emission arises where the excitation enters; it spreads in the paper and leaves through the other inks as reflected
light does, and adds to that. What a colorant emits is said in `model.fluorescence`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.fluorescence import EXCITATION_NM, Fluorescence

__all__ = ["donaldson_to_fluorescence", "emission_spectra", "uv_line"]

_STEP_NM = float(WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0])
_UNSEEN = len(EXCITATION_NM) - len(WAVELENGTHS_NM)
_UV_PEAK_NM, _UV_SHORT_NM, _UV_LONG_NM = 365.0, 3.5, 5.0


def _bell(wavelengths_nm: NDArray[np.float64], peak_nm: float, short_nm: float, long_nm: float) -> NDArray[np.float64]:
    """Two half Gaussians, peak 1."""
    return np.exp(-0.5 * ((wavelengths_nm - peak_nm) / np.where(wavelengths_nm < peak_nm, short_nm, long_nm)) ** 2)


def uv_line() -> NDArray[np.float64]:
    """Spectral power of a 365 nm LED on `EXCITATION_NM`, per nm, its area being 1: 10 nm wide, the longer side wider.

    Less than 1 % of it is light above 380 nm.
    """
    line = _bell(EXCITATION_NM, _UV_PEAK_NM, _UV_SHORT_NM, _UV_LONG_NM)
    return line / (line.sum() * _STEP_NM)


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
