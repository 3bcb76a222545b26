"""Splines over the frame and the tone curves made of them: against sums written out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping.spline_grid import SplineGrid, spline_grid, spline_weights
from paxel_runtime.gamut_mapping.tone_curves import ToneCurves, linear_curves

GRIDS = [SplineGrid(30, 50, (3, 5), 4), SplineGrid(50, 30, (5, 2), 4), SplineGrid(7, 9, (1, 1), 1)]


def _curves(grid: SplineGrid, seed: int = 0) -> ToneCurves:
    rng = np.random.default_rng(seed)
    return ToneCurves(grid, np.cumsum(rng.uniform(0, 5, grid.shape), axis=2), (20.0, 80.0))


@given(share=st.floats(0, 1), cells=st.integers(1, 30))
def test_weights_sum_to_one_and_reproduce_straight_lines(share: float, cells: int) -> None:
    first, weights = spline_weights(np.array([share]), cells)
    assert 0 <= first[0] <= cells - 1
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(), 1, atol=1e-14)  # rounding of three numbers
    line = (np.arange(cells + 2) - 0.5) / cells
    np.testing.assert_allclose(weights[0] @ line[first[0] : first[0] + 3], share, atol=1e-13)


def test_nodes_are_about_two_fifths_of_a_degree_apart_and_not_too_many() -> None:
    assert spline_grid(1080, 1920, 477.0).cells == (6, 10)
    assert max(spline_grid(2160, 3840, 20.0).cells) == 40
    assert spline_grid(10, 10, 1e4).cells == (1, 1)


@pytest.mark.parametrize("grid", GRIDS)
def test_the_order_of_unknowns(grid: SplineGrid) -> None:
    control = np.random.default_rng(0).normal(size=grid.shape)
    np.testing.assert_array_equal(grid.unraveled(grid.raveled(control)), control)
    for axis in range(3):
        differences = grid.differences(axis) @ grid.raveled(control)
        assert np.sum(differences**2) == pytest.approx(np.sum(np.diff(control, axis=axis) ** 2))  # order apart
    np.testing.assert_allclose(
        np.sort(grid.differences(2, order=2) @ grid.raveled(control)), np.sort(np.diff(control, 2, axis=2).ravel())
    )


@pytest.mark.parametrize("grid", GRIDS)
def test_curves_against_sums_written_out(grid: SplineGrid) -> None:
    curves = _curves(grid)
    L = np.random.default_rng(1).uniform(0, 100, (grid.height, grid.width)).astype(np.float32)
    mapped = curves.apply(L)
    rows, columns = np.array([0, grid.height // 2, grid.height - 1]), np.array([0, grid.width - 1, grid.width // 3])
    sampled = curves.sampled(rows, columns, L[rows, columns]) @ grid.raveled(curves.control)
    np.testing.assert_allclose(mapped[rows, columns], sampled, rtol=1e-6)  # float32
    for n, (row, column) in enumerate(zip(rows, columns, strict=True)):
        axes = ((row + 0.5) / grid.height, (column + 0.5) / grid.width, np.clip((L[row, column] - 20) / 60, 0, 1))
        total = 0.0
        (i, u), (j, v), (k, w) = (
            (f[0], g[0])
            for f, g in (spline_weights(np.array([s]), c) for s, c in zip(axes, (*grid.cells, grid.bins), strict=True))
        )
        for a in range(3):
            for b in range(3):
                for c in range(3):
                    total += u[a] * v[b] * w[c] * curves.control[i + a, j + b, k + c]
        assert sampled[n] == pytest.approx(total, rel=1e-6)  # L is float32


@pytest.mark.parametrize("grid", GRIDS)
def test_linear_curves_are_static_mapping(grid: SplineGrid) -> None:
    L = np.linspace(0, 100, grid.height * grid.width, dtype=np.float32).reshape(grid.height, grid.width)
    mapped = linear_curves(grid, (20, 80), (30, 50)).apply(L)
    np.testing.assert_allclose(mapped, 30 + 20 * np.clip((L - 20) / 60, 0, 1), atol=1e-5)  # float32 of L*


def test_rising_control_values_make_rising_curves() -> None:
    grid = GRIDS[0]
    ramp = np.broadcast_to(np.linspace(0, 100, grid.width, dtype=np.float32), (grid.height, grid.width))
    assert np.diff(linear_curves(grid, (20, 80), (30, 50)).apply(ramp), axis=1).min() >= 0
    curves = _curves(grid)
    place = (np.full(200, 11), np.full(200, 17))
    values = curves.sampled(*place, np.linspace(20, 80, 200)) @ grid.raveled(curves.control)
    assert np.diff(values).min() > 0


def test_what_does_not_fit() -> None:
    grid = GRIDS[0]
    with pytest.raises(InputError, match="control values"):
        ToneCurves(grid, np.zeros((2, 2, 2)), (0, 100))
    with pytest.raises(InputError, match="30 x 50"):
        _curves(grid).apply(np.zeros((31, 50), np.float32))
