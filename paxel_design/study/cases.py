"""What a study asks for: every combination of layout, angle, dot size and number of clusters, as settings.

Knows settings and their defaults; no files, no bench, no processes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from math import inf
from typing import Any

from paxel_runtime.errors import SettingsError, UsageError
from paxel_runtime.settings import PRESETS, Settings, make_settings

__all__ = ["DOT_SIZES_MM", "PITCH_MM", "Case", "Study", "cases_of", "settings_of"]

DOT_SIZES_MM = (0.5, 0.75, 1.0)
"""Those of the paper (Section VI-B)."""

_MORE_CLUSTERS = (0, 1, 3)
"""Clusters beyond the colorants, of a print of two inks: K = 2, 3 and 5, as in Fig. 13."""

PITCH_MM = 281.0 / 1920.0
"""Width of a projector pixel on the wall: the default projection's."""

_FRAME_PX = (480, 270)
_MARGIN_MM = 10.0
"""Of the print beyond the projection, both sides together."""

_CAMERA_PX = 32 / 15
"""Width of the camera's picture in pixels for one of the projector: what `paxel demo` has."""

_VARIED = {
    "pattern.layout": "--layout",
    "pattern.angle_deg": "--angle",
    "pattern.dot_size_mm": "--dot-size",
    "clusters.count": "--clusters",
}
"""Keys that a study varies, and the option of the command line that does."""


@dataclass(frozen=True)
class Case:
    """One print with one number of clusters.

    Attributes
    ----------
    layout : str
    angle_deg : float
    dot_size_mm : float
    clusters : int
        K.
    """

    layout: str
    angle_deg: float
    dot_size_mm: float
    clusters: int

    @property
    def print_name(self) -> str:
        """What is printed, as a file name."""
        return f"{self.layout}-{self.dot_size_mm:.10g}mm-{self.angle_deg:.10g}deg"

    @property
    def name(self) -> str:
        """The case, as a file name."""
        return f"{self.print_name}-K{self.clusters}"


@dataclass(frozen=True)
class Study:
    """What is varied, and what all cases have in common.

    Attributes
    ----------
    dot_sizes_mm, layouts, angles_deg, clusters : tuples
        Every combination is a case. Empty ones: the paper's dot sizes; the preset's layout and angle; K = 2, 3 and 5
        for two colorants, else as many as there are colorants.
    preset : str
        A key of `PRESETS`.
    pitch_mm : float
        Width of a projector pixel on the wall.
    overrides : dict of key -> value
        Further keys of paxel.toml. Without them the study looks at a frame of 480 x 270 pixels: figures are those of
        the meter's spot, which a larger frame does not change.
    ghosting : bool
        Also project two photographs at once and measure what is seen of each in the other.
    """

    dot_sizes_mm: tuple[float, ...] = ()
    layouts: tuple[str, ...] = ()
    angles_deg: tuple[float, ...] = ()
    clusters: tuple[int, ...] = ()
    preset: str = "bw-checkerboard"
    pitch_mm: float = PITCH_MM
    overrides: Mapping[str, Any] = field(default_factory=dict)
    ghosting: bool = True


def cases_of(study: Study) -> dict[Case, Settings]:
    """Every case of a study with its settings, those of one print one after the other.

    Raises
    ------
    UsageError
        If `overrides` set what the study varies or derives, or a pixel has no width.
    SettingsError
        If a case breaks a rule: which, and the rule.
    """
    for key, flag in _VARIED.items():
        if key in study.overrides:
            raise UsageError(f"--set {key} is what a study varies; use {flag}, as often as you like")
    if "projector.width_mm" in study.overrides:
        raise UsageError(
            "--set projector.width_mm: a study looks at a part of the projection; tell the width of a pixel instead, "
            "--pitch, in mm: the projection's width over its pixels across"
        )
    if not 0 < study.pitch_mm < inf:
        raise UsageError(f"--pitch must be > 0 mm, got {study.pitch_mm:g}")
    base = make_settings(study.preset, _common(study))
    inks = len(base.pattern.colorants)
    counts = study.clusters or (tuple(inks + more for more in _MORE_CLUSTERS) if inks == 2 else (inks,))
    grid = product(
        study.layouts or (base.pattern.layout,),
        study.angles_deg or (base.pattern.angle_deg,),
        study.dot_sizes_mm or DOT_SIZES_MM,
        sorted(counts),
    )
    return {case: settings_of(study, case) for case in dict.fromkeys(Case(*combination) for combination in grid)}


def settings_of(study: Study, case: Case) -> Settings:
    """The settings of one case.

    Raises
    ------
    SettingsError
        If they break a rule.
    """
    varied = {
        "pattern.layout": case.layout,
        "pattern.angle_deg": case.angle_deg,
        "pattern.dot_size_mm": case.dot_size_mm,
        "clusters.count": case.clusters,
    }
    try:
        return make_settings(study.preset, {**_common(study), **varied})
    except SettingsError as error:
        raise SettingsError(str(error).replace("--set", case.name)) from None


def _common(study: Study) -> dict[str, Any]:
    """Keys that all cases share: a small frame, a print and a camera that fit it, and what the study asks for.

    K is the number of colorants, until a case says otherwise.
    """
    wanted = {"projector.resolution": list(_FRAME_PX), **study.overrides}
    try:
        columns, rows = (int(length) for length in wanted["projector.resolution"])
    except (TypeError, ValueError):
        columns, rows = _FRAME_PX  # the rule that it breaks is told when the settings are made
    size_mm = [columns * study.pitch_mm, rows * study.pitch_mm]
    width_px = round(columns * _CAMERA_PX)
    derived = {
        "projector.width_mm": size_mm[0],
        "pattern.size_mm": [length + _MARGIN_MM for length in size_mm],
        "camera.resolution": [width_px, round(width_px * 3 / 4)],
    }
    inks = {**PRESETS.get(study.preset, {}), **wanted}.get("pattern.colorants", ("black", "white"))
    return {**derived, **wanted, "clusters.count": len(inks)}
