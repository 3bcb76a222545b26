"""The charts of a study: what they are drawn from, and that nothing of it is needed."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from PIL import Image

from paxel_design.study import Case
from paxel_design.study.figures import write_study_figure


def test_two_rows_of_charts_a_layout_even_where_no_grays_are_in_common(figures, tmp_path) -> None:
    of = {Case("checkerboard", 30.0, mm, K): figures(mm, K) for mm, K in product((0.5, 1.0), (2, 3))}
    of[Case("blue-noise", 0.0, 0.2, 2)] = figures(0.2, 2) | {"lightness": None, "hue": None}
    write_study_figure(tmp_path / "study.png", of)
    with Image.open(tmp_path / "study.png") as picture:
        assert picture.height / picture.width == pytest.approx(2 * 2 * 78 / 260, rel=0.01)  # mm
        dark = np.asarray(picture.convert("L")) < 200
    above, below = np.array_split(dark, 2)
    assert above.mean() > below.mean() > 0.005
