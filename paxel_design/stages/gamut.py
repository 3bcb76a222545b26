"""`paxel gamut`: what an installation, or a model on its own, can show; figures, half-spaces and meshes as files."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut import (
    MESH_FORMATS,
    RGB_SPACES,
    GamutMesh,
    JointGamut,
    coverage,
    gamut_mesh,
    hue_change_area,
    hue_figures,
    lightness_area,
    lightness_figures,
    lightness_rectangle,
    mesh_of_arrays,
    rgb_space,
    sampled_figures,
    sampled_gamut,
    subgamut_and_mesh,
    subgamut_arrays,
    subgamut_figures,
    write_mesh,
)
from paxel_design.gamut.primaries import has_primaries, primaries_figures
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import DualImage, Effect, Full, Neutralize, parse_effect
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.printed import load_pattern
from paxel_runtime.storage import file_sha256, load_model, read_json, read_npz, write_atomically, write_json, write_npz

__all__ = ["GamutRequest", "gamut_files", "make_gamut", "make_gamut_of_model"]

Progress = Callable[[str, int, int], None]

METHODS = ("exact", "sampling")


@dataclass(frozen=True)
class GamutRequest:
    """How, and what besides sub-gamuts.

    Attributes
    ----------
    method : str
        ``"exact"``, or ``"sampling"`` for the paper's grid of inputs (figures and cells, no mesh).
    step : float
        Grid of level sets, CIELAB units, 0.5..8.
    further : tuple of Effect
        Also these effects, on the same surface.
    hue_area_deg : float or None
        Also the hue-change area at this angle.
    same_range : bool
        Also the largest lightness rectangle that has one range on both surfaces.
    least_range : (float, float) or None
        Also the largest lightness rectangle whose ranges on the pattern and on the white surface are no shorter, L*.
    beside : tuple of str
        Bodies that each sub-gamut is compared with and that are drawn too: keys of `RGB_SPACES`, or ``.npz`` files of
        other sub-gamuts.
    picture : Path or None
        Also one picture of all sub-gamuts.
    """

    method: str = "exact"
    step: float = 2.0
    further: tuple[Effect, ...] = ()
    hue_area_deg: float | None = None
    same_range: bool = False
    least_range: tuple[float, float] | None = None
    beside: tuple[str, ...] = ()
    picture: Path | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"--method must be one of {', '.join(METHODS)}; got {self.method!r}")
        if not 0.5 <= self.step <= 8:
            raise InputError(f"--step must be 0.5..8 CIELAB units, got {self.step!r}")
        if self.picture is not None and self.picture.suffix != ".png":
            raise InputError(f"--picture must end in .png, got {self.picture.name}")
        if (self.picture is not None or self.beside) and self.method == "sampling":
            raise InputError("--picture and --beside need meshes, and --method sampling makes none; leave it out")
        if self.least_range is not None and not all(0 <= least <= 100 for least in self.least_range):
            raise InputError(f"--least-range must be two numbers 0..100 of L*, got {self.least_range}")
        for name in self.beside:
            if name not in RGB_SPACES and Path(name).suffix != ".npz":
                raise InputError(
                    f"--beside must be one of {', '.join(RGB_SPACES)}, or the .npz of a sub-gamut; got {name!r}"
                )

    @property
    def hue_record(self) -> str:
        """File name of the hue-change area's record."""
        return f"hue-{self.hue_area_deg:g}.json"

    @property
    def conditions(self) -> dict[str, dict[str, Any]]:
        """File names of the records of lightness rectangles under a condition, and the condition."""
        found: dict[str, dict[str, Any]] = {}
        if self.same_range:
            found["lightness-same.json"] = {"same_range": True}
        if self.least_range is not None:
            on_pattern, on_white = self.least_range
            found[f"lightness-{on_pattern:g}_{on_white:g}.json"] = {
                "least_L_pattern": on_pattern,
                "least_L_white": on_white,
            }
        return found


def _wanted_effects(
    model: PredictionModel, effect: Effect | None, shown_on: str, further: tuple[Effect, ...] = ()
) -> list[tuple[Effect, str]]:
    """Pairs of effect and surface: those of the effects given, or the default set."""
    if effect is not None:
        if shown_on not in model.surfaces:
            raise InputError(f"--shown-on must be one of {', '.join(model.surfaces)}, got {shown_on!r}")
        effects = dict.fromkeys((effect, *further))
        return [(one, s) for one in effects for s in (model.surfaces if isinstance(one, DualImage) else (shown_on,))]
    wanted: list[tuple[Effect, str]] = [(Full(), surface) for surface in model.surfaces]
    if model.white is not None:
        wanted += [(DualImage(), "pattern"), (DualImage(), "white"), (Neutralize(), "pattern")]
    return wanted


def gamut_files(
    installation: Installation, effect: Effect | None, shown_on: str, request: GamutRequest | None = None
) -> list[str]:
    """Names of the records that `make_gamut` writes for the same arguments."""
    request = request or GamutRequest()
    model = load_model(installation.folder("calibration") / "model.json")
    suffix = "_sampled" if request.method == "sampling" else ""
    wanted = _wanted_effects(model, effect, shown_on, request.further)
    names = [f"{one.name}{suffix}.on-{surface}.json" for one, surface in wanted]
    if effect is None and model.white is not None:
        names = ["lightness.json", *names]
    if effect is None and has_primaries(model):
        names = ["primaries.json", *names]
    names += request.conditions
    return names if request.hue_area_deg is None else [*names, request.hue_record]


def _write_gamuts(
    folder: Path,
    model: PredictionModel,
    effect: Effect | None,
    shown_on: str,
    inputs: dict[str, Any],
    report: Progress,
    request: GamutRequest,
    shares: NDArray[np.float64],
) -> dict[str, Any]:
    """Compute and write into `folder`; returns the records by file name."""
    wanted = _wanted_effects(model, effect, shown_on, request.further)
    beside = {name: _body_of(name) for name in request.beside}
    joint = JointGamut(model)
    results: dict[str, Any] = {}

    def keep(name: str, record: dict[str, Any]) -> None:
        results[name] = {**record, "inputs": inputs}
        write_json(folder / name, results[name])

    write_npz(folder / "joint.npz", normals=joint.normals, offsets=joint.offsets, white_point=model.white_point)
    if effect is None and model.white is not None:
        report("lightness area", 0, len(wanted))
        keep("lightness.json", _lightness(folder, joint))
    if effect is None and has_primaries(model):
        keep("primaries.json", primaries_figures(model, shares))
    for name, condition in request.conditions.items():
        keep(name, _rectangle(joint, condition))
    meshes: dict[str, GamutMesh] = {}
    for k, (one, surface) in enumerate(wanted):
        report(f"{one.name} on {surface}", k, len(wanted))
        if request.method == "sampling":
            told = partial(report, f"sample {one.name} on {surface}")
            cells = sampled_gamut(joint, one, surface, progress=told)
            write_npz(folder / f"{cells.file_stem}.npz", **subgamut_arrays(cells))
            keep(f"{cells.file_stem}.json", {**sampled_figures(cells), "text": one.text})
            continue
        gamut, mesh = subgamut_and_mesh(joint, one, surface, step=request.step)
        meshes[f"{one.text} on {surface}"] = mesh
        write_npz(folder / f"{gamut.file_stem}.npz", **subgamut_arrays(gamut, mesh))
        for suffix in MESH_FORMATS:
            write_atomically(folder / f"{gamut.file_stem}{suffix}", partial(write_mesh, mesh))
        record = {**subgamut_figures(gamut, mesh), "text": one.text}
        if isinstance(one, Full):
            record["coverage"] = {name: coverage(mesh, name) for name in RGB_SPACES}
        if beside:
            record["beside"] = {
                name: {"volume": body.volume, "covered": coverage(mesh, body), "covers": coverage(body, mesh)}
                for name, body in beside.items()
            }
        keep(f"{gamut.file_stem}.json", record)
    if request.hue_area_deg is not None:
        report("hue-change area", 0, 1)
        keep(request.hue_record, _hue_area(folder, joint, request.hue_area_deg))
    if request.picture is not None:
        report("picture", 0, 1)
        _draw(request.picture, joint, meshes, beside)
    return results


def _lightness(folder: Path, joint: JointGamut) -> dict[str, Any]:
    """The record of the lightness area; its picture and its mesh in the plane (L* on the pattern, L* on white)."""
    from paxel_design.gamut.figures import write_lightness_figure, write_plane  # matplotlib is heavy

    area = lightness_area(joint)
    write_atomically(folder / "lightness.png", lambda to: write_lightness_figure(to, {"": area}))
    write_atomically(folder / "lightness.ply", lambda to: write_plane(to, area.polygon))
    return lightness_figures(area)


def _hue_area(folder: Path, joint: JointGamut, angle_deg: float) -> dict[str, Any]:
    """The record of a hue-change area; its picture and its mesh in the plane (a*, b*)."""
    from paxel_design.gamut.figures import write_hue_figure, write_plane  # matplotlib is heavy

    area = hue_change_area(joint, angle_deg)
    write_atomically(folder / f"hue-{angle_deg:g}.png", lambda to: write_hue_figure(to, {"": area}))
    write_atomically(folder / f"hue-{angle_deg:g}.ply", lambda to: write_plane(to, area.polygon_any))
    return hue_figures(area)


def _rectangle(joint: JointGamut, condition: dict[str, Any]) -> dict[str, Any]:
    on_pattern, on_white = lightness_rectangle(joint, **condition)
    return {"condition": condition, "rectangle": {"L_pattern": list(on_pattern), "L_white": list(on_white)}}


def _body_of(name: str) -> GamutMesh:
    """An RGB space, or the mesh that an ``.npz`` of a sub-gamut holds."""
    return gamut_mesh(rgb_space(name)) if name in RGB_SPACES else mesh_of_arrays(read_npz(Path(name)), name)


def _draw(path: Path, joint: JointGamut, meshes: dict[str, GamutMesh], beside: dict[str, GamutMesh]) -> None:
    """One picture of all bodies; where none is a full gamut, that of the surface stands about them."""
    from paxel_design.gamut.scenes import SceneBody, write_scene  # pyvista is heavy

    surfaces = dict.fromkeys(label.rsplit(" on ", 1)[1] for label in meshes)
    if len(surfaces) == 1 and not beside and not any(label.startswith("full on ") for label in meshes):
        (surface,) = surfaces
        meshes = {f"full on {surface}": subgamut_and_mesh(joint, Full(), surface)[1], **meshes}
    meshes = {**meshes, **{Path(name).stem if name not in RGB_SPACES else name: m for name, m in beside.items()}}
    write_atomically(path, lambda to: write_scene(to, [SceneBody(mesh, label) for label, mesh in meshes.items()]))


def make_gamut(
    installation: Installation,
    effect: Effect | None,
    shown_on: str,
    report: Progress = lambda *_: None,
    request: GamutRequest | None = None,
) -> dict[str, Any]:
    """Write sub-gamuts into ``gamut/``; returns the records by file name.

    Results of an older model that are not asked for now are computed anew too: nothing stale stays beside new ones.
    """
    request = request or GamutRequest()
    model = load_model(installation.folder("calibration") / "model.json")
    inputs = installation.inputs("gamut")
    plain = GamutRequest()
    with installation.writing("gamut", keep=True) as folder:
        records = {path: read_json(path) for path in sorted(folder.glob("*.json"))}
        outdated = {path.name: old for path, old in records.items() if old.get("inputs") != inputs}
        shares = _printed_shares(installation, model)
        results = _write_gamuts(folder, model, effect, shown_on, inputs, report, request, shares)
        for name, old in outdated.items():
            if name in results or not (folder / name).is_file():
                continue
            if "sampled" in old:  # minutes: it is made again when it is asked for again
                for path in (folder / name, (folder / name).with_suffix(".npz")):
                    path.unlink(missing_ok=True)
            elif "angle_deg" in old:
                figures = _hue_area(folder, JointGamut(model), old["angle_deg"])
                write_json(folder / name, {**figures, "inputs": inputs})
            elif "condition" in old:
                _again_or_away(folder / name, JointGamut(model), old["condition"], inputs)
            elif name in ("lightness.json", "primaries.json"):
                _write_gamuts(folder, model, None, "pattern", inputs, report, plain, shares)
            elif read_json(folder / name).get("inputs") != inputs:
                one = parse_effect(old["text"])
                _write_gamuts(folder, model, one, old["shown_on"], inputs, report, plain, shares)
    return results


def _again_or_away(path: Path, joint: JointGamut, condition: dict[str, Any], inputs: dict[str, Any]) -> None:
    """A rectangle under a condition, made anew; the new model may have none."""
    try:
        write_json(path, {**_rectangle(joint, condition), "inputs": inputs})
    except GamutError:
        path.unlink()


def make_gamut_of_model(
    path: Path,
    effect: Effect | None,
    shown_on: str,
    out: Path | None,
    report: Progress = lambda *_: None,
    request: GamutRequest | None = None,
) -> dict[str, Any]:
    """The same for a model file on its own; writes only where `out` names a folder."""
    model = load_model(path)
    request = request or GamutRequest()
    inputs = {"settings": {}, "files": {path.name: file_sha256(path)}}
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        return _write_gamuts(out, model, effect, shown_on, inputs, report, request, _equal_shares(model))
    with tempfile.TemporaryDirectory() as scratch:
        return _write_gamuts(Path(scratch), model, effect, shown_on, inputs, report, request, _equal_shares(model))


def _printed_shares(installation: Installation, model: PredictionModel) -> NDArray[np.float64]:
    """Area shares of the clusters as they were printed, in the model's order; equal ones where names do not tell."""
    if not has_primaries(model):
        return _equal_shares(model)
    pattern = load_pattern(installation)
    by_name = dict(zip(pattern.colorants, pattern.shares(), strict=True))
    if set(model.clusters) != set(by_name):
        return _equal_shares(model)
    return np.array([by_name[name] for name in model.clusters])


def _equal_shares(model: PredictionModel) -> NDArray[np.float64]:
    """Area shares of the clusters of a model on its own, which does not tell them."""
    return np.full(len(model.clusters), 1 / len(model.clusters))
