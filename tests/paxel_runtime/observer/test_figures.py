"""The figures of a view as a whole, of views with planted errors, and what is said of them."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.observer import Viewer, fall_off, inner_mask, leveled, picture_to_Lab, view_figures, view_to_Lab

WHITE = np.array([0.94, 1.0, 1.12])
SHAPE = (80, 120)
ALL = np.ones(SHAPE, bool)
VIEWER = Viewer(4000.0, 0.194)  # sigma 3 px
INNER = inner_mask(ALL, VIEWER.sigma_px)


def smooth_Lab(seed: int, L_mean: float = 50.0, L_range: float = 8.0) -> NDArray[np.float64]:
    """A picture of soft blobs, independent of one of another seed."""
    blobs = gaussian_filter(np.random.default_rng(seed).normal(size=(*SHAPE, 3)), (6, 6, 0))
    blobs /= blobs.std(axis=(0, 1))
    return blobs * (L_range, 4, 4) + (L_mean, 0, 0)


def figures_of(
    view_XYZ: NDArray[Any],
    reference: NDArray[Any],
    mapped: NDArray[Any],
    other: NDArray[Any] | None = None,
    source: NDArray[Any] | None = None,
) -> dict[str, Any]:
    """All of it through the eye, as the stage does."""
    sigma = VIEWER.sigma_px
    seen = [None if Lab is None else picture_to_Lab(Lab, WHITE, sigma) for Lab in (mapped, other, source)]
    view = view_to_Lab(leveled(view_XYZ, fall_off(reference, WHITE, sigma)), WHITE, sigma)
    assert seen[0] is not None
    return view_figures(view, seen[0], seen[1], seen[2], INNER, VIEWER, 4.0)


@settings(max_examples=5)
@given(st.integers(0, 1000))
def test_the_mapped_picture_itself_is_perfect_under_any_fall_off(seed: int) -> None:
    Lab = smooth_Lab(seed)
    y, x = np.mgrid[-1 : 1 : SHAPE[0] * 1j, -1 : 1 : SHAPE[1] * 1j]
    reference = WHITE * (1 - 0.2 * (x**2 + y**2)[..., None] * (1.0, 1.0, 1.1))
    figures = figures_of(Lab_to_XYZ(Lab, WHITE) * reference / WHITE, reference, Lab, smooth_Lab(seed + 1), Lab)
    # The fall-off itself is blurred: its curvature over 3 px, and the repeated border. 960 px have 1/64 of it.
    assert figures["dE00_p95"] < 0.05
    assert figures["ghosting_percent"] < 0.2
    assert figures["source_dE00_mean"] == figures["dE00_mean"]
    assert figures["coherent_gain"] == pytest.approx(1, abs=0.005)
    assert figures["local_contrast_kept"] == pytest.approx(1, abs=0.005)
    assert figures["texture_L"] < 0.05
    assert figures["L_range"] == pytest.approx(figures["L_range_mapped"], abs=0.1)
    assert figures["chroma_mean"] == pytest.approx(figures["chroma_mean_mapped"], abs=0.05)


def test_a_uniform_error_is_its_dE00() -> None:
    wanted, seen = np.broadcast_to([50.0, 5, -5], (*SHAPE, 3)), np.broadcast_to([53.0, 5, -5], (*SHAPE, 3))
    figures = figures_of(Lab_to_XYZ(seen, WHITE), np.broadcast_to(WHITE, (*SHAPE, 3)), wanted)
    expected = float(dE00(seen[0, 0], wanted[0, 0]))
    for key in ("dE00_mean", "dE00_p95", "dE00_rms"):
        assert figures[key] == pytest.approx(expected, abs=1e-4)  # float32 light
    assert figures["chroma_max"] == pytest.approx(np.hypot(5, 5), abs=1e-3)
    for key in ("ghosting_percent", "coherent_gain", "source_dE00_mean", "local_contrast_kept"):
        assert figures[key] is None


@pytest.mark.parametrize("ghost", [0.0, 0.02, -0.05])
def test_a_planted_ghost_and_a_planted_gain_are_found_together(ghost: float) -> None:
    """The view holds a share of the other picture, and 90 % of the contrast of its own, which is no ghost."""
    own, other = smooth_Lab(0), smooth_Lab(1, L_mean=70)
    view = own.copy()
    view[..., 0] += -0.1 * (own[..., 0] - 50) + ghost * other[..., 0]
    figures = figures_of(Lab_to_XYZ(view, WHITE), np.broadcast_to(WHITE, (*SHAPE, 3)), own, other, own)
    # L* is not linear in light, so the eye's blur of a sum is not the sum of the blurs.
    assert figures["ghosting_percent"] == pytest.approx(100 * abs(ghost), abs=0.2)
    assert figures["ghosting_fine_percent"] == pytest.approx(100 * abs(ghost), abs=0.3)
    assert abs(figures["pictures_correlation"]) < 0.5
    # The ghost's gradients are those of 15 blobs: they do not cancel altogether against the picture's.
    assert figures["coherent_gain"] == pytest.approx(0.9, abs=0.005 + 0.3 * abs(ghost))
    assert figures["local_contrast_kept"] == pytest.approx(0.9, abs=0.005 + 0.3 * abs(ghost))


def test_what_does_not_fit_is_told() -> None:
    Lab = smooth_Lab(2)
    with pytest.raises(InputError, match="other picture must have the view's shape"):
        view_figures(Lab, Lab, Lab[1:], None, INNER, VIEWER, 4.0)
    with pytest.raises(InputError, match="with pixels in it"):
        view_figures(Lab, Lab, None, None, ~ALL, VIEWER, 4.0)
