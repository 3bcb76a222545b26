"""The charts of a study: what they are drawn from, and that nothing of it is needed."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from PIL import Image

from paxel_design.study import Case
from paxel_design.study.figures import write_study_figure


def _ink(path) -> float:
    with Image.open(path) as picture:
        return float(np.mean(np.asarray(picture.convert("L")) < 200))


def test_two_rows_of_charts_a_layout(figures, tmp_path) -> None:
    of = {Case("checkerboard", deg, mm, K): figures(mm, K) for deg, mm, K in product((0.0, 30.0), (0.5, 1.0), (2, 3))}
    write_study_figure(tmp_path / "study.png", of)
    with Image.open(tmp_path / "study.png") as picture:
        assert picture.height / picture.width == pytest.approx(2 * 2 * 78 / 260, rel=0.01)  # mm
    assert _ink(tmp_path / "study.png") > 0.01


def test_one_case_without_grays_in_common_is_drawn_all_the_same(figures, tmp_path) -> None:
    blind = figures(0.2, 2) | {"lightness": None, "hue": None}
    write_study_figure(tmp_path / "study.png", {Case("blue-noise", 0.0, 0.2, 2): blind})
    assert _ink(tmp_path / "study.png") > 0.005
