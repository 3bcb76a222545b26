"""A lit cluster on the virtual bench, photographed: for Fig. 12. The bench's truth stands in for a registration."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from paxel_design.visibility.moire import Partition
from paxel_runtime.clustering.kmeans import lloyd, nearest
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.optics.geometry import raster_to_wall
from paxel_runtime.registration.plane import fit_homography

__all__ = ["PITCH_MM", "LitCluster", "draw_panels"]

PITCH_MM = 281.0 / 1920.0
RESOLUTION = (480, 270)
CAMERA = (1440, 1080)


class LitCluster:
    """The middle of a layout on the realistic bench, `piece_px` projector pixels wide."""

    def __init__(self, pattern: Pattern, piece_px: int) -> None:
        self.bench = VirtualBench(
            BenchSetup(
                pattern=pattern,
                resolution=RESOLUTION,
                width_mm=RESOLUTION[0] * PITCH_MM,
                channels=("red", "green", "blue"),
                bits=8,
                camera_resolution=CAMERA,
                camera_bits=14,
                aperture_mm=20.0,
                quality="realistic",
                seed=1,
            )
        )
        self.piece_px = piece_px
        self.full = np.full((RESOLUTION[1], RESOLUTION[0], 3), 255, np.uint8)
        self.camera_px_mm = float(self.bench.truth.maps.camera_px_mm)

    @property
    def aim(self) -> NDArray[np.float64]:
        """How the projector is turned and tilted over the piece, as a registration tells it."""
        to = np.linspace(-self.piece_px / 2, self.piece_px / 2, 15)
        px = np.stack(np.meshgrid(to, to), axis=-1).reshape(-1, 2)
        middle = (np.array(RESOLUTION) - 1) / 2
        return fit_homography(px * (PITCH_MM, -PITCH_MM), raster_to_wall(self.bench.truth.maps, px + middle))

    @cached_property
    def _flat(self) -> NDArray[np.float64]:
        return self._capture("white", np.where(np.arange(3) == 1, self.full, 0).astype(np.uint8))

    @cached_property
    def _reflectance(self) -> NDArray[np.float64]:
        on_pattern, on_white = (self.bench.view_XYZ(self.full, surface) for surface in ("pattern", "white"))
        return np.asarray((on_pattern / on_white).reshape(-1, 3), np.float64)

    def photograph(self, partition: Partition, K: int) -> NDArray[np.float64]:
        """The white cluster lit green, over the white sheet under green: linear, the middle of the picture."""
        if partition == "lab":  # the paper's: k-means of what is seen under full light
            dark, bright = np.quantile(self._reflectance, (0.02, 0.98), axis=0)
            starts = np.array([dark, bright, (dark + bright) / 2])[:K]
            points, centres = (
                np.asarray(XYZ_to_Lab(XYZ, np.ones(3)), np.float64) for XYZ in (self._reflectance, starts)
            )
            centres, _ = lloyd(points, centres)
        else:  # the shares of a registered design
            points = np.ascontiguousarray(self.bench.truth.coverage()[..., :2].reshape(-1, 2), np.float64)
            centres = np.array([[1.0, 0.0], [0.0, 1.0], [0.5, 0.5]])[:K]
        green = np.zeros_like(self.full)
        green[..., 1] = 255 * (nearest(points, centres)[0] == 1).reshape(RESOLUTION[::-1])
        picture = self._capture("pattern", green) / np.maximum(self._flat, 1.0)
        size = round(self.piece_px * PITCH_MM / self.camera_px_mm)
        top, left = ((n - size) // 2 for n in picture.shape)
        return picture[top : top + size, left : left + size]

    def _capture(self, surface: str, frame: NDArray[np.uint8]) -> NDArray[np.float64]:
        self.bench.place(surface)
        self.bench.show(frame)
        return np.squeeze(self.bench.capture("green")).astype(np.float64)


def draw_panels(columns: list[tuple[str, NDArray[np.float64]]], reach: int, side: int = 360) -> Image.Image:
    """Photographs above their spectra (logarithmic, over 3.5 decades), `reach` cycles of the piece to each side."""
    gap, head = 8, 26
    board = Image.new("RGB", (len(columns) * (side + gap) + gap, 2 * side + 3 * gap + head), "white")
    for k, (words, view) in enumerate(columns):
        tone = np.clip(view / np.quantile(view, 0.98), 0, 1)[..., None] ** (1 / 2.2) * np.array([0.1, 1.0, 0.1])
        window = np.outer(np.hanning(len(view)), np.hanning(len(view)))
        power = np.abs(np.fft.fftshift(np.fft.fft2((view / view.mean() - 1) * window)))
        middle = len(view) // 2
        power = power[middle - reach : middle + reach, middle - reach : middle + reach]
        log = np.clip(np.log10(np.maximum(power / power.max(), 1e-9)) / 3.5 + 1, 0, 1)
        left = gap + k * (side + gap)
        ImageDraw.Draw(board).text((left, 6), words, fill="black")
        for row, panel in enumerate((tone, np.repeat(log[..., None], 3, axis=2))):
            image = Image.fromarray(np.rint(255 * panel).astype(np.uint8))
            board.paste(image.resize((side, side), Image.Resampling.LANCZOS), (left, head + row * (side + gap)))
    return board
