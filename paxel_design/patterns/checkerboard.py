"""The checkerboard: two colorants, each cell beside four of the other (paper, Fig. 1 and section VI-A)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError

__all__ = ["checkerboard"]


def checkerboard(colorants: tuple[str, ...], seed: int) -> NDArray[np.uint8]:
    """Cells of a checkerboard of two colorants, half the area each.

    Parameters
    ----------
    colorants : tuple of 2 str
        The first lies on the cell whose lower left corner is the centre of the pattern.
    seed : int
        Not used: a checkerboard has nothing random.

    Returns
    -------
    (2, 2) uint8 array
        One torus of indices into `colorants`, row 0 lowest.

    Raises
    ------
    InputError
        If there are not exactly two colorants.
    """
    if len(colorants) != 2:
        raise InputError(
            f"a checkerboard must have exactly 2 colorants, got {len(colorants)} ({', '.join(colorants) or 'none'}): "
            "name two, such as black and white"
        )
    return np.array([[0, 1], [1, 0]], dtype=np.uint8)
