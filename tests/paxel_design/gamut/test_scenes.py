"""Pictures of bodies: drawn off screen where the machine can, one clear error where it cannot."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from paxel_design.gamut import gamut_mesh, sub_gamut
from paxel_design.gamut.scenes import SceneBody, write_scene
from paxel_runtime.errors import GamutError
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]


def test_bodies_are_drawn_on_white_with_axes(bw_model: Models, tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    model = bw_model(2)
    bodies = [SceneBody(gamut_mesh(sub_gamut(model, effect)), effect) for effect in ("full", "neutralize")]
    write_scene(tmp_path / "both.png", bodies, size_px=(400, 320))
    with Image.open(tmp_path / "both.png") as picture:
        assert picture.size == (400, 320)
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    white = np.all(pixels == 255, axis=1)
    assert 0.3 < white.mean() < 0.98
    assert len(np.unique(pixels, axis=0)) > 100, "bodies are shaded"


def test_nothing_to_draw_and_no_graphics_are_told(
    bw_model: Models, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(GamutError, match="one body or more"):
        write_scene(tmp_path / "none.png", [])
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(GamutError, match=r"need pyvista.*pip install pyvista"):
        write_scene(tmp_path / "none.png", [SceneBody(gamut_mesh(sub_gamut(bw_model(2), "full"), 16.0))])
    assert not (tmp_path / "none.png").exists()
