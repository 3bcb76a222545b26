"""Rebuild paxel_runtime/data/dlp.csv: the primaries of a measured DLP-LED projector, balanced to a D65 white.

The measurement (ProPixx of pysilsub: 3 primaries x 18 levels, 380-780 nm by 1 nm, counts, dark-subtracted) is
relative between its primaries, so each spectrum here is

    the mean over the levels from 180 of 255 up, each level scaled to the same area,
    weighted onto the 5 nm grid with a triangle of +-5 nm (the bandpass of a 5 nm instrument),
    scaled so that the three at full together are D65 with Y = 1: XYZ (0.9505, 1, 1.0891).

Run from a checkout, with the measurement at hand::

    PAXEL_DATA=<folder with projector/ProPixx.csv> python reports/make_dlp_spectra.py
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import D65_XYZ, WAVELENGTHS_NM, spectra_to_XYZ

PRIMARIES = {"red": 2, "green": 1, "blue": 0}  # number of the primary in the measurement
LOWEST_LEVEL = 180
TABLE = Path(__file__).parent.parent / "paxel_runtime" / "data" / "dlp.csv"
HEADER = """\
# Spectral power of the three primaries of a DLP-LED projector at full, on 380-780 nm by 5 nm, per nm.
# Measured: ProPixx.csv of pysilsub 0.1.1 (VPixx ProPixx, OceanOptics Jaz), MIT licence: see LICENSE.pysilsub.
# Altered: mean of the levels from 180 of 255 up, weighted onto the 5 nm grid with a triangle of +-5 nm, and the three
# primaries scaled so that full white is D65 with Y = 1 (CIE 1931, 2 degrees; the measurement is relative between
# primaries). reports/make_dlp_spectra.py rebuilds this file.
"""


def read_levels(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths in nm, (m,), and the table's rows: primary, level, then m counts."""
    lines = path.read_text(encoding="utf-8").splitlines()
    wavelengths_nm = np.array(lines[0].split(",")[2:], dtype=np.float64)
    return wavelengths_nm, np.array([line.split(",") for line in lines[1:]], dtype=np.float64)


def balanced_primaries(wavelengths_nm: NDArray[np.float64], table: NDArray[np.float64]) -> NDArray[np.float64]:
    """(81, 3) spectra of red, green and blue on `WAVELENGTHS_NM` whose sum is D65 with Y = 1."""
    distance_nm = np.abs(WAVELENGTHS_NM[:, None] - wavelengths_nm[None, :])
    triangle = np.maximum(0.0, 1.0 - distance_nm / (WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]))
    triangle /= triangle.sum(axis=1, keepdims=True)
    shapes = []
    for number in PRIMARIES.values():
        levels = table[(table[:, 0] == number) & (table[:, 1] >= LOWEST_LEVEL), 2:]
        shapes.append(triangle @ (levels / levels.sum(axis=1, keepdims=True)).mean(axis=0))
    spectra = np.array(shapes)
    return spectra.T * np.linalg.solve(spectra_to_XYZ(spectra).T, D65_XYZ)


def main() -> None:
    """Write the table and show how far its white lies from D65 after rounding."""
    wavelengths_nm, table = read_levels(Path(os.environ["PAXEL_DATA"]) / "projector" / "ProPixx.csv")
    spectra = balanced_primaries(wavelengths_nm, table)
    rows = [f"{nm:.0f}," + ",".join(f"{v:.6e}" for v in row) for nm, row in zip(WAVELENGTHS_NM, spectra, strict=True)]
    TABLE.write_text(HEADER + "\n".join(["wavelength_nm," + ",".join(PRIMARIES), *rows]) + "\n", encoding="utf-8")
    print("white:", spectra_to_XYZ(np.round(spectra, 12).sum(axis=1)), "wanted:", D65_XYZ)


if __name__ == "__main__":
    main()
