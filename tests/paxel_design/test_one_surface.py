"""One channel, one surface: the presets `uv-rgb` and `rgb` from the print to what a viewer sees, at a small size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paxel_design.demo import run_demo
from paxel_runtime.captures.acquisition import plan_exposures
from paxel_runtime.errors import SettingsError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibrate
from paxel_runtime.storage import load_model, read_image, read_json

SMALL = {
    "projector.resolution": [360, 202],
    "projector.width_mm": 52.7,
    "pattern.size_mm": [60, 36],
    "camera.resolution": [800, 600],
}


def _quiet(*_: object) -> None:
    pass


@pytest.fixture(scope="module", params=["uv-rgb", pytest.param("rgb", marks=pytest.mark.slow)])
def show(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Installation, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("one-surface") / request.param
    result = run_demo(folder, request.param, SMALL, _quiet, _quiet)
    return Installation.open(folder), result


def test_no_white_sheet_is_asked_for(show: tuple[Installation, dict[str, Any]]) -> None:
    assert {exposure.surface for exposure in plan_exposures(show[0])} == {"pattern"}


def test_the_model_has_one_surface_and_its_own_white(show: tuple[Installation, dict[str, Any]]) -> None:
    """All clusters at full are the white point: A and black add up to it, to cross-talk between neighbours."""
    model = load_model(show[0].folder("calibration") / "model.json")
    assert model.white is None
    assert (model.n, len(model.channels)) == (3, 1)
    assert np.allclose(model.pattern.A.sum(axis=1) + model.pattern.black, model.white_point, atol=0.02)


def test_prediction_meets_table_II(show: tuple[Installation, dict[str, Any]]) -> None:
    """The issue's limits on the 5^3 grid of projections (the paper on hardware: 2.56 / 4.5 / 5.6)."""
    accuracy = show[1]["figures"]["prediction"]["pattern"]
    assert read_json(show[0].folder("calibration") / "accuracy.json")["n"] == 125
    assert accuracy["dE00_mean"] < 1.2
    assert accuracy["dE00_p95"] < 2.4
    assert accuracy["dE00_max"] < 4.0


def test_the_viewer_sees_the_mapped_picture_in_colour(show: tuple[Installation, dict[str, Any]]) -> None:
    installation, result = show
    figures = result["figures"]["monochrome"]
    assert figures["seen_on_pattern"]["dE00_mean"] < 2.0
    seen = read_json(installation.folder("preview") / "monochrome.json")["on_pattern"]
    assert seen["chroma_mean"] > 0.8 * seen["chroma_mean_mapped"]
    projection = read_image(installation.folder("projection") / "monochrome.png")
    assert projection.shape == (202, 360)  # one channel: one plane


def test_another_white_makes_grays_of_that_tint(tmp_path: Path, show: tuple[Installation, dict[str, Any]]) -> None:
    """`model.white = "D65"`: the white point has D65's chromaticity, and one primary at full limits it."""
    import shutil

    folder = tmp_path / "again"
    shutil.copytree(show[0].path, folder)
    toml = folder / "paxel.toml"
    text = toml.read_text(encoding="utf-8")
    toml.write_text(text.replace('white = "full"', 'white = "D65"'), encoding="utf-8")
    installation = Installation.open(folder)
    assert {s.stage.name for s in installation.status() if s.state == "stale"} >= {"calibration"}
    calibrate(installation)
    model = load_model(folder / "calibration" / "model.json")
    assert model.white_point[:2] / model.white_point.sum() == pytest.approx([0.31272, 0.32903], abs=1e-4)
    x = np.linalg.solve(model.pattern.A, model.white_point - model.pattern.black)
    assert x.max() == pytest.approx(1.0, abs=1e-6)


def test_white_is_the_papers_where_there_is_a_sheet() -> None:
    with pytest.raises(SettingsError, match="second surface"):
        make_settings("bw-checkerboard", {"model.white": "D65"})
    with pytest.raises(SettingsError, match="chromaticity"):
        make_settings("uv-rgb", {"model.white": [0.7, 0.6]})


def test_colours_lie_inside_the_triangle_of_the_inks(show: tuple[Installation, dict[str, Any]]) -> None:
    """Whatever is predicted mixes the clusters' light, each a mixture of what the three inks shine."""
    installation, _ = show
    settings = installation.settings
    if settings.projector.channels != ("uv",):
        pytest.skip("reflected white light is no mixture of three emissions")
    from paxel_runtime.colorants import load_colorants

    library = load_colorants(settings, installation.path)
    inks = spectra_to_XYZ(np.array([library[n].fluorescence.emission for n in settings.pattern.colorants]))  # type: ignore[union-attr]
    model = load_model(installation.folder("calibration") / "model.json").linear
    x = np.random.default_rng(5).random((500, 3))
    shares = np.linalg.solve(inks.T, np.asarray(model.predict_XYZ(x)[0]).T - model.pattern.black[:, None])
    assert shares.min() > -2e-3 * shares.max()  # noise of the readings
