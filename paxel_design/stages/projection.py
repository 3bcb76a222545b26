"""`paxel project` and `paxel preview`: what they read is made first where it is out of date."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from paxel_design.stages.gamut import gamut_files, make_gamut
from paxel_runtime import stages as runtime
from paxel_runtime.errors import InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import Effect, parse_effect, require_projectable
from paxel_runtime.storage import read_json

__all__ = ["make_previews", "make_projection_stage", "recorded_projections"]

Progress = Callable[[str, int, int], None]


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
    """Make one projection, its sub-gamut first where that is out of date; returns the record and whether it is new."""
    require_projectable(effect)
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
    return runtime.project(installation, effect, pictures, name=name, shown_on=shown_on, progress=progress), True


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
