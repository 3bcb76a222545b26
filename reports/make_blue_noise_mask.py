"""Makes paxel_runtime/data/blue_noise.npy: the thresholds with which assembly rounds intensities to device codes.

Void-and-cluster (R. Ulichney 1993, Proc. SPIE 1913, 332-343) on a torus of 64 x 64: a random tenth of ones is relaxed
by moving the tightest cluster into the largest void; taking ones out of it ranks the pixels below, filling voids those
above. Ranks are stored as 8-bit thresholds. Run from a checkout (10 s)::

    python -m reports.make_blue_noise_mask
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIZE, SIGMA_PX, START, SEED = 64, 1.9, 0.1, 0
RESULT = Path(__file__).parents[1] / "paxel_runtime" / "data" / "blue_noise.npy"


def ranks(size: int = SIZE, sigma_px: float = SIGMA_PX, seed: int = SEED) -> NDArray[np.int64]:
    """Rank 0..size^2 - 1 of each pixel of the torus, (size, size)."""
    away = np.minimum(np.arange(size), size - np.arange(size))
    kernel = np.exp(-0.5 * (away[:, None] ** 2 + away**2) / sigma_px**2)
    ones = np.zeros((size, size), bool)
    ones.flat[np.random.default_rng(seed).choice(size**2, int(START * size**2), replace=False)] = True
    density = np.real(np.fft.ifft2(np.fft.fft2(ones) * np.fft.fft2(kernel)))

    def change(place: tuple[int, int], sign: int) -> None:
        ones[place] = sign > 0
        density[:] += sign * np.roll(kernel, place, (0, 1))

    def tightest() -> tuple[int, int]:
        row, column = np.unravel_index(np.argmax(np.where(ones, density, -np.inf)), ones.shape)
        return int(row), int(column)

    def largest_void() -> tuple[int, int]:
        row, column = np.unravel_index(np.argmin(np.where(ones, np.inf, density)), ones.shape)
        return int(row), int(column)

    while True:
        cluster = tightest()
        change(cluster, -1)
        void = largest_void()
        change(void, 1)
        if void == cluster:
            break
    start, begin = ones.copy(), density.copy()
    rank = np.empty((size, size), np.int64)
    for k in reversed(range(int(ones.sum()))):
        place = tightest()
        rank[place] = k
        change(place, -1)
    ones[:], density[:] = start, begin
    for k in range(int(ones.sum()), size**2):
        place = largest_void()
        rank[place] = k
        change(place, 1)
    return rank


def main() -> None:
    """Write the thresholds."""
    rank = ranks()
    np.save(RESULT, (rank * 256 // rank.size).astype(np.uint8))
    print(RESULT)


if __name__ == "__main__":
    main()
