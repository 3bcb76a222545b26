import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter, minimum_filter

from paxel_design.patterns import colorants_of, make_pattern
from paxel_design.printing.blocks import (
    Block,
    CellRaster,
    block_indices,
    blocks_of,
    palette_of,
    paper_index_of,
    plan_cell_raster,
    printed_shares,
)
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

RGB = ("red", "green", "blue")


def random_cells(rows, columns, colorants=3, seed=0):
    return np.random.default_rng(seed).integers(0, colorants, (rows, columns), dtype=np.uint8)


@settings(max_examples=40, deadline=None)
@given(
    torus=st.tuples(st.integers(1, 200), st.integers(1, 200)),
    angle_deg=st.floats(-180, 180),
    size_mm=st.tuples(st.floats(1, 150), st.floats(1, 150)),
)
def test_blocks_cover_every_cell_of_the_area_once_with_its_own_colorant(torus, angle_deg, size_mm):
    pattern = Pattern("any", RGB, random_cells(*torus), 1.0, angle_deg, size_mm)
    reach = 250  # cells from the centre: half of 150 * sqrt(2), and a block of up to 128
    count = np.zeros((2 * reach, 2 * reach), int)
    value = np.zeros((2 * reach, 2 * reach), np.uint8)
    one_subpixel = CellRaster(1, 0, 1000.0)
    images = {}
    for block in blocks_of(pattern, one_subpixel):
        where = np.s_[
            reach + block.row : reach + block.row + block.rows,
            reach + block.column : reach + block.column + block.columns,
        ]
        count[where] += 1
        value[where] = block_indices(pattern, block, one_subpixel, 0)
        assert np.array_equal(images.setdefault(block.image_key, value[where].copy()), value[where])
    at = np.arange(-reach, reach) + 0.5
    u, v = np.meshgrid(at, at)
    a = np.deg2rad(angle_deg)
    labels = pattern.label(np.cos(a) * u - np.sin(a) * v, np.sin(a) * u + np.cos(a) * v)
    inside = labels != 255
    assert np.all(count[inside] == 1)
    assert np.array_equal(value[inside], labels[inside])
    assert count.max() == 1


def test_a_periodic_pattern_needs_one_image_whatever_its_size():
    pattern = make_pattern("checkerboard", ("black", "white"), 0.5, 30, (3000, 2000))
    assert len({block.image_key for block in blocks_of(pattern, plan_cell_raster(0.5, 0))}) == 1


@pytest.mark.parametrize(("subpixels", "shrink"), [(12, 1), (13, 6), (16, 3)])
def test_shrinking_is_an_erosion_of_every_colorant(subpixels, shrink):
    pattern = Pattern("any", RGB, random_cells(5, 7), 1.0, 0.0, (10, 10))
    paper = 3
    indices = block_indices(pattern, Block(-2, 3, 8, 9, (0, 0)), CellRaster(subpixels, shrink, 1.0), paper)
    rows, columns = np.arange(-3, 7) % 5, np.arange(2, 13) % 7
    plain = pattern.cells[np.ix_(rows, columns)].repeat(subpixels, 0).repeat(subpixels, 1)
    window = 2 * shrink + 1
    plain[minimum_filter(plain, window) != maximum_filter(plain, window)] = paper
    assert np.array_equal(indices, plain[subpixels:-subpixels, subpixels:-subpixels])


@given(dot_size_mm=st.floats(0.1, 50), share=st.floats(0, 0.499))
def test_the_compensation_is_realised_within_one_micrometre(dot_size_mm, share):
    asked_um = share * 1000 * dot_size_mm
    raster = plan_cell_raster(dot_size_mm, asked_um)
    assert abs(raster.ink_spread_um - asked_um) <= 1.0 + 1e-9
    assert raster.subpixels >= 12
    assert 2 * raster.shrink < raster.subpixels
    assert raster.subpixels * raster.subpixel_um == pytest.approx(1000 * dot_size_mm)


@pytest.mark.parametrize("ink_spread_um", [-1.0, 375.0, float("nan")])
def test_a_compensation_that_leaves_no_dot_is_an_error(ink_spread_um):
    with pytest.raises(InputError, match="below half a dot"):
        plan_cell_raster(0.75, ink_spread_um)


def test_paper_joins_the_palette_only_where_shrinking_needs_it():
    shrunk, plain = plan_cell_raster(0.75, 20), plan_cell_raster(0.75, 0)
    inks = colorants_of(RGB)
    assert palette_of(inks, shrunk) == (*inks, None)
    assert palette_of(inks, plain) == inks
    black, white = colorants_of(("black", "white"))
    assert palette_of((black, white), shrunk) == (black, None)
    assert paper_index_of(palette_of((white, black), shrunk)) == 0
    assert paper_index_of(palette_of(inks, shrunk)) == 3


@settings(deadline=None)
@given(
    torus=st.tuples(st.integers(1, 7), st.integers(1, 7)),
    subpixels=st.integers(3, 9),
    share=st.floats(0, 0.49),
    seed=st.integers(0, 99),
    names=st.sampled_from((RGB, ("red", "white", "blue"))),
)
def test_printed_shares_are_a_count_of_the_sub_pixels(torus, subpixels, share, seed, names):
    pattern = Pattern("any", names, random_cells(*torus, seed=seed), 1.0, 0.0, (10, 10))
    raster = CellRaster(subpixels, int(share * subpixels), 1.0)
    palette = palette_of(colorants_of(names), raster)
    indices = block_indices(pattern, Block(0, 0, *torus, (0, 0)), raster, paper_index_of(palette))
    counted = np.bincount(indices.ravel(), minlength=len(palette)) / indices.size
    assert printed_shares(pattern, raster, palette) == pytest.approx(counted, abs=1e-12)
