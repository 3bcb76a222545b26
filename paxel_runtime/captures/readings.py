"""Readings of any meter, from the files that its software writes: name -> spectrum on the project's grid.

Tables (CSV) with a reading a line or a column, CGATS and Argyll's .ti3, IES TM-27 (.spdx), folders of these, and
objects of colour-science. Tristimulus values stand for the smoothest spectrum that has them: the prediction needs no
more. What a reading looked at is told by its name, that of an exposure of the plan; see `match_to_plan`.
"""

from __future__ import annotations

import csv
import re
import shlex
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.captures.exposures import Exposure
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.spectral_files import read_spectra, to_grid

if TYPE_CHECKING:
    import colour

__all__ = ["XYZ_to_spectra", "load_readings", "match_to_plan", "readings_from_colour"]

Readings = dict[str, NDArray[np.float64]]

_SPECTRAL_FIELD = re.compile(
    r"(?:SPEC(?:TRAL)?(?:_NM)?_?|NM_?|SPECTRAL_NM_?)?(\d{3,4}(?:\.\d+)?)(?:_?NM)?", re.IGNORECASE
)
_XYZ = (("x", "y", "z"), ("xyz_x", "xyz_y", "xyz_z"))
_NAMES = ("exposure", "name", "sample_name", "reading", "sample_id", "id")
_TABLES = (".csv", ".txt", ".tsv")
_CGATS = (".ti3", ".cgats", ".it8", ".cie", ".cgt")


def load_readings(path: Path) -> Readings:
    """Read every reading of a file, or of all files in a folder.

    - ``.csv``, ``.txt``, ``.tsv``: a reading a line under a header (a column ``exposure`` or ``name``, then a column a
      wavelength in nm, or ``X``, ``Y``, ``Z``), as Paxel's own ``measurements.csv``; or a wavelength a line, and a
      reading a column.
    - ``.ti3`` and other CGATS: ``SAMPLE_NAME`` (or ``SAMPLE_ID``), and ``SPEC_380 ...`` or ``XYZ_X XYZ_Y XYZ_Z``.
    - ``.spdx`` (IES TM-27): one reading, called as the file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict of name -> (81,) float64 array
        On ``WAVELENGTHS_NM``, in the file's own unit, in the file's order. Beyond the meter's range there is no light.

    Raises
    ------
    InputError
        If the file cannot be read as one of these, a row holds something else than finite numbers or lacks some, a
        name stands twice, or a spectrum does not cover the visible range: with the row.
    """
    if path.is_dir():
        known = [p for p in sorted(path.iterdir()) if p.suffix.lower() in (*_TABLES, *_CGATS, ".spdx")]
        if not known:
            raise InputError(f"{path} must hold readings ({', '.join((*_TABLES, *_CGATS, '.spdx'))}), got none")
        return _joined((p, load_readings(p)) for p in known)
    suffix = path.suffix.lower()
    if suffix == ".spdx":
        return {path.stem: _read_spdx(path)}
    text = _text(path)
    if suffix in _CGATS or re.search(r"^BEGIN_DATA\b", text, re.MULTILINE):
        return _from_rows(path, *_cgats_rows(path, text))
    rows = _csv_rows(text)
    if rows and _columns(rows[0][1]) is not None:
        return _from_rows(path, rows[0][1], rows[1:])
    return {
        name: _on_grid(nm, values, f"{path}, column {name}")
        for name, (nm, values) in read_spectra(path, "readings").items()
    }


def readings_from_colour(
    spectra: colour.MultiSpectralDistributions | Sequence[colour.SpectralDistribution] | Mapping[str, Any],
) -> Readings:
    """Readings from spectral distributions of colour-science: one of many, several, or several under their names.

    Raises
    ------
    InputError
        If a spectrum does not cover the visible range, or a name stands twice.
    """
    if isinstance(spectra, Mapping):
        columns = [(name, one.wavelengths, one.values) for name, one in spectra.items()]
    elif isinstance(spectra, Sequence):
        columns = [(one.name, one.wavelengths, one.values) for one in spectra]
    else:
        values = np.reshape(spectra.values, (len(spectra.wavelengths), -1))
        columns = [(name, spectra.wavelengths, one) for name, one in zip(spectra.labels, values.T, strict=True)]
    names = [str(name) for name, _, _ in columns]
    if len(set(names)) != len(names):
        raise InputError(f"readings must have different names, got {', '.join(names)}")
    return {str(name): _on_grid(nm, one, f"reading {name}") for name, nm, one in columns}


def match_to_plan(readings: Mapping[str, NDArray[np.float64]], plan: Iterable[Exposure]) -> Readings:
    """Readings under the names of the plan, in the plan's order.

    Readings are found by name. Where every name is a number (1, 2, ...: a meter that counts), they are taken in the
    order of the plan.

    Raises
    ------
    InputError
        If a name is not in the plan, or counted readings are fewer or more than planned.
    """
    planned = [e.name for e in plan if e.device == "meter"]
    if readings and all(re.fullmatch(r"\D{0,3}0*\d+", name) for name in readings):
        if len(readings) != len(planned):
            raise InputError(
                f"{len(planned)} readings are planned, got {len(readings)} that are only counted: name each after its "
                f"exposure ({planned[0]}, ...), as captures/exposures.json lists them, or measure what is missing"
            )
        return dict(zip(planned, readings.values(), strict=True))
    unknown = [name for name in readings if name not in set(planned)]
    if unknown:
        raise InputError(
            f"readings must be named as in captures/exposures.json ({planned[0]}, ...), got {unknown[0]!r}"
            + (f" and {len(unknown) - 1} more that are not" if len(unknown) > 1 else "")
        )
    return {name: np.asarray(readings[name]) for name in planned if name in readings}


def XYZ_to_spectra(XYZ: ArrayLike) -> NDArray[np.float64]:
    """Spectra (..., 81) that have tristimulus values XYZ (..., 3): of all, those with the least energy.

    They are linear in XYZ, so that differences and sums of readings stay right; they are no real light's.
    """
    basis = spectra_to_XYZ(np.eye(len(WAVELENGTHS_NM)))  # (81, 3)
    return np.asarray(XYZ, np.float64) @ np.linalg.pinv(basis)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"there is no file of readings {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read as UTF-8 text: {error}") from None


def _joined(parts: Iterable[tuple[Path, Readings]]) -> Readings:
    readings: Readings = {}
    for path, part in parts:
        for name, spectrum in part.items():
            if name in readings:
                raise InputError(f"{path}: the reading {name} stands in another file of this folder too")
            readings[name] = spectrum
    return readings


def _csv_rows(text: str) -> list[tuple[int, list[str]]]:
    """Number and cells of every line that is no comment."""
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
    delimiter = next((sign for sign in "\t;" if lines and sign in lines[0][1]), ",")
    return [(n, [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]) for n, line in lines]


def _cgats_rows(path: Path, text: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Fields and rows of the first table of a CGATS file."""
    fields: list[str] = []
    rows: list[tuple[int, list[str]]] = []
    part = ""
    for number, line in enumerate(text.splitlines(), 1):
        word = line.strip().split(maxsplit=1)[0] if line.strip() else ""
        if word == "END_DATA":
            break
        if word in ("BEGIN_DATA_FORMAT", "BEGIN_DATA"):
            part = word
        elif word == "END_DATA_FORMAT":
            part = ""
        elif part == "BEGIN_DATA_FORMAT":
            fields += line.split()
        elif part == "BEGIN_DATA" and word and not word.startswith("#"):
            try:
                rows.append((number, shlex.split(line)))
            except ValueError as error:
                raise InputError(f"{path}, line {number}: not a row of a CGATS table ({error})") from None
    if not fields or not rows:
        raise InputError(f"{path} must hold a CGATS table (BEGIN_DATA_FORMAT ... BEGIN_DATA ...), got none")
    return fields, rows


def _columns(header: Sequence[str]) -> tuple[int | None, list[int], NDArray[np.float64] | None] | None:
    """Places of the name and of the values in a header, and their wavelengths (None: XYZ); None if it is no header."""
    low = [cell.lower() for cell in header]
    name = next((low.index(word) for word in _NAMES if word in low), None)
    spectral = [(i, float(m[1])) for i, cell in enumerate(header) if (m := _SPECTRAL_FIELD.fullmatch(cell))]
    if len(spectral) >= 2 and (name is not None or len(spectral) < len(header)):
        spectral.sort(key=lambda pair: pair[1])
        return name, [i for i, _ in spectral], np.array([nm for _, nm in spectral])
    for words in _XYZ:
        if all(word in low for word in words):
            return name, [low.index(word) for word in words], None
    return None


def _from_rows(path: Path, header: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> Readings:
    found = _columns(header)
    if found is None:
        raise InputError(
            f"{path} must have a column for each wavelength (SPEC_380, ... or 380, ...) or X, Y, Z, "
            f"got {', '.join(header[:6])}, ..."
        )
    name_at, places, nm = found
    readings: Readings = {}
    for count, (number, row) in enumerate(rows, 1):
        name = row[name_at] if name_at is not None and name_at < len(row) else str(count)
        what = f"{path}, line {number} (reading {name})"
        if len(row) != len(header):
            raise InputError(f"{what} must have {len(header)} cells as the header, got {len(row)}: measure it again")
        try:
            values = np.array([row[i] for i in places], np.float64)
        except ValueError:
            raise InputError(f"{what} must hold numbers with a decimal point, got {row[places[0]]!r}, ...") from None
        if not np.all(np.isfinite(values)):
            raise InputError(f"{what} must hold finite numbers, got NaN or infinity: measure it again")
        if name in readings:
            raise InputError(f"{what} stands twice: are rows mixed up? Take one out, or name it after its exposure")
        readings[name] = XYZ_to_spectra(values) if nm is None else _on_grid(nm, values, what)
    if not readings:
        raise InputError(f"{path} holds no reading")
    return readings


def _read_spdx(path: Path) -> NDArray[np.float64]:
    """The spectrum of an IES TM-27-14 file."""
    try:
        root = ET.fromstring(_text(path))
    except ET.ParseError as error:
        raise InputError(f"{path} is not an IES TM-27 file: {error}") from None
    points = [node for node in root.iter() if node.tag.rpartition("}")[2] == "SpectralData"]
    try:
        table = np.array(sorted((float(node.attrib["wavelength"]), float(node.text or "")) for node in points))
    except (KeyError, ValueError):
        raise InputError(f"{path}: every SpectralData must have a wavelength and a number") from None
    if len(table) < 2:
        raise InputError(f"{path} must hold SpectralData at two wavelengths at least, got {len(table)}")
    return _on_grid(table[:, 0], table[:, 1], str(path))


def _on_grid(nm: ArrayLike, values: ArrayLike, what: str) -> NDArray[np.float64]:
    values = np.asarray(values, np.float64)
    if not np.all(np.isfinite(values)):
        raise InputError(f"{what} must hold finite numbers, got NaN or infinity: measure it again")
    return to_grid(nm, values, what, beyond="zero")
