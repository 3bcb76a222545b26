"""RGB spaces against published volumes, and what bodies share; areas of hue and pictures beside them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from paxel_design.gamut import (
    JointGamut,
    coverage,
    gamut_mesh,
    hue_change_area,
    intersection,
    lightness_area,
    lightness_rectangle,
    product_pair,
    rgb_space,
    sub_gamut,
)
from paxel_design.gamut.figures import plane_mesh, write_hue_figure, write_lightness_figure
from paxel_design.gamut.meshes import exact_volume
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

Models = Callable[..., PredictionModel]


@pytest.mark.parametrize(("name", "volume"), [("srgb", 833_500), ("dci-p3", 1_175_000), ("rec2020", 1_856_000)])
def test_volumes_of_rgb_spaces_are_those_of_argyll_and_cielab_gamut_tools(name: str, volume: float) -> None:
    assert exact_volume(rgb_space(name, under_D50=True)) == pytest.approx(volume, rel=0.005)


def test_coverage_and_intersection() -> None:
    srgb, wide = gamut_mesh(rgb_space("srgb"), 8.0), gamut_mesh(rgb_space("rec2020"), 8.0)
    shared = intersection(srgb, wide)
    assert shared.mesh_volume == pytest.approx(srgb.mesh_volume, rel=0.01), "sRGB lies in Rec.2020 but for triangles"
    assert coverage(srgb, wide) == pytest.approx(srgb.mesh_volume / wide.mesh_volume, rel=0.01)
    assert coverage(wide, "srgb") > 0.99
    with pytest.raises(InputError, match="srgb, dci-p3, rec2020"):
        rgb_space("adobe")


def test_bodies_that_share_nothing(bw_model: Models) -> None:
    low = gamut_mesh(sub_gamut(bw_model(2), "dual-image", "pattern"))
    moved = replace(low, Lab=low.Lab + np.array([60.0, 0, 0]))
    assert coverage(moved, low) == 0.0
    with pytest.raises(GamutError, match="empty"):
        intersection(low, moved)


def test_rectangles_under_conditions(bw_model: Models) -> None:
    model = bw_model(2)
    joint = JointGamut(model)
    free = lightness_area(joint)
    assert free.L_same is None, "a pattern is always darker than the sheet"
    with pytest.raises(GamutError, match="gray sheet"):
        lightness_rectangle(joint, same_range=True)
    on_pattern, on_white = lightness_rectangle(joint, least_L_pattern=30)
    # 1e-6: the search ends at 1e-9 of the range.
    assert on_pattern[1] - on_pattern[0] == pytest.approx(30, abs=1e-6)
    area = 30 * (on_white[1] - on_white[0])
    assert 0 < area < np.prod([high - low for low, high in (free.L_pattern, free.L_white)])
    gray = Lab_to_XYZ([(L, 0.0, 0.0) for L in (*on_pattern, *on_white)], model.white_point)
    pairs = joint.slack(gray[[0, 0, 1, 1]], gray[[2, 3, 2, 3]])
    assert pairs.min() > -1e-7
    with pytest.raises(GamutError, match="90 on the white"):
        lightness_rectangle(joint, least_L_white=90)


def test_a_gray_sheet_has_a_range_in_common_and_no_longer_one_exists(bw_model: Models) -> None:
    model = bw_model(2)
    assert model.white is not None
    joint = JointGamut(replace(model, white=SurfaceModel(0.4 * model.white.A, 0.4 * model.white.black)))
    same = lightness_area(joint).L_same
    assert same is not None
    L = np.linspace(5, 70, 131)
    grays = np.asarray(Lab_to_XYZ(np.stack((L, 0 * L, 0 * L), axis=-1), model.white_point))
    inside = joint.contains(grays[:, None], grays[None])
    best = max(
        L[j] - L[i]
        for i in range(len(L))
        for j in range(i, len(L))
        if inside[i, i] and inside[i, j] and inside[j, i] and inside[j, j]
    )
    assert best <= same[1] - same[0] + 1e-9 < best + 2 * 0.5 + 1e-9, "the grid is half a unit wide"


def test_the_hue_area_is_what_the_joint_gamut_holds(bw_model: Models) -> None:
    model = bw_model(2)
    joint = JointGamut(model)
    lightness, area = lightness_area(joint), hue_change_area(joint, 180)
    assert 0 < area.area_all < area.area_any
    middle = [np.mean(lightness.L_pattern), np.mean(lightness.L_white)]
    for hue in range(0, 180, 20):
        a, b = area.polygon_all[hue]
        pattern = Lab_to_XYZ([middle[0], 0.99 * a, 0.99 * b], model.white_point)
        white = Lab_to_XYZ([middle[1], -0.99 * a, -0.99 * b], model.white_point)
        assert joint.contains(pattern, white)
        # Beyond 'any' no pair of the rectangle goes.
        a, b = 1.02 * area.polygon_any[hue]
        L_P, L_W = np.meshgrid(np.linspace(*lightness.L_pattern, 40), np.linspace(*lightness.L_white, 40))
        pattern = Lab_to_XYZ(np.stack((L_P, 0 * L_P + a, 0 * L_P + b), axis=-1), model.white_point)
        white = Lab_to_XYZ(np.stack((L_W, 0 * L_P - a, 0 * L_P - b), axis=-1), model.white_point)
        assert not np.any(joint.contains(pattern, white))
    assert hue_change_area(joint, 0.0).area_any > area.area_any, "not turning is easier"
    with pytest.raises(InputError, match="400"):
        hue_change_area(joint, 400)


def test_maximised_pairs_are_no_smaller_than_the_closure_and_products(measured_model: Models) -> None:
    joint = JointGamut(measured_model(2, 2))
    closure = product_pair(joint, "closure")
    for pair, aim in (
        ("volume", lambda sides: np.prod([exact_volume(s) for s in sides])),
        ("contrast", lambda sides: min(np.ptp(s.gray_range()) for s in sides)),
    ):
        sides = product_pair(joint, pair)
        assert aim(sides) >= aim(closure) * (1 - 1e-3), "the search compares volumes to a part in a thousand"
        assert all(side.effect == f"dual-image-{pair}" for side in sides)
    assert exact_volume(product_pair(joint)[0]) == exact_volume(closure[0]), "auto: the closure is even enough"
    with pytest.raises(InputError, match="auto, closure, volume, contrast"):
        product_pair(joint, "best")


def test_figures_and_plane_meshes(bw_model: Models, tmp_path: Path) -> None:
    joint = JointGamut(bw_model(2))
    lightness, hue = lightness_area(joint), hue_change_area(joint, 180)
    for polygon, size in ((lightness.polygon, lightness.area), (hue.polygon_any, hue.area_any)):
        vertices, faces = plane_mesh(polygon)
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
        assert areas.sum() == pytest.approx(size, rel=1e-9)
    write_lightness_figure(tmp_path / "lightness.png", {"": lightness})
    write_hue_figure(tmp_path / "hue.png", {"K = 2": hue})
    for name in ("lightness.png", "hue.png"):
        with Image.open(tmp_path / name) as picture:
            assert picture.size[0] > 700
            assert len(np.unique(np.asarray(picture.convert("L")))) > 20, "something is drawn"
