"""The stage behind `paxel preview`: looks at a projection on the surfaces of the bench, writes ``preview/``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.errors import InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.observer import (
    EXPOSURES,
    Viewer,
    change_figures,
    codes_to_Y,
    eye_blur,
    fall_off,
    ghost_L,
    inner_mask,
    judge_view,
    leak_figures,
    leveled,
    minimum_distance_mm,
    picture_to_Lab,
    view_figures,
    view_to_Lab,
    view_to_sRGB,
)
from paxel_runtime.projection import picture_surfaces
from paxel_runtime.stages.looks import LOOK_TAGS, Look, usual_look
from paxel_runtime.stages.planted import codes_with_mark
from paxel_runtime.stages.projected import Projected, load_projected, other_surface
from paxel_runtime.stages.wall import Wall
from paxel_runtime.storage import read_json, write_image, write_json

__all__ = ["fresh_preview", "preview"]


def fresh_preview(installation: Installation, name: str) -> dict[str, Any] | None:
    """The record of a projection's preview, if it is there and up to date."""
    path = installation.folder("preview") / f"{name}.json"
    if not path.is_file():
        return None
    record = read_json(path)
    return record if record.get("inputs") == installation.inputs("preview", stem=name) else None


def preview(
    installation: Installation, name: str, bench: VirtualBench, looks: Sequence[Look] = (), plant: bool = False
) -> dict[str, Any]:
    """Look at one projection on the surfaces of the virtual bench; writes ``preview/`` and returns the record.

    Parameters
    ----------
    installation : Installation
    name : str
        Of the projection.
    bench : VirtualBench
        As it stands for these looks (`Look.bench_changes`).
    looks : sequence of Look
        The usual one by default. It makes the record anew; others are added to a record that is up to date, or follow
        the usual one.
    plant : bool
        Measure ghosts by a mark that is planted in the other picture: the projection is made once more for each
        picture.

    Returns
    -------
    dict
        Figures of the usual look as ``on_pattern`` and ``on_white``, of others under ``views`` by their tag.

    Raises
    ------
    InstallationError
        If the usual look is not among `looks` and there is no record that is up to date.
    """
    projected = load_projected(installation, name)
    usual = usual_look(installation)
    looks = tuple(looks) or (usual,)
    record = fresh_preview(installation, name)
    if record is None and usual not in looks:
        raise InstallationError(f"the preview of {name} is out of date; run: paxel preview {installation.path}")
    kept = dict((record or {}).get("views", {}))
    wall = Wall(bench, projected, installation)
    with installation.writing("preview", keep=True) as folder:
        if record is None:
            _remove_pictures(folder, name)
        for look in sorted(looks, key=lambda look: look != usual):
            marked = _marked_codes(installation, projected, look, wall.mm_per_px) if plant else {}
            seen = _look(folder, projected, wall, look, look.tag(usual.distance_mm), marked)
            seen |= {"planted_mark": True} if plant else {}
            if look == usual:
                record = {
                    "name": name,
                    "effect": projected.record["effect"],
                    "seen_on": f"virtual bench, {installation.settings.bench.quality}",
                    **seen,
                }
            else:
                kept[look.tag(usual.distance_mm)] = seen
        assert record is not None  # the usual look comes first
        views = {"views": dict(sorted(kept.items()))} if kept else {}
        inputs = {"inputs": installation.inputs("preview", stem=name)}
        result = {k: v for k, v in record.items() if k not in ("writer", "views", "inputs")} | views | inputs
        write_json(folder / f"{name}.json", result)
    return read_json(installation.folder("preview") / f"{name}.json")


def _marked_codes(
    installation: Installation, projected: Projected, look: Look, mm_per_px: float
) -> dict[str, NDArray[np.unsignedinteger]]:
    """The projection with a mark in the other picture, by the surface on which that might be seen."""
    record, marked = projected.record, {}
    for picture, surface in picture_surfaces(parse_effect(record["effect"]), record["shown_on"]).items():
        other = other_surface(surface)
        if projected.ghosts and other in projected.mapped and other in look.surfaces:
            px_per_degree = Viewer(look.distance_mm, mm_per_px).px_per_degree
            marked[other] = codes_with_mark(installation, record, picture, px_per_degree)
    return marked


def _look(
    folder: Path,
    projected: Projected,
    wall: Wall,
    look: Look,
    tag: str,
    marked: Mapping[str, NDArray[np.unsignedinteger]],
) -> dict[str, Any]:
    """Pictures into the folder, and the figures of one look."""
    viewer = Viewer(look.distance_mm, wall.mm_per_px)
    white, sigma_px = projected.model.white_point, viewer.sigma_px
    surfaces = [s for s in look.surfaces if s in projected.model.surfaces]
    stem = f"{projected.name}.{tag}" if tag else projected.name
    figures: dict[str, Any] = {key: value for key, value in asdict(look).items() if value}  # what is unusual about it
    seen, targets = {}, {s: picture_to_Lab(Lab, white, sigma_px) for s, Lab in projected.mapped.items()}
    for surface in surfaces:
        blurred = eye_blur(wall.view(surface), sigma_px)
        for exposure, suffix in EXPOSURES.items():
            picture = view_to_sRGB(blurred, exposure, white, mask=projected.inside)
            write_image(folder / f"{stem}.on-{surface}{suffix}.png", picture)
        share = fall_off(wall.reference(surface), white, sigma_px)
        level = leveled(wall.view(surface), share)
        seen[surface] = view_to_Lab(level, white, sigma_px)
        if surface not in projected.mapped:
            continue
        inner = inner_mask(projected.mask(surface), sigma_px)
        other, source = other_surface(surface), projected.sources.get(surface)
        own = view_figures(
            seen[surface],
            targets[surface],
            targets[other] if projected.other(surface) is not None else None,
            None if source is None else picture_to_Lab(source, white, sigma_px),
            inner,
            viewer,
            wall.window_px,
        )
        own["minimum_distance_mm"] = minimum_distance_mm(
            level[..., 1], _luminance(projected.mapped[surface]), inner, wall.mm_per_px, wall.window_px
        )
        if surface in marked:
            Lab_marked = view_to_Lab(leveled(wall.light(marked[surface], surface), share), white, sigma_px)
            own["ghost_L"] = ghost_L(seen[surface][..., 0], Lab_marked[..., 0], inner, viewer.px_per_degree)
        figures[f"on_{surface}"] = own | {"verdict": judge_view(own, look.distance_mm)}
    if len(seen) == 2 and not projected.ghosts:
        figures["change"] = _change(projected, seen, sigma_px)
    if not tag:
        figures["projection_image"] = _leak(projected, targets, sigma_px, wall.window_px)
    return figures


def _luminance(Lab: NDArray[np.float32]) -> NDArray[np.floating]:
    """Y = 1 for white, of L* alone."""
    gray = np.zeros((*Lab.shape[:2], 3), np.float32)
    gray[..., 0] = Lab[..., 0]
    return Lab_to_XYZ(gray, np.ones(3))[..., 1]


def _change(projected: Projected, seen: Mapping[str, NDArray[np.float32]], sigma_px: float) -> dict[str, float | None]:
    """What the effect did between the surface that shows its picture and the other."""
    shown = projected.record["shown_on"]
    inner = inner_mask(projected.mask(shown), sigma_px)
    return change_figures(seen[shown], seen[other_surface(shown)], inner)


def _leak(
    projected: Projected,
    targets: Mapping[str, NDArray[np.float32]],
    sigma_px: float,
    window_px: float,
) -> dict[str, Any]:
    """What each surface's picture leaks to someone who sees only the projection image."""
    Y = codes_to_Y(projected.codes, projected.bits)
    L = {surface: Lab[..., 0] for surface, Lab in targets.items()}
    leaks = {}
    for surface in L:
        other = L.get(other_surface(surface)) if projected.ghosts else None
        inner = inner_mask(projected.mask(surface), sigma_px)
        leaks[f"on_{surface}"] = leak_figures(Y, L[surface], other, inner, sigma_px, window_px)
    return leaks


def _remove_pictures(folder: Path, name: str) -> None:
    """Pictures of looks that the record no longer tells of."""
    for path in folder.glob("*.png"):
        rest = path.name.removeprefix(f"{name}.")
        if rest != path.name and rest.startswith(("on-", *LOOK_TAGS)):
            path.unlink()
