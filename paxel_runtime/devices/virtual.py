"""The virtual bench: a projector, a printed or blank sheet, a camera and a meter, simulated from physics.

It answers as real devices do (`devices.base`) and knows nothing of how its answers are used; `bench_truth` is for tests
and for figures about the bench only. What stands on it is said in `bench_setup` and becomes sheets in `bench_sheets`;
the physics stands in the ``optics`` modules, the pinned imperfections in `bench_qualities`; geometry, response curves
(unless chosen), the camera's lens blur and sensitivities are the same in every quality.
"""

from __future__ import annotations

from functools import cached_property
from math import ceil

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import QUALITIES, BenchQuality
from paxel_runtime.devices.bench_setup import BenchSetup
from paxel_runtime.devices.bench_sheets import BenchSheet, inks_of, make_sheet, plain_sheet
from paxel_runtime.devices.bench_truth import BenchTruth, channel_index
from paxel_runtime.errors import DeviceError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.optics.camera import (
    PIXEL_BLUR_PX,
    SPLINE_VARIANCE,
    demosaic,
    expose,
    mosaic,
    sample_camera,
)
from paxel_runtime.optics.geometry import BenchMaps, camera_to_fine_grid, make_maps, raster_to_wall
from paxel_runtime.optics.grid import MARGIN_PX, FineGrid, gaussian_kernel
from paxel_runtime.optics.light import drive, fringe, make_footprint
from paxel_runtime.optics.meter import MeterSpot, make_spot
from paxel_runtime.optics.paper import radiance
from paxel_runtime.optics.spectra import (
    camera_sensitivities,
    patch_factors,
    response_table,
    sensor_factors,
    shift_of_level,
)

__all__ = ["BenchSetup", "VirtualBench"]

_SURFACES = ("pattern", "white", "paper")
_FULL_SIGNAL = 0.8
_DRIFT_MEMORY = 0.995
_DRIFT_STEP = 0.1
_NO_LIGHT = 1e-3
_CENTRE = (0.0, 0.0)


class VirtualBench:
    """Projector, camera, meter and operator in one (the four protocols of `devices.base`).

    It starts with the pattern in place and a black frame. Everything random follows from the seed: two benches of one
    setup that are asked the same in the same order answer the same, bit for bit.

    Stated limits: nothing but drift and noise changes with time; a held sheet is plane, and its defocus a disc of even
    light; overprints are measured for solids of the process inks alone.

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
        pitch_mm = setup.width_mm / setup.resolution[0]
        margin_px = MARGIN_PX + ceil(setup.defocus_px / 2)
        self._grid = FineGrid.fitting(setup.resolution, pitch_mm, q.scattering_mm, margin_px)
        self._maps = make_maps(
            setup.resolution,
            setup.width_mm,
            setup.camera_resolution,
            len(setup.channels),
            q.chromatic_shift_camera_px,
            q.wave_camera_px,
            q.wave_correlation_px,
            setup.seed,
            setup.camera_pose,
        )
        self._footprints = [
            make_footprint(
                self._grid, self._maps, j, q.fill_factor, blur * q.blur_centre_px, blur * q.blur_corner_px, q.fall_off
            )
            for j, blur in enumerate(setup.channel_blur or (1.0,) * len(setup.channels))
        ] * (2 if setup.level_spectra else 1)
        step_mm = pitch_mm / self._grid.subsamples
        # Coverage is a mean over each sample, at both passages: its box is a part of the scattering, of variance 1/6.
        self._scattering = gaussian_kernel(np.sqrt(max((q.scattering_mm / step_mm) ** 2 - 1 / 6, 0.0)))
        camera_variance = (PIXEL_BLUR_PX**2 + 1 / 12) * (self._maps.camera_px_mm / step_mm) ** 2
        self._camera_blur = gaussian_kernel(np.sqrt(max(camera_variance - SPLINE_VARIANCE, 0.0)))
        self._codes_to_x = response_table(len(setup.channels), setup.bits, setup.responses, setup.channels)
        self._spots: dict[tuple[str, tuple[float, float]], MeterSpot] = {}
        self._aim_mm = _CENTRE
        self._camera_nodes: dict[str, NDArray[np.float64]] = {}
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
            inks=inks_of(self._setup),
            ink_coverage=self._printed[1],
            printed_size_mm=np.array(pattern.size_mm) * (1.0 + np.array([q.print_scale_x, q.print_scale_y])),
            responses=self._setup.responses,
            sheet_maps=self._maps_of("white"),
        )

    def place(self, surface: str) -> None:
        """Put up ``"pattern"``, as ``"white"`` the second surface, or as ``"paper"`` the bare paper of the print.

        Raises
        ------
        DeviceError
            For any other surface.
        """
        self._surface = _known_surface(surface)

    def aim(self, position_mm: tuple[float, float]) -> None:
        """Point the meter at a place of the wall, mm from the centre of the projection, +x right, +y up.

        Raises
        ------
        InputError
            When it measures, if its spot does not lie within the projection.
        """
        self._aim_mm = (float(position_mm[0]), float(position_mm[1]))

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

        The exposure brings the brightest place of a white sheet in place (or of a fluorescent ink, where that is
        brighter) to 80 % of saturation under full white, or under the one channel at full, with the ambient light; a
        one-plane picture is the mean of the sensor's planes. A mosaic sensor has one plane: ``"raw"`` hands it out as
        it is, ``"demosaiced"`` interpolates it bilinearly.

        Raises
        ------
        DeviceError
            For a channel that the projector has not.
        """
        q, setup = self._quality, self._setup
        planes, single = camera_sensitivities(), setup.bayer == "none" and channel is not None
        lit = np.ones(len(setup.channels))
        if channel is not None:
            lit = (np.arange(len(lit)) == channel_index(setup.channels, channel)).astype(float)
        sensitivities = planes.mean(axis=0, keepdims=True) if single else planes
        brightest, full = self._brightest(sensitivities, lit), setup.exposure * _FULL_SIGNAL
        gain = self._light_level() * full / brightest
        ambient = self._sheets[self._surface].ambient_factors(sensitivities * (full / brightest))
        field = self._radiance(self._x, self._surface, sensitivities * gain, ambient, self._camera_blur)
        around = np.zeros(len(field)) if ambient is None else ambient[:, 0, 0]  # the wall is of the same paper
        nodes = self._nodes(self._surface)
        pictures = [
            sample_camera(plane, nodes, setup.camera_resolution, float(beyond))
            for plane, beyond in zip(field, around, strict=True)
        ]
        if setup.bayer != "none":
            pictures = [mosaic(pictures)]
        bits = min(setup.camera_bits, q.camera_bits)
        raw = [expose(p, q.glare, q.full_well_e, q.read_noise_e, bits, self._rng) for p in pictures]
        if setup.bayer == "demosaiced":
            raw = list(demosaic(raw[0]))
        if setup.bayer == "raw" or single:
            return raw[0]
        stack = np.stack(raw, axis=-1)
        return stack if channel is None else stack.mean(axis=-1).round().astype(np.uint16)

    def measure(self) -> NDArray[np.float64]:
        """Spectral radiance over the meter's spot, (81,), in units in which the three primaries at full have Y = 1."""
        q, spot = self._quality, self._spot(self._surface, self._aim_mm)
        spectrum = self._read(self._x, self._surface, spot) * self._light_level() + spot.ambient
        level_noise, band_noise = self._rng.standard_normal(), self._rng.standard_normal(len(spectrum))
        return spectrum * (1.0 + q.meter_noise_level * level_noise) * (1.0 + q.meter_noise_band * band_noise)

    def view_XYZ(self, codes: NDArray[np.unsignedinteger], surface: str) -> NDArray[np.float32]:
        """What leaves the wall, averaged over each projector pixel's area, before any eye's blur.

        Without noise and drift; a frame that was shown stays. On a sheet held in front of the wall, pixels are where
        their light falls.

        Parameters
        ----------
        codes : (H, W, N) unsigned integer array
        surface : str
            ``"pattern"`` or ``"white"``.

        Returns
        -------
        (H, W, 3) float32 array
            Y = 1 for full white on a white sheet in place, averaged over the meter's spot; where the projector gives
            no visible light, for the solid ink that shines brightest.
        """
        matching = spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM))).T / (WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0])
        matching = matching / self._white_Y
        ambient = self._sheets[_known_surface(surface)].ambient_factors(matching)
        field = self._radiance(self._drive(codes), surface, matching, ambient, gaussian_kernel(0.0))
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

    def _maps_of(self, surface: str) -> BenchMaps:
        held = self._sheets["white"].held if surface == "white" else None
        return held.maps if held else self._maps

    def _nodes(self, surface: str) -> NDArray[np.float64]:
        """Fine samples that the camera sees, kept for each surface."""
        if surface not in self._camera_nodes:
            maps = self._maps_of(surface)
            self._camera_nodes[surface] = camera_to_fine_grid(maps, self._grid, self._setup.camera_resolution)
        return self._camera_nodes[surface]

    @cached_property
    def _printed(self) -> tuple[BenchSheet, NDArray[np.uint8]]:
        return make_sheet(self._setup, self._quality, self._grid, self._maps, "pattern")

    @cached_property
    def _sheets(self) -> dict[str, BenchSheet]:
        """What can be placed, and the white sheet in place that all is relative to (``"reference"``)."""
        second, _ = make_sheet(self._setup, self._quality, self._grid, self._maps, "white")
        same = self._setup.second_surface == "white" and not self._setup.held
        reference = second if same else plain_sheet(self._setup, self._grid, "white")
        return {"pattern": self._printed[0], "white": second, "paper": reference, "reference": reference}

    def _radiance(
        self,
        x: NDArray[np.float32],
        surface: str,
        sensitivities: NDArray[np.float64],
        ambient: NDArray[np.float32] | None,
        blur: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        q, sheet = self._quality, self._sheets[surface]
        factors = sensor_factors(sensitivities, sheet.of_pairs)
        if q.scattering_mm == 0:
            factors, ambient = patch_factors(factors), None if ambient is None else patch_factors(ambient)
        lit = sheet.light(self._sources(fringe(x, q.fringing, q.fringing_exponent)))
        return radiance(lit, self._footprints, sheet.coverage, factors, self._scattering, blur, ambient)

    def _sources(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Intensities of all lights of fixed spectrum that channels of intensities (N, ...) are made of."""
        if not self._setup.level_spectra:
            return x
        return np.concatenate((x, shift_of_level(x, self._setup.channels)))

    def _full(self, lit: NDArray[np.float64]) -> NDArray[np.float64]:
        """`_sources` of a uniform frame with channels `lit` (0 or 1) at full."""
        q = self._quality
        x = lit * (1.0 - 0.5 * q.cross_talk * (lit.sum() - lit))
        return self._sources((q.black + (1.0 - q.black) * x).astype(np.float32)).astype(np.float64)

    def _brightest(self, sensitivities: NDArray[np.float64], lit: NDArray[np.float64]) -> float:
        """Largest signal of white paper's, or a fluorescent ink's, brightest place with channels `lit` at full."""
        reference, x = self._sheets["reference"], self._full(lit)
        signals = sensor_factors(sensitivities, reference.of_pairs)[:, :, 0, 0] @ x
        if self._setup.fluoresces:
            solids = sensor_factors(sensitivities, self._sheets["pattern"].solids)
            signals = np.maximum(signals, (solids[..., 0] * x[:, None]).sum(axis=1).max(axis=1))
        ambient = reference.ambient_factors(sensitivities)
        return float((signals if ambient is None else signals + ambient[:, 0, 0]).max())

    @cached_property
    def _white_Y(self) -> float:
        full = np.full(self._frame_shape, 2**self._setup.bits - 1, np.uint16)
        white = float(spectra_to_XYZ(self._read(self._drive(full), "reference", self._spot("reference")))[1])
        if not self._setup.fluoresces:
            return white
        solids = self._sheets["pattern"].solids[:, :, 0]
        x = self._full(np.ones(len(self._setup.channels)))
        shining = float(spectra_to_XYZ(np.einsum("j,jkw->kw", x, solids))[:, 1].max())
        return white if white > _NO_LIGHT * shining else shining

    def _read(self, x: NDArray[np.float32], surface: str, spot: MeterSpot) -> NDArray[np.float64]:
        """Noise-free reading of the meter, (81,), without ambient light."""
        q, sheet = self._quality, self._sheets[surface]
        rows, columns = spot.rows, spot.columns
        if sheet.held:
            lit = self._sources(fringe(x, q.fringing, q.fringing_exponent))
            return spot.read(sheet.light_at(lit, rows, columns))
        top, left = min(rows.start, 1), min(columns.start, 1)  # fringing needs the neighbours around
        around = x[:, rows.start - top : rows.stop + 1, columns.start - left : columns.stop + 1]
        lit = self._sources(fringe(np.ascontiguousarray(around), q.fringing, q.fringing_exponent))
        height, width = spot.weights.shape[2:]
        return spot.read(lit[:, top : top + height, left : left + width])

    def _spot(self, surface: str, aim_mm: tuple[float, float] = _CENTRE) -> MeterSpot:
        """A spot of the meter on a surface, kept. It looks along the camera's axis, wherever a sheet is held."""
        sheet = self._sheets[surface]
        if sheet is self._sheets["reference"]:
            surface = "reference"
        if (surface, aim_mm) not in self._spots:
            elsewhere = sheet.held is not None or aim_mm != _CENTRE
            self._spots[surface, aim_mm] = make_spot(
                self._setup.aperture_mm,
                self._grid,
                sheet.held.maps if sheet.held else self._maps,
                self._footprints,
                sheet.coverage,
                self._scattering if self._quality.scattering_mm > 0 else None,
                sheet.of_pairs,
                sheet.of_ambient,
                raster_to_wall(self._maps, self._maps.raster_centre) + np.array(aim_mm) if elsewhere else None,
            )
        return self._spots[surface, aim_mm]


def _known_surface(surface: str) -> str:
    if surface not in _SURFACES:
        raise DeviceError(f"the bench's surfaces are {', '.join(_SURFACES)}; got {surface!r}")
    return surface
