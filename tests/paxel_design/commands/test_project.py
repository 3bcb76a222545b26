"""`paxel project`: with a model on its own; mistakes are answered before anything is read or written."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.storage import model_to_dict, read_npz, write_image, write_json

run = CliRunner()


ALONE = ("--model", "m.json", "--clusters", "c.png")


def _paxel(*words: object) -> tuple[int, str, str]:
    result = run.invoke(app, ["project", *(str(word) for word in words)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def files(tmp_path: Path, bw_model: Callable[[int], PredictionModel]) -> dict[str, Path]:
    """A model, labels of 48 x 27 pixels and two pictures."""
    write_json(tmp_path / "model.json", model_to_dict(bw_model(2)))
    labels = (np.indices((27, 48)).sum(axis=0) % 2).astype(np.uint8)
    labels[:, :3] = 255
    write_image(tmp_path / "clusters.png", labels)
    rng = np.random.default_rng(0)
    for name in ("a.png", "b.png"):
        Image.fromarray(rng.integers(0, 256, (9, 16, 3), dtype=np.uint8)).save(tmp_path / name)
    return {name: tmp_path / name for name in ("model.json", "clusters.png", "a.png", "b.png")}


def test_a_model_and_labels_are_enough(files: dict[str, Path], tmp_path: Path) -> None:
    words = ["--model", files["model.json"], "--clusters", files["clusters.png"], "--effect", "watermark"]
    words += ["--strength", 0.05, "--image", files["a.png"], "--mark", files["b.png"]]
    before = {p.name for p in tmp_path.iterdir()}
    code, out, err = _paxel(*words, "--json")
    assert code == 0, err
    assert "nothing was written" in err
    assert {p.name for p in tmp_path.iterdir()} == before
    record = json.loads(out)
    assert record["effect"] == "watermark:0.05"
    assert record["pixels_in_gamut"] == 1.0
    assert record["colours"]["mark"] == "16 x 9 of 8 bits, sRGB, assumed: the file has no profile"
    assert record["assembly"]["method"] == "dither"

    code, _, err = _paxel(*words, "--out", tmp_path / "frames", "--name", "cat", "--bits", 10)
    assert code == 0, err
    assert {p.name for p in (tmp_path / "frames").iterdir()} == {"cat.png", "cat.json", "cat.npz"}
    targets = read_npz(tmp_path / "frames" / "cat.npz")
    assert targets["Lab_white"].shape == (27, 48, 3)
    header = (tmp_path / "frames" / "cat.png").read_bytes()[16:26]
    assert (int.from_bytes(header[:4], "big"), int.from_bytes(header[4:8], "big")) == (48, 27), "native pixels"
    assert header[8] == 16, "10 bits are written with 16"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "give a folder, or --model FILE and --clusters FILE"),
        (["show", "--model", "m.json"], "give a folder, or --model FILE and --clusters FILE"),
        (["--model", "m.json"], "give a folder, or --model FILE and --clusters FILE"),
        (["show", "--out", "frames"], "--out and --bits go with --model"),
        (["show", "--angle", "30"], "--angle belongs to an effect"),
        (["show", "--mark", "a.png"], "--mark belongs to an effect"),
        ([*ALONE, "--effect", "watermark", "--image", "a.png"], "needs --image and --mark; got --image"),
        (
            [*ALONE, "--effect", "full", "--image", "a.png", "--strength", "0.1"],
            "--strength belongs to --effect watermark",
        ),
        ([*ALONE, "--effect", "hue-shift", "--angle", "0", "--image", "a.png"], "must not be 0"),
        ([*ALONE, "--effect", "sepia", "--image", "a.png"], "effect must be one of full, hue-shift"),
    ],
)
def test_a_mistake_says_what_to_write(words: list[str], message: str, tmp_path: Path) -> None:
    words = [str(tmp_path / word) if word == "show" else word for word in words]
    code, out, err = _paxel(*words)
    assert code == 2
    assert message in " ".join(err.split())
    assert not out
    assert not list(tmp_path.iterdir())


def test_a_picture_that_is_not_there(files: dict[str, Path]) -> None:
    words = ["--model", files["model.json"], "--clusters", files["clusters.png"], "--effect", "full"]
    code, _, err = _paxel(*words, "--image", "none.jpg")
    assert code == 2
    assert "none.jpg" in err


def test_what_one_surface_cannot_do(
    files: dict[str, Path], bw_model: Callable[[int], PredictionModel], tmp_path: Path
) -> None:
    write_json(files["model.json"], model_to_dict(bw_model(2).alone("pattern")))
    words = ["--model", files["model.json"], "--clusters", files["clusters.png"], "--image", files["a.png"]]
    code, _, err = _paxel(*words, "--effect", "hue-shift")
    assert code == 2
    assert "enough for: full, monochrome" in " ".join(err.split())
    code, out, err = _paxel(*words, "--effect", "monochrome", "--out", tmp_path / "frames", "--json")
    assert code == 0, err
    assert json.loads(out)["pixels_in_gamut"] == 1.0
