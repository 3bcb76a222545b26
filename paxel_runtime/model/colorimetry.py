"""Plain colorimetry: spectra -> XYZ, XYZ <-> CIELAB under our own white, LCh, sRGB.

Scales: ``XYZ`` has Y = 1 for the white point; ``Lab`` is CIELAB relative to a white point given by the caller;
``sRGB`` is 0..1 encoded, ``linear_sRGB`` 0..1 linear. The last axis is the channel; leading axes are free.
This file knows nothing of projectors, patterns or clusters.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.resources import files
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "D65_XYZ",
    "WAVELENGTHS_NM",
    "LCh_to_Lab",
    "Lab_to_LCh",
    "Lab_to_XYZ",
    "Lab_to_sRGB",
    "XYZ_to_Lab",
    "XYZ_to_linear_sRGB",
    "illuminant_D50",
    "illuminant_D65",
    "linear_sRGB_to_XYZ",
    "linear_sRGB_to_sRGB",
    "observer",
    "sRGB_to_Lab",
    "sRGB_to_linear_sRGB",
    "spectra_to_XYZ",
]

WAVELENGTHS_NM: NDArray[np.float64] = np.arange(380.0, 780.1, 5.0)
"""The project's one spectral grid: 380 to 780 nm by 5 nm, (81,)."""

_LINEAR_SRGB_TO_XYZ = np.array(
    [
        [0.4123907992659595, 0.35758433938387796, 0.1804807884018343],
        [0.21263900587151036, 0.7151686787677559, 0.07219231536073371],
        [0.01933081871559185, 0.11919477979462599, 0.9505321522496607],
    ]
)
_XYZ_TO_LINEAR_SRGB = np.linalg.inv(_LINEAR_SRGB_TO_XYZ)

D65_XYZ: NDArray[np.float64] = _LINEAR_SRGB_TO_XYZ.sum(axis=1)
"""White of sRGB (D65), Y = 1, (3,)."""

_EPSILON = (6.0 / 29.0) ** 3
_KAPPA = (29.0 / 3.0) ** 3


_OBSERVERS = {2: "cie_1931_2deg_5nm.csv", 10: "cie_1964_10deg_5nm.csv"}
_observer_deg: ContextVar[int] = ContextVar("observer_deg", default=2)


@contextmanager
def observer(degrees: Literal[2, 10]) -> Iterator[None]:
    """Let `spectra_to_XYZ` see with the CIE 1931 2-degree or the CIE 1964 10-degree observer inside a ``with`` block.

    The one place where the observer is chosen: whatever is computed from spectra in the block follows.
    """
    token = _observer_deg.set(degrees)
    try:
        yield
    finally:
        _observer_deg.reset(token)


@cache
def _color_matching_functions(degrees: int) -> NDArray[np.float64]:
    """CIE standard observer on `WAVELENGTHS_NM`, (81, 3); checked against colour-science in the tests."""
    path = files("paxel_runtime") / "data" / _OBSERVERS[degrees]
    with path.open(encoding="utf-8") as file:
        table = np.loadtxt(file, delimiter=",", comments="#")
    assert np.array_equal(table[:, 0], WAVELENGTHS_NM)
    return np.ascontiguousarray(table[:, 1:])


@cache
def illuminant_D65() -> NDArray[np.float64]:
    """Relative spectral power of CIE illuminant D65 on `WAVELENGTHS_NM`, (81,), 100 at 560 nm."""
    return _illuminant("d65")


@cache
def illuminant_D50() -> NDArray[np.float64]:
    """Relative spectral power of CIE illuminant D50 on `WAVELENGTHS_NM`, (81,), 100 at 560 nm: light of print shops."""
    return _illuminant("d50")


def _illuminant(name: str) -> NDArray[np.float64]:
    with (files("paxel_runtime") / "data" / f"cie_{name}_5nm.csv").open(encoding="utf-8") as file:
        wavelengths_nm, power = np.loadtxt(file, delimiter=",", comments="#").T
    return np.ascontiguousarray(power[np.isin(wavelengths_nm, WAVELENGTHS_NM)])


def spectra_to_XYZ(spectra: ArrayLike) -> NDArray[np.float64]:
    """Integrate spectra with the CIE 1931 2-degree observer, or the one of `observer`.

    Parameters
    ----------
    spectra : (..., 81) array
        Radiances on `WAVELENGTHS_NM`, in any unit.

    Returns
    -------
    (..., 3) float64 array
        XYZ in that unit times nm: the caller divides by the Y of its white point (CIE 15:2018, section 7).
    """
    step_nm = WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]
    return np.asarray(spectra, np.float64) @ _color_matching_functions(_observer_deg.get()) * step_nm


def XYZ_to_Lab(XYZ: ArrayLike, white_XYZ: ArrayLike) -> NDArray[np.floating]:
    """CIELAB of (..., 3) XYZ relative to the white point `white_XYZ` (3,) (CIE 15:2018, section 8.2.1).

    Negative XYZ (readings with noise) follow the linear branch, so no value is lost or clipped.
    """
    t = np.asarray(XYZ) / np.asarray(white_XYZ)
    f = np.where(t > _EPSILON, np.cbrt(t), (_KAPPA * t + 16.0) / 116.0)
    return np.stack(
        (116.0 * f[..., 1] - 16.0, 500.0 * (f[..., 0] - f[..., 1]), 200.0 * (f[..., 1] - f[..., 2])), axis=-1
    )


def Lab_to_XYZ(Lab: ArrayLike, white_XYZ: ArrayLike) -> NDArray[np.floating]:
    """Inverse of `XYZ_to_Lab`: (..., 3) XYZ from (..., 3) CIELAB under the white point `white_XYZ` (3,)."""
    Lab = np.asarray(Lab)
    fy = (Lab[..., 0] + 16.0) / 116.0
    f = np.stack((fy + Lab[..., 1] / 500.0, fy, fy - Lab[..., 2] / 200.0), axis=-1)
    t = np.where(f > 6.0 / 29.0, f**3, (116.0 * f - 16.0) / _KAPPA)
    return t * np.asarray(white_XYZ)


def Lab_to_LCh(Lab: ArrayLike) -> NDArray[np.floating]:
    """(..., 3) L*, chroma C*ab, hue angle in degrees 0..360."""
    Lab = np.asarray(Lab)
    hue_deg = np.rad2deg(np.arctan2(Lab[..., 2], Lab[..., 1])) % 360.0
    return np.stack((Lab[..., 0], np.hypot(Lab[..., 1], Lab[..., 2]), hue_deg), axis=-1)


def LCh_to_Lab(LCh: ArrayLike) -> NDArray[np.floating]:
    """Inverse of `Lab_to_LCh`; hue in degrees."""
    LCh = np.asarray(LCh)
    h = np.deg2rad(LCh[..., 2])
    return np.stack((LCh[..., 0], LCh[..., 1] * np.cos(h), LCh[..., 1] * np.sin(h)), axis=-1)


def sRGB_to_linear_sRGB(sRGB: ArrayLike) -> NDArray[np.floating]:
    """Decode sRGB values (IEC 61966-2-1); the sign is kept outside 0..1."""
    v = np.asarray(sRGB)
    m = np.abs(v)
    return np.sign(v) * np.where(m <= 0.04045, m / 12.92, ((m + 0.055) / 1.055) ** 2.4)


def linear_sRGB_to_sRGB(linear_sRGB: ArrayLike) -> NDArray[np.floating]:
    """Encode linear sRGB values (IEC 61966-2-1); the sign is kept outside 0..1."""
    v = np.asarray(linear_sRGB)
    m = np.abs(v)
    return np.sign(v) * np.where(m <= 0.0031308, m * 12.92, 1.055 * m ** (1 / 2.4) - 0.055)


def linear_sRGB_to_XYZ(linear_sRGB: ArrayLike) -> NDArray[np.floating]:
    """(..., 3) XYZ under D65, Y = 1 for white, of linear sRGB."""
    return np.asarray(linear_sRGB) @ _LINEAR_SRGB_TO_XYZ.T


def XYZ_to_linear_sRGB(XYZ: ArrayLike) -> NDArray[np.floating]:
    """Linear sRGB of XYZ under D65; outside 0..1 where the colour is outside sRGB."""
    return np.asarray(XYZ) @ _XYZ_TO_LINEAR_SRGB.T


def sRGB_to_Lab(sRGB: ArrayLike) -> NDArray[np.floating]:
    """CIELAB under D65 of encoded sRGB 0..1: the numbers that become a target under our own white."""
    return XYZ_to_Lab(linear_sRGB_to_XYZ(sRGB_to_linear_sRGB(sRGB)), D65_XYZ)


def Lab_to_sRGB(Lab: ArrayLike) -> NDArray[np.floating]:
    """Encoded sRGB of CIELAB taken under D65; outside 0..1 where the colour is outside sRGB."""
    return linear_sRGB_to_sRGB(XYZ_to_linear_sRGB(Lab_to_XYZ(Lab, D65_XYZ)))
