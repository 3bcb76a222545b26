"""Light passes a print twice, into the paper and out of it, through one ink or two.

Light that enters beside an edge and leaves beyond it is coloured by both (optical dot gain; Yule and Nielsen 1951). A
passage of a colorant is the square root of its reflectance (Clapper and Yule 1953, without inner reflections).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.model.colorimetry import illuminant_D65, spectra_to_XYZ
from paxel_runtime.model.pattern import Colorant, Pattern

__all__ = ["SCATTERING_MM", "passage_reflectances", "passages_to_XYZ", "scattered_cells"]

SCATTERING_MM = 0.06
"""Sigma of the light's way in paper: half of the contrast is left at 3 cycles/mm, as in coated paper. Measurements: G.
L. Rogers, Applied Optics 37, 1998; L. G. Coppel, M. Neuman and P. Edstrom, Optics Express 19, 2011."""


_SAMPLES = 1 << 20


def passage_reflectances(colorants: Sequence[Colorant]) -> NDArray[np.float64]:
    """What returns through each colorant of the light that entered through each, (M, M, 81): their geometric mean."""
    passed = np.sqrt([colorant.reflectance for colorant in colorants])
    return np.asarray(passed[:, None] * passed[None])


def passages_to_XYZ(colorants: Sequence[Colorant]) -> NDArray[np.float64]:
    """XYZ of `passage_reflectances`, (M, M, 3): under D65, as `colorants_to_XYZ` has the solids on the diagonal.

    Of fluorescent inks that are told apart by what they emit alone: the mean of both, half emitted on either way.
    """
    solid_XYZ = colorants_to_XYZ(colorants)
    reflectances = passage_reflectances(colorants)
    if np.allclose(reflectances, reflectances[0, 0], rtol=0.0, atol=1e-9):
        return np.asarray((solid_XYZ[:, None] + solid_XYZ[None]) / 2)
    D65 = illuminant_D65()
    return np.asarray(spectra_to_XYZ(reflectances * D65) / spectra_to_XYZ(D65)[1])


@lru_cache(maxsize=2)  # of one print at many zooms
def scattered_cells(pattern: Pattern, scattering_mm: float = SCATTERING_MM) -> NDArray[np.float32]:
    """Where light leaves that enters at a place: share of each colorant around but the first, n to a cell.

    (rows n, columns n, M - 1), of the torus of cells, by a Gaussian of sigma `scattering_mm`; n is 16, and down to 4 of
    large tori. Not to be written into: it is kept.
    """
    rows, columns = pattern.cells.shape
    n = 1 if scattering_mm == 0 else next((n for n in (16, 8) if pattern.cells.size * n**2 <= _SAMPLES), 4)
    inked = (np.kron(pattern.cells, np.ones((n, n), np.uint8)) == k for k in range(1, len(pattern.colorants)))
    if scattering_mm == 0:
        return np.stack([one.astype(np.float32) for one in inked], axis=-1)
    sigma = scattering_mm / pattern.dot_size_mm  # cells
    down, across = scipy.fft.fftfreq(rows * n, 1 / n), scipy.fft.rfftfreq(columns * n, 1 / n)
    transfer = np.exp(-2 * (np.pi * sigma) ** 2 * (down[:, None] ** 2 + across**2)).astype(np.float32)
    shape = (rows * n, columns * n)
    blurred = [scipy.fft.irfft2(scipy.fft.rfft2(one.astype(np.float32)) * transfer, shape) for one in inked]
    return np.ascontiguousarray(np.stack(blurred, axis=-1))
