"""The table of effects: text and file names round trip, errors list the choices."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.model.effects import EFFECTS, DualImage, Full, Neutralize, parse_effect

NUMBERS = st.floats(-150, 150, allow_nan=False)


@pytest.mark.parametrize("key", EFFECTS)
def test_a_key_alone_gives_the_defaults_and_the_row_is_complete(key: str) -> None:
    effect = parse_effect(key)
    assert type(effect) is EFFECTS[key]
    assert effect == EFFECTS[key]()
    assert effect.pictures in {("image",), ("on_pattern", "on_white")}
    assert effect.description
    assert "\n" not in effect.description


@pytest.mark.parametrize(
    ("effect", "text", "name"),
    [
        (Full(), "full", "full"),
        (DualImage(), "dual-image", "dual-image"),
        (Neutralize(), "neutralize:50,0,0", "neutralize-50_0_0"),
        (Neutralize((62.5, -3, 0.1)), "neutralize:62.5,-3,0.1", "neutralize-62.5_-3_0.1"),
    ],
)
def test_text_and_file_name_are_those_of_the_design(
    effect: Full | DualImage | Neutralize, text: str, name: str
) -> None:
    assert (effect.text, effect.name) == (text, name)


@given(st.floats(0, 100), NUMBERS, NUMBERS)
def test_text_reads_back_as_the_same_effect(L: float, a: float, b: float) -> None:
    effect = Neutralize((L, a, b))
    assert parse_effect(effect.text) == effect
    assert re.fullmatch(r"neutralize(-?[-+.\de_]+)", effect.name), "a file name on every system"


def test_minus_zero_is_zero() -> None:
    assert parse_effect("neutralize:50,-0.0,0").name == "neutralize-50_0_0"


def test_an_unknown_effect_is_answered_with_the_choices_of_the_table() -> None:
    with pytest.raises(InputError, match="neutralise") as caught:
        parse_effect("neutralise:50,0,0")
    assert all(key in str(caught.value) for key in EFFECTS)


@pytest.mark.parametrize(
    "text",
    ["neutralize:", "neutralize:50,0", "neutralize:50,0,x", "neutralize:120,0,0", "neutralize:50,nan,0", "full:1", ""],
)
def test_a_broken_value_is_answered_with_rule_and_value(text: str) -> None:
    with pytest.raises(InputError, match="effect"):
        parse_effect(text)


@pytest.mark.parametrize("Lab", [None, (50, 0), (50, "a", 0), (-1, 0, 0)])
def test_a_broken_Lab_is_refused(Lab: object) -> None:
    with pytest.raises(InputError, match="three numbers L,a,b"):
        Neutralize(Lab)  # type: ignore[arg-type]
