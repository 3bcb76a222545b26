"""Frame plans against the inversion, against the model's own prediction, and against plain colorimetry."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_runtime.assembly import dither, intensities_to_codes
from paxel_runtime.errors import InputError
from paxel_runtime.inversion import EXACT, build_mapping_table, invert
from paxel_runtime.inversion.frame_plan import AffineMapping, FramePlan, frame_to_codes, plan_frame
from paxel_runtime.model.colorimetry import Lab_to_XYZ, sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

Models = Callable[[int], PredictionModel]
SHAPE = (24, 301)  # not a multiple of the lanes
DIM, BRIGHT = AffineMapping(0.10, 30.0, 0.25), AffineMapping(0.12, 58.0, 0.25)


def _pictures(seed: int) -> list[NDArray[np.uint8]]:
    rng = np.random.default_rng(seed)
    return [rng.integers(0, 256, (*SHAPE, 3)).astype(np.uint8) for _ in range(2)]


def _labels(K: int, seed: int = 0) -> NDArray[np.uint8]:
    labels = np.random.default_rng(seed).integers(0, K, SHAPE).astype(np.uint8)
    labels[:2] = 255
    return labels


def _mapped(picture: NDArray[np.uint8], mapping: AffineMapping) -> NDArray[np.float64]:
    """The mapping as its definition says it, in float64."""
    Lab = sRGB_to_Lab(picture / 255)
    return Lab * [mapping.L_gain, mapping.chroma_scale, mapping.chroma_scale] + [mapping.L_offset, 0.0, 0.0]


def test_six_inputs_give_the_codes_of_the_inversion(bw_model: Models) -> None:
    model, labels, (first, second) = bw_model(2), _labels(2), _pictures(1)
    codes = frame_to_codes(plan_frame(model, labels, DIM, BRIGHT), first, second)
    exact = invert(_mapped(first, DIM), _mapped(second, BRIGHT), model)
    p = dither(exact.x.astype(np.float32), labels, 3)
    reference = intensities_to_codes(p, labels != 255, model.response, 8, rounding="nearest")
    reached = (exact.status == EXACT) & (labels != 255)
    assert reached.mean() > 0.3
    apart = np.abs(codes.astype(int) - reference)[reached].max(axis=-1)
    # float32 through the inverse of A moves x by some 1e-5: a code rounds the other way now and then.
    assert np.mean(apart > 1) <= 0.001
    assert np.mean(apart == 0) > 0.98
    assert not codes[:2].any(), "outside the pattern: black"


def test_more_inputs_come_within_reach_by_clip_and_correct(bw_model: Models) -> None:
    """Predicted from the plan's own x: every cluster's rows are read off by labelling the frame with it."""
    model = bw_model(3)
    first, second = _pictures(2)
    x = _inputs(lambda labels: plan_frame(model, labels, DIM, BRIGHT, bits=16), model, (first, second))
    wanted = _mapped(first, DIM), _mapped(second, BRIGHT)
    reachable = invert(*wanted, model).status == EXACT
    assert reachable.mean() > 0.3
    error = np.maximum(*(dE00(Lab, seen)[reachable] for Lab, seen in zip(wanted, model.predict(x), strict=True)))
    assert np.mean(error <= 0.6) >= 0.999, "the issue's figure for 16 rounds"


def _inputs(
    make: Callable[[NDArray[np.uint8]], FramePlan], model: PredictionModel, pictures: tuple[NDArray[np.uint8], ...]
) -> NDArray[np.float64]:
    """Linear inputs of every cluster that the codes stand for, (H, W, n)."""
    rows = []
    for cluster in range(len(model.clusters)):
        codes = frame_to_codes(make(np.full(SHAPE, cluster, np.uint8)), *pictures)
        rows.append(model.response.P_to_x(codes / 65535.0))
    return np.concatenate(rows, axis=-1)


def _five_clusters(model: PredictionModel) -> PredictionModel:
    """15 inputs: three clusters, and two more that are neither."""
    rng = np.random.default_rng(0)
    surfaces = {
        name: SurfaceModel(0.6 * np.hstack([s.A, s.A[:, :6] * rng.uniform(0.5, 1.5, (3, 6))]), s.black)
        for name, s in model.surfaces.items()
    }
    return dataclasses.replace(model, clusters=tuple("abcde"), **surfaces)


@pytest.mark.parametrize("K", [3, 5])
def test_rounds_are_those_of_clip_and_correct(bw_model: Models, K: int) -> None:
    """Both forms of a round, by what A does not see (n - 6 < 6) and by G and A, against the formula in float64."""
    model = bw_model(3) if K == 3 else _five_clusters(bw_model(3))
    pictures = _pictures(5)
    x = _inputs(lambda labels: plan_frame(model, labels, DIM, BRIGHT, bits=16), model, tuple(pictures))
    assert model.white is not None
    A = np.concatenate([model.pattern.A, model.white.A])
    wanted = [Lab_to_XYZ(_mapped(p, m), model.white_point) for p, m in zip(pictures, (DIM, BRIGHT), strict=True)]
    y = np.concatenate(wanted, axis=-1) - np.concatenate([model.pattern.black, model.white.black])
    G = np.linalg.pinv(A)
    slow = 0.5 + (y - A.sum(axis=1) / 2) @ G.T
    for _ in range(16):
        inside = np.clip(slow, 0.0, 1.0)
        slow = inside + 1.6 * (y - inside @ A.T) @ G.T
    # float32 through G, whose entries are some tens, and the response's steep foot: 16-bit codes of 0.0005 in x.
    assert np.quantile(np.abs(x - np.clip(slow, 0, 1)), 0.999) < 1e-3


def test_a_table_serves_as_mapping(bw_model: Models) -> None:
    """The codes of an affine mapping and of its table: on one surface, on the other, and on both."""
    model, labels, pictures = bw_model(2), _labels(2), _pictures(6)
    mappings = DIM, BRIGHT
    tables = [
        build_mapping_table(
            lambda Lab, m=m: (
                Lab * np.float32([m.L_gain, m.chroma_scale, m.chroma_scale]) + np.float32([m.L_offset, 0.0, 0.0])
            )
        )
        for m in mappings
    ]
    x = _inputs(lambda labels: plan_frame(model, labels, *mappings, bits=16), model, tuple(pictures))
    seen = model.predict(x)
    bound = max(table.dE00_bound for table in tables)
    assert bound < 0.3, "33 nodes, a tenth of the lightness"
    shown = np.all((x > 0) & (x < 1), axis=-1)  # outside, clipping moves both in ways of their own
    assert shown.mean() > 0.3
    for pair in ((tables[0], BRIGHT), (DIM, tables[1]), tuple(tables)):
        near = _inputs(lambda labels, pair=pair: plan_frame(model, labels, *pair, bits=16), model, tuple(pictures))
        for Lab, other in zip(seen, model.predict(near), strict=True):
            assert Lab is not None
            assert other is not None
            assert dE00(Lab, other)[shown].max() <= bound + 0.01  # 16-bit codes
    assert not frame_to_codes(plan_frame(model, labels, *tables), *pictures)[:2].any(), "outside the pattern: black"


def test_one_surface_shows_the_mapped_picture(bw_model: Models) -> None:
    two = bw_model(2)
    model = dataclasses.replace(two, white=None)
    mapping, picture = AffineMapping(0.3, 20.0, 0.3), _pictures(3)[0]
    x = _inputs(lambda labels: plan_frame(model, labels, mapping, bits=16), model, (picture,))
    wanted = _mapped(picture, mapping)
    inside = invert(wanted, None, model).status == EXACT
    assert inside.mean() > 0.9
    assert np.quantile(dE00(wanted, model.predict(x)[0])[inside], 0.99) < 0.05


def test_inputs_that_are_no_multiple_of_three_are_filled_up() -> None:
    """One channel on four inks: 4 inputs, 3 equations."""
    rng = np.random.default_rng(0)
    A = rng.uniform(0.05, 0.3, (3, 4))
    ramp = np.linspace(0, 1, 5)

    model = PredictionModel(
        ("uv",),
        tuple("abcd"),
        SurfaceModel(A, np.full(3, 1e-3)),
        None,
        A.sum(axis=1),
        ProjectorResponse((ramp,), (ramp,)),
    )
    gray = np.full((*SHAPE, 3), 128, np.uint8)
    mapping = AffineMapping(0.0, 50.0, 0.0)
    x = _inputs(lambda labels: plan_frame(model, labels, mapping, bits=16), model, (gray,))
    np.testing.assert_allclose(dE00(model.predict(x)[0], [50.0, 0.0, 0.0]), 0.0, atol=0.01)


@given(st.integers(0, 255), st.floats(0, 1), st.floats(0, 100))
def test_the_mapping_keeps_its_ends_in_range(code: int, gain: float, offset: float) -> None:
    if offset + 100 * gain > 100:
        with pytest.raises(InputError, match=r"0\.\.100"):
            AffineMapping(gain, offset)
    else:
        assert 0 <= AffineMapping(gain, offset).L_offset + gain * code / 2.55 <= 100 + 1e-9


def test_moved_colours_move_codes_little(bw_model: Models) -> None:
    """Continuity: neighbouring codes of a smooth gradient differ by a few steps, also where x meets the box."""
    model = bw_model(3)
    gradient = np.broadcast_to(np.linspace(0, 255, SHAPE[1]).astype(np.uint8)[None, :, None], (*SHAPE, 3))
    flat = np.full((*SHAPE, 3), 128, np.uint8)
    x = _inputs(lambda labels: plan_frame(model, labels, DIM, BRIGHT, bits=16), model, (gradient.copy(), flat))
    assert np.abs(np.diff(x[0], axis=0)).max() < 0.05  # a step of one 8-bit code is 0.04 L* on the pattern


def test_what_does_not_fit_is_named(bw_model: Models) -> None:
    model, labels = bw_model(2), _labels(2)
    plan = plan_frame(model, labels, DIM, BRIGHT)
    first, second = _pictures(4)
    with pytest.raises(InputError, match="2 pictures"):
        frame_to_codes(plan, first)
    with pytest.raises(InputError, match="uint8"):
        frame_to_codes(plan, first / 255, second)
    with pytest.raises(InputError, match="below 2"):
        plan_frame(model, labels + np.uint8(3), DIM, BRIGHT)
    with pytest.raises(InputError, match="two surfaces"):
        plan_frame(dataclasses.replace(model, white=None), labels, DIM, BRIGHT)
    gray = dataclasses.replace(model, pattern=SurfaceModel(np.outer(model.white_point, np.ones(6)) / 6, np.zeros(3)))
    with pytest.raises(InputError, match="independent inputs"):
        plan_frame(gray, labels, DIM, BRIGHT)
    everywhere = SurfaceModel(np.broadcast_to(model.pattern.A, (*SHAPE, 3, 6)), np.zeros((*SHAPE, 3)))
    with pytest.raises(InputError, match="image-based"):
        plan_frame(dataclasses.replace(model, pattern=everywhere), labels, DIM)
    with pytest.raises(InputError, match="bits"):
        plan_frame(model, labels, DIM, BRIGHT, bits=0)
