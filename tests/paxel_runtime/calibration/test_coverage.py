"""Coverages and point spreads of projector pixels, read off made-up pictures whose truth is known."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import ndtr

from paxel_runtime.calibration.coverage import channels_differ, coverage_from_nodal, pack_coverage
from paxel_runtime.calibration.point_spread import line_blur, line_captures
from paxel_runtime.errors import InputError

H, W, DOT = 72, 96, 5.12


def shares(colorants: int, shift: float = 0.0) -> np.ndarray:
    """Share (H, W, M) of each colorant in pixels on tiles turned by 30 degrees."""
    x, y = np.meshgrid((np.arange(8 * W) + 0.5) / 8 + shift, (np.arange(8 * H) + 0.5) / 8)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    kind = (np.floor((c * x + s * y) / DOT) + 2 * np.floor((c * y - s * x) / DOT)) % colorants
    return np.stack([(kind == m).reshape(H, 8, W, 8).mean(axis=(1, 3)) for m in range(colorants)], axis=-1)


INKS = {
    2: np.array([[0.05, 0.06, 0.05], [0.9, 0.88, 0.92]]),
    6: np.array([[0.1, 0.5, 0.7], [0.6, 0.1, 0.3], [0.8, 0.7, 0.1], [0.6, 0.1, 0.1], [0.1, 0.4, 0.2], [0.1, 0.1, 0.4]]),
}


@pytest.mark.parametrize("colorants", [2, 6])
def test_coverage_is_read_off_mixtures(colorants: int) -> None:
    truth = shares(colorants)
    rng = np.random.default_rng(0)
    nodal = (truth @ INKS[colorants] + 0.004 * rng.standard_normal((H, W, 3))).astype(np.float32)
    labels = np.argmax(truth, axis=-1).astype(np.uint8)
    labels[:, :3], nodal[5, 50] = 255, np.nan
    coverage = coverage_from_nodal(nodal, labels, colorants)
    assert coverage.shape == (H, W, 1, colorants)
    assert not coverage[:, :3].any()
    assert not coverage[5, 50].any()
    inside = labels != 255
    inside[5, 50] = False
    assert np.all(np.abs(coverage[inside].sum(axis=-1).astype(int) - 255) <= 1)
    off = (coverage[:, :, 0] / 255 - truth)[inside]
    two = (np.count_nonzero(truth, axis=-1) <= 2)[inside]
    # noise over the contrast of two inks (0.85; 0.2 at least) where two colorants meet; of three, two are told
    assert np.sqrt(np.mean(off[two] ** 2)) < (0.006 if colorants == 2 else 0.03)
    assert np.sqrt(np.mean(off**2)) < 0.06


def test_channels_have_their_own_where_they_lie_apart() -> None:
    """The first and last channel's pixels lie 0.3 px to either side of the middle one's."""
    by_channel = [shares(2, shift) for shift in (-0.3, 0.0, 0.3)]
    nodal = np.stack([s @ INKS[2][:, j] for j, s in enumerate(by_channel)], axis=-1).astype(np.float32)
    labels = np.argmax(by_channel[1], axis=-1).astype(np.uint8)
    joint, own = (coverage_from_nodal(nodal, labels, 2, by_channel=each) for each in (False, True))
    assert own.shape == (H, W, 3, 2)
    for j, truth in enumerate(by_channel):
        rms = [np.sqrt(np.mean((c[:, :, k] / 255 - truth) ** 2)) for c, k in ((joint, 0), (own, j))]
        # a weight of 0.05^2 against a squared contrast of 0.85^2 pulls by 0.3 %; rounded to 1/255
        assert rms[1] < 0.01
        assert j == 1 or rms[0] > 5 * rms[1]


def test_tables_that_lie_apart() -> None:
    rows, columns = np.mgrid[:H, :W].astype(np.float32)
    table = 2 * np.stack([columns, rows], axis=-1)
    valid = np.ones((H, W), bool)
    assert not channels_differ([table, table + np.float32(0.02)], valid)
    assert channels_differ([table, table, table * np.float32(1.001)], valid)
    assert not channels_differ([table, table + 1], ~valid)


def test_packed_to_a_byte() -> None:
    plane = np.random.default_rng(0).random((300, 4, 2))
    packed = pack_coverage([plane, plane + 1])
    assert packed.shape == (300, 4, 2, 2)
    assert np.all(np.abs(packed[:, :, 0] / 255 - plane) <= 0.5 / 255 + 1e-9)
    assert np.all(packed[:, :, 1] == 255)


def test_a_colorant_without_pixels() -> None:
    with pytest.raises(InputError, match="colorant 1 of 2"):
        coverage_from_nodal(np.ones((8, 8, 3), np.float32), np.zeros((8, 8), np.uint8), 2)
    with pytest.raises(InputError, match="labels"):
        coverage_from_nodal(np.ones((8, 8, 3), np.float32), np.zeros((8, 7), np.uint8), 2)


def lines(variance: Callable[[np.ndarray, np.ndarray], np.ndarray], noise: float) -> Callable[[str], np.ndarray]:
    """A camera of two pixels a projector pixel looks at lines a pixel wide, blurred by a variance of (u, v)."""
    y, x = (np.indices((2 * H, 2 * W)) / 2.0).astype(np.float64)
    sigma = np.sqrt(variance(2 * x / (W - 1) - 1, 2 * y / (H - 1) - 1))
    reflectance = 0.5 + 0.4 * (np.arange(2 * W) // 24 % 2)
    rng = np.random.default_rng(1)

    def capture(name: str) -> np.ndarray:
        _, _, _, axis, shift = name.split("-")
        place, length = (x, W) if axis == "x" else (y, H)
        away = place[..., None] - np.arange(int(shift), length, 8)
        light = (ndtr((away + 0.5) / sigma[..., None]) - ndtr((away - 0.5) / sigma[..., None])).sum(axis=-1)
        seen = 20000 * reflectance * (light + 0.01) + noise * rng.standard_normal(light.shape)
        return np.rint(np.clip(seen, 0, 65535)).astype(np.uint16)

    return capture


def test_blur_of_lines_over_the_field() -> None:
    rows, columns = np.mgrid[:H, :W].astype(np.float32)
    table = 2 * np.stack([columns, rows], axis=-1)
    nodal = np.broadcast_to(0.5 + 0.4 * (np.arange(W) // 12 % 2), (H, W)).astype(np.float32)
    wanted = np.array([0.35, 0.01, -0.02, 0.08, 0.0, 0.03])

    def variance(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return wanted[0] + wanted[1] * u + wanted[2] * v + wanted[3] * u**2 + wanted[4] * u * v + wanted[5] * v**2

    assert len(line_captures("green")) == 16
    found = line_blur(lines(variance, 100.0), "green", table, nodal)
    # tiles of the fit are a sixth of the field wide: the mean of a square over one is 0.009 of it more; noise of 0.5 %
    assert found == pytest.approx(wanted, abs=0.012)


def test_no_blur_where_nothing_is_seen() -> None:
    table, nodal = np.zeros((H, W, 2), np.float32), np.full((H, W), np.nan, np.float32)
    assert np.all(np.isnan(line_blur(lines(lambda u, v: 0.3 + 0 * u, 0.0), "green", table, nodal)))
