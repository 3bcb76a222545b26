"""The spatial spectrum of a printed layout, and how visible the print is at a distance.

The cells repeat as a torus, so the spectrum is a lattice of lines: the discrete Fourier transform of the cells, times
the sinc of a square cell, turned by the angle. Exact; nothing is rendered.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_design.visibility.s_cielab import XYZ_TO_OPPONENT, colorants_to_XYZ, opponent_to_Lab
from paxel_design.visibility.sensitivity import cycles_per_degree, luminance_sensitivity, opponent_sensitivity
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

__all__ = ["LayoutSpectrum", "PatternVisibility", "layout_spectrum", "pattern_visibility", "radial_average"]

_ZONES, _ZONES_OF_LARGE, _LARGE = 2, 1, 10_000
"""Cycles per cell up to which lines are taken, of small and large tori (cells): beyond, the square cell's sinc leaves
less than a tenth of a line, and no eye sees it."""

_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class LayoutSpectrum:
    """Lines of a layout's spectrum; of each pair (f, -f) one.

    Attributes
    ----------
    frequency_per_mm : (m, 2) float64 array
        Cycles per millimetre along x and y of the wall.
    XYZ : (m, 3) complex array
        Fourier coefficients: the line adds ``2 |XYZ| cos(2 pi f . p + arg XYZ)``.
    mean_XYZ : (3,) float64 array
        The mean colour of the print under D65, Y = 1 for a perfect diffuser.
    """

    frequency_per_mm: NDArray[np.float64]
    XYZ: NDArray[np.complex128]
    mean_XYZ: NDArray[np.float64]

    @property
    def radius_per_mm(self) -> NDArray[np.float64]:
        """Length of every frequency, (m,)."""
        return np.hypot(*self.frequency_per_mm.T)

    @property
    def contrast(self) -> NDArray[np.float64]:
        """Amplitude of every line's luminance over the mean luminance, (m,)."""
        return np.asarray(2 * np.abs(self.XYZ[:, 1]) / self.mean_XYZ[1])


@dataclass(frozen=True)
class PatternVisibility:
    """How plainly a print is seen as a pattern, under even light.

    Attributes
    ----------
    distance_mm : float
    luminance, opponent : float
        In threshold units: 1 is just seen (root of the summed squares over the lines).
    frequency_cpd : float
        Of the line that is seen best, cycles per degree.
    """

    distance_mm: float
    luminance: float
    opponent: float
    frequency_cpd: float


def layout_spectrum(pattern: Pattern, zones: int = 0) -> LayoutSpectrum:
    """The lines of a layout's spectrum, as printed (with its measured scale); lines of no strength left out.

    Parameters
    ----------
    pattern : Pattern
    zones : int
        Cycles a cell up to which lines are taken; 0 = two, and one of large tori.
    """
    XYZ = colorants_to_XYZ(pattern.palette)
    rows, columns = pattern.cells.shape
    cells_XYZ = XYZ[pattern.cells]
    amplitude = np.fft.fft2(cells_XYZ, axes=(0, 1)) / (rows * columns)
    zones = zones or (_ZONES if pattern.cells.size <= _LARGE else _ZONES_OF_LARGE)
    u = np.arange(-zones * columns, zones * columns + 1)
    v = np.arange(0, zones * rows + 1)
    # the half plane v > 0, or v = 0 and u > 0
    half = (v[:, None] > 0) | (u[None] > 0)
    row, column = np.nonzero(half)
    fu, fv = u[column] / columns, v[row] / rows
    shape = np.sinc(fu) * np.sinc(fv)
    lines = amplitude[v[row] % rows, u[column] % columns] * shape[:, None]
    kept = np.abs(lines).max(axis=1) > _NOTHING
    fu, fv, lines = fu[kept], fv[kept], lines[kept]
    angle = np.deg2rad(pattern.angle_deg)
    c, s = np.cos(angle) / pattern.dot_size_mm, np.sin(angle) / pattern.dot_size_mm
    # cells are (c x + s y, c y - s x) of the unscaled place, so frequencies turn with them
    x_per_mm = (c * fu - s * fv) / pattern.print_scale[0]
    y_per_mm = (s * fu + c * fv) / pattern.print_scale[1]
    return LayoutSpectrum(np.stack([x_per_mm, y_per_mm], axis=1), lines, np.asarray(cells_XYZ.mean(axis=(0, 1))))


def pattern_visibility(
    pattern: Pattern | LayoutSpectrum, distance_mm: float, luminance_cd_m2: float = 100.0
) -> PatternVisibility:
    """How visible a print is as a pattern from a distance (design: section 11).

    Parameters
    ----------
    pattern : Pattern or its LayoutSpectrum
    distance_mm : float
    luminance_cd_m2 : float
        Mean luminance of the lit print.

    Raises
    ------
    InputError
        If the distance or the luminance is not positive, or the print has no light.
    """
    spectrum = layout_spectrum(pattern) if isinstance(pattern, Pattern) else pattern
    if not spectrum.mean_XYZ[1] > 0:
        raise InputError("a print must reflect some light to be seen, got a mean luminance of 0")
    cpd = cycles_per_degree(spectrum.radius_per_mm, distance_mm)
    luminance = spectrum.contrast * luminance_sensitivity(cpd, luminance_cd_m2)
    opponent = 2 * np.abs(spectrum.XYZ @ XYZ_TO_OPPONENT.T)[:, 1:]
    # each opponent channel's deviation as a length in CIELAB
    in_Lab = opponent * np.linalg.norm(opponent_to_Lab(spectrum.mean_XYZ)[:, 1:], axis=0)
    in_thresholds = in_Lab * opponent_sensitivity(cpd)
    both = luminance**2 + (in_thresholds**2).sum(axis=1)
    return PatternVisibility(
        distance_mm,
        float(np.sqrt(np.sum(luminance**2))),
        float(np.sqrt(np.sum(in_thresholds**2))),
        float(cpd[np.argmax(both)]) if both.size else 0.0,
    )


def radial_average(
    spectrum: LayoutSpectrum, bins: int = 60, limit_per_mm: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Luminance power by frequency, and how much it depends on direction.

    Parameters
    ----------
    spectrum : LayoutSpectrum
    bins : int
        Rings of equal width from 0 to the limit.
    limit_per_mm : float, optional
        Largest frequency; that of the strongest line and half as much again by default.

    Returns
    -------
    frequency_per_mm : (bins,) array
        Middle of each ring.
    power : (bins,) array
        Squared contrast in the ring, summed, per cycle/mm.
    anisotropy : (bins,) array
        Of the ring's power over its direction: |sum P exp(2 i k phi)| / sum P, the largest of k = 1, 2, 3; 0 for light
        from all sides, 1 for a line or a lattice; NaN where a ring has no power.
    """
    radius = spectrum.radius_per_mm
    power = spectrum.contrast**2 / 2
    if limit_per_mm is None:
        limit_per_mm = 1.5 * float(radius[np.argmax(power)])
    edges = np.linspace(0, limit_per_mm, bins + 1)
    summed = np.histogram(radius, edges, weights=power)[0]
    phi = np.arctan2(spectrum.frequency_per_mm[:, 1], spectrum.frequency_per_mm[:, 0])
    anisotropy = np.zeros(bins)
    for k in (1, 2, 3):
        real, imaginary = (
            np.histogram(radius, edges, weights=power * wave(2 * k * phi))[0] for wave in (np.cos, np.sin)
        )
        anisotropy = np.maximum(anisotropy, np.hypot(real, imaginary))
    with np.errstate(invalid="ignore", divide="ignore"):
        anisotropy = np.where(summed > 0, anisotropy / summed, np.nan)
    return (edges[1:] + edges[:-1]) / 2, summed / np.diff(edges), anisotropy
