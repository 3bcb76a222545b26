"""`paxel pattern`: the print sheet, its preview, a note for the print shop, and the pattern's description."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from paxel_design.patterns import make_pattern
from paxel_design.printing import print_sheet_text, write_pattern_pdf, write_preview
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.pattern_json import pattern_to_json_dict
from paxel_runtime.storage import file_sha256, write_image, write_json, write_text

__all__ = ["make_print", "pattern_of"]


def pattern_of(installation: Installation) -> Pattern:
    """The pattern that paxel.toml asks for."""
    p = installation.settings.pattern
    return make_pattern(
        p.layout,
        p.colorants,
        p.dot_size_mm,
        p.angle_deg,
        p.size_mm,
        p.seed,
        shares=p.shares or None,
        blue_noise=p.blue_noise,
        flatness=p.flatness,
        tile_order=p.tile_order,
    )


def make_print(installation: Installation) -> dict[str, Any]:
    """Write the print sheet, its preview and the pattern's description; returns ``pattern.json``."""
    pattern = pattern_of(installation)
    printer = installation.settings.printer
    how: dict[str, Any] = {"dpi": printer.dpi, "ink_spread_um": printer.ink_spread_um}
    with installation.writing("print") as folder:
        write_image(folder / "cells.png", pattern.cells)
        figures = write_pattern_pdf(pattern, folder / "pattern.pdf", **how)
        write_preview(pattern, folder / "preview.png", **how)
        write_text(folder / "print-sheet.txt", print_sheet_text(pattern, **how))
        record = {
            **pattern_to_json_dict(pattern, file_sha256(folder / "cells.png")),
            "pdf": asdict(figures),
            "inputs": installation.inputs("print"),
        }
        write_json(folder / "pattern.json", record)
    return record
