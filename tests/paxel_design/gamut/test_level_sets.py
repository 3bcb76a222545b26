"""Level sets: surface nets of bodies with a formula, and the meshes of hue sets by their own definition."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.gamut import GamutMesh, JointGamut, gamut_mesh, sub_gamut, subgamut_and_mesh
from paxel_design.gamut.contouring import crossings_of, net_faces, net_vertices
from paxel_design.gamut.level_sets import level_set, level_set_mesh
from paxel_design.gamut.margins import Margins, hue_margins
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import HueShift
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SubGamut

Models = Callable[..., PredictionModel]


def sphere_net(radius: float, n: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices about the centre, and faces, of the net of a sphere."""
    centre = np.array([n / 2 + 0.3, n / 2 - 0.2, n / 2 + 0.1])
    nodes = np.moveaxis(np.indices((n + 1, n, n + 1)), 0, -1)
    crossings = crossings_of(radius - np.linalg.norm(nodes - centre, axis=-1))
    # Where |point - centre| = radius on each edge.
    from_centre = crossings.low - centre
    along = from_centre[np.arange(len(from_centre)), crossings.axis]
    root = np.sqrt(along**2 - np.sum(from_centre**2, axis=1) + radius**2)
    points = crossings.points(np.where(crossings.low_inside, root, -root) - along)
    normals = (points - centre) / radius
    vertices = net_vertices(crossings, points, normals)
    return vertices - centre, net_faces(crossings, vertices, points, normals)


def _node_count_volume(gamut: SubGamut) -> float:
    """Of a sub-gamut with a field, in cubic CIELAB units: its nodes inside, each a cube of the step."""
    assert gamut.field is not None
    nodes = gamut.field.origin + gamut.field.step * np.argwhere(gamut.field.values > 0)
    full = SubGamut(gamut.effect, gamut.shown_on, gamut.normals, gamut.offsets, gamut.white_point)
    return float(np.sum(full.contains(Lab_to_XYZ(nodes, gamut.white_point)))) * gamut.field.step**3


def volume_of(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


def is_closed(faces: NDArray[np.int64]) -> bool:
    """Whether each edge has two faces, wound alike."""
    halves = {(i, j) for face in faces.tolist() for i, j in zip(face, face[1:] + face[:1], strict=True)}
    return len(halves) == 3 * len(faces) and all((j, i) in halves for i, j in halves)


def test_the_net_of_a_sphere_is_closed_and_lies_on_it() -> None:
    radius, off = 6.5, []
    for scale in (1, 2):
        R = scale * radius
        vertices, faces = sphere_net(R, int(2 * R + 8))
        assert is_closed(faces)
        # Middle and meeting of tangent planes at points within a cell, a ball of radius sqrt(3) / 2: within the
        # sagitta on either side.
        depth = R - np.linalg.norm(vertices, axis=1)
        assert np.abs(depth).max() < R - np.sqrt(R**2 - 3 / 4)
        off.append(np.abs(1 - volume_of(vertices, faces) / (4 / 3 * np.pi * R**3)))
        # Any point of a face is a mixture of vertices of four cells about an edge, in a ball of radius 3 / 2.
        assert off[-1] < 1 - (1 - (3 / 2 / R) ** 2) ** 1.5
    assert off[0] / off[1] == pytest.approx(4, rel=0.15), "all of it goes with the square of the step"


def test_the_net_of_a_turned_box_has_its_edges_and_corners() -> None:
    n, half = 24, np.array([6.3, 5.1, 4.2])
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    centre = np.array([12.2, 11.9, 12.1])

    def beyond(places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance beyond each of the six planes, (..., 6)."""
        own = (places - centre) @ turn
        return np.concatenate((own - half, -own - half), axis=-1)

    crossings = crossings_of(-beyond(np.moveaxis(np.indices((n + 1,) * 3), 0, -1).astype(float)).max(axis=-1))
    ends = [beyond(end.astype(float)) for end in (crossings.low, crossings.high)]
    # The plane that is crossed is the last to be left on the way in.
    outer = np.where(crossings.low_inside[:, None], ends[1], ends[0])
    inner = np.where(crossings.low_inside[:, None], ends[0], ends[1])
    share = np.where(outer > 0, outer / (outer - inner), 0.0)
    plane, k = np.argmax(share, axis=1), np.arange(len(share))
    share = np.where(crossings.low_inside, 1 - share[k, plane], share[k, plane])
    points, normals = crossings.points(share), np.concatenate((turn, -turn), axis=1)[:, plane].T
    vertices = net_vertices(crossings, points, normals)
    assert np.abs(beyond(points).max(axis=1)).max() < 1e-9
    # Planes meet on edges and in corners exactly, but where an edge only touches a cell's faces and runs beside it.
    off = np.abs(beyond(vertices).max(axis=1))
    assert np.mean(off < 1e-6) > 0.95
    assert off.max() < np.sqrt(3) / 2
    corners = (
        centre + np.stack(np.meshgrid(*np.stack((-half, half), axis=1), indexing="ij"), -1).reshape(-1, 3) @ turn.T
    )
    nearest = np.linalg.norm(vertices[:, None] - corners, axis=-1).min(axis=0)
    # A corner whose cell is crossed by edges of all three of its planes is met exactly; a cell's diagonal is 1.7.
    assert np.sum(nearest < 1e-6) >= 4
    assert nearest.max() < 1.8
    faces = net_faces(crossings, vertices, points, normals)
    assert is_closed(faces)
    assert volume_of(vertices, faces) == pytest.approx(np.prod(2 * half), rel=0.01)


def test_a_half_of_the_full_gamut_by_a_formula(bw_model: Models) -> None:
    """A margin that is a plane in CIELAB: half of the body is left, and its mesh is the boolean cut."""
    full = sub_gamut(bw_model(2), "full")

    def dark(XYZ: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        L = np.asarray(XYZ_to_Lab(XYZ, full.white_point))[:, 0]
        return 41 - L, np.tile([-1.0, 0.0, 0.0], (len(L), 1))

    margins = Margins(dark)
    level = level_set(full, "dark", margins, 4.0)
    half, mesh, whole = level.gamut, level_set_mesh(level), gamut_mesh(full)
    body = whole.Lab[whole.faces]
    assert body[..., 0].max() > 60
    # Simplifying moves by 0.01.
    assert mesh.Lab[:, 0].max() == pytest.approx(41, abs=0.02)
    top = mesh.Lab[mesh.faces]
    a, b, c = np.moveaxis(top[np.all(top[..., 0] > 40.98, axis=1)], 1, 0)
    field = half.field
    assert field is not None
    layer = int((40 - field.origin[0]) / field.step + 0.5)
    nodes = field.origin + field.step * np.argwhere(field.values[layer : layer + 1] > 0) + (field.step * layer, 0, 0)
    inside = full.contains(Lab_to_XYZ(nodes, full.white_point))
    flat = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert flat == pytest.approx(np.sum(inside) * field.step**2, rel=0.1), "a layer of nodes 1 below, 2 apart"
    assert mesh.mesh_volume == pytest.approx(_node_count_volume(half), rel=0.02), "node count at a step of 2"
    assert (mesh.components, mesh.genus) == (1, 0)
    assert half.gray_range()[1] == pytest.approx(41, abs=0.1)


def test_an_empty_level_set_is_told(bw_model: Models) -> None:
    full = sub_gamut(bw_model(2), "full")
    with pytest.raises(GamutError, match=r"nothing\.on-pattern is empty"):
        level_set(full, "nothing", Margins(lambda XYZ: (np.full(len(XYZ), -1.0), np.zeros((len(XYZ), 3)))), 8.0)


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


@pytest.mark.parametrize("angle", [45, pytest.param(170, marks=pytest.mark.slow)])
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
    # A layer of 0.05 at the gamut's surface is not asked. Sagittas, and what is cut off a crease, go with the square of
    # the step: a quarter, of 6,000 colours some third.
    assert differing[1] < 0.05 + differing[0] / 2.5
    # So at the usual step of 2 less than 0.1 CIELAB units.
    assert differing[1] < 0.05 + 4 * 0.05
    # The node count's own error is the larger: its surface is known to half a step at random.
    assert mesh.mesh_volume == pytest.approx(mesh.volume, rel=0.02)
