"""How visible a periodic row of colorants is when each row is the one below shifted: what tiles are searched by.

By S-CIELAB (`visibility.s_cielab`): such a row needs only its discrete Fourier transform. The scale is fixed: a cell is
seen under `CELL_ARCMIN` (a 0.75 mm dot from 2.6 m); only the ratio between arrangements is used.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_design.visibility.s_cielab import XYZ_TO_OPPONENT, eye_transfer, opponent_to_Lab

__all__ = ["CELL_ARCMIN", "row_visibility"]

CELL_ARCMIN = 1.0


def row_visibility(rows_XYZ: NDArray[np.float64], shift: int) -> NDArray[np.float64]:
    """Root mean square CIELAB difference from the mean colour that the eye still sees.

    Parameters
    ----------
    rows_XYZ : (..., N, 3) array
        One period of a row of cells, XYZ, Y = 1 for white; the same mean for all leading axes.
    shift : int
        The cell above is `shift` cells further on in the row: cell (r, c) is ``rows_XYZ[(c + r * shift) % N]``.

    Returns
    -------
    (...) float64 array
        Root mean square of CIELAB differences.

    Notes
    -----
    Harmonics above half a cycle per cell, which a square cell also has, are far beyond what the eye resolves here.
    """
    n = rows_XYZ.shape[-2]
    amplitude = np.fft.fft(rows_XYZ, axis=-2)[..., 1:, :] / n
    k = np.arange(1, n)
    fx, fy = (f - np.round(f) for f in (k / n, k * shift / n))
    eye = eye_transfer(np.hypot(fx, fy) * 60 / CELL_ARCMIN) * (np.sinc(fx) * np.sinc(fy))[:, None]
    to_Lab = opponent_to_Lab(rows_XYZ.reshape(-1, n, 3)[0].mean(axis=0))
    Lab = (amplitude @ XYZ_TO_OPPONENT.T * eye) @ to_Lab.T
    return np.sqrt((np.abs(Lab) ** 2).sum(axis=(-2, -1)))
