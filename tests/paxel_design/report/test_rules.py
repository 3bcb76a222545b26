"""The thresholds: their words, their order, and that they are those of the stages that judge by them."""

from types import SimpleNamespace
from typing import Any

import pytest

from paxel_design.advice.ranking import SEEN_MOIRE, SEEN_PRINT
from paxel_design.report.content import Quantity
from paxel_design.report.rules import HONESTY, RULES, judged, judged_honesty, rules_table
from paxel_runtime.errors import InputError
from paxel_runtime.observer.judgement import LIMITS
from paxel_runtime.registration.report import verdict
from paxel_runtime.structured_light import REASONS


@pytest.mark.parametrize("key", RULES)
def test_a_rule_judges_at_its_own_limits(key: str) -> None:
    rule = RULES[key]
    sign = 1 if rule.less_is_better else -1
    assert [rule.judge(v) for v in (rule.good, rule.usable)] == ["good", "usable"]
    assert rule.judge(rule.good + sign * 1e-9) == "usable"
    assert rule.judge(rule.usable + sign * 1e-9) == "weak"
    assert f"{rule.good:g}" in rule.words
    assert f"{rule.usable:g}" in rule.words
    assert rule.reason
    assert rule.advice


def test_limits_are_those_of_the_stages() -> None:
    assert (RULES["print"].good, RULES["moire"].good) == (SEEN_PRINT, SEEN_MOIRE)
    for key, rule, factor in (
        ("dE00_mean", "colours-seen", 1),
        ("ghosting_percent", "ghosting", 1),
        ("local_contrast_kept", "contrast-kept", 100),
    ):
        limit = LIMITS[key]
        assert (RULES[rule].good, RULES[rule].usable) == (factor * limit.good, factor * limit.usable)


@pytest.mark.parametrize(
    ("key", "rule", "scale"), [("residual_rms_px", "registration", 1.0), ("coverage", "coverage", 0.01)]
)
def test_registration_is_judged_as_the_capture_judges_it(key: str, rule: str, scale: float) -> None:
    def word(value: float) -> str:
        figures: dict[str, Any] = {"residual_rms_px": 0.1, "coverage": 1.0, "outliers": 0.0, key: value}
        decoded: Any = SimpleNamespace(counts=dict.fromkeys(REASONS, 0) | {REASONS[0]: 1000})
        registration: Any = SimpleNamespace(figures=figures)
        return verdict(decoded, registration)[0].replace("repeat", "weak")

    limits = RULES[rule]
    sign = 1 if limits.less_is_better else -1
    for value in (limits.good - sign * 0.01, limits.good + sign * 0.1, limits.usable + sign * 0.1):
        assert limits.judge(value) == word(scale * value), value


def test_a_verdict_names_its_quantity_and_advises_only_where_needed() -> None:
    quantities = {"a.x": Quantity(0.5, "dE00"), "a.y": Quantity(0.8), "a.word": Quantity("dishonest")}
    good = judged("prediction", "a.x", quantities, of="on the pattern")
    assert (good.judgement, good.advice, good.quantity) == ("good", "", "a.x")
    assert good.name == "colour prediction on the pattern"
    weak = judged("purity", "a.y", quantities)
    assert (weak.judgement, weak.advice) == ("weak", RULES["purity"].advice)
    assert judged("purity", "a.y", quantities, scale=100).judgement == "usable"
    assert judged_honesty("a.word", quantities).judgement == HONESTY["dishonest"] == "weak"
    with pytest.raises(InputError, match="must be one of prediction"):
        judged("nothing", "a.x", quantities)
    for name in ("a.word", "a.none"):
        with pytest.raises(InputError, match=f"{name!r} is"):
            judged("prediction", name, quantities)


def test_every_rule_stands_in_the_table() -> None:
    assert [row[0] for row in rules_table().rows] == [rule.name for rule in RULES.values()]
