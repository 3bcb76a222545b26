"""Hidden pictures against the eye's threshold: gratings in closed form, noise, and pictures that are alike."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_design.report.hidden import hidden_picture
from paxel_design.visibility.sensitivity import luminance_sensitivity
from paxel_runtime.errors import InputError

SHAPE = (300, 400)
DISTANCE_MM, MM_PER_PX, LUMINANCE = 4000.0, 0.5, 100.0
PX_PER_DEGREE = DISTANCE_MM * np.tan(np.deg2rad(1.0)) / MM_PER_PX
INNER = np.ones(SHAPE, bool)
FLAT = np.full(SHAPE, 0.2)


def _grating(cpd: float) -> NDArray[np.float64]:
    return np.broadcast_to(np.cos(2 * np.pi * cpd / PX_PER_DEGREE * np.arange(SHAPE[1])), SHAPE)


def _picture(seed: int) -> NDArray[np.float64]:
    noise = np.random.default_rng(seed).normal(size=SHAPE)
    picture = sum(sigma * gaussian_filter(noise, sigma, mode="wrap") for sigma in (2, 4, 8, 16))
    return 0.2 * (1 + 0.4 * picture / np.abs(picture).max())


def _found(view: NDArray[np.float64], own: NDArray[np.float64], hidden: NDArray[np.float64]):  # type: ignore[no-untyped-def]
    return hidden_picture(view, own, hidden, INNER, MM_PER_PX, DISTANCE_MM, LUMINANCE)


@pytest.mark.parametrize("cpd", [3.0, 6.0, 12.0])
def test_a_grating_of_modulation_m_has_m_times_the_sensitivity(cpd: float) -> None:
    hidden, view = 0.2 * (1 + 0.3 * _grating(cpd)), 0.2 * (1 + 0.01 * _grating(cpd))
    found = _found(view, FLAT, hidden)
    sensitivity = float(luminance_sensitivity(cpd, LUMINANCE))
    # 3 %: the window's own width over which the sensitivity varies, and the surround, which follows slow gratings
    assert found.seen == pytest.approx(0.01 * sensitivity, rel=0.03)
    assert found.shown == pytest.approx(0.3 * sensitivity, rel=0.03)
    assert found.rms_percent == pytest.approx(1 / np.sqrt(2), rel=0.03)


@pytest.mark.parametrize("share", [0.005, -0.02])
def test_a_share_of_a_picture_is_that_share_of_its_visibility(share: float) -> None:
    own, hidden = _picture(0), _picture(1)
    found = _found(own + share * (hidden - hidden.mean()), own, hidden)
    assert found.seen == pytest.approx(abs(share) * found.shown, rel=0.1)  # own's light varies from place to place


def test_noise_and_lost_contrast_hide_nothing() -> None:
    own, hidden = _picture(0), _picture(1)
    noise = 0.002 * np.random.default_rng(2).normal(size=SHAPE)
    faded = 0.9 * (own - own.mean()) + own.mean()
    clean = _found(own + 0.01 * (hidden - hidden.mean()), own, hidden).seen
    assert _found(own, own, hidden).seen == 0
    # One percent of noise: what it has in common with the picture by chance stays far below what is seen.
    assert _found(own + noise, own, hidden).seen < 0.3
    assert _found(faded, own, hidden).seen < 0.1 * clean  # what goes with the own picture is no ghost


def test_a_flat_picture_hides_nothing_and_wrong_shapes_are_told_of() -> None:
    assert _found(FLAT, FLAT, FLAT).seen == 0
    with pytest.raises(InputError, match="one shape"):
        _found(FLAT[:-1], FLAT, FLAT)
    with pytest.raises(InputError, match="pixels that count"):
        hidden_picture(FLAT, FLAT, FLAT, ~INNER, MM_PER_PX, DISTANCE_MM, LUMINANCE)
