"""The colorants of an installation: the library's, and the inks and papers that paxel.toml describes.

Files stand beside paxel.toml and are text, one line a wavelength, its first column in nm (`spectral_files`):

    reflectance    wavelength_nm, reflectance of a solid patch on the paper, 0..1
    emission       wavelength_nm, radiant power that a solid patch emits per nm and per power of exciting light that
                   falls on it: the row of its Donaldson matrix under the light that excites it. What the ink reflects
                   is its reflectance; its area is at most 1. Where the unit is another, `efficiency` says the area.

Everyone who needs to know what a name of a colorant means asks `load_colorants`, or the `Pattern` that carries it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import (
    WAVELENGTHS_NM,
    XYZ_to_linear_sRGB,
    illuminant_D65,
    linear_sRGB_to_sRGB,
    spectra_to_XYZ,
)
from paxel_runtime.model.fluorescence import Fluorescence, excitation_band
from paxel_runtime.model.pattern import Colorant, colorant_library
from paxel_runtime.model.recovery import XYZ_to_reflectance
from paxel_runtime.settings import ColorantSettings, Settings
from paxel_runtime.spectral_files import read_spectra, to_grid

__all__ = ["load_colorants"]

_STEP_NM = float(WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0])
_BRIGHTEST = 1.2
_DARKEST_PAPER = 0.02


def load_colorants(settings: Settings, folder: Path) -> dict[str, Colorant]:
    """Every colorant by name: the library, and over it the tables ``[colorants.NAME]``.

    What a table leaves out is as in the library, where that has the name; of a new ink, the reflectance is the paper's
    (a colourless ink that fluoresces), and it is printed with a plate of its own name, unless `cmyk` says how the
    printer mixes it. A table of ``white`` is the paper; the library's inks keep their transmittance on it.

    Parameters
    ----------
    settings : Settings
    folder : Path
        Of paxel.toml, to which the names of files are relative.

    Raises
    ------
    InputError
        If a file is missing or its spectrum is impossible: which, where and why.
    """
    library, own = dict(colorant_library()), dict(settings.colorants)
    if "white" in own:
        coated = library["white"].reflectance
        library["white"] = paper = _colorant("white", own.pop("white"), library, folder)
        for name, ink in library.items():
            if name != "white":
                library[name] = replace(ink, reflectance=ink.reflectance * paper.reflectance / coated)
    return library | {name: _colorant(name, table, library, folder) for name, table in own.items()}


def _colorant(name: str, table: ColorantSettings, library: dict[str, Colorant], folder: Path) -> Colorant:
    key, known = f"colorants.{name}", library.get(name)
    reflectance = (known or library["white"]).reflectance
    if table.reflectance:
        reflectance = _read_reflectance(folder / table.reflectance, f"{key}.reflectance")
    elif table.XYZ is not None:
        try:
            reflectance = XYZ_to_reflectance(table.XYZ)
        except InputError as error:
            raise InputError(f"{key}.XYZ: {error}") from None
    if name == "white" and reflectance.min() < _DARKEST_PAPER:
        raise InputError(
            f"{key}: the paper must reflect at least {_DARKEST_PAPER} at every wavelength, got {reflectance.min():.3g}"
        )
    fluorescence = known.fluorescence if known else None
    if table.emission:
        fluorescence = _read_emission(folder / table.emission, f"{key}.emission", table)
    colorant = Colorant(name, reflectance, (0.0, 0.0, 0.0, 0.0), "", fluorescence)
    if table.cmyk is not None:
        return replace(colorant, cmyk=table.cmyk, spot=table.spot)
    if known is not None:
        return replace(colorant, cmyk=known.cmyk, spot=table.spot or known.spot)
    return replace(colorant, cmyk=_proof(reflectance, fluorescence), spot=table.spot or name)


def _read_reflectance(path: Path, what: str) -> NDArray[np.float64]:
    (wavelengths_nm, values), *more = read_spectra(path, what).values()
    if more:
        raise InputError(f"{what}: {path} must hold one spectrum, got {1 + len(more)} columns of values")
    for wrong, rule in (
        (values < 0, "must be >= 0"),
        (values > _BRIGHTEST, f"must be at most {_BRIGHTEST:g} (a share, not percent)"),
    ):
        if wrong.any():
            first = int(np.argmax(wrong))
            raise InputError(
                f"{what}: a reflectance {rule}, got {values[first]:g} at {wavelengths_nm[first]:g} nm in {path}"
            )
    return to_grid(wavelengths_nm, values, what)


def _read_emission(path: Path, what: str, table: ColorantSettings) -> Fluorescence:
    (wavelengths_nm, values), *more = read_spectra(path, what).values()
    if more:
        raise InputError(f"{what}: {path} must hold one spectrum, got {1 + len(more)} columns of values")
    if (values < 0).any():
        raise InputError(
            f"{what}: an emission must be >= 0, got {values.min():g} at {wavelengths_nm[int(np.argmin(values))]:g} nm "
            f"in {path}"
        )
    emission = to_grid(wavelengths_nm, values, what, beyond="zero", must_cover_nm=None)
    area = float(emission.sum() * _STEP_NM)
    if not area > 0:
        raise InputError(f"{what}: {path} must emit some visible light, got none between 380 and 780 nm")
    efficiency = area if table.efficiency is None else table.efficiency
    if efficiency > 1:
        raise InputError(
            f"{what}: the area of an emission (power emitted per power received) must be at most 1, got {area:.4g} in "
            f"{path}: if its unit is another, set efficiency"
        )
    return Fluorescence(emission / area, excitation_band(table.excitation_nm, efficiency))


def _proof(reflectance: NDArray[np.float64], fluorescence: Fluorescence | None) -> tuple[float, float, float, float]:
    """A plain CMYK recipe near the colour, for proofs of an ink that has a plate of its own."""
    D65 = illuminant_D65()
    sRGB = linear_sRGB_to_sRGB(XYZ_to_linear_sRGB(spectra_to_XYZ(reflectance * D65) / spectra_to_XYZ(D65)[1]))
    if fluorescence is not None:  # the colour of its light, as a tint
        linear = XYZ_to_linear_sRGB(spectra_to_XYZ(fluorescence.emission))
        sRGB = sRGB * (0.4 + 0.6 * np.clip(linear / linear.max(), 0.0, 1.0))
    c, m, y = (round(float(v), 2) for v in np.clip(1.0 - sRGB, 0.0, 1.0))
    return c, m, y, 0.0
