"""The virtual bench: a projector, a printed or blank sheet, a camera and a meter, simulated from physics.

It answers as real devices do (`devices.base`) and knows nothing of how its answers are used; `bench_truth` is for tests
and for figures about the bench only. The physics stands in the ``optics`` modules, the pinned imperfections in
`bench_qualities`; geometry, response curves, the camera's lens blur and sensitivities are the same in every quality.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.bench_truth import BenchTruth, channel_index
from paxel_runtime.errors import DeviceError, InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern, colorant_library
from paxel_runtime.optics import (
    camera_sensitivities,
    ink_terms,
    pair_factors,
    patch_factors,
    primaries,
    response_table,
)
from paxel_runtime.optics_camera import PIXEL_BLUR_PX, SPLINE_VARIANCE, expose, sample_camera
from paxel_runtime.optics_geometry import camera_to_fine_grid, make_maps
from paxel_runtime.optics_grid import FineGrid, gaussian_kernel
from paxel_runtime.optics_light import drive, fringe, make_footprint
from paxel_runtime.optics_meter import MeterSpot, make_spot
from paxel_runtime.optics_paper import radiance
from paxel_runtime.optics_print import ink_coverage, make_layers

__all__ = ["BenchSetup", "VirtualBench"]

_SURFACES = ("pattern", "white")
_FULL_SIGNAL = 0.8
_DRIFT_MEMORY = 0.995
_DRIFT_STEP = 0.1
_WIDEST_APERTURE = 0.8


@dataclass(frozen=True)
class BenchSetup:
    """What stands on the bench.

    Attributes
    ----------
    pattern : Pattern
        What is printed.
    resolution : (width, height)
        Of the projector.
    width_mm : float
        Width of the projection on the wall.
    channels : tuple of str
        The projector's channels.
    bits : int
        Of the projector's codes, 1..16.
    camera_resolution : (width, height)
    camera_bits : int
        At most; the quality may say fewer. 1..16.
    aperture_mm : float
        Diameter of the meter's spot, at the centre of the projection.
    quality : str
        A name in `bench_qualities.QUALITIES`.
    seed : int
        Of everything random: geometry, print, noise.

    Raises
    ------
    InputError
        If a value is out of its range or a name is unknown.
    """

    pattern: Pattern
    resolution: tuple[int, int]
    width_mm: float
    channels: tuple[str, ...]
    bits: int
    camera_resolution: tuple[int, int]
    camera_bits: int
    aperture_mm: float
    quality: str
    seed: int

    def __post_init__(self) -> None:
        if self.quality not in QUALITIES:
            raise InputError(f"bench.quality must be one of {', '.join(QUALITIES)}; got {self.quality!r}")
        if not self.channels or len(set(self.channels)) != len(self.channels):
            raise InputError(f"projector.channels must be different names, at least one; got {self.channels}")
        for name, size in (("projector", self.resolution), ("camera", self.camera_resolution)):
            if min(size) < 16:
                raise InputError(f"{name}.resolution must be at least 16 x 16 pixels, got {size[0]} x {size[1]}")
        for name, bits in (("projector", self.bits), ("camera", self.camera_bits)):
            if not 1 <= bits <= 16:
                raise InputError(f"{name}.bits must be 1 to 16, got {bits}")
        if not self.width_mm > 0:
            raise InputError(f"projector.width_mm must be > 0, got {self.width_mm}")
        largest_mm = _WIDEST_APERTURE * self.width_mm * min(1.0, self.resolution[1] / self.resolution[0])
        if not 0 < self.aperture_mm <= largest_mm:
            raise InputError(
                f"meter.aperture_mm must be > 0 and at most {_WIDEST_APERTURE:.0%} of the projection's shorter side "
                f"({largest_mm:.1f} mm), got {self.aperture_mm}"
            )


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A sheet on the wall: (L, rows, columns) ink coverage of the fine raster, (1 + L, 81) terms of transmittance."""

    coverage: NDArray[np.uint8]
    terms: NDArray[np.float64]


class VirtualBench:
    """Projector, camera, meter and operator in one (the four protocols of `devices.base`).

    It starts with the pattern in place and a black frame. Everything random follows from the seed: two benches of one
    setup that are asked the same in the same order answer the same, bit for bit.

    Memory: for each of the 16 (up to 64, for pixels larger than 0.24 mm) fine samples of a projector pixel, 1 byte an
    ink and 4 bytes a plane that is captured. 1920 x 1080 with two colorants and a 12-megapixel camera peaks at 1 GB.

    Parameters
    ----------
    setup : BenchSetup
    quality : BenchQuality, optional
        Imperfections of your own in place of the named ones.

    Raises
    ------
    InputError
        If a channel has no spectrum or a colorant no reflectance.
    """

    def __init__(self, setup: BenchSetup, quality: BenchQuality | None = None) -> None:
        q = quality or QUALITIES[setup.quality]
        self._setup, self._quality = setup, q
        self._spectra = primaries(setup.channels)
        self._paper, self._inks = _paper_and_inks(setup.pattern)
        pitch_mm = setup.width_mm / setup.resolution[0]
        self._grid = FineGrid.fitting(setup.resolution, pitch_mm, q.scattering_mm)
        self._maps = make_maps(
            setup.resolution,
            setup.width_mm,
            setup.camera_resolution,
            len(setup.channels),
            q.chromatic_shift_camera_px,
            q.wave_camera_px,
            q.wave_correlation_px,
            setup.seed,
        )
        self._footprints = [
            make_footprint(self._grid, self._maps, j, q.fill_factor, q.blur_centre_px, q.blur_corner_px, q.fall_off)
            for j in range(len(setup.channels))
        ]
        step_mm = pitch_mm / self._grid.subsamples
        # Coverage is a mean over each sample, at both passages: its box is a part of the scattering, of variance 1/6.
        self._scattering = gaussian_kernel(np.sqrt(max((q.scattering_mm / step_mm) ** 2 - 1 / 6, 0.0)))
        camera_variance = (PIXEL_BLUR_PX**2 + 1 / 12) * (self._maps.camera_px_mm / step_mm) ** 2
        self._camera_blur = gaussian_kernel(np.sqrt(max(camera_variance - SPLINE_VARIANCE, 0.0)))
        self._codes_to_x = response_table(len(setup.channels), setup.bits)
        self._spots: dict[str, MeterSpot] = {}
        self._rng = np.random.default_rng((setup.seed, 4))
        self._drift = 0.0
        self._surface = "pattern"
        self._x = self._drive(np.zeros(self._frame_shape, np.uint8))

    @cached_property
    def truth(self) -> BenchTruth:
        """What no device would tell; for tests only."""
        pattern, q = self._setup.pattern, self._quality
        return BenchTruth(
            channels=self._setup.channels,
            grid=self._grid,
            maps=self._maps,
            colorants=len(pattern.colorants),
            inks=self._inks,
            ink_coverage=self._sheets["pattern"].coverage,
            printed_size_mm=np.array(pattern.size_mm) * (1.0 + np.array([q.print_scale_x, q.print_scale_y])),
        )

    def place(self, surface: str) -> None:
        """Put ``"pattern"`` or ``"white"`` on the wall.

        Raises
        ------
        DeviceError
            For any other surface.
        """
        self._surface = _known_surface(surface)

    def show(self, codes: NDArray[np.unsignedinteger]) -> None:
        """Show a frame (H, W, N) of device codes, 0 to 2**bits - 1, until the next.

        Raises
        ------
        DeviceError
            If the frame does not fit the projector.
        """
        self._x = self._drive(codes)

    def capture(self, channel: str | None = None) -> NDArray[np.uint16]:
        """Take a picture of what is shown; see `devices.base.Camera.capture`.

        The exposure brings the brightest place of the white sheet to 80 % of saturation under full white, or under the
        one channel at full; a one-plane picture is the mean of the sensor's planes.

        Raises
        ------
        DeviceError
            For a channel that the projector has not.
        """
        q = self._quality
        sensitivities = camera_sensitivities()
        lit = np.ones(len(self._setup.channels))
        if channel is not None:
            lit = (np.arange(len(lit)) == channel_index(self._setup.channels, channel)).astype(float)
            sensitivities = sensitivities.mean(axis=0, keepdims=True)
        gain = self._light_level() * _FULL_SIGNAL / self._brightest(sensitivities, lit)
        field = self._radiance(self._x, self._surface, sensitivities * gain, self._camera_blur)
        bits = min(self._setup.camera_bits, q.camera_bits)
        planes = [
            expose(
                sample_camera(plane, self._camera_nodes, self._setup.camera_resolution),
                q.glare,
                q.full_well_e,
                q.read_noise_e,
                bits,
                self._rng,
            )
            for plane in field
        ]
        return np.stack(planes, axis=-1) if channel is None else planes[0]

    def measure(self) -> NDArray[np.float64]:
        """Spectral radiance over the meter's spot, (81,), in units in which the three primaries at full have Y = 1."""
        q = self._quality
        spectrum = self._read(self._x, self._surface) * self._light_level()
        level_noise, band_noise = self._rng.standard_normal(), self._rng.standard_normal(len(spectrum))
        return spectrum * (1.0 + q.meter_noise_level * level_noise) * (1.0 + q.meter_noise_band * band_noise)

    def view_XYZ(self, codes: NDArray[np.unsignedinteger], surface: str) -> NDArray[np.float32]:
        """What leaves the wall, averaged over each projector pixel's area, before any eye's blur.

        Without noise and drift; a frame that was shown stays.

        Parameters
        ----------
        codes : (H, W, N) unsigned integer array
        surface : str
            ``"pattern"`` or ``"white"``.

        Returns
        -------
        (H, W, 3) float32 array
            Y = 1 for full white on the white sheet, averaged over the meter's spot.
        """
        matching = spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM))).T / (WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0])
        field = self._radiance(
            self._drive(codes), _known_surface(surface), matching / self._white_Y, gaussian_kernel(0.0)
        )
        return np.stack([self._grid.pixel_means(plane) for plane in field], axis=-1)

    @property
    def _frame_shape(self) -> tuple[int, int, int]:
        return self._setup.resolution[1], self._setup.resolution[0], len(self._setup.channels)

    def _drive(self, codes: NDArray[np.unsignedinteger]) -> NDArray[np.float32]:
        """(N, H, W) intensities of a frame, all laws but fringing applied."""
        codes = np.asarray(codes)
        if codes.shape != self._frame_shape or codes.dtype.kind != "u":
            raise DeviceError(
                f"a frame must be an unsigned integer array {self._frame_shape}, got {codes.shape} of {codes.dtype}"
            )
        highest = 2**self._setup.bits - 1
        if int(codes.max()) > highest:
            raise DeviceError(f"codes of {self._setup.bits} bits must be at most {highest}, got {int(codes.max())}")
        q = self._quality
        return drive(codes, self._codes_to_x, q.cross_talk, q.black, q.dimming)

    def _light_level(self) -> float:
        """All light relative to its nominal value, drifting from one capture or reading to the next."""
        self._drift = _DRIFT_MEMORY * self._drift + _DRIFT_STEP * self._quality.drift * self._rng.standard_normal()
        return 1.0 + self._drift

    @cached_property
    def _camera_nodes(self) -> NDArray[np.float64]:
        return camera_to_fine_grid(self._maps, self._grid, self._setup.camera_resolution)

    @cached_property
    def _sheets(self) -> dict[str, _Sheet]:
        q, pattern = self._quality, self._setup.pattern
        reflectances = [colorant_library()[pattern.colorants[ink]].reflectance for ink in self._inks]
        blank = _Sheet(np.empty((0, *self._grid.shape), np.uint8), ink_terms(self._paper, np.empty((0, 81))))
        if not self._inks:
            return {"pattern": blank, "white": blank}
        layers = make_layers(
            pattern,
            self._inks,
            (q.print_scale_x, q.print_scale_y),
            q.ink_offset_um,
            q.ink_spread_um,
            q.ragged_um,
            q.ragged_correlation_um,
            self._setup.seed,
        )
        coverage = ink_coverage(layers, self._maps, self._grid)
        return {"pattern": _Sheet(coverage, ink_terms(self._paper, np.array(reflectances))), "white": blank}

    def _radiance(
        self,
        x: NDArray[np.float32],
        surface: str,
        sensitivities: NDArray[np.float64],
        blur: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        q, sheet = self._quality, self._sheets[surface]
        factors = pair_factors(sensitivities, self._spectra, self._paper, sheet.terms)
        if q.scattering_mm == 0:
            factors = patch_factors(factors)
        lit = fringe(x, q.fringing, q.fringing_exponent)
        return radiance(lit, self._footprints, sheet.coverage, factors, self._scattering, blur)

    def _brightest(self, sensitivities: NDArray[np.float64], lit: NDArray[np.float64]) -> float:
        """Largest signal of the white sheet's brightest place with channels `lit` (0 or 1) at full."""
        q = self._quality
        x = lit * (1.0 - 0.5 * q.cross_talk * (lit.sum() - lit))
        x = q.black + (1.0 - q.black) * x
        blank = ink_terms(self._paper, np.empty((0, len(self._paper))))
        return float((pair_factors(sensitivities, self._spectra, self._paper, blank)[:, :, 0, 0] @ x).max())

    @cached_property
    def _white_Y(self) -> float:
        full = np.full(self._frame_shape, 2**self._setup.bits - 1, np.uint16)
        return float(spectra_to_XYZ(self._read(self._drive(full), "white"))[1])

    def _read(self, x: NDArray[np.float32], surface: str) -> NDArray[np.float64]:
        """Noise-free reading of the meter, (81,)."""
        spot = self._spots.get(surface) or self._aim_at(surface)
        rows, columns = spot.rows, spot.columns
        top, left = min(rows.start, 1), min(columns.start, 1)  # fringing needs the neighbours around
        around = x[:, rows.start - top : rows.stop + 1, columns.start - left : columns.stop + 1]
        lit = fringe(np.ascontiguousarray(around), self._quality.fringing, self._quality.fringing_exponent)
        height, width = spot.weights.shape[2:]
        return spot.read(lit[:, top : top + height, left : left + width])

    def _aim_at(self, surface: str) -> MeterSpot:
        """The meter's spot on a surface, kept."""
        sheet = self._sheets[surface]
        self._spots[surface] = make_spot(
            self._setup.aperture_mm,
            self._grid,
            self._maps,
            self._footprints,
            sheet.coverage,
            self._scattering if self._quality.scattering_mm > 0 else None,
            self._spectra,
            self._paper,
            sheet.terms,
        )
        return self._spots[surface]


def _known_surface(surface: str) -> str:
    if surface not in _SURFACES:
        raise DeviceError(f"the bench's surfaces are {' and '.join(_SURFACES)}; got {surface!r}")
    return surface


def _paper_and_inks(pattern: Pattern) -> tuple[NDArray[np.float64], list[int]]:
    """Reflectance of the bare paper, and the colorants that are ink, the darkest first."""
    library = colorant_library()
    unknown = [name for name in pattern.colorants if name not in library]
    if unknown:
        raise InputError(f"the bench knows the colorants {', '.join(library)}; got {', '.join(unknown)}")
    paper = library["white"].reflectance
    inks = [i for i, name in enumerate(pattern.colorants) if not np.array_equal(library[name].reflectance, paper)]
    darkness = {i: float(spectra_to_XYZ(library[pattern.colorants[i]].reflectance)[1]) for i in inks}
    return paper, sorted(inks, key=darkness.__getitem__)
