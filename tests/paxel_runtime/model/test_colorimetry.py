"""Plain colorimetry against colour-science and against itself."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.model.colorimetry import (
    D65_XYZ,
    WAVELENGTHS_NM,
    Lab_to_LCh,
    Lab_to_sRGB,
    Lab_to_XYZ,
    LCh_to_Lab,
    XYZ_to_Lab,
    linear_sRGB_to_XYZ,
    observer,
    spectra_to_XYZ,
    sRGB_to_Lab,
)

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # colour-science warns about optional packages
    import colour

channel = st.floats(0, 1)
three = st.tuples(channel, channel, channel)


def test_the_observer_is_cie_1931() -> None:
    cmf = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy()
    theirs = cmf.align(colour.SpectralShape(380, 780, 5)).values
    ours = spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM))) / 5
    assert ours == pytest.approx(theirs, abs=1e-9)  # the table is written with 10 digits


def test_the_other_observer_is_cie_1964_inside_its_block_and_nowhere_else() -> None:
    cmf = colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"].copy()
    theirs = cmf.align(colour.SpectralShape(380, 780, 5)).values
    two = spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM)))
    with observer(10):
        assert spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM))) / 5 == pytest.approx(theirs, abs=1e-9)  # ten digits
    assert np.array_equal(spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM))), two)


def test_the_white_of_sRGB_is_d65() -> None:
    xy = D65_XYZ[:2] / D65_XYZ.sum()
    assert xy == pytest.approx([0.3127, 0.3290], abs=1e-9)  # IEC 61966-2-1 defines it by these digits


@given(three)
def test_Lab_agrees_with_colour_science(XYZ: tuple[float, float, float]) -> None:
    theirs = colour.XYZ_to_Lab(np.array(XYZ), illuminant=D65_XYZ[:2] / D65_XYZ.sum())
    # 1e-3: they keep the rounded 7.787 of older CIE texts below the branch
    assert XYZ_to_Lab(np.array(XYZ), D65_XYZ) == pytest.approx(theirs, abs=1e-3)


@given(three)
def test_Lab_and_XYZ_are_inverse(sRGB: tuple[float, float, float]) -> None:
    Lab = sRGB_to_Lab(np.array(sRGB))
    assert XYZ_to_Lab(Lab_to_XYZ(Lab, D65_XYZ), D65_XYZ) == pytest.approx(Lab, abs=1e-9)
    assert Lab_to_sRGB(Lab) == pytest.approx(sRGB, abs=1e-6)  # the two branches of sRGB meet at 1e-8 only
    assert LCh_to_Lab(Lab_to_LCh(Lab)) == pytest.approx(Lab, abs=1e-9)


def test_negative_XYZ_keep_their_order() -> None:
    Y = np.linspace(-0.01, 0.02, 100)
    L = XYZ_to_Lab(Y[:, None] * D65_XYZ, D65_XYZ)[:, 0]
    assert np.all(np.diff(L) > 0)


def test_sRGB_primaries_agree_with_colour_science() -> None:
    theirs = colour.sRGB_to_XYZ(np.eye(3), apply_cctf_decoding=False)
    assert linear_sRGB_to_XYZ(np.eye(3)) == pytest.approx(theirs, abs=1e-4)  # they round the matrix to 4 digits
