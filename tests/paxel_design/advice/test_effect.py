"""The simulated model: light is conserved, large dots are colorants alone, larger dots and clusters change more."""

from __future__ import annotations

import numpy as np
import pytest

from paxel_design.advice.effect import BLACK, effect_size, simulated_model
from paxel_design.patterns import make_pattern
from paxel_design.visibility.passages import SCATTERING_MM
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

PITCH_MM = 281.0 / 1920.0


def checker(dot_mm: float, angle_deg: float = 30.0) -> Pattern:
    return make_pattern("checkerboard", ("black", "white"), dot_mm, angle_deg, (60, 40))


@pytest.mark.parametrize("K", [2, 3])
def test_full_white_is_one_and_all_clusters_light_the_mean_of_the_print(K: int) -> None:
    model = simulated_model(checker(0.75), PITCH_MM, K)
    assert model.white is not None
    on_white = model.white.predict_XYZ(np.ones(model.n))
    np.testing.assert_allclose(on_white, model.white_point, rtol=1e-9)
    on_pattern = model.pattern.predict_XYZ(np.ones(model.n))[1]
    # of light that goes N(0, sigma) along both axes, a checkerboard of dots d turns this share onto the other colorant
    crossing = (1 - (1 - 2 * SCATTERING_MM * np.sqrt(2 / np.pi) / 0.75) ** 2) / 2
    black = 0.017  # of paper's luminance
    expected = (1 - crossing) * (1 + black) / 2 + crossing * np.sqrt(black)
    assert on_pattern == pytest.approx(expected, abs=0.012)  # what a piece of 96 pixels has of a dot more
    np.testing.assert_allclose(model.pattern.black, on_pattern_black(model), rtol=1e-9)


def on_pattern_black(model) -> np.ndarray:  # type: ignore[no-untyped-def]
    """What the black level leaves: full light times its share."""
    return model.pattern.A.sum(axis=1) / (1 - BLACK) * BLACK


def test_huge_dots_leave_the_colorants_alone() -> None:
    """Dots of 40 pixels: the black cluster on the pattern shows black ink, to the light of its pixels at edges."""
    model = simulated_model(checker(40 * PITCH_MM, 0.0), PITCH_MM, 2, offset_px=(0.0, 0.0))
    assert model.white is not None
    black, white = model.pattern.A[1, :3].sum(), model.pattern.A[1, 3:].sum()
    on_paper = model.white.A[1, :3].sum()
    assert black / on_paper < 0.1
    assert white / model.white.A[1, 3:].sum() > 0.95


def test_larger_dots_have_a_larger_effect_and_a_third_cluster_too() -> None:
    """Fig. 13 of the paper, without its faults: what the light leaves of small dots."""
    sizes = [
        effect_size(simulated_model(checker(dot), PITCH_MM, 2), volumes=False).lightness for dot in (0.5, 0.75, 1.0)
    ]
    assert sizes[0] < sizes[1] < sizes[2]
    three = effect_size(simulated_model(checker(0.75), PITCH_MM, 3))
    assert three.lightness > sizes[1]
    assert three.volume_pattern is not None
    assert three.volume_pattern > 0


def test_clusters_that_cannot_be_are_told() -> None:
    with pytest.raises(InputError, match="K = 2 or 3"):
        simulated_model(checker(0.75), PITCH_MM, 5)
