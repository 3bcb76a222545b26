"""Primaries of one channel: which limits white, and what other area shares give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_design.gamut.primaries import neutral_shares, primaries_figures, primaries_sentence
from paxel_runtime.calibration.white_point import WHITES, brightest_of_chromaticity
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

SOLID = np.array([[1.2, 0.6, 0.54], [0.66, 1.86, 0.3], [0.09, 0.36, 2.85]])
"""XYZ of each ink over the whole area."""


def printed(shares: np.ndarray) -> PredictionModel:
    A, line = SOLID * shares, np.linspace(0, 1, 3)
    return PredictionModel(
        channels=("uv",),
        clusters=("red", "green", "blue"),
        pattern=SurfaceModel(A, np.zeros(3)),
        white=None,
        white_point=A.sum(axis=1),
        response=ProjectorResponse((line,), (line,)),
    )


@given(st.floats(0.1, 0.6), st.floats(0.15, 0.35))
def test_a_print_with_neutral_shares_wastes_no_light(red: float, green: float) -> None:
    shares = np.array([red, green, 1 - red - green])
    best = neutral_shares(SOLID * shares, shares)
    assert best is not None
    assert best.sum() == pytest.approx(1.0)
    assert np.allclose(brightest_of_chromaticity(printed(best), WHITES["D65"])[1], 1.0, atol=1e-6)


def test_the_figures_tell_what_another_print_would_show() -> None:
    shares = np.array([0.4, 0.35, 0.25])
    figures = primaries_figures(printed(shares), shares)
    white = figures["whites"]["D65"]
    assert figures["primaries"]["red"]["xy"] == pytest.approx(list(SOLID[:2, 0] / SOLID[:, 0].sum()))
    assert sum(p["luminance"] for p in figures["primaries"].values()) == pytest.approx(1.0)
    assert white["inputs"][white["limiting"]] == pytest.approx(1.0, abs=1e-9)
    better = printed(np.array(list(white["shares"].values())))
    now = brightest_of_chromaticity(printed(shares), WHITES["D65"])[0][1]
    then = brightest_of_chromaticity(better, WHITES["D65"])[0][1]
    assert white["luminance_with_shares"] / white["luminance"] == pytest.approx(then / now, rel=1e-9)
    assert then > now


def test_a_white_beyond_the_inks_is_told_as_none() -> None:
    narrow = printed(np.full(3, 1 / 3))
    A = np.array(narrow.pattern.A)
    A[:, 2] = 0.6 * A[:, 1] + 0.001 * A[:, 2]
    poor = PredictionModel(
        narrow.channels, narrow.clusters, SurfaceModel(A, np.zeros(3)), None, A.sum(axis=1), narrow.response
    )
    assert primaries_figures(poor, [1 / 3] * 3)["whites"]["D65"] is None


@pytest.mark.parametrize("shares", [[0.5, 0.5], [0.5, 0.5, 0.5], [0, 0.5, 0.5]])
def test_shares_must_be_shares(shares: list[float]) -> None:
    with pytest.raises(InputError, match="three positive numbers"):
        primaries_figures(printed(np.full(3, 1 / 3)), shares)


def test_the_sentence_names_the_limiting_primary_and_better_shares() -> None:
    shares = np.array([0.2, 0.35, 0.45])
    figures = primaries_figures(printed(shares), shares)
    white = figures["whites"]["D65"]
    told = primaries_sentence(figures)
    assert f"limited by {white['limiting']}" in told
    for name, share in white["shares"].items():
        assert f"{name} {100 * share:.0f} %" in told
    assert "now 20, 35, 45" in told
    better = np.array(list(white["shares"].values()))
    assert "fit" in primaries_sentence(primaries_figures(printed(better), better))
