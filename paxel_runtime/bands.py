"""Work on the rows of a picture, shared by threads. Knows no picture and no kernel."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numba

__all__ = ["in_bands"]

_BANDS_A_THREAD = 4  # a thread that is held up leaves its rest to the others


def in_bands(work: Callable[[int, int], None], rows: int) -> None:
    """Call ``work(first, stop)`` on bands of rows side by side, on as many threads as numba may use.

    `work` has to release the interpreter's lock, as kernels do, and to write to its own rows only.
    """
    threads = min(numba.get_num_threads(), rows)
    if threads <= 1:
        work(0, rows)
        return
    bands = min(_BANDS_A_THREAD * threads, rows)
    edges = [rows * k // bands for k in range(bands + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))
