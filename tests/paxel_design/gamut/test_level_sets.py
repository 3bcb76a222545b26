"""Level sets: surface nets of bodies with a formula, and the meshes of hue sets by their own definition."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from paxel_design.gamut import GamutMesh, JointGamut, gamut_mesh, intersection, sub_gamut, subgamut_and_mesh
from paxel_design.gamut.contouring import crossings_of, smoothed, surface_net
from paxel_design.gamut.level_sets import field_volume, level_set, level_set_mesh
from paxel_design.gamut.margins import hue_margins
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import EFFECTS, HueShift
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]


def sphere_net(radius: float, n: int) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Vertices about the centre, faces, and crossings about the centre of the net of a sphere."""
    centre = np.array([n / 2 + 0.3, n / 2 - 0.2, n / 2 + 0.1])
    nodes = np.moveaxis(np.indices((n + 1, n, n + 1)), 0, -1)
    values = radius - np.linalg.norm(nodes - centre, axis=-1)
    crossings = crossings_of(values)
    f0, f1 = (values[tuple(ends.T)] for ends in (crossings.low, crossings.high))
    vertices, faces = surface_net(crossings, f0 / (f0 - f1), values.shape)
    return vertices - centre, faces, crossings.low + (f0 / (f0 - f1))[:, None] * np.eye(3)[crossings.axis] - centre


def volume_of(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


def test_a_surface_net_of_a_sphere_is_closed_and_lies_on_it() -> None:
    radius, missing = 6.5, []
    for scale in (1, 2):
        R = scale * radius
        vertices, faces, on_edges = sphere_net(R, int(2 * R + 8))
        halves = {(i, j) for face in faces.tolist() for i, j in zip(face, face[1:] + face[:1], strict=True)}
        assert all((j, i) in halves for i, j in halves), "closed, and neighbours wound alike"
        assert len(halves) == 3 * len(faces)
        # Straight interpolation of a distance along an edge of 1: an eighth of its curvature inside.
        assert np.linalg.norm(on_edges, axis=1).min() > R - 1 / (8 * (R - 1))
        # The middle of points of a sphere within a ball about a cell, radius sqrt(3) / 2: inside by up to the sagitta.
        depth = R - np.linalg.norm(vertices, axis=1)
        assert depth.min() > -1e-9
        assert depth.max() < R - np.sqrt(R**2 - 3 / 4) + 1 / (8 * (R - 1))
        missing.append(1 - volume_of(vertices, faces) / (4 / 3 * np.pi * R**3))
        # Any point of a face is a mixture of crossings of four cells about an edge, in a ball of radius 3 / 2.
        assert 0 < missing[-1] < 1 - (1 - (3 / 2 / R) ** 2) ** 1.5
    assert missing[0] / missing[1] == pytest.approx(4, rel=0.1), "all of it goes with the square of the step"


def test_smoothing_takes_teeth_and_keeps_volume() -> None:
    vertices, faces, _ = sphere_net(13.0, 34)
    teeth = np.where(np.random.default_rng(0).random(len(vertices)) < 0.5, 1.03, 0.97)[:, None]
    rough = vertices * teeth
    smooth = smoothed(rough, faces)
    roughness = [np.linalg.norm(v, axis=1).std() for v in (rough, smooth)]
    # Of the shortest waves (0.4 * 1.64)^6 = 8 % is left, of those of four edges (0.7 * 1.32)^6 = 60 %.
    assert roughness[1] < 0.5 * roughness[0]
    # A sphere of radius 13 is a wave of 80 edges: it is kept.
    assert volume_of(smoothed(vertices, faces), faces) == pytest.approx(volume_of(vertices, faces), rel=0.003)


def test_a_half_of_the_full_gamut_by_a_formula(bw_model: Models) -> None:
    """A margin that is a plane in CIELAB: half of the body is left, and its mesh is the boolean cut."""
    full = sub_gamut(bw_model(2), "full")

    def margins(XYZ: NDArray[np.float64]) -> NDArray[np.float64]:
        return 40 - np.asarray(XYZ_to_Lab(XYZ, full.white_point))[:, 0]

    half = level_set(full, "dark", margins, 4.0)
    mesh, whole = level_set_mesh(half, margins), gamut_mesh(full)
    body = whole.Lab[whole.faces]
    assert body[..., 0].max() > 60
    assert mesh.Lab[:, 0].max() == pytest.approx(40, abs=0.12), (
        "simplifying moves by 0.02, smoothing at the bend on the gamut's surface 2.5 % of a step"
    )
    assert mesh.mesh_volume == pytest.approx(field_volume(half), rel=0.02), "node count at a step of 4"
    assert (mesh.components, mesh.genus) == (1, 0)
    assert half.gray_range()[1] == pytest.approx(40, abs=0.1)


def test_an_empty_level_set_is_told(bw_model: Models) -> None:
    full = sub_gamut(bw_model(2), "full")
    with pytest.raises(GamutError, match=r"nothing\.on-pattern is empty"):
        level_set(full, "nothing", lambda XYZ: np.full(len(XYZ), -1.0), 8.0)


def is_in_mesh(mesh: GamutMesh, L: NDArray[np.float64], ab: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether colours of lightness (l,) over places (k, 2) of the floor lie in a mesh, (k, l): odd crossings above."""
    a, b, c = np.moveaxis(mesh.Lab[mesh.faces], 1, 0)
    sides = np.array([b[:, 1:] - a[:, 1:], c[:, 1:] - a[:, 1:]])
    area = sides[0, :, 0] * sides[1, :, 1] - sides[0, :, 1] * sides[1, :, 0]
    inside = np.zeros((len(ab), len(L)), bool)
    for k, place in enumerate(ab):
        d = place - a[:, 1:]
        v = (d[:, 0] * sides[1, :, 1] - d[:, 1] * sides[1, :, 0]) / area
        w = (sides[0, :, 0] * d[:, 1] - sides[0, :, 1] * d[:, 0]) / area
        hit = (v >= 0) & (w >= 0) & (v + w <= 1)
        height = a[hit, 0] + v[hit] * (b - a)[hit, 0] + w[hit] * (c - a)[hit, 0]
        inside[k] = np.count_nonzero(height[:, None] > L, axis=0) % 2 == 1
    return inside


@pytest.mark.parametrize("angle", [45, 170])
def test_the_mesh_of_a_hue_set_holds_the_colours_whose_margin_is_positive(measured_model: Models, angle: int) -> None:
    model = measured_model(1, 2)
    joint = JointGamut(model)
    effect = HueShift(angle)
    full, margins = sub_gamut(joint, "full"), hue_margins(model, effect, "pattern")
    rng = np.random.default_rng(0)
    differing = []
    for step in (8.0, 4.0):
        gamut, mesh = subgamut_and_mesh(joint, effect, step=step)
        assert gamut.field is not None
        low, high = mesh.Lab.min(axis=0) - 4, mesh.Lab.max(axis=0) + 4
        L, ab = np.linspace(low[0], high[0], 40), rng.uniform(low[1:], high[1:], (150, 2))
        Lab = np.concatenate(np.broadcast_arrays(L[None, :, None], ab[:, None]), axis=-1)[..., -3:]
        XYZ = np.asarray(Lab_to_XYZ(Lab, model.white_point), np.float64)
        inside = full.contains(XYZ)
        inside[inside] = margins(XYZ[inside]) >= 0
        # As a layer on the surface: the volume of what differs, over the area.
        share = np.mean(inside != is_in_mesh(mesh, L, ab))
        differing.append(share * np.prod(high - low) / mesh.area)
        assert mesh.volume_error == pytest.approx(abs(mesh.mesh_volume - mesh.volume))
    # Sagittas, and what is cut off a crease, go with the square of the step: a quarter, of 6,000 colours some third.
    assert differing[1] < differing[0] / 2.5
    # So at the usual step of 2 less than 0.1 CIELAB units.
    assert differing[1] < 4 * 0.1
    # The node count's own error is the larger: its surface is known to half a step at random.
    assert mesh.mesh_volume == pytest.approx(mesh.volume, rel=0.02)


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
