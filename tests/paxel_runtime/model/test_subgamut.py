"""Sub-gamuts as data: slack is a distance, and boxes have closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model import subgamut
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ
from paxel_runtime.model.subgamut import LabField, PairGamut, SubGamut, subgamut_from_arrays

BOX = np.concatenate((np.eye(3), -np.eye(3)))
POINTS = arrays(np.float64, (7, 3), elements=st.floats(-1, 2))


def box(low: NDArray[np.float64], high: NDArray[np.float64]) -> SubGamut:
    return SubGamut("full", "pattern", BOX, np.concatenate((high, -low)), D65_XYZ)


@given(POINTS)
def test_slack_in_a_box_is_the_distance_to_its_nearest_face(XYZ: NDArray[np.float64]) -> None:
    low, high = np.array([0.1, 0.2, 0.0]), np.array([0.5, 0.4, 0.9])
    expected = np.minimum(XYZ - low, high - XYZ).min(axis=-1)
    gamut = box(low, high)
    # 1e-15: one rounding of numbers of size 1.
    np.testing.assert_allclose(gamut.slack(XYZ), expected, atol=1e-15)
    np.testing.assert_array_equal(gamut.contains(XYZ, 1e-3), expected >= -1e-3)


def test_the_leading_axes_are_free_and_blocks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    XYZ = np.random.default_rng(0).random((4, 5, 3))
    gamut = box(np.zeros(3), np.full(3, 0.5))
    whole = gamut.slack(XYZ)
    monkeypatch.setattr(subgamut, "_BLOCK", 12)
    np.testing.assert_array_equal(gamut.slack(XYZ), whole)
    assert whole.shape == (4, 5)
    assert gamut.slack(XYZ[0, 0]).shape == ()


def test_the_gray_range_is_where_the_gray_axis_runs_through() -> None:
    low, high = Lab_to_XYZ([[20.0, 0, 0], [70.0, 0, 0]], D65_XYZ)
    # 1e-9: a few roundings, times 116 for CIELAB.
    assert box(low, high).gray_range() == pytest.approx((20, 70), abs=1e-9)


def test_a_flat_set_that_holds_the_gray_axis_has_a_gray_range() -> None:
    across = np.cross(D65_XYZ, [1.0, 0, 0])
    across /= np.linalg.norm(across)
    normals = np.concatenate((BOX, across[None], -across[None]))
    offsets = np.concatenate((0.5 * D65_XYZ, np.zeros(3), [0.0, 0.0]))
    low, high = SubGamut("full", "pattern", normals, offsets, D65_XYZ).gray_range()
    # L* of Y = 1/2 is 76.07 (CIE 15:2018, section 8.2.1).
    assert (low, high) == pytest.approx((0, 116 * 0.5 ** (1 / 3) - 16), abs=1e-6)


@pytest.mark.parametrize(
    ("low", "high"),
    [
        (np.array([0.5, 0.0, 0.0]), np.array([0.6, 0.1, 0.1])),  # a saturated red
        (0.3 * D65_XYZ, np.array([0.3 * D65_XYZ[0], 1, 1])),  # touches the axis in one point
    ],
)
def test_a_set_without_grays_says_so(low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
    with pytest.raises(GamutError, match=r"full\.on-pattern must hold a stretch of the gray axis"):
        box(low, high).gray_range()


def test_rows_along_the_axis_that_shut_it_out_leave_no_gray() -> None:
    across = np.cross(D65_XYZ, [1.0, 0, 0])
    across /= np.linalg.norm(across)
    normals, offsets = np.concatenate((BOX, across[None])), np.append(np.concatenate((D65_XYZ, np.zeros(3))), -0.01)
    with pytest.raises(GamutError, match="it holds none"):
        SubGamut("full", "white", normals, offsets, D65_XYZ).gray_range()


def test_the_file_stem_names_effect_and_surface() -> None:
    gamut = SubGamut("neutralize-50_0_0", "white", BOX, np.ones(6), D65_XYZ)
    assert gamut.file_stem == "neutralize-50_0_0.on-white"


@given(POINTS, POINTS)
def test_in_a_product_of_boxes_the_slack_of_a_pair_is_the_smaller_one(
    XYZ_pattern: NDArray[np.float64], XYZ_white: NDArray[np.float64]
) -> None:
    pattern, white = box(np.zeros(3), np.full(3, 0.4)), box(np.zeros(3), np.full(3, 0.9))
    none = np.zeros_like(BOX)
    pairs = PairGamut(
        np.block([[pattern.normals, none], [none, white.normals]]), np.append(pattern.offsets, white.offsets), D65_XYZ
    )
    expected = np.minimum(pattern.slack(XYZ_pattern), white.slack(XYZ_white))
    np.testing.assert_array_equal(pairs.slack(XYZ_pattern, XYZ_white), expected)
    np.testing.assert_array_equal(pairs.contains(XYZ_pattern, XYZ_white, 0.0), expected >= 0)
    # One colour beside many: broadcast, as arrays do.
    assert pairs.slack(XYZ_pattern, XYZ_white[0]).shape == (7,)


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"shown_on": "wall"}, "shown_on must be one of pattern, white"),
        ({"normals": np.eye(6)}, r"normals \(m, 3\)"),
        ({"offsets": np.ones(5)}, r"offsets \(m,\)"),
        ({"normals": 2 * BOX}, "length 1"),
        ({"offsets": np.full(6, np.nan)}, "finite"),
        ({"white_point": np.array([1.0, 0, 1])}, "white point"),
    ],
)
def test_data_that_make_no_sense_are_refused(changes: dict[str, object], rule: str) -> None:
    fields = {"effect": "full", "shown_on": "white", "normals": BOX, "offsets": np.ones(6), "white_point": D65_XYZ}
    with pytest.raises(InputError, match=rule):
        SubGamut(**fields | changes)  # type: ignore[arg-type]


def test_colours_of_another_shape_are_refused() -> None:
    with pytest.raises(InputError, match=r"\(\.\.\., 3\)"):
        box(np.zeros(3), np.ones(3)).slack(np.zeros((4, 6)))


def test_a_field_is_linear_between_its_nodes_and_cuts_the_half_spaces() -> None:
    def plane(Lab: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(60 - Lab[..., 0] + 0.3 * Lab[..., 1] - 0.2 * Lab[..., 2], np.float64)

    origin = np.array([-10.0, -60, -60])
    nodes = origin + 4.0 * np.moveaxis(np.indices((31, 31, 31)), 0, -1)
    field = LabField(origin, 4.0, plane(nodes).astype(np.float32))
    Lab = np.random.default_rng(0).uniform([0, -50, -50], [100, 50, 50], (100, 3))
    # 1e-4: nodes in 32 bits.
    np.testing.assert_allclose(field.at(Lab), plane(Lab), atol=1e-4)
    wide = box(np.zeros(3), np.full(3, 2.0))
    cut = SubGamut("x", "pattern", wide.normals, wide.offsets, wide.white_point, field)
    XYZ = Lab_to_XYZ(Lab, D65_XYZ)
    np.testing.assert_array_equal(cut.contains(XYZ), wide.contains(XYZ) & (field.at(Lab) >= -1e-7))
    assert cut.gray_range()[1] == pytest.approx(60, abs=0.1), "asked at steps of 0.05"
    arrays = {"effect": np.array("x"), "shown_on": np.array("pattern"), "normals": cut.normals, "offsets": cut.offsets,
              "white_point": cut.white_point, "field": field.values, "field_origin": origin,
              "field_step": np.array(4.0)}  # fmt: skip
    np.testing.assert_array_equal(subgamut_from_arrays(arrays).slack(XYZ), cut.slack(XYZ))
    with pytest.raises(InputError, match="field needs"):
        LabField(origin, 0.0, field.values)
    none = SubGamut(
        "x", "pattern", wide.normals, wide.offsets, D65_XYZ, LabField(origin, 4.0, -np.ones((31, 31, 31), np.float32))
    )
    with pytest.raises(GamutError, match="gray axis"):
        none.gray_range()
