"""What several commands take: their options, and text turned into settings, effects and pictures."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paxel_runtime.errors import InputError, UsageError

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation

__all__ = [
    "EFFECT_OPTIONS",
    "Angle",
    "Dir",
    "EffectOption",
    "EffectsOption",
    "Force",
    "Json",
    "LabOption",
    "Lightness",
    "LightnessBand",
    "Preset",
    "Scale",
    "Set",
    "ShownOn",
    "Strength",
    "Tolerance",
    "effect_of",
    "open_installation",
    "overrides_of",
    "pictures_of",
]

EFFECT_OPTIONS = {
    "angle": "angle_deg",
    "lab": "Lab",
    "lightness": "lightness",
    "lightness_band": "lightness_band",
    "scale": "scale",
    "strength": "strength",
    "tolerance": "tolerance",
}
"""Options of the command line that set a field of an effect."""

Dir = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the installation.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object on standard output.")]
Force = Annotated[bool, typer.Option("--force", help="Make it anew although nothing changed.")]


def _option(help: str, *names: str, metavar: str | None = None) -> Any:
    return typer.Option(*names, help=help, metavar=metavar, show_default=False)


_EFFECTS = (
    "full, hue-shift, chroma, decolorize, neutralize, full-change, dual-image, watermark or monochrome; settings may "
    "follow, as hue-shift:45 or dual-image:volume."
)
EffectOption = Annotated[str, _option(_EFFECTS, "--effect")]
EffectsOption = Annotated[list[str] | None, _option(f"Only this effect: {_EFFECTS} Repeat for several.", "--effect")]
ShownOn = Annotated[str, typer.Option(help="Surface of the picture: pattern or white.")]
Angle = Annotated[float | None, _option("Turn of hue of hue-shift, degrees, -170 to 170 (45).")]
Scale = Annotated[float | None, _option("What chroma multiplies chroma by (0.5).")]
Lightness = Annotated[str | None, _option("Of decolorize's grays: free, relative or same (free).")]
LightnessBand = Annotated[
    float | None, _option("Of hue-shift and chroma: largest difference of L* between the surfaces (free).")
]
LabOption = Annotated[
    tuple[float, float, float] | None, _option("Uniform colour of neutralize (50 0 0).", "--lab", metavar="L A B")
]
Tolerance = Annotated[float | None, _option("Of neutralize, and of decolorize with lightness free, dE00 (0 = exact).")]
Strength = Annotated[float | None, _option("Of watermark: what the mark's L*, less its mean, is multiplied by (0.1).")]
Preset = Annotated[
    str, typer.Option(help="Whole installation to start from: bw-checkerboard, bw-blue-noise, cmyrgb, rgb, uv-rgb.")
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Any key of paxel.toml, such as pattern.dot_size_mm=0.5; repeat."),
]


def overrides_of(pairs: list[str] | None) -> dict[str, Any]:
    """``["pattern.dot_size_mm=0.5"]`` as ``{"pattern.dot_size_mm": 0.5}``; a bare word is a string."""
    overrides = {}
    for pair in pairs or []:
        key, equals, text = pair.partition("=")
        if not equals:
            raise UsageError(f"--set must be KEY=VALUE, such as pattern.dot_size_mm=0.5; got {pair!r}")
        try:
            overrides[key.strip()] = tomllib.loads(f"v = {text}")["v"]
        except tomllib.TOMLDecodeError:
            overrides[key.strip()] = text.strip()  # a bare word is a string
    return overrides


def effect_of(text: str, lab: tuple[float, float, float] | None, **given: float | str | None) -> Any:
    """The effect that ``--effect`` names, with what ``--lab`` and other options say.

    Parameters
    ----------
    text : str
        Such as ``hue-shift`` or ``hue-shift:45``.
    lab : (L, a, b) or None
        Of ``--lab``.
    **given
        Further options of `EFFECT_OPTIONS` by name, None where not given.

    Raises
    ------
    UsageError
        If an option belongs to another effect.
    """
    from dataclasses import replace

    from paxel_runtime.model.effects import EFFECTS, parse_effect

    effect = parse_effect(text)
    for option, value in {"lab": lab, **given}.items():
        if value is None:
            continue
        field, flag = EFFECT_OPTIONS[option], f"--{option.replace('_', '-')}"
        if not hasattr(effect, field):
            owners = ", ".join(key for key, row in EFFECTS.items() if field in getattr(row, "__dataclass_fields__", ()))
            raise UsageError(f"{flag} belongs to --effect {owners}, got --effect {text}")
        effect = replace(effect, **{field: value})  # type: ignore[type-var]  # every row of the table is a dataclass
    return effect


def pictures_of(effect: Any, given: dict[str, Path | None]) -> dict[str, Path]:
    """The pictures given, if they are the ones that the effect needs."""
    pictures = {name: path for name, path in given.items() if path is not None}
    flags = {name: f"--{name.replace('_', '-')}" for name in {*given, *effect.pictures}}
    if set(pictures) != set(effect.pictures):
        wanted = " and ".join(flags[name] for name in effect.pictures)
        found = ", ".join(flags[name] for name in pictures) or "none"
        raise InputError(f"--effect {effect.key} needs {wanted}; got {found}")
    return pictures


def open_installation(dir: Path) -> Installation:
    """The installation in a folder."""
    from paxel_runtime.installation import Installation

    return Installation.open(dir)
