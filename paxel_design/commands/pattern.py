"""`paxel pattern`: the print sheet, the test sheet, and the library of inks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paxel_design.commands.options import Force, Json, open_installation
from paxel_design.commands.running import run_stage
from paxel_design.console import print_json, print_table, report, say
from paxel_runtime.errors import UsageError

if TYPE_CHECKING:
    from paxel_runtime.model.pattern import Colorant

__all__ = ["pattern"]


def pattern(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    list_colorants: Annotated[
        bool, typer.Option("--list-colorants", help="Tell the inks that pattern.colorants may name; your own with DIR.")
    ] = False,
    test_sheet: Annotated[
        bool, typer.Option("--test-sheet", help="Write a small sheet for measuring ink spread, and a table to fill in.")
    ] = False,
    ink_spread_from: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="Tell the ink spread from the filled-in table of the test sheet."),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make the print sheet: a PDF in true millimetres, a PNG preview and a note for the print shop.

    What is printed stands in paxel.toml under [pattern] and [printer]: layout, colorants, shares, dot size, angle;
    snap = true moves dot size and angle onto the printer's pixels (at most 1 % and 0.5 degrees, told in pattern.json
    and on the sheet); page = "A4" cuts a large sheet into pages that overlap, with a map for gluing.

    When the print is there, measure its two rulers and write the lengths to printer.measured_ruler_mm: everything
    after reckons with them. The print sheet itself stays as it is.

    \b
    Ink spread, once for a printer and a paper:
      paxel pattern my-show --test-sheet      then print it and read its patches
      paxel pattern --ink-spread-from my-show/test-sheet/measurements.csv
    tells what to write to printer.ink_spread_um.
    """
    if sum((list_colorants, test_sheet, ink_spread_from is not None)) > 1:
        raise UsageError("--list-colorants, --test-sheet and --ink-spread-from are different jobs: give one of them")
    if list_colorants:
        _list_colorants(dir, as_json)
        return
    if ink_spread_from is not None:
        _tell_ink_spread(ink_spread_from, as_json)
        return
    if dir is None:
        raise UsageError("give the installation's folder: paxel pattern my-show")
    from paxel_design.stages.print_sheet import make_print, make_test_sheet

    if test_sheet:
        made = make_test_sheet(open_installation(dir), force=force)
        line = f"wrote {made['test_sheet']}; print it at 100 %, and write its readings into {made['measurements']}"
        report(as_json, made, line)
        return
    run_stage(dir, "print", force, as_json, lambda inst, _: make_print(inst), "print/pattern.json")


def _list_colorants(dir: Path | None, as_json: bool) -> None:
    """The library of colorants: the printer's recipe, and XYZ under equal energy with Y = 1 for the paper."""
    from paxel_runtime.model.colorimetry import spectra_to_XYZ
    from paxel_runtime.model.pattern import colorant_library

    library: dict[str, Colorant] = colorant_library()
    if dir is not None:
        from paxel_runtime.colorants import load_colorants

        library = load_colorants(open_installation(dir).settings, dir)
    paper_Y = spectra_to_XYZ(library["white"].reflectance)[1]
    rows: dict[str, Any] = {}
    for name, c in library.items():
        rows[name] = {"cmyk": list(c.cmyk), "XYZ": (spectra_to_XYZ(c.reflectance) / paper_Y).round(4).tolist()}
        if c.spot:
            rows[name]["spot"] = c.spot
        if c.fluorescence is not None:
            rows[name]["fluorescent"] = True
    report(as_json, rows, "colorants (solid on coated paper after FOGRA39; white is the bare paper)")


def _tell_ink_spread(path: Path, as_json: bool) -> None:
    from paxel_design.stages.print_sheet import ink_spread_from

    found = ink_spread_from(path)
    if as_json:
        print_json(found)
        return
    patches = found.pop("patches")
    shares = {
        f"{p['patch']}  {p['colorant']}, {p['dot_mm']:g} mm": f"{p['ink_share']:.3f}  (fit {p['fitted_share']:.3f})"
        for p in patches
    }
    print_table("share of ink that each patch looks like (drawn: 0.5)", shares)
    print_table("", found)
    spread, uncertainty = found["ink_spread_um"], found["ink_spread_uncertainty_um"]
    if spread < 2 * uncertainty:
        say(
            f"edges move by {spread:.1f} um, which is less than twice its uncertainty ({uncertainty:.1f} um): read more"
        )
        say("patches, or leave printer.ink_spread_um at 0")
        return
    say(f"write into paxel.toml, [printer]:  ink_spread_um = {spread:.1f}  (standard uncertainty {uncertainty:.1f})")
