import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.pattern_json import pattern_from_json_dict, pattern_to_json_dict

positive = st.floats(1e-3, 1e4)


@given(
    cells=arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=5), elements=st.integers(0, 2)),
    dot_size_mm=positive,
    angle_deg=st.floats(-360, 360),
    size_mm=st.tuples(positive, positive),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_pattern_comes_back_from_json_unchanged(cells, dot_size_mm, angle_deg, size_mm, seed):
    pattern = Pattern("tiles", ("red", "green", "blue"), cells, dot_size_mm, angle_deg, size_mm, seed)
    text = json.dumps(pattern_to_json_dict(pattern, "ab" * 32), allow_nan=False)
    back = pattern_from_json_dict(json.loads(text), cells)
    assert vars(back) | {"cells": None} == vars(pattern) | {"cells": None}
    assert np.array_equal(back.cells, cells)


def _description():
    pattern = Pattern("checkerboard", ("black", "white"), np.eye(2, dtype=np.uint8), 0.75, 30.0, (60.0, 40.0))
    return pattern_to_json_dict(pattern, "ab" * 32)


def test_keys_of_others_are_left_alone():
    pattern = pattern_from_json_dict(_description() | {"writer": "somebody"}, np.eye(2, dtype=np.uint8))
    assert pattern.dot_size_mm == 0.75


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"schema": "paxel-model"}, "schema and version must be 'paxel-pattern', 1"),
        ({"version": 2}, "got 'paxel-pattern', 2"),
        ({"size_mm": [1.0]}, "a value has the wrong form"),
        ({"dot_size_mm": "wide"}, "a value has the wrong form"),
        ({"cells": {"rows": 2}}, "key 'columns' is missing"),
        ({"cells": {"rows": 4, "columns": 2}}, r"must be 4 x 2, got \(2, 2\)"),
        ({"colorants": ["black"]}, "below its number of colorants"),
    ],
)
def test_a_broken_description_is_named(change, text):
    with pytest.raises(InputError, match=text):
        pattern_from_json_dict(_description() | change, np.eye(2, dtype=np.uint8))


def test_the_recipe_and_the_shares_stand_in_the_description():
    cells = np.array([[0, 1, 1]], np.uint8)
    pattern = Pattern("stripes", ("black", "white"), cells, 0.75, 30.0, (60.0, 40.0))
    description = pattern_to_json_dict(pattern, "ab" * 32, {"tile_order": ["black", "white", "white"]})
    assert description["recipe"] == {"tile_order": ["black", "white", "white"]}
    assert description["shares"] == {"black": pytest.approx(1 / 3), "white": pytest.approx(2 / 3)}
    assert np.array_equal(pattern_from_json_dict(description, cells).cells, cells)
