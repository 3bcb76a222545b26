"""Dither and combine: Eq. 6 against the formula itself, blocks against plain means."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_runtime.assembly import combine, dither
from paxel_runtime.assembly.combine import block_px_of
from paxel_runtime.assembly.coverage import coverage_from_labels
from paxel_runtime.errors import InputError


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    K=st.integers(2, 6),
    N=st.integers(1, 4),
    by_channel=st.booleans(),
    block=st.integers(1, 9),
)
def test_eq_6_pixel_by_pixel(seed: int, K: int, N: int, by_channel: bool, block: int) -> None:
    rng = np.random.default_rng(seed)
    x = rng.random((11, 7, N * K), np.float32)
    labels = rng.choice([*range(K), 255], (11, 7, N) if by_channel else (11, 7)).astype(np.uint8)
    p, blocks = dither(x, labels, N), combine(x, labels, N, block)
    of = np.broadcast_to(labels if by_channel else labels[..., None], (11, 7, N))
    for row, column, j in np.ndindex(11, 7, N):
        k = int(of[row, column, j])
        assert p[row, column, j] == (0 if k == 255 else x[row, column, k * N + j])
        cell = (slice(row // block * block, (row // block + 1) * block),
                slice(column // block * block, (column // block + 1) * block))  # fmt: skip
        inside = of[cell][..., 0] != 255
        if k != 255 and inside.any():
            # float32 inputs, summed as float64
            assert blocks[row, column, j] == pytest.approx(x[cell][inside][:, k * N + j].mean(), abs=1e-6)


def test_a_memory_map_in_tiles_gives_the_same(tmp_path) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(0)
    x, labels = rng.random((600, 20, 6), np.float32), rng.integers(0, 2, (600, 20)).astype(np.uint8)
    np.save(tmp_path / "x.npy", x)
    mapped = np.load(tmp_path / "x.npy", mmap_mode="r")
    assert np.array_equal(dither(mapped, labels, 3), dither(x, labels, 3))
    assert np.array_equal(dither(x, labels, 3)[300:], dither(x[300:], labels[300:], 3))
    assert np.array_equal(combine(mapped, labels, 3, 7), combine(x, labels, 3, 7))


def test_a_block_holds_every_colorant() -> None:
    """A checkerboard's block is two dots, that of six tiles (2 x 3) three; where the raster falls does not matter."""
    assert block_px_of(5.12, 2) == 11
    assert block_px_of(5.12, 6) == 16
    assert block_px_of(0.5, 2) == 2


def test_labels_stand_in_for_coverages() -> None:
    names = ("uv-2", "white", "uv-2+white", "uv-2+white-2")
    coverage = coverage_from_labels(np.array([[0, 1, 2, 3, 255]], np.uint8), names)
    assert coverage.shape == (1, 5, 1, 2)
    assert coverage[0, :, 0].tolist() == [[255, 0], [0, 255], [127, 127], [127, 127], [0, 0]]


def test_what_cannot_be_assembled() -> None:
    x, labels = np.zeros((2, 2, 6), np.float32), np.zeros((2, 2), np.uint8)
    with pytest.raises(InputError, match="below 2"):
        dither(x, labels + np.uint8(2), 3)
    with pytest.raises(InputError, match="K times 3"):
        dither(x[..., :5], labels, 3)
    with pytest.raises(InputError, match="labels"):
        combine(x, labels[:1], 3, 2)
    with pytest.raises(InputError, match="at least 1"):
        combine(x, labels, 3, 0)
    with pytest.raises(InputError, match="larger than 0"):
        block_px_of(0.0, 2)
