"""The virtual bench's spectroradiometer: the mean radiance over a spot of the wall, as weights of projector pixels.

The reading is linear in the projector's intensities, so that the paper's scattering and the footprint are applied
once, backwards from the spot (their exact adjoint), for each surface; a reading is then a weighted sum over the pixels
that reach the spot. Noise and drift are not known here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.optics import pair_spectra, patch_factors
from paxel_runtime.optics_geometry import BenchMaps, raster_to_wall
from paxel_runtime.optics_grid import FineGrid
from paxel_runtime.optics_light import Footprint, footprint_adjoint
from paxel_runtime.optics_paper import scattered_apertures

__all__ = ["MeterSpot", "make_spot"]


class MeterSpot(NamedTuple):
    """A spot on one surface, seen from the projector.

    Attributes
    ----------
    rows, columns : slice
        The part of the raster that reaches the spot.
    weights : (N, pairs, h, w) float32 array
        Of the intensities of that part, for each channel and pair of passages through the ink.
    spectra : (N, pairs, 81) float64 array
        Spectral radiance of each.
    """

    rows: slice
    columns: slice
    weights: NDArray[np.float32]
    spectra: NDArray[np.float64]

    def read(self, x: NDArray[np.float32]) -> NDArray[np.float64]:
        """Spectral radiance (81,) for intensities (N, h, w) of the spot's part of the raster."""
        return np.einsum("jpvu,jvu,jpw->w", self.weights, x, self.spectra, optimize=True)


def make_spot(
    aperture_mm: float,
    grid: FineGrid,
    maps: BenchMaps,
    footprints: list[Footprint],
    coverage: NDArray[np.uint8],
    scattering: NDArray[np.float32] | None,
    spectra: NDArray[np.float64],
    paper: NDArray[np.float64],
    terms: NDArray[np.float64],
) -> MeterSpot:
    """A round spot at the centre of the projection.

    Parameters
    ----------
    aperture_mm : float
        Diameter.
    grid : FineGrid
    maps : BenchMaps
    footprints : list of N Footprint
    coverage : (L, rows, columns) uint8 array
        Ink on the fine raster; L = 0 for a blank sheet.
    scattering : (radius + 1,) float32 array or None
        One side of the paper's kernel, in samples; None = light leaves where it entered.
    spectra : (N, 81) array
        Primaries.
    paper : (81,) array
    terms : (1 + L, 81) array
        From `optics.ink_terms`.
    """
    kernel = np.ones(1, np.float32) if scattering is None else scattering
    window, share = _area_shares(aperture_mm, grid, maps, len(kernel))
    passages = scattered_apertures(share, np.ascontiguousarray(coverage[:, *window]), kernel)
    of_pairs = pair_spectra(spectra, paper, terms)
    pairs = [(k, m) for k in range(len(terms)) for m in range(k + 1)]
    if scattering is None:
        of_pairs = np.moveaxis(patch_factors(np.moveaxis(of_pairs, -1, 0)), 0, -1)
    else:  # both orders of a pair have one spectrum
        passages = passages + np.swapaxes(passages, 0, 1) * (1 - np.eye(len(terms), dtype=np.float32))[..., None, None]
    resolution = (grid.width, grid.height)
    reach = footprints[0].pad + 1
    rows, columns = (
        slice(max(int(grid.to_raster(part.start)) - reach, 0), min(int(grid.to_raster(part.stop)) + reach, size))
        for part, size in zip(window, resolution[::-1], strict=True)
    )
    weights = [
        [
            footprint_adjoint(passages[k, m], window[0].start, window[1].start, f, resolution)[rows, columns]
            for k, m in pairs
        ]
        for f in footprints
    ]
    return MeterSpot(
        rows, columns, np.array(weights, np.float32), np.stack([of_pairs[:, k, m] for k, m in pairs], axis=1)
    )


def _area_shares(
    aperture_mm: float, grid: FineGrid, maps: BenchMaps, rim: int
) -> tuple[tuple[slice, slice], NDArray[np.float32]]:
    """Window of the fine raster around the spot with a rim, and each sample's share of the spot's area."""
    centre = raster_to_wall(maps, maps.raster_centre)
    pitch_mm = np.linalg.norm(raster_to_wall(maps, maps.raster_centre + np.array([1.0, 0.0])) - centre)
    half = int(np.ceil(0.53 * aperture_mm / pitch_mm * grid.subsamples)) + rim
    column, row = (round(grid.to_sample(c).item()) for c in maps.raster_centre)
    rows, columns = slice(row - half, row + half + 1), slice(column - half, column + half + 1)
    u, v = (grid.to_raster(np.arange(part.start, part.stop)) for part in (columns, rows))
    wall = raster_to_wall(maps, np.stack(np.meshgrid(u, v), axis=-1))
    across, down = np.gradient(wall, axis=1), np.gradient(wall, axis=0)
    area = np.abs(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])
    inside = np.clip(0.5 + (aperture_mm / 2 - np.linalg.norm(wall - centre, axis=-1)) / np.sqrt(area), 0.0, 1.0)
    share = inside * area
    return (rows, columns), (share / share.sum()).astype(np.float32)
