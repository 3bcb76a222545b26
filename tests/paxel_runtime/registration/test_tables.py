"""The paper's table, the plane check, the inverse of a table, and what is reported of a registration."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.registration import (
    TABLES,
    ChannelRegistration,
    fit_registration,
    invert_table,
    per_pixel_registration,
    registration_report,
    verdict,
)
from paxel_runtime.registration.delaunay import fill_holes, pixel_means
from paxel_runtime.registration.plane import fit_homography, homography_places, plane_figures
from paxel_runtime.structured_light import REASONS, Decoded, SensorNoise

WIDTH, HEIGHT = 96, 64
SHAPE = (150, 214)
HOMOGRAPHY = np.array([[2.1, 0.05, 6.0], [-0.04, 2.15, 8.0], [1e-4, -8e-5, 1.0]])


def grid(width: int = WIDTH, height: int = HEIGHT) -> NDArray[np.float64]:
    return np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(np.float64)


@cache
def decoded(noise_px: float = 0.02) -> Decoded:
    """A plane, seen straight, decoded with some noise."""
    camera = grid(SHAPE[1], SHAPE[0])
    uv = homography_places(np.linalg.inv(HOMOGRAPHY), camera)
    inside = np.all((uv > -0.4) & (uv < (WIDTH - 0.6, HEIGHT - 0.6)), axis=-1)
    uv = uv + np.random.default_rng(0).normal(0.0, noise_px, uv.shape)
    uv[~inside] = np.nan
    reason = np.where(inside, 0, 1).astype(np.uint8)
    signal = np.full(SHAPE, 30000.0, np.float32)
    confidence = inside.astype(np.float32)
    return Decoded(uv.astype(np.float32), signal, reason, SensorNoise(40.0, 1.5), (0.0, 0.0), confidence)


def rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(values**2)))


# --- the paper's table ----------------------------------------------------------------------------------------------


def test_means_are_means() -> None:
    uv = decoded().projector_xy
    means = pixel_means(decoded(), WIDTH, HEIGHT)
    for u, v in ((10, 20), (50, 33), (90, 60)):
        rows, columns = np.nonzero((np.floor(uv[..., 0] + 0.5) == u) & (np.floor(uv[..., 1] + 0.5) == v))
        assert means[v, u] == pytest.approx((columns.mean(), rows.mean()))


@given(seed=st.integers(0, 2**16))
def test_holes_of_a_linear_table_are_filled_exactly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = (grid(30, 24) @ rng.normal(size=(2, 2)) + rng.normal(size=2)).astype(np.float32)
    hole = np.zeros((24, 30), bool)
    for _ in range(3):
        top, left = rng.integers(1, 14), rng.integers(1, 18)
        hole[top : top + rng.integers(1, 9), left : left + rng.integers(1, 11)] = True
    holed = np.where(hole[..., None], np.float32(np.nan), table)
    # linear over triangles is exact for linear data, whichever triangles they are; float32 in, float32 out
    assert np.allclose(fill_holes(holed), table, atol=1e-4)
    assert np.array_equal(fill_holes(table), table)


def test_beyond_the_rim_the_nearest_pixel_stands_in() -> None:
    table = grid(10, 8).astype(np.float32)
    table[:, 7:] = np.nan
    filled = fill_holes(table)
    assert np.isfinite(filled).all()
    assert np.array_equal(filled[:, 8], filled[:, 6])


def test_the_papers_table_is_near_and_the_fit_nearer() -> None:
    truth = homography_places(HOMOGRAPHY, grid())
    errors = {}
    for name, make in TABLES.items():
        table = make(decoded(), WIDTH, HEIGHT)
        assert table.valid.all()
        errors[name] = rms(np.hypot(*np.moveaxis(table.camera_xy - truth, -1, 0))[2:-2, 2:-2])
    # about 4 camera pixels fall on a projector pixel, unevenly: their mean is off by up to a third of a camera pixel
    assert 0.05 < errors["per-pixel"] < 0.5
    assert errors["fit"] < 0.1 * errors["per-pixel"]
    assert next(iter(TABLES)) == "fit"


def test_hardly_any_pixel_makes_no_table() -> None:
    places = decoded().projector_xy.copy()
    places[2:] = np.nan
    with pytest.raises(CalibrationError, match="at least 100 projector pixels"):
        per_pixel_registration(replace(decoded(), projector_xy=places), WIDTH, HEIGHT)


# --- the plane ------------------------------------------------------------------------------------------------------


def test_a_homography_is_found_among_outliers() -> None:
    rng = np.random.default_rng(1)
    uv = rng.uniform(0, 90, (400, 2))
    xy = homography_places(HOMOGRAPHY, uv)
    xy[:80] += rng.uniform(-40, 40, (80, 2))
    assert np.allclose(fit_homography(uv, xy), HOMOGRAPHY, atol=1e-6)


def test_four_pairs_are_enough() -> None:
    uv = np.array([[0.0, 0.0], [90.0, 2.0], [88.0, 60.0], [1.0, 63.0]])
    assert np.allclose(fit_homography(uv, homography_places(HOMOGRAPHY, uv)), HOMOGRAPHY, atol=1e-9)


def test_a_plane_is_a_plane_and_a_bent_sheet_is_none() -> None:
    flat = homography_places(HOMOGRAPHY, grid()).astype(np.float32)
    valid = np.ones((HEIGHT, WIDTH), bool)
    assert plane_figures(flat, valid)["plane_max_px"] < 1e-3
    bent = flat + np.float32(0.5) * np.sin(grid() / 4.0).astype(np.float32)
    # sines of rms 0.35 along each axis
    assert plane_figures(bent, valid)["plane_rms_px"] == pytest.approx(0.5, abs=0.05)
    assert plane_figures(flat, np.zeros_like(valid)) == {}


# --- the inverse ----------------------------------------------------------------------------------------------------


def test_the_inverse_of_a_homography_is_its_inverse() -> None:
    inverse = invert_table(homography_places(HOMOGRAPHY, grid()), SHAPE)
    expected = homography_places(np.linalg.inv(HOMOGRAPHY), grid(SHAPE[1], SHAPE[0]))
    last = (WIDTH - 1, HEIGHT - 1)
    lit = np.all((expected > 0.01) & (expected < np.subtract(last, 0.01)), axis=-1)
    dark = np.any((expected < -0.01) | (expected > np.add(last, 0.01)), axis=-1)
    assert np.isfinite(inverse[lit]).all()
    assert np.isnan(inverse[dark]).all()
    # a quad is bilinear, the homography is not quite: its second derivative over eight is 1e-4
    assert np.max(np.abs(inverse - expected)[lit]) < 1e-3


def test_every_table_comes_back() -> None:
    rng = np.random.default_rng(2)
    table = 3.0 * grid(20, 16) + 5.0 + rng.uniform(-0.6, 0.6, (16, 20, 2))
    inverse = invert_table(table, (60, 70)).astype(np.float64)
    rows, columns = np.nonzero(np.isfinite(inverse[..., 0]))
    u, v = inverse[rows, columns].T
    i, j = np.minimum(v.astype(int), 14), np.minimum(u.astype(int), 18)
    a, b = (u - j)[:, None], (v - i)[:, None]
    upper = table[i, j] * (1 - a) + table[i, j + 1] * a
    lower = table[i + 1, j] * (1 - a) + table[i + 1, j + 1] * a
    assert rows.size > 1500
    assert np.allclose(upper * (1 - b) + lower * b, np.column_stack([columns, rows]), atol=1e-4)


def test_the_inverse_wants_a_table() -> None:
    with pytest.raises(InputError, match=r"must be \(H, W, 2\)"):
        invert_table(np.zeros((1, 5, 2)), (4, 4))


# --- the report -----------------------------------------------------------------------------------------------------


@cache
def fitted() -> ChannelRegistration:
    return fit_registration(decoded(), WIDTH, HEIGHT)


def test_residuals_count_every_point() -> None:
    residuals = fitted().residuals
    assert residuals.histogram.sum() == np.count_nonzero(decoded().reason == 0)
    assert residuals.rms_px.shape == (HEIGHT // 8, WIDTH // 8)
    # noise of 0.02 projector pixels, 2.1 camera pixels each, two coordinates
    assert np.nanmedian(residuals.rms_px) == pytest.approx(0.02 * 2.12 * np.sqrt(2), rel=0.1)


def test_the_report_tells_aberration_from_movement() -> None:
    table = fitted()
    stretched = replace(table, camera_xy=(table.camera_xy - 100) * np.float32(1.002) + 100)
    moved = replace(table, camera_xy=table.camera_xy + np.float32(0.5))
    told = {name: verdict(decoded(), table) for name in ("red", "green", "blue")}
    figures, pictures = registration_report({"red": stretched, "green": table, "blue": table}, told, "green")
    assert figures["verdict"] == "good"
    assert figures["chromatic_aberration"]["red"]["max_px"] == pytest.approx(0.002 * 115, rel=0.3)
    assert figures["chromatic_aberration"]["blue"]["max_px"] == 0.0
    assert pictures["registration"].shape[1:] == (1180, 3)
    assert pictures["registration"].std() > 10  # something is drawn
    figures, _ = registration_report({"red": moved, "green": table, "blue": table}, told, "green")
    assert figures["verdict"] == "usable"
    assert "red: all of it lies 0.71 camera pixels from green" in figures["why"]


def test_the_worst_channel_decides() -> None:
    reason = decoded().reason.copy()
    reason[:60] = REASONS.index("saturated")
    told = {"red": verdict(decoded(), fitted()), "green": verdict(replace(decoded(), reason=reason), fitted())}
    figures, _ = registration_report({"red": fitted(), "green": fitted()}, told, "green")
    assert figures["verdict"] == "repeat"
    assert figures["why"].startswith("green: ")
    assert "expose less" in figures["why"]
