"""``measurements.csv``: the meter's readings of a session, a line an exposure.

Knows the file; which exposures there are and what is made of them stands elsewhere.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InstallationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.storage import write_text

__all__ = ["append_measurement", "read_measurements"]


def append_measurement(path: Path, name: str, surface: str, spectrum: NDArray[np.float64]) -> None:
    """Add one reading; a line that a kill cuts short is left out when the file is read again."""
    whole = path.exists() and path.read_bytes()[-1:] == b"\n"
    if path.exists() and not whole:
        text = path.read_text(encoding="utf-8")
        write_text(path, text[: text.rfind("\n") + 1])
    if not path.exists() or path.stat().st_size == 0:
        write_text(path, ",".join(["exposure", "surface", *(f"{w:g}" for w in WAVELENGTHS_NM)]) + "\n")
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow([name, surface, *(f"{value:.9g}" for value in spectrum)])
    with path.open("a", encoding="utf-8") as file:
        file.write(line.getvalue())


def read_measurements(path: Path) -> dict[str, NDArray[np.float64]]:
    """Readings by exposure name, each (81,) on ``WAVELENGTHS_NM``; none without a file.

    A last line without an end, which a kill cut short, is left out.

    Raises
    ------
    InstallationError
        If a line does not hold one number a wavelength.
    """
    if not path.is_file():
        return {}
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InstallationError(f"{path} cannot be read as UTF-8 text: {error}") from None
    text = text[: text.rfind("\n") + 1]
    readings = {}
    for number, row in enumerate(csv.reader(text.splitlines()), 1):
        if number == 1:
            continue
        try:
            name, _, *values = row
            readings[name] = np.array(values, dtype=np.float64)
        except ValueError as error:
            raise InstallationError(f"{path}, line {number}: not a reading ({error})") from None
        if readings[name].shape != WAVELENGTHS_NM.shape:
            raise InstallationError(
                f"{path}, line {number}: a reading needs {len(WAVELENGTHS_NM)} numbers, got {len(values)}"
            )
    return readings
