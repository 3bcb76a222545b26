"""The virtual bench's spectroradiometer: the mean radiance over a spot of the wall, as weights of projector pixels.

The reading is linear in the projector's intensities, so that the paper's scattering and the footprint are applied
once, backwards from the spot (their exact adjoint), for each surface; a reading is then a weighted sum over the pixels
that reach the spot. Noise and drift are not known here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.optics.geometry import BenchMaps, raster_to_wall
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.light import Footprint, footprint_adjoint
from paxel_runtime.optics.paper import scattered_apertures
from paxel_runtime.optics.spectra import patch_factors

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
    ambient : (81,) float64 array
        Spectral radiance of the spot under the uniform light alone.
    """

    rows: slice
    columns: slice
    weights: NDArray[np.float32]
    spectra: NDArray[np.float64]
    ambient: NDArray[np.float64]

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
    of_pairs: NDArray[np.float64],
    of_ambient: NDArray[np.float64],
    centre_mm: NDArray[np.float64] | None = None,
) -> MeterSpot:
    """A round spot at the centre of the projection, or at `centre_mm` on the wall.

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
    of_pairs : (N, 1 + L, 1 + L, 81) array
        From `optics.pair_spectra`.
    of_ambient : (1 + L, 1 + L, 81) array
        The same for a uniform light of 1 besides.
    centre_mm : (2,) array, optional

    Raises
    ------
    InputError
        If the spot reaches beyond the projection.
    """
    kernel = np.ones(1, np.float32) if scattering is None else scattering
    window, share = _area_shares(aperture_mm, grid, maps, len(kernel), centre_mm)
    passages = scattered_apertures(share, np.ascontiguousarray(coverage[:, *window]), kernel)
    if scattering is None:
        of_pairs = np.moveaxis(patch_factors(np.moveaxis(of_pairs, -1, 0)), 0, -1)
        of_ambient = np.moveaxis(patch_factors(np.moveaxis(of_ambient, -1, 0)), 0, -1)
    ambient = np.einsum("klvu,klw->w", passages, of_ambient, dtype=np.float64, optimize=True)
    size = of_pairs.shape[1]
    pairs = [(k, m) for k in range(size) for m in range(k + 1)]
    if np.allclose(of_pairs, np.swapaxes(of_pairs, 1, 2), rtol=1e-9, atol=0.0):  # both orders have one spectrum
        passages = passages + np.swapaxes(passages, 0, 1) * (1 - np.eye(size, dtype=np.float32))[..., None, None]
    elif scattering is not None:  # inks that fluoresce
        pairs = list(np.ndindex(size, size))
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
        rows, columns, np.array(weights, np.float32), np.stack([of_pairs[:, k, m] for k, m in pairs], axis=1), ambient
    )


def _area_shares(
    aperture_mm: float, grid: FineGrid, maps: BenchMaps, rim: int, centre_mm: NDArray[np.float64] | None
) -> tuple[tuple[slice, slice], NDArray[np.float32]]:
    """Window of the fine raster around the spot with a rim, and each sample's share of the spot's area."""
    middle, centre = maps.raster_centre, raster_to_wall(maps, maps.raster_centre)
    if centre_mm is not None:
        middle, centre = _raster_of(maps, centre_mm), centre_mm
    pitch_mm = np.linalg.norm(raster_to_wall(maps, middle + np.array([1.0, 0.0])) - centre)
    half = int(np.ceil(0.53 * aperture_mm / pitch_mm * grid.subsamples)) + rim
    column, row = (round(grid.to_sample(c).item()) for c in middle)
    if min(row, column) < half or row + half >= grid.shape[0] or column + half >= grid.shape[1]:
        raise InputError(
            f"the meter's spot must lie within the projection; got one of {aperture_mm} mm that the sheet's place or "
            "its own moves out of it (hold the sheet nearer to the wall, aim nearer to the centre, or choose a smaller "
            "aperture)"
        )
    rows, columns = slice(row - half, row + half + 1), slice(column - half, column + half + 1)
    u, v = (grid.to_raster(np.arange(part.start, part.stop)) for part in (columns, rows))
    wall = raster_to_wall(maps, np.stack(np.meshgrid(u, v), axis=-1))
    across, down = np.gradient(wall, axis=1), np.gradient(wall, axis=0)
    area = np.abs(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])
    inside = np.clip(0.5 + (aperture_mm / 2 - np.linalg.norm(wall - centre, axis=-1)) / np.sqrt(area), 0.0, 1.0)
    share = inside * area
    return (rows, columns), (share / share.sum()).astype(np.float32)


def _raster_of(maps: BenchMaps, xy_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Raster position whose light falls on a point of the wall, to 1e-3 px: Newton's method."""
    uv = maps.raster_centre.copy()
    for _ in range(6):
        here = raster_to_wall(maps, uv)
        slope = (raster_to_wall(maps, uv + 0.5 * np.eye(2)) - raster_to_wall(maps, uv - 0.5 * np.eye(2))).T
        uv = uv + np.linalg.solve(slope, xy_mm - here)
    return uv
