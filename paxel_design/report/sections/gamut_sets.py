"""Which sets of colours a report shows, and their figures: of the installation's records, or computed now.

Knows the files of ``gamut/`` and what `paxel_design.gamut` computes; nothing of texts, tables or charts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from paxel_design.gamut.comparison import coverage, mesh_of_arrays
from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.meshes import GamutMesh, gamut_mesh, simplified_mesh, subgamut_figures
from paxel_design.gamut.subgamuts import subgamut_and_mesh
from paxel_design.report.content import Quantity
from paxel_design.report.source import ReportSource
from paxel_runtime.errors import GamutError
from paxel_runtime.model.effects import (
    Decolorize,
    DualImage,
    Effect,
    Full,
    FullChange,
    HueShift,
    Neutralize,
    parse_effect,
)
from paxel_runtime.model.subgamut import SubGamut, subgamut_from_arrays
from paxel_runtime.storage import read_npz

__all__ = ["COMPUTED", "DRAWN_DEVIATION", "DRAWN_EDGE", "ColourSet", "Figures", "colour_sets", "figures_of", "share_of"]

COMPUTED = "computed for the report from the model"
"""Source of a figure that no record holds."""

DRAWN_EDGE = 12.0
"""Longest edge of the drawn mesh of an exact polytope, CIELAB; its corners lie on the exact surface."""

DRAWN_DEVIATION = 0.1
"""How far the drawn surface of a level set may lie from the computed one, CIELAB."""

_LEVEL_SET_STEP = 4.0
"""Grid of level sets that no record has, CIELAB: their volumes are right to half a percent, in a third of the time of
`paxel gamut`'s grid."""

_EFFECTS: tuple[Effect, ...] = (
    Full(),
    DualImage(),
    Neutralize(),
    Decolorize(),
    HueShift(45.0),
    HueShift(90.0),
    FullChange(),
)


@dataclass(frozen=True)
class Figures:
    """A record of ``gamut/``, or the same figures computed for the report.

    Attributes
    ----------
    values : mapping
        As the record holds them.
    path : str
        From the installation's folder; empty where they were computed now.
    """

    values: Mapping[str, Any]
    path: str = ""

    def at(self, pointer: str) -> Any:
        """What stands at a JSON pointer without its first slash, such as ``"rectangle/L_white"``."""
        value: Any = self.values
        for key in pointer.split("/"):
            value = value[int(key)] if isinstance(value, list) else value[key]
        return value

    def quantity(self, pointer: str, unit: str = "", digits: int = 3) -> Quantity:
        """What stands at a JSON pointer, with its source."""
        value = self.at(pointer)
        return Quantity(tuple(value) if isinstance(value, list) else value, unit, self._source(pointer), digits)

    def percent(self, pointer: str, digits: int = 3) -> Quantity:
        """A share 0..1 in percent."""
        times = " x 100" if self.path else ""
        return Quantity(100.0 * self.at(pointer), "%", f"{self._source(pointer)}{times}", digits)

    def _source(self, pointer: str) -> str:
        return f"{self.path}#/{pointer}" if self.path else COMPUTED


@dataclass(frozen=True, eq=False)
class ColourSet:
    """The colours of one surface that an effect can use.

    Attributes
    ----------
    effect : Effect
    shown_on : str
    gamut : SubGamut
    drawn : GamutMesh
        For pictures and shares; volumes are in `figures`.
    figures : Figures
        As ``gamut/<effect>.on-<surface>.json``.
    """

    effect: Effect
    shown_on: str
    gamut: SubGamut
    drawn: GamutMesh
    figures: Figures

    @property
    def name(self) -> str:
        """``"full.on-pattern"``."""
        return self.gamut.file_stem


def figures_of(source: ReportSource, path: str, compute: Callable[[], Mapping[str, Any]]) -> Figures:
    """The record `path` where it is up to date, or else what `compute` gives."""
    record = source.records.get(path)
    return Figures(compute()) if record is None else Figures(record, path)


def colour_sets(source: ReportSource, joint: JointGamut) -> tuple[list[ColourSet], dict[str, str]]:
    """The report's sets and any others that the installation has records of, and why some do not exist.

    Parameters
    ----------
    source : ReportSource
    joint : JointGamut
        Of the source's model.

    Returns
    -------
    sets : list of ColourSet
        By effect, the pattern first.
    missing : dict of "effect.on-surface" to str
        Sets without a volume, with the reason.
    """
    surfaces = tuple(joint.model.surfaces)
    wanted = [(effect, surface) for effect in _EFFECTS if effect.surfaces <= len(surfaces) for surface in surfaces]
    for path, record in sorted(source.records.items()):
        if path.startswith("gamut/") and "text" in record and "sampled" not in record:
            effect = parse_effect(record["text"])
            # One channel's monochrome is its full gamut under another name.
            if effect.key != "monochrome" and (effect, record["shown_on"]) not in wanted:
                wanted.append((effect, record["shown_on"]))
    sets, missing = [], {}
    for effect, surface in wanted:
        try:
            sets.append(_colour_set(source, joint, effect, surface))
        except GamutError as error:
            missing[f"{effect.name}.on-{surface}"] = str(error)
    return sets, missing


def _colour_set(source: ReportSource, joint: JointGamut, effect: Effect, surface: str) -> ColourSet:
    path = f"gamut/{effect.name}.on-{surface}.json"
    record = source.records.get(path)
    if record is not None and source.installation is not None:
        arrays = read_npz((source.installation.path / path).with_suffix(".npz"))
        gamut, figures = subgamut_from_arrays(arrays), Figures(record, path)
        exact = None if gamut.field is None else mesh_of_arrays(arrays, path)
    else:
        gamut, exact = subgamut_and_mesh(joint, effect, surface, step=_LEVEL_SET_STEP)
        figures = Figures(subgamut_figures(gamut, exact))
    if gamut.field is None:
        return ColourSet(effect, surface, gamut, gamut_mesh(gamut, DRAWN_EDGE), figures)
    assert exact is not None
    return ColourSet(effect, surface, gamut, simplified_mesh(exact, DRAWN_DEVIATION), figures)


def share_of(one: ColourSet, body: GamutMesh) -> tuple[float, float]:
    """Share (0..1) of a body that a set holds, and share of the set that lies in the body.

    Taken of the drawn mesh, whose volume is right to a part in a thousand.
    """
    held = coverage(one.drawn, body)
    return held, held * body.mesh_volume / one.drawn.mesh_volume
