"""The sheets on the virtual bench: what each reflects and emits, where its ink lies, how it is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import BenchQuality
from paxel_runtime.devices.bench_setup import GRAY, BenchSetup
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.optics.cache import cached
from paxel_runtime.optics.fluorescence import emission_spectra
from paxel_runtime.optics.geometry import BenchMaps
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.held import HeldSheet, defocus, hold_sheet
from paxel_runtime.optics.ink import ink_coverage, make_layers
from paxel_runtime.optics.overprint import lay_over, overprint_reflectance
from paxel_runtime.optics.spectra import (
    ambient_spectrum,
    excitation_spectra,
    ink_terms,
    pair_spectra,
    primaries,
    sensor_factors,
)

__all__ = ["BenchSheet", "inks_of", "make_sheet", "plain_sheet"]


@dataclass(frozen=True, eq=False)
class BenchSheet:
    """A sheet.

    Attributes
    ----------
    coverage : (L, rows, columns) uint8 array
        Of each ink, and of each overprint, on the fine raster.
    of_pairs : (N, 1 + L, 1 + L, 81) float64 array
        Spectral radiance of unit light of each channel; see `optics.pair_spectra`.
    of_ambient : (1 + L, 1 + L, 81) float64 array
        The same of the ambient light.
    held : HeldSheet, optional
        None for a sheet in place.
    """

    coverage: NDArray[np.uint8]
    of_pairs: NDArray[np.float64]
    of_ambient: NDArray[np.float64]
    held: HeldSheet | None = None

    def ambient_factors(self, sensitivities: NDArray[np.float64]) -> NDArray[np.float32] | None:
        """(sensors, 1 + L, 1 + L) factors of the ambient light; None in the dark."""
        return sensor_factors(sensitivities, self.of_ambient[None])[:, 0] if self.of_ambient.any() else None

    @property
    def solids(self) -> NDArray[np.float64]:
        """Spectral radiance of bare paper and of each solid ink under unit light, (N, 1 + L, 1, 81)."""
        own = np.arange(self.of_pairs.shape[1])
        pairs = self.of_pairs
        inked = pairs[:, own, own] + pairs[:, own, 0] + pairs[:, 0, own] + pairs[:, :1, 0]
        inked[:, 0] = pairs[:, 0, 0]
        return inked[:, :, None]

    def light(self, lit: NDArray[np.float32]) -> NDArray[np.float32]:
        """Intensities (N, H, W) as they reach the sheet."""
        if self.held is None:
            return lit
        return defocus(lit, self.held.defocus_px2) * self.held.irradiance


def inks_of(setup: BenchSetup) -> list[int]:
    """The colorants that are ink (not bare paper), the darkest first."""
    names, library = setup.pattern.colorants, setup.library
    paper = library["white"].reflectance
    inks = [
        i
        for i, name in enumerate(names)
        if not np.array_equal(library[name].reflectance, paper) or (name in setup.fluorescence and name != "white")
    ]
    darkness = {i: float(spectra_to_XYZ(library[names[i]].reflectance)[1]) for i in inks}
    return sorted(inks, key=darkness.__getitem__)


def plain_sheet(setup: BenchSetup, grid: FineGrid, surface: str) -> BenchSheet:
    """A blank sheet in place: ``"white"`` the print's paper, ``"gray"``, or the name of a colorant."""
    paper = setup.library["white" if surface == "gray" else surface].reflectance
    paper = GRAY * paper if surface == "gray" else paper
    return _sheet(setup, np.empty((0, *grid.shape), np.uint8), paper, [], {0: surface})


def make_sheet(
    setup: BenchSetup, quality: BenchQuality, grid: FineGrid, maps: BenchMaps, surface: str
) -> tuple[BenchSheet, NDArray[np.uint8]]:
    """The sheet of ``"pattern"`` or ``"white"``, and the ink that decides on each fine sample of it (for the truth)."""
    pattern, library, inks = setup.pattern, setup.library, inks_of(setup)
    if surface == "white":
        sheet = plain_sheet(setup, grid, setup.second_surface)
        if setup.held:
            held = hold_sheet(maps, setup.resolution, setup.width_mm, setup.sheet_distance_mm, setup.sheet_tilt_deg)
            sheet = BenchSheet(sheet.coverage, sheet.of_pairs, sheet.of_ambient, held)
        return sheet, sheet.coverage
    if not inks:
        sheet = plain_sheet(setup, grid, "white")
        return sheet, sheet.coverage
    layers = make_layers(
        pattern,
        inks,
        (quality.print_scale_x, quality.print_scale_y),
        quality.ink_offset_um,
        quality.ink_spread_um,
        quality.ragged_um,
        quality.ragged_correlation_um,
        setup.seed,
    )
    inputs = (layers, maps, grid)
    decided = coverage = cached("ink-coverage", inputs, lambda: ink_coverage(*inputs))
    names = [pattern.colorants[i] for i in inks]
    reflectances = [library[name].reflectance for name in names]
    if setup.overprint:
        both = {
            (a, b): spectrum
            for a in range(len(inks))
            for b in range(a + 1, len(inks))
            if (spectrum := overprint_reflectance(library[names[a]].cmyk, library[names[b]].cmyk)) is not None
        }
        coverage = lay_over(layers, maps, grid, decided, list(both))
        reflectances += both.values()
    emitters = {0: "white"} | {1 + k: name for k, name in enumerate(names)}
    return _sheet(setup, coverage, library["white"].reflectance, reflectances, emitters), decided


def _sheet(
    setup: BenchSetup,
    coverage: NDArray[np.uint8],
    paper: NDArray[np.float64],
    inks: list[NDArray[np.float64]],
    emitters: dict[int, str],
) -> BenchSheet:
    terms = ink_terms(paper, np.array(inks).reshape(-1, len(paper)))
    of_pairs = pair_spectra(primaries(setup.channels, setup.projector), paper, terms)
    emitting = {k: setup.fluorescence[name] for k, name in emitters.items() if name in setup.fluorescence}
    if emitting:
        excitation = excitation_spectra(setup.channels, setup.projector)
        of_pairs = of_pairs + emission_spectra(excitation, terms, emitting)
    ambient = pair_spectra(setup.ambient * ambient_spectrum()[None], paper, terms)[0]
    return BenchSheet(coverage, of_pairs, ambient)
