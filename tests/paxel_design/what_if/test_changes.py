"""What counts as a gain, in which order changes are told, and how numbers of options are written."""

from dataclasses import replace

import pytest

from paxel_design.what_if.changes import Change, helpful, idle, option

CHANGE = Change("key", "effect", "title", "figure", "L*", 20.0, 25.0, "print", "cost", "how")


def test_gain_is_relative_to_the_present_figure() -> None:
    assert CHANGE.gain == pytest.approx(0.25)
    assert replace(CHANGE, after=15.0).gain == pytest.approx(-0.25)
    assert replace(CHANGE, after=15.0, less_is_better=True).gain == pytest.approx(0.25)
    assert replace(CHANGE, less_is_better=True).gain == pytest.approx(-0.25)


def test_below_what_is_enough_less_is_no_gain() -> None:
    seen = replace(CHANGE, less_is_better=True, enough=1.0)
    assert replace(seen, before=4.0, after=0.1).gain == pytest.approx(0.75)
    assert replace(seen, before=0.9, after=0.1).gain == 0.0
    assert not replace(seen, before=0.9, after=0.1).helps


def test_from_nothing_to_something_helps_without_a_ratio() -> None:
    new = replace(CHANGE, before=0.0, after=13.0)
    assert new.gain is None
    assert new.helps
    assert not replace(new, after=0.0).helps


def test_changes_are_told_by_aim_and_gain() -> None:
    a, b = replace(CHANGE, key="a", after=21.0), replace(CHANGE, key="b", after=22.0)
    c = replace(CHANGE, key="c", aim="seen", after=80.0)
    d = replace(CHANGE, key="d", after=20.1)
    e, f = replace(CHANGE, key="e", in_use=True), replace(CHANGE, key="f", objection="too large")
    changes = (c, a, d, e, f, b)
    assert [change.key for change in helpful(changes)] == ["b", "a", "c"]
    new = [replace(CHANGE, key=f"{after:g}", before=0.0, after=after) for after in (13.0, 17.0)]
    assert [change.key for change in helpful((*new, a))] == ["17", "13", "a"]
    assert [change.key for change in idle(changes)] == ["d"]


@pytest.mark.parametrize(("value", "digits"), [(0.5, 1), (1.0, 1), (0.75, 2), (1.25, 3), (30.0, 1), (18.434948822, 5)])
def test_options_have_the_digits_that_set_them(value: float, digits: int) -> None:
    assert option(value).digits == digits
