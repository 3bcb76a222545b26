"""The design side's stages, and the runtime's where they need a sub-gamut made first.

`make_print` and `make_gamut` as they stand behind `paxel pattern` and `paxel gamut`; `make_projection_stage` and
`make_previews` make sure that what they read is there and up to date. Folders and records are the runtime's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from paxel_design.gamut import (
    JointGamut,
    lightness_area,
    sub_gamut,
    subgamut_figures,
    subgamut_mesh,
    write_mesh,
)
from paxel_design.patterns import make_pattern
from paxel_design.printing import print_sheet_text, write_pattern_pdf, write_preview
from paxel_runtime import stages as runtime
from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import DualImage, Effect, Full, Neutralize, parse_effect
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.pattern_json import pattern_to_json_dict
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.storage import file_sha256, load_model, read_json, write_image, write_json, write_npz, write_text

__all__ = [
    "gamut_files",
    "make_gamut",
    "make_gamut_of_model",
    "make_previews",
    "make_print",
    "make_projection_stage",
    "pattern_of",
    "recorded_projections",
]

Progress = Callable[[str, int, int], None]

GAMUT_SUFFIXES = (".ply", ".glb", ".gam")


def pattern_of(installation: Installation) -> Pattern:
    """The pattern that paxel.toml asks for."""
    p = installation.settings.pattern
    return make_pattern(p.layout, p.colorants, p.dot_size_mm, p.angle_deg, p.size_mm)


def make_print(installation: Installation) -> dict[str, Any]:
    """Write the print sheet, its preview and the pattern's description; returns ``pattern.json``."""
    pattern = pattern_of(installation)
    printer = installation.settings.printer
    with installation.writing("print") as folder:
        write_image(folder / "cells.png", pattern.cells)
        write_pattern_pdf(pattern, folder / "pattern.pdf", dpi=printer.dpi, ink_spread_um=printer.ink_spread_um)
        write_preview(pattern, folder / "preview.png")
        write_text(
            folder / "print-sheet.txt",
            print_sheet_text(pattern, dpi=printer.dpi, ink_spread_um=printer.ink_spread_um),
        )
        description = pattern_to_json_dict(pattern, file_sha256(folder / "cells.png"))
        description["pdf_sha256"] = file_sha256(folder / "pattern.pdf")
        write_json(folder / "pattern.json", {**description, "inputs": installation.inputs("print")})
    return read_json(installation.folder("print") / "pattern.json")


# Gamut --------------------------------------------------------------------------------------------------------------


def _wanted_effects(model: PredictionModel, effect: Effect | None, shown_on: str) -> list[tuple[Effect, str]]:
    """Pairs of effect and surface: one effect's, or the default set."""
    if effect is not None:
        if shown_on not in model.surfaces:
            raise InputError(f"--shown-on must be one of {', '.join(model.surfaces)}, got {shown_on!r}")
        return [(effect, s) for s in (model.surfaces if isinstance(effect, DualImage) else (shown_on,))]
    wanted: list[tuple[Effect, str]] = [(Full(), surface) for surface in model.surfaces]
    if model.white is not None:
        wanted += [(DualImage(), "pattern"), (DualImage(), "white"), (Neutralize(), "pattern")]
    return wanted


def gamut_files(installation: Installation, effect: Effect | None, shown_on: str) -> list[str]:
    """Names of the records that `make_gamut` writes for the same arguments."""
    model = load_model(installation.folder("calibration") / "model.json")
    names = [f"{e.name}.on-{surface}.json" for e, surface in _wanted_effects(model, effect, shown_on)]
    return names if effect is not None or model.white is None else ["lightness.json", *names]


def _write_gamuts(
    folder: Path, model: PredictionModel, effect: Effect | None, shown_on: str, inputs: dict[str, Any], report: Progress
) -> dict[str, Any]:
    """Compute and write into `folder`; returns the records by file name."""
    wanted = _wanted_effects(model, effect, shown_on)
    joint = JointGamut(model)
    results: dict[str, Any] = {}
    if effect is None:
        write_npz(folder / "joint.npz", normals=joint.normals, offsets=joint.offsets, white_point=joint.white_point)
        if model.white is not None:
            report("lightness area", 0, len(wanted))
            results["lightness.json"] = {**lightness_area(joint).to_dict(), "inputs": inputs}
            write_json(folder / "lightness.json", results["lightness.json"])
    for k, (one, surface) in enumerate(wanted):
        report(f"{one.name} on {surface}", k, len(wanted))
        gamut = sub_gamut(model, one, surface)
        mesh = subgamut_mesh(gamut)
        stem = f"{one.name}.on-{surface}"
        write_npz(folder / f"{stem}.npz", normals=gamut.normals, offsets=gamut.offsets, white_point=gamut.white_point)
        for suffix in GAMUT_SUFFIXES:
            write_mesh(mesh, folder / f"{stem}{suffix}")
        record = {**subgamut_figures(gamut, mesh), "text": one.text, "inputs": inputs}
        results[f"{stem}.json"] = record
        write_json(folder / f"{stem}.json", record)
    return results


def make_gamut(
    installation: Installation, effect: Effect | None, shown_on: str, report: Progress = lambda *_: None
) -> dict[str, Any]:
    """Write sub-gamuts into ``gamut/``; returns the records by file name.

    Results of an older model that are not asked for now are computed anew too: nothing stale stays beside new ones.
    """
    model = load_model(installation.folder("calibration") / "model.json")
    inputs = installation.inputs("gamut")
    with installation.writing("gamut", keep=True) as folder:
        outdated = [p for p in sorted(folder.glob("*.on-*.json")) if read_json(p).get("inputs") != inputs]
        lightness = folder / "lightness.json"
        refresh_default = lightness.is_file() and read_json(lightness).get("inputs") != inputs
        results = _write_gamuts(folder, model, effect, shown_on, inputs, report)
        for record in outdated:
            if record.name not in results:
                old = read_json(record)
                _write_gamuts(folder, model, parse_effect(old["text"]), old["shown_on"], inputs, report)
        if refresh_default and effect is not None:
            _write_gamuts(folder, model, None, "pattern", inputs, report)
    return results


def make_gamut_of_model(path: Path, effect: Effect | None, shown_on: str, out: Path | None) -> dict[str, Any]:
    """The same for a model file on its own; writes only where `out` names a folder."""
    import tempfile

    model = load_model(path)
    inputs = {"settings": {}, "files": {path.name: file_sha256(path)}}
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        return _write_gamuts(out, model, effect, shown_on, inputs, lambda *_: None)
    with tempfile.TemporaryDirectory() as scratch:
        return _write_gamuts(Path(scratch), model, effect, shown_on, inputs, lambda *_: None)


# Projection and preview ---------------------------------------------------------------------------------------------


def recorded_projections(installation: Installation) -> list[tuple[Effect, dict[str, Path], str, str]]:
    """Every projection there is: effect, pictures, name, surface."""
    records = [read_json(path) for path in sorted(installation.folder("projection").glob("*.json"))]
    return [
        (parse_effect(r["effect"]), {key: Path(p) for key, p in r["pictures"].items()}, r["name"], r["shown_on"])
        for r in records
    ]


def make_projection_stage(
    installation: Installation,
    effect: Effect,
    pictures: Mapping[str, Path],
    *,
    name: str,
    shown_on: str,
    force: bool = False,
    progress: Progress = lambda *_: None,
) -> tuple[dict[str, Any], bool]:
    """Make one projection, its sub-gamut first where that is not up to date; returns the record and whether it is new."""
    gamut_inputs = installation.inputs("gamut")
    records = [installation.folder("gamut") / file for file in gamut_files(installation, effect, shown_on)]
    if not all(path.is_file() and read_json(path).get("inputs") == gamut_inputs for path in records):
        make_gamut(installation, effect, shown_on, progress)
    inputs = runtime.projection_inputs(installation, pictures)
    path = installation.folder("projection") / f"{name}.json"
    if path.is_file() and not force:
        record = read_json(path)
        same = (record.get("inputs"), record.get("effect"), record.get("shown_on")) == (inputs, effect.text, shown_on)
        if same:
            return record, False
    return runtime.project(
        installation, effect, pictures, name=name, shown_on=shown_on, progress=progress
    ), True


def make_previews(
    installation: Installation, names: Iterable[str], force: bool = False, progress: Progress = lambda *_: None
) -> tuple[dict[str, Any], bool]:
    """Preview the named projections (all without names); returns the records and whether any is new.

    Raises
    ------
    InstallationError
        If there is no such projection, or it is out of date.
    """
    have = [record[2] for record in recorded_projections(installation)]
    chosen = list(names) or have
    unknown = [name for name in chosen if name not in have]
    if unknown or not chosen:
        raise InstallationError(
            f"there is no projection {', '.join(unknown) or 'yet'}; there is: {', '.join(have) or 'none'}. "
            f"Make one with: paxel project {installation.path} --effect dual-image --on-pattern A --on-white B"
        )
    installation.require("projection")
    results, todo = {}, []
    for name in chosen:
        path = installation.folder("preview") / f"{name}.json"
        if not force and path.is_file() and read_json(path).get("inputs") == installation.inputs("preview", stem=name):
            results[f"{name}.json"] = read_json(path)
        else:
            todo.append(name)
    if todo:
        progress("set up the virtual bench", 0, len(todo))
        bench = runtime.open_bench(installation)
        for k, name in enumerate(todo):
            progress(f"look at {name}", k, len(todo))
            results[f"{name}.json"] = runtime.preview(installation, name, bench)
    return results, bool(todo)
