"""Files come back as they were written, are written whole or not at all, and a bad model is answered with its key."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.model.correction import Correction, Term
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.storage import (
    load_model,
    model_from_dict,
    model_to_dict,
    read_json,
    read_npz,
    read_tiff,
    write_atomically,
    write_json,
    write_npz,
    write_tiff,
)


def a_model(K: int = 2, N: int = 3, surfaces: int = 2, seed: int = 0) -> PredictionModel:
    rng = np.random.default_rng(seed)
    code = np.linspace(0, 1, 33)
    return PredictionModel(
        channels=tuple(f"channel{j}" for j in range(N)),
        clusters=tuple(f"cluster{i}" for i in range(K)),
        pattern=SurfaceModel(rng.random((3, K * N)), rng.random(3) / 1000),
        white=SurfaceModel(rng.random((3, K * N)), rng.random(3) / 1000) if surfaces == 2 else None,
        white_point=np.array([0.95, 1.0, 1.09]),
        response=ProjectorResponse((code,) * N, (code**2.2,) * N),
    )


@given(st.integers(1, 4), st.integers(1, 4), st.integers(1, 2))
def test_a_model_survives_its_json(K: int, N: int, surfaces: int) -> None:
    model = a_model(K, N, surfaces)
    again = model_from_dict(json.loads(json.dumps(model_to_dict(model))))
    x = np.random.default_rng(1).random((5, model.n))
    for before, after in zip(model.predict(x), again.predict(x), strict=True):
        # JSON keeps every bit of a float64
        assert np.array_equal(before, after) if before is not None else after is None
    assert np.array_equal(np.array(model.response.linear), np.array(again.response.linear))


def test_curves_may_have_different_lengths() -> None:
    data = model_to_dict(a_model())
    coarse = np.linspace(0, 1, 9)
    data["response"]["channel1"] = {"code": coarse.tolist(), "linear": (coarse**2).tolist()}
    response = model_from_dict(data).response
    # 1e-6: the measured points lie on nodes of the table
    assert response.P_to_x(np.stack([coarse] * 3, axis=-1))[:, 1] == pytest.approx(coarse**2, abs=1e-6)


def _change(path: list[Any], value: Any) -> dict[str, Any]:
    data = json.loads(json.dumps(model_to_dict(a_model())))
    target = data
    for key in path[:-1]:
        target = target[key]
    if value is None:
        del target[path[-1]]
    else:
        target[path[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["schema"], "other", "schema must be"),
        (["channels"], [], "channels must be a list of names"),
        (["clusters"], ["a", "a"], "must not name one twice"),
        (["surfaces", "pattern"], None, 'must hold "pattern"'),
        (["surfaces", "pattern", "A"], [[0.0] * 5] * 3, "surfaces.pattern: A must be finite numbers in shape (3, 6)"),
        (["surfaces", "white", "black"], None, "surfaces.white: black is missing"),
        (["white_point_XYZ"], [1, 0, 1], "white_point_XYZ must be > 0"),
        (["response", "channel0"], None, "response must hold one curve"),
        (["response", "channel0", "linear"], [0.5] * 33, "response.channel0"),
    ],
)
def test_a_foreign_model_with_a_mistake_is_answered_with_the_key(path: list[Any], value: Any, message: str) -> None:
    with pytest.raises(InputError) as error:
        model_from_dict(_change(path, value), "theirs.json")
    assert message in str(error.value)
    assert "theirs.json" in str(error.value)


def test_load_model_reads_a_file_and_names_a_missing_one(tmp_path: Path) -> None:
    write_json(tmp_path / "model.json", model_to_dict(a_model()))
    assert load_model(tmp_path / "model.json").clusters == ("cluster0", "cluster1")
    with pytest.raises(InputError, match="no model file"):
        load_model(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match=r"bad\.json"):
        load_model(tmp_path / "bad.json")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "figures.json"
    write_json(path, {"a": 1})
    before = path.read_bytes()

    def fail(temporary: Path) -> None:
        temporary.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, fail)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["figures.json"]


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
def test_captures_come_back_bit_for_bit_and_uncompressed(shape: tuple[int, ...], tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 2**16, shape, dtype=np.uint16)
    write_tiff(tmp_path / "a.tif", picture)
    assert np.array_equal(read_tiff(tmp_path / "a.tif"), picture)
    assert picture.tobytes() in (tmp_path / "a.tif").read_bytes()


def test_files_name_their_writer(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"x": 1})
    write_npz(tmp_path / "a.npz", x=np.ones(2))
    assert read_json(tmp_path / "a.json")["writer"].startswith("paxel-toolkit ")
    assert str(read_npz(tmp_path / "a.npz")["writer"]).startswith("paxel-toolkit ")


@pytest.mark.parametrize(("reader", "suffix"), [(read_json, "json"), (read_npz, "npz"), (read_tiff, "tif")])
def test_a_missing_or_damaged_file_is_named(reader: Any, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{suffix}"
    with pytest.raises(InstallationError, match=path.name):
        reader(path)
    path.write_bytes(b"not this")
    with pytest.raises(InstallationError, match=path.name):
        reader(path)


def _corrected(model: PredictionModel) -> PredictionModel:
    rng = np.random.default_rng(0)
    return replace(
        model,
        correction=Correction(
            n=model.n,
            terms=(Term("product", 0, 1), Term("signed-square", 2, model.n - 1)),
            coefficients=rng.standard_normal((2, 3, 2)),
            centres=rng.random((4, model.n)),
            weights=rng.standard_normal((2, 3, 4)),
        ),
    )


def test_a_correction_is_stored_with_its_model(tmp_path: Path) -> None:
    model = _corrected(a_model())
    write_json(tmp_path / "model.json", model_to_dict(model))
    again = load_model(tmp_path / "model.json")
    x = np.random.default_rng(1).random((9, model.n))
    for was, read in zip(model.predict(x), again.predict(x), strict=True):
        assert np.array_equal(was, read)
    assert pytest.approx(model.pattern.A) == again.linear.pattern.A
    assert "correction" not in model_to_dict(model.linear)


def test_a_correction_without_a_residual_is_stored() -> None:
    model = _corrected(a_model())
    assert model.correction is not None
    empty = replace(model.correction, centres=np.empty((0, model.n)), weights=np.empty((2, 3, 0)))
    again = model_from_dict(json.loads(json.dumps(model_to_dict(replace(model, correction=empty)))))
    assert again.correction is not None
    assert again.correction.XYZ(np.ones(model.n)) == pytest.approx(empty.XYZ(np.ones(model.n)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.pop("terms"), 'must hold "terms"'),
        (lambda c: c["terms"].append(["cubic", 0, 1]), "must be one of linear, product|coefficients must be"),
        (lambda c: c["terms"].append(["product", 0, 99]), "inputs 0 to 5|coefficients must be"),
        (lambda c: c["terms"].append([1]), 'must hold "terms"'),
        (lambda c: c["surfaces"].pop("white"), "surfaces must be those of the model"),
        (lambda c: c["surfaces"]["white"].pop("coefficients"), "correction.white: coefficients is missing"),
        (
            lambda c: c["surfaces"]["white"].update(weights=[[0.0]] * 3),
            r"weights must be finite numbers in shape \(3, 4\)",
        ),
        (lambda c: c.update(centres=[[0.0]]), r"centres must be finite numbers in shape \(1, 6\)"),
    ],
)
def test_a_broken_correction_is_named(change: Callable[[dict[str, Any]], object], message: str) -> None:
    data = json.loads(json.dumps(model_to_dict(_corrected(a_model()))))
    change(data["correction"])
    with pytest.raises(InputError, match=message):
        model_from_dict(data)
