"""A small finished installation whose model is read off the bench itself, and what every section has to keep."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_design.report.content import (
    Bullets,
    Chart,
    Heading,
    Paragraph,
    Pictures,
    Scene,
    Section,
    Table,
    Verdicts,
    filled,
)
from paxel_design.report.source import ReportSource
from paxel_design.stages.gamut import GamutRequest, make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_design.stages.projection import make_previews
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import DualImage, Full, Neutralize
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import open_bench, project
from paxel_runtime.storage import load_model, model_to_dict, read_json, write_image, write_json

W, H = 240, 135
SETTINGS = {
    "projector.resolution": [W, H],
    "projector.width_mm": 35.1,
    "pattern.size_mm": [50.0, 40.0],
    "camera.resolution": [320, 240],
    "meter.aperture_mm": 10.0,
    "clusters.count": 2,
    "bench.quality": "ideal",
    "mapping.method": "static",
    "viewing.distance_mm": 4000.0,
}


@pytest.fixture(scope="session")
def projected_installation(
    tmp_path_factory: pytest.TempPathFactory,
    model_off_the_bench: Callable[[Installation, NDArray[np.uint8]], PredictionModel],
) -> Installation:
    """Everything from print to preview: projections ``dual-image``, ``hidden 1`` and ``free``; nobody changes it."""
    installation = Installation.create(
        tmp_path_factory.mktemp("sections") / "show", make_settings("bw-checkerboard", SETTINGS)
    )
    make_print(installation)
    bench = open_bench(installation)
    labels = (bench.truth.coverage()[..., 0] < 0.5).astype(np.uint8)
    for name in ("captures", "calibration"):
        installation.folder(name).mkdir()
    model = model_to_dict(model_off_the_bench(installation, labels))
    write_json(installation.folder("calibration") / "model.json", model)
    write_image(installation.folder("calibration") / "clusters.png", labels)
    write_json(installation.folder("captures") / "complete.json", {})
    for stage, file in (("captures", "exposures.json"), ("calibration", "calibration.json")):
        write_json(installation.folder(stage) / file, {"inputs": installation.inputs(stage)})
    make_gamut(installation, DualImage(), "pattern", request=GamutRequest(further=(Neutralize(), Full())))
    pictures = [installation.path / f"{name}.png" for name in ("a", "b")]
    for seed, path in enumerate(pictures):
        write_image(path, _colourful(seed))
    project(installation, DualImage(), dict(zip(("on_pattern", "on_white"), pictures, strict=True)))
    project(installation, Neutralize(), {"image": pictures[0]}, name="hidden 1")
    project(installation, Full(), {"image": pictures[1]}, name="free")
    make_previews(installation, [], False)
    return installation


def _colourful(seed: int) -> NDArray[np.uint8]:
    """A picture of soft blobs in the colours of a screen, as detailed as a photograph."""
    noise = np.random.default_rng(seed).normal(size=(H, W, 3))
    picture = gaussian_filter(noise, (6, 6, 0), mode="wrap") + 0.3 * gaussian_filter(noise, (2, 2, 0), mode="wrap")
    return np.rint(255 * (picture - picture.min()) / np.ptp(picture)).astype(np.uint8)


@pytest.fixture(scope="session")
def projected_source(projected_installation: Installation) -> ReportSource:
    """What its report is made from."""
    path = projected_installation.path
    records = {
        f"{stage}/{file.name}": read_json(file)
        for stage in ("gamut", "projection", "preview")
        for file in sorted((path / stage).glob("*.json"))
    }
    model = path / "calibration" / "model.json"
    return ReportSource(load_model(model), model, "virtual bench, ideal", projected_installation, records)


@pytest.fixture(scope="session")
def check_section() -> Callable[[Section], None]:
    """What holds of any section: its texts name quantities that are there, its anchors differ, its tables are even."""

    def texts_of(section: Section) -> list[str]:
        texts: list[str] = []
        for block in section.blocks:
            match block:
                case Heading(text) | Paragraph(text):
                    texts.append(text)
                case Bullets(items):
                    texts += items
                case Table(_, caption, header, rows):
                    assert all(len(row) == len(header) for row in rows), caption
                    texts += [caption, *header, *(cell for row in rows for cell in row)]
                case Pictures(_, caption, pictures):
                    assert pictures
                    texts += [caption, *(t for p in pictures for t in (p.label, p.note))]
                    for one in pictures:
                        assert one.picture.dtype == np.uint8
                        assert one.picture.ndim == 3
                        assert one.picture.shape[1] <= 900
                case _:
                    texts.append(block.caption)
        return texts

    def check(section: Section) -> None:
        anchors = [b.name for b in section.blocks if isinstance(b, Table | Chart | Pictures | Scene | Verdicts)]
        assert len(set(anchors)) == len(anchors)
        for text in texts_of(section):
            told = filled(text, section.quantities)
            assert "{" not in told, told
            assert "nan" not in told.split(), told
        assert all(name.startswith(f"{section.key}.") for name in section.quantities)
        assert all(quantity.source for quantity in section.quantities.values())
        assert all(verdict.quantity in section.quantities for verdict in section.verdicts)

    return check
