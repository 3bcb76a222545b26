"""How wide the projector's pixels are on the sheet, over the field: read off the profile of the shifted lines.

The lines of structured light are one pixel wide, of period 8. In one camera pixel their profile over time is a box as
wide as a pixel, blurred by all there is: projector, paper, camera. Its harmonics fall off as that blur's variance says:
the second against the first is free of ink, black level, glare and exposure, and far above the noise. The camera's and
the paper's part is the same everywhere and comes off. Knows captures and lookup tables.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from paxel_runtime.calibration.nodal import Captures
from paxel_runtime.structured_light.checks import LINE_PERIOD, SHIFTS, fine_name
from paxel_runtime.structured_light.frames import AXES

__all__ = ["line_blur", "line_captures"]

_SAMPLES = 150_000
_TILES = 12
"""Along each side of the field; the variance of each is one point of the fit."""
_EVEN_SHARE = 0.2
"""Share of the pixels that are looked at: those where the ink around is most even."""
_LEAST_IN_TILE = 20


def line_captures(channel: str) -> list[str]:
    """Names of the captures that `line_blur` needs."""
    return [f"light-{channel}-{fine_name('lines', axis, k)}" for axis in AXES for k in range(SHIFTS)]


def line_blur(
    captures: Captures, channel: str, camera_xy: NDArray[np.float32], nodal: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Variance of all that blurs a projector pixel's own area, projector px^2, as a polynomial over the field.

    Parameters
    ----------
    captures : callable
        Gives the picture of an exposure by its name; asked for one of `line_captures` at a time.
    channel : str
    camera_xy : (H, W, 2) float32 array
        Lookup table of the channel.
    nodal : (H, W) float32 array
        Nodal image in that channel, NaN where unknown.

    Returns
    -------
    (6,) float64 array
        Coefficients of 1, u, v, u^2, u v, v^2; u, v from -1 at the first column and row to 1 at the last. NaN where
        too little of the field is seen.
    """
    rows, columns = _even_pixels(nodal)
    xy = np.rint(camera_xy[rows, columns]).astype(np.int64)
    height, width = nodal.shape
    u, v = 2.0 * columns / (width - 1) - 1.0, 2.0 * rows / (height - 1) - 1.0
    tile = (np.minimum((0.5 + 0.5 * v) * _TILES, _TILES - 1)).astype(np.int64) * _TILES
    tile += np.minimum((0.5 + 0.5 * u) * _TILES, _TILES - 1).astype(np.int64)
    first = second = np.zeros(_TILES**2)
    for axis in AXES:
        profile = np.stack([_looked_at(captures(f"light-{channel}-{fine_name('lines', axis, k)}"), xy)
                            for k in range(SHIFTS)])  # fmt: skip
        c1, c2 = np.fft.fft(profile, axis=0)[1:3]
        power = np.abs(c1) ** 2
        # of a symmetric profile the second harmonic has twice the first's phase: noise has any and averages out
        along = np.real(c2 * np.conj(c1) ** 2) / np.maximum(np.sqrt(power), 1e-9)
        first = first + np.bincount(tile, power, _TILES**2)
        second = second + np.bincount(tile, along, _TILES**2)
    counts = np.bincount(tile, minlength=_TILES**2)
    seen = (counts >= _LEAST_IN_TILE) & (first > 0) & (second > 0)
    if np.count_nonzero(seen) < _TILES:
        return np.full(6, np.nan)
    box = np.sinc(2 / LINE_PERIOD) / np.sinc(1 / LINE_PERIOD)
    ratio = second[seen] / first[seen]
    variance = -np.log(ratio / box) * LINE_PERIOD**2 / (2 * np.pi**2 * 3)
    middle_u, middle_v = (np.bincount(tile, place, _TILES**2)[seen] / counts[seen] for place in (u, v))
    terms = np.stack(
        [np.ones_like(middle_u), middle_u, middle_v, middle_u**2, middle_u * middle_v, middle_v**2], axis=1
    )
    weights = np.sqrt(counts[seen])
    return np.asarray(np.linalg.lstsq(terms * weights[:, None], variance * weights, rcond=None)[0])


def _even_pixels(nodal: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of pixels where the ink is light and even, away from the frame's rim."""
    known = np.isfinite(nodal)
    signal = np.where(known, nodal, np.float32(0))
    uneven = (maximum_filter(signal, 3) - minimum_filter(signal, 3)) / np.maximum(signal, 1e-3)
    rim = LINE_PERIOD
    inner = np.zeros(nodal.shape, bool)
    inner[rim:-rim, rim:-rim] = minimum_filter(known, 3)[rim:-rim, rim:-rim]
    if not inner.any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    usable = inner & (signal >= np.median(signal[inner]))
    rows, columns = np.nonzero(usable & (uneven <= np.quantile(uneven[usable], _EVEN_SHARE)))
    stride = max(1, len(rows) // _SAMPLES)
    return rows[::stride], columns[::stride]


def _looked_at(picture: NDArray[np.generic], xy: NDArray[np.int64]) -> NDArray[np.float64]:
    """Values of a picture (h, w) or (h, w, C) at some of its pixels."""
    h, w = picture.shape[:2]
    values = picture[np.clip(xy[:, 1], 0, h - 1), np.clip(xy[:, 0], 0, w - 1)].astype(np.float64)
    return values if values.ndim == 1 else values.mean(axis=-1)
