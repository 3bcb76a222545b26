"""Assembly: Eq. 6 against the formula itself, and the codes against the response."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_runtime.assembly import assemble
from paxel_runtime.errors import InputError
from paxel_runtime.model.response import ProjectorResponse

CODE = np.linspace(0, 1, 33)
RESPONSE = ProjectorResponse(np.tile(CODE, (3, 1)), np.stack([CODE**2.2, CODE**1.8, 3 * CODE**2 - 2 * CODE**3]))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), K=st.integers(2, 6), bits=st.sampled_from([1, 8, 10, 16]))
def test_eq_6_pixel_by_pixel(seed: int, K: int, bits: int) -> None:
    rng = np.random.default_rng(seed)
    x = rng.random((5, 7, 3 * K), np.float32)
    labels = rng.choice([*range(K), 255], (5, 7)).astype(np.uint8)
    codes = assemble(x, labels, RESPONSE, bits)
    assert codes.dtype == (np.uint8 if bits <= 8 else np.uint16)
    for row, column in np.ndindex(5, 7):
        k = int(labels[row, column])
        if k == 255:
            assert not codes[row, column].any()
            continue
        P = RESPONSE.x_to_P(x[row, column, 3 * k : 3 * k + 3].astype(np.float64))
        # Half a code of rounding, and the two interpolations' last bits.
        assert np.all(np.abs(codes[row, column] - P * (2**bits - 1)) <= 0.5 + 1e-6)


def test_rounding_of_codes_bounds_the_light() -> None:
    """What the projector then emits is x to half a code's step of the steepest response."""
    x = np.linspace(0, 1, 64 * 64 * 3, dtype=np.float32).reshape(64, 64, 3)
    codes = assemble(x, np.zeros((64, 64), np.uint8), RESPONSE, 8)
    emitted = RESPONSE.P_to_x(codes / 255)
    # f' is at most 2.2; 2e-4 for the inverse table where f starts flat.
    assert np.max(np.abs(emitted - x)) <= 2.2 * 0.5 / 255 + 2e-4


@pytest.mark.parametrize(("outside", "code"), [("black", 0), ("white", 1023)])
def test_outside_the_pattern(outside: str, code: int) -> None:
    x = np.full((2, 3, 6), np.nan, np.float32)  # nobody reads it there
    codes = assemble(x, np.full((2, 3), 255, np.uint8), RESPONSE, 10, outside=outside)
    assert np.all(codes == code)


def test_a_memory_map_in_tiles_gives_the_same(tmp_path) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(0)
    x, labels = rng.random((600, 20, 6), np.float32), rng.integers(0, 2, (600, 20)).astype(np.uint8)
    np.save(tmp_path / "x.npy", x)
    mapped = np.load(tmp_path / "x.npy", mmap_mode="r")
    codes = assemble(mapped, labels, RESPONSE, 8)
    assert np.array_equal(codes, assemble(x, labels, RESPONSE, 8))
    assert np.array_equal(codes[300:], assemble(x[300:], labels[300:], RESPONSE, 8))


def test_what_cannot_be_assembled() -> None:
    x, labels = np.zeros((2, 2, 6), np.float32), np.zeros((2, 2), np.uint8)
    bad = x.copy()
    bad[0, 0, 0], bad[1, 1, 2], bad[1, 0, 5] = np.nan, 1.1, -3  # the last belongs to a cluster that is not lit there
    with pytest.raises(InputError, match="got 2 that are not"):
        assemble(bad, labels, RESPONSE, 8)
    with pytest.raises(InputError, match="below 2"):
        assemble(x, labels + np.uint8(2), RESPONSE, 8)
    with pytest.raises(InputError, match="K times 3"):
        assemble(x[..., :5], labels, RESPONSE, 8)
    with pytest.raises(InputError, match="black, white"):
        assemble(x, labels, RESPONSE, 8, outside="gray")
    with pytest.raises(InputError, match=r"bits must be 1\.\.16"):
        assemble(x, labels, RESPONSE, 17)
    with pytest.raises(InputError, match="labels"):
        assemble(x, labels[:1], RESPONSE, 8)
