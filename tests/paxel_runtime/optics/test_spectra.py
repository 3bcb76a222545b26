"""Spectra and response curves of projectors other than the default, and of ambient light."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import D65_XYZ, WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.optics.spectra import RESPONSES, ambient_spectrum, primaries, response, response_table

RGBW = ("red", "green", "blue", "white")


def test_the_four_channels_together_have_Y_1() -> None:
    XYZ = spectra_to_XYZ(primaries(RGBW, "rgbw"))
    assert XYZ[:, 1].sum() == pytest.approx(1.0, abs=1e-6)  # a table of 7 digits
    x, y = (XYZ[:, :2] / XYZ.sum(axis=1, keepdims=True)).T
    assert x[0] > 0.6
    assert y[1] > 0.55
    assert y[2] < 0.15
    # A channel of its own: white is no mixture of the other three.
    rest = np.linalg.lstsq(primaries(RGBW[:3], "rgbw").T, primaries(("white",), "rgbw")[0], rcond=None)[1]
    assert np.sqrt(rest[0]) > 0.01 * np.linalg.norm(primaries(("white",), "rgbw"))


def test_the_four_channels_are_the_measured_ones() -> None:
    if "PAXEL_DATA" not in os.environ:
        pytest.skip("PAXEL_DATA is not set: the measurement is not at hand")
    text = (Path(os.environ["PAXEL_DATA"]) / "projector" / "VirtualSky.csv").read_text(encoding="utf-8")
    header, *lines = text.splitlines()
    wavelengths_nm = np.array(header.split(",")[2:], np.float64)
    table = np.array([line.split(",") for line in lines], np.float64)
    for name, number in zip(RGBW, (2, 1, 0, 3), strict=True):
        levels = table[table[:, 0] == number]
        measured, ours = levels[-1, 2:], primaries((name,), "rgbw")[0]
        means = [(s * w).sum() / s.sum() for s, w in ((measured, wavelengths_nm), (ours, WAVELENGTHS_NM))]
        assert means[0] == pytest.approx(means[1], abs=0.5)  # nm; a triangle of +-5 nm is symmetric
        areas = levels[:, 2:].sum(axis=1) / measured.sum()
        np.testing.assert_allclose(response(levels[:, 1] / 260, 0, "rgbw", name), areas, atol=1e-6)


@pytest.mark.parametrize("curve", RESPONSES)
def test_every_curve_rises_from_0_to_1(curve: str) -> None:
    x = response(np.linspace(0, 1, 1025), 0, curve, "green")
    assert (x[0], x[-1]) == (pytest.approx(0.0, abs=1e-12), pytest.approx(1.0))
    assert np.all(np.diff(x) > 0)


def test_presets_are_the_benchs_own_curves() -> None:
    P = np.linspace(0, 1, 33)
    for channel, name in enumerate(("red-preset", "green-preset", "blue-preset")):
        np.testing.assert_array_equal(response(P, 0, name), response(P, channel))
    np.testing.assert_array_equal(response_table(2, 8, ("", ""), ("red", "green")), response_table(2, 8))


def test_the_measured_curve_is_no_power_law() -> None:
    P = np.array([0.1, 0.3, 0.6])
    exponents = np.log(response(P, 0, "rgbw", "blue")) / np.log(P)
    assert np.ptp(exponents) > 0.1


def test_ambient_light_is_D65() -> None:
    XYZ = spectra_to_XYZ(ambient_spectrum()[-81:])
    np.testing.assert_allclose(XYZ, D65_XYZ, rtol=1e-3)  # sRGB's white is D65's to 4 digits


def test_an_unknown_projector_is_named() -> None:
    with pytest.raises(InputError, match="lantern"):
        primaries(("red",), "lantern")
    with pytest.raises(InputError, match="violet"):
        primaries(("red", "violet"), "rgbw")
