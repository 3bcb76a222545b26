"""The viewer's eye: closed forms of its blur, of levelling under fall-off, and of the border that does not count."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.observer import (
    Viewer,
    eye_blur,
    eye_sigma_mm,
    fall_off,
    inner_mask,
    leveled,
    picture_to_Lab,
    view_to_Lab,
)
from paxel_runtime.observer.gaussian import gaussian_blur

WHITE = np.array([0.94, 1.0, 1.12])
SIGMA_PX = 3.0


def test_the_eye_sees_half_a_minute_of_arc() -> None:
    assert eye_sigma_mm(4000) == pytest.approx(0.58, abs=0.005)  # the design's figure, two digits
    assert eye_sigma_mm(2000) == pytest.approx(eye_sigma_mm(4000) / 2)
    for wrong in (0, -1, np.nan, np.inf):
        with pytest.raises(InputError, match="distance_mm must be > 0"):
            eye_sigma_mm(wrong)


def test_a_viewer_knows_its_raster() -> None:
    viewer = Viewer(4000, 281 / 1920)
    assert viewer.sigma_px == pytest.approx(eye_sigma_mm(4000) * 1920 / 281)
    assert viewer.px_per_degree == pytest.approx(60 / 0.5 * viewer.sigma_px, rel=1e-3)  # the tangent of one degree
    with pytest.raises(InputError, match="pitch"):
        Viewer(4000, 0)


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


@pytest.mark.parametrize("shape", [(40, 60, 3), (9, 200), (30, 7, 2)])
@pytest.mark.parametrize("sigma_px", [0.6, 3.0, 11.0])
def test_the_kernel_is_the_library_s_blur(shape: tuple[int, ...], sigma_px: float) -> None:
    values = np.random.default_rng(0).random(shape)
    for repeated, mode in ((True, "reflect"), (False, "constant")):
        expected = gaussian_filter(values, sigma_px, axes=(0, 1), mode=mode)
        np.testing.assert_allclose(gaussian_blur(values, sigma_px, repeated=repeated), expected, atol=1e-14)
    single = gaussian_blur(values.astype(np.float32), sigma_px)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, gaussian_filter(values, sigma_px, axes=(0, 1), mode="reflect"), atol=1e-6)


def test_a_view_under_fall_off_is_the_picture_that_is_shown() -> None:
    Lab = np.broadcast_to([40.0, 12, -7], (60, 90, 3))
    y, x = np.mgrid[-1:1:60j, -1:1:90j]
    reference = WHITE * (1 - 0.2 * (x**2 + y**2)[..., None] * (1.0, 1.0, 1.1))
    view = Lab_to_XYZ(Lab, WHITE) * reference / WHITE
    seen = view_to_Lab(leveled(view, fall_off(reference, WHITE, SIGMA_PX)), WHITE, SIGMA_PX)
    # The fall-off is blurred before it divides: its curvature over 3 px. At the frame's edge the border is repeated.
    np.testing.assert_allclose(seen[9:-9, 9:-9], Lab[9:-9, 9:-9], atol=0.1)
    np.testing.assert_allclose(picture_to_Lab(Lab, WHITE, SIGMA_PX), Lab, atol=1e-3)  # float32
    assert not leveled(view, np.zeros(view.shape, np.float32)).any()  # no light: black, and no warning
    with pytest.raises(InputError, match="must have the view's shape"):
        leveled(view, np.ones((59, 90, 3), np.float32))


def test_dots_average_in_light_and_not_in_lightness() -> None:
    L = np.where(np.indices((60, 60)).sum(axis=0) % 2, 80.0, 20.0)
    Lab = np.stack([L, 0 * L, 0 * L], axis=-1)
    mean_Y = np.mean([Lab_to_XYZ(np.array([v, 0, 0]), WHITE)[1] for v in (20.0, 80.0)])
    expected = XYZ_to_Lab(mean_Y * WHITE, WHITE)[0]
    assert picture_to_Lab(Lab, WHITE, SIGMA_PX)[30, 30, 0] == pytest.approx(expected, abs=1e-3)  # not 50


def test_the_border_that_does_not_count_is_three_sigma_wide() -> None:
    mask = np.ones((40, 50), bool)
    mask[:, :10] = False
    inner = inner_mask(mask, 2.0)
    rows, columns = np.nonzero(inner)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (6, 33, 16, 43)
    assert inner.sum() == 28 * 28
    with pytest.raises(InputError, match="farther than 21 px"):
        inner_mask(mask, 7.0)
