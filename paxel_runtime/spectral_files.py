"""Spectra as people have them: comma-separated tables of any step, read onto the project's grid.

The first column is the wavelength in nm, every further one a spectrum; a first line of names is optional, lines that
start with # are comments. What a spectrum means is not known here.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM

__all__ = ["VISIBLE_NM", "read_spectra", "to_grid"]

VISIBLE_NM = (420.0, 680.0)
"""What a spectrum must cover at least: beyond, the eye is below 1 % of its peak, and instruments may end."""


def read_spectra(path: Path, what: str) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Wavelengths and values of every column, by its name (``"1"``, ``"2"``, ... where there are no names).

    Parameters
    ----------
    path : Path
        UTF-8 text, separated by commas, semicolons or tabs.
    what : str
        What it is, for errors: ``"colorants.silver.reflectance"``.

    Raises
    ------
    InputError
        If the file is missing, no table of finite numbers, or its wavelengths do not rise.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{what}: there is no file {path}; its name is relative to the folder of paxel.toml") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{what}: {path} cannot be read as UTF-8 text: {error}") from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
    delimiter = next((sign for sign in ";\t" if lines and sign in lines[0][1]), ",")
    rows = [(n, [cell.strip() for cell in row]) for n, line in lines for row in csv.reader([line], delimiter=delimiter)]
    names: list[str] = []
    if rows and not _is_number(rows[0][1][0]):
        names = rows.pop(0)[1][1:]
    width = len(rows[0][1]) if rows else 0
    if len(rows) < 2 or width < 2:
        raise InputError(f"{what}: {path} must hold lines such as 400,0.52 (wavelength in nm, value), two at least")
    for number, row in rows:
        if len(row) != width or not all(map(_is_number, row)):
            raise InputError(
                f"{what}: {path}, line {number}: must hold {width} numbers, got {delimiter.join(row)!r}; decimals are "
                "written with a point"
            )
    table = np.array([row for _, row in rows], np.float64)
    if not np.isfinite(table).all():
        bad = rows[int(np.argmin(np.isfinite(table).all(axis=1)))]
        raise InputError(f"{what}: {path}, line {bad[0]}: must be finite numbers, got {', '.join(bad[1])}")
    steps = np.diff(table[:, 0])
    if steps.min() <= 0:
        raise InputError(f"{what}: {path}, line {rows[int(np.argmin(steps)) + 1][0]}: wavelengths must rise")
    if len(names) != width - 1 or len(set(names)) != len(names):
        names = [str(i) for i in range(1, width)]
    return {name: (table[:, 0], column) for name, column in zip(names, table.T[1:], strict=True)}


def to_grid(
    wavelengths_nm: ArrayLike,
    values: ArrayLike,
    what: str,
    *,
    grid_nm: NDArray[np.float64] = WAVELENGTHS_NM,
    beyond: Literal["hold", "zero"] = "hold",
    must_cover_nm: tuple[float, float] | None = VISIBLE_NM,
) -> NDArray[np.float64]:
    """A spectrum on the project's grid of 5 nm, or another of that step.

    Parameters
    ----------
    wavelengths_nm, values : (n,) arrays
        Rising wavelengths. Steps below 5 nm are weighted with a triangle of +-5 nm (CIE 15:2018), wider ones are
        interpolated.
    what : str
        What it is, for errors.
    grid_nm : (m,) array
    beyond : "hold" | "zero"
        What the spectrum is beyond its ends: as at the end, or nothing.
    must_cover_nm : (low, high), optional

    Returns
    -------
    (m,) float64 array

    Raises
    ------
    InputError
        If the spectrum does not cover what it must.
    """
    x, y = np.asarray(wavelengths_nm, np.float64), np.asarray(values, np.float64)
    low, high = must_cover_nm or (x[-1], x[0])
    if x[0] > low or x[-1] < high:
        raise InputError(
            f"{what} must cover {low:g} to {high:g} nm, got {x[0]:g} to {x[-1]:g}: wavelengths are in nanometres"
        )
    step_nm = float(grid_nm[1] - grid_nm[0])
    left, right = (y[0], y[-1]) if beyond == "hold" else (0.0, 0.0)
    if np.diff(x).min() >= step_nm - 1e-9:
        return np.interp(grid_nm, x, y, left, right)
    fine_nm = np.arange(grid_nm[0] - step_nm, grid_nm[-1] + step_nm + 0.5, 1.0)
    fine = np.interp(fine_nm, x, y, left, right)
    triangle = np.maximum(0.0, 1.0 - np.abs(grid_nm[:, None] - fine_nm) / step_nm)
    return np.asarray(triangle / triangle.sum(axis=1, keepdims=True) @ fine)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
