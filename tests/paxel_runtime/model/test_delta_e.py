"""CIEDE2000 against the published pairs and colour-science; its derivatives against differences."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.delta_e import TRUE_dE00, dE00, squared_dE00_jet

# L1 a1 b1 L2 a2 b2 dE00: Table 1 of G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula:
# implementation notes, supplementary test data, and mathematical observations", Color Res. Appl. 30(1), 2005.
SHARMA = np.array(
    [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ]
)


@njit(error_model="numpy")
def _jets(Lab1: NDArray[np.float64], Lab2: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.empty((len(Lab1), 8))
    for i in range(len(Lab1)):
        L1, a1, b1 = Lab1[i, 0], Lab1[i, 1], Lab1[i, 2]
        jet = squared_dE00_jet(L1, a1, b1, Lab2[i, 0], Lab2[i, 1], Lab2[i, 2], TRUE_dE00)
        for k in range(8):
            out[i, k] = jet[k]
    return out


def _random_Lab(rng: np.random.Generator, n: int, chroma: float) -> NDArray[np.float64]:
    return np.column_stack((rng.uniform(0, 100, n), rng.uniform(-chroma, chroma, (n, 2))))


def test_published_pairs() -> None:
    # Four decimals are published.
    np.testing.assert_allclose(dE00(SHARMA[:, :3], SHARMA[:, 3:6]), SHARMA[:, 6], atol=0.5001e-4)
    np.testing.assert_allclose(dE00(SHARMA[:, 3:6], SHARMA[:, :3]), SHARMA[:, 6], atol=0.5001e-4)


@pytest.mark.parametrize("chroma", [120.0, 10.0, 0.01])
def test_agrees_with_colour_science(chroma: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science warns of its own optional dependencies
        from colour.difference import delta_E_CIE2000

    rng = np.random.default_rng(1)
    Lab1, Lab2 = _random_Lab(rng, 100_000, chroma), _random_Lab(rng, 100_000, chroma)
    # The rotation term is dropped beyond 120 degrees from hue 275, where it is below 2e-10: 1e-8 in dE00 at most.
    np.testing.assert_allclose(dE00(Lab1, Lab2), delta_E_CIE2000(Lab1, Lab2), atol=1e-8)


def test_broadcasts_and_is_zero_only_for_equal_colours() -> None:
    rng = np.random.default_rng(2)
    picture = _random_Lab(rng, 12, 50.0).reshape(4, 3, 3)
    assert dE00(picture, picture[0, 0]).shape == (4, 3)
    assert dE00(picture.astype(np.float32), picture[:1]).dtype == np.float64
    np.testing.assert_allclose(dE00(picture, picture), 0.0, atol=1e-12)  # rounding of two chromas of about 50
    assert dE00([50.0, 0.0, 0.0], [50.0, 0.0, 0.0]) == 0.0
    assert np.isnan(dE00([np.nan, 0.0, 0.0], [50.0, 0.0, 0.0]))


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(InputError, match="shape"):
        dE00(np.zeros((4, 2)), np.zeros((4, 3)))
    with pytest.raises(InputError, match="broadcast"):
        dE00(np.zeros((4, 3)), np.zeros((5, 3)))


def _differences(
    Lab1: NDArray[np.float64], Lab2: NDArray[np.float64], h: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gradient (m, 3) of the value and Hessian (m, 3, 3) of the gradient by central differences of step h (m,)."""
    gradient, hessian = np.empty((len(Lab1), 3)), np.empty((len(Lab1), 3, 3))
    for i, step in enumerate(h * np.eye(3)):
        above, below = _jets(Lab1, Lab2 + step), _jets(Lab1, Lab2 - step)
        gradient[:, i] = (above[:, 0] - below[:, 0]) / (2 * h)
        hessian[:, i] = (above[:, 1:4] - below[:, 1:4]) / (2 * h)
    return gradient, hessian


def _pairs(kind: str, rng: np.random.Generator, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    Lab1, Lab2 = _random_Lab(rng, n, 100.0), _random_Lab(rng, n, 100.0)
    if kind == "first gray":
        Lab1[:, 1:] = 0.0
    elif kind == "second nearly gray":
        Lab2[:, 1:] *= 0.01
    elif kind == "both nearly gray":
        Lab1[:, 1:] *= 0.01
        Lab2[:, 1:] *= 0.01
    elif kind == "opposite hues":  # within about a degree of opposite, on either side
        Lab2[:, 1:] = -Lab1[:, 1:] * rng.uniform(0.2, 2.0, (n, 1)) + rng.normal(0.0, 1.0, (n, 2))
    elif kind == "equal hues":
        Lab2[:, 1:] = Lab1[:, 1:] * rng.uniform(0.2, 2.0, (n, 1))
    return Lab1, Lab2


def _is_smooth(Lab1: NDArray[np.float64], Lab2: NDArray[np.float64], h: float) -> NDArray[np.bool_]:
    """Pairs farther than a few steps from where dE00^2 has no derivatives.

    That is: gray of the second colour, opposite hues h', and the mean hue 0, where the standard itself jumps.
    """
    c7 = (0.5 * (np.hypot(Lab1[:, 1], Lab1[:, 2]) + np.hypot(Lab2[:, 1], Lab2[:, 2]))) ** 7
    stretch = 1.5 - 0.5 * np.sqrt(c7 / (c7 + 25.0**7))
    z1, z2 = (stretch * Lab[:, 1] + 1j * Lab[:, 2] for Lab in (Lab1, Lab2))
    clear = np.maximum(0.01, 10 * h / np.abs(z2))  # radians of the second hue
    difference = np.abs(np.angle(z2 * z1.conj()))
    mean = np.angle(z2 * z1) / 2  # or the opposite direction
    return (np.abs(z2) > 0.02) & ((z1 == 0) | ((difference < np.pi - clear) & (np.abs(mean) > clear)))


@pytest.mark.parametrize(
    "kind", ["any", "first gray", "second nearly gray", "both nearly gray", "opposite hues", "equal hues"]
)
def test_gradient_and_hessian_match_differences(kind: str) -> None:
    Lab1, Lab2 = _pairs(kind, np.random.default_rng(3), 170_000)
    h = 1e-4
    chroma2 = np.hypot(Lab2[:, 1], Lab2[:, 2])
    smooth = _is_smooth(Lab1, Lab2, h)
    Lab1, Lab2, chroma2 = Lab1[smooth], Lab2[smooth], chroma2[smooth]
    assert len(Lab1) > 50_000
    jets = _jets(Lab1, Lab2)
    gradient, hessian = _differences(Lab1, Lab2, h)
    expected = np.zeros_like(hessian)
    expected[:, 0, 0], expected[:, 1, 1], expected[:, 2, 2] = jets[:, 4], jets[:, 5], jets[:, 7]
    expected[:, 1, 2] = expected[:, 2, 1] = jets[:, 6]
    # A difference of values up to 1e4 rounds to 1e-12 / h = 1e-8, a hundred times that where hues are 0.01 rad from
    # opposite. Its truncation is h^2 times the third derivative, which grows toward gray as value / chroma^3, times
    # 3^3 since the rotation term varies over a third of a radian of hue.
    truncation = 27.0 * (1.0 + jets[:, 0]) * (h / chroma2) ** 2
    assert np.all(np.abs(gradient - jets[:, 1:4]) <= (2e-6 + truncation / chroma2)[:, None])
    assert np.all(np.abs(hessian - expected) <= (2e-6 + truncation / chroma2**2)[:, None, None])


def test_jets_are_finite_where_derivatives_do_not_exist() -> None:
    gray, red, cyan = [50.0, 0.0, 0.0], [50.0, 40.0, 10.0], [40.0, -40.0, -10.0]
    first = np.array([gray, red, gray, red, red])
    second = np.array([gray, gray, red, cyan, red])
    assert np.isfinite(_jets(first, second)).all()
