from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_design.patterns import BLUE_NOISE, make_pattern
from paxel_design.patterns.gaussian import blur, gaussian_kernel
from paxel_design.patterns.request import apportion
from paxel_design.patterns.swap import swap_classes
from paxel_design.patterns.swap_kernels import sweep
from paxel_design.patterns.void_and_cluster import void_and_cluster_ones
from paxel_design.patterns.void_and_cluster_kernels import fill_voids, relax
from paxel_design.patterns.zhou_fang import zhou_fang_coefficients, zhou_fang_sheet
from paxel_runtime.errors import InputError

BW = ("black", "white")
SIX = ("cyan", "magenta", "yellow", "red", "green", "blue")
LOW = 0.1  # cycles per cell: what the eye sees of a dot


def frequencies(n):
    return np.hypot(*np.meshgrid(np.fft.fftfreq(n), np.fft.fftfreq(n), indexing="ij"))


def power(fields, window=None):
    """Mean periodogram of square fields of 0 and 1 over s (1 - s): 1 everywhere for white noise."""
    window = np.ones(fields[0].shape) if window is None else window
    share = np.mean(fields)
    spectra = [np.abs(np.fft.fft2((field - share) * window)) ** 2 for field in fields]
    return np.mean(spectra, axis=0) / (window**2).sum() / (share * (1 - share))


def low_power(fields):
    f = frequencies(fields[0].shape[0])
    return power(fields)[(f > 0) & (f < LOW)].mean()


@pytest.fixture(scope="module")
def fields_at_half():
    """Eight fields of 128 x 128 for each method; Zhou-Fang's are cut from a 1024 sheet, under a Hann window."""
    sheet = zhou_fang_sheet(0.5, (1024, 1024), 5)
    blocks = sheet.reshape(8, 128, 8, 128).swapaxes(1, 2).reshape(64, 128, 128)
    return {
        "swap": [swap_classes((0.5, 0.5), (128, 128), 2.0, seed) for seed in range(8)],
        "void-and-cluster": [void_and_cluster_ones(128 * 64, (128, 128), seed) for seed in range(8)],
        "zhou-fang": list(blocks),
    }


@pytest.mark.parametrize("method", BLUE_NOISE)
def test_at_half_the_spectrum_is_blue_without_peaks_and_the_same_in_both_directions(method, fields_at_half):
    fields = fields_at_half[method]
    torus = method != "zhou-fang"
    hann = np.hanning(128)
    spectrum = power(fields, None if torus else np.outer(hann, hann))
    f = frequencies(128)
    above_dc = f > (0 if torus else 1.5 / 128)  # the window spreads the mean over the first bins
    # measured: 3.8 (swap), 3.8 (void-and-cluster), 3.0 (zhou-fang); a checkerboard has 16 384
    assert spectrum[above_dc].max() / spectrum[above_dc].mean() < 6
    # measured: 0.003, 0.017, 0.011; white noise has 1
    assert spectrum[above_dc & (f < LOW)].mean() <= 0.02
    across = np.mean([np.mean(field[:, 1:] != field[:, :-1]) for field in fields])
    along = np.mean([np.mean(field[1:] != field[:-1]) for field in fields])
    assert abs(across - along) < 0.02


@pytest.mark.parametrize("method", BLUE_NOISE)
@pytest.mark.parametrize("share", [0.5, 0.3, 0.85])
def test_shares_of_two_colorants_are_exact_to_one_cell(method, share):
    pattern = make_pattern("blue-noise", BW, 1.0, 30, (90, 60), 4, shares=(share, 1 - share), blue_noise=method)
    assert abs(pattern.shares()[0] - share) * pattern.cells.size <= 1
    other = make_pattern("blue-noise", BW, 1.0, 30, (90, 60), 5, shares=(share, 1 - share), blue_noise=method)
    assert not np.array_equal(pattern.cells, other.cells)


def test_every_colorant_and_every_union_of_six_is_free_of_low_frequencies_by_the_same_factor():
    fields = [swap_classes((1 / 6,) * 6, (128, 128), 2.0, seed) for seed in range(2)]
    unions = [union for size in range(1, 6) for union in combinations(range(6), size)]
    figures = np.array([low_power([np.isin(cells, union) for cells in fields]) for union in unions])
    assert figures.max() <= 0.02
    # 500 bins a field: each figure is known to sqrt(2 / 500) = 6 %, the extremes of 62 lie 3 of these from the mean
    assert np.abs(figures / figures.mean() - 1).max() < 0.2


@pytest.mark.parametrize("shares", [(0.5, 0.3, 0.2), (0.4, 0.3, 0.2, 0.1)])
def test_unequal_shares_are_exact_and_every_union_is_free_of_low_frequencies(shares):
    fields = [swap_classes(shares, (128, 128), 2.0, seed) for seed in range(2)]
    for cells in fields:
        assert np.abs(np.bincount(cells.ravel()) - np.multiply(shares, cells.size)).max() <= 1
    n = len(shares)
    unions = [union for size in range(1, n) for union in combinations(range(n), size)]
    figures = np.array([low_power([np.isin(cells, union) for cells in fields]) for union in unions])
    assert figures.max() <= 0.02
    # measured: 0.0041 to 0.0056, and 0.0048 to 0.0132: a swap moves a whole cell, which is more to a rare class
    assert figures.max() < 3.5 * figures.min()


def test_flatness_trades_visible_grain_for_peaks():
    sharp, flat = (power([swap_classes((0.5, 0.5), (64, 64), sigma, s) for s in range(6)]) for sigma in (0.6, 2.5))
    f = frequencies(64)
    assert sharp[f > 0].max() > 3 * flat[f > 0].max()
    middle = (f > 0.2) & (f < 0.35)
    assert sharp[middle].mean() < 0.5 * flat[middle].mean()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 5))
def test_a_sweep_keeps_the_counts_lowers_the_energy_and_keeps_the_blurred_fields(seed, n):
    rng = np.random.default_rng(seed)
    cells = rng.integers(0, n, (20, 24)).astype(np.uint8)
    counts = np.bincount(cells.ravel(), minlength=n)
    kernel = gaussian_kernel(1.5, 3)
    classes = np.arange(n)[:, None, None]
    weights = rng.uniform(0.5, 2, n)

    def energy():
        indicators = (cells == classes).astype(float)
        return float((weights * (indicators * blur(indicators, kernel)).sum(axis=(1, 2))).sum())

    before, blurred = energy(), blur(cells == classes, kernel)
    order, far = rng.permutation(cells.size), rng.integers(0, cells.size, (cells.size, 3))
    swaps = sweep(cells, blurred, kernel, weights, order, far, 3)
    assert swaps > 0
    assert energy() < before
    assert np.array_equal(np.bincount(cells.ravel(), minlength=n), counts)
    # sums of up to 480 rounded numbers of order 10
    assert np.abs(blurred - blur(cells == classes, kernel)).max() < 1e-9


def test_the_change_of_one_swap_is_that_of_the_energy_summed_over_all_pairs_of_cells():
    rng = np.random.default_rng(0)
    cells = rng.integers(0, 3, (17, 17)).astype(np.uint8)
    kernel = gaussian_kernel(1.0)  # radius 4
    weights = np.array([1.0, 2.0, 0.7])

    def energy(cells):
        wrapped = (np.arange(17)[:, None] - np.arange(17) + 8) % 17 - 8
        line = np.where(np.abs(wrapped) <= 4, np.exp(-(wrapped**2) / 2.0), 0)
        return sum(
            weight * np.einsum("rc,rs,cd,sd", cells == k, line, line, cells == k, optimize=True)
            for k, weight in enumerate(weights)
        )

    r, c = 0, 16  # at the seam of the torus
    trials = []
    for dr in range(-2, 3):
        for dc in range(-2, 3):
            trial = cells.copy()
            to = (r + dr) % 17, (c + dc) % 17
            trial[r, c], trial[to] = cells[to], cells[r, c]
            trials.append(energy(trial))
    blurred = blur(cells == np.arange(3)[:, None, None], kernel)
    sweep(cells, blurred, kernel, weights, np.array([r * 17 + c]), np.zeros((1, 0), np.int64), 2)
    assert energy(cells) == pytest.approx(min(trials), abs=1e-9)  # rounding


def test_blur_is_the_sum_over_the_torus():
    rng = np.random.default_rng(1)
    field, kernel = rng.random((9, 11)), gaussian_kernel(0.8)
    radius = kernel.shape[0] // 2
    wanted = sum(
        kernel[radius + dr, radius + dc] * np.roll(field, (dr, dc), (0, 1))
        for dr in range(-radius, radius + 1)
        for dc in range(-radius, radius + 1)
    )
    assert np.abs(blur(field, kernel) - wanted).max() < 1e-12


def test_a_relaxed_start_has_its_largest_void_where_its_tightest_cluster_was():
    rng = np.random.default_rng(2)
    ones = np.zeros(32 * 32, np.uint8)
    ones[rng.choice(ones.size, 100, replace=False)] = 1
    ones = ones.reshape(32, 32)
    kernel = gaussian_kernel(1.5)
    blurred = blur(ones, kernel)
    assert relax(ones, blurred, kernel, 1024) < 1024
    assert ones.sum() == 100
    assert np.abs(blurred - blur(ones, kernel)).max() < 1e-9
    cluster = np.unravel_index(np.argmax(np.where(ones == 1, blurred, -np.inf)), ones.shape)
    ones[cluster] = 0
    without = np.where(ones == 0, blur(ones, kernel), np.inf)
    assert without[cluster] == pytest.approx(without.min(), abs=1e-9)


def test_filling_takes_the_least_crowded_zero_of_the_whole_torus_every_time():
    kernel = gaussian_kernel(1.5)
    ones = np.zeros((16, 20), np.uint8)
    ones[15, 19] = ones[3, 2] = ones[9, 11] = 1
    blurred = blur(ones, kernel)
    for _ in range(60):
        crowd = np.where(ones == 0, blur(ones, kernel), np.inf)
        before = ones.copy()
        fill_voids(ones, blurred, kernel, 1)
        (filled,) = np.argwhere(ones != before)
        assert crowd[tuple(filled)] == pytest.approx(crowd.min(), abs=1e-9)


@pytest.mark.parametrize("share", [0.0, 3 / 255, 0.1, 0.3, 0.5, 0.8, 1.0])
def test_zhou_fang_coefficients_spread_all_of_the_error_and_are_mirrored_about_half(share):
    *parts, modulation = zhou_fang_coefficients(share)
    assert sum(parts) == pytest.approx(1, abs=1e-12)
    assert min(parts) >= 0
    assert 0 <= modulation <= 1
    assert zhou_fang_coefficients(1 - share) == pytest.approx((*parts, modulation), abs=1e-12)


def test_zhou_fang_interpolates_as_the_authors_program_does():
    # levels between the keys, as their table of all levels has them
    for level, parts, percent in (
        (13, (0.521102, 0.250720, 0.228178), 9),
        (36, (0.467212, 0.273534, 0.259255), 27),
        (50, (0.410459, 0.424631, 0.164909), 38),
        (80, (0.387644, 0.450085, 0.162272), 100),
        (98, (0.345525, 0.365396, 0.289080), 31),
        (120, (0.343785, 0.369475, 0.286741), 90),
        (126, (0.351421, 0.361923, 0.286657), 98),
    ):
        *ours, modulation = zhou_fang_coefficients(level / 255)
        assert ours == pytest.approx(parts, abs=5e-6)  # their level 80 is cut to five digits
        assert int(100 * modulation) == pytest.approx(percent, abs=1)  # they cut percents off


def test_a_zhou_fang_sheet_covers_the_pattern_with_its_seam_outside():
    pattern = make_pattern("blue-noise", BW, 1.0, 25, (40, 30), 9, blue_noise="zhou-fang")
    rows, columns = pattern.cells.shape
    a = np.deg2rad(25)
    x, y = np.meshgrid([-20, 20], [-15, 15])
    assert np.abs(np.cos(a) * x + np.sin(a) * y).max() < columns / 2
    assert np.abs(np.cos(a) * y - np.sin(a) * x).max() < rows / 2
    sheet = zhou_fang_sheet(0.5, (rows, columns), 9)
    assert pattern.cells[0, 0] == sheet[rows // 2, columns // 2]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"blue_noise": "white"}, "blue_noise must be one of swap, zhou-fang, void-and-cluster, got 'white'"),
        ({"flatness": 9.0}, "flatness must be 0.5 to 4 cells, got 9"),
        ({"flatness": float("nan")}, "flatness must be 0.5 to 4"),
        ({"colorants": SIX, "blue_noise": "zhou-fang"}, 'exactly 2 colorants, got 6: blue_noise = "swap"'),
        ({"colorants": SIX, "blue_noise": "void-and-cluster"}, 'exactly 2 colorants, got 6: blue_noise = "swap"'),
        ({"shares": (0.5, 0.4)}, "must sum to 1, got 0.9; in this proportion: 0.555556, 0.444444"),
        ({"shares": (1.5, -0.5)}, "shares must be > 0"),
        ({"shares": (1.0,)}, "one for each of its 2 colorants, got 1"),
    ],
)
def test_what_no_blue_noise_can_be_is_named(change, text):
    description = {"layout": "blue-noise", "colorants": BW, "dot_size_mm": 1, "angle_deg": 0, "size_mm": (50, 50)}
    with pytest.raises(InputError, match=text):
        make_pattern(**(description | change))


@given(st.lists(st.floats(0.01, 1), min_size=2, max_size=8), st.integers(1, 10_000))
def test_apportioned_cells_sum_to_the_total_and_lie_within_one_cell(parts, total):
    shares = np.array(parts) / sum(parts)
    counts = apportion(tuple(shares), total)
    assert counts.sum() == total
    assert np.abs(counts - shares * total).max() < 1 + 1e-6  # rounding of the product
