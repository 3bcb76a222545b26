"""CAM16-UCS against colour-science, and what any such space has to fulfil."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.model.cam16 import ADAPTING_CD_M2, CAM16_UCS_difference, XYZ_to_CAM16_UCS
from paxel_runtime.model.colorimetry import D65_XYZ

WHITE = np.array([0.93, 1.0, 1.2])


def test_it_is_what_colour_science_computes() -> None:
    colour = pytest.importorskip("colour", reason="colour-science is a test extra")
    XYZ = np.random.default_rng(0).uniform(0.01, 1, (50, 3)) * WHITE
    cam = colour.XYZ_to_CAM16(
        100 * XYZ,
        100 * WHITE,
        ADAPTING_CD_M2,
        20.0,
        colour.VIEWING_CONDITIONS_CAM16["Average"],
        discount_illuminant=False,
    )
    expected = colour.JMh_CAM16_to_CAM16UCS(np.stack([cam.J, cam.M, cam.h], axis=-1))
    expected = expected * (1 if colour.get_domain_range_scale() == "reference" else 100)
    np.testing.assert_allclose(XYZ_to_CAM16_UCS(XYZ, WHITE), expected, atol=1e-6)  # constants of six digits


@given(st.floats(0.001, 1.0))
def test_grays_have_no_chroma_worth_the_name_and_white_is_100(Y: float) -> None:
    Jab = XYZ_to_CAM16_UCS(Y * WHITE, WHITE)
    assert np.hypot(Jab[1], Jab[2]) < 4.0  # adaptation to this bluish white is not complete (D = 0.86 at 20 cd/m2)
    assert Jab[0] <= XYZ_to_CAM16_UCS(WHITE, WHITE)[0] + 1e-9
    assert XYZ_to_CAM16_UCS(WHITE, WHITE)[0] == pytest.approx(100.0)


def test_equal_colours_do_not_differ_and_noise_below_black_is_none() -> None:
    XYZ = np.array([[0.2, 0.3, 0.1], [-1e-4, -1e-4, -1e-4]])
    assert np.all(CAM16_UCS_difference(XYZ, XYZ, D65_XYZ) == 0)
    assert np.all(np.isfinite(XYZ_to_CAM16_UCS(XYZ, D65_XYZ)))
