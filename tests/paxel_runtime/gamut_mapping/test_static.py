"""Gamut mapping: against a slow exact reference, and for what it promises of every pixel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.gamut_mapping import CHROMA_KNEES, MappingOptions, map_to_subgamut, moved_picture
from paxel_runtime.model.colorimetry import (
    D65_XYZ,
    Lab_to_LCh,
    Lab_to_XYZ,
    LCh_to_Lab,
    XYZ_to_Lab,
    linear_sRGB_to_XYZ,
)
from paxel_runtime.model.subgamut import LabField, SubGamut

WHITE = np.array([0.96, 1.0, 1.05])


def _sub_gamut(points_XYZ: NDArray[np.float64]) -> SubGamut:
    equations = np.unique(ConvexHull(points_XYZ).equations.round(12), axis=0)
    scale = np.linalg.norm(equations[:, :3], axis=1)
    return SubGamut("full", "pattern", equations[:, :3] / scale[:, None], -equations[:, 3] / scale, WHITE)


def _zonotope() -> SubGamut:
    """What a projector with primaries of sRGB and a second, duller triple can show: a body like those of a model."""
    primaries = linear_sRGB_to_XYZ(np.eye(3)) / D65_XYZ * WHITE
    edges = np.concatenate([0.3 * primaries, 0.1 * (primaries + primaries.mean(axis=0))])
    corners = np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T
    return _sub_gamut(corners @ edges + 0.01 * WHITE)


SUB_GAMUT = _zonotope()


def _picture(seed: int, shape: tuple[int, int] = (30, 40)) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    Lab = np.stack([rng.uniform(0, 100, shape), rng.normal(0, 40, shape), rng.normal(0, 40, shape)], axis=-1)
    Lab[rng.random(shape) < 0.1, 1:] = 0.0
    return Lab.astype(np.float32)


def _reference(Lab: NDArray[np.float32], sub_gamut: SubGamut, knee: float) -> NDArray[np.float64]:
    """The mapping pixel by pixel: chroma of the boundary by 40 halvings with `SubGamut.slack`, all in float64."""
    source = Lab_to_LCh(Lab.astype(np.float64).reshape(-1, 3))
    low, high = np.percentile(source[:, 0], [0.5, 99.5])
    L_low, L_high = sub_gamut.gray_range()
    L = L_low + (L_high - L_low) * np.clip((source[:, 0] - low) / (high - low), 0, 1)
    inner, outer = np.zeros(len(L)), np.full(len(L), 256.0)
    for _ in range(40):
        middle = (inner + outer) / 2
        colors = LCh_to_Lab(np.stack([L, middle, source[:, 2]], axis=-1))
        inside = sub_gamut.slack(Lab_to_XYZ(colors, WHITE)) >= 0
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    bend = knee * inner
    room, excess = inner - bend, np.maximum(source[:, 1] - bend, 0)
    with np.errstate(invalid="ignore"):
        chroma = np.where(excess > 0, bend + np.nan_to_num(room * excess / (room + excess)), source[:, 1])
    return LCh_to_Lab(np.stack([L, chroma, source[:, 2]], axis=-1)).reshape(Lab.shape)


@pytest.mark.parametrize("chroma", ["soft", "clip"])
def test_against_the_slow_reference(chroma: str) -> None:
    Lab = _picture(0, (60, 80))
    mapped = map_to_subgamut(Lab, SUB_GAMUT, MappingOptions(chroma=chroma)).Lab
    difference = np.linalg.norm(mapped - _reference(Lab, SUB_GAMUT, CHROMA_KNEES[chroma]), axis=-1)
    # The table is bilinear over half a degree of hue and 0.5 L*: it rounds edges of the polytope by up to 0.1 where
    # chroma reaches 70, and more only beside the sharp ends of the gray axis and the primaries' own corners.
    assert np.mean(difference) < 0.02
    assert np.quantile(difference, 0.99) < 0.25
    assert np.max(difference) < 2.0


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), chroma=st.sampled_from(["soft", "clip"]))
def test_every_pixel_is_inside_in_its_own_hue_and_never_gains_chroma(seed: int, chroma: str) -> None:
    rng = np.random.default_rng(seed)
    points = np.concatenate([rng.uniform(0.05, 0.6, (12, 3)) * WHITE, [0.1 * WHITE, 0.5 * WHITE]])
    sub_gamut, Lab = _sub_gamut(points), _picture(seed)
    result = map_to_subgamut(Lab, sub_gamut, MappingOptions(chroma=chroma))
    assert sub_gamut.slack(Lab_to_XYZ(result.Lab.astype(np.float64), WHITE)).min() >= -1e-6  # float32 Lab in XYZ
    before, after = Lab_to_LCh(Lab.astype(np.float64)), Lab_to_LCh(result.Lab.astype(np.float64))
    turned = (after[..., 2] - before[..., 2] + 180) % 360 - 180
    assert np.all(np.abs(turned)[after[..., 1] > 0.1] < 1e-3)  # float32 of (a, b) at chroma 0.1
    assert np.all(after[..., 1] <= before[..., 1] + 1e-4)


def test_lightness_is_linear_on_the_gray_axis() -> None:
    L = np.linspace(0, 100, 201, dtype=np.float32)
    Lab = np.stack([L, 0 * L, 0 * L], axis=-1)[None]
    result = map_to_subgamut(Lab, SUB_GAMUT, lightness=(20, 80))
    low, high = SUB_GAMUT.gray_range()
    np.testing.assert_allclose(
        result.Lab[0, :, 0], low + (high - low) * np.clip((L - 20) / 60, 0, 1), atol=1e-5  # float32 of L* up to 100
    )  # fmt: skip
    assert not result.Lab[..., 1:].any()
    assert result.figures["L_from"] == [20, 80]
    assert result.figures["pixels_moved"] == 0
    assert map_to_subgamut(Lab, SUB_GAMUT).figures["L_from"] == pytest.approx([0.5, 99.5])


@pytest.mark.parametrize("chroma", ["soft", "clip"])
def test_monotone_in_chroma(chroma: str) -> None:
    C, hue_deg = np.meshgrid(np.linspace(0, 140, 400), np.arange(0, 360, 7.3))
    Lab = LCh_to_Lab(np.stack([np.full_like(C, 50), C, hue_deg], axis=-1)).astype(np.float32)
    mapped = map_to_subgamut(Lab, SUB_GAMUT, MappingOptions(chroma=chroma), lightness=(0, 100)).Lab
    steps = np.diff(np.hypot(mapped[..., 1], mapped[..., 2]), axis=1)
    assert steps.min() > -2e-3  # where the table overshoots by some thousandths a colour is moved onto the boundary


def test_clipping_leaves_alone_what_is_inside() -> None:
    rng = np.random.default_rng(1)
    low, high = SUB_GAMUT.gray_range()
    XYZ = rng.uniform(0.02, 0.5, (400, 3)) * WHITE
    Lab = XYZ_to_Lab(XYZ[SUB_GAMUT.contains(XYZ)], WHITE)[None].astype(np.float32)
    Lab = Lab[:, (Lab[0, :, 0] > low) & (Lab[0, :, 0] < high)]
    assert Lab.shape[1] > 50
    result = map_to_subgamut(Lab, SUB_GAMUT, MappingOptions(chroma="clip"), lightness=(low, high))
    moved = np.linalg.norm(result.Lab - Lab, axis=-1)
    assert np.quantile(moved, 0.95) < 1e-4  # float32 of L* on its way through the line
    assert moved.max() < 0.5  # right at a ridge of the polytope, which the table cuts off
    assert result.figures["pixels_in_gamut_before"] > 0.95
    assert result.figures["chroma_kept"] == pytest.approx(1, abs=1e-3)


def test_the_soft_knee_keeps_half_and_never_reaches_the_boundary() -> None:
    hue_deg, L = 40.0, 50.0
    limit = float(np.hypot(*_reference(_row(L, 200.0, hue_deg), SUB_GAMUT, 1.0)[0, 0, 1:]))
    soft = map_to_subgamut(_row(L, [0.4 * limit, 2 * limit], hue_deg), SUB_GAMUT, lightness=(0, 100)).Lab
    assert np.hypot(*soft[0, 0, 1:]) == pytest.approx(0.4 * limit, abs=1e-4)  # float32
    # Twice the boundary is 3 knee widths beyond the knee: 0.5 + 0.5 * 3 / 4 of it; 1 % for the table.
    assert np.hypot(*soft[0, 1, 1:]) == pytest.approx(0.875 * limit, rel=0.01)


def _row(L: float, chroma: float | list[float], hue_deg: float) -> NDArray[np.float32]:
    """Colours of one lightness and hue, with two grays beside them that make the picture's range 0..100."""
    C = np.atleast_1d(np.array(chroma, np.float64))
    Lab = LCh_to_Lab(np.stack([np.full_like(C, L), C, np.full_like(C, hue_deg)], axis=-1))
    ends = np.repeat([[0.0, 0, 0], [100.0, 0, 0]], 100, axis=0)
    return np.concatenate([Lab, ends])[None].astype(np.float32)


def test_a_picture_of_one_gray_and_errors() -> None:
    flat = np.full((4, 4, 3), (50, 0, 0), np.float32)
    low, high = SUB_GAMUT.gray_range()
    assert map_to_subgamut(flat, SUB_GAMUT).Lab[0, 0, 0] == pytest.approx((low + high) / 2, abs=1e-4)  # float32
    with pytest.raises(InputError, match="soft, clip"):
        MappingOptions(chroma="hard")
    with pytest.raises(InputError, match="finite"):
        map_to_subgamut(flat * np.float32(np.nan), SUB_GAMUT)
    with pytest.raises(InputError, match="must rise"):
        map_to_subgamut(flat, SUB_GAMUT, lightness=(50, 50))
    with pytest.raises(InputError, match=r"\(H, W, 3\)"):
        map_to_subgamut(flat[..., 0], SUB_GAMUT)
    beside = np.random.default_rng(0).uniform(0, 0.1, (20, 3)) + np.array([0.5, 0.2, 0.1])
    with pytest.raises(GamutError, match="gray"):
        map_to_subgamut(flat, _sub_gamut(beside))


def test_monotone_in_lightness() -> None:
    L = np.linspace(0, 100, 2001)
    colours = LCh_to_Lab(np.stack(np.broadcast_arrays(L[None], 40.0, np.arange(0, 360, 40.0)[:, None]), axis=-1))
    mapped = map_to_subgamut(colours.astype(np.float32), SUB_GAMUT).Lab
    assert np.diff(mapped[..., 0], axis=1).min() >= 0


def test_a_set_with_a_field_holds_every_mapped_colour() -> None:
    """A ball in CIELAB within the polytope: not convex in XYZ, and no half-space bounds it."""
    step, shape = 2.0, (60, 50, 50)
    origin = np.array([0.0, -50.0, -50.0])
    nodes = origin + step * np.moveaxis(np.indices(shape), 0, -1)
    field = LabField(origin, step, (20.0 - np.linalg.norm(nodes - [45, 5, 0], axis=-1)).astype(np.float32))
    ball = SubGamut("ball", "pattern", SUB_GAMUT.normals, SUB_GAMUT.offsets, WHITE, field)
    mapped = map_to_subgamut(_picture(5), ball, MappingOptions(chroma="clip")).Lab
    distance = np.linalg.norm(mapped - [45, 5, 0], axis=-1)
    # Trilinear between nodes 2 apart a ball of 20 is too small by 0.15 at most; the table of 5.6 degrees and 0.6 L*
    # cuts its ends off.
    assert distance.max() < 20.05
    assert np.quantile(distance, 0.9) > 15


@pytest.mark.parametrize(
    ("options", "L_from"),
    [
        (MappingOptions(lightness="fixed"), [0, 100]),
        (MappingOptions(lightness="clip"), list(SUB_GAMUT.gray_range())),
        (MappingOptions(black_percent=10, white_percent=20), [10, 80]),
    ],
)
def test_black_and_white_points(options: MappingOptions, L_from: list[float]) -> None:
    L = np.linspace(0, 100, 101, dtype=np.float32)
    Lab = np.stack([L, 0 * L, 0 * L], axis=-1)[None]
    result = map_to_subgamut(Lab, SUB_GAMUT, options)
    assert result.figures["L_from"] == pytest.approx(L_from)
    low, high = SUB_GAMUT.gray_range()
    if options.lightness == "clip":
        np.testing.assert_allclose(result.Lab[0, :, 0], np.clip(L, low, high), atol=1e-4)  # float32


def test_the_picture_of_what_moved_shows_the_chroma_that_was_lost() -> None:
    source = np.zeros((2, 3, 3), np.float32)
    source[..., 0] = [[20, 50, 80]] * 2
    source[1, :, 1] = [0, 10, 80]
    mapped = source.copy()
    mapped[1, 1:, 1] = [9.95, 20]
    picture = moved_picture(source, mapped)
    assert (np.ptp(picture[0], axis=-1) == 0).all(), "grays stay gray"
    assert (np.ptp(picture[1, :2], axis=-1) == 0).all(), "a tenth is not seen"
    assert picture[1, 2, 0] > 2 * picture[1, 2, 2], "sixty is red"
