"""`paxel project` and `paxel preview`: what they read is made first where it is out of date."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from paxel_design.gamut import JointGamut, sub_gamut
from paxel_design.stages.gamut import gamut_files, make_gamut
from paxel_runtime import stages as runtime
from paxel_runtime.assembly import AssemblyOptions
from paxel_runtime.errors import InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import Effect, parse_effect
from paxel_runtime.pictures import Frame, place_picture, read_picture
from paxel_runtime.projection import make_projection, picture_surfaces, require_surfaces
from paxel_runtime.storage import file_sha256, load_model, read_image, read_json

__all__ = [
    "RecordedProjection",
    "make_previews",
    "make_projection_of_model",
    "make_projection_stage",
    "recorded_projections",
]

Progress = Callable[[str, int, int], None]


class RecordedProjection(NamedTuple):
    """What a projection was made of, and what was asked of it; empty methods follow the settings."""

    effect: Effect
    pictures: dict[str, Path]
    name: str
    shown_on: str
    mapping: str = ""
    assembly: str = ""


def recorded_projections(installation: Installation) -> list[RecordedProjection]:
    """Every projection there is."""
    records = [read_json(path) for path in sorted(installation.folder("projection").glob("*.json"))]
    return [
        RecordedProjection(
            parse_effect(r["effect"]),
            {key: Path(p) for key, p in r["pictures"].items()},
            r["name"],
            r["shown_on"],
            **r.get("asked", {}),
        )
        for r in records
    ]


def make_projection_stage(
    installation: Installation,
    effect: Effect,
    pictures: Mapping[str, Path],
    *,
    name: str,
    shown_on: str,
    mapping: str = "",
    assembly: str = "",
    force: bool = False,
    progress: Progress = lambda *_: None,
) -> tuple[dict[str, Any], bool]:
    """Make one projection, its sub-gamut first where that is out of date; returns the record and whether it is new."""
    inputs = runtime.projection_inputs(installation, pictures)
    require_surfaces(effect, shown_on, load_model(installation.folder("calibration") / "model.json"))
    _make_gamut_if_stale(installation, effect if effect.in_sub_gamut else None, shown_on, progress)
    path = installation.folder("projection") / f"{name}.json"
    if path.is_file() and not force:
        record = read_json(path)
        asked = {"mapping": mapping, "assembly": assembly}
        then = [record.get(key) for key in ("inputs", "effect", "shown_on", "asked")]
        if then == [inputs, effect.text, shown_on, asked]:
            return record, False
    record = runtime.project(
        installation,
        effect,
        pictures,
        name=name,
        shown_on=shown_on,
        mapping=mapping,
        assembly=assembly,
        progress=progress,
    )
    return record, True


def _make_gamut_if_stale(installation: Installation, effect: Effect | None, shown_on: str, progress: Progress) -> None:
    """The sub-gamut of an effect and the joint gamut, where they are not of today's model."""
    folder, inputs = installation.folder("gamut"), installation.inputs("gamut")
    records = [folder / file for file in gamut_files(installation, effect, shown_on)]
    fresh = all(path.is_file() and read_json(path).get("inputs") == inputs for path in records)
    if not (fresh and (folder / "joint.npz").is_file()):
        make_gamut(installation, effect, shown_on, progress)


def make_projection_of_model(
    model_path: Path,
    clusters_path: Path,
    effect: Effect,
    pictures: Mapping[str, Path],
    *,
    name: str,
    shown_on: str,
    assembly: str = "",
    bits: int = 8,
    out: Path | None = None,
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """Make one projection from a model and labels on their own; writes only where `out` names a folder.

    Parameters
    ----------
    model_path : Path
        A model.json.
    clusters_path : Path
        A clusters.png: its size is that of the projection image.
    effect : Effect
    pictures : dict of picture name -> path
    name : str
        Of the files.
    shown_on : "pattern" | "white"
    assembly : str
        A key of `METHODS`; dither if empty, as dot size and viewing distance are not known.
    bits : int
        Bits of a device code, 8 to 16.
    out : Path, optional

    Returns
    -------
    dict
        The record.
    """
    model, labels = load_model(model_path), read_image(clusters_path)
    require_surfaces(effect, shown_on, model)
    files = {"model": model_path, "clusters": clusters_path, **{f"picture {key}": p for key, p in pictures.items()}}
    joint = JointGamut(model)
    surfaces = picture_surfaces(effect, shown_on) if effect.in_sub_gamut else {}
    progress("sub-gamut", 0, 1)
    sub_gamuts = {surface: sub_gamut(joint, effect, surface) for surface in surfaces.values()}
    frame = Frame(labels.shape[1], labels.shape[0])
    sources = {key: read_picture(path, (frame.width, frame.height)) for key, path in pictures.items()}
    projection = make_projection(
        effect,
        {key: place_picture(source, frame) for key, source in sources.items()},
        sub_gamuts,
        model,
        labels,
        pairs=joint.pairs if model.white is not None else None,
        shown_on=shown_on,
        bits=bits,
        assembly=AssemblyOptions(method=assembly or "dither"),
        progress=lambda done, total: progress("solve", done, total),
    )
    record = {
        "name": name,
        "effect": effect.text,
        "shown_on": shown_on,
        "pictures": {key: str(path) for key, path in pictures.items()},
        "colours": {key: source.description for key, source in sources.items()},
        **projection.figures,
        "inputs": {"settings": {}, "files": {key: file_sha256(path) for key, path in files.items()}},
    }
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        runtime.write_projection(out, name, projection, bits, record)
    return record


def make_previews(
    installation: Installation,
    names: Iterable[str],
    force: bool = False,
    progress: Progress = lambda *_: None,
    looks: Iterable[runtime.Look] = (),
    plant: bool = False,
) -> tuple[dict[str, Any], bool]:
    """Preview the named projections (all without names); returns the records and whether any is new.

    Parameters
    ----------
    installation : Installation
    names : iterable of str
    force : bool
        Anew although nothing changed.
    progress : callable
    looks : iterable of Look
        Ways to look besides the usual one: other distances, a sheet held before the wall, a print that moved.
    plant : bool
        Measure ghosts by a planted mark.

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
    usual = runtime.usual_look(installation)
    settings = installation.settings
    mm_per_px = settings.projector.width_mm / settings.projector.resolution[0]
    wanted = dict.fromkeys([usual, *looks])
    by_bench: dict[str, list[runtime.Look]] = {}
    for look in wanted:  # the bench as it stands comes first
        by_bench.setdefault(repr(look.bench_changes(mm_per_px)), []).append(look)
    results = {f"{name}.json": runtime.fresh_preview(installation, name) for name in chosen}
    fresh = False
    for group in by_bench.values():
        todo = {name: _missing(results[f"{name}.json"], group, usual, force, plant) for name in chosen}
        todo = {name: missing for name, missing in todo.items() if missing}
        if not todo:
            continue
        progress("set up the virtual bench", 0, len(todo))
        bench = runtime.open_bench(installation, **group[0].bench_changes(mm_per_px))
        for k, (name, missing) in enumerate(todo.items()):
            progress(f"look at {name}", k, len(todo))
            results[f"{name}.json"] = runtime.preview(installation, name, bench, missing, plant)
            fresh = True
    return {name: record for name, record in results.items() if record is not None}, fresh


def _missing(
    record: Mapping[str, Any] | None, looks: Iterable[runtime.Look], usual: runtime.Look, force: bool, plant: bool
) -> list[runtime.Look]:
    """The looks of these that a record does not tell of; those without a planted mark where one is wanted."""
    if record is None or force:
        return list(looks)
    missing = []
    for look in looks:
        seen = record if look == usual else record.get("views", {}).get(look.tag(usual.distance_mm))
        if seen is None or (plant and not seen.get("planted_mark")):
            missing.append(look)
    return missing
