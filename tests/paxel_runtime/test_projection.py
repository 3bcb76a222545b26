"""The recipe: every effect, its targets reached by x, and what lies outside the joint gamut moved into it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut, sub_gamut
from paxel_runtime.assembly import AssemblyOptions
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping import AdaptiveOptions, MappingOptions, map_to_subgamut
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import Lab_to_LCh, Lab_to_XYZ, LCh_to_Lab, XYZ_to_Lab
from paxel_runtime.model.effects import EFFECTS, Effect, Full, Neutralize
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.projection import make_projection, picture_surfaces

H, W = 24, 40
DITHER = AssemblyOptions(method="dither")


@pytest.fixture(scope="module")
def joint(bw_model: Callable[[int], PredictionModel]) -> JointGamut:
    return JointGamut(bw_model(3))


def _picture(seed: int) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    LCh = np.stack([rng.uniform(0, 100, (H, W)), rng.gamma(1.5, 15, (H, W)), rng.uniform(0, 360, (H, W))], axis=-1)
    return LCh_to_Lab(LCh).astype(np.float32)


PICTURES = {"image": _picture(0), "mark": _picture(1), "on_pattern": _picture(0), "on_white": _picture(2)}
LABELS = (np.indices((H, W)).sum(axis=0) % 3).astype(np.uint8)


@pytest.mark.parametrize("key", [key for key in EFFECTS if key != "monochrome"])
def test_every_effect_can_be_projected_and_x_meets_its_targets(key: str, joint: JointGamut) -> None:
    effect, model = EFFECTS[key](), joint.model
    sub_gamuts = {s: sub_gamut(joint, effect, s) for s in model.surfaces} if effect.in_sub_gamut else {}
    made = make_projection(effect, PICTURES, sub_gamuts, model, LABELS, pairs=joint.pairs, assembly=DITHER)
    assert made.codes.shape == (H, W, 3)
    assert np.ptp(made.codes) > 100
    assert made.figures["pixels_in_gamut"] == 1.0
    assert made.figures["dE00_max"] < 1e-3  # what mapping promises
    assert set(made.Lab) == ({"pattern"} if key == "full" else {"pattern", "white"})
    own = Lab_to_LCh(made.Lab["pattern"])
    if key == "hue-shift":
        partner = Lab_to_LCh(made.Lab["white"])
        turned = ((partner[..., 2] - own[..., 2]) % 360)[own[..., 1] > 5]
        assert turned.mean() == pytest.approx(45, abs=0.01)
        assert turned.std() < 0.01
    if key == "decolorize":
        assert np.abs(made.Lab["white"][..., 1:]).max() < 1e-4
    if key == "neutralize":
        assert np.ptp(made.Lab["white"], axis=(0, 1)).max() == 0


@pytest.mark.parametrize("surface", ["pattern", "white"])
@pytest.mark.parametrize("chroma", ["soft", "clip"])
def test_every_mapped_colour_is_met_by_the_inversion(surface: str, chroma: str, joint: JointGamut) -> None:
    Lab = np.concatenate([_picture(seed) for seed in range(5)])
    mapped = map_to_subgamut(Lab, sub_gamut(joint, "full", surface), MappingOptions(chroma)).Lab
    assert invert(mapped, None, joint.model.alone(surface)).dE_pattern.max() < 1e-3


def test_targets_outside_the_joint_gamut_are_moved_into_it_and_it_is_reported(joint: JointGamut) -> None:
    """A sub-gamut of another effect: the picture's colours cannot all hide."""
    model, full = joint.model, sub_gamut(joint, "full", "pattern")
    made = make_projection(Neutralize(), PICTURES, {"pattern": full}, model, LABELS, assembly=DITHER)
    moved = made.figures["targets_moved"]
    assert moved["pattern"]["pixels"] > 0.3
    assert moved["pattern"]["dE00_max"] > 1
    assert made.figures["pixels_in_gamut"] < 0.7
    shown = invert(made.Lab["pattern"], made.Lab["white"], model)
    # what x shows can be shown; float32 Lab, and the search for it ends at the boundary
    assert max(shown.dE_pattern.max(), shown.dE_white.max()) < 0.01  # type: ignore[union-attr]


def test_two_pictures_are_mapped_together_where_that_gains_contrast(joint: JointGamut) -> None:
    """Two ramps that rise together leave much of the joint gamut to each other."""
    effect, model = EFFECTS["dual-image"](), joint.model
    ramp = np.zeros((H, W, 3), np.float32)
    ramp[..., 0] = np.linspace(5, 95, W)
    pictures = {"on_pattern": ramp, "on_white": ramp}
    sub_gamuts = {s: sub_gamut(joint, effect, s) for s in model.surfaces}
    made = {
        adaptive: make_projection(
            effect, pictures, sub_gamuts, model, LABELS, pairs=joint.pairs, adaptive=adaptive, assembly=DITHER
        )
        for adaptive in (None, AdaptiveOptions(px_per_degree=10.0))
    }
    static, together = made.values()
    assert static.figures["mapping"]["method"] == "static"
    assert together.figures["mapping"]["method"] == "adaptive"
    assert "times that of static mapping" in together.figures["mapping"]["why"]
    assert together.figures["dE00_max"] < 1e-3  # every pair is in the joint gamut
    for surface in model.surfaces:
        ranges = [float(np.ptp(one.Lab[surface][..., 0])) for one in (static, together)]
        assert ranges[1] > 1.2 * ranges[0]
    with pytest.raises(InputError, match="joint gamut"):
        make_projection(effect, pictures, sub_gamuts, model, LABELS, adaptive=AdaptiveOptions(10.0), assembly=DITHER)


@pytest.mark.slow  # compiles the solver of image-based models
def test_under_half_the_light_the_picture_is_half_as_bright_and_x_is_the_same(joint: JointGamut) -> None:
    """An image-based model of one A everywhere, but half of it on the right: the same x, the same codes."""
    model = joint.model
    light = np.where(np.arange(W) < W // 2, 1.0, 0.5)[None, :, None] * np.ones((H, 1, 1))

    def local(surface: SurfaceModel | None) -> SurfaceModel:
        assert surface is not None
        return SurfaceModel(light[..., None] * surface.A, light * surface.black)

    image_based = replace(model, pattern=local(model.pattern), white=local(model.white))
    sub_gamuts = {"pattern": sub_gamut(joint, "neutralize", "pattern")}
    plain, lit = (
        make_projection(Neutralize(), PICTURES, sub_gamuts, model, LABELS, local=one, assembly=DITHER)
        for one in (None, image_based)
    )
    np.testing.assert_allclose(plain.Lab["pattern"], lit.Lab["pattern"], atol=1e-3)  # float32, there and back
    x = [
        invert(lit.Lab["pattern"], lit.Lab["white"], model).x,
        invert(
            *(_dimmed(lit.Lab[s], light, model) for s in ("pattern", "white")),
            image_based,
        ).x,
    ]
    # the nearest x to 1/2 is the same; float32 Lab, and the image-based solver stops at 1e-6
    np.testing.assert_allclose(x[0], x[1], atol=2e-3)


def _dimmed(Lab: NDArray[np.float32], light: NDArray[np.float64], model: PredictionModel) -> NDArray[np.float64]:
    return np.asarray(XYZ_to_Lab(Lab_to_XYZ(Lab.astype(np.float64), model.white_point) * light, model.white_point))


def test_where_each_picture_is_shown() -> None:
    assert picture_surfaces(Full(), "white") == {"image": "white"}
    assert picture_surfaces(EFFECTS["watermark"](), "pattern") == {"image": "pattern"}
    assert picture_surfaces(EFFECTS["dual-image"](), "white") == {"on_pattern": "pattern", "on_white": "white"}


@pytest.mark.parametrize("effect", [EFFECTS["hue-shift"](), EFFECTS["dual-image"](), Neutralize()])
def test_one_surface_is_not_enough_and_the_error_says_for_what_it_is(effect: Effect, joint: JointGamut) -> None:
    model = joint.model.alone("pattern")
    with pytest.raises(InputError, match="which is enough for: full, monochrome"):
        make_projection(effect, PICTURES, {}, model, LABELS)


def test_pictures_that_are_missing_or_of_another_size(joint: JointGamut) -> None:
    with pytest.raises(InputError, match=r"needs the pictures image, mark; missing: \['mark'\]"):
        make_projection(EFFECTS["watermark"](), {"image": PICTURES["image"]}, {}, joint.model, LABELS)
    with pytest.raises(InputError, match="on the projector's raster"):
        make_projection(Full(), {"image": PICTURES["image"][1:]}, {}, joint.model, LABELS)
    with pytest.raises(InputError, match="needs the joint gamut"):
        make_projection(EFFECTS["hue-shift"](), PICTURES, {}, joint.model, LABELS)
