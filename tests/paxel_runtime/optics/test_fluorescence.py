"""Fluorescence against energy, closed forms, and measured Donaldson matrices (where they are at hand)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.fluorescence import (
    EXCITATION_NM,
    Fluorescence,
    brightener,
    excitation_band,
    fluorescent_triad,
)
from paxel_runtime.optics.fluorescence import donaldson_to_fluorescence, emission_spectra, uv_line
from paxel_runtime.optics.spectra import excitation_spectra, ink_terms, primaries

PAPER = np.full(81, 0.9)
DYES = list(fluorescent_triad().values())


def data_folder() -> Path:
    if "PAXEL_DATA" not in os.environ:
        pytest.skip("PAXEL_DATA is not set: the measurements are not at hand")
    return Path(os.environ["PAXEL_DATA"])


def test_uv_line_is_a_365_nm_led() -> None:
    line = uv_line()
    assert EXCITATION_NM[line.argmax()] == 365.0
    assert line.sum() * 5 == pytest.approx(1.0)
    above_half = EXCITATION_NM[line >= line.max() / 2]
    assert 5.0 <= above_half[-1] - above_half[0] <= 15.0
    assert line[EXCITATION_NM > 380].sum() * 5 < 0.01


def test_uv_line_is_as_wide_as_a_measured_one() -> None:
    values, wavelengths_nm = np.loadtxt(data_folder() / "projector" / "LED_UV_365.txt").T
    values = np.where(np.abs(wavelengths_nm - 373) < 25, values, 0.0)  # without the phosphor and the noise
    width = []
    for x, y in ((wavelengths_nm, values), (EXCITATION_NM, uv_line())):
        mean = (x * y).sum() / y.sum()
        width.append(np.sqrt(((x - mean) ** 2 * y).sum() / y.sum()))
    # The measured LED peaks at 372.8 nm in spite of its name; spectra on 5 nm cannot have its sharper flanks.
    assert width[1] == pytest.approx(width[0], rel=0.35)


def test_the_uv_channel_has_the_power_of_full_white_and_next_to_no_light() -> None:
    white, uv = excitation_spectra(("white", "uv"))
    assert uv.sum() == pytest.approx(white.sum())
    visible = primaries(("white", "uv"))
    np.testing.assert_array_equal(visible[0], white[16:])
    assert spectra_to_XYZ(visible[1])[1] < 1e-4 * spectra_to_XYZ(visible[0])[1]


@pytest.mark.parametrize("dye", [*DYES, brightener()])
def test_no_dye_emits_more_than_it_gets(dye: Fluorescence) -> None:
    assert dye.emission.sum() * 5 == pytest.approx(1.0)
    assert dye.excitation.max() < 1.0
    assert dye.excitation[EXCITATION_NM > 430].max() < 1e-3


def test_a_band_excites_between_its_soft_edges() -> None:
    band = excitation_band((400.0, 460.0), 0.5)
    assert np.interp([400.0, 460.0], EXCITATION_NM, band) == pytest.approx(0.25, rel=1e-3)  # half way up each edge
    assert band[EXCITATION_NM == 430] == pytest.approx(0.5, rel=0.01)
    assert max(band[0], band[-1]) < 1e-8
    assert excitation_band((300.0, 400.0), 0.5)[0] == pytest.approx(0.5)


def test_the_triad_spans_a_gamut() -> None:
    XYZ = spectra_to_XYZ(np.array([dye.emission for dye in DYES]))
    x, y = (XYZ[:, :2] / XYZ.sum(axis=1, keepdims=True)).T
    assert x[0] > 0.6
    assert y[1] > 0.6
    assert max(x[2], y[2]) < 0.2


def test_a_solid_emits_excitation_times_emission() -> None:
    terms = ink_terms(PAPER, np.array([np.full(81, 0.3), np.full(81, 0.5)]))
    light = excitation_spectra(("uv", "green"))
    spectra = emission_spectra(light, terms, {2: DYES[1]})
    solid = spectra[:, 0, 2] + spectra[:, 2, 2]  # terms 1 and the ink's own, on both passages
    expected = (light @ DYES[1].excitation * 5)[:, None] * DYES[1].emission
    np.testing.assert_allclose(solid, expected, rtol=1e-12)
    assert not spectra[:, :, :2].any()  # nothing that enters elsewhere is emitted
    through = spectra[0, 0, 2] + spectra[0, 1, 2]  # what leaves under ink 0 passed it once
    np.testing.assert_allclose(through, expected[0] * np.sqrt(0.3 / 0.9), rtol=1e-12)


def test_ink_on_brightened_paper_dims_uv_and_emission() -> None:
    terms = ink_terms(PAPER, np.full((1, 81), 0.1))
    spectra = emission_spectra(excitation_spectra(("uv",)), terms, {0: brightener()})[0]
    np.testing.assert_allclose(spectra.sum(axis=(0, 1)), spectra[0, 0] * 0.1 / 0.9, rtol=1e-12)


def test_a_product_is_recovered_from_its_matrix() -> None:
    emission_nm, excitation_nm = np.arange(380.0, 781, 10), np.arange(300.0, 781, 10)
    emission = np.exp(-0.5 * ((emission_nm - 560) / 25) ** 2)
    excitation = np.exp(-0.5 * ((excitation_nm - 370) / 25) ** 2)
    matrix = 0.3 * np.outer(emission / emission.sum(), excitation)
    matrix[emission_nm[:, None] == excitation_nm] += 0.5  # reflection
    found = donaldson_to_fluorescence(matrix, emission_nm, excitation_nm)
    np.testing.assert_allclose(np.interp(excitation_nm, EXCITATION_NM, found.excitation), 0.3 * excitation, atol=1e-4)
    assert WAVELENGTHS_NM[found.emission.argmax()] == 560


@pytest.mark.parametrize(
    ("name", "xy"), [("HERPICER", (0.592, 0.313)), ("TEXTYELL", (0.210, 0.625)), ("CIBA12", (0.152, 0.062))]
)
def test_measured_materials_have_their_chromaticity_under_365_nm(name: str, xy: tuple[float, float]) -> None:
    lines = (data_folder() / "fluorescence" / f"{name}.BFC").read_text(encoding="latin-1").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("r:c:"))
    excitation_nm = np.array(lines[start].split()[1:], np.float64)
    cells = [line.split() for line in lines[start + 1 :]]
    rows = np.array([row for row in cells if len(row) == 1 + len(excitation_nm)], np.float64)
    found = donaldson_to_fluorescence(rows[:, 1:], rows[:, 0], excitation_nm)
    XYZ = spectra_to_XYZ(found.emission)
    # One spectrum for all excitation, 10 nm bands, noise cut at 0; the stated xy holds the LED's own light as well.
    np.testing.assert_allclose(XYZ[:2] / XYZ.sum(), xy, atol=0.05)
    assert 0.01 < np.interp(365.0, EXCITATION_NM, found.excitation) < 1.0


def test_impossible_fluorescence_is_refused() -> None:
    good = DYES[0]
    for emission, excitation, words in (
        (good.emission[:80], good.excitation, r"\(81,\)"),
        (2 * good.emission, good.excitation, "area 1"),
        (good.emission, 3 * good.excitation, "0..1"),
    ):
        with pytest.raises(InputError, match=words):
            Fluorescence(emission, excitation)
