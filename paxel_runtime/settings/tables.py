"""The tables of paxel.toml: every key with its unit, rule and default, as pydantic models.

From these `paxel new` writes the file, with a comment behind every key. Knows keys and rules; not files, not presets.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from paxel_runtime.model.fluorescence import UV_BAND_NM
from paxel_runtime.model.pattern import colorant_library

__all__ = ["BENCH_CHANNELS", "PAPERS", "SPECTRA", "ColorantSettings", "Response", "Section", "Settings"]

Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Percent = Annotated[float, Field(ge=0, lt=50)]
Response = Literal["linear", "power", "srgb", "red-preset", "green-preset", "blue-preset", "rgbw"]
Pan = Annotated[float, Field(ge=-2, le=2)]
Tilt = Annotated[float, Field(ge=-20, le=20)]
Slant = Annotated[float, Field(ge=-0.3, le=0.3)]
SPECTRA = ("dlp", "rgbw")
BENCH_CHANNELS = ("red", "green", "blue", "white", "uv")
"""What the virtual bench knows the spectra of, by the names of its projectors and of their channels."""
Tristimulus = Annotated[float, Field(ge=0, le=1.2)]
Corner = tuple[float, float]
Pixels = tuple[Annotated[int, Field(ge=16, le=16384)], Annotated[int, Field(ge=16, le=16384)]]


class Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PatternSettings(Section):
    """What is printed."""

    layout: Literal["checkerboard", "tiles", "stripes", "blue-noise"] = Field(
        "checkerboard", description="how the colorants are laid out"
    )
    colorants: tuple[str, ...] = Field(("black", "white"), description="inks of the print; white is the bare paper")
    dot_size_mm: Annotated[float, Field(gt=0, le=50)] = Field(0.75, description="edge of a dot on the paper, mm")
    angle_deg: Annotated[float, Field(ge=-360, le=360)] = Field(
        30.0, description="rotation, counter-clockwise, degrees"
    )
    size_mm: tuple[Positive, Positive] = Field((600.0, 400.0), description="width and height of the pattern, mm")
    snap: bool = Field(False, description="move dot size (1 %) and angle (0.5 degrees) onto the printer's pixels")
    shares: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(
        (), description="area of each colorant, summing to 1; [] = equal"
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(0, description="seed of a blue-noise layout")
    blue_noise: Literal["swap", "zhou-fang", "void-and-cluster"] = Field(
        "swap", description="method of a blue-noise layout"
    )
    flatness: Annotated[float, Field(ge=0.5, le=4)] = Field(
        2.0, description="of the swap method, in dots: small for low visibility, large for a flat spectrum"
    )
    tile_order: Literal["search"] | tuple[str, ...] = Field(
        "search", description='order of the colorants in a tile: "search" for the least visible, or a list'
    )

    @model_validator(mode="after")
    def _different_colorants(self) -> PatternSettings:
        if len(self.colorants) < 2 or len(set(self.colorants)) != len(self.colorants):
            raise ValueError(f"colorants must be two or more different ones, got {list(self.colorants)}")
        if self.layout == "checkerboard" and len(self.colorants) != 2:
            raise ValueError(f"colorants of a checkerboard must be two different ones, got {list(self.colorants)}")
        if self.shares and (len(self.shares) != len(self.colorants) or abs(sum(self.shares) - 1) > 1e-6):
            raise ValueError(
                f"shares must be {len(self.colorants)} numbers that sum to 1, one a colorant, got {list(self.shares)}"
            )
        return self


class ColorantSettings(Section):
    """An ink or a paper of your own, or what is otherwise about one of the library's; keys that are absent: see there.

    Names of files are relative to the folder of paxel.toml; their form stands in ``colorants.py``.
    """

    reflectance: str = Field("", description='"file.csv" of wavelength in nm and reflectance 0..1 of a solid patch')
    XYZ: tuple[Tristimulus, Tristimulus, Tristimulus] | None = Field(
        None, description="in place of a reflectance: its colour under D50, Y = 1 for the perfect diffuser"
    )
    emission: str = Field(
        "", description='of a fluorescent ink, "file.csv" of wavelength in nm and power emitted per nm'
    )
    efficiency: Annotated[float, Field(gt=0, le=1)] | None = Field(
        None, description="power emitted per power received, if the emission's unit is another"
    )
    excitation_nm: tuple[Annotated[float, Field(ge=300, le=780)], Annotated[float, Field(ge=300, le=780)]] = Field(
        UV_BAND_NM, description="light that excites it, from and to, nm"
    )
    cmyk: tuple[Share, Share, Share, Share] | None = Field(None, description="how the printer mixes it, 0..1")
    spot: str = Field("", description="name of the plate that prints it")

    @model_validator(mode="after")
    def _describes_one_ink(self) -> ColorantSettings:
        if self.reflectance and self.XYZ is not None:
            raise ValueError("reflectance and XYZ exclude each other: leave one of them out")
        if not self.reflectance and self.XYZ is None and not self.emission:
            raise ValueError("reflectance, XYZ or emission must be given: what is the ink to look like?")
        if not self.emission and (self.efficiency is not None or self.excitation_nm != UV_BAND_NM):
            raise ValueError("efficiency and excitation_nm belong to an emission: give one, or leave them out")
        if self.excitation_nm[0] >= self.excitation_nm[1]:
            raise ValueError(f"excitation_nm must be a shorter and a longer wavelength, got {list(self.excitation_nm)}")
        return self


PAPERS = ("A0", "A1", "A2", "A3", "A4", "A3+", "letter", "legal", "tabloid")
"""Names of paper that ``printer.page`` may have."""


def _page(value: Any) -> str | tuple[float, float]:
    if value in ("auto", *PAPERS):
        return str(value)
    if isinstance(value, list | tuple) and len(value) == 2:
        width, height = value
        if all(isinstance(side, int | float) and not isinstance(side, bool) and 0 < side < 1e5 for side in value):
            return float(width), float(height)
    raise ValueError(f'page must be "auto", {", ".join(PAPERS)}, or [width, height] in mm, got {value!r}')


class PrinterSettings(Section):
    """The printer that prints it."""

    dpi: Annotated[int, Field(ge=72, le=9600)] = Field(1440, description="dots per inch of the printer")
    ink_spread_um: Annotated[float, Field(ge=0, le=200)] = Field(
        0.0, description="growth of every ink edge on paper, um: the PDF shrinks the dots by it"
    )
    page: Annotated[str | tuple[float, float], BeforeValidator(_page)] = Field(
        "auto",
        description='"auto" = one page as large as the sheet; or pages to glue: "A4", "A3", [width, height] in mm',
    )
    measured_ruler_mm: tuple[Annotated[float, Field(ge=90, le=110)], Annotated[float, Field(ge=90, le=110)]] = Field(
        (100.0, 100.0), description="length of the printed rulers in x and y as you measured them, mm"
    )


class ProjectorSettings(Section):
    """The projector."""

    resolution: Pixels = Field((1920, 1080), description="native width and height, pixels")
    width_mm: Positive = Field(281.0, description="width of the projection on the wall, mm")
    channels: tuple[str, ...] = Field(
        ("red", "green", "blue"), description="light channels, 1 to 4, in the order of the frame's planes"
    )
    bits: Literal[8, 10] = Field(8, description="bits of a device code")
    spectra: str = Field(
        "dlp",
        description='spectra of the channels on the bench: "dlp", "rgbw", or a "file.csv" of wavelength, channels',
    )
    responses: tuple[Response, ...] = Field(
        (), description=f"response curve of each channel on the bench: {' | '.join(get_args(Response))}; [] = its own"
    )

    @model_validator(mode="after")
    def _one_to_four_channels(self) -> ProjectorSettings:
        if not 1 <= len(self.channels) <= 4 or len(set(self.channels)) != len(self.channels):
            raise ValueError(f"channels must be one to four different names, got {list(self.channels)}")
        for name in self.channels:
            if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,19}", name):
                raise ValueError(f"channels must be named with letters, digits, - and _, got {name!r}")
            if self.spectra in SPECTRA and name not in BENCH_CHANNELS:
                raise ValueError(
                    f"channels must be among {', '.join(BENCH_CHANNELS)}, or in a file of your own that spectra names, "
                    f"got {name!r}"
                )
        if self.spectra not in SPECTRA and not self.spectra.lower().endswith((".csv", ".txt")):
            raise ValueError(f"spectra must be one of {', '.join(SPECTRA)} or the name of a .csv, got {self.spectra!r}")
        if len(self.responses) not in (0, len(self.channels)):
            raise ValueError(f"responses must be one for each of the {len(self.channels)} channels, or [], "
                             f"got {list(self.responses)}")  # fmt: skip
        return self


class LightSettings(Section):
    """Structured light, which finds where the camera sees each projector pixel."""

    method: Literal["lines", "phase"] = Field(
        "lines", description="what refines the Gray code: thin shifted lines, or sinusoids for a camera short of light"
    )


class RegistrationSettings(Section):
    """How decoded structured light becomes a lookup table."""

    table: Literal["fit", "per-pixel"] = Field(
        "fit",
        description="one smooth fit through all points, or each pixel's own mean with gaps triangulated (the paper's)",
    )


class CameraSettings(Section):
    """The camera that looks at the wall."""

    resolution: Pixels = Field((4000, 3000), description="width and height of its pictures, pixels")
    bits: Annotated[int, Field(ge=8, le=16)] = Field(
        14, description="bits of its raw values; the virtual bench may use fewer, as its quality says"
    )


class ClusterSettings(Section):
    """How projector pixels are sorted."""

    count: Annotated[int, Field(ge=2, le=12)] = Field(
        3, description="number of clusters K, at least the number of colorants"
    )
    method: Literal["kmeans", "design"] = Field(
        "kmeans", description="from the pixels' colours, or from the known pattern found in the picture"
    )
    corners_px: tuple[Corner, Corner, Corner, Corner] | tuple[()] = Field(
        (),
        description="for design: the pattern's corners in the camera's picture, [[x, y], ...] clockwise from the upper "
        "left; [] = by the print's own lattice",
    )
    space: Literal["lab", "linear"] = Field("lab", description="where k-means takes distances: CIELAB or linear light")


class ModelSettings(Section):
    """The prediction of colours."""

    second_surface: Literal["white", "gray", "none"] = Field(
        "white",
        description="sheet that is laid over the pattern; gray needs the white paper once more, as reference; none: "
        "pictures are shown on the pattern alone",
    )
    white: Literal["full", "D50", "D65"] | tuple[Share, Share] = Field(
        "full",
        description='white where there is no second surface: "full" = all clusters at full; or the brightest light of '
        '"D50", "D65" or a chromaticity [x, y]',
    )
    ramps: Literal["meter", "camera"] = Field("meter", description="what measures the response curves")
    response: Literal["measured", "gamma"] = Field(
        "measured", description="curves through the measured steps, or offset and exponent fitted to them"
    )
    observer_deg: Literal[2, 10] = Field(2, description="CIE standard observer that sees the spectra, degrees")
    kind: Literal["spectral", "image"] = Field(
        "spectral", description="from the meter's spot, or at every pixel from the camera's pictures"
    )
    correction: Literal["auto", "off"] = Field(
        "auto", description="what extra readings teach beyond the linear model, if it helps"
    )
    camera_to_XYZ: Literal["readings", "sRGB", "AdobeRGB"] = Field(
        "readings", description="of an image-based model: scaled to the meter's readings, or taken for an RGB space"
    )


_SPOT_SHARE = 0.4
"""Largest spot at several positions, of the field's shorter side: they lie a quarter of it from the rim, less some."""


class MeterSettings(Section):
    """The spectroradiometer."""

    aperture_mm: Positive = Field(
        20.0, description="diameter of its spot on the wall, mm: at least 8 periods of the pattern"
    )
    positions: Literal[1, 5, 9] = Field(
        1, description="places of the wall where it reads the clusters: 1 = the centre, 5 or 9 = over the field"
    )


class ViewingSettings(Section):
    """Who looks at it."""

    distance_mm: Positive = Field(4000.0, description="distance of the viewer from the wall, mm")
    luminance_cd_m2: Annotated[float, Field(gt=0, le=10_000)] = Field(
        100.0, description="mean luminance of the lit print: how well its pattern and its moire are seen, cd/m2"
    )


class MappingSettings(Section):
    """How pictures are fitted into what the pattern can show."""

    method: Literal["adaptive", "static"] = Field(
        "adaptive",
        description="adaptive: two pictures share what the pattern can show, where that gains contrast; "
        "static: each for itself",
    )
    lightness: Literal["linear", "fixed", "clip"] = Field(
        "linear", description="the picture's range of L*, or 0-100, onto the grays there are; or kept and clipped"
    )
    black_percent: Percent = Field(0.5, description="share of the picture that becomes black, with linear")
    white_percent: Percent = Field(0.5, description="share of the picture that becomes white, with linear")
    chroma: Literal["soft", "clip"] = Field("soft", description="how chroma meets the edge of the sub-gamut")
    placement: Literal["fill", "fit", "stretch"] = Field("fill", description="how a picture fills the projection")
    align: tuple[Share, Share] = Field(
        (0.5, 0.5), description="what is kept or where it stands, across and down: 0 = left, top; 0.5 = the middle"
    )
    geometry: Literal["frame", "wall"] = Field(
        "frame",
        description="pictures straight on the projector's frame, or on the wall, so that circles are round there: by "
        "clusters.corners_px, or else as a camera sees it that looks straight at the wall",
    )


class AssemblySettings(Section):
    """How the projection image is put together."""

    method: Literal["refine", "dither", "combine"] = Field(
        "refine",
        description="dither: each pixel takes its cluster's part; refine: corrected for what the eye sees of each "
        "pixel's own coverage; combine: blocks of pixels share their colours",
    )
    outside: Literal["black", "white"] = Field("black", description="light beside the pattern")


class DeviceSettings(Section):
    """What stands on the table."""

    kind: Literal["virtual", "folder"] = Field(
        "virtual", description="where frames are shown and captured; folder: your own camera, photographs as files"
    )


class BenchSettings(Section):
    """The virtual bench."""

    quality: Literal["realistic", "ideal", "harsh"] = Field("realistic", description="how honest its hardware is")
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(0, description="seed of its noise and imperfections")
    white_sheet: str = Field(
        "white", description='paper of the white sheet: "white" = the print\'s, "uncoated", or a colorant'
    )
    sheet_distance_mm: Annotated[float, Field(ge=0, le=50)] = Field(
        0.0, description="gap between the white sheet, held freely, and the wall, 0 to 50 mm"
    )
    sheet_tilt_deg: tuple[Tilt, Tilt] = Field(
        (0.0, 0.0), description="tilt of the white sheet about the x and the y axis, -20 to 20 degrees"
    )
    ambient: Annotated[float, Field(ge=0, le=10)] = Field(
        0.0, description="daylight besides the projector's light, as a share of full white, 0 to 10"
    )
    level_spectra: bool = Field(
        False, description="whether the spectra of the projector rgbw change with the level, as measured"
    )
    brightener: bool = Field(False, description="whether the print's paper shines blue under UV")
    overprint: bool = Field(False, description="whether overlapping inks have their measured overprint's colour")
    channel_blur: tuple[Annotated[float, Field(ge=0.1, le=10)], ...] = Field(
        (), description="factor on the projector's blur for each channel, 0.1 to 10; [] = 1"
    )
    exposure: Annotated[float, Field(gt=0, le=100)] = Field(
        1.0, description="factor on the camera's exposure, up to 100; above 1.25 the brightest place saturates"
    )
    bayer: Literal["none", "demosaiced", "raw"] = Field("none", description="the camera's mosaic of colour filters")
    camera_pan: tuple[Pan, Pan] = Field(
        (0.0, 0.0), description="shift of the projection in the camera's picture, right and down, share of its size"
    )
    camera_zoom: Annotated[float, Field(gt=0, le=100)] = Field(1.0, description="magnification of the camera")
    camera_roll_deg: Annotated[float, Field(ge=-180, le=180)] = Field(
        0.0, description="turn of the camera about its axis, degrees"
    )
    camera_slant: tuple[Slant, Slant] = Field(
        (0.0, 0.0), description="change of scale from the middle to the corner along x and y, -0.3 to 0.3"
    )


class Settings(Section):
    """All of paxel.toml; a section a table."""

    pattern: PatternSettings = PatternSettings()
    printer: PrinterSettings = PrinterSettings()
    projector: ProjectorSettings = ProjectorSettings()
    light: LightSettings = LightSettings()
    registration: RegistrationSettings = RegistrationSettings()
    camera: CameraSettings = CameraSettings()
    clusters: ClusterSettings = ClusterSettings()
    model: ModelSettings = ModelSettings()
    meter: MeterSettings = MeterSettings()
    viewing: ViewingSettings = ViewingSettings()
    mapping: MappingSettings = MappingSettings()
    assembly: AssemblySettings = AssemblySettings()
    devices: DeviceSettings = DeviceSettings()
    bench: BenchSettings = BenchSettings()
    colorants: dict[str, ColorantSettings] = {}

    @model_validator(mode="after")
    def _known_colorants(self) -> Settings:
        for name in self.colorants:
            if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}", name):
                raise ValueError(f"[colorants.NAME] must be named with letters, digits, - and _, got {name!r}")
        known = {**colorant_library(), **self.colorants}
        for name in self.pattern.colorants:
            if name not in known:
                raise ValueError(
                    f"pattern.colorants must be among {', '.join(known)}, or described in a table [colorants.NAME], "
                    f"got {name!r}"
                )
        return self

    @property
    def field_mm(self) -> tuple[float, float]:
        """Width and height of what pattern and projection have in common."""
        columns, rows = self.projector.resolution
        (width, height), across = self.pattern.size_mm, self.projector.width_mm
        return min(width, across), min(height, across * rows / columns)

    @model_validator(mode="after")
    def _spots_within_field(self) -> Settings:
        largest_mm = _SPOT_SHARE * min(self.field_mm)
        if self.meter.positions > 1 and self.meter.aperture_mm > largest_mm:
            raise ValueError(
                f"meter.positions must be 1 where meter.aperture_mm is above {largest_mm:.4g} ({_SPOT_SHARE:g} of the "
                f"field's shorter side), got {self.meter.positions} and {self.meter.aperture_mm:g}: spots leave it"
            )
        return self

    @model_validator(mode="after")
    def _bench_fits(self) -> Settings:
        sheets = {"uncoated", *colorant_library(), *self.colorants}
        if self.bench.white_sheet not in sheets:
            raise ValueError(f"bench.white_sheet must be among {', '.join(sorted(sheets))}, "
                             f"got {self.bench.white_sheet!r}")  # fmt: skip
        if self.model.second_surface == "gray" and self.bench.white_sheet != "white":
            raise ValueError(f'bench.white_sheet must be "white" where model.second_surface is "gray", '
                             f"got {self.bench.white_sheet!r}")  # fmt: skip
        if self.bench.level_spectra and self.projector.spectra != "rgbw":
            raise ValueError(f'bench.level_spectra needs projector.spectra "rgbw", got {self.projector.spectra!r}')
        if len(self.bench.channel_blur) not in (0, len(self.projector.channels)):
            raise ValueError(
                f"bench.channel_blur must be one for each of the {len(self.projector.channels)} channels, or [], "
                f"got {list(self.bench.channel_blur)}"
            )
        return self

    @model_validator(mode="after")
    def _white_where_there_is_no_sheet(self) -> Settings:
        if self.model.white != "full" and self.model.second_surface != "none":
            raise ValueError(
                f'model.white must be "full" where there is a second surface (its paper is the white), '
                f"got {self.model.white!r}"
            )
        if self.model.white != "full" and self.model.kind == "image":
            raise ValueError(f'model.white must be "full" where model.kind is "image", got {self.model.white!r}')
        if isinstance(self.model.white, tuple) and not (self.model.white[1] > 0 and sum(self.model.white) < 1):
            raise ValueError(f"model.white must be a chromaticity with y > 0, x + y < 1, got {list(self.model.white)}")
        return self

    @model_validator(mode="after")
    def _clusters_cover_colorants(self) -> Settings:
        if self.clusters.count < len(self.pattern.colorants):
            raise ValueError(
                f"clusters.count must be >= the number of pattern.colorants ({len(self.pattern.colorants)}), "
                f"got {self.clusters.count}"
            )
        return self

    def values(self, *tables: str) -> dict[str, Any]:
        """Flat ``{"pattern.dot_size_mm": 0.75, ...}``, ready for JSON; ``"colorants"`` is one value.

        Of the named tables and single keys (``"pattern", "printer.dpi"``); of all without names.
        """
        data = self.model_dump(mode="json")
        own = {"colorants": data.pop("colorants")}
        flat = {f"{s}.{key}": value for s, keys in data.items() for key, value in keys.items()} | own
        return {key: flat[key] for key in flat if not tables or key in tables or key.partition(".")[0] in tables}

    def files(self, *tables: str) -> dict[str, str]:
        """Files that the named tables name, by their key, relative to the folder of paxel.toml."""
        named = {
            f"colorants.{name}.{key}": value
            for name, colorant in self.colorants.items()
            for key, value in (("reflectance", colorant.reflectance), ("emission", colorant.emission))
        }
        named["projector.spectra"] = "" if self.projector.spectra in SPECTRA else self.projector.spectra
        return {key: value for key, value in named.items() if value and key.partition(".")[0] in tables}
