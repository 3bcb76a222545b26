"""The observer: closed forms of blur, of error figures and of planted ghosts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_sRGB, Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.observer import eye_blur, eye_sigma_mm, view_figures, view_to_sRGB

WHITE = np.array([0.94, 1.0, 1.12])
SHAPE = (80, 120)
ALL = np.ones(SHAPE, bool)
SIGMA_PX = 3.0


def _smooth_Lab(seed: int, L_mean: float = 50.0, L_range: float = 8.0) -> NDArray[np.float64]:
    """A picture of soft blobs, independent of one of another seed."""
    rng = np.random.default_rng(seed)
    blobs = gaussian_filter(rng.normal(size=(*SHAPE, 3)), (6, 6, 0))
    blobs /= blobs.std(axis=(0, 1))
    return blobs * (L_range, 4, 4) + (L_mean, 0, 0)


def _white_view() -> NDArray[np.float64]:
    """The white sheet with 40 % of fall-off to the corners, a little stronger in blue."""
    y, x = np.mgrid[-1 : 1 : SHAPE[0] * 1j, -1 : 1 : SHAPE[1] * 1j]
    return WHITE * (1 - 0.2 * (x**2 + y**2)[..., None] * (1.0, 1.0, 1.1))


def test_the_eye_sees_half_a_minute_of_arc() -> None:
    assert eye_sigma_mm(4000) == pytest.approx(0.58, abs=0.005)  # the design's figure, two digits
    assert eye_sigma_mm(2000) == pytest.approx(eye_sigma_mm(4000) / 2)
    with pytest.raises(InputError, match="distance_mm must be > 0"):
        eye_sigma_mm(0)


@pytest.mark.parametrize("cycles_per_px", [0.02, 0.05, 0.1])
def test_blur_lowers_a_grating_as_a_gaussian(cycles_per_px: float) -> None:
    x = np.arange(400)
    grating = np.broadcast_to(0.5 + 0.4 * np.cos(2 * np.pi * cycles_per_px * x), (20, 400))[..., None].repeat(3, axis=2)
    blurred = eye_blur(grating, SIGMA_PX)[10, 50:350, 1]
    expected = 0.4 * np.exp(-2 * (np.pi * cycles_per_px * SIGMA_PX) ** 2)
    assert np.ptp(blurred) / 2 == pytest.approx(expected, abs=1e-3)  # the kernel is cut at 4 sigma; 300 samples
    assert blurred.mean() == pytest.approx(0.5, abs=1e-3)


def test_blur_keeps_uniform_light_and_nothing_is_the_identity() -> None:
    flat = np.broadcast_to(WHITE, (30, 40, 3))
    np.testing.assert_allclose(eye_blur(flat, 7.5), flat, rtol=1e-6)  # float32
    noise = np.random.default_rng(0).random((30, 40, 3), np.float32)
    assert np.array_equal(eye_blur(noise, 0), noise)
    with pytest.raises(InputError, match=">= 0 pixels"):
        eye_blur(noise, -1)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 1000))
def test_the_mapped_picture_itself_is_perfect_under_any_fall_off(seed: int) -> None:
    Lab, white_view = _smooth_Lab(seed), _white_view()
    view = Lab_to_XYZ(Lab, WHITE) * white_view / WHITE
    figures = view_figures(view, white_view, Lab, _smooth_Lab(seed + 1), WHITE, SIGMA_PX, ALL)
    # The fall-off itself is blurred: its curvature over 3 px, and the repeated border. 960 px have 1/64 of it.
    assert figures["dE00_p95"] is not None
    assert figures["dE00_p95"] < 0.05
    assert figures["ghosting_percent"] is not None
    assert figures["ghosting_percent"] < 0.2


def test_a_uniform_error_is_its_dE00() -> None:
    wanted, seen = np.broadcast_to([50.0, 5, -5], (*SHAPE, 3)), np.broadcast_to([53.0, 5, -5], (*SHAPE, 3))
    white_view = np.broadcast_to(WHITE, (*SHAPE, 3))
    figures = view_figures(Lab_to_XYZ(seen, WHITE), white_view, wanted, None, WHITE, SIGMA_PX, ALL)
    expected = float(dE00(seen[0, 0], wanted[0, 0]))
    # float32 light
    assert figures == {
        "dE00_mean": pytest.approx(expected, abs=1e-4),
        "dE00_p95": pytest.approx(expected, abs=1e-4),
        "ghosting_percent": None,
    }


@pytest.mark.parametrize("ghost", [0.0, 0.02, -0.05])
def test_a_planted_ghost_is_found(ghost: float) -> None:
    """The view holds a share of the other picture, and 10 % less contrast of its own, which is no ghost."""
    own, other, white_view = _smooth_Lab(0), _smooth_Lab(1, L_mean=70), np.broadcast_to(WHITE, (*SHAPE, 3))
    assert abs(np.corrcoef(own[..., 0].ravel(), other[..., 0].ravel())[0, 1]) < 0.5
    view = own.copy()
    view[..., 0] += -0.1 * (own[..., 0] - 50) + ghost * other[..., 0]
    figures = view_figures(Lab_to_XYZ(view, WHITE), white_view, own, other, WHITE, SIGMA_PX, ALL)
    # L* is not linear in light, so the eye's blur of a sum is not the sum of the blurs.
    assert figures["ghosting_percent"] == pytest.approx(100 * abs(ghost), abs=0.2)


def test_what_lies_outside_the_mask_or_near_its_edge_does_not_count() -> None:
    Lab, white_view = _smooth_Lab(2), np.broadcast_to(WHITE, (*SHAPE, 3)).copy()
    view, mask = Lab_to_XYZ(Lab, WHITE), ALL.copy()
    mask[:, :30] = False
    clean = view_figures(view, white_view, Lab, None, WHITE, SIGMA_PX, mask)
    view[:, :29], white_view[:, :10] = 5.0, 0.0  # reaches 12 px through a kernel cut at 4 sigma
    dirty = view_figures(view, white_view, Lab, None, WHITE, SIGMA_PX, mask)
    assert clean["dE00_mean"] is not None
    assert dirty["dE00_mean"] == pytest.approx(clean["dE00_mean"], abs=0.02)  # what 3 to 4 sigma let through
    with pytest.raises(InputError, match="farther than 9 px"):
        view_figures(view, white_view, Lab, None, WHITE, SIGMA_PX, ~mask & (np.arange(120) < 15))
    with pytest.raises(InputError, match="without light"):
        view_figures(view, 0 * white_view, Lab, None, WHITE, SIGMA_PX, mask)
    with pytest.raises(InputError, match="mapped picture must have the view's shape"):
        view_figures(view, white_view, Lab[1:], None, WHITE, SIGMA_PX, mask)


def test_another_picture_of_one_lightness_cannot_ghost() -> None:
    Lab, white_view = _smooth_Lab(3), np.broadcast_to(WHITE, (*SHAPE, 3))
    gray = np.broadcast_to([50.0, 0, 0], (*SHAPE, 3))
    view = Lab_to_XYZ(Lab, WHITE)
    assert view_figures(view, white_view, Lab, gray, WHITE, SIGMA_PX, ALL)["ghosting_percent"] is None
    # The hiding surface is uniform itself; what is left of the hidden picture in it is still found.
    leak = Lab_to_XYZ(gray + 0.03 * (Lab - (50, 0, 0)), WHITE)
    ghosting = view_figures(leak, white_view, gray, Lab, WHITE, SIGMA_PX, ALL)["ghosting_percent"]
    assert ghosting == pytest.approx(3, abs=0.1)  # blur in light, fit in L*


def test_a_fixed_exposure_goes_back_the_way_pictures_come_in() -> None:
    Lab = _smooth_Lab(4)
    picture = view_to_sRGB(Lab_to_XYZ(Lab, WHITE), "fixed", WHITE)
    expected = np.rint(255 * np.clip(Lab_to_sRGB(Lab), 0, 1))
    assert picture.dtype == np.uint8
    assert np.max(np.abs(picture - expected)) <= 1  # float32 beside a rounding edge
    assert np.all(view_to_sRGB(WHITE[None, None], "fixed", WHITE) == 255)


def test_auto_exposure_is_one_gain() -> None:
    view = Lab_to_XYZ(_smooth_Lab(5, L_mean=25, L_range=4), WHITE)
    picture = view_to_sRGB(view, "auto", WHITE)
    bright = np.percentile(view[..., 1], 99.5)
    expected = view_to_sRGB(view * 0.9 / bright, "fixed", WHITE)
    assert np.max(np.abs(picture.astype(int) - expected)) <= 1  # float32 beside a rounding edge
    assert np.array_equal(view_to_sRGB(0.3 * view, "auto", WHITE), picture)
    assert not view_to_sRGB(0 * view, "auto", WHITE).any()
    with pytest.raises(InputError, match="fixed or auto"):
        view_to_sRGB(view, "bright", WHITE)


def test_a_preview_goes_through_the_eye() -> None:
    dots = (np.indices((60, 60)).sum(axis=0) % 2)[..., None] * WHITE
    picture = view_to_sRGB(dots, "fixed", WHITE, sigma_px=3.0)[15:-15, 15:-15]  # the border is repeated: 0 0 1 0 1
    L = XYZ_to_Lab(0.5 * WHITE, WHITE)[0]
    assert np.all(picture == np.rint(255 * Lab_to_sRGB(np.array([L, 0, 0]))))
