"""Every effect of every kind of print: closed meshes that can be cut with each other."""

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
import trimesh

from paxel_design.gamut import GamutMesh, JointGamut, subgamut_and_mesh
from paxel_design.gamut.meshes import gamut_solid
from paxel_runtime.model.effects import EFFECTS
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]


def assert_closed(mesh: GamutMesh) -> None:
    """Watertight, wound outwards, of the volume it tells, and one vertex an index."""
    solid = trimesh.Trimesh(mesh.Lab, mesh.faces, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    # 1e-9: two sums of the same tetrahedra.
    assert solid.volume == pytest.approx(mesh.mesh_volume, rel=1e-9)
    assert mesh.mesh_volume > 0
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.Lab)))


@pytest.fixture
def model(
    request: pytest.FixtureRequest,
    bw_model: Models,
    measured_model: Models,
    four_channel_model: Models,
    uv_model: PredictionModel,
) -> PredictionModel:
    return {
        "b/w K=2": lambda: bw_model(2),
        "b/w K=3": lambda: bw_model(3),
        "measured b/w K=3": lambda: measured_model(3, 3),
        "cmyrgb K=6": lambda: measured_model(3, 6, colored=True),
        "four channels": lambda: four_channel_model("black", "white"),
        "ultraviolet": lambda: uv_model,
    }[request.param]()


@pytest.mark.slow
@pytest.mark.parametrize(
    "model",
    ["b/w K=2", "b/w K=3", "measured b/w K=3", "cmyrgb K=6", "four channels", "ultraviolet"],
    indirect=True,
)
def test_every_effect_has_a_closed_mesh_and_any_two_can_be_cut_and_joined(model: PredictionModel) -> None:
    joint = JointGamut(model)
    meshes = {}
    for key, effect in EFFECTS.items():
        if effect.surfaces <= len(model.surfaces):
            for surface in model.surfaces:
                _, meshes[f"{key} on {surface}"] = subgamut_and_mesh(joint, effect(), surface, step=6.0)
    for mesh in meshes.values():
        assert_closed(mesh)
    for (one, first), (two, second) in combinations(meshes.items(), 2):
        a, b = gamut_solid(first), gamut_solid(second)
        both, either = a ^ b, a + b
        for solid in (both, either):
            assert solid.status().name == "NoError", f"{one}, {two}"
        # What both hold is counted once. 1e-4 of the larger: manifold3d merges what lies within its tolerance.
        assert either.volume() == pytest.approx(
            a.volume() + b.volume() - both.volume(), abs=1e-4 * max(a.volume(), b.volume())
        ), f"{one}, {two}"
        # What is outside the full gamut is at most what flat triangles cut off its bulges.
        if one.startswith("full on") and two.split(" on ")[1] == one.split(" on ")[1]:
            assert both.volume() == pytest.approx(b.volume(), rel=0.01), f"{one}, {two}"
