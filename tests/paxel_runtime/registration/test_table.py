"""Registration against an analytic map: homography, radial distortion, a wavy sheet, ink, noise, outliers, holes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.registration import ChannelRegistration, fit, fit_registration, verdict, warp_to_nodal
from paxel_runtime.registration import start as begin
from paxel_runtime.structured_light import REASONS, Decoded, SensorNoise

WIDTH, HEIGHT = 170, 121
SHAPE = (272, 372)
REASON = {text: number for number, text in enumerate(REASONS)}


def to_camera(u: NDArray[np.float64], v: NDArray[np.float64], wave_px: float = 0.0) -> NDArray[np.float64]:
    """Camera place (..., 2) of projector places: 2 camera pixels each, keystone, 1.5 % of distortion, waves."""
    a, b = (u - 84.5) / 85.0, (v - 60.0) / 85.0
    stretch = 1.0 - 0.015 * (a * a + b * b)
    a, b = a * stretch, b * stretch
    z = 1.0 + 0.02 * a - 0.015 * b
    x = 186.0 + 170.0 * (np.cos(0.02) * a - np.sin(0.02) * b) / z
    y = 136.0 + 170.0 * (np.sin(0.02) * a + np.cos(0.02) * b) / z
    x = x + wave_px * np.sin(u / 9.0 + 0.4) * np.cos(v / 11.0)
    y = y + wave_px * np.cos(u / 10.0) * np.sin(v / 8.0 + 1.0)
    return np.stack([x, y], axis=-1)


def to_projector(x: NDArray[np.float64], y: NDArray[np.float64], wave_px: float = 0.0) -> NDArray[np.float64]:
    """Inverse of `to_camera`, by Newton's method."""
    u, v = 84.5 + (x - 186.0) / 2.0, 60.0 + (y - 136.0) / 2.0
    for _ in range(4):
        here = to_camera(u, v, wave_px)
        du = (to_camera(u + 1e-4, v, wave_px) - here) / 1e-4
        dv = (to_camera(u, v + 1e-4, wave_px) - here) / 1e-4
        off = np.stack([x, y], axis=-1) - here
        area = du[..., 0] * dv[..., 1] - du[..., 1] * dv[..., 0]
        u = u + (off[..., 0] * dv[..., 1] - off[..., 1] * dv[..., 0]) / area
        v = v + (du[..., 0] * off[..., 1] - du[..., 1] * off[..., 0]) / area
    return np.stack([u, v], axis=-1)


@cache
def truth(wave_px: float = 0.0) -> NDArray[np.float64]:
    v, u = np.indices((HEIGHT, WIDTH)).astype(np.float64)
    return to_camera(u, v, wave_px)


@cache
def measured(noise_px: float = 0.0, wave_px: float = 0.0, seed: int = 0) -> Decoded:
    """Decoded camera pixels on blank paper."""
    y, x = np.indices(SHAPE).astype(np.float64)
    uv = to_projector(x, y, wave_px)
    inside = (uv > 1.0).all(axis=-1) & (uv[..., 0] < WIDTH - 2) & (uv[..., 1] < HEIGHT - 2)
    uv = uv + np.random.default_rng(seed).normal(0.0, noise_px, uv.shape) if noise_px else uv
    uv[~inside] = np.nan
    reason = np.where(inside, 0, REASON["too dark"]).astype(np.uint8)
    signal = np.full(SHAPE, 30000.0, np.float32)
    return Decoded(
        uv.astype(np.float32), signal, reason, SensorNoise(40.0, 1.5), (0.0, 0.0), (reason == 0).astype(np.float32)
    )


@cache
def fitted(noise_px: float) -> ChannelRegistration:
    return fit_registration(measured(noise_px), WIDTH, HEIGHT)


def error(table: ChannelRegistration, wave_px: float = 0.0) -> NDArray[np.float64]:
    off = table.camera_xy - truth(wave_px)
    return np.hypot(off[..., 0], off[..., 1])


def rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def on_ink(psf_px: float = 0.55, dot_px: float = 10.2) -> Decoded:
    """What a camera with a Gaussian point spread measures on a checkerboard of black (2.5 %) and white dots."""
    fine = 3
    y, x = (np.indices((SHAPE[0] * fine, SHAPE[1] * fine)) + 0.5) / fine - 0.5
    c, s = np.cos(0.5) / dot_px, np.sin(0.5) / dot_px
    reflectance = np.where((np.floor(c * x + s * y) + np.floor(c * y - s * x)) % 2 == 0, 0.025, 1.0)
    blank = measured()
    uv = to_projector(x, y)
    seen = [
        gaussian_filter(plane, psf_px * fine, mode="nearest", truncate=3.5)
        for plane in (reflectance, *np.moveaxis(uv, -1, 0) * reflectance)
    ]
    middle = [plane[1::fine, 1::fine] for plane in seen]
    place = np.stack([middle[1] / middle[0], middle[2] / middle[0]], axis=-1)
    place[blank.reason != 0] = np.nan
    return replace(blank, projector_xy=place.astype(np.float32), signal=(30000.0 * middle[0]).astype(np.float32))


# --- the table ------------------------------------------------------------------------------------------------------


def test_without_noise_the_table_is_the_map() -> None:
    table = fit_registration(measured(), WIDTH, HEIGHT)
    # float32 coordinates are good to 1e-5, a polynomial of degree 12 to better than 1e-3 on this map
    assert np.max(error(table)) < 1e-3
    assert table.valid.all()
    assert table.camera_xy.dtype == np.float32
    assert table.figures["outliers"] == 0.0
    assert table.figures["coverage"] == 1.0
    assert table.figures["residual_max_px"] == pytest.approx(0.0, abs=1e-3)


def test_noise_averages_out() -> None:
    noise_px = 0.05
    decoded, table = measured(noise_px), fitted(noise_px)
    points, terms = np.sum(decoded.reason == 0), 91
    # least squares with at most 91 terms: sigma sqrt(terms / points), two coordinates, 2 camera px a projector px
    assert rms(error(table)) < 1.5 * 2 * noise_px * np.sqrt(2 * terms / points)
    assert np.max(error(table)) < 0.05
    assert table.figures["residual_rms_px"] == pytest.approx(2 * noise_px * np.sqrt(2), rel=0.05)


def test_a_third_of_outliers_does_no_harm() -> None:
    clean, decoded = fitted(0.05), measured(0.05)
    rng = np.random.default_rng(5)
    wrong = (rng.random(SHAPE) < 0.3) & (decoded.reason == 0)
    places = decoded.projector_xy.copy()
    places[wrong] = rng.uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (int(wrong.sum()), 2))
    table = fit_registration(replace(decoded, projector_xy=places), WIDTH, HEIGHT)
    assert rms(error(table)) < 2.0 * rms(error(clean)) + 1e-3
    assert table.figures["outliers"] == pytest.approx(0.3, abs=0.01)
    assert table.valid.all()


def test_ink_pulls_pixels_and_not_the_table() -> None:
    decoded = on_ink()
    known = decoded.reason == 0
    pulled = to_camera(*np.moveaxis(decoded.projector_xy.astype(np.float64), -1, 0))[known]
    y, x = np.nonzero(known)
    assert rms(np.hypot(pulled[:, 0] - x, pulled[:, 1] - y)) > 0.1  # what a table of the pixels themselves would have
    table = fit_registration(decoded, WIDTH, HEIGHT)
    # the design asks for 0.0055; the shift along the signal's gradient is exact but for sampling the gradient
    assert rms(error(table)) < 0.002
    assert np.max(error(table)) < 0.01
    # Tweedie: the factor is the variance of the point spread; differences of the signal fall 10 % short of its slope
    assert table.figures["ink_px2"] == pytest.approx(0.55**2, rel=0.15)


def test_a_wavy_sheet_is_followed() -> None:
    wave_px = 0.15
    decoded = measured(0.03, wave_px)
    table = fit_registration(decoded, WIDTH, HEIGHT)
    assert table.figures["sigma_px"] is not None
    assert rms(error(table, wave_px)) < 0.012  # the polynomial alone: 0.06
    stiff = np.moveaxis(begin.polynomial_grid(_polynomial(decoded), WIDTH, HEIGHT), 0, -1)
    assert rms(np.hypot(*np.moveaxis(stiff - truth(wave_px), -1, 0))) > 3.0 * rms(error(table, wave_px))


def _polynomial(decoded: Decoded) -> NDArray[np.float64]:
    rows, columns = np.nonzero(decoded.reason == 0)
    uv = decoded.projector_xy[rows, columns].astype(np.float64)
    terms = begin.chebyshev_terms(uv[:, 0], uv[:, 1], WIDTH, HEIGHT, 6)
    return np.asarray(
        np.linalg.lstsq(terms, np.column_stack([columns, rows]).astype(np.float64), rcond=None)[0], np.float64
    )


def test_a_hole_is_marked_and_its_surroundings_are_not_harmed() -> None:
    decoded = measured(0.05)
    reason, places = decoded.reason.copy(), decoded.projector_xy.copy()
    u, v = decoded.projector_xy[..., 0], decoded.projector_xy[..., 1]
    hidden = (u > 60) & (u < 110) & (v > 30) & (v < 90)
    reason[hidden] = REASON["bit contrast too low"]
    places[hidden] = np.nan
    table = fit_registration(replace(decoded, reason=reason, projector_xy=places), WIDTH, HEIGHT)
    assert not table.valid[36:85, 66:105].any()  # 4 pixels and more from what was measured
    assert table.valid[:28].all()
    assert table.valid[:, :58].all()
    assert rms(error(table)[table.valid]) < 0.01
    assert rms(error(table)[~table.valid]) < 0.015  # the polynomial carries on over it
    assert verdict(decoded, table)[0] == "usable"


def test_what_the_camera_does_not_see_is_marked_and_extrapolated_sanely() -> None:
    decoded = measured(0.05)
    cut = 240
    reason, places = decoded.reason[:, :cut], decoded.projector_xy[:, :cut]
    part = replace(decoded, reason=reason, projector_xy=places, signal=decoded.signal[:, :cut])
    table = fit_registration(part, WIDTH, HEIGHT)
    seen = truth()[..., 0] <= cut - 1
    assert not table.valid[~seen & (truth()[..., 0] > cut + 1)].any()
    assert np.mean(table.valid[truth()[..., 0] < cut - 3]) == 1.0
    assert rms(error(table)[table.valid]) < 0.01
    assert np.max(error(table)) < 3.0
    word, why = verdict(part, table)
    assert word == "repeat"
    assert "of the projection has no table entry: hidden or out of view" in why


def test_lone_survivors_in_a_hole_do_not_make_it_valid() -> None:
    decoded = measured(0.05)
    u, v = decoded.projector_xy[..., 0], decoded.projector_xy[..., 1]
    hidden = (u > 60) & (u < 110) & (v > 30) & (v < 90)
    hidden &= np.random.default_rng(3).random(SHAPE) > 0.01
    places = decoded.projector_xy.copy()
    places[hidden] = np.nan
    reason = np.where(hidden, np.uint8(1), decoded.reason)
    table = fit_registration(replace(decoded, reason=reason, projector_xy=places), WIDTH, HEIGHT)
    assert np.mean(table.valid[36:85, 66:105]) < 0.02


def test_the_same_seed_gives_the_same_table() -> None:
    decoded = measured(0.05)
    one, two = fitted(0.05), fit_registration(decoded, WIDTH, HEIGHT, seed=0)
    assert np.array_equal(one.camera_xy, two.camera_xy)
    assert one.figures == two.figures


def test_points_that_make_no_sheet_are_refused() -> None:
    decoded = measured()
    known = decoded.reason == 0
    rng = np.random.default_rng(0)
    places = decoded.projector_xy.copy()
    places[known] = rng.permutation(places[known])
    with pytest.raises(CalibrationError, match="must lie on one smooth sheet"):
        fit_registration(replace(decoded, projector_xy=places), WIDTH, HEIGHT)
    reason = decoded.reason.copy()
    reason[np.nonzero(known)[0][100] :] = 1
    with pytest.raises(CalibrationError, match="at least 500 decoded camera pixels"):
        fit_registration(replace(decoded, reason=reason), WIDTH, HEIGHT)


def test_verdicts() -> None:
    decoded, table = measured(0.05), fitted(0.05)
    assert verdict(decoded, table)[0] == "good"
    bright = decoded.reason.copy()
    bright[:60] = REASON["saturated"]
    word, why = verdict(replace(decoded, reason=bright), table)
    assert word == "repeat"
    assert "saturated: expose less" in why
    blurred = replace(table, figures={**table.figures, "residual_rms_px": 0.9})
    assert verdict(decoded, blurred) == ("usable", "points scatter by 0.90 camera pixels: check focus and exposure")


# --- nodal images ---------------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=25)
@given(
    shape=st.tuples(st.integers(1, 12), st.integers(1, 12), st.integers(1, 4)),
    seed=st.integers(0, 2**16),
)
def test_warping_is_bilinear(shape: tuple[int, int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    picture = rng.integers(0, 65536, shape).astype(np.uint16)
    table = rng.uniform((-0.4, -0.4), (shape[1] - 0.6, shape[0] - 0.6), (5, 7, 2)).astype(np.float32)
    nodal = warp_to_nodal(picture, table)
    assert nodal.shape == (5, 7, shape[2])
    assert nodal.dtype == np.float32
    for c in range(shape[2]):
        expected = map_coordinates(
            picture[..., c].astype(np.float64), [table[..., 1], table[..., 0]], order=1, mode="nearest"
        )
        assert np.allclose(nodal[..., c], expected, atol=0.02)  # float32 of values up to 65535
    assert np.array_equal(warp_to_nodal(picture[..., 0], table), nodal[..., 0])


def test_warping_has_no_value_outside_the_picture() -> None:
    picture = np.arange(20.0).reshape(4, 5)
    table = np.array([[[-0.6, 1.0], [4.6, 1.0], [2.0, 3.6], [np.nan, 1.0], [4.4, 3.4]]])
    nodal = warp_to_nodal(picture, table)
    assert np.array_equal(np.isnan(nodal), [[True, True, True, True, False]])
    assert nodal[0, 4] == 19.0


def test_warping_refuses_shapes_that_do_not_fit() -> None:
    with pytest.raises(InputError, match=r"a table \(H, W, 2\)"):
        warp_to_nodal(np.zeros((4, 5)), np.zeros((3, 3)))


# --- the fits' parts ------------------------------------------------------------------------------------------------


@given(degree=st.integers(1, 14))
def test_degree_and_number_of_coefficients_belong_together(degree: int) -> None:
    assert begin.degree_of(np.zeros((len(begin.orders(degree)), 2))) == degree


@pytest.mark.parametrize("step", [1, 4, 8])
def test_the_grid_is_the_terms_at_the_centres_of_blocks(step: int) -> None:
    width, height = 41, 27
    coefficients = np.random.default_rng(0).normal(size=(len(begin.orders(5)), 2))
    grid = begin.polynomial_grid(coefficients, width, height, step)
    rows, columns = np.indices(grid.shape[1:]).reshape(2, -1).astype(np.float64)
    u, v = step * (columns + 0.5) - 0.5, step * (rows + 0.5) - 0.5
    terms = begin.chebyshev_terms(u, v, width, height, 5)
    assert np.allclose(grid.reshape(2, -1).T, terms @ coefficients, atol=1e-12)


def test_a_quadratic_field_is_smoothed_to_itself_up_to_the_rim() -> None:
    rows, columns = 20, 25
    j, i = np.indices((rows, columns)).astype(np.float64)
    field = np.stack([0.3 + 0.02 * i - 0.01 * j + 1e-3 * i * j, 1e-3 * (i - 9) ** 2 - 2e-3 * j**2])
    weight = np.random.default_rng(0).uniform(0.5, 2.0, (rows, columns))
    sums = np.zeros((3, rows + 2 * fit.RIM, columns + 2 * fit.RIM))
    sums[:, fit.RIM : -fit.RIM, fit.RIM : -fit.RIM] = np.stack([weight, weight * field[0], weight * field[1]])
    smooth = fit.smooth_blocks(sums, 8.0)[:, fit.RIM : -fit.RIM, fit.RIM : -fit.RIM]
    assert np.allclose(smooth, field, atol=0.01)  # the ridge of 1e-4 pulls a little at the corners
    assert np.allclose(smooth[:, 3:-3, 3:-3], field[:, 3:-3, 3:-3], atol=1e-3)
    assert not fit.smooth_blocks(sums, np.inf).any()


def test_a_quadratic_of_the_blocks_is_the_same_quadratic_of_the_pixels() -> None:
    width, height = 37, 30
    rows, columns = -(-height // fit.BLOCK) + 2 * fit.RIM, -(-width // fit.BLOCK) + 2 * fit.RIM

    def quadratic(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack([0.1 + 0.01 * u + 1e-3 * v**2, 1e-3 * u * v - 0.02 * u])

    j, i = np.indices((rows, columns)).astype(np.float64)
    blocks = quadratic(fit.BLOCK * (i - fit.RIM + 0.5) - 0.5, fit.BLOCK * (j - fit.RIM + 0.5) - 0.5)
    v, u = np.indices((height, width)).astype(np.float64)
    assert np.allclose(fit.blocks_to_pixels(blocks, width, height), quadratic(u, v), atol=1e-12)


def test_gathering_is_a_weighted_sum_over_blocks() -> None:
    rng = np.random.default_rng(7)
    width, height, shape = 22, 17, (9, 12)
    places = rng.uniform((0.5, 0.5), (width - 1.5, height - 1.5), (*shape, 2)).astype(np.float32)
    places[2, 3] = np.nan
    signal = rng.uniform(0.5, 2.0, shape).astype(np.float32)
    v, u = np.indices((height, width)).astype(np.float64)
    table = np.stack([0.5 * u + 0.1 * v, 0.4 * v - 0.05 * u])  # bilinear interpolation is exact on a plane
    sums, hit = fit.gather(places, signal, 1.25, table, 0.3, 6.0)
    expected, touched = np.zeros_like(sums), np.zeros_like(hit)
    across = (
        8 * (np.roll(signal, -1, 1) - np.roll(signal, 1, 1)) - np.roll(signal, -2, 1) + np.roll(signal, 2, 1)
    ) / 12
    down = (8 * (np.roll(signal, -1, 0) - np.roll(signal, 1, 0)) - np.roll(signal, -2, 0) + np.roll(signal, 2, 0)) / 12
    for row, column in np.ndindex(shape):
        if row == 2 and column == 3:
            continue
        pu, pv = places[row, column].astype(float)
        rim = row < 2 or column < 2 or row >= shape[0] - 2 or column >= shape[1] - 2
        shift = np.zeros(2) if rim else 0.3 * np.array([across[row, column], down[row, column]]) / signal[row, column]
        off = np.array([column, row]) + shift - [0.5 * pu + 0.1 * pv, 0.4 * pv - 0.05 * pu]
        weight = max(1.0 - (off @ off) / 36.0, 0.0) ** 2 * (signal[row, column] / 1.25) ** 2
        if weight > 0:
            j, i = round(pv), round(pu)
            touched[j, i] = True
            expected[:, j // 4 + fit.RIM, i // 4 + fit.RIM] += weight * np.array([1.0, *off])
    assert np.allclose(sums, expected, rtol=1e-5, atol=1e-6)  # the signal is float32
    assert np.array_equal(hit, touched)


def test_tukey_ignores_what_is_far() -> None:
    rng = np.random.default_rng(0)
    residual = rng.normal(0.0, 0.2, (4000, 2))
    residual[:1000] += 50.0
    trust, cutoff_px = begin.tukey(residual, np.ones(4000), np.ones(4000))
    assert not trust[:1000].any()
    # 6 sigma; a quarter of outliers moves the median to the 67 % point of the rest: 1.49 / 1.18 times its place
    assert cutoff_px == pytest.approx(6 * 0.2 * 1.26, rel=0.05)
    assert np.all(trust[1000:] > 0)


@pytest.mark.slow
@pytest.mark.parametrize(("quality", "limit_px"), [("ideal", 0.01), ("realistic", 0.01), ("harsh", 0.03)])
def test_the_virtual_bench_is_registered_to_hundredths_of_a_camera_pixel(quality: str, limit_px: float) -> None:
    """Captures of the whole bench, print in place, wavy sheet, against the bench's own truth."""
    from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
    from paxel_runtime.model.pattern import Pattern
    from paxel_runtime.structured_light import decode, plan_frames

    width, height = 480, 270
    cells = np.array([[0, 1], [1, 0]], np.uint8)
    pattern = Pattern("checkerboard", ("black", "white"), cells, 0.75, 30.0, (600.0, 400.0))
    setup = BenchSetup(pattern, (width, height), 70.3, ("red", "green", "blue"), 8, (1024, 768), 14, 10.0, quality, 0)
    bench = VirtualBench(setup)

    def shown(name: str) -> NDArray[np.uint16]:
        codes = np.zeros((height, width, 3), np.uint8)
        codes[..., 1] = np.uint8(255) * frames[name].pixels(width, height)
        bench.show(codes)
        return bench.capture("green")

    frames = {frame.name: frame for frame in plan_frames(width, height)}
    decoded = decode(shown, width, height)
    table = fit_registration(decoded, width, height)
    off = np.hypot(*np.moveaxis(table.camera_xy - bench.truth.camera_xy("green"), -1, 0))
    assert table.valid.mean() > 0.999
    assert rms(off) < limit_px
