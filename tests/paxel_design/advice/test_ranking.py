"""Advice: candidates on the printer's grid, an order that follows the score, a front that nothing beats."""

from __future__ import annotations

import numpy as np
import pytest

from paxel_design.advice import ranking
from paxel_design.advice.effect import EffectSize
from paxel_design.advice.ranking import Candidate, Setup, advise, pareto
from paxel_design.visibility import Moire, PatternVisibility
from paxel_runtime.errors import InputError

SETUP = Setup((1920, 1080), 281.0, 2700.0)


@pytest.fixture(scope="module")
def advice():  # type: ignore[no-untyped-def]
    """A corner of the table, on small pieces: what is tested is the order, not the figures."""
    few = {
        "ANGLES_DEG": (0.0, 30.0), "DOTS_PX": (3.2, 5.1), "_BLUE_NOISE_CELLS": 24,
        "_ZOOMS": (0.983, 0.996, 1.009), "_PIECE_PX": 160, "_SAMPLES": 55,
        "_FINE_ZOOMS": (0.983, 1.009), "_FINE_PIECE_PX": 96, "_FINE_SAMPLES": 34,
    }  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        for name, value in few.items():
            patch.setattr(ranking, name, value)
        return advise(SETUP)


def test_the_best_come_first_with_their_reasons(advice) -> None:  # type: ignore[no-untyped-def]
    scores = [c.score for c in advice.candidates]
    assert scores == sorted(scores, reverse=True)
    assert {(c.layout, c.asked_angle_deg) for c in advice.candidates} == {
        ("checkerboard", 0.0),
        ("checkerboard", 30.0),
        ("blue-noise", 0.0),
    }
    assert len(advice.best) == 3
    first = advice.best[0]
    assert first.layout == "checkerboard"
    assert first.effect.volume_pattern is not None
    for word in ("effect:", "print:", "moire:", "printer:"):
        assert any(reason.startswith(word) for reason in first.reasons), word


def test_blue_noise_is_seen_and_a_turned_grid_beats_one_along_the_raster(advice) -> None:  # type: ignore[no-untyped-def]
    at = {(c.layout, c.asked_angle_deg, c.asked_dot_px): c for c in advice.candidates}
    for dot in (3.2, 5.1):
        straight, turned = at["checkerboard", 0.0, dot], at["checkerboard", 30.0, dot]
        assert turned.moire.visibility < straight.moire.visibility
        assert at["blue-noise", 0.0, dot].seen > 5 * turned.seen
    assert at["checkerboard", 30.0, 5.1].effect.lightness > at["checkerboard", 30.0, 3.2].effect.lightness


def test_dots_stand_on_the_printers_grid(advice) -> None:  # type: ignore[no-untyped-def]
    snapped = [c for c in advice.candidates if c.step_px is not None]
    assert len(snapped) == len(advice.candidates)  # at 1440 dpi some size within 5 % fits every angle
    for c in snapped:
        across, up = c.step_px
        assert c.dot_size_mm == pytest.approx(np.hypot(across, up) * 25.4 / SETUP.dpi)
        assert c.angle_deg == pytest.approx(np.rad2deg(np.arctan2(up, across)))
        assert abs(c.dot_size_mm / (c.asked_dot_px * SETUP.pitch_mm) - 1) < 0.06  # 4.5 % and snapping's own 1 %


def candidate(print_seen: float, moire: float, effect: float) -> Candidate:
    seen = PatternVisibility(3000.0, print_seen, 0.0, 20.0)
    return Candidate("checkerboard", 30.0, 0.75, 30.0, 5.0, (1, 1), seen, Moire(0.1, moire, 8.0),
                     EffectSize(effect, effect))  # fmt: skip


def test_the_front_holds_what_nothing_beats() -> None:
    a, b, c, beaten = candidate(1, 5, 20), candidate(2, 2, 20), candidate(3, 9, 30), candidate(2, 6, 19)
    unseen = candidate(0.1, 5, 19.9)  # 1 is not seen either, and a has more effect
    assert pareto([a, beaten, b, unseen, c]) == [a, b, c]
    assert candidate(0, 0, 20).score == pytest.approx(20)  # nothing seen: the effect itself
    assert candidate(0, 0, 20).score > a.score > beaten.score


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"width_mm": 0.0}, "--width must be > 0"),
        ({"distance_mm": float("nan")}, "--distance must be > 0"),
        ({"colorants": ("black",)}, "two or more"),
        ({"K": 5}, "--clusters must be 2 or 3"),
        ({"dpi": 20.0}, "use a finer printer"),
    ],
)
def test_what_makes_no_sense_is_told(changes, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=words):
        Setup(**{"resolution": (1920, 1080), "width_mm": 281.0, "distance_mm": 2700.0, **changes})


@pytest.mark.parametrize("colorants", [("uv-red", "uv-green", "uv-blue"), ("black", "white", "uv-red")])
def test_inks_that_this_light_cannot_tell_apart_are_refused_at_once(colorants: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r"--colorants \S+ and uv-\S+ look alike.*--monochrome"):
        advise(Setup((1920, 1080), 281.0, 2700.0, colorants=colorants))
