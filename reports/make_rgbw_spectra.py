"""Rebuild rgbw.csv, rgbw_response.csv and rgbw_shift*.csv of paxel_runtime/data: a measured projector of four channels.

The measurement (VirtualSky of pysilsub: 4 primaries x 21 levels, 380-780 nm by 1 nm, W/m2/nm) keeps the relation
between its primaries. Spectra: the highest level, weighted onto the 5 nm grid with a triangle of +-5 nm, all scaled
by one factor so that the four at full together have Y = 1. Responses: the area of each level over that of the highest.
The spectrum of a channel changes its shape with the level: what a level has beyond its share of the spectrum at full is
one further spectrum times a curve (the first singular pair; it leaves 0.2 to 1 % of 3 to 9 %).

Run from a checkout, with the measurement at hand::

    PAXEL_DATA=<folder with projector/VirtualSky.csv> python reports/make_rgbw_spectra.py
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ

PRIMARIES = {"red": 2, "green": 1, "blue": 0, "white": 3}  # number of the primary in the measurement
FOLDER = Path(__file__).parent.parent / "paxel_runtime" / "data"
SOURCE = """\
# Measured: VirtualSky.csv of pysilsub 0.1.1 (a projector with red, green, blue and white), MIT licence: see
# LICENSE.pysilsub.
"""
SPECTRA_HEADER = f"""\
# Spectral power of the four channels of a projector at full, on 380-780 nm by 5 nm, per nm.
{SOURCE}# Altered: weighted onto the 5 nm grid with a triangle of +-5 nm, one factor for all so that the four at full
# have Y = 1 (CIE 1931, 2 degrees). reports/make_rgbw_spectra.py rebuilds this file.
"""
RESPONSE_HEADER = f"""\
# Linear intensity of the four channels of a projector at 21 device values.
{SOURCE}# Altered: areas of the spectra over that of the highest level. reports/make_rgbw_spectra.py rebuilds this file.
"""
SHIFT_HEADER = f"""\
# How the spectrum of each channel of a projector changes its shape with the level: the spectrum added to that at
# full times the linear intensity, on 380-780 nm by 5 nm, per nm, in the scale of rgbw.csv.
{SOURCE}# Altered: the first singular pair of what 21 levels differ by. reports/make_rgbw_spectra.py rebuilds this file.
"""
SHIFT_CURVE_HEADER = f"""\
# How much of the spectrum in rgbw_shift.csv each channel adds at 21 device values, 1 at most.
{SOURCE}# reports/make_rgbw_spectra.py rebuilds this file.
"""


def shift_of_shape(levels: NDArray[np.float64], responses: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Added spectra (4, 81) and curves (4, levels), >= 0 in the mean and 1 at most, of spectra (4, levels, 81)."""
    added, curves = [], []
    for spectra, x in zip(levels, responses, strict=True):
        beyond = spectra - np.outer(x, spectra[-1])
        left, values, right = np.linalg.svd(beyond)
        curve, spectrum = left[:, 0], values[0] * right[0]
        highest = curve[np.abs(curve).argmax()]
        left_over = np.linalg.norm(beyond - np.outer(curve, spectrum)) / np.linalg.norm(spectra)
        print(f"shape differs by {np.linalg.norm(beyond) / np.linalg.norm(spectra):.4f}, left {left_over:.4f}")
        added.append(spectrum * highest)
        curves.append(np.clip(curve / highest, 0.0, 1.0))
    return np.array(added), np.array(curves)


def main() -> None:
    """Write the tables and show the white."""
    lines = (Path(os.environ["PAXEL_DATA"]) / "projector" / "VirtualSky.csv").read_text(encoding="utf-8").splitlines()
    wavelengths_nm = np.array(lines[0].split(",")[2:], np.float64)
    table = np.array([line.split(",") for line in lines[1:]], np.float64)
    triangle = np.maximum(0.0, 1.0 - np.abs(WAVELENGTHS_NM[:, None] - wavelengths_nm) / 5.0)
    triangle /= triangle.sum(axis=1, keepdims=True)
    levels = np.stack([table[table[:, 0] == number] for number in PRIMARIES.values()])
    spectra = levels[:, -1, 2:] @ triangle.T
    scale = spectra_to_XYZ(spectra.sum(axis=0))[1]
    spectra /= scale
    areas = levels[..., 2:].sum(axis=-1)
    responses = areas / areas[:, -1:]
    P = levels[0, :, 1] / levels[0, -1, 1]
    assert np.all(np.diff(responses, axis=1) > 0)
    added, curves = shift_of_shape(levels[..., 2:] @ triangle.T / scale, responses)
    names = ",".join(PRIMARIES)
    for name, header, first, keys, columns in (
        ("rgbw.csv", SPECTRA_HEADER, "wavelength_nm", WAVELENGTHS_NM, spectra),
        ("rgbw_response.csv", RESPONSE_HEADER, "P", P, responses),
        ("rgbw_shift.csv", SHIFT_HEADER, "wavelength_nm", WAVELENGTHS_NM, added),
        ("rgbw_shift_response.csv", SHIFT_CURVE_HEADER, "P", P, curves),
    ):
        rows = [f"{key:g}," + ",".join(f"{v:.6e}" for v in row) for key, row in zip(keys, columns.T, strict=True)]
        (FOLDER / name).write_text(header + "\n".join([f"{first},{names}", *rows]) + "\n", encoding="utf-8")
    print("white:", spectra_to_XYZ(spectra.sum(axis=0)), "of each:", spectra_to_XYZ(spectra)[:, 1])


if __name__ == "__main__":
    main()
