"""`paxel pattern`: the print sheet, its preview, a note for the print shop, and the pattern's description; and the test
sheet for ink spread, which has a folder of its own.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from paxel_design.patterns import layout_recipe, make_pattern
from paxel_design.patterns.snapping import Snapped, check_dots, snap_to_printer
from paxel_design.printing import print_sheet_text, write_pattern_pdf, write_preview
from paxel_design.printing.ink_spread import fit_ink_spread, parse_readings
from paxel_design.printing.test_sheet import measurements_table, write_test_sheet
from paxel_design.visibility import beats, layout_spectrum, pattern_visibility, worst_moire
from paxel_design.visibility.moire import Partition
from paxel_runtime.colorants import load_colorants
from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.pattern_json import pattern_to_json_dict
from paxel_runtime.settings import Settings
from paxel_runtime.storage import file_sha256, write_image, write_json, write_text

__all__ = ["Design", "design_of", "ink_spread_from", "make_print", "make_test_sheet", "visibility_of"]

_ZOOMS = (0.99, 1.0, 1.01)
"""Of the projector, which nobody sets to a percent: the worst of these is told."""

_PIECE_PX = 160


@dataclass(frozen=True, eq=False)
class Design:
    """What an installation's paxel.toml asks to be printed.

    Attributes
    ----------
    pattern : Pattern
    recipe : dict
        What makes its cells again, see `paxel_design.patterns.layout_recipe`.
    snapped : Snapped, optional
        The move onto the printer's grid; None where it was not asked for.
    """

    pattern: Pattern
    recipe: dict[str, Any]
    snapped: Snapped | None


def design_of(installation: Installation) -> Design:
    """The pattern that paxel.toml asks for.

    Raises
    ------
    InputError
        If there is no such pattern, or the printer cannot print it: what would work.
    """
    p, dpi = installation.settings.pattern, installation.settings.printer.dpi
    check_dots(p.dot_size_mm, dpi)
    snapped = snap_to_printer(p.dot_size_mm, p.angle_deg, dpi) if p.snap else None
    pattern = make_pattern(
        p.layout,
        p.colorants,
        snapped.dot_size_mm if snapped else p.dot_size_mm,
        snapped.angle_deg if snapped else p.angle_deg,
        p.size_mm,
        p.seed,
        shares=p.shares or None,
        blue_noise=p.blue_noise,
        flatness=p.flatness,
        tile_order=p.tile_order,
        library=load_colorants(installation.settings, installation.path),
    )
    return Design(pattern, layout_recipe(pattern, p.shares or None, p.blue_noise, p.flatness), snapped)


def make_print(installation: Installation) -> dict[str, Any]:
    """Write the print sheet, its preview and the pattern's description; returns ``pattern.json``."""
    design, printer = design_of(installation), installation.settings.printer
    pattern = design.pattern
    how: dict[str, Any] = {
        "dpi": printer.dpi,
        "ink_spread_um": printer.ink_spread_um,
        "recipe": design.recipe,
    }
    with installation.writing("print") as folder:
        write_image(folder / "cells.png", pattern.cells)
        figures = write_pattern_pdf(pattern, folder / "pattern.pdf", **how, page=printer.page)
        write_preview(pattern, folder / "preview.png", **how)
        write_text(folder / "print-sheet.txt", print_sheet_text(pattern, **how, page=printer.page))
        record = {
            **pattern_to_json_dict(pattern, file_sha256(folder / "cells.png"), design.recipe),
            "snap": {"dpi": printer.dpi, **asdict(design.snapped)} if design.snapped else None,
            "pdf": asdict(figures),
            "inputs": installation.inputs("print"),
        }
        write_json(folder / "pattern.json", record)
        write_json(folder / "visibility.json", visibility_of(pattern, installation.settings))
    return record


def visibility_of(pattern: Pattern, settings: Settings) -> dict[str, Any]:
    """How visible a print is to the viewer of paxel.toml, and how it beats with the projector: ``visibility.json``.

    What was looked at stands in it: projector and viewer may change without making the print stale.
    """
    viewing, projector = settings.viewing, settings.projector
    pitch_mm = projector.width_mm / projector.resolution[0]
    partition: Partition = "light" if settings.clusters.method == "design" else "lab"
    K = min(settings.clusters.count, len(pattern.colorants) + 1)
    spectrum = layout_spectrum(pattern)
    strongest = worst_moire(
        pattern,
        [pitch_mm * zoom for zoom in _ZOOMS],
        viewing.distance_mm,
        K=K,
        partition=partition,
        luminance_cd_m2=viewing.luminance_cd_m2,
        phases=1,
        size_px=_PIECE_PX,
    )
    return {
        "distance_mm": viewing.distance_mm,
        "luminance_cd_m2": viewing.luminance_cd_m2,
        "pixel_pitch_mm": pitch_mm,
        "unit": "thresholds of contrast: 1 is just seen, 10 is plain",
        "print": asdict(pattern_visibility(spectrum, viewing.distance_mm, viewing.luminance_cd_m2)),
        "moire": {
            "clusters": K,
            "partition": partition,
            "pitches_mm": [pitch_mm * zoom for zoom in _ZOOMS],
            **{key: None if value == float("inf") else value for key, value in asdict(strongest).items()},
        },
        "beats": [asdict(beat) for beat in beats(pattern, pitch_mm)],
    }


def make_test_sheet(installation: Installation, *, force: bool = False) -> dict[str, Any]:
    """Write ``test-sheet/``: the test sheet of the pattern's inks, and the table for its readings.

    Raises
    ------
    InputError
        If no ink can be measured, or the table there holds readings already and `force` is not set.
    """
    design, printer = design_of(installation), installation.settings.printer
    table_path = installation.folder("test-sheet") / "measurements.csv"
    with installation.writing("test-sheet") as folder:
        patches = write_test_sheet(
            design.pattern.palette,
            folder / "test-sheet.pdf",
            dpi=printer.dpi,
            angle_deg=design.pattern.angle_deg,
            page=printer.page,
        )
        table = measurements_table(patches)
        if table_path.is_file() and table_path.read_text(encoding="utf-8") != table and not force:
            raise InputError(
                f"{table_path} is filled in, and a new test sheet would replace it: move it away, or give --force"
            )
        write_text(folder / "measurements.csv", table)
    return {
        "test_sheet": str(installation.folder("test-sheet") / "test-sheet.pdf"),
        "measurements": str(table_path),
        "patches": len(patches),
        "dot_sizes_mm": sorted({patch.dot_mm for patch in patches if patch.dot_mm}),
    }


def ink_spread_from(path: Path) -> dict[str, Any]:
    """What the readings of a test sheet say, and the key of paxel.toml to set.

    Raises
    ------
    InputError
        If the file is missing, or its readings make no ink spread.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"--ink-spread-from: {path} cannot be read as text ({error})") from None
    found = asdict(fit_ink_spread(parse_readings(text, path.name)))
    names = ("patch", "colorant", "dot_mm", "ink_share", "fitted_share")
    patches = [dict(zip(names, patch, strict=True)) for patch in found.pop("patches")]
    return {**found, "set": f"printer.ink_spread_um = {max(0.0, found['ink_spread_um']):.1f}", "patches": patches}
