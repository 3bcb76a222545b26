"""What a fluorescent colorant emits and under which light, as data; how light is made of it is not known here.

A fluorescent colorant is one product of the Donaldson matrix, emission(wavelength) x excitation(wavelength): its
emission has one spectrum whatever excites it (Kasha's rule). Bands of excitation reach from 300 nm, so that a UV
channel, which no eye sees, has a spectrum here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM

__all__ = ["EXCITATION_NM", "UV_BAND_NM", "Fluorescence", "brightener", "excitation_band", "fluorescent_triad"]

_STEP_NM = float(WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0])
EXCITATION_NM: NDArray[np.float64] = np.arange(300.0, WAVELENGTHS_NM[-1] + 0.1, _STEP_NM)
"""Wavelengths of excitation, (97,): 300-780 nm by 5 nm."""

UV_BAND_NM = (300.0, 392.0)
"""Where the dyes of security inks and paper brighteners take up light."""

_EDGE_NM = 5.0
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


def excitation_band(band_nm: tuple[float, float], efficiency: float) -> NDArray[np.float64]:
    """Excitation (97,) that is `efficiency` within a band of wavelengths; its edges are 5 nm soft.

    The band's short end is left sharp where it lies at 300 nm, the grid's own.
    """
    low, high = band_nm
    rising = 1.0 / (1.0 + np.exp((low - EXCITATION_NM) / _EDGE_NM)) if low > EXCITATION_NM[0] else 1.0
    return efficiency * rising / (1.0 + np.exp((EXCITATION_NM - high) / _EDGE_NM))


def fluorescent_triad() -> dict[str, Fluorescence]:
    """Dyes of three inks that are colourless in visible light and shine under UV, by ``"uv-red"``, ``"uv-green"`` ...

    Parametric: emission bells at 613, 520 and 445 nm, such as security inks have.
    """
    return {f"uv-{name}": _uv_excited(*_TRIAD_NM[name], efficiency=_YIELD[name]) for name in _TRIAD_NM}


def brightener() -> Fluorescence:
    """An optical brightener in paper: shines blue (435 nm) under UV; a fifth of the power comes back."""
    return _uv_excited(435.0, 18.0, 0.2)


def _uv_excited(peak_nm: float, width_nm: float, efficiency: float) -> Fluorescence:
    """A dye whose emission is two half Gaussians, the longer side wider, and whose excitation ends at 400 nm."""
    sigma_nm = np.where(peak_nm > WAVELENGTHS_NM, width_nm, 1.4 * width_nm)
    emission = np.exp(-0.5 * ((WAVELENGTHS_NM - peak_nm) / sigma_nm) ** 2)
    return Fluorescence(emission / (emission.sum() * _STEP_NM), excitation_band(UV_BAND_NM, efficiency))
