"""Ramps -> response curves: exact on exact data, monotone on noisy data, and bad ramps are named."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_runtime.calibration.ramps import fit_curve, picture_shares, spectral_shares
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.response import ProjectorResponse

CODE = np.linspace(0, 1, 33)
NAMES = [f"ramp-white-red-{k:02d}" for k in range(33)]
LIGHT = np.exp(-(((WAVELENGTHS_NM - 620) / 20) ** 2))


def _fit(shares: NDArray[np.float64], **how: object) -> ProjectorResponse:
    code, linear = fit_curve(CODE, shares, NAMES, "red", **how)  # type: ignore[arg-type]
    return ProjectorResponse((code,), (linear,))


def test_spectra_and_pictures_give_the_share_of_full_light() -> None:
    shares = CODE**2.2
    spectra = 0.03 + shares[:, None] * LIGHT
    np.testing.assert_allclose(spectral_shares(spectra), shares, atol=1e-12)
    field = np.random.default_rng(0).uniform(0.1, 1, (20, 30))
    pictures = np.rint(100 + 60_000 * shares[:, None, None] * field).astype(np.uint16)
    np.testing.assert_allclose(picture_shares(lambda k: pictures[k], 33), shares, atol=1e-5)  # whole numbers of 60,000


@given(st.floats(1.6, 3.0), st.floats(0, 0.1))
def test_the_gamma_model_finds_offset_and_exponent(exponent: float, offset: float) -> None:
    shares = np.clip((CODE - offset) / (1 - offset), 0, 1) ** exponent
    response = _fit(shares, curve="gamma")
    P = np.linspace(0, 1, 200)
    true = np.clip((P - offset) / (1 - offset), 0, 1) ** exponent
    # The curve is sampled at 1025 points, and the fit may stop short on the kink at the offset.
    np.testing.assert_allclose(response.P_to_x(P[:, None])[:, 0], true, atol=1e-4)


def test_measured_curves_pass_through_their_points_and_never_fall() -> None:
    rng = np.random.default_rng(0)
    shares = CODE**2.2 + rng.normal(0, 0.003, 33)
    response = _fit(shares)
    x = response.P_to_x(np.linspace(0, 1, 5000)[:, None])
    assert np.all(np.diff(x[:, 0]) >= 0)
    assert np.abs(response.P_to_x(CODE[:, None])[:, 0] - CODE**2.2).max() < 0.012  # four sigma


@given(st.floats(1.0, 3.0), st.integers(0, 2**32 - 1))
def test_the_inverse_undoes_the_curve(gamma: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps = rng.uniform(0.2, 1, 32)
    linear = np.concatenate(([0], np.cumsum(steps) / steps.sum())) ** gamma
    linear[-1] = 1.0
    response = ProjectorResponse((CODE,), (linear,))
    x, P = rng.random((200, 1)), rng.random((200, 1))
    # The issue asks 1e-6. The inverse is the table itself, read backwards: rounding is left, and that of P where the
    # curve is nearly flat (x of 1e-9 at the first step for an exponent of 3).
    assert np.abs(response.P_to_x(response.x_to_P(x)) - x).max() < 1e-12
    assert np.abs(response.x_to_P(response.P_to_x(P)) - P).max() < 1e-6


def test_a_device_of_whole_codes_shows_the_nearest_code() -> None:
    response = ProjectorResponse((CODE,) * 2, (CODE**2.0, CODE))
    x = np.random.default_rng(0).random((100, 2))
    shown = response.shown_x(x, 8)
    codes = response.x_to_P(shown) * 255
    np.testing.assert_allclose(codes, np.rint(codes), atol=1e-9)
    assert np.abs(response.x_to_P(x) * 255 - codes).max() <= 0.5 + 1e-9
    np.testing.assert_allclose(response.shown_x(shown, 8), shown, atol=1e-12)


@pytest.mark.parametrize(
    ("shares", "says"),
    [
        (np.zeros(33), "the red ramp gives no light"),
        (np.where(np.arange(33) == 20, 0.1, CODE), r"red-20 \(10.0% of full light\) is darker than .*red-19"),
        (np.minimum(1, 1.4 * CODE), r"the red ramp is clipped: ramp-white-red-29 \(code 0.91\) has 100.0%"),
        (CODE * np.nan, "the red ramp gives no light"),
    ],
)
def test_bad_ramps_are_named(shares: NDArray[np.float64], says: str) -> None:
    with pytest.raises(CalibrationError, match=says):
        _fit(shares)


def test_too_few_steps_are_refused() -> None:
    with pytest.raises(CalibrationError, match="at least 3 steps from dark to full, got 2"):
        fit_curve(CODE[[0, -1]], CODE[[0, -1]], NAMES[:2], "red")
