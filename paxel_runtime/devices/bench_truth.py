"""What really is on a virtual bench: for tests, and for figures about the bench itself. No estimator may look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import DeviceError
from paxel_runtime.optics.geometry import BenchMaps, raster_of_channel, raster_to_wall, wall_to_camera
from paxel_runtime.optics.grid import FineGrid
from paxel_runtime.optics.spectra import response

__all__ = ["BenchTruth", "channel_index"]


@dataclass(frozen=True, eq=False)
class BenchTruth:
    """Ground truth of a bench.

    Attributes
    ----------
    channels : tuple of str
    grid : FineGrid
        The fine raster on which the bench computes.
    maps : BenchMaps
        The geometry.
    colorants : int
        Number of the pattern's colorants.
    inks : list of int
        Those that are ink, in the order of `ink_coverage`; the others are bare paper.
    ink_coverage : (L, rows, columns) uint8 array
        Share of each ink in each sample of the fine raster, 0..255.
    printed_size_mm : (2,) float64 array
        Width and height of the pattern area as printed.
    responses : tuple of str
        Response curves of the channels; see `optics.response`.
    sheet_maps : BenchMaps, optional
        Geometry of the second surface, which may be held in front of the wall.
    """

    channels: tuple[str, ...]
    grid: FineGrid
    maps: BenchMaps
    colorants: int
    inks: list[int]
    ink_coverage: NDArray[np.uint8]
    printed_size_mm: NDArray[np.float64]
    responses: tuple[str, ...] = ()
    sheet_maps: BenchMaps | None = None

    def camera_xy(self, channel: str, surface: str = "pattern") -> NDArray[np.float64]:
        """Camera position (x, y) of the light of each projector pixel's centre on a surface, (H, W, 2)."""
        maps = self.sheet_maps if surface == "white" and self.sheet_maps is not None else self.maps
        columns, rows = np.arange(self.grid.width), np.arange(self.grid.height)
        pixels = np.stack(np.meshgrid(columns, rows), axis=-1).astype(np.float64)
        middle = raster_of_channel(maps, channel_index(self.channels, channel), pixels)
        return wall_to_camera(maps, raster_to_wall(maps, middle))

    def coverage(self) -> NDArray[np.float32]:
        """Share of each colorant, then of bare paper, in the area of each projector pixel: (H, W, M + 1), sum 1.

        The area is that of the middle channel. A colorant that is the paper itself has the unprinted part of the
        pattern area; without one, the gaps between inks count as bare paper.
        """
        shares = np.zeros((self.grid.height, self.grid.width, self.colorants + 1), np.float32)
        for ink, layer in zip(self.inks, self.ink_coverage, strict=True):
            shares[..., ink] = self.grid.pixel_means(layer) / np.float32(255)
        inked = shares.sum(axis=-1)
        unprinted = [i for i in range(self.colorants) if i not in self.inks]
        if unprinted:
            shares[..., unprinted[0]] = np.clip(self._inside_pattern() - inked, 0.0, 1.0)
        shares[..., -1] = np.clip(1.0 - shares[..., :-1].sum(axis=-1), 0.0, 1.0)
        return shares

    def response(self, channel: str, P: ArrayLike) -> NDArray[np.float64]:
        """Linear intensity x of device values P, 0..1."""
        j = channel_index(self.channels, channel)
        return response(P, j, self.responses[j] if self.responses else "", channel)

    def _inside_pattern(self) -> NDArray[np.float32]:
        """Share of the pattern area in each projector pixel, (H, W), from the centres of its samples."""
        rows, columns = (self.grid.to_raster(np.arange(size)) for size in self.grid.shape)
        inside = np.empty(self.grid.shape, np.uint8)
        for i, row in enumerate(rows):
            wall = raster_to_wall(self.maps, np.stack((columns, np.full_like(columns, row)), axis=-1))
            inside[i] = np.all(np.abs(wall) <= self.printed_size_mm / 2, axis=-1)
        return self.grid.pixel_means(inside)


def channel_index(channels: tuple[str, ...], channel: str) -> int:
    """Place of a channel among the projector's.

    Raises
    ------
    DeviceError
        If the projector has no such channel.
    """
    if channel not in channels:
        raise DeviceError(f"the projector's channels are {', '.join(channels)}; got {channel!r}")
    return channels.index(channel)
