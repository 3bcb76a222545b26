"""Other light and other sheets: closed forms of XYZ = A x + b."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_design.gamut import JointGamut, lightness_area
from paxel_design.what_if.figures import common_range, room_of
from paxel_design.what_if.light import black_level, with_black, with_columns, with_second_sheet
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel

ModelOf = Callable[[int], PredictionModel]


def full_on_white(model: PredictionModel) -> np.ndarray:
    assert model.white is not None
    return model.white.A.sum(axis=1) + model.white.black


def test_no_change_is_the_same_model(bw_model: ModelOf) -> None:
    model = bw_model(2)
    for same in (with_black(model), with_second_sheet(model, 1.0), with_columns(model, np.ones(6))):
        for name, surface in model.surfaces.items():
            np.testing.assert_allclose(same.surfaces[name].A, surface.A, rtol=1e-12)
            np.testing.assert_allclose(same.surfaces[name].black, surface.black, rtol=1e-12)
        np.testing.assert_allclose(same.white_point, model.white_point, rtol=1e-12)


@settings(max_examples=20)
@given(factor=st.floats(0, 20), ambient=st.floats(0, 2))
def test_black_level_has_its_closed_form_and_white_stays_one(bw_model: ModelOf, factor: float, ambient: float) -> None:
    model = bw_model(2)
    before = black_level(model)
    there = with_black(model, factor, ambient)
    # ambient light is a share of what the projector's inputs give
    light = 1 - before
    expected = (factor * before + ambient * light) / (light + factor * before + ambient * light)
    assert black_level(there) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    # everything is relative to full white on the white paper
    np.testing.assert_allclose(full_on_white(there), there.white_point, rtol=1e-12)
    assert there.white_point[1] == pytest.approx(1.0, rel=1e-12)


def test_ambient_light_falls_on_what_the_pattern_reflects(bw_model: ModelOf) -> None:
    model = bw_model(2)
    there = with_black(model, 0.0, ambient=0.5)
    # a third of all light is ambient then: the pattern shows it with its mean reflectance, as it shows full light
    np.testing.assert_allclose(there.pattern.black, there.pattern.A.sum(axis=1) / 2, rtol=1e-12)


def test_less_black_never_narrows_the_room(bw_model: ModelOf) -> None:
    rooms = [room_of(with_black(bw_model(2), factor)) for factor in (4.0, 1.0, 0.0)]
    assert rooms[0].contrast < rooms[1].contrast < rooms[2].contrast
    assert rooms[0].volume < rooms[1].volume < rooms[2].volume


@pytest.mark.parametrize("luminance", [0.5, 0.3])
def test_a_gray_sheet_shares_the_range_that_the_lightness_area_tells(bw_model: ModelOf, luminance: float) -> None:
    model = bw_model(3)
    gray = with_second_sheet(model, luminance)
    assert full_on_white(gray)[1] == pytest.approx(luminance)
    expected = lightness_area(JointGamut(model)).L_same_by_sheet[luminance]
    # the same search on the same polygon, scaled before or after it was found
    assert common_range(gray) == pytest.approx(expected, abs=1e-6)
    assert common_range(model) is None


def test_columns_change_the_pattern_alone(bw_model: ModelOf) -> None:
    model = bw_model(2)
    factors = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
    there = with_columns(model, factors)
    assert model.white is not None
    assert there.white is not None
    np.testing.assert_allclose(there.pattern.A, model.pattern.A * factors)
    np.testing.assert_array_equal(there.white.A, model.white.A)
    assert room_of(there).contrast > room_of(model).contrast


def test_one_surface_stays_relative_to_its_own_white(bw_model: ModelOf) -> None:
    model = bw_model(2).alone("white")
    for there in (with_black(model, ambient=0.2), with_columns(model, np.full(6, 0.5))):
        np.testing.assert_allclose(there.pattern.A.sum(axis=1) + there.pattern.black, there.white_point, rtol=1e-12)
        assert there.white_point[1] == pytest.approx(1.0)


def test_numbers_out_of_range_are_refused(bw_model: ModelOf) -> None:
    with pytest.raises(InputError, match="factor >= 0 and ambient >= 0, got -1 and 0"):
        with_black(bw_model(2), -1)
    with pytest.raises(InputError, match=r"luminance 0\.\.1, got 1\.5"):
        with_second_sheet(bw_model(2), 1.5)
    with pytest.raises(InputError, match="two surfaces"):
        with_second_sheet(bw_model(2).alone("pattern"), 0.5)
