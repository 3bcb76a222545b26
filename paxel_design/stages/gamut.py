"""`paxel gamut`: what an installation, or a model on its own, can show; figures, half-spaces and meshes as files."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from paxel_design.gamut import (
    MESH_FORMATS,
    JointGamut,
    gamut_mesh,
    lightness_area,
    lightness_figures,
    sub_gamut,
    subgamut_arrays,
    subgamut_figures,
    write_mesh,
)
from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import DualImage, Effect, Full, Neutralize, parse_effect
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.storage import file_sha256, load_model, read_json, write_atomically, write_json, write_npz

__all__ = ["gamut_files", "make_gamut", "make_gamut_of_model"]

Progress = Callable[[str, int, int], None]


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
        write_npz(folder / "joint.npz", normals=joint.normals, offsets=joint.offsets, white_point=model.white_point)
        if model.white is not None:
            report("lightness area", 0, len(wanted))
            results["lightness.json"] = {**lightness_figures(lightness_area(joint)), "inputs": inputs}
            write_json(folder / "lightness.json", results["lightness.json"])
    for k, (one, surface) in enumerate(wanted):
        report(f"{one.name} on {surface}", k, len(wanted))
        gamut = sub_gamut(joint, one, surface)
        mesh = gamut_mesh(gamut)
        write_npz(folder / f"{gamut.file_stem}.npz", **subgamut_arrays(gamut, mesh))
        for suffix in MESH_FORMATS:
            write_atomically(folder / f"{gamut.file_stem}{suffix}", partial(write_mesh, mesh))
        record = {**subgamut_figures(gamut, mesh), "text": one.text, "inputs": inputs}
        results[f"{gamut.file_stem}.json"] = record
        write_json(folder / f"{gamut.file_stem}.json", record)
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
    model = load_model(path)
    inputs = {"settings": {}, "files": {path.name: file_sha256(path)}}
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        return _write_gamuts(out, model, effect, shown_on, inputs, lambda *_: None)
    with tempfile.TemporaryDirectory() as scratch:
        return _write_gamuts(Path(scratch), model, effect, shown_on, inputs, lambda *_: None)
