"""Zhou-Fang error diffusion: blue noise of two colorants on a whole sheet that never repeats.

B. Zhou and X. Fang, "Improving mid-tone quality of variable-coefficient error diffusion using threshold modulation",
ACM Trans. Graph. 22(3), 2003 (the paper's reference [55] is of this family). The three coefficients and the strength
of the threshold's modulation depend on the gray; between the published key levels both are interpolated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.error_diffusion_kernels import diffuse
from paxel_design.patterns.gaussian import gaussian_kernel
from paxel_design.patterns.request import LayoutRequest, apportion
from paxel_runtime.errors import InputError

__all__ = ["zhou_fang", "zhou_fang_coefficients", "zhou_fang_sheet"]

# Key levels of 255, parts of the error to the right, down left and down (normalised below)
_COEFFICIENTS = np.array(
    [
        (0, 13, 0, 5),
        (1, 1300249, 0, 499250),
        (2, 214114, 287, 99357),
        (3, 351854, 0, 199965),
        (4, 801100, 0, 490999),
        (10, 704075, 297466, 303694),
        (22, 46613, 31917, 21469),
        (32, 47482, 30617, 21900),
        (40, 45959, 24089, 29950),
        (44, 43024, 42131, 14826),
        (64, 36411, 43219, 20369),
        (72, 38477, 53843, 7678),
        (77, 40503, 51547, 7948),
        (85, 35865, 34108, 30026),
        (95, 34117, 36899, 28983),
        (102, 35132, 36059, 28807),
        (107, 16477, 18810, 14712),
        (112, 33360, 37954, 28685),
        (127, 35269, 36066, 28664),
    ],
    dtype=np.float64,
)
# Key levels of 255 and strength of the modulation
_MODULATION = np.array(
    [
        (0, 0.0),
        (40, 0.30),
        (44, 0.34),
        (64, 0.50),
        (80, 1.0),
        (85, 1.0),
        (95, 0.17),
        (102, 0.50),
        (107, 0.70),
        (112, 0.79),
        (127, 1.0),
    ]
)
_GUARD = 64  # rows and columns that are thrown away: the first rows are regular, the sides distorted
_CHOICES = 8  # cells to choose each flipped one from
_MOST_CANDIDATES = 2**20
_CROWD_SIGMA = 1.5  # cells


def zhou_fang(request: LayoutRequest) -> NDArray[np.uint8]:
    """One sheet of at least ``request.shape`` cells for two colorants, cell (0, 0) in its middle.

    Raises
    ------
    InputError
        If there are more than two colorants.
    """
    if len(request.colorants) != 2:
        raise InputError(
            f"Zhou-Fang error diffusion must have exactly 2 colorants, got {len(request.colorants)}: "
            'blue_noise = "swap" takes any number'
        )
    rows, columns = request.shape
    ones = zhou_fang_sheet(request.shares[1], request.shape, request.seed)
    # labels wrap around at cell 0, the centre of the pattern: the sheet's edges belong half a sheet away from it
    return np.roll(ones, (-(rows // 2), -(columns // 2)), (0, 1))


def zhou_fang_coefficients(share: float) -> tuple[float, float, float, float]:
    """Parts of the error to the right, down left and down (summing to 1), and the modulation, for a gray 0..1."""
    level = min(255 * min(share, 1 - share), 127.0)  # the table ends at 127; 1/2 is 127.5
    parts = _COEFFICIENTS[:, 1:] / _COEFFICIENTS[:, 1:].sum(axis=1, keepdims=True)
    right, down_left, down = (float(np.interp(level, _COEFFICIENTS[:, 0], part)) for part in parts.T)
    modulation = float(np.interp(level, _MODULATION[:, 0], _MODULATION[:, 1]))
    return right, down_left, down, modulation


def zhou_fang_sheet(share: float, shape: tuple[int, int], seed: int) -> NDArray[np.uint8]:
    """Zeros and ones, the share of ones exact to one cell.

    Parameters
    ----------
    share : float
        Share of ones, between 0 and 1.
    shape : (int, int)
        Rows and columns; guard rows and columns around them are diffused as well and dropped.
    seed : int
        Seed of the threshold's modulation.

    Returns
    -------
    (rows, columns) uint8 array
    """
    random_state = np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]
    ones = diffuse(share, *zhou_fang_coefficients(share), *shape, _GUARD, random_state)
    surplus = int(ones.sum(dtype=np.int64)) - int(apportion((1 - share, share), ones.size)[1])
    if surplus:
        _flip(ones, 1 if surplus > 0 else 0, abs(surplus), np.random.default_rng(seed))
    return ones


def _flip(ones: NDArray[np.uint8], value: int, count: int, rng: np.random.Generator) -> None:
    """Flip `count` cells of `value` in place, each the most crowded of a few drawn at random.

    Diffusion keeps the share but for what crosses the edges of the window: ten cells or fewer of a sheet.
    """
    stride = ones.size // _MOST_CANDIDATES + 1
    candidates = rng.permutation(np.flatnonzero(ones.ravel()[::stride] == value) * stride)[: _CHOICES * count]
    kernel = gaussian_kernel(_CROWD_SIGMA)
    offsets = np.arange(kernel.shape[0]) - kernel.shape[0] // 2
    r, c = np.divmod(candidates[:, None, None], ones.shape[1])
    around = ones[(r + offsets[:, None]) % ones.shape[0], (c + offsets) % ones.shape[1]]
    crowd = ((around == value) * kernel).sum(axis=(1, 2))
    for group in np.array_split(np.arange(candidates.size), count):
        ones.flat[candidates[group[np.argmax(crowd[group])]]] = 1 - value
