"""The joint gamut against linear programming: half-spaces and inputs must say the same of every pair."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

Models = Callable[..., PredictionModel]
Oracle = Callable[[PredictionModel, NDArray[np.float64]], bool]


def colors_of(model: PredictionModel, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3 or 6) colours of inputs (m, n) on all surfaces, side by side."""
    return np.concatenate([surface.predict_XYZ(x) for surface in model.surfaces.values()], axis=-1)


@settings(deadline=None, max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.integers(0, 2**32 - 1), st.sampled_from([(1, 3), (2, 1), (2, 2), (2, 3), (3, 3), (4, 3), (3, 4)]), st.booleans()
)
def test_slack_and_linear_programming_agree(
    measured_model: Models, is_reachable: Oracle, seed: int, size: tuple[int, int], colored: bool
) -> None:
    model = measured_model(seed, *size, colored=colored)
    joint = JointGamut(model)
    rng = np.random.default_rng(seed)
    # Pairs from nearly binary inputs lie near the boundary; half of them are pushed about.
    pairs = colors_of(model, rng.beta(0.1, 0.1, (12, model.n)))
    pairs[6:] += 0.03 * rng.standard_normal((6, 6))
    slack = joint.slack(pairs[:, :3], pairs[:, 3:])
    assert slack[:6].min() > -1e-12, "what an input gives is inside, to rounding"
    for pair, distance in zip(pairs, slack, strict=True):
        if abs(distance) > 1e-6:  # nearer than that, HiGHS itself is not sure
            assert is_reachable(model, pair) == (distance > 0)
    np.testing.assert_array_equal(joint.contains(pairs[:, :3], pairs[:, 3:]), slack >= -1e-9)


def test_eighteen_inputs(measured_model: Models, is_reachable: Oracle) -> None:
    model = measured_model(1, 6, 3, colored=True)
    joint = JointGamut(model)
    assert len(joint.normals) == 17136, "2 C(18, 5): measured generators are in general position"
    rng = np.random.default_rng(1)
    pairs = colors_of(model, rng.beta(0.05, 0.05, (30, model.n)))
    pairs[10:] += 0.02 * rng.standard_normal((20, 6))
    for pair, distance in zip(pairs, joint.slack(pairs[:, :3], pairs[:, 3:]), strict=True):
        assert abs(distance) < 1e-6 or is_reachable(model, pair) == (distance > 0)


@pytest.mark.parametrize("K", [2, 3])
def test_neutral_inks_have_few_facets_because_parallel_generators_merge(bw_model: Models, K: int) -> None:
    # Each channel alone gives a parallelogram of (pattern, white) with 2 K sides; the joint gamut is their product.
    assert len(JointGamut(bw_model(K)).normals) == 3 * 2 * K


def test_one_surface_is_a_zonotope_in_three_dimensions(measured_model: Models, is_reachable: Oracle) -> None:
    model = measured_model(3, 3, 2, colored=True)
    alone = PredictionModel(model.channels, model.clusters, model.pattern, None, model.white_point, model.response)
    joint = JointGamut(alone)
    assert joint.normals.shape == (2 * 15, 3)
    colors = colors_of(alone, np.random.default_rng(0).beta(0.1, 0.1, (20, 6)))
    assert np.all(joint.contains(colors))
    normals, offsets = joint.surface("pattern")
    np.testing.assert_array_equal(normals, joint.normals)
    np.testing.assert_array_equal(offsets, joint.offsets)
    with pytest.raises(InputError, match="two surfaces"):
        _ = joint.pairs
    with pytest.raises(InputError, match="two surfaces"):
        joint.section([0.2, 0.2, 0.2], "pattern")


def test_the_pair_gamut_is_the_joint_gamut_as_data(bw_model: Models) -> None:
    joint = JointGamut(bw_model(2))
    pattern, white = np.random.default_rng(0).random((2, 50, 3))
    np.testing.assert_array_equal(joint.pairs.slack(pattern, white), joint.slack(pattern, white))


@pytest.mark.parametrize("shown_on", ["pattern", "white"])
def test_a_section_holds_what_goes_with_the_colour_and_nothing_else(
    measured_model: Models, is_reachable: Oracle, shown_on: str
) -> None:
    model = measured_model(5, 3)
    held = model.white if shown_on == "pattern" else model.pattern
    assert held is not None
    color = held.predict_XYZ(np.full(model.n, 0.35))
    section = JointGamut(model).section(color, shown_on)
    middle = section.vertices.mean(axis=0)
    for vertex in section.vertices:
        for point, inside in ((vertex, True), (vertex + 1e-3 * (vertex - middle), False)):
            pair = np.concatenate((point, color) if shown_on == "pattern" else (color, point))
            # A thousandth of the way beyond a vertex is 1e-5 and more in XYZ: HiGHS sees that.
            assert is_reachable(model, pair) == inside


def test_an_erosion_is_the_intersection_of_the_sections(measured_model: Models) -> None:
    model = measured_model(6, 3)
    joint = JointGamut(model)
    assert model.white is not None
    held = model.white.predict_XYZ(0.45 + 0.1 * np.random.default_rng(0).random((4, model.n)))
    eroded = joint.erode(held, "pattern")
    sections = [joint.section(color, "pattern") for color in held]
    points = eroded.vertices.mean(axis=0) + 0.2 * np.random.default_rng(1).standard_normal((500, 3)) * np.ptp(
        eroded.vertices, axis=0
    )
    in_all = np.min([np.min(s.offsets - points @ s.normals.T, axis=1) for s in sections], axis=0) >= 0
    # 1e-12: rounding of colours below 1.
    np.testing.assert_array_equal(np.min(eroded.offsets - points @ eroded.normals.T, axis=1) >= -1e-12, in_all)
    assert 0 < in_all.sum() < len(points), "the points must tell inside from outside"


def test_a_pattern_of_one_ink_leaves_no_choice(measured_model: Models) -> None:
    """With one cluster the other surface follows: a section is a point, and says so."""
    model = measured_model(0, 1)
    assert model.white is not None
    color = model.white.predict_XYZ([0.5, 0.5, 0.5])
    joint = JointGamut(model)
    assert joint.contains(model.pattern.predict_XYZ([0.5, 0.5, 0.5]), color)
    with pytest.raises(GamutError, match="flat"):
        joint.section(color, "pattern")


def test_a_colour_out_of_reach_has_an_empty_section(bw_model: Models) -> None:
    model = bw_model(2)
    with pytest.raises(GamutError, match="empty"):
        JointGamut(model).section(Lab_to_XYZ([50.0, 120, 0], model.white_point), "pattern")


def test_models_and_surfaces_that_make_no_sense_are_refused(bw_model: Models) -> None:
    model = bw_model(2)
    image = SurfaceModel(np.zeros((2, 2, 3, 6)), np.zeros((2, 2, 3)))
    broken = SurfaceModel(np.full((3, 6), np.nan), np.zeros(3))
    for surface, rule in ((image, "one matrix"), (broken, "finite")):
        with pytest.raises(InputError, match=rule):
            JointGamut(
                PredictionModel(model.channels, model.clusters, surface, None, model.white_point, model.response)
            )
    assert model.white is not None
    dark = [SurfaceModel(s.A * (np.arange(6) != 4), s.black) for s in (model.pattern, model.white)]
    swapped = PredictionModel(
        model.channels, model.clusters, model.white, model.pattern, model.white_point, model.response
    )
    with pytest.raises(InputError, match=r"zeros, got one at input 4 \(channel green on cluster white\)"):
        JointGamut(PredictionModel(model.channels, model.clusters, *dark, model.white_point, model.response))
    with pytest.raises(InputError, match="swapped"):
        JointGamut(swapped)
    with pytest.raises(InputError, match="pattern, white"):
        JointGamut(model).surface("wall")
    with pytest.raises(InputError, match="XYZ_white"):
        JointGamut(model).slack(np.zeros(3))
