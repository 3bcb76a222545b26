"""The section on gamuts: figures equal to the records and to what the gamut side computes, whatever the model."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paxel_design.gamut import JointGamut
from paxel_design.gamut.meshes import exact_volume
from paxel_design.gamut.subgamuts import sub_gamut
from paxel_design.report.content import Chart, Heading, Paragraph, Scene, Section, Table, filled
from paxel_design.report.sections import gamut_sets
from paxel_design.report.sections.gamut_bodies import sub_gamuts
from paxel_design.report.sections.gamuts import section
from paxel_design.report.source import ReportSource
from paxel_design.stages.gamut import GamutRequest, make_gamut_of_model
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.model.effects import DualImage, Full, Neutralize, parse_effect
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.storage import read_npz

Models = Callable[[int], PredictionModel]
Check = Callable[[Section], None]


def _response(channels: int) -> ProjectorResponse:
    code = np.linspace(0, 1, 3)
    return ProjectorResponse((code,) * channels, (code**2.2,) * channels)


def _alone(model: PredictionModel) -> ReportSource:
    return ReportSource(model, Path("model.json"))


@pytest.fixture(scope="module", autouse=True)
def _coarse_level_sets() -> Iterator[None]:
    """Level sets on a coarse grid: their accuracy is tested where they are made."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gamut_sets, "_LEVEL_SET_STEP", 8.0)
        yield


@pytest.fixture(scope="module")
def of_model(bw_model: Models) -> Section:
    """Of a model.json alone: everything is computed."""
    return section(_alone(bw_model(2)))


def test_a_model_alone_has_everything(of_model: Section, check_section: Check, bw_model: Models) -> None:
    check_section(of_model)
    assert of_model.key == "gamut"
    headings = [block.text for block in of_model.blocks if isinstance(block, Heading)]
    assert headings == ["Volumes", "Full gamut", "Sub-gamuts", "Lightness that can be chosen freely",
                        "Hue that can be turned", "Two independent pictures: the product pair"]  # fmt: skip
    assert {block.name for block in of_model.blocks if isinstance(block, Chart)} == {"gamut-lightness", "gamut-hue"}
    quantities = of_model.quantities
    for effect in ("full", "decolorize:free", "neutralize:50,0,0", "dual-image", "full-change"):
        for surface in ("pattern", "white"):
            gamut = sub_gamut(bw_model(2), effect, surface)
            volume = quantities[f"gamut.{gamut.file_stem}.volume"]
            assert volume.unit == "CIELAB^3"
            assert volume.source.startswith("computed")
            # The same set on triangles half as long: `exact_volume` is right to 1 part in 10,000.
            assert volume.value == pytest.approx(exact_volume(gamut), rel=5e-4)
    assert not any("virtual bench" in str(block) for block in of_model.blocks)


def test_sets_lie_in_each_other(of_model: Section) -> None:
    value = {name: quantity.value for name, quantity in of_model.quantities.items()}
    for surface in ("pattern", "white"):
        volumes = [value[f"gamut.{name}.on-{surface}.volume"] for name in ("full", "hue-shift-45", "hue-shift-90")]
        assert volumes == sorted(volumes, reverse=True)
        assert value[f"gamut.full.on-{surface}.of_full"] == pytest.approx(100)
        assert value[f"gamut.full.on-{surface}.parts"] == 1
    assert value["gamut.hue-45.area_any"] > value["gamut.hue-90.area_any"] > value["gamut.hue-180.area_any"]
    assert value["gamut.hue-180.area_any"] > value["gamut.hue-180.area_all"]
    # An sRGB projector on white paper is sRGB, but for a black of 1/1000 that takes L* below 0.9 and its chroma.
    assert 97 < float(str(value["gamut.full.on-white.srgb_held"])) < 99
    assert value["gamut.full.on-white.inside_srgb"] == pytest.approx(100, abs=0.1)
    # On the pattern nothing is beyond it.
    assert value["gamut.full.on-pattern.inside_srgb"] == pytest.approx(100, abs=0.1)


def test_bodies_are_light_and_right(of_model: Section) -> None:
    scenes = [block for block in of_model.blocks if isinstance(block, Scene)]
    assert len(scenes) == 12  # six groups on two surfaces
    for scene in scenes:
        assert scene.bodies[0].mesh.mesh_volume == max(body.mesh.mesh_volume for body in scene.bodies)
        for body in scene.bodies:
            # What is drawn has the volume that is told: 2 %, of level sets counted on the coarse grid of these tests.
            assert body.mesh.mesh_volume == pytest.approx(body.mesh.volume, rel=2e-2)
    numbers = sum(3 * len(body.mesh.Lab) + 3 * len(body.mesh.faces) for scene in scenes for body in scene.bodies)
    assert numbers * 4 * 4 / 3 < 4e6  # bytes in base64, of 32-bit numbers


def test_records_are_quoted_and_only_what_is_missing_is_computed(
    projected_source: ReportSource, check_section: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gamut_sets, "_EFFECTS", (Full(), DualImage(), Neutralize()))
    found = section(projected_source)
    check_section(found)
    assert projected_source.installation is not None
    root = projected_source.installation.path
    followed = 0
    for name, quantity in found.quantities.items():
        match = re.fullmatch(r"(.+\.json)#/(.+?)( x 100)?", quantity.source)
        if match is None:
            assert quantity.source.startswith(("computed", "upper end", "the s", "from both")), name
            continue
        value = json.loads((root / match[1]).read_text())
        for key in match[2].split("/"):
            value = value[int(key)] if isinstance(value, list) else value[key]
        wanted = 100 * value if match[3] else tuple(value) if isinstance(value, list) else value
        assert quantity.value == wanted, name
        followed += 1
    assert followed > 12
    for stem in ("full.on-pattern", "neutralize-50_0_0.on-pattern", "dual-image.on-white"):
        assert found.quantities[f"gamut.{stem}.volume"].source == f"gamut/{stem}.json#/volume"
    assert found.quantities["gamut.full.on-white.volume"].source.startswith("computed")
    captions = [block.caption for block in found.blocks if isinstance(block, Chart | Scene | Table)]
    assert captions
    assert all(caption.endswith("(virtual bench).") for caption in captions)


def test_a_hue_shift_that_was_computed_before_is_shown_too(
    projected_source: ReportSource,
    projected_installation: Installation,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Any further record of gamut/ is shown, level sets from their files."""
    folder = tmp_path / "gamut"
    request = GamutRequest(step=8.0)
    made = make_gamut_of_model(
        projected_source.model_path, parse_effect("hue-shift:120"), "pattern", folder, request=request
    )
    elsewhere = Installation(tmp_path, projected_installation.settings)
    records = {f"gamut/{name}": record for name, record in made.items()}
    source = replace(projected_source, installation=elsewhere, records=records)
    monkeypatch.setattr(gamut_sets, "_EFFECTS", (Full(),))  # others take their time
    sets, missing = gamut_sets.colour_sets(source, JointGamut(source.model))
    assert not missing
    assert [one.name for one in sets] == ["full.on-pattern", "full.on-white", "hue-shift-120.on-pattern"]
    volume = sets[-1].figures.quantity("volume", "CIELAB^3")
    assert volume.value == made["hue-shift-120.on-pattern.json"]["volume"]
    assert volume.source == "gamut/hue-shift-120.on-pattern.json#/volume"
    # Simplified by 0.1 unit: the volume changes by less than that times the surface.
    exact = read_npz(folder / "hue-shift-120.on-pattern.npz")
    assert len(sets[-1].drawn.Lab) < len(exact["Lab"])
    record = made["hue-shift-120.on-pattern.json"]
    assert abs(sets[-1].drawn.mesh_volume - record["mesh_volume"]) < gamut_sets.DRAWN_DEVIATION * record["area"]
    scene = next(b for b in sub_gamuts(source, sets).blocks if isinstance(b, Scene))
    assert [body.label for body in scene.bodies[1:]] == ["Hue turned by 120° or more"]


def test_one_surface_under_srgb_light_is_srgb(check_section: Check) -> None:
    primaries = linear_sRGB_to_XYZ(np.eye(3)).T
    model = PredictionModel(
        ("red", "green", "blue"), ("white",), SurfaceModel(primaries, np.zeros(3)), None, D65_XYZ, _response(3)
    )
    found = section(_alone(model))
    check_section(found)
    value = {name: quantity.value for name, quantity in found.quantities.items()}
    assert value["gamut.full.on-pattern.volume"] == pytest.approx(820_300, rel=1e-3)  # design, section 8
    # 0.1 %: two meshes of the same set, whose sRGB matrices are rounded differently.
    assert value["gamut.full.on-pattern.srgb_held"] == pytest.approx(100, abs=0.1)
    assert value["gamut.full.on-pattern.inside_srgb"] == pytest.approx(100, abs=0.1)
    assert [verdict.judgement for verdict in found.verdicts] == ["good"]
    assert "other surface" not in " ".join(block.text for block in found.blocks if isinstance(block, Paragraph))


def test_one_channel_tells_what_limits_white(check_section: Check) -> None:
    inks = [colorant_library()[name].fluorescence for name in ("uv-red", "uv-green", "uv-blue")]
    A = np.column_stack([spectra_to_XYZ(ink.emission) for ink in inks if ink is not None])
    A = A * [0.2, 1.0, 1.0] / (A * [0.2, 1.0, 1.0])[1].sum()  # the red ink is weak, as the paper's
    names = ("uv-red", "uv-green", "uv-blue")
    model = PredictionModel(("uv",), names, SurfaceModel(A, np.zeros(3)), None, A.sum(axis=1), _response(1))
    found = section(_alone(model))
    check_section(found)
    told = " ".join(filled(b.text, found.quantities) for b in found.blocks if isinstance(b, Paragraph))
    assert found.quantities["gamut.primaries.D65.limiting"].value == "uv-red"
    assert "uv-red limits it" in told
    assert "Area shares are taken as equal" in told
    gain = found.quantities["gamut.primaries.D65.gain"].value
    assert isinstance(gain, float)
    assert gain > 20
    (chart,) = (block for block in found.blocks if isinstance(block, Chart))
    assert chart.name == "gamut-primaries"


def test_surfaces_that_share_no_grays_are_told_of_and_the_rest_is_shown(check_section: Check) -> None:
    """One cluster: both surfaces always show the same light, one only darker."""
    primaries = linear_sRGB_to_XYZ(np.eye(3)).T
    sides = SurfaceModel(0.5 * primaries, np.zeros(3)), SurfaceModel(primaries, np.zeros(3))
    model = PredictionModel(("red", "green", "blue"), ("gray",), *sides, D65_XYZ, _response(3))
    found = section(_alone(model))
    check_section(found)
    assert "gamut.lightness.missing" in found.quantities
    assert {f"gamut.dual-image.on-{surface}.missing" for surface in ("pattern", "white")} <= set(found.quantities)
    # Half of the light: L* and with it all of CIELAB shrink to the cube root of 1/2, near black apart.
    ratio = float(str(found.quantities["gamut.full.on-pattern.volume"].value)) / 820_300
    assert ratio == pytest.approx(0.5, abs=0.03)
