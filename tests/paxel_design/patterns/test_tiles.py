from itertools import permutations

import numpy as np
import pytest

from paxel_design.patterns import colorants_of, make_pattern
from paxel_design.patterns.tiles import MOST_CELLS, SHARE_TOLERANCE, tile_counts, tile_of
from paxel_design.patterns.visibility import row_visibility
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab, spectra_to_XYZ

RGB = ("red", "green", "blue")
CMYRGB = ("cyan", "magenta", "yellow", "red", "green", "blue")
RGBCMYK = (*RGB, "cyan", "magenta", "yellow", "black")
SHEET = (0.75, 30.0, (600.0, 400.0))


def visibility_of(pattern):
    """Of a tile's own first row and shift."""
    row = pattern.cells[0]
    above = pattern.cells[1 % pattern.cells.shape[0]]
    shift = next(s for s in range(row.size) if np.array_equal(above, np.roll(row, -s)))
    return row_visibility(colorants_to_XYZ(colorants_of(pattern.colorants))[row], shift)


@pytest.mark.parametrize("colorants", [("black", "white"), RGB, CMYRGB, RGBCMYK])
def test_a_tile_of_equal_shares_has_each_colorant_once_a_row_and_rows_are_shifted(colorants):
    pattern = make_pattern("tiles", colorants, *SHEET)
    cells = pattern.cells
    assert np.array_equal(pattern.shares(), np.full(len(colorants), 1 / len(colorants)))
    assert np.array_equal(np.sort(cells, axis=1), np.tile(np.arange(len(colorants)), (cells.shape[0], 1)))
    shift = next(s for s in range(cells.shape[1]) if np.array_equal(cells[1], np.roll(cells[0], -s)))
    for r in range(cells.shape[0]):  # over the seam of the torus too
        assert np.array_equal(cells[(r + 1) % cells.shape[0]], np.roll(cells[r], -shift))


def test_the_least_visible_tile_of_black_and_white_is_the_checkerboard():
    assert np.array_equal(make_pattern("tiles", ("black", "white"), *SHEET).cells, [[0, 1], [1, 0]])


def test_no_order_and_no_shift_of_cmyrgb_is_less_visible_than_the_one_found():
    found = visibility_of(make_pattern("tiles", CMYRGB, *SHEET))
    orders = np.array([(0, *rest) for rest in permutations(range(1, 6))])
    rows_XYZ = colorants_to_XYZ(colorants_of(CMYRGB))[orders]
    every = np.array([row_visibility(rows_XYZ, shift) for shift in range(6)])
    assert found == pytest.approx(every.min(), abs=1e-9)  # rounding
    assert every.max() > 10 * found  # and it matters


def test_visibility_is_the_blurred_difference_from_the_mean_summed_over_the_plane():
    """Against a picture of the tile, blurred with the three Gaussians in space."""
    order, shift = np.array([0, 3, 1, 4, 2]), 2
    XYZ = colorants_to_XYZ(colorants_of(CMYRGB))[order]
    cells = np.tile(tile_of(np.arange(5), shift), (4, 4))
    to_opponent = np.array([[0.279, 0.72, -0.107], [-0.449, 0.29, -0.077], [0.086, -0.59, 0.501]])
    picture = XYZ[cells] @ to_opponent.T
    spectrum = np.fft.fft2(picture, axes=(0, 1))
    f = np.fft.fftfreq(20)
    fy, fx = np.meshgrid(f, f, indexing="ij")
    eyes = [
        ((0.921, 0.0283), (0.105, 0.133), (-0.108, 4.336)),
        ((0.531, 0.0392), (0.330, 0.494)),
        ((0.488, 0.0536), (0.371, 0.386)),
    ]
    for channel, eye in enumerate(eyes):
        transfer = sum(w * np.exp(-((np.pi * spread * 60) ** 2) * (fx**2 + fy**2)) for w, spread in eye)
        spectrum[..., channel] *= transfer / sum(w for w, _ in eye) * np.sinc(fx) * np.sinc(fy)
    blurred_XYZ = np.fft.ifft2(spectrum, axes=(0, 1)).real @ np.linalg.inv(to_opponent).T
    mean_XYZ = XYZ.mean(axis=0)
    small = 1e-4  # in the limit of small differences CIELAB is linear: half a step of curvature, 1e-4 of it
    Lab = XYZ_to_Lab(mean_XYZ + small * (blurred_XYZ - mean_XYZ), np.array([0.95047, 1.0, 1.08883]))
    Lab_mean = XYZ_to_Lab(mean_XYZ, np.array([0.95047, 1.0, 1.08883]))
    wanted = np.sqrt(((Lab - Lab_mean) ** 2).sum(axis=-1).mean()) / small
    assert row_visibility(XYZ, shift) == pytest.approx(wanted, rel=2e-3)  # that, and D65 to five digits


@pytest.mark.parametrize(
    ("shares", "counts"),
    [
        ((0.5, 0.25, 0.25), [2, 1, 1]),
        ((0.4, 0.35, 0.25), [8, 7, 5]),
        ((1 / 3, 1 / 3, 1 / 3), [1, 1, 1]),
        ((0.9, 0.1), [9, 1]),
        ((0.332, 0.333, 0.335), [1, 1, 1]),
    ],
)
def test_a_row_is_the_shortest_that_meets_the_shares(shares, counts):
    assert tile_counts(shares).tolist() == counts
    pattern = make_pattern("tiles", RGB[: len(shares)], *SHEET, shares=shares)
    assert pattern.shares() == pytest.approx(shares, abs=SHARE_TOLERANCE)


def test_shares_that_no_short_row_meets_are_met_as_well_as_a_row_can_and_stated():
    shares = (0.613, 0.387)
    realised = make_pattern("tiles", ("black", "white"), *SHEET, shares=shares).shares()
    assert realised[0] == pytest.approx(0.613, abs=0.5 / MOST_CELLS)


def test_stripes_are_columns_in_the_least_visible_order_with_its_shares():
    pattern = make_pattern("stripes", CMYRGB, *SHEET)
    assert pattern.cells.shape == (1, 6)
    orders = np.array([(0, *rest) for rest in permutations(range(1, 6))])
    every = row_visibility(colorants_to_XYZ(colorants_of(CMYRGB))[orders], 0)
    assert visibility_of(pattern) == pytest.approx(every.min(), abs=1e-9)
    assert make_pattern("stripes", ("black", "white"), *SHEET, shares=(0.25, 0.75)).shares().tolist() == [0.25, 0.75]


def test_a_given_order_is_taken_and_gives_the_shares():
    pattern = make_pattern("stripes", ("black", "white", "red"), *SHEET, tile_order=["black", "white", "white", "red"])
    assert pattern.cells.tolist() == [[0, 1, 1, 2]]
    tile = make_pattern("tiles", RGB, *SHEET, tile_order=("blue", "green", "red"))
    assert tile.cells[0].tolist() == [2, 1, 0]
    assert tile.cells.shape == (3, 3)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"tile_order": "best"}, "tile_order must be \"search\" or a list of colorants, got 'best'"),
        ({"tile_order": ["red", "green"]}, "must name each of its colorants \\(red, green, blue\\)"),
        ({"tile_order": [*RGB, "gold"]}, "and no other, got red, green, blue, gold"),
        ({"tile_order": [*RGB, "red"], "shares": (0.2, 0.4, 0.4)}, "must have its shares .*got \\[0.5, 0.25, 0.25\\]"),
        ({"shares": (0.98, 0.01, 0.01)}, "leave each colorant a cell in a row of 24"),
        ({"layout": "checkerboard", "colorants": RGB[:2], "shares": (0.3, 0.7)}, "checkerboard's shares must be 0.5"),
        ({"size_mm": (float("inf"), 1)}, "must be finite"),
    ],
)
def test_what_no_tile_can_be_is_named(change, text):
    description = {"layout": "tiles", "colorants": RGB, "dot_size_mm": 1, "angle_deg": 0, "size_mm": (50, 50)}
    with pytest.raises(InputError, match=text):
        make_pattern(**(description | change))


def test_fluorescent_inks_that_look_like_paper_are_told_apart_by_their_light():
    inks = colorants_of(("uv-red", "uv-green", "uv-blue", "white"))
    XYZ = colorants_to_XYZ(inks)
    assert XYZ[:, 1].max() == pytest.approx(1.0)
    assert XYZ[3].tolist() == [0.0, 0.0, 0.0]  # paper emits nothing
    for ink, row in zip(inks[:3], XYZ[:3], strict=True):
        wanted = spectra_to_XYZ(ink.fluorescence.emission)
        assert row / row.sum() == pytest.approx(wanted / wanted.sum(), abs=1e-12)
    # beside an ink that absorbs, daylight tells them apart, and they look like paper
    beside_black = colorants_to_XYZ(colorants_of(("uv-red", "black", "white")))
    assert np.array_equal(beside_black[0], beside_black[2])
    tile = make_pattern("tiles", ("uv-red", "uv-green", "uv-blue"), *SHEET)
    every = [row_visibility(XYZ[[0, *rest]], s) for rest in ((1, 2), (2, 1)) for s in range(3)]
    assert row_visibility(XYZ[tile.cells[0]], 1) == pytest.approx(min(every), abs=1e-9)
