"""Rebuild rgbw.csv and rgbw_response.csv of paxel_runtime/data: a measured projector of four channels.

The measurement (VirtualSky of pysilsub: 4 primaries x 21 levels, 380-780 nm by 1 nm, W/m2/nm) keeps the relation
between its primaries. Spectra: the highest level, weighted onto the 5 nm grid with a triangle of +-5 nm, all scaled
by one factor so that the four at full together have Y = 1. Responses: the area of each level over that of the highest.

Run from a checkout, with the measurement at hand::

    PAXEL_DATA=<folder with projector/VirtualSky.csv> python reports/make_rgbw_spectra.py
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

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


def main() -> None:
    """Write both tables and show the white."""
    lines = (Path(os.environ["PAXEL_DATA"]) / "projector" / "VirtualSky.csv").read_text(encoding="utf-8").splitlines()
    wavelengths_nm = np.array(lines[0].split(",")[2:], np.float64)
    table = np.array([line.split(",") for line in lines[1:]], np.float64)
    triangle = np.maximum(0.0, 1.0 - np.abs(WAVELENGTHS_NM[:, None] - wavelengths_nm) / 5.0)
    triangle /= triangle.sum(axis=1, keepdims=True)
    levels = np.stack([table[table[:, 0] == number] for number in PRIMARIES.values()])
    spectra = levels[:, -1, 2:] @ triangle.T
    spectra /= spectra_to_XYZ(spectra.sum(axis=0))[1]
    areas = levels[..., 2:].sum(axis=-1)
    responses = areas / areas[:, -1:]
    P = levels[0, :, 1] / levels[0, -1, 1]
    assert np.all(np.diff(responses, axis=1) > 0)
    names = ",".join(PRIMARIES)
    for name, header, first, keys, columns in (
        ("rgbw.csv", SPECTRA_HEADER, "wavelength_nm", WAVELENGTHS_NM, spectra),
        ("rgbw_response.csv", RESPONSE_HEADER, "P", P, responses),
    ):
        rows = [f"{key:g}," + ",".join(f"{v:.6e}" for v in row) for key, row in zip(keys, columns.T, strict=True)]
        (FOLDER / name).write_text(header + "\n".join([f"{first},{names}", *rows]) + "\n", encoding="utf-8")
    print("white:", spectra_to_XYZ(spectra.sum(axis=0)), "of each:", spectra_to_XYZ(spectra)[:, 1])


if __name__ == "__main__":
    main()
