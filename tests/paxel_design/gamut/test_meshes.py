"""Meshes against analytic truth: boxes, published volumes of RGB spaces, and the topology of a sphere."""

import contextlib
from collections.abc import Callable

import manifold3d
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from paxel_design.gamut import (
    GamutMesh,
    JointGamut,
    gamut_mesh,
    product_pair,
    sub_gamut,
    subgamut_arrays,
    subgamut_figures,
)
from paxel_design.gamut.meshes import exact_volume, simplified_mesh
from paxel_design.gamut.polytopes import hull_surface, polytope
from paxel_design.gamut.tessellation import tessellate
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_Lab
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SubGamut

Models = Callable[..., PredictionModel]
BOX = np.concatenate((np.eye(3), -np.eye(3)))
D50_XYZ = np.array([0.9642, 1.0, 0.8249])  # ICC.1:2022, section 7.2.16
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def box(low: NDArray[np.float64], high: NDArray[np.float64], white: NDArray[np.float64] = D65_XYZ) -> SubGamut:
    return SubGamut("full", "pattern", BOX, np.concatenate((high, -low)), white)


def cube_root_of_light(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """f of CIELAB (CIE 15:2018, section 8.2.1)."""
    return np.where(t > (6 / 29) ** 3, np.cbrt(t), t * (29 / 6) ** 2 / 3 + 4 / 29)


def assert_closed(mesh: GamutMesh) -> None:
    """Each edge is used once in each direction, one part, no handle: said by counting, not by manifold3d."""
    halves = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    key = halves[:, 0] * len(mesh.Lab) + halves[:, 1]
    assert len(np.unique(key)) == len(key)
    np.testing.assert_array_equal(np.sort(key), np.sort(halves[:, 1] * len(mesh.Lab) + halves[:, 0]))
    assert len(mesh.Lab) - len(key) // 2 + len(mesh.faces) == 2
    assert (mesh.components, mesh.genus) == (1, 0)
    assert len(np.unique(mesh.Lab.astype(np.float32), axis=0)) == len(mesh.Lab), "32 bits tell all vertices apart"
    a, b, c = np.moveaxis(mesh.Lab[mesh.faces], 1, 0)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(mesh.mesh_volume, rel=1e-6), "outwards"
    # The mesh of a curved surface with edges of 4 units: an eighth of edge^2 x curvature, over the thickness.
    assert mesh.mesh_volume == pytest.approx(mesh.volume, rel=0.01)


@pytest.mark.parametrize(
    ("low", "high"),
    [((0.2, 0.2, 0.2), (0.9, 0.9, 0.9)), ((0.0, 0.0, 0.0), (0.03, 0.03, 0.03)), ((0.0, 0.1, 0.4), (0.3, 0.12, 0.8))],
)
def test_a_box_in_XYZ_has_a_volume_in_closed_form(low: tuple[float, ...], high: tuple[float, ...]) -> None:
    """CIELAB is a linear map of determinant 116 x 500 x 200 after f on each of X, Y, Z."""
    t = np.array([low, high])
    mesh = gamut_mesh(box(*(t * D65_XYZ)))
    expected = 116 * 500 * 200 * np.prod(np.diff(cube_root_of_light(t), axis=0))
    assert_closed(mesh)
    # 2e-4: edges that cross the join of the two branches of f, where its second derivative jumps.
    assert mesh.volume == pytest.approx(expected, rel=2e-4)
    assert exact_volume(box(*(t * D65_XYZ))) == pytest.approx(expected, rel=1e-3)


def rgb_space(red: tuple, green: tuple, blue: tuple, white: tuple) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """XYZ of the primaries (columns) and of the white of an RGB space, from chromaticities."""

    def XYZ(x: float, y: float) -> NDArray[np.float64]:
        return np.array([x / y, 1.0, (1 - x - y) / y])

    primaries, white_XYZ = np.column_stack([XYZ(*xy) for xy in (red, green, blue)]), XYZ(*white)
    return primaries * np.linalg.solve(primaries, white_XYZ), white_XYZ


SRGB = rgb_space((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
DCI_P3 = rgb_space((0.680, 0.320), (0.265, 0.690), (0.150, 0.060), (0.314, 0.351))
REC_2020 = rgb_space((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), (0.3127, 0.3290))


@pytest.mark.parametrize(
    ("space", "adapted", "published"),
    [(SRGB, True, 833_500), (DCI_P3, True, 1_175_000), (REC_2020, True, 1_856_000), (SRGB, False, 820_300)],
    ids=["sRGB D50", "DCI-P3 D50", "Rec.2020 D50", "sRGB D65"],
)
def test_rgb_spaces_have_their_known_volumes(
    space: tuple[NDArray[np.float64], NDArray[np.float64]], adapted: bool, published: float, model_of: Models
) -> None:
    primaries, white = space
    if adapted:
        to_D50 = np.linalg.inv(BRADFORD) @ np.diag(BRADFORD @ D50_XYZ / (BRADFORD @ white)) @ BRADFORD
        primaries, white = to_D50 @ primaries, D50_XYZ
    full = sub_gamut(model_of(primaries, None, 1, black=0.0), "full")
    mesh = gamut_mesh(SubGamut("full", "pattern", full.normals, full.offsets, white))
    assert_closed(mesh)
    # 0.5 %: what tessellations of these solids differ by (ISO/TS 18621-11 and Argyll's viewgam).
    assert mesh.volume == pytest.approx(published, rel=0.005)
    assert mesh.mesh_volume == pytest.approx(mesh.volume, rel=1e-4)


def test_a_finer_mesh_comes_nearer_to_the_exact_volume_and_area(bw_model: Models) -> None:
    gamut = sub_gamut(bw_model(2), "neutralize")
    meshes = [gamut_mesh(gamut, edge) for edge in (8.0, 4.0, 2.0)]
    errors = [abs(mesh.mesh_volume - meshes[-1].volume) for mesh in meshes]
    assert errors[2] < errors[1] / 2 < errors[0] / 4, "the error falls with the square of the edge, 4 times a halving"
    for mesh in meshes:
        # 1e-4: quadrature of degree 2 on edges of 8 units.
        assert mesh.volume == pytest.approx(meshes[-1].volume, rel=1e-4)
        assert mesh.area == pytest.approx(meshes[-1].area, rel=1e-4)
    a, b, c = np.moveaxis(meshes[-1].Lab[meshes[-1].faces], 1, 0)
    flat_area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert meshes[-1].area == pytest.approx(flat_area, rel=1e-3), "of the flat triangles, to the same order"


def test_the_split_is_short_conforming_and_stays_on_the_facets(bw_model: Models) -> None:
    gamut = sub_gamut(bw_model(3), "dual-image", "white")
    surface = hull_surface(polytope(gamut.normals, gamut.offsets).vertices)
    XYZ, faces = tessellate(*surface, D65_XYZ, 3.0)
    Lab = XYZ_to_Lab(XYZ, D65_XYZ)
    assert np.linalg.norm(Lab[faces] - Lab[np.roll(faces, 1, axis=1)], axis=-1).max() <= 3.0
    np.testing.assert_array_equal(XYZ[: len(surface[0])], surface[0])
    assert np.abs(gamut.slack(XYZ)).max() < 1e-12, "every vertex is on the exact surface, to rounding"
    assert_closed(gamut_mesh(gamut, 3.0))


@settings(deadline=None, max_examples=4, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32 - 1), st.floats(-13, -1), st.sampled_from([(2, False), (3, False), (3, True), (4, True)]))
def test_meshes_of_any_print_are_closed(
    measured_model: Models, seed: int, error: float, kind: tuple[int, bool]
) -> None:
    """From generators that are parallel to rounding, over slivers, to general position."""
    clusters, colored = kind
    joint = JointGamut(measured_model(seed, clusters, colored=colored, noise=10**error))
    gamuts = [sub_gamut(joint, "full", "pattern")]
    with contextlib.suppress(GamutError):  # wild errors may leave no common grays, or none of L* 50
        gamuts += [*product_pair(joint), sub_gamut(joint, "neutralize", "pattern")]
    for gamut in gamuts:
        assert_closed(gamut_mesh(gamut, 8.0))


@pytest.mark.parametrize("shown_on", ["pattern", "white"])
def test_sub_gamuts_lie_inside_the_full_gamut(bw_model: Models, shown_on: str) -> None:
    joint = JointGamut(bw_model(3))
    solids = {}
    for effect in ("full", "dual-image", "neutralize"):
        mesh = gamut_mesh(sub_gamut(joint, effect, shown_on))
        solids[effect] = manifold3d.Manifold(manifold3d.Mesh64(mesh.Lab, mesh.faces.astype(np.uint64)))
    for effect in ("dual-image", "neutralize"):
        outside = (solids[effect] - solids["full"]).volume()
        # Flat triangles cut what is curved: 4 units wide, 0.05 deep, along the faces both sets share.
        assert outside < 0.005 * solids[effect].volume()


def test_a_small_and_a_thin_set_have_their_volume() -> None:
    gray = 0.3 * D65_XYZ
    for size in ((1e-3, 1e-3, 1e-3), (0.2, 1e-4, 0.2)):
        half = np.array(size) / 2 * D65_XYZ
        mesh = gamut_mesh(box(gray - half, gray + half))
        t = (0.3 + np.array([-1, 1])[:, None] * np.array(size) / 2).reshape(2, 3)
        # 1e-3: corners within a thousandth of a unit are one.
        assert mesh.volume == pytest.approx(116e5 * np.prod(np.diff(np.cbrt(t), axis=0)), rel=1e-3)
        assert mesh.mesh_volume == pytest.approx(mesh.volume, rel=0.01)


def test_a_flat_set_has_no_mesh_and_says_so(model_of: Models) -> None:
    flat = sub_gamut(model_of(np.array([[0.3, 0.1], [0.2, 0.4], [0.1, 0.3]]), None, 2), "full")
    with pytest.raises(GamutError, match=r"full\.on-pattern has no mesh: the set is flat"):
        gamut_mesh(flat)
    with pytest.raises(GamutError, match=r"full\.on-pattern has no mesh: the set is empty"):
        gamut_mesh(box(np.full(3, 0.5), np.full(3, 0.4)))


def test_figures_and_arrays_are_those_of_the_files(bw_model: Models) -> None:
    gamut = sub_gamut(bw_model(2), "neutralize", "white")
    mesh = gamut_mesh(gamut)
    figures = subgamut_figures(gamut, mesh)
    assert {"effect", "shown_on", "volume", "mesh_volume", "area", "watertight", "components", "mesh", "method"} <= set(
        figures
    )
    assert (figures["effect"], figures["shown_on"]) == ("neutralize-50_0_0", "white")
    assert figures["mesh"] == "neutralize-50_0_0.on-white.ply"
    arrays = subgamut_arrays(gamut, mesh)
    again = SubGamut(
        str(arrays["effect"]), str(arrays["shown_on"]), arrays["normals"], arrays["offsets"], arrays["white_point"]
    )
    np.testing.assert_array_equal(again.slack(D65_XYZ / 5), gamut.slack(D65_XYZ / 5))
    np.testing.assert_array_equal(arrays["Lab"][arrays["faces"]], mesh.Lab[mesh.faces])


def test_a_simplified_body_keeps_its_volume_and_its_surface(bw_model: Models) -> None:
    mesh = gamut_mesh(sub_gamut(bw_model(2), "neutralize:50,0,0"))
    for deviation in (0.1, 0.5):
        simple = simplified_mesh(mesh, deviation)
        assert len(simple.faces) < len(mesh.faces) / 4
        assert (simple.volume, simple.volume_error) == (mesh.volume, mesh.volume_error)
        # No point moves farther than that: neither does the volume, by more than the surface times as much ...
        assert abs(simple.mesh_volume - mesh.mesh_volume) < deviation * mesh.area
        # ... and corners stay where they are.
        assert np.max(cKDTree(mesh.Lab).query(simple.Lab)[0]) < 1e-6
        assert (simple.components, simple.genus) == (1, 0)
    with pytest.raises(GamutError, match="empty"):
        simplified_mesh(mesh, 1000.0)
