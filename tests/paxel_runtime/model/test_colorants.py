import os
from pathlib import Path

import numpy as np
import pytest

from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.pattern import colorant_library

# FOGRA39L.ti3 (Fogra, December 2006): CIELAB of the solids, D50, 2 degrees
FOGRA39_LAB = {
    "white": (95.00, 0.00, -2.00),
    "black": (16.00, 0.00, 0.00),
    "cyan": (55.00, -37.00, -50.00),
    "magenta": (48.00, 74.00, -3.00),
    "yellow": (89.00, -5.00, 93.00),
    "red": (47.00, 68.00, 48.00),
    "green": (50.00, -65.00, 27.00),
    "blue": (24.00, 22.00, -46.00),
}


def test_reflectances_are_physical_and_smooth():
    for colorant in colorant_library().values():
        r = colorant.reflectance
        assert r.min() > 0
        assert r.max() < 1
        # the steepest ink edge known (a sharp-cut filter dye) rises by less than 0.1 in 5 nm
        assert np.abs(np.diff(r)).max() < 0.1


def test_no_overprint_reflects_more_than_twice_its_lightest_ink():
    library = colorant_library()
    overprints = {"red": ("magenta", "yellow"), "green": ("cyan", "yellow"), "blue": ("cyan", "magenta")}
    for name, (one, other) in overprints.items():
        darker = np.minimum(library[one].reflectance, library[other].reflectance)
        # spectra are recovered one by one from three numbers: an overprint can only loosely stay below its inks
        assert np.mean(library[name].reflectance) < 2 * np.mean(darker)


def test_recipes_are_those_of_the_neugebauer_primaries():
    cmyk = {name: colorant.cmyk for name, colorant in colorant_library().items()}
    assert cmyk["white"] == (0, 0, 0, 0)
    assert cmyk["black"] == (0, 0, 0, 1)
    for secondary, (one, other) in {"red": ("magenta", "yellow"), "green": ("cyan", "yellow")}.items():
        assert cmyk[secondary] == tuple(np.maximum(cmyk[one], cmyk[other]))


@pytest.mark.filterwarnings("ignore")  # colour-science warns of optional packages that are not there
def test_colours_are_the_measured_ones():
    colour = pytest.importorskip("colour")
    D50 = colour.SDS_ILLUMINANTS["D50"]
    white_xy = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D50"]
    for name, Lab_measured in FOGRA39_LAB.items():
        spectrum = colour.SpectralDistribution(colorant_library()[name].reflectance, WAVELENGTHS_NM)
        XYZ = colour.sd_to_XYZ(spectrum, illuminant=D50, method="Integration") / 100
        # 0.15: the file rounds XYZ to 0.01 of 100, which is up to 0.11 in a* of black
        assert colour.XYZ_to_Lab(XYZ, white_xy) == pytest.approx(Lab_measured, abs=0.15), name


def test_the_gold_values_are_those_of_the_file():
    if "PAXEL_DATA" not in os.environ:
        pytest.skip("PAXEL_DATA is not set: the characterisation file is not at hand")
    text = (Path(os.environ["PAXEL_DATA"]) / "print" / "FOGRA39L.ti3").read_text(encoding="latin-1")
    rows = [line.split() for line in text.splitlines() if line[:1].isdigit()]
    for name, Lab in FOGRA39_LAB.items():
        cmyk = tuple(100 * v for v in colorant_library()[name].cmyk)
        found = [row for row in rows if tuple(float(v) for v in row[1:5]) == cmyk]
        assert found
        assert tuple(float(v) for v in found[0][8:11]) == Lab
