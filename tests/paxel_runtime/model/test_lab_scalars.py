"""CIELAB for kernels against the formulas for arrays, and its derivatives against differences."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.lab_scalars import ab_of, lightness_of, luminance_of, root, root_slope, slope_in_Lab

XYZ = D65_XYZ * np.random.default_rng(0).uniform(0, 1, (40, 3)) ** 4  # a third of them in the linear part
WEIGHTS = np.array([0.3, -1.2, 0.7])


@njit
def told(XYZ: NDArray[np.float64], white: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """L*, a*, b*, Y of that L*, slope of the root, its difference, and the slope of a weighted sum in CIELAB (3)."""
    found = np.empty((len(XYZ), 9))
    for i in range(len(XYZ)):
        t = XYZ[i, 1]
        found[i, 0] = lightness_of(t)
        found[i, 1], found[i, 2] = ab_of(XYZ[i], white)
        found[i, 3] = luminance_of(found[i, 0])
        found[i, 4], found[i, 5] = root_slope(t), (root(t + 1e-7) - root(t - 1e-7)) / 2e-7
        slope_in_Lab(weights, XYZ[i], white, found[i, 6:])
    return found


def test_values_are_those_of_colorimetry_and_slopes_those_of_differences() -> None:
    found = told(XYZ, D65_XYZ, WEIGHTS)
    Lab = np.asarray(XYZ_to_Lab(XYZ, D65_XYZ))
    np.testing.assert_allclose(found[:, :3], Lab, atol=1e-9)
    np.testing.assert_allclose(found[:, 3], XYZ[:, 1], atol=1e-12)
    np.testing.assert_allclose(found[:, 4], found[:, 5], rtol=1e-3)  # rounding of a difference of 1e-7
    h = 1e-5
    high, low = (np.asarray(Lab_to_XYZ(Lab[:, None] + s * h * np.eye(3), D65_XYZ)) @ WEIGHTS for s in (1, -1))
    np.testing.assert_allclose(found[:, 6:], (high - low) / (2 * h), rtol=1e-4, atol=1e-9)
