"""The checkerboard: two colorants, each cell beside four of the other (paper, Fig. 1 and section VI-A)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.request import LayoutRequest
from paxel_runtime.errors import InputError

__all__ = ["checkerboard"]


def checkerboard(request: LayoutRequest) -> NDArray[np.uint8]:
    """Cells of a checkerboard of two colorants, half the area each.

    Parameters
    ----------
    request : LayoutRequest
        The first colorant lies on the cell whose lower left corner is the centre of the pattern.

    Returns
    -------
    (2, 2) uint8 array
        One torus of indices into the colorants, row 0 lowest.

    Raises
    ------
    InputError
        If there are not exactly two colorants, or not with half the area each.
    """
    names = [colorant.name for colorant in request.colorants]
    if len(names) != 2:
        raise InputError(
            f"a checkerboard must have exactly 2 colorants, got {len(names)} ({', '.join(names)}): "
            'name two, such as black and white, or take layout = "tiles"'
        )
    if request.shares[0] != request.shares[1]:
        raise InputError(
            f"a checkerboard's shares must be 0.5 each, got {list(request.shares)}: "
            'take layout = "tiles" or "blue-noise"'
        )
    return np.array([[0, 1], [1, 0]], dtype=np.uint8)
