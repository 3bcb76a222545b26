"""What a report is made from: which records are up to date, and how a figure is found in one."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.report.content import Quantity, quoted
from paxel_design.report.source import ReportSource, found, installation_source, model_source, quantities_at, recorded
from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import make_settings
from paxel_runtime.storage import model_to_dict, write_image, write_json


@pytest.fixture
def show(calibrated: Installation, tmp_path: Path) -> Installation:
    """A copy to work on."""
    shutil.copytree(calibrated.path, tmp_path / "show")
    return Installation.open(tmp_path / "show")


def test_a_calibrated_installation_tells_its_records(calibrated: Installation) -> None:
    source = installation_source(calibrated)
    assert source.bench == "virtual bench, realistic"
    assert source.date == "2026-03-04"
    assert {"print/pattern.json", "captures/complete.json", "calibration/accuracy.json"} <= set(source.records)
    assert source.model.clusters == ("black", "white")


def test_own_hardware_is_no_bench(show: Installation) -> None:
    (show.path / "paxel.toml").write_text(
        (show.path / "paxel.toml").read_text(encoding="utf-8").replace('kind = "virtual"', 'kind = "folder"'),
        encoding="utf-8",
    )
    show = Installation.open(show.path)
    for stage, file in (("captures", "exposures.json"), ("calibration", "calibration.json")):
        write_json(show.folder(stage) / file, {"inputs": show.inputs(stage)})
    assert installation_source(show).bench == ""


def test_an_installation_that_is_not_calibrated_is_told_what_to_run(tmp_path: Path) -> None:
    installation = Installation.create(tmp_path / "show", make_settings())
    with pytest.raises(InstallationError, match="run: paxel pattern"):
        installation_source(installation)


def test_records_that_are_out_of_date_are_left_out(show: Installation) -> None:
    gamut, projection, preview = (show.folder(name) for name in ("gamut", "projection", "preview"))
    for folder in (gamut, projection, preview):
        folder.mkdir()
    inputs = show.inputs("gamut")
    write_json(gamut / "fresh.json", {"inputs": inputs})
    write_json(gamut / "stale.json", {"inputs": {**inputs, "files": {"calibration/model.json": "another"}}})
    made_from = show.inputs("projection", extra_files={"picture image": show.path / "paxel.toml"})
    for name in ("new", "old"):
        settings = made_from["settings"] | ({"mapping.chroma": "clip"} if name == "old" else {})
        write_json(projection / f"{name}.json", {"inputs": {**made_from, "settings": settings}})
        write_image(projection / f"{name}.png", _black())
        write_json(preview / f"{name}.json", {"inputs": show.inputs("preview", stem=name)})
    records = installation_source(show).records
    assert "gamut/fresh.json" in records
    assert "gamut/stale.json" not in records
    assert {name for name in records if "projection/" in name} == {"projection/new.json"}
    assert {name for name in records if "preview/" in name} == {"preview/new.json"}  # of a projection that is fresh


def _black() -> NDArray[np.uint8]:
    return np.zeros((2, 2), np.uint8)


def test_a_model_alone(tmp_path: Path, bw_model: Callable[[int], PredictionModel]) -> None:
    write_json(tmp_path / "theirs.json", model_to_dict(bw_model(2)))
    source = model_source(tmp_path / "theirs.json")
    assert (source.installation, source.bench, dict(source.records)) == (None, "", {})
    assert source.date
    with pytest.raises(InputError, match="there is no model file"):
        model_source(tmp_path / "none.json")


def test_pointers(calibrated: Installation) -> None:
    records = {"a/b.json": {"x": {"y": [1.5, 2.5]}, "share": 0.25, "word": "yes", "on": True}}
    source = ReportSource(installation_source(calibrated).model, Path("model.json"), records=records)
    assert found(source, "a/b.json#/x/y/1") == 2.5
    for nothing in ("a/b.json#/x/z", "a/b.json#/x/y/2", "a/b.json#/share/deeper", "a/none.json#/x"):
        assert found(source, nothing) is None
        assert recorded(source, nothing) is None
    assert recorded(source, "a/b.json#/x") is None  # an object is no figure
    assert recorded(source, "a/b.json#/x/y", "L*") == Quantity((1.5, 2.5), "L*", "a/b.json#/x/y")
    assert recorded(source, "a/b.json#/share", percent=True) == Quantity(25.0, "%", "a/b.json#/share x 100")
    taken = quantities_at(source, {"q.share": ("a/b.json#/share", "share"), "q.none": ("a/b.json#/none", "")})
    assert list(taken) == ["q.share"]


def test_words_are_quoted_as_a_list_and_two_numbers_as_a_range() -> None:
    assert quoted(Quantity(("black", "white"))) == "black, white"
    assert quoted(Quantity((19.03, 41.97), digits=3)) == "19.0 to 42.0"
