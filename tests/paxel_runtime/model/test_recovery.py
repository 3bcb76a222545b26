"""Reflectances from colours: the colour comes back, the curve is smooth and possible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import illuminant_D50, spectra_to_XYZ
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.recovery import XYZ_to_reflectance


def colour_of(reflectance: np.ndarray) -> np.ndarray:
    D50 = illuminant_D50()
    return spectra_to_XYZ(reflectance * D50) / spectra_to_XYZ(D50)[1]


def test_illuminant_is_that_of_colour_science() -> None:
    colour = pytest.importorskip("colour")
    D50 = colour.SDS_ILLUMINANTS["D50"]
    np.testing.assert_allclose(illuminant_D50(), [D50[nm] for nm in np.arange(380, 781, 5)], rtol=1e-5)  # 6 digits


@given(st.floats(0.02, 0.95), st.floats(-2.0, 2.0), st.floats(420.0, 700.0), st.floats(30.0, 200.0))
def test_colour_comes_back(level: float, rise: float, middle_nm: float, width_nm: float) -> None:
    """Of any smooth surface; Newton's residual is 1e-10."""
    nm = np.arange(380, 781, 5)
    surface = 1 / (1 + np.exp(-np.log(level / (1 - level)) - rise * np.tanh((nm - middle_nm) / width_nm)))
    found = XYZ_to_reflectance(colour_of(surface))
    np.testing.assert_allclose(colour_of(found), colour_of(surface), atol=1e-8)
    assert found.min() >= 0
    assert found.max() <= 1


def test_gray_is_flat_and_the_library_is_its_own_recovery() -> None:
    np.testing.assert_allclose(XYZ_to_reflectance(colour_of(np.full(81, 0.3))), 0.3, atol=1e-8)
    for name in ("cyan", "black", "yellow"):
        ink = colorant_library()[name].reflectance
        np.testing.assert_allclose(XYZ_to_reflectance(colour_of(ink)), ink, atol=2e-3)  # the table has 5 digits


@pytest.mark.parametrize("XYZ", [(30.0, 40.0, 20.0), (0.9, 0.9, 0.1), (0.0, 0.5, 0.0), (0.2, -0.1, 0.2)])
def test_an_impossible_colour_is_refused(XYZ: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="Y = 1 for the perfect diffuser"):
        XYZ_to_reflectance(XYZ)
