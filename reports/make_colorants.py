"""Rebuild colorants.csv, overprints.csv, papers.csv of paxel_runtime/data: smooth reflectances of FOGRA's solids.

The colorants are inks of FOGRA39L by name; the overprints are all its 16 Neugebauer primaries by their recipe; the
papers are the bare stock of FOGRA29L (uncoated).

FOGRA39L gives the colours of the printed solids (XYZ under D50, 2 degrees), not their spectra. Of all
reflectances between 0 and 1 with that very colour, this takes the smoothest in the hyperbolic-tangent form,

    minimise  sum (z[i+1] - z[i])^2   subject to   T^T r = XYZ,   r = (tanh z + 1) / 2,

which stays inside 0..1 by construction (S. A. Burns, "Numerical methods for smoothest reflectance
reconstruction", Color Research and Application 45, 2020: method LHTSS).

Run from a checkout, with colour-science and the measurement file at hand::

    PAXEL_DATA=<folder with print/FOGRA39L.ti3, print/FOGRA29L.ti3> python reports/make_colorants.py
"""

from __future__ import annotations

import os
from pathlib import Path

import colour
import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, XYZ_to_Lab, spectra_to_XYZ

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


def smoothest_reflectance(
    XYZ: NDArray[np.float64], XYZ_of_band: NDArray[np.float64], tolerance: float = 1e-10
) -> NDArray[np.float64]:
    """The (81,) reflectance in 0..1 with colour `XYZ` and least squared slope of z = artanh(2 r - 1).

    Parameters
    ----------
    XYZ : (3,) array
        Wanted colour, Y = 1 for the perfect diffuser.
    XYZ_of_band : (81, 3) array
        Colour of each band of the illuminant: ``reflectance @ XYZ_of_band`` is XYZ.
    tolerance : float
        Newton's method on the stationary point of the Lagrangian ends when no residual exceeds it.
    """
    bands = len(XYZ_of_band)
    difference = np.diff(np.eye(bands), axis=0)
    hessian = 2.0 * difference.T @ difference
    z, multipliers = np.zeros(bands), np.zeros(3)
    for _ in range(100):
        r, slope = (np.tanh(z) + 1.0) / 2.0, 0.5 / np.cosh(z) ** 2
        pull = XYZ_of_band @ multipliers
        residual = np.concatenate((hessian @ z + slope * pull, r @ XYZ_of_band - XYZ))
        if np.abs(residual).max() < tolerance:
            return r
        jacobian = np.zeros((bands + 3, bands + 3))
        jacobian[:bands, :bands] = hessian - np.diag(2.0 * slope * np.tanh(z) * pull)
        jacobian[:bands, bands:] = slope[:, None] * XYZ_of_band
        jacobian[bands:, :bands] = jacobian[:bands, bands:].T
        step = np.linalg.solve(jacobian, -residual)
        step *= min(1.0, 2.0 / np.abs(step[:bands]).max())  # tanh saturates: a longer step in z may not come back
        z, multipliers = z + step[:bands], multipliers + step[bands:]
    raise RuntimeError(f"the smoothest reflectance of XYZ {XYZ} was not found in 100 Newton steps")


def main() -> None:
    """Write the tables and state how well they give back the measured colours."""
    coated, uncoated = (
        read_primaries_XYZ(Path(os.environ["PAXEL_DATA"]) / "print" / name) for name in ("FOGRA39L.ti3", "FOGRA29L.ti3")
    )
    D50 = colour.SDS_ILLUMINANTS["D50"].copy().align(colour.SpectralShape(380, 780, 5)).values
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
            reflectance = np.round(smoothest_reflectance(primaries[cmyk], XYZ_of_band), 5)
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
