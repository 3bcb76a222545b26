"""`paxel gamut --model`: what it writes and tells, and one clear error for each model that makes no sense."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.storage import model_to_dict, write_json

run = CliRunner()


def _gamut(*words: object) -> tuple[int, str, str]:
    result = run.invoke(app, ["gamut", *(str(word) for word in words)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, " ".join(result.stderr.split())


@pytest.fixture
def data(bw_model: Callable[[int], PredictionModel]) -> dict[str, Any]:
    """What a model.json of a b/w print with two clusters holds."""
    return json.loads(json.dumps(model_to_dict(bw_model(2))))


def _without_column(data: dict[str, Any]) -> None:
    for surface in data["surfaces"].values():
        for row in surface["A"]:
            row[4] = 0.0


def _swapped(data: dict[str, Any]) -> None:
    data["surfaces"] = {"pattern": data["surfaces"]["white"], "white": data["surfaces"]["pattern"]}


def _nan(data: dict[str, Any]) -> None:
    data["surfaces"]["pattern"]["A"][1][2] = float("nan")


def _too_narrow(data: dict[str, Any]) -> None:
    for row in data["surfaces"]["white"]["A"]:
        row.pop()


def _no_white_point(data: dict[str, Any]) -> None:
    data["white_point_XYZ"] = [0.95, 1.0]


def _gray_only(data: dict[str, Any]) -> None:
    """Two clusters under one channel, of one colour: the pattern shows a line."""
    data["channels"] = ["white"]
    data["response"] = {"white": data["response"]["red"]}
    for surface in data["surfaces"].values():
        surface["A"] = [[0.1 * Y, 0.4 * Y] for Y in data["white_point_XYZ"]]


@pytest.mark.parametrize(
    ("spoil", "exit_code", "message"),
    [
        (_without_column, 2, r"no column of zeros, got one at input 4 (channel green on cluster white)"),
        (_swapped, 2, "the white surface must not be darker than the pattern"),
        (_nan, 2, "surfaces.pattern: A must be finite numbers in shape (3, 6), got numbers that are not finite"),
        (_too_narrow, 2, "surfaces.white: A must be finite numbers in shape (3, 6), got shape (3, 5)"),
        (_no_white_point, 2, "white_point_XYZ must be finite numbers in shape (3,)"),
        (_gray_only, 1, "no mesh"),
    ],
)
def test_a_model_that_makes_no_sense_gets_one_error_and_no_file(
    data: dict[str, Any], spoil: Callable[[dict[str, Any]], None], exit_code: int, message: str, tmp_path: Path
) -> None:
    spoil(data)
    (tmp_path / "model.json").write_text(json.dumps(data))
    code, out, err = _gamut("--model", tmp_path / "model.json", "--effect", "full")
    assert (code, out) == (exit_code, "")
    assert message in err
    assert "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--effect", "fulll"], "effect must be one of full, hue-shift"),
        (["--angle", "45"], "--angle belongs to one effect: give --effect too"),
        (["--effect", "hue-shift", "--effect", "full", "--angle", "45"], "as hue-shift:45"),
        (["--effect", "hue-shift:175"], "170"),
        (["--effect", "full", "--shown-on", "wall"], "--shown-on must be one of pattern, white"),
        (["--effect", "full", "--step", "0.1"], "--step must be 0.5..8"),
        (["--effect", "full", "--least-range", "20", "-1"], "--least-range must be two numbers 0..100"),
        (["--effect", "full", "--beside", "adobe"], "--beside must be one of srgb, dci-p3, rec2020, or the .npz"),
        (["--effect", "full", "--picture", "a.jpg"], "--picture must end in .png"),
        (["--effect", "full", "--method", "guess"], "--method must be one of exact, sampling"),
    ],
)
def test_options_that_make_no_sense_are_told(
    data: dict[str, Any], words: list[str], message: str, tmp_path: Path
) -> None:
    write_json(tmp_path / "model.json", data)
    code, out, err = _gamut("--model", tmp_path / "model.json", *words)
    assert (code, out) == (2, "")
    assert message in err


def test_lightness_is_told_with_a_picture_and_a_mesh_in_the_plane(data: dict[str, Any], tmp_path: Path) -> None:
    white = data["surfaces"]["white"]
    # A gray sheet that reflects half: with it both surfaces have a range in common.
    white["A"], white["black"] = (0.5 * np.array(white["A"])).tolist(), (0.5 * np.array(white["black"])).tolist()
    write_json(tmp_path / "gray.json", data)
    words = ("--same-range", "--least-range", 20, 10, "--hue-area", 180, "--out", tmp_path / "g", "--json")
    code, out, err = _gamut("--model", tmp_path / "gray.json", *words)
    assert code == 0, err
    result = json.loads(out)
    lightness, same, least = (result[f"lightness{name}.json"] for name in ("", "-same", "-20_10"))
    assert lightness["same_range_by_sheet"]["white"] is None
    # 1e-9: the same search on the same polygon, scaled there and back.
    assert lightness["same_range_by_sheet"]["gray 0.5"] == pytest.approx(lightness["same_range"], abs=1e-9)
    assert same["rectangle"]["L_pattern"] == same["rectangle"]["L_white"] == lightness["same_range"]
    assert least["rectangle"]["L_pattern"][1] - least["rectangle"]["L_pattern"][0] >= 20 - 1e-6
    for name, area in (("lightness", lightness["area"]), ("hue-180", result["hue-180.json"]["area_any"])):
        flat = trimesh.load(tmp_path / "g" / f"{name}.ply")
        assert flat.area == pytest.approx(area, rel=1e-6), "nine digits in the file"
        with Image.open(tmp_path / "g" / f"{name}.png") as picture:
            assert len(np.unique(np.asarray(picture.convert("L")))) > 20, "something is drawn"


def test_beside_a_white_sheet_no_range_is_the_same_and_that_is_told(data: dict[str, Any], tmp_path: Path) -> None:
    write_json(tmp_path / "model.json", data)
    code, _, err = _gamut("--model", tmp_path / "model.json", "--effect", "full", "--same-range")
    assert code == 1
    assert "use a gray sheet" in err


def test_several_effects_stand_beside_other_bodies(data: dict[str, Any], tmp_path: Path) -> None:
    write_json(tmp_path / "model.json", data)
    model = ("--model", tmp_path / "model.json")
    assert _gamut(*model, "--effect", "full", "--out", tmp_path / "g")[0] == 0
    other = tmp_path / "g" / "full.on-pattern.npz"
    effects = ("--effect", "neutralize", "--effect", "decolorize:relative")
    code, out, err = _gamut(*model, *effects, "--beside", other, "--beside", "srgb", "--json")
    assert code == 0, err
    result = json.loads(out)
    assert set(result) == {"neutralize-50_0_0.on-pattern.json", "decolorize-relative.on-pattern.json"}
    for record in result.values():
        beside = record["beside"][str(other)]
        # 1 %: flat triangles of 4 units cut off the full gamut's bulges.
        assert beside["covers"] == pytest.approx(1, abs=0.01)
        assert beside["covered"] == pytest.approx(record["volume"] / beside["volume"], rel=0.02)
        assert 0 < record["beside"]["srgb"]["covered"] < 1
    code, _, err = _gamut(*model, "--effect", "full", "--beside", tmp_path / "g" / "joint.npz")
    assert code == 2
    assert "must hold the mesh of a sub-gamut" in err


def test_one_channel_on_three_inks_is_told_which_ink_limits_white(data: dict[str, Any], tmp_path: Path) -> None:
    data["channels"], data["clusters"] = ["uv"], ["uv-red", "uv-green", "uv-blue"]
    data["response"] = {"uv": data["response"]["red"]}
    del data["surfaces"]["white"]
    A = [[0.22, 0.2, 0.18], [0.12, 0.62, 0.1], [0.01, 0.12, 0.95]]
    data["surfaces"]["pattern"] = {**data["surfaces"]["pattern"], "A": A}
    write_json(tmp_path / "model.json", data)
    exit_code, stdout, stderr = _gamut("--model", tmp_path / "model.json", "--out", tmp_path / "out", "--json")
    assert exit_code == 0
    record = json.loads((tmp_path / "out" / "primaries.json").read_text())
    assert json.loads(stdout)["primaries.json"].items() <= record.items()
    assert set(record["shares"].values()) == {1 / 3}, "a model on its own does not tell shares"
    assert record["whites"]["D65"]["limiting"] == "uv-red"
    assert "limited by uv-red; printed with area shares uv-red" in stderr
