"""`paxel calibrate` on captures of a made-up scene: every kind of model, what is written, what is left as it was."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from paxel_design.commands.calibrate import _told
from paxel_runtime import load_model
from paxel_runtime.captures.acquisition import CaptureFolder
from paxel_runtime.captures.exposures import EXTRA_COUNT, Exposure, mask_pixels, plan_geometry, plan_readings
from paxel_runtime.captures.meter_positions import at_positions
from paxel_runtime.errors import CalibrationError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, WAVELENGTHS_NM
from paxel_runtime.model_image import load_image_model
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibration as calibration_stage
from paxel_runtime.stages.calibration import calibrate
from paxel_runtime.storage import read_image, read_json, write_json, write_tiff

RGB = ("red", "green", "blue")
W, H = 64, 48
LIGHT = np.exp(-(((WAVELENGTHS_NM - np.array([[620.0], [540.0], [460.0]])) / 25) ** 2))
INK = {"pattern": np.array([0.1, 0.8]), "white": np.array([1.0, 1.0])}
CLUSTER = np.arange(W)[None, :] // 2 % 2 * np.ones((H, 1), int)
FIELD = (1 - 0.3 * np.arange(W) / (W - 1))[None, :] * np.ones((H, 1))


def intensities(e: Exposure) -> np.ndarray:
    """(H, W, 3) linear light of a frame; 0.2 % black."""
    P = np.array(e.P)
    if e.mask:
        P_of_pixel = np.where(mask_pixels(e.mask, W, H)[..., None], P[0], P[1])
    else:
        P_of_pixel = P[CLUSTER] if e.clusters else np.broadcast_to(P[0], (H, W, 3))
    return P_of_pixel**2.2 + 0.002


def reading(e: Exposure) -> np.ndarray:
    """The mean over the field's middle, with channels that take light from each other."""
    x = np.array([[intensities(e)[i == CLUSTER][:, j].mean() for j in range(3)] for i in range(2)])
    x = x * (1 - 0.03 * (x.sum(axis=1, keepdims=True) - x))
    return np.einsum("i,ij,jw->w", INK[e.surface] / 2, x, LIGHT) * (1 - 0.05 * e.position)


def captures_of(installation: Installation) -> CaptureFolder:
    """What `paxel capture` would have left: pictures on disk (camera pixel = projector pixel), the rest in memory."""
    readings = plan_readings(RGB, (2,), bits=8, seed=0, surfaces=("pattern", "white"), extra=EXTRA_COUNT)
    plan = plan_geometry(RGB, (W, H)) + at_positions(readings, installation.settings.meter.positions, 2)
    folder = installation.folder("captures")
    folder.mkdir()
    for e in plan:
        if e.device == "camera" and (not e.light or e.light in ("white", "black")):
            on = np.full((H, W, 3), 0.002) + (e.light == "white") if e.light else intensities(e)
            seen = 30000 * on * INK[e.surface][CLUSTER][..., None] * FIELD[..., None]
            write_tiff(folder / f"{e.name}.tif", np.rint(seen.mean(axis=-1) if e.channel else seen).astype(np.uint16))
    for name in ("exposures.json", "complete.json"):
        write_json(folder / name, {})
    rows, columns = np.mgrid[:H, :W].astype(np.float32)
    return CaptureFolder(
        plan=plan,
        readings={e.name: reading(e) for e in plan if e.device == "meter"},
        camera_xy=dict.fromkeys(RGB, np.stack([columns, rows], axis=-1)),
        valid=np.ones((H, W), bool),
        nodal=INK["pattern"][CLUSTER][..., None].astype(np.float32) * np.ones(3, np.float32),
        labels={2: CLUSTER.astype(np.uint8)},
        facts={"bench": "a made-up scene", "registration": {}, "clusters": {"2": {"names": ["black", "white"]}}},
    )


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Installation]:
    def installation(positions: int = 1, **keys: str) -> Installation:
        small = {
            "projector.resolution": [W, H],
            "projector.width_mm": 16.0,
            "pattern.dot_size_mm": 0.5,
            "meter.aperture_mm": 8.0 if positions == 1 else 4.8,
            "meter.positions": positions,
            "clusters.count": 2,
        }
        settings = make_settings("bw-checkerboard", small | {f"model.{key}": value for key, value in keys.items()})
        made = Installation.create(tmp_path / "show", settings)
        captures = captures_of(made)
        monkeypatch.setattr(calibration_stage, "load_captures", lambda _: captures)
        return made

    return installation


@pytest.mark.parametrize("kind", ["spectral", "image"])
def test_positions_are_reported_and_a_light_that_falls_off_moves_no_color(
    make: Callable[..., Installation], kind: str
) -> None:
    """Every position has 5 % less light than the one before, and nothing else differs."""
    installation = make(positions=5, kind=kind, correction="off")
    assert calibrate(installation)["kind"] == kind
    told = _told(installation.path)
    first = next(i for i, line in enumerate(told) if line.startswith("5 positions of the meter"))
    assert "full white down to 80 % of the centre's" in told[first]
    assert [line.split()[0] for line in told[first + 2 : first + 4]] == ["pattern", "white"]
    assert any("the model is that of their mean" in line for line in told) == (kind == "spectral")
    positions = read_json(installation.folder("calibration") / "calibration.json")["positions"]
    assert positions["positions_mm"] == [[0, 0], [-4, 3], [4, 3], [4, -3], [-4, -3]]
    assert positions["white_percent"] == pytest.approx([100, 95, 90, 85, 80])
    for surface in ("pattern", "white"):
        spread = positions["surfaces"][surface]
        assert spread["as_read"]["dE00_mean"] > 0.5
        assert spread["local_white"]["dE00_max"] < 1e-6  # rounding


def test_a_corrected_model_is_written_and_predicts(make: Callable[..., Installation]) -> None:
    installation = make()
    accuracy = calibrate(installation)
    folder = installation.folder("calibration")
    on_disk = read_json(folder / "accuracy.json")
    assert {k: v for k, v in on_disk.items() if k != "writer"} == accuracy
    assert accuracy["n"] == 100
    assert (accuracy["model"], accuracy["kind"]) == ("corrected", "spectral")
    for surface in ("pattern", "white"):
        assert accuracy[surface]["dE00_mean"] < 0.1 * accuracy["linear"][surface]["dE00_mean"]  # no noise here
        assert set(accuracy["by_input"][surface]["per_cluster"]) == {"black", "white"}
    model = load_model(folder / "model.json")
    assert model.correction is not None
    # inside the law: all channels at full lose 6 % against the sum of single channels
    white = model.predict_XYZ(np.ones(6))[1]
    assert white is not None
    assert white[1] == pytest.approx(1.0, abs=0.003)
    assert model.linear.predict_XYZ(np.ones(6))[1][1] > 1.01  # type: ignore[index]
    assert read_image(folder / "accuracy.png").shape[2] == 3


def test_without_a_correction_the_model_is_linear(make: Callable[..., Installation]) -> None:
    installation = make(correction="off")
    accuracy = calibrate(installation)
    assert accuracy["model"] == "linear"
    assert "extra_readings" not in accuracy
    assert accuracy["pattern"] == accuracy["linear"]["pattern"]
    assert load_model(installation.folder("calibration") / "model.json").correction is None


def test_an_image_based_model_stands_beside_its_median(make: Callable[..., Installation]) -> None:
    installation = make(kind="image", correction="off")
    accuracy = calibrate(installation)
    assert (accuracy["model"], accuracy["kind"]) == ("linear", "image")
    folder = installation.folder("calibration")
    median, image = load_model(folder / "model.json"), load_image_model(folder)
    assert image.pattern.A.shape == (H, W, 3, 6)
    assert read_json(folder / "model.json")["image"] == "model-image"
    for name, surface in image.surfaces.items():
        middle = np.asarray(surface.A[H // 2, W // 2], float)
        # the middle of a straight fall-off is its median; 2 %: rounded pictures, clusters of two columns
        assert middle == pytest.approx(median.surfaces[name].A, rel=0.02, abs=1e-4)
        left, right = (float(surface.A[H // 2, column, 1].sum()) for column in (12, W - 13))
        assert right / left == pytest.approx((1 - 0.3 * (W - 13) / (W - 1)) / (1 - 0.3 * 12 / (W - 1)), rel=0.02)


def test_a_camera_taken_for_sRGB_is_tested_as_such(make: Callable[..., Installation]) -> None:
    installation = make(kind="image", correction="off", camera_to_XYZ="sRGB")
    accuracy = calibrate(installation)
    model = load_model(installation.folder("calibration") / "model.json")
    assert model.white_point == pytest.approx(D65_XYZ, rel=1e-3)
    assert accuracy["white"]["dE00_mean"] > 2.0  # these primaries are not sRGB's


def test_an_error_leaves_the_stage_as_it_was(make: Callable[..., Installation]) -> None:
    installation = make(kind="image")
    calibrate(installation)
    before = {p.name: p.stat().st_mtime_ns for p in installation.folder("calibration").rglob("*")}
    picture = installation.folder("captures") / "cluster-white-K2-1-blue.tif"
    write_tiff(picture, np.zeros((H, W), np.uint16))
    for name in ("cluster-white-K2-0-blue", "white-full-blue"):
        write_tiff(picture.with_name(f"{name}.tif"), np.zeros((H, W), np.uint16))
    with pytest.raises(CalibrationError, match="the camera sees no blue light"):
        calibrate(installation)
    assert before == {p.name: p.stat().st_mtime_ns for p in installation.folder("calibration").rglob("*")}
    assert not list(installation.path.glob(".calibration*"))
