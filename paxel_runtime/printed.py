"""The pattern of an installation: as it was designed, and as it hangs on the wall by the ruler that was measured on it.

The virtual bench prints the design, with an error of scale of its own, as a printer does. Whoever has to know where a
dot lies on the wall asks `printed_pattern`, the one place where ``measured_ruler_mm`` is read.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.colorants import load_colorants
from paxel_runtime.errors import InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.pattern_json import pattern_from_json_dict
from paxel_runtime.storage import file_sha256, read_image, read_json

__all__ = ["RULER_MM", "load_pattern", "printed_fiducials", "printed_pattern"]

RULER_MM = 100
"""Designed length of both rulers of a print sheet, between the middles of their outer ticks."""


def load_pattern(installation: Installation) -> Pattern:
    """The pattern as it was designed: what the PDF holds.

    Raises
    ------
    InstallationError
        If a file of the print stage is missing, or ``cells.png`` is not the one ``pattern.json`` was written with.
    """
    folder = installation.folder("print")
    description = read_json(folder / "pattern.json")
    if description.get("cells", {}).get("sha256") != file_sha256(folder / "cells.png"):
        raise InstallationError(
            f"{folder / 'cells.png'} is not the one that pattern.json describes; "
            f"run: paxel pattern {installation.path} --force"
        )
    pattern = pattern_from_json_dict(description, read_image(folder / "cells.png"))
    return replace(pattern, library=load_colorants(installation.settings, installation.path))


def printed_pattern(installation: Installation) -> Pattern:
    """The pattern as it hangs: the design at the scale of ``[printer] measured_ruler_mm``.

    Raises
    ------
    InstallationError
        As `load_pattern`.
    """
    x_mm, y_mm = installation.settings.printer.measured_ruler_mm
    return replace(load_pattern(installation), print_scale=(x_mm / RULER_MM, y_mm / RULER_MM))


def printed_fiducials(installation: Installation) -> tuple[dict[int, NDArray[np.float64]], str] | None:
    """Corners of the sheet's markers as they hang, (4, 2) mm in the pattern's frame, and the name of their dictionary.

    None where ``pattern.json`` tells of none.
    """
    described = read_json(installation.folder("print") / "pattern.json").get("pdf", {}).get("fiducials")
    if not described:
        return None
    scale = np.array(installation.settings.printer.measured_ruler_mm) / RULER_MM
    return {m["id"]: np.array(m["corners_mm"]) * scale for m in described["markers"]}, described["dictionary"]
