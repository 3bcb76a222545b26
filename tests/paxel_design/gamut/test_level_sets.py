"""Level sets: surface nets of bodies with a formula, and the meshes of hue sets by their own definition."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut, gamut_mesh, intersection, sub_gamut, subgamut_and_mesh
from paxel_design.gamut.contouring import crossings_of, surface_net
from paxel_design.gamut.level_sets import field_volume, level_set, level_set_mesh
from paxel_design.gamut.margins import hue_margins
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import EFFECTS, HueShift
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]


def test_a_surface_net_of_a_sphere_is_closed_and_lies_on_it() -> None:
    centre, radius = np.array([10.3, 9.8, 10.1]), 6.5
    nodes = np.moveaxis(np.indices((21, 20, 21)), 0, -1)
    values = radius - np.linalg.norm(nodes - centre, axis=-1)
    crossings = crossings_of(values)
    f0, f1 = (values[tuple(ends.T)] for ends in (crossings.low, crossings.high))
    vertices, faces = surface_net(crossings, f0 / (f0 - f1), values.shape)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    halves = {(i, j) for face in faces.tolist() for i, j in zip(face, face[1:] + face[:1], strict=True)}
    assert all((j, i) in halves for i, j in halves), "closed, and neighbours wound alike"
    assert len(halves) == 3 * len(faces)
    # The middle of crossings on a sphere lies inside it by up to the sagitta of a cell, sqrt(3)^2 / 8 radius = 0.06.
    distance = np.linalg.norm(vertices - centre, axis=1) - radius
    assert np.abs(distance).max() < 0.06
    volume = np.einsum("fi,fi->", a - centre, np.cross(b - centre, c - centre)) / 6
    assert volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.035), "sagitta 0.06 of 6.5, three times"


def test_a_half_of_the_full_gamut_by_a_formula(bw_model: Models) -> None:
    """A margin that is a plane in CIELAB: half of the body is left, and its mesh is the boolean cut."""
    full = sub_gamut(bw_model(2), "full")

    def margins(XYZ: NDArray[np.float64]) -> NDArray[np.float64]:
        return 40 - np.asarray(XYZ_to_Lab(XYZ, full.white_point))[:, 0]

    half = level_set(full, "dark", margins, 4.0)
    mesh, whole = level_set_mesh(half, margins), gamut_mesh(full)
    body = whole.Lab[whole.faces]
    assert body[..., 0].max() > 60
    assert mesh.Lab[:, 0].max() == pytest.approx(40, abs=0.05), "simplifying moves by 0.02"
    assert mesh.mesh_volume == pytest.approx(field_volume(half), rel=0.02), "node count at a step of 4"
    assert (mesh.components, mesh.genus) == (1, 0)
    assert half.gray_range()[1] == pytest.approx(40, abs=0.1)


def test_an_empty_level_set_is_told(bw_model: Models) -> None:
    full = sub_gamut(bw_model(2), "full")
    with pytest.raises(GamutError, match=r"nothing\.on-pattern is empty"):
        level_set(full, "nothing", lambda XYZ: np.full(len(XYZ), -1.0), 8.0)


@pytest.mark.parametrize("angle", [45, 170])
def test_the_mesh_of_a_hue_set_lies_where_its_margin_is_zero(measured_model: Models, angle: int) -> None:
    model = measured_model(1, 2)
    joint = JointGamut(model)
    effect = HueShift(angle)
    gamut, mesh = subgamut_and_mesh(joint, effect, step=4.0)
    margins = hue_margins(model, effect, "pattern")
    middle = mesh.Lab.mean(axis=0)
    rng = np.random.default_rng(0)
    some = mesh.Lab[rng.permutation(len(mesh.Lab))[:300]]
    # A unit inwards is in the set but at sharp edges that a grid of 4 rounds; a unit and a half outwards is not.
    inwards = (middle - some) / np.linalg.norm(middle - some, axis=1)[:, None]

    def inside(Lab: NDArray[np.float64]) -> NDArray[np.bool_]:
        XYZ = np.asarray(Lab_to_XYZ(Lab, model.white_point), np.float64)
        reachable = sub_gamut(joint, "full").contains(XYZ)
        reachable[reachable] = margins(XYZ[reachable]) >= 0
        return reachable

    assert np.mean(inside(some + 1.5 * inwards)) > 0.9
    assert np.mean(inside(some - 1.5 * inwards)) < 0.1
    assert mesh.mesh_volume == pytest.approx(mesh.volume, rel=0.02)
    assert mesh.volume_error == pytest.approx(abs(mesh.mesh_volume - mesh.volume))
    assert gamut.field is not None


@pytest.mark.slow
@pytest.mark.parametrize("make", ["bw 2", "measured 2 3", "measured 3 3", "coloured 6 3", "measured 2 4"])
def test_every_effect_of_every_print_has_a_closed_mesh_that_cuts_the_others(
    bw_model: Models, measured_model: Models, make: str
) -> None:
    kind, *size = make.split()
    model = bw_model(2) if kind == "bw" else measured_model(3, *map(int, size), colored=kind == "coloured")
    joint = JointGamut(model)
    full = gamut_mesh(sub_gamut(joint, "full"))
    for effect in EFFECTS:
        _, mesh = subgamut_and_mesh(joint, effect, step=4.0)
        solid = trimesh.Trimesh(mesh.Lab, mesh.faces, process=False)
        assert solid.is_watertight
        assert solid.is_winding_consistent
        assert solid.volume > 0
        # What is outside the full gamut is at most what flat triangles of 4 units cut off its bulges.
        assert intersection(mesh, full).mesh_volume == pytest.approx(mesh.mesh_volume, rel=0.01)
