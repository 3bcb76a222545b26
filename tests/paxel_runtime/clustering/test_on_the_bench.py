"""Clusters on the virtual bench, against its true coverages: the figures of the paper's section IV-B and ours.

Nodal images come from the bench's own geometry, so that registration has no part in the errors.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.patterns import make_pattern
from paxel_runtime.clustering import cluster, suggest_count
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.registration import warp_to_nodal

RGB = ("red", "green", "blue")
CMYRGB = ("cyan", "magenta", "yellow", "red", "green", "blue")
SIZE, CAMERA, PITCH_MM = (320, 180), (684, 512), 140.6 / 960  # the demonstration's pitches


@cache
def _scene(quality: str, colorants: tuple[str, ...]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Nodal XYZ and the true coverage of every projector pixel, a border left out."""
    layout = "checkerboard" if len(colorants) == 2 else "tiles"
    pattern = make_pattern(layout, colorants, 0.75, 30.0, (70.0, 50.0))
    bench = VirtualBench(
        BenchSetup(
            pattern=pattern, resolution=SIZE, width_mm=SIZE[0] * PITCH_MM, channels=RGB, bits=8,
            camera_resolution=CAMERA, camera_bits=14, aperture_mm=15.0, quality=quality, seed=0,
        )
    )  # fmt: skip
    nodal = np.empty((SIZE[1], SIZE[0], 3), np.float32)
    for j, channel in enumerate(RGB):
        light = {}
        for surface in ("pattern", "white"):
            bench.place(surface)
            codes = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
            bench.show(codes)
            dark = bench.capture(channel).astype(np.float32)
            codes[..., j] = 255
            bench.show(codes)
            picture = bench.capture(channel) - dark
            light[surface] = warp_to_nodal(picture, bench.truth.camera_xy(channel).astype(np.float32))
        nodal[..., j] = light["pattern"] / light["white"]
    inner = (slice(12, -12), slice(12, -12))
    return linear_sRGB_to_XYZ(nodal[inner]).astype(np.float32), bench.truth.coverage()[inner][..., :-1]


def _expected(names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
    library = colorant_library()
    white_Y = spectra_to_XYZ(library["white"].reflectance)[1]
    return {name: spectra_to_XYZ(library[name].reflectance) / white_Y * D65_XYZ for name in names}


# The issue asks 0.94 and 0.92; plain k-means gives 0.93. What is missing to 1 is blur, which moves edges by a
# fraction of a pixel, and ink spread that the camera sees and the projector's pixel does not.
@pytest.mark.parametrize(("quality", "least"), [("ideal", 0.98), ("realistic", 0.98), ("harsh", 0.96)])
def test_labels_are_coverage_above_one_half(quality: str, least: float) -> None:
    nodal_XYZ, coverage = _scene(quality, ("black", "white"))
    valid = np.ones(coverage.shape[:2], bool)
    result = cluster(nodal_XYZ, valid, _expected(("black", "white")), 2, D65_XYZ)
    wrong = (result.labels == 1) != (coverage[..., 1] > 0.5)
    assert 1 - wrong.mean() >= least
    assert not wrong[(coverage[..., 1] < 0.1) | (coverage[..., 1] > 0.9)].any()
    paper = cluster(nodal_XYZ, valid, _expected(("black", "white")), 2, D65_XYZ, boundary="nearest")
    assert wrong.mean() < ((paper.labels == 1) != (coverage[..., 1] > 0.5)).mean()
    assert suggest_count(result, ("black", "white"))[0] == 3


def test_six_colorants_have_few_errors_on_pure_pixels() -> None:
    nodal_XYZ, coverage = _scene("realistic", CMYRGB)
    result = cluster(nodal_XYZ, np.ones(coverage.shape[:2], bool), _expected(CMYRGB), 6, D65_XYZ)
    wrong = result.labels != coverage.argmax(axis=-1)
    assert wrong[coverage.max(axis=-1) > 0.9].mean() <= 0.01  # the figure; k-means alone 0.016 to 0.03
    true = np.array([coverage[result.labels == k].mean(axis=0) for k in range(6)])
    # The camera sees purity through its own blur and between centres that are themselves mixed.
    np.testing.assert_allclose(result.purity, true, atol=0.05)
    assert suggest_count(result, CMYRGB)[0] == 6
