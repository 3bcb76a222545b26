"""What the figures are said to mean."""

from typing import Any

import pytest

from paxel_runtime.observer import judge_view, preview_words, view_words
from paxel_runtime.observer.judgement import LIMITS, VERDICTS

GOOD: dict[str, Any] = {
    "dE00_mean": 0.3,
    "ghosting_percent": 0.4,
    "coherent_gain": 0.97,
    "local_contrast_kept": 0.5,
    "minimum_distance_mm": 2600.0,
}


@pytest.mark.parametrize("key", LIMITS)
def test_every_limit_turns_the_verdict_at_its_value(key: str) -> None:
    limit = LIMITS[key]
    worse = 1e-6 if limit.usable > limit.good else -1e-6
    assert [limit.verdict(v) for v in (limit.good, limit.good + worse, limit.usable, limit.usable + worse)] == [
        "good", "usable", "usable", "weak",
    ]  # fmt: skip
    for value, verdict in ((limit.good, "good"), (limit.usable, "usable"), (limit.usable + worse, "weak")):
        assert judge_view(GOOD | {key: value}, 4000) == verdict
        (first, *cures) = view_words("on the pattern", GOOD | {key: value}, 4000)
        assert first.startswith(f"on the pattern from 4 m: {verdict}")
        assert bool(cures) == (verdict != "good")


def test_too_close_is_weak_and_says_how_far_to_stand() -> None:
    assert [judge_view(GOOD, mm) for mm in (2600, 2599, 2341, 2339)] == ["good", "usable", "usable", "weak"]
    words = view_words("on the pattern", GOOD, 2000)
    assert "too close" in words[1]
    assert "at least 2.6 m" in words[1]


def test_a_planted_mark_is_worth_more_than_the_regression() -> None:
    assert judge_view(GOOD | {"ghosting_percent": 30.0}, 4000) == "weak"
    assert judge_view(GOOD | {"ghosting_percent": 30.0, "ghost_L": 0.1}, 4000) == "good"


def test_figures_that_are_missing_are_passed_over() -> None:
    assert judge_view({"dE00_mean": 0.5, "coherent_gain": None}, 4000) == VERDICTS[0]


def test_a_record_in_words() -> None:
    record = {
        "name": "evening",
        "seen_on": "virtual bench, ideal",
        "distance_mm": 4000.0,
        "on_pattern": GOOD,
        "on_white": GOOD | {"dE00_mean": 2.0},
        "views": {"at-2000mm.tilt-10deg": {"distance_mm": 2000.0, "on_white": GOOD}},
        "projection_image": {"on_pattern": {"blurred": 0.02, "texture": 0.61}, "on_white": {"blurred": None}},
    }
    change = {"hue_pixels": 0.6, "hue_turn_deg": 44.96, "hue_turn_sd_deg": 1.21, "chroma_ratio": 0.9}
    told = preview_words(record | {"change": change})[-2]
    assert told.endswith("hues turn by 45.0 degrees (standard deviation 1.2), chroma times 0.90")
    assert preview_words(record | {"change": change | {"hue_pixels": 0.001}})[-2].endswith(": chroma times 0.90")
    text = "\n".join(preview_words(record))
    assert "evening (virtual bench, ideal)" in text
    assert "on the white sheet from 4 m: usable: colours are off by 2.0 dE00 on average (usable)" in text
    assert "(tilt-10deg) on the white sheet from 2 m: weak" in text
    assert "finds the picture on the pattern (1 = plainly): blurred 0.02, by its dots 0.61" in text
    assert "picture on the white sheet (1" not in text
