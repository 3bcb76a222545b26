"""Device codes: the nearest one against the response itself, blue noise right in the mean of the light and fine."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_runtime.assembly import intensities_to_codes
from paxel_runtime.assembly.codes import blue_noise
from paxel_runtime.errors import InputError
from paxel_runtime.model.response import ProjectorResponse

CODE = np.linspace(0, 1, 33)
RESPONSE = ProjectorResponse((CODE,) * 3, (CODE**2.2, CODE**1.8, 3 * CODE**2 - 2 * CODE**3))
INSIDE = np.ones((64, 64), bool)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), bits=st.sampled_from([1, 8, 10, 16]))
def test_the_nearest_code(seed: int, bits: int) -> None:
    p = np.random.default_rng(seed).random((5, 7, 3), np.float32)
    codes = intensities_to_codes(p, np.ones((5, 7), bool), RESPONSE, bits, rounding="nearest")
    assert codes.dtype == (np.uint8 if bits <= 8 else np.uint16)
    P = RESPONSE.x_to_P(p.astype(np.float64))
    # half a code of rounding, and what two interpolations of one table differ by, in codes of 16 bits
    assert np.all(np.abs(codes - P * (2**bits - 1)) <= 0.5 + 2e-2 * 2.0 ** (bits - 16) + 1e-6)


@settings(max_examples=20, deadline=None)
@given(value=st.floats(0, 1), bits=st.sampled_from([1, 4, 8, 10]))
def test_blue_noise_gives_the_mean_light(value: float, bits: int) -> None:
    """Over one period of the mask, and with the two codes beside the wanted light only."""
    p = np.full((64, 64, 3), value, np.float32)
    codes = intensities_to_codes(p, INSIDE, RESPONSE, bits)
    emitted = RESPONSE.P_to_x(codes / (2**bits - 1))
    # thresholds come in 256 steps between two codes, and those are at most 2.2 (the steepest curve) apart; float32
    assert np.all(np.abs(emitted.mean(axis=(0, 1)) - np.float32(value)) <= 2.2 / (2**bits - 1) / 512 + 1e-6)
    assert np.all(np.ptp(codes.astype(int), axis=(0, 1)) <= 1)


def test_exact_codes_stay() -> None:
    codes = np.random.default_rng(0).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    p = RESPONSE.P_to_x(codes / 255)
    again = intensities_to_codes(p.astype(np.float32), INSIDE, RESPONSE, 8).astype(int)
    # float32 moves an intensity by 6e-8, which passes a threshold once in a while where codes lie close
    assert np.mean(again == codes) > 0.999
    assert np.max(np.abs(again - codes)) <= 1


def test_the_mask_is_blue() -> None:
    """Every threshold equally often; of a half-tone's power less than 1 % below an eighth of the raster's frequency."""
    mask = blue_noise()
    assert np.array_equal(np.bincount(mask.ravel(), minlength=256), np.full(256, 16))
    for level in (32, 128, 224):
        power = np.abs(np.fft.fft2(mask < level)) ** 2
        power[0, 0] = 0
        f = np.hypot(*np.meshgrid(np.fft.fftfreq(64), np.fft.fftfreq(64)))
        share, area = power[f < 0.125].sum() / power.sum(), np.mean(f < 0.125)
        assert share < 0.01
        assert area > 0.04  # white noise would have that share there


@pytest.mark.parametrize(("outside", "code"), [("black", 0), ("white", 1023)])
def test_outside_the_pattern(outside: str, code: int) -> None:
    p = np.full((2, 3, 3), np.nan, np.float32)  # nobody reads it there
    codes = intensities_to_codes(p, np.zeros((2, 3), bool), RESPONSE, 10, outside=outside)
    assert np.all(codes == code)


def test_what_cannot_be_coded() -> None:
    p, inside = np.zeros((2, 2, 3), np.float32), np.ones((2, 2), bool)
    bad = p.copy()
    bad[0, 0, 0], bad[1, 1, 2] = np.nan, 1.1
    for rounding in ("nearest", "blue-noise"):
        with pytest.raises(InputError, match="got 2 that are not"):
            intensities_to_codes(bad, inside, RESPONSE, 8, rounding=rounding)
    with pytest.raises(InputError, match="black, white"):
        intensities_to_codes(p, inside, RESPONSE, 8, outside="gray")
    with pytest.raises(InputError, match=r"bits must be 1\.\.16"):
        intensities_to_codes(p, inside, RESPONSE, 17)
    with pytest.raises(InputError, match="blue-noise, nearest"):
        intensities_to_codes(p, inside, RESPONSE, 8, rounding="white-noise")
    with pytest.raises(InputError, match="mask"):
        intensities_to_codes(p[..., :2], inside, RESPONSE, 8)
