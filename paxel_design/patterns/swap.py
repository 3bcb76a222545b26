"""Blue noise of any number of colorants with exact shares: cells of a torus swapped until no swap helps.

With b_k the indicator of class k and s_k its share, swaps lower

    E = sum_k (1 / s_k) sum_{x, y} (b_k(x) - s_k) G(x - y) (b_k(y) - s_k),

G a Gaussian of width `flatness` on the torus. The weights 1 / s_k measure the fields in the metric in which randomly
strewn classes (covariance diag(s) - s s^T) are white in every direction; so E treats every class and every union of
classes alike, and pushes the power of all of them out of the low frequencies by the same factor (to 10 % for equal
shares; where these differ, the rarest class keeps up to 2.7 times as much, for a swap moves a whole cell of it, and
other weights do not mend that: ``reports/blue_noise_methods.py``). This is the multi-class version of direct binary
search (Analoui & Allebach 1992) with a Gaussian for the eye.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.gaussian import blur, gaussian_kernel
from paxel_design.patterns.request import LayoutRequest, apportion
from paxel_design.patterns.swap_kernels import sweep
from paxel_runtime.errors import InputError

__all__ = ["FLATNESS_RANGE", "SWAP_TORUS", "swap_blue_noise", "swap_classes"]

SWAP_TORUS = (256, 256)
"""Rows and columns of the torus that repeats over the sheet."""

FLATNESS_RANGE = (0.5, 4.0)

_REACH = 3  # near partners lie within 3 rows and columns
_FAR = 4  # partners anywhere, drawn anew at every visit
_SWEEPS = 12
_AT_REST = 1000  # fewer swaps a sweep than one in so many cells change no figure


def swap_blue_noise(request: LayoutRequest) -> NDArray[np.uint8]:
    """`SWAP_TORUS` cells for a request; see `swap_classes`."""
    return swap_classes(request.shares, SWAP_TORUS, request.flatness, request.seed)


def swap_classes(
    shares: tuple[float, ...], shape: tuple[int, int], flatness: float, seed: int, sweeps: int = _SWEEPS
) -> NDArray[np.uint8]:
    """Blue noise of n classes on a torus.

    Parameters
    ----------
    shares : tuple of n floats
        Share of each class, summing to 1; realised to one cell.
    shape : (int, int)
        Rows and columns of the torus.
    flatness : float
        Standard deviation of the Gaussian in cells, the one knob between visibility and flatness. Small (0.6): only
        near neighbours count and all power goes to the highest frequencies: least visible, but regular patches like
        a checkerboard, which beat with projector pixels. Large (3): only low frequencies are emptied, above them
        the spectrum is flat: no frequency to beat with, but grain that is easier to see. 2 by default.
    seed : int
        Seed of the start and of the order of visits.
    sweeps : int
        Visits of every cell.

    Returns
    -------
    (rows, columns) uint8 array
        Class of each cell.

    Raises
    ------
    InputError
        If `flatness` lies outside `FLATNESS_RANGE`.
    """
    low, high = FLATNESS_RANGE
    if not low <= flatness <= high:
        raise InputError(f"a pattern's flatness must be {low:g} to {high:g} cells, got {flatness}: 2 is the default")
    rng = np.random.default_rng(seed)
    size = shape[0] * shape[1]
    cells = np.repeat(np.arange(len(shares), dtype=np.uint8), apportion(shares, size))
    cells = rng.permutation(cells).reshape(shape)
    kernel = gaussian_kernel(flatness, least_radius=_REACH)
    blurred = blur(cells == np.arange(len(shares))[:, None, None], kernel)
    weights = 1 / np.asarray(shares, np.float64)
    for _ in range(sweeps):
        far = rng.integers(0, size, (size, _FAR))
        if sweep(cells, blurred, kernel, weights, rng.permutation(size), far, _REACH) < size // _AT_REST:
            break
    return cells
