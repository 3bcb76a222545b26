"""paxel.toml: the only file a person writes. Its keys, rules, units and presets, in one place.

The pydantic models below are the table from which `paxel new` writes the file, with a comment behind every key, and
from which an error names the key, the rule, the value found and the line. Nothing here reads a stage's results.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from paxel_runtime.errors import SettingsError
from paxel_runtime.model.pattern import colorant_library

__all__ = ["DEMO_OVERRIDES", "PRESETS", "Settings", "load_settings", "make_settings", "settings_to_toml"]

Positive = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1)]
Pixels = tuple[Annotated[int, Field(ge=16, le=16384)], Annotated[int, Field(ge=16, le=16384)]]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PatternSettings(_Section):
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
    def _known_colorants(self) -> PatternSettings:
        known = colorant_library()
        for name in self.colorants:
            if name not in known:
                raise ValueError(f"colorants must be among {', '.join(known)}, got {name!r}")
        if len(self.colorants) < 2 or len(set(self.colorants)) != len(self.colorants):
            raise ValueError(f"colorants must be two or more different ones, got {list(self.colorants)}")
        if self.layout == "checkerboard" and len(self.colorants) != 2:
            raise ValueError(f"colorants of a checkerboard must be two different ones, got {list(self.colorants)}")
        if self.shares and (len(self.shares) != len(self.colorants) or abs(sum(self.shares) - 1) > 1e-6):
            raise ValueError(
                f"shares must be {len(self.colorants)} numbers that sum to 1, one a colorant, got {list(self.shares)}"
            )
        return self


class PrinterSettings(_Section):
    """The printer that prints it."""

    dpi: Annotated[int, Field(ge=72, le=9600)] = Field(1440, description="dots per inch of the printer")
    ink_spread_um: Annotated[float, Field(ge=0, le=200)] = Field(
        0.0, description="growth of every ink edge on paper, um: the PDF shrinks the dots by it"
    )


class ProjectorSettings(_Section):
    """The projector."""

    resolution: Pixels = Field((1920, 1080), description="native width and height, pixels")
    width_mm: Positive = Field(281.0, description="width of the projection on the wall, mm")
    channels: tuple[Literal["red"], Literal["green"], Literal["blue"]] = Field(
        ("red", "green", "blue"), description="light channels, in the order of the frame's planes"
    )
    bits: Literal[8] = Field(8, description="bits of a device code")


class CameraSettings(_Section):
    """The camera that looks at the wall."""

    resolution: Pixels = Field((4000, 3000), description="width and height of its pictures, pixels")
    bits: Annotated[int, Field(ge=8, le=16)] = Field(
        14, description="bits of its raw values; the virtual bench may use fewer, as its quality says"
    )


class ClusterSettings(_Section):
    """How projector pixels are sorted."""

    count: Annotated[int, Field(ge=2, le=12)] = Field(
        3, description="number of clusters K, at least the number of colorants"
    )


class MeterSettings(_Section):
    """The spectroradiometer."""

    aperture_mm: Positive = Field(20.0, description="diameter of its spot on the wall, mm: at least 8 dots")


class ViewingSettings(_Section):
    """Who looks at it."""

    distance_mm: Positive = Field(4000.0, description="distance of the viewer from the wall, mm")


class MappingSettings(_Section):
    """How pictures are fitted into what the pattern can show."""

    chroma: Literal["soft", "clip"] = Field("soft", description="how chroma meets the edge of the sub-gamut")
    placement: Literal["fill", "fit", "stretch"] = Field("fill", description="how a picture fills the projection")


class AssemblySettings(_Section):
    """How the projection image is put together."""

    outside: Literal["black", "white"] = Field("black", description="light beside the pattern")


class DeviceSettings(_Section):
    """What stands on the table."""

    kind: Literal["virtual"] = Field("virtual", description="where frames are shown and captured")


class BenchSettings(_Section):
    """The virtual bench."""

    quality: Literal["realistic", "ideal", "harsh"] = Field("realistic", description="how honest its hardware is")
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(0, description="seed of its noise and imperfections")


class Settings(_Section):
    """All of paxel.toml; a section a table."""

    pattern: PatternSettings = PatternSettings()
    printer: PrinterSettings = PrinterSettings()
    projector: ProjectorSettings = ProjectorSettings()
    camera: CameraSettings = CameraSettings()
    clusters: ClusterSettings = ClusterSettings()
    meter: MeterSettings = MeterSettings()
    viewing: ViewingSettings = ViewingSettings()
    mapping: MappingSettings = MappingSettings()
    assembly: AssemblySettings = AssemblySettings()
    devices: DeviceSettings = DeviceSettings()
    bench: BenchSettings = BenchSettings()

    @model_validator(mode="after")
    def _clusters_cover_colorants(self) -> Settings:
        if self.clusters.count < len(self.pattern.colorants):
            raise ValueError(
                f"clusters.count must be >= the number of pattern.colorants ({len(self.pattern.colorants)}), "
                f"got {self.clusters.count}"
            )
        return self

    def values(self, *sections: str) -> dict[str, Any]:
        """Flat ``{"pattern.dot_size_mm": 0.75, ...}`` of the named sections (all without names), ready for JSON."""
        data = self.model_dump(mode="json")
        return {f"{s}.{key}": value for s in (sections or data) for key, value in data[s].items()}


PRESETS: dict[str, dict[str, Any]] = {
    "bw-checkerboard": {},
    "bw-blue-noise": {"pattern.layout": "blue-noise"},
    "cmyrgb": {
        "pattern.layout": "tiles",
        "pattern.colorants": ["cyan", "magenta", "yellow", "red", "green", "blue"],
        "clusters.count": 6,
    },
}
"""Whole installations by name: what they change from the defaults."""

DEMO_OVERRIDES: dict[str, Any] = {
    "pattern.size_mm": [160.0, 100.0],
    "projector.resolution": [960, 540],
    "projector.width_mm": 140.6,
    "camera.resolution": [2048, 1536],
}
"""What `paxel demo` changes in any preset: fit for a laptop and an A4 sheet, never a whole number of pixels a dot."""


def make_settings(preset: str = "bw-checkerboard", overrides: dict[str, Any] | None = None) -> Settings:
    """Settings of a preset with single keys changed.

    Parameters
    ----------
    preset : str
        A key of `PRESETS`.
    overrides : dict, optional
        ``{"pattern.dot_size_mm": 0.5}``.

    Raises
    ------
    SettingsError
        If the preset or a key is unknown, or a value breaks its rule.
    """
    if preset not in PRESETS:
        raise SettingsError(f"--preset must be one of {', '.join(PRESETS)}, got {preset!r}")
    nested: dict[str, dict[str, Any]] = {}
    for key, value in {**PRESETS[preset], **(overrides or {})}.items():
        section, dot, name = key.partition(".")
        if not dot or not name:
            raise SettingsError(f"a key is written section.name, such as pattern.dot_size_mm; got {key!r}")
        nested.setdefault(section, {})[name] = value
    return _validate(nested, source="--set", text=None)


def load_settings(path: Path) -> Settings:
    """Read and check a paxel.toml.

    Raises
    ------
    SettingsError
        With the key, the rule, the value found and the line.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SettingsError(f"{path}: there is no paxel.toml here; make one with: paxel new {path.parent}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path} cannot be read as UTF-8 text: {error}") from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(f"{path.name} is not TOML: {error}") from None
    return _validate(data, source=path.name, text=text)


def _validate(data: dict[str, Any], *, source: str, text: str | None) -> Settings:
    try:
        return Settings.model_validate(data)
    except ValidationError as error:
        lines = dict.fromkeys(_explain(e, source, text) for e in error.errors())  # one line a rule
        raise SettingsError("\n".join(lines)) from None


def _explain(error: Any, source: str, text: str | None) -> str:
    """One pydantic error as `source: key rule, got value (line)`."""
    location = [str(part) for part in error["loc"]]
    key = ".".join(location[:2]) + "".join(f"[{part}]" for part in location[2:])
    line = _line_of(location, text)
    where = f" (line {line})" if line else ""
    if error["type"] == "extra_forbidden":
        return f"{source}: {key} is not a known key{where}; {_known_keys(location)}"
    if error["type"] == "missing" and len(location) > 2:
        key = ".".join(location[:2])
        return f"{source}: {key} must have more values, got {error['input']!r}{where}"
    if error["type"] == "model_type":
        return f"{source}: {key} must be a table, written [{key}], got {error['input']!r}{where}"
    if error["type"] == "value_error":  # our own rules: the message holds rule and value
        message = str(error["ctx"]["error"])
        if text:  # the rule may be about another key than the section it stands in
            keys = [k for k in re.findall(r"\b(?:\w+\.)?\w+\b", message) if _line_of(_path_in(location, k), text)]
            line = _line_of(_path_in(location, keys[0]), text) if keys else line
        where = f" (line {line})" if line else ""
        prefix = f"{location[0]}." if location else ""
        return f"{source}: {prefix}{message}{where}"
    rule = re.sub(r"^Input should be |^Value should ", "", error["msg"])
    for words, sign in (
        ("greater than or equal to", ">="),
        ("less than or equal to", "<="),
        ("greater than", ">"),
        ("less than", "<"),
    ):
        rule = rule.replace(words, sign)
    rule = rule.split(", unable")[0].replace("'", '"')
    return f"{source}: {key} must be {rule}, got {error['input']!r}{where}"


def _path_in(location: list[str], key: str) -> list[str]:
    return key.split(".") if "." in key else [*location[:1], key]


def _known_keys(location: list[str]) -> str:
    sections = Settings.model_fields
    if len(location) == 1 or location[0] not in sections:
        return f"the tables are {', '.join(f'[{name}]' for name in sections)}"
    fields = sections[location[0]].annotation.model_fields  # type: ignore[union-attr]
    return f"[{location[0]}] has {', '.join(fields)}"


def _line_of(location: list[str], text: str | None) -> int | None:
    """Line of `[section] key = ...` in the file: every key stands alone on a line under its table."""
    if text is None or not location:
        return None
    section, found = "", None
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[\s*([\w.-]+)\s*\]", line):
            section = header.group(1)
            if section == location[0]:
                found = number
        elif len(location) > 1 and (key := re.match(r"\s*([\w.-]+)\s*=", line)):
            if [*section.split("."), *key.group(1).split(".")][-2:] == location[:2]:
                return number
        elif not section and re.match(rf"\s*{re.escape(location[0])}\s*=", line):
            return number
    return found


def settings_to_toml(settings: Settings) -> str:
    """The text of a paxel.toml with every key, one a line, with its unit and choices in a comment."""
    lines = ["# A Paxel installation. Change a value, then run: paxel status", ""]
    for name, field in Settings.model_fields.items():
        section = getattr(settings, name)
        lines += [f"[{name}]  # {(type(section).__doc__ or '').rstrip('.')}"]
        for key, info in type(section).model_fields.items():
            choices = _choices(info.annotation)
            comment = f"{info.description}{'; ' + choices if choices else ''}"
            lines.append(f"{f'{key} = {_toml_value(getattr(section, key))}':<40} # {comment}")
        lines.append("")
        assert field.annotation is type(section)
    return "\n".join(lines)


def _choices(annotation: Any) -> str:
    return " | ".join(str(choice) for choice in get_args(annotation)) if get_origin(annotation) is Literal else ""


def _toml_value(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_toml_value(v) for v in value) + "]"
    return repr(value)
