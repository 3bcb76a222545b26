"""`paxel preview` on a small wall whose model is read off the bench itself: what it writes, and what it finds."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_design.stages.print_sheet import make_print
from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.frame_files import write_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import Effect
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.observer import Viewer, planted_mark
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import Look, fresh_preview, looks_of, open_bench, preview, usual_look
from paxel_runtime.stages.projected import load_projected
from paxel_runtime.storage import file_sha256, model_to_dict, read_image, read_json, write_image, write_json, write_npz

W, H = 240, 135
SETTINGS = {
    "projector.resolution": [W, H],
    "projector.width_mm": 35.1,
    "pattern.size_mm": [50.0, 40.0],
    "camera.resolution": [320, 240],
    "meter.aperture_mm": 10.0,
    "clusters.count": 2,
    "bench.quality": "ideal",
    "viewing.distance_mm": 4000.0,
}
ModelOf = Callable[[Installation, NDArray[np.uint8]], PredictionModel]


def _blobs(seed: int, low: float, high: float) -> NDArray[np.float64]:
    picture = gaussian_filter(np.random.default_rng(seed).normal(size=(H, W)), 14, mode="wrap")
    return low + (high - low) * (picture - picture.min()) / np.ptp(picture)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, model_off_the_bench: ModelOf) -> Installation:
    """A finished installation with the projection ``pair``; nobody changes it."""
    installation = Installation.create(
        tmp_path_factory.mktemp("views") / "show", make_settings("bw-checkerboard", SETTINGS)
    )
    make_print(installation)
    bench = open_bench(installation)
    labels = (bench.truth.coverage()[..., 0] < 0.5).astype(np.uint8)
    model = model_off_the_bench(installation, labels)
    code = np.arange(256) / 255
    x = np.stack([_blobs(0, 0.05, 0.4), _blobs(1, 0.1, 0.6)], axis=-1).repeat(3, axis=-1)
    own = np.where(labels[..., None] == 0, x[..., :3], x[..., 3:])
    codes = np.stack([np.rint(255 * np.interp(own[..., j], model.response.linear[j], code)) for j in range(3)], -1)
    Lab = dict(zip(("pattern", "white"), model.predict(x), strict=True))
    for name in ("captures", "calibration", "gamut", "projection"):
        installation.folder(name).mkdir()
    write_json(installation.folder("calibration") / "model.json", model_to_dict(model))
    write_image(installation.folder("calibration") / "clusters.png", labels)
    write_json(installation.folder("captures") / "complete.json", {})
    for stage, file in (("captures", "exposures.json"), ("calibration", "calibration.json"), ("gamut", "full.json")):
        write_json(installation.folder(stage) / file, {"inputs": installation.inputs(stage)})
    _write_projection(installation, "pair", codes.astype(np.uint8), Lab, "dual-image")
    return installation


@pytest.fixture
def show(made: Installation, tmp_path: Path) -> Installation:
    """A copy to work on."""
    shutil.copytree(made.path, tmp_path / "show")
    return Installation.open(tmp_path / "show")


def _write_projection(
    installation: Installation, name: str, codes: NDArray[np.uint8], Lab: dict[str, NDArray[Any]], effect: str
) -> None:
    folder = installation.folder("projection")
    pictures = {}
    for surface in Lab:
        key = f"on_{surface}" if effect == "dual-image" else "image"
        pictures[key] = folder.parent / f"{name}-{surface}.png"
        gray = np.rint(2.55 * np.clip(3 * (Lab[surface][..., 0] - 20), 0, 100)).astype(np.uint8)
        write_image(pictures[key], gray[..., None].repeat(3, axis=2))
    inputs = installation.inputs("projection", extra_files={f"picture {key}": p for key, p in pictures.items()})
    write_frame(folder / f"{name}.png", codes, 8)
    write_npz(folder / f"{name}.npz", **{f"Lab_{s}": np.asarray(v, np.float32) for s, v in Lab.items()})
    files = {key: str(p) for key, p in pictures.items()}
    record = {"name": name, "effect": effect, "shown_on": "pattern", "pictures": files, "inputs": inputs}
    write_json(folder / f"{name}.json", record)


def _arrays(installation: Installation) -> tuple[NDArray[np.uint8], dict[str, NDArray[Any]]]:
    folder = installation.folder("projection")
    with np.load(folder / "pair.npz") as file:
        return read_image(folder / "pair.png"), {s: file[f"Lab_{s}"] for s in ("pattern", "white")}


def test_the_usual_look_finds_what_was_projected(show: Installation) -> None:
    record = preview(show, "pair", open_bench(show))
    assert read_json(show.folder("preview") / "pair.json")["on_white"] == record["on_white"]
    assert fresh_preview(show, "pair") is not None
    assert "virtual bench, ideal" in record["seen_on"]
    for surface in ("pattern", "white"):
        for suffix in ("", ".auto"):
            assert read_image(show.folder("preview") / f"pair.on-{surface}{suffix}.png").shape == (H, W, 3)
        figures = record[f"on_{surface}"]
        # The ideal bench is linear; what is left is Eq. 6 itself, whose clusters' shares vary from place to place.
        assert figures["dE00_mean"] < 1.0
        assert figures["ghosting_percent"] < 2.0
        assert figures["coherent_gain"] == pytest.approx(1, abs=0.15)
        assert figures["source_dE00_mean"] > 5
        assert figures["verdict"] in ("good", "usable", "weak")
        assert 1500 < figures["minimum_distance_mm"] < 4000  # dots of 0.75 mm: about 2.7 m (design, section 10)
    assert {s.stage.name: s.state for s in show.status()}["preview"] == "done"


@pytest.mark.parametrize("percent", [3.0, -5.0])
def test_a_ghost_in_the_target_is_the_ghost_in_the_view(show: Installation, percent: float) -> None:
    """The target lacks a share of the other picture that the view then has too much."""
    bench = open_bench(show)
    clean = preview(show, "pair", bench)
    codes, Lab = _arrays(show)
    ghostly = Lab["pattern"].copy()
    ghostly[..., 0] -= percent / 100 * (Lab["white"][..., 0] - Lab["white"][..., 0].mean())
    _write_projection(show, "pair", codes, {"pattern": ghostly, "white": Lab["white"]}, "dual-image")
    assert fresh_preview(show, "pair") is None
    found = preview(show, "pair", bench)
    before = clean["on_pattern"]["ghosting_percent"]
    # 0.3: the eye averages light, not L*; the clean view's own ghost has an unknown sign
    assert found["on_pattern"]["ghosting_percent"] == pytest.approx(abs(percent), abs=before + 0.3)


def test_other_looks_are_added_and_the_usual_one_is_kept(show: Installation) -> None:
    usual = usual_look(show)
    base = preview(show, "pair", open_bench(show), [Look(2700.0), usual])
    assert set(base["views"]) == {"at-2700mm"}
    assert base["views"]["at-2700mm"]["on_white"]["texture_L"] > base["on_white"]["texture_L"]  # nearer: more dots
    held = Look(usual.distance_mm, 20.0, 10.0)
    mm_per_px = SETTINGS["projector.width_mm"] / W
    record = preview(show, "pair", open_bench(show, **held.bench_changes(mm_per_px)), [held])
    assert record["on_white"] == base["on_white"]
    assert set(record["views"]) == {"at-2700mm", "sheet-20mm.tilt-10deg"}
    sheet = record["views"]["sheet-20mm.tilt-10deg"]
    assert "on_pattern" not in sheet
    assert sheet["on_white"]["dE00_mean"] > base["on_white"]["dE00_mean"]  # out of focus, and elsewhere
    assert sheet["on_white"]["dE00_mean"] < 5  # but levelled by its own fall-off, the picture is there
    shifted = [Look(usual.distance_mm, print_shift_px=px) for px in (0.5, 1.5)]
    ghosts = [base["on_pattern"]["ghosting_percent"]]
    for look in shifted:
        bench = open_bench(show, **look.bench_changes(mm_per_px))
        record = preview(show, "pair", bench, [look])
        ghosts.append(record["views"][look.tag(usual.distance_mm)]["on_pattern"]["ghosting_percent"])
    assert ghosts[2] > ghosts[1] > ghosts[0] - 1
    assert ghosts[2] > 10  # 1.5 px of a dot of 5: a third of its pixels light the wrong ink
    names = {path.name for path in show.folder("preview").iterdir()}
    assert {"pair.at-2700mm.on-pattern.auto.png", "pair.sheet-20mm.tilt-10deg.on-white.png"} <= names
    assert "pair.shift-1.5px.on-white.png" not in names
    # A projection made anew: pictures of looks that were not repeated go
    codes, Lab = _arrays(show)
    _write_projection(show, "pair", codes // 2, Lab, "dual-image")
    with pytest.raises(InstallationError, match="out of date"):
        preview(show, "pair", open_bench(show), [Look(2700.0)])
    assert {path.name for path in show.folder("preview").iterdir()} == names
    preview(show, "pair", open_bench(show))
    assert len(list(show.folder("preview").glob("*.png"))) == 4


def test_one_surface_is_compared_with_itself_at_full(show: Installation, model_off_the_bench: ModelOf) -> None:
    path = show.folder("calibration") / "model.json"
    both = model_off_the_bench(show, read_image(show.folder("calibration") / "clusters.png"))
    codes, _ = _arrays(show)
    alone = replace(both.alone("pattern"), white_point=both.pattern.predict_XYZ(np.ones(6)))
    # Scaled as a calibration without a white sheet does: Y = 1 for all clusters at full on the print
    unit = alone.white_point[1]
    alone = replace(
        alone, pattern=SurfaceModel(alone.pattern.A / unit, np.zeros(3)), white_point=alone.white_point / unit
    )
    write_json(path, model_to_dict(alone))
    write_json(show.folder("calibration") / "calibration.json", {"inputs": show.inputs("calibration")})
    x = np.stack([_blobs(0, 0.05, 0.4), _blobs(1, 0.1, 0.6)], axis=-1).repeat(3, axis=-1)
    _write_projection(show, "pair", codes, {"pattern": alone.predict(x)[0]}, "full")
    record = preview(show, "pair", open_bench(show))
    assert "on_white" not in record
    assert record["on_pattern"]["dE00_mean"] < 1.5  # as above, and full light varies a little from dot to dot
    assert record["on_pattern"]["ghosting_percent"] is None
    assert record["projection_image"]["on_pattern"]["blurred"] is not None
    assert not list(show.folder("preview").glob("*on-white*"))


def test_a_source_that_is_gone_or_changed_costs_only_its_figures(show: Installation) -> None:
    bench = open_bench(show)
    path = show.folder("projection") / "pair.json"
    record = read_json(path)
    record["pictures"] = {key: str(show.path / Path(picture).name) for key, picture in record["pictures"].items()}
    write_json(path, record)
    assert preview(show, "pair", bench)["on_pattern"]["source_dE00_mean"] > 5
    (show.path / "pair-pattern.png").unlink()
    write_image(show.path / "pair-white.png", np.zeros((20, 30, 3), np.uint8))
    record = preview(show, "pair", bench)
    for surface in ("on_pattern", "on_white"):
        assert record[surface]["source_dE00_mean"] is None
        assert record[surface]["dE00_mean"] < 1.0


def test_effects_with_one_picture_have_no_other_that_ghosts(show: Installation) -> None:
    folder = show.folder("projection")
    record = read_json(folder / "pair.json")
    record |= {"effect": "hue-shift:45", "pictures": {"image": record["pictures"]["on_pattern"]}}
    write_json(folder / "pair.json", record)
    result = preview(show, "pair", open_bench(show))
    assert result["on_pattern"]["ghosting_percent"] is None
    assert set(result["change"]) == {"hue_pixels", "hue_turn_deg", "hue_turn_sd_deg", "chroma_ratio"}


@pytest.fixture
def run() -> Callable[..., Any]:
    """The command line."""

    def invoke(*words: str, code: int = 0) -> Any:
        result = CliRunner().invoke(app, list(words))
        assert result.exit_code == code, result.output
        return result

    return invoke


def test_the_command_makes_what_is_missing_and_says_what_it_means(show: Installation, run: Callable[..., Any]) -> None:
    told = run("preview", str(show.path), "--distance", "2000")
    assert "on the pattern from 4 m" in told.stderr
    assert "too close" in told.stderr
    assert "whoever has only the projection image" in told.stderr
    before = {p: p.stat().st_mtime_ns for p in show.folder("preview").iterdir()}
    again = run("preview", str(show.path), "--distance", "2000", "--json")
    assert "up to date" in again.stderr
    assert {p: p.stat().st_mtime_ns for p in show.folder("preview").iterdir()} == before
    assert json.loads(again.stdout) == read_json(show.folder("preview") / "pair.json")
    held = json.loads(run("preview", str(show.path), "--sheet-distance", "20", "--sheet-tilt", "10", "--json").stdout)
    assert set(held["views"]) == {"at-2000mm", "sheet-20mm.tilt-10deg"}
    assert "must be > 0 mm" in run("preview", str(show.path), "--distance", "-3", code=2).stderr
    assert (
        "sheet_distance_mm must be 0 to 50" in run("preview", str(show.path), "--sheet-distance", "70", code=2).stderr
    )
    assert fresh_preview(show, "pair") == held
    assert "no projection evening" in run("preview", str(show.path), "--name", "evening", code=1).stderr


def test_looks_that_are_asked_for(made: Installation) -> None:
    assert looks_of(made) == [Look(4000.0)]
    assert looks_of(made, (2700.0, 8000.0)) == [Look(2700.0), Look(8000.0)]
    held = looks_of(made, (2700.0,), 20.0, 10.0, (0.3,))
    assert held == [Look(2700.0, print_shift_px=0.3), Look(2700.0, 20.0, 10.0)]
    assert [look.tag(4000.0) for look in held] == ["at-2700mm.shift-0.3px", "at-2700mm.sheet-20mm.tilt-10deg"]
    assert held[1].bench_changes(0.1) == {"sheet_distance_mm": 20.0, "sheet_tilt_deg": (0.0, 10.0)}
    assert held[0].bench_changes(0.1) == {"print_offset_mm": (pytest.approx(0.03), 0.0)}
    with pytest.raises(InputError, match="--distance"):
        Look(float("nan"))
    assert file_sha256(made.folder("projection") / "pair.png")


@pytest.mark.parametrize("leak", [0, 12])
def test_a_planted_mark_is_found_where_it_leaks(show: Installation, monkeypatch: pytest.MonkeyPatch, leak: int) -> None:
    """The projection with a mark is made by a stand-in, so that what leaks into the other picture is known."""
    codes, _ = _arrays(show)
    marked_pictures = []

    def project(beside: Installation, effect: Effect, pictures: dict[str, Path], *, name: str, **options: str) -> None:
        assert beside.path != show.path
        assert (beside.folder("calibration") / "model.json").is_file()
        assert not beside.folder("preview").exists()
        (key,) = [key for key, path in pictures.items() if path.parent == beside.path]
        marked_pictures.append((key, read_image(pictures[key])))
        beside.folder("projection").mkdir()
        disc = planted_mark((H, W), Viewer(4000.0, 35.1 / W).px_per_degree)
        write_frame(beside.folder("projection") / f"{name}.png", codes + np.uint8(leak) * disc[..., None], 8)

    monkeypatch.setattr("paxel_runtime.stages.planted.project", project)
    record = preview(show, "pair", open_bench(show), plant=True)
    for surface in ("on_pattern", "on_white"):
        if leak:
            assert record[surface]["ghost_L"] > 0.5  # 12 codes of 255 at a third of full light: about 2 L*
        else:
            assert record[surface]["ghost_L"] == 0
    assert [key for key, _ in marked_pictures] == ["on_pattern", "on_white"]
    original = read_image(show.path / "pair-pattern.png").astype(int)
    changed = np.any(marked_pictures[0][1] != original, axis=-1)
    # The frame is half a degree wide: one disc of 0.4 degree and the rims of others.
    assert 0.1 < changed.mean() < 0.9
    assert record["planted_mark"]


def test_a_letterbox_does_not_count(show: Installation) -> None:
    path = show.folder("projection") / "pair.json"
    record = read_json(path)
    tall = show.path / "tall.png"
    write_image(tall, np.full((60, 40, 3), 90, np.uint8))
    record["pictures"]["on_white"] = str(tall)
    record["inputs"]["files"]["picture on_white"] = file_sha256(tall)
    write_json(path, record)
    mapping = show.settings.mapping.model_copy(update={"placement": "fit"})
    fitted = Installation(show.path, show.settings.model_copy(update={"mapping": mapping}))
    projected = load_projected(fitted, "pair")
    assert projected.mask("white").mean() == pytest.approx(40 / 60 * H / W, abs=0.01)
    assert projected.mask("pattern").mean() == pytest.approx(1, abs=0.01)  # a picture as wide as the frame
    assert projected.sources["white"][projected.shown["white"]][:, 0].min() > 20
