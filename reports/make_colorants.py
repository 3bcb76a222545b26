"""Rebuild colorants.csv, overprints.csv, papers.csv of paxel_runtime/data: smooth reflectances of FOGRA's solids.

The colorants are inks of FOGRA39L by name; the overprints are all its 16 Neugebauer primaries by their recipe; the
papers are the bare stock of FOGRA29L (uncoated).

FOGRA39L gives the colours of the printed solids (XYZ under D50, 2 degrees), not their spectra: of all reflectances
between 0 and 1 with that very colour, this takes the smoothest (`paxel_runtime.model.recovery`).

Run from a checkout, with the measurement file at hand::

    PAXEL_DATA=<folder with print/FOGRA39L.ti3, print/FOGRA29L.ti3> python reports/make_colorants.py
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, XYZ_to_Lab, illuminant_D50, spectra_to_XYZ
from paxel_runtime.model.recovery import XYZ_to_reflectance

CMYK_OF_COLORANT = {
    "white": (0, 0, 0, 0),
    "black": (0, 0, 0, 100),
    "cyan": (100, 0, 0, 0),
    "magenta": (0, 100, 0, 0),
    "yellow": (0, 0, 100, 0),
    "red": (0, 100, 100, 0),
    "green": (100, 0, 100, 0),
    "blue": (100, 100, 0, 0),
}
COLUMNS = ("CMYK_C", "CMYK_M", "CMYK_Y", "CMYK_K", "XYZ_X", "XYZ_Y", "XYZ_Z")
FOLDER = Path(__file__).parent.parent / "paxel_runtime" / "data"
HEADER = """\
# Spectral reflectances (0..1, 380-780 nm by 5 nm) of solid inks on coated paper, and the printer's recipe (CMYK, 0..1).
# Colours: the Neugebauer primaries of FOGRA39L.ti3 (Fogra, www.fogra.org: offset, ISO 12647-2, coated paper, white
# backing, 45/0, XYZ under D50, 2 degrees), from icc-profiles-free, (c) Kai-Uwe Behrmann, zlib licence: see
# LICENSE.fogra-characterisation. This is an altered version: the spectra are not measured, they are the smoothest
# reflectances with the measured XYZ (Burns 2020, LHTSS); reports/make_colorants.py rebuilds them.
"""


def read_primaries_XYZ(path: Path) -> dict[tuple[int, ...], NDArray[np.float64]]:
    """XYZ (Y = 1 for the perfect diffuser, D50) of every patch of a .ti3 file whose inks are all 0 or 100 %."""
    lines = path.read_text(encoding="latin-1").splitlines()
    names = lines[lines.index("BEGIN_DATA_FORMAT") + 1].split()
    rows = [line.split() for line in lines[lines.index("BEGIN_DATA") + 1 : lines.index("END_DATA")]]
    table = np.array([[float(row[names.index(column)]) for column in COLUMNS] for row in rows])
    solids = table[np.isin(table[:, :4], (0.0, 100.0)).all(axis=1)]
    return {tuple(int(v) for v in row[:4]): row[4:] / 100.0 for row in solids}


def main() -> None:
    """Write the tables and state how well they give back the measured colours."""
    coated, uncoated = (
        read_primaries_XYZ(Path(os.environ["PAXEL_DATA"]) / "print" / name) for name in ("FOGRA39L.ti3", "FOGRA29L.ti3")
    )
    D50 = illuminant_D50()
    D50_XYZ = spectra_to_XYZ(D50)
    XYZ_of_band = spectra_to_XYZ(np.diag(D50)) / D50_XYZ[1]
    overprints = {"".join(ink for ink, share in zip("CMYK", cmyk, strict=True) if share) or "paper": cmyk
                  for cmyk in sorted(coated)}  # fmt: skip
    for table, primaries, recipes in (
        ("colorants.csv", coated, CMYK_OF_COLORANT),
        ("overprints.csv", coated, overprints),
        ("papers.csv", uncoated, {"uncoated": (0, 0, 0, 0)}),
    ):
        lines = [",".join(("name", "cmyk_c", "cmyk_m", "cmyk_y", "cmyk_k", *(f"{nm:.0f}" for nm in WAVELENGTHS_NM)))]
        for name, cmyk in recipes.items():
            reflectance = np.round(XYZ_to_reflectance(primaries[cmyk]), 5)
            Lab = XYZ_to_Lab(np.stack((primaries[cmyk], reflectance @ XYZ_of_band)), D50_XYZ / D50_XYZ[1])
            dE76 = float(np.linalg.norm(Lab[0] - Lab[1]))
            L, a, b = Lab[1]
            print(f"{name:8s} Lab {L:6.2f} {a:6.2f} {b:6.2f}   dE76 from the measurement {dE76:.4f}")
            lines.append(",".join((name, *(f"{v / 100:g}" for v in cmyk), *(f"{r:.5f}" for r in reflectance))))
        header = HEADER
        if primaries is uncoated:
            header = header.replace("FOGRA39L", "FOGRA29L").replace("coated", "uncoated")
        (FOLDER / table).write_text(header + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
