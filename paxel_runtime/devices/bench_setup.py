"""What stands on the virtual bench, as its user says it; checked, but not yet simulated. Numbers and names only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import QUALITIES
from paxel_runtime.errors import InputError
from paxel_runtime.model.fluorescence import brightener
from paxel_runtime.model.pattern import Colorant, Pattern
from paxel_runtime.optics.geometry import CameraPose
from paxel_runtime.optics.held import largest_disc_px
from paxel_runtime.optics.overprint import papers
from paxel_runtime.optics.spectra import RESPONSES, primaries

__all__ = ["BAYER", "GRAY", "BenchSetup"]

GRAY = 0.5
"""Reflectance of the gray sheet as a share of the white paper's, in every band."""

BAYER = ("none", "demosaiced", "raw")
"""What the camera's sensor may be: three planes, or a mosaic that is interpolated or handed out as it is."""

_WIDEST_APERTURE = 0.8
_FARTHEST_MM, _STEEPEST_DEG = 50.0, 20.0
_FARTHEST_OFF_MM = 10.0
_BRIGHTEST, _LONGEST = 10.0, 100.0


@dataclass(frozen=True)
class BenchSetup:
    """What stands on the bench.

    Attributes
    ----------
    pattern : Pattern
        What is printed, and what its colorants are; ``"white"`` is the paper of the print.
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
    second_surface : str
        What ``place("white")`` puts up: ``"white"``, a sheet of the print's paper; ``"gray"``, one that reflects half
        as much in every band (the paper's remedy where the white surface is much the brighter); ``"uncoated"``, a
        sheet of another paper; or the name of a colorant, a sheet of that reflectance.
    sheet_distance_mm : float
        Gap between that sheet and the wall at the middle, 0..50; 0 with no tilt is a sheet in place.
    sheet_tilt_deg : (float, float)
        Its tilt about the x and the y axis, -20..20; see `optics.held.hold_sheet`.
    print_offset_mm : (float, float)
        How far the print has moved from its place since, right and up, -10..10.
    ambient : float
        Uniform light of D65's spectrum besides the projector's, as a share of full white, 0..10.
    projector : str
        Whose measured spectra the channels have: ``"dlp"`` or ``"rgbw"``; see `optics.primaries`.
    responses : tuple of str
        Response curve of each channel, of `optics.RESPONSES`; none: the bench's own.
    channel_blur : tuple of float
        Factor on the projector's blur for each channel, > 0; none: equal.
    spectra : mapping of str to (97,) float64 array
        Spectral power of channels of your own, on `EXCITATION_NM`, per nm, besides the measured ones and before them;
        all of them at full together are to have Y = 1.
    level_spectra : bool
        Whether the spectra of the projector ``"rgbw"`` change their shape with the level, as they were measured to do.
    brightener : bool
        Whether the paper of the print has an optical brightener, which shines blue under UV.
    overprint : bool
        Where inks overlap, their measured overprint (`optics.overprint.overprints`), if all are printed by recipes of
        solids; else, and for all other inks, the darker decides.
    exposure : float
        Factor on the camera's exposure, up to 100; above 1.25 the brightest place saturates.
    camera_pose : CameraPose
        Where the camera looks, if not straight at the whole projection.
    bayer : str
        One of `BAYER`; with ``"raw"`` every picture is one plane (h, w), red at even rows and columns, blue at odd.

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
    second_surface: str = "white"
    sheet_distance_mm: float = 0.0
    sheet_tilt_deg: tuple[float, float] = (0.0, 0.0)
    print_offset_mm: tuple[float, float] = (0.0, 0.0)
    ambient: float = 0.0
    projector: str = "dlp"
    responses: tuple[str, ...] = ()
    channel_blur: tuple[float, ...] = ()
    spectra: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    level_spectra: bool = False
    brightener: bool = False
    overprint: bool = False
    exposure: float = 1.0
    bayer: str = "none"
    camera_pose: CameraPose = field(default_factory=CameraPose)

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
        primaries(self.channels, self.projector, self.spectra)
        self._check_surfaces()
        self._check_options()

    @property
    def held(self) -> bool:
        """Whether the second surface stands free of the wall."""
        return self.sheet_distance_mm != 0 or any(self.sheet_tilt_deg)

    @property
    def defocus_px(self) -> float:
        """Diameter, at most, of the disc to which the held sheet's defocus spreads a point; 0 in place."""
        if not self.held:
            return 0.0
        return largest_disc_px(self.resolution, self.width_mm, self.sheet_distance_mm, self.sheet_tilt_deg)

    @property
    def library(self) -> dict[str, Colorant]:
        """What is known to the pattern, and other papers."""
        library = papers() | dict(self.pattern.library)
        if self.brightener:
            library["white"] = replace(library["white"], fluorescence=brightener())
        return library

    @property
    def fluoresces(self) -> bool:
        """Whether anything on the bench emits light of its own."""
        library = self.library
        return any(library[name].fluorescence for name in (*self.pattern.colorants, "white"))

    def _check_surfaces(self) -> None:
        library = self.library
        unknown = [name for name in self.pattern.colorants if name not in library]
        if unknown:
            raise InputError(f"the bench knows the colorants {', '.join(library)}; got {', '.join(unknown)}")
        if self.second_surface != "gray" and self.second_surface not in library:
            raise InputError(
                f"bench.second_surface must be gray or a colorant ({', '.join(library)}); got {self.second_surface!r}"
            )
        if not 0 <= self.sheet_distance_mm <= _FARTHEST_MM:
            raise InputError(f"bench.sheet_distance_mm must be 0 to {_FARTHEST_MM:g}, got {self.sheet_distance_mm}")
        if len(self.sheet_tilt_deg) != 2 or not all(abs(tilt) <= _STEEPEST_DEG for tilt in self.sheet_tilt_deg):
            raise InputError(
                f"bench.sheet_tilt_deg must be two angles of at most {_STEEPEST_DEG:g} degrees, "
                f"got {self.sheet_tilt_deg}"
            )
        if len(self.print_offset_mm) != 2 or not all(abs(mm) <= _FARTHEST_OFF_MM for mm in self.print_offset_mm):
            raise InputError(
                f"bench.print_offset_mm must be two lengths of at most {_FARTHEST_OFF_MM:g} mm, "
                f"got {self.print_offset_mm}"
            )
        if self.defocus_px == float("inf"):
            raise InputError(
                f"bench.sheet_distance_mm ({self.sheet_distance_mm:g}) and bench.sheet_tilt_deg {self.sheet_tilt_deg} "
                f"bring the sheet too near to the projector of a picture {self.width_mm:g} mm wide: hold it nearer to "
                "the wall"
            )

    def _check_options(self) -> None:
        for name, value, ok in (
            (f"bench.ambient must be 0 to {_BRIGHTEST:g}", self.ambient, 0 <= self.ambient <= _BRIGHTEST),
            (
                f"bench.exposure must be > 0 and at most {_LONGEST:g}",
                self.exposure,
                0 < self.exposure <= _LONGEST,
            ),
            (
                "bench.level_spectra is measured of the projector rgbw alone: set projector.spectra",
                self.level_spectra,
                not self.level_spectra or (self.projector == "rgbw" and not self.spectra),
            ),
            (f"bench.bayer must be one of {', '.join(BAYER)}", self.bayer, self.bayer in BAYER),
            (
                f"projector.responses must be one of {', '.join(RESPONSES)} for each channel, or empty",
                self.responses,
                len(self.responses) in (0, len(self.channels)) and all(name in RESPONSES for name in self.responses),
            ),
            (
                "bench.channel_blur must be a factor from 0.1 to 10 for each channel, or empty",
                self.channel_blur,
                len(self.channel_blur) in (0, len(self.channels)) and all(0.1 <= f <= 10 for f in self.channel_blur),
            ),
        ):
            if not ok:
                raise InputError(f"{name}; got {value!r}")
