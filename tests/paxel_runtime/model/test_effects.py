"""The table of effects: text and file names round trip, errors list the choices."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.model.effects import (
    EFFECTS,
    Chroma,
    Decolorize,
    DualImage,
    Effect,
    Full,
    FullChange,
    HueShift,
    Monochrome,
    Neutralize,
    Partner,
    Watermark,
    parse_effect,
)

NUMBERS = st.floats(-150, 150, allow_nan=False)


@pytest.mark.parametrize("key", EFFECTS)
def test_a_key_alone_gives_the_defaults_and_the_row_is_complete(key: str) -> None:
    effect = parse_effect(key)
    assert type(effect) is EFFECTS[key]
    assert effect == EFFECTS[key]()
    assert effect.pictures in {("image",), ("on_pattern", "on_white"), ("image", "mark")}
    assert effect.in_sub_gamut or effect.partner, "something bounds the picture's colours"
    assert effect.description
    assert "\n" not in effect.description


@pytest.mark.parametrize(
    ("effect", "text", "name"),
    [
        (Full(), "full", "full"),
        (DualImage(), "dual-image", "dual-image"),
        (Neutralize(), "neutralize:50,0,0", "neutralize-50_0_0"),
        (Neutralize((62.5, -3, 0.1)), "neutralize:62.5,-3,0.1", "neutralize-62.5_-3_0.1"),
        (Neutralize((50, 0, 0), 2), "neutralize:50,0,0,2", "neutralize-50_0_0_2"),
        (HueShift(angle_deg=45), "hue-shift:45", "hue-shift-45"),
        (HueShift(90, lightness_band=10), "hue-shift:90,10", "hue-shift-90_10"),
        (HueShift(-60), "hue-shift:-60", "hue-shift--60"),
        (Chroma(), "chroma:0.5", "chroma-0.5"),
        (Watermark(), "watermark:0.1", "watermark-0.1"),
        (Decolorize(), "decolorize:free", "decolorize-free"),
        (Decolorize("free", 2), "decolorize:free,2", "decolorize-free_2"),
        (Decolorize("relative"), "decolorize:relative", "decolorize-relative"),
        (FullChange(), "full-change", "full-change"),
        (FullChange(20, 60), "full-change:20,60", "full-change-20_60"),
        (DualImage("volume"), "dual-image:volume", "dual-image-volume"),
        (Monochrome(), "monochrome", "monochrome"),
    ],
)
def test_text_and_file_name_are_those_of_the_design(effect: Effect, text: str, name: str) -> None:
    assert (effect.text, effect.name) == (text, name)
    assert parse_effect(text) == effect


@given(st.floats(0, 100), NUMBERS, NUMBERS)
def test_text_reads_back_as_the_same_effect(L: float, a: float, b: float) -> None:
    effect = Neutralize((L, a, b))
    assert parse_effect(effect.text) == effect
    assert re.fullmatch(r"neutralize(-?[-+.\de_]+)", effect.name), "a file name on every system"


@pytest.mark.parametrize("lightness", ["relative", "same"])
def test_a_tolerance_about_grays_of_given_lightness_is_refused_with_the_cure(lightness: str) -> None:
    with pytest.raises(
        InputError, match=rf"free only, got {lightness},2; write decolorize:free,2 or decolorize:{lightness}$"
    ):
        parse_effect(f"decolorize:{lightness},2")


def test_what_each_effect_asks_of_the_other_surface() -> None:
    asked = {effect.text: effect.partner for effect in (row() for row in EFFECTS.values())}
    assert asked == {
        "full": None,
        "hue-shift:45": Partner(turn_deg=45),
        "chroma:0.5": Partner(chroma_scale=0.5),
        "decolorize:free": Partner(chroma_scale=0),
        "neutralize:50,0,0": None,
        "full-change": Partner(turn_deg=180),
        "dual-image": None,
        "watermark:0.1": Partner(mark_strength=0.1),
        "monochrome": None,
    }
    assert parse_effect("hue-shift:-30,10").partner == Partner(turn_deg=-30, lightness_band=10)
    assert parse_effect("decolorize:same").partner == Partner(chroma_scale=0, lightness="same")


def test_minus_zero_is_zero() -> None:
    assert parse_effect("neutralize:50,-0.0,0").name == "neutralize-50_0_0"


def test_an_unknown_effect_is_answered_with_the_choices_of_the_table() -> None:
    with pytest.raises(InputError, match="neutralise") as caught:
        parse_effect("neutralise:50,0,0")
    assert all(key in str(caught.value) for key in EFFECTS)


@pytest.mark.parametrize(
    "text",
    [
        "neutralize:",
        "neutralize:50,0",
        "neutralize:50,0,x",
        "neutralize:120,0,0",
        "neutralize:50,nan,0",
        "full:1",
        "",
        "hue-shift:0",
        "hue-shift:171",
        "hue-shift:-171",
        "watermark:0",
        "watermark:1.1",
        "watermark:0.1,1",
        "hue-shift:45,0",
        "hue-shift:45,10,1",
        "chroma:-1",
        "chroma:x",
        "decolorize:gray",
        "decolorize:free,-1",
        "full-change:20",
        "full-change:60,20",
        "dual-image:best",
        "neutralize:50,0,0,11",
    ],
)
def test_a_broken_value_is_answered_with_rule_and_value(text: str) -> None:
    with pytest.raises(InputError, match="effect"):
        parse_effect(text)


@pytest.mark.parametrize("Lab", [None, (50, 0), (50, "a", 0), (-1, 0, 0)])
def test_a_broken_Lab_is_refused(Lab: object) -> None:
    with pytest.raises(InputError, match="three numbers L,a,b"):
        Neutralize(Lab)  # type: ignore[arg-type]
