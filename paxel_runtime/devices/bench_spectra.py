"""The spectra of a projector of your own, for the virtual bench: a file of measurements becomes what `BenchSetup` asks.

The file is a table of wavelength in nm and one column a channel, named in its first line as in ``projector.channels``,
in any unit; columns that are no channel are left out. Wavelengths may begin in the ultraviolet, from 300 nm.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.fluorescence import EXCITATION_NM
from paxel_runtime.optics.spectra import primaries
from paxel_runtime.spectral_files import read_spectra, to_grid

__all__ = ["read_projector_spectra"]

_NO_LIGHT = 0.02


def read_projector_spectra(path: Path, channels: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
    """Spectral power (97,) of each channel on `EXCITATION_NM`, per nm.

    One factor for all: the channels together have Y = 1; where the eye sees less than a fiftieth of what it would of a
    white of that power (a UV projector), they have the power of the built-in projector at full white.

    Raises
    ------
    InputError
        If the file is missing, lacks a channel, or holds no light.
    """
    what = "projector.spectra"
    columns = read_spectra(path, what)
    missing = [name for name in channels if name not in columns]
    if missing:
        raise InputError(
            f"{what}: {path} must have a column for each of projector.channels in its first line; it has "
            f"{', '.join(columns)}, and lacks {', '.join(missing)}"
        )
    spectra = np.array(
        [
            to_grid(*columns[name], f"{what}: {name}", grid_nm=EXCITATION_NM, beyond="zero", must_cover_nm=None)
            for name in channels
        ]
    )
    for name, spectrum in zip(channels, spectra, strict=True):
        if spectrum.min() < 0 or not spectrum.any():
            raise InputError(f"{what}: {path}: {name} must be >= 0 and shine between 300 and 780 nm")
    white = primaries(("white",))[0]
    power, Y = spectra.sum() / white.sum(), spectra_to_XYZ(spectra.sum(axis=0)[-len(WAVELENGTHS_NM) :])[1]
    return dict(zip(channels, spectra / (Y if _NO_LIGHT * power < Y else power), strict=True))
