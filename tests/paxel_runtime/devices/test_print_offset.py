"""A print that hangs elsewhere than it was calibrated: its period brings it back, half of it swaps the inks."""

from dataclasses import replace

import numpy as np
import pytest

from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

DOT_MM = 0.75
ANGLE = np.deg2rad(30)
ALONG_CELLS = np.array([np.cos(ANGLE), np.sin(ANGLE)])
CHECKER = Pattern("checkerboard", ("black", "white"), np.eye(2, dtype=np.uint8), DOT_MM, 30.0, (600.0, 400.0))
SETUP = BenchSetup(
    pattern=CHECKER,
    resolution=(96, 64),
    width_mm=14.06,
    channels=("red", "green", "blue"),
    bits=8,
    camera_resolution=(320, 240),
    camera_bits=16,
    aperture_mm=6.0,
    quality="ideal",
    seed=5,
)


def _black(dots: float) -> np.ndarray:
    """Share of black ink in each pixel with the print moved by so many dots along its rows of cells."""
    setup = replace(SETUP, print_offset_mm=tuple(dots * DOT_MM * ALONG_CELLS))
    return VirtualBench(setup).truth.coverage()[..., 0]


def test_a_period_of_the_pattern_brings_it_back_and_half_of_it_swaps_the_inks() -> None:
    in_place = _black(0)
    # Coverage is kept as a byte for each of the 16 or more samples of a pixel.
    np.testing.assert_allclose(_black(2), in_place, atol=0.01)
    np.testing.assert_allclose(_black(-1), 1 - in_place, atol=0.01)
    assert np.abs(_black(0.3) - in_place).max() > 0.3


def test_only_the_print_moves_and_not_far() -> None:
    white = np.full((64, 96, 3), 200, np.uint8)
    moved = VirtualBench(replace(SETUP, print_offset_mm=(0.4, 0.0)))
    assert np.array_equal(moved.view_XYZ(white, "white"), VirtualBench(SETUP).view_XYZ(white, "white"))
    with pytest.raises(InputError, match="print_offset_mm must be two lengths of at most 10 mm"):
        replace(SETUP, print_offset_mm=(0.0, 11.0))
