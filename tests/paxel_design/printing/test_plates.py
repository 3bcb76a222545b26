import re
from dataclasses import replace

import numpy as np
import pytest

from paxel_design.printing.colour_spaces import tint_program
from paxel_design.printing.plates import PROCESS_INKS, is_paper, plates_of, recipe_of
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import colorant_library

LIBRARY = colorant_library()


def spot(name, plate, cmyk=(0.5, 0.0, 0.7, 0.0)):
    return replace(LIBRARY["white"], name=name, cmyk=cmyk, spot=plate)


def run_calculator(program, inputs):
    """A PostScript calculator (PDF 1.7, 7.10.5) for what tint programs use, the top of the stack last."""
    stack = list(inputs)
    for token in re.findall(r"\{pop 1\} if|[^\s{}]+", program):
        if token == "index":
            stack.append(stack[-1 - int(stack.pop())])
        elif token in ("mul", "add"):
            b, a = stack.pop(), stack.pop()
            stack.append(a * b if token == "mul" else a + b)
        elif token == "dup":
            stack.append(stack[-1])
        elif token == "gt":
            b, a = stack.pop(), stack.pop()
            stack.append(a > b)
        elif token == "{pop 1} if":
            if stack.pop():
                stack[-1] = 1.0
        elif token == "roll":
            j, n = int(stack.pop()), int(stack.pop())
            stack[-n:] = stack[-j:] + stack[-n:-j]
        elif token == "pop":
            stack.pop()
        else:
            stack.append(float(token))
    return stack


def test_process_inks_need_the_four_plates():
    plates = plates_of([LIBRARY["red"], LIBRARY["white"]])
    assert plates.names == PROCESS_INKS
    assert plates.amounts(LIBRARY["red"]) == (0.0, 1.0, 1.0, 0.0)
    assert plates.amounts(None) == (0.0,) * 4


def test_spot_inks_have_a_plate_each_beside_the_process_inks_in_use():
    glow, shine = spot("glow", "UV green"), spot("shine", "UV red")
    plates = plates_of([glow, LIBRARY["red"], shine, LIBRARY["white"]])
    assert plates.names == ("Magenta", "Yellow", "UV green", "UV red")
    assert plates.amounts(glow) == (0, 0, 1, 0)
    assert plates.amounts(LIBRARY["red"]) == (1, 1, 0, 0)
    assert plates_of([glow, shine]).names == ("UV green", "UV red")


def test_the_tint_program_adds_recipes_and_stops_at_full_ink():
    glow, shine = spot("glow", "UV green"), spot("shine", "UV red", (0.0, 0.8, 0.6, 0.25))
    plates = plates_of([LIBRARY["blue"], glow, shine])
    assert plates.names == ("Cyan", "Magenta", "UV green", "UV red")
    recipes = np.array([[1, 0, 0, 0], [0, 1, 0, 0], glow.cmyk, shine.cmyk])
    for amounts in np.random.default_rng(0).random((20, 4)):
        wanted = np.minimum(1, amounts @ recipes)
        assert run_calculator(tint_program(plates), amounts) == pytest.approx(list(wanted), abs=1e-12)


def test_recipes_in_words():
    assert recipe_of(LIBRARY["red"]) == "M100 Y100"
    assert recipe_of(spot("glow", "UV green")) == "spot UV green"
    assert recipe_of(LIBRARY["white"]) == recipe_of(None) == "no ink"
    assert is_paper(LIBRARY["white"])
    assert not is_paper(spot("varnish", "Varnish", (0.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["cyan"], "a name of its own, got 'cyan'"),
        (["All"], "a name of its own"),
        (["UV", "UV"], "must print one colorant, got 2 on 'UV'"),
        (["x" * 61], "at most 60"),
        (["日本"], "Latin letters"),
    ],
)
def test_an_impossible_plate_is_named(names, text):
    with pytest.raises(InputError, match=text):
        plates_of([spot(f"ink {i}", name) for i, name in enumerate(names)])
