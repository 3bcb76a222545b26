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
from paxel_runtime.optics.held import HeldSheet, defocus, defocus_reach_px, hold_sheet
from paxel_runtime.optics.ink import ink_coverage, make_layers
from paxel_runtime.optics.overprint import lay_over, overprints
from paxel_runtime.optics.spectra import (
    ambient_spectrum,
    excitation_spectra,
    ink_terms,
    pair_spectra,
    sensor_factors,
    shift_spectra,
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
        Spectral radiance of unit light of each channel; see `optics.pair_spectra`. Twice as many, the second half what
        the channels add between 0 and full, where their spectra change with the level.
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
        """Intensities (N, H, W) as they reach the sheet; with a rim around the frame if it is held."""
        if self.held is None:
            return lit
        rim = (self.held.rim_px,) * 2
        around = np.pad(lit, ((0, 0), rim, rim))
        return defocus(around, self.held.defocus_px2) * self.held.irradiance

    def light_at(self, lit: NDArray[np.float32], rows: slice, columns: slice) -> NDArray[np.float32]:
        """`light` on a part of the frame of a held sheet, without the rest."""
        assert self.held is not None
        reach = defocus_reach_px(self.held.defocus_px2)
        top, left = max(rows.start - reach, 0), max(columns.start - reach, 0)
        near = slice(top, rows.stop + reach), slice(left, columns.stop + reach)
        inner = slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left)
        of_frame = (slice(self.held.rim_px, -self.held.rim_px),) * 2
        variance, irradiance = self.held.defocus_px2[of_frame], self.held.irradiance[of_frame]
        part = np.ascontiguousarray(lit[:, *near])
        return defocus(part, np.ascontiguousarray(variance[near]))[:, *inner] * irradiance[rows, columns]


def inks_of(setup: BenchSetup) -> list[int]:
    """The colorants that are ink (not bare paper), the darkest first."""
    names, library = setup.pattern.colorants, setup.library
    paper = library["white"].reflectance
    inks = [
        i
        for i, name in enumerate(names)
        if not np.array_equal(library[name].reflectance, paper) or (name != "white" and library[name].fluorescence)
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
            held = hold_sheet(
                maps, setup.resolution, setup.width_mm, setup.sheet_distance_mm, setup.sheet_tilt_deg, grid.margin_px
            )
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
    layers = layers._replace(offsets_mm=layers.offsets_mm + np.array(setup.print_offset_mm))
    inputs = (layers, maps, grid)
    decided = coverage = cached("ink-coverage", inputs, lambda: ink_coverage(*inputs))
    names = [pattern.colorants[i] for i in inks]
    reflectances = [library[name].reflectance for name in names]
    if setup.overprint:
        inks_on = [library[name] for name in names]
        together = overprints([None if ink.spot else ink.cmyk for ink in inks_on])
        coverage = lay_over(layers, maps, grid, decided, list(together))
        reflectances += together.values()
    emitters = {0: "white"} | {1 + k: name for k, name in enumerate(names)}
    return _sheet(setup, coverage, library["white"].reflectance, reflectances, emitters), decided


def _sheet(
    setup: BenchSetup,
    coverage: NDArray[np.uint8],
    paper: NDArray[np.float64],
    inks: list[NDArray[np.float64]],
    emitters: dict[int, str],
) -> BenchSheet:
    library, terms = setup.library, ink_terms(paper, np.array(inks).reshape(-1, len(paper)))
    emitting = {k: dye for k, name in emitters.items() if name in library and (dye := library[name].fluorescence)}

    def leaving(spectra: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of lights (..., 97): what is reflected, and what is emitted."""
        reflected = pair_spectra(spectra[:, -len(paper) :], paper, terms)
        return reflected + emission_spectra(spectra, terms, emitting) if emitting else reflected

    lights = excitation_spectra(setup.channels, setup.projector, setup.spectra)
    if setup.level_spectra:
        lights = np.concatenate((lights, shift_spectra(setup.channels)))
    of_pairs = leaving(lights)
    return BenchSheet(coverage, of_pairs, leaving(setup.ambient * ambient_spectrum()[None])[0])
