"""The image-based model on disk: what is written is read, float16 is enough, 4K stays small, and damage is named."""

import json
import subprocess
import sys
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numba
import numpy as np
import pytest

from paxel_runtime.calibration import Fields
from paxel_runtime.errors import InputError
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.model_image import load_image_model, median_model, write_model_image
from paxel_runtime.storage import model_to_dict, write_json

H, W, n = 30, 40, 6


def spectral(n: int = n) -> PredictionModel:
    rng = np.random.default_rng(0)
    surfaces = [SurfaceModel(rng.uniform(0.01, 0.4, (3, n)), np.full(3, 1e-3)) for _ in range(2)]
    code = np.linspace(0, 1, 5)
    names = tuple("ab" if n == 6 else "abc")
    return PredictionModel(("r", "g", "b"), names, *surfaces, D65_XYZ, ProjectorResponse((code,) * 3, (code,) * 3))


def fields_of(model: PredictionModel, shape: tuple[int, int] = (H, W)) -> Iterator[Fields]:
    """The model's A under a fall-off to the right."""
    field = np.linspace(1.0, 0.5, shape[1], dtype=np.float32)[None, :, None] * np.ones((shape[0], 1, 1), np.float32)
    for name, surface in model.surfaces.items():
        for k in range(model.n):
            yield Fields(name, k, field * surface.A[:, k].astype(np.float32))
        yield Fields(name, None, field * surface.black.astype(np.float32))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    model = spectral()
    write_model_image(tmp_path, fields_of(model), n)
    median = median_model(model, tmp_path, np.ones((H, W), bool))
    write_json(tmp_path / "model.json", model_to_dict(median) | {"image": "model-image"})
    return tmp_path


def test_what_is_written_is_read_back(folder: Path) -> None:
    model, source = load_image_model(folder), spectral()
    assert isinstance(model.pattern.A, np.memmap)
    assert model.pattern.A.shape == (H, W, 3, n)
    x = np.random.default_rng(1).random(n)
    for place, column in ((0, 0), (1, W - 1)):
        share = 1.0 if place == 0 else 0.5
        for name, surface in model.at((5, column)).surfaces.items():
            expected = share * source.surfaces[name].predict_XYZ(x)
            error = dE00(XYZ_to_Lab(expected, D65_XYZ), XYZ_to_Lab(surface.predict_XYZ(x), D65_XYZ))
            assert error < 0.03  # 11 bits of each of 7 terms
    tile = model.at((slice(0, 4), slice(None)))
    Lab_pattern, Lab_white = tile.predict(np.broadcast_to(x, (4, W, n)))
    assert Lab_pattern.shape == (4, W, 3)
    assert Lab_white is not None
    assert np.all(np.diff(Lab_white[0, :, 0]) < 0)  # darker to the right


def test_the_median_is_the_middle_of_the_field(folder: Path) -> None:
    model = spectral()
    inside = np.zeros((H, W), bool)
    inside[:, 10:31] = True  # odd: the middle column is the median
    median = median_model(model, folder, inside)
    middle = np.linspace(1.0, 0.5, W)[20]
    for name, surface in median.surfaces.items():
        assert pytest.approx(middle * model.surfaces[name].A, rel=2**-10) == surface.A
        assert surface.black == pytest.approx(middle * model.surfaces[name].black, rel=2**-10)


def test_a_spectral_model_is_told_apart(tmp_path: Path) -> None:
    write_json(tmp_path / "model.json", model_to_dict(spectral()))
    with pytest.raises(InputError, match='has no "image": it is a spectral model'):
        load_image_model(tmp_path / "model.json")


def test_files_that_do_not_fit_are_named(folder: Path) -> None:
    path = folder / "model-image" / "white.npy"
    np.save(path, np.zeros((H, W, 3, 9), np.float16))
    with pytest.raises(InputError, match=r"white.npy must be \(H, W, 3, 6\) float16, got \(30, 40, 3, 9\)"):
        load_image_model(folder)
    np.save(path, np.zeros((H, W + 1, 3, 6), np.float16))
    with pytest.raises(InputError, match="must be of one size"):
        load_image_model(folder)
    path.write_bytes(b"no array")
    with pytest.raises(InputError, match=r"white\.npy is damaged"):
        load_image_model(folder)
    path.unlink()
    with pytest.raises(InputError, match=r"white\.npy is missing; make it with: paxel calibrate --force"):
        load_image_model(folder)


def test_a_path_out_of_the_folder_is_refused(folder: Path) -> None:
    data = json.loads((folder / "model.json").read_text(encoding="utf-8")) | {"image": "../elsewhere"}
    write_json(folder / "model.json", data)
    with pytest.raises(InputError, match='has no "image"'):
        load_image_model(folder)


@pytest.mark.slow
def test_4K_is_built_and_used_below_2_GB(tmp_path: Path) -> None:
    """12-megapixel captures, K = 2, both surfaces; peak resident memory of a process of its own."""
    program = f"""
import resource
from pathlib import Path
import numpy as np
from paxel_runtime.calibration import NodalImages, camera_to_XYZ, image_fields, kernel_sigma_px, spot_of_meter
from paxel_runtime.captures.exposures import plan_readings
from paxel_runtime.model_image import load_image_model, median_model, write_model_image
from paxel_runtime.storage import model_to_dict, write_json
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_model_image import spectral
H, W = 2160, 3840
plan = tuple(plan_readings(("r", "g", "b"), (2,), bits=8, seed=0, surfaces=("pattern", "white")))
rng = np.random.default_rng(0)
picture = rng.integers(900, 40000, (3000, 4000)).astype(np.uint16)
dark = np.full((3000, 4000), 60, np.uint16)
table = np.stack(np.meshgrid(np.linspace(5, 3990, W), np.linspace(5, 2990, H)), axis=-1).astype(np.float32)
captures = lambda name: dark.copy() if "dark" in name or "black" in name else picture.copy()
inside = np.ones((H, W), bool)
images = NodalImages(captures, plan, ("r", "g", "b"), ("a", "b"), {{c: table.copy() for c in "rgb"}}, inside)
conversion = camera_to_XYZ(images, "readings", spot_of_meter((H, W), 270.0), spectral())
folder = Path({str(tmp_path)!r})
write_model_image(folder, image_fields(images, conversion, kernel_sigma_px(10.0, 2)), 6)
median = median_model(spectral(), folder, inside)
write_json(folder / "model.json", model_to_dict(median) | {{"image": "model-image"}})
model = load_image_model(folder)
x = rng.random((64, W, 6), np.float32)
for start in range(0, H, 64):
    rows = slice(start, min(start + 64, H))
    model.at((rows, slice(None))).predict(x[: rows.stop - rows.start])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert int(result.stdout) < 2e6  # kB


def test_the_inversion_holds_a_few_tiles_of_the_model_at_a_time(tmp_path: Path) -> None:
    """What it allocates for the equations does not grow with the picture; as float64 they were 110 MB here."""
    shape, model = (400, 800), spectral()
    write_model_image(tmp_path, fields_of(model, shape), n)
    median = median_model(model, tmp_path, np.ones(shape, bool))
    write_json(tmp_path / "model.json", model_to_dict(median) | {"image": "model-image"})
    local = load_image_model(tmp_path)
    wanted = [np.empty((*shape, 3), np.float32) for _ in range(2)]
    for name, Lab in zip(("pattern", "white"), wanted, strict=True):
        Lab[:] = XYZ_to_Lab(local.at((0, shape[1] // 2)).surfaces[name].predict_XYZ(np.full(n, 0.5)), D65_XYZ)
    tile = (slice(0, 4), slice(0, 4))
    invert(wanted[0][tile], wanted[1][tile], local.at(tile))  # compiling allocates, too
    tracemalloc.start()
    result = invert(wanted[0], wanted[1], local)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    answer = sum(part.nbytes for part in (result.x, result.dE_pattern, result.dE_white, result.status))
    threads = numba.config.NUMBA_NUM_THREADS
    # a chunk is 16,384 pixels: 288 bytes each as equations, and about as much again on the way
    assert peak - answer < 5e6 + threads * 16384 * 288 * 3
    middle = invert(wanted[0][5, 400], wanted[1][5, 400], local.at((5, 400)))
    np.testing.assert_allclose(result.x[5, 400], middle.x, atol=1e-6)  # tiles do not show
