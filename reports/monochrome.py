"""Colour from one channel on the virtual bench: the paper's Table II, Fig. 9 and Fig. 10, and what it costs in time.

Ultraviolet light on the built-in fluorescent inks, white light on printed red, green and blue, and, where PAXEL_DATA
names the folder of measured data, ultraviolet on three measured materials. Each installation is demonstrated from print
to preview; three photographs are projected; the ultraviolet gamut stands in one picture with that of the video
projector on white paper, under the latter's white and with equal luminance. Figures go to
reports/reference/monochrome.json, the photographs beside their projection images (Fig. 9) to monochrome.jpg, the gamuts
(Fig. 10) to monochrome_gamut.png.

Run from a checkout (ten minutes; ``--small``: 480 x 270, five)::

    PAXEL_DATA=<folder> python -m reports.monochrome FOLDER [--small]
"""

from __future__ import annotations

import argparse
import json
import os
import time
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_design.contact_sheet import Group, Tile, write_contact_sheet
from paxel_design.demo import run_demo
from paxel_design.gamut import JointGamut, subgamut_and_mesh
from paxel_design.gamut.primaries import primaries_figures
from paxel_design.gamut.scenes import SceneBody, write_scene
from paxel_design.stages.projection import make_previews, make_projection_stage
from paxel_runtime.assembly import AssemblyOptions, assemble
from paxel_runtime.frame_files import write_frame
from paxel_runtime.gamut_mapping import map_to_subgamut
from paxel_runtime.installation import Installation
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.effects import Full, Monochrome
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.optics.spectra import primaries
from paxel_runtime.pictures import load_picture
from paxel_runtime.settings import DEMO_OVERRIDES
from paxel_runtime.stages import load_sub_gamut
from paxel_runtime.storage import load_model, read_image, read_json

RESULT = Path(__file__).parent / "reference" / "monochrome.json"
PHOTOGRAPHS = ("astronaut.png", "coffee.png", "chelsea.png")
SMALL = {
    "projector.resolution": [480, 270],
    "projector.width_mm": 70.3,
    "pattern.size_mm": [80.0, 50.0],
    "camera.resolution": [1024, 768],
}
MEASURED = {"uv-red": "HERPICER", "uv-green": "IXCRLALE", "uv-blue": "CIBA12"}
"""Materials of the bispectral measurements; under 365 nm they shine red, green and blue."""
PAPER = {"measured_on": "hardware (the paper, Table II)", "dE00_mean": 2.56, "dE00_p95": 4.5, "dE00_max": 5.6}


def emission_at(path: Path, excitation_nm: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Emission (nm, power) of a bispectral file at an excitation, from 30 nm above it on."""
    lines = path.read_text(encoding="latin-1").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("r:c:"))
    bands = np.array(lines[start].split()[1:], np.float64)
    cells = [line.split() for line in lines[start + 1 :]]
    table = np.array([row for row in cells if len(row) == 1 + len(bands)], np.float64)
    column = int(np.argmin(np.abs(bands - excitation_nm)))
    return table[:, 0], np.where(table[:, 0] > excitation_nm + 30, np.maximum(table[:, 1 + column], 0), 0)


def measured_inks(folder: Path, data: Path) -> dict[str, Any]:
    """Emissions as .csv in a folder, and the keys that name them: all with the same efficiency."""
    folder.mkdir(parents=True, exist_ok=True)
    own: dict[str, Any] = {}
    for ink, material in MEASURED.items():
        nm, power = emission_at(data / "fluorescence" / f"{material}.BFC", 365.0)
        rows = "\n".join(f"{a:g},{b:.6g}" for a, b in zip(nm, power, strict=True))
        path = (folder / f"{ink}.csv").resolve()
        path.write_text(f"wavelength_nm,power\n{rows}\n", encoding="utf-8")
        own |= {f"colorants.{ink}.emission": str(path), f"colorants.{ink}.efficiency": 0.4}
    return own


def demonstrate(folder: Path, preset: str, overrides: dict[str, Any]) -> tuple[Installation, dict[str, Any]]:
    """From print to the views of three photographs; the figures of all."""
    run_demo(folder, preset, overrides, lambda *_: None, print)
    installation = Installation.open(folder)
    views = {}
    for name in PHOTOGRAPHS:
        picture = folder / "pictures" / name
        if not picture.is_file():
            with Image.open(str(files("skimage") / "data" / name)) as image:
                image.convert("RGB").save(picture)
        stem = picture.stem
        make_projection_stage(installation, Monochrome(), {"image": picture}, name=stem, shown_on="pattern")
        views[stem] = make_previews(installation, [stem])[0][f"{stem}.json"]["on_pattern"]
    accuracy = read_json(folder / "calibration" / "accuracy.json")
    model = load_model(folder / "calibration" / "model.json")
    mesh = subgamut_and_mesh(JointGamut(model), Full(), "pattern")[1]
    return installation, {
        "prediction": {kind: accuracy[kind]["pattern"] if kind == "linear" else accuracy["pattern"]
                       for kind in ("linear", "corrected")},
        "XYZ_volume": float(abs(np.linalg.det(model.pattern.A))),
        "Lab_volume": mesh.volume,
        "primaries": primaries_figures(model, [1 / 3] * 3),
        "seen": {stem: {key: view[key] for key in ("dE00_mean", "dE00_p95", "chroma_mean", "chroma_mean_mapped")}
                 for stem, view in views.items()},
    }  # fmt: skip


def photographs_sheet(installations: dict[str, Installation], path: Path) -> None:
    """Fig. 9: each photograph, its gray projection image, and what is seen."""
    groups = []
    for name, installation in installations.items():
        rows = []
        for stem in (Path(photograph).stem for photograph in PHOTOGRAPHS):
            gray = read_image(installation.folder("projection") / f"{stem}.png")
            seen = read_image(installation.folder("preview") / f"{stem}.on-pattern.auto.png")
            with Image.open(installation.path / "pictures" / f"{stem}.png") as image:
                source = np.asarray(image.convert("RGB"))
            rows.append((
                Tile(source, "the photograph"),
                Tile(np.repeat(gray[..., None], 3, axis=2), "the projection image"),
                Tile(seen, "seen on the print", emphasis=True),
            ))  # fmt: skip
        groups.append(Group(name, tuple(rows)))
    sheet = path.with_suffix(".png")
    write_contact_sheet(sheet, groups, "Colour from one channel", "after the paper's Fig. 9")
    with Image.open(sheet) as image:
        half = image.convert("RGB").resize((image.width // 2, image.height // 2), Image.Resampling.LANCZOS)
        half.save(path, quality=80)
    sheet.unlink()


def gamuts_picture(model: PredictionModel, path: Path) -> dict[str, float]:
    """Fig. 10: the ultraviolet gamut and the video projector's on white paper, under the video projector's white.

    Both have the same luminance at full. Returns the volumes.
    """
    A = spectra_to_XYZ(primaries(("red", "green", "blue")) * colorant_library()["white"].reflectance).T
    white = A.sum(axis=1)
    response = replace(model.response, code=model.response.code * 3, linear=model.response.linear * 3)
    video = PredictionModel(
        ("red", "green", "blue"), ("white",), SurfaceModel(A / white[1], np.zeros(3)), None, white / white[1], response
    )
    ultraviolet = replace(model, white_point=video.white_point, correction=None)
    bodies = [subgamut_and_mesh(JointGamut(m), Full(), "pattern")[1] for m in (video, ultraviolet)]
    write_scene(path, [SceneBody(bodies[0], "video projector on white paper"), SceneBody(bodies[1], "ultraviolet")])
    return {"video projector on white paper": bodies[0].volume, "ultraviolet": bodies[1].volume}


def seconds_at_4K(installation: Installation, folder: Path) -> dict[str, float]:
    """Read, map, invert, assemble (dither) and write one photograph at 3840 x 2160, second run."""
    model = load_model(installation.folder("calibration") / "model.json")
    gamut = load_sub_gamut(installation.folder("gamut"), Full(), "pattern")
    labels = read_image(installation.folder("calibration") / "clusters.png")
    labels = np.tile(labels, (2160 // len(labels) + 1, 3840 // labels.shape[1] + 1))[:2160, :3840].copy()
    seconds: dict[str, float] = {}
    for _ in range(2):
        begin = last = time.perf_counter()

        def lap(name: str) -> None:
            nonlocal last
            now = time.perf_counter()
            seconds[name], last = now - last, now

        Lab = load_picture(Path(str(files("skimage") / "data" / "astronaut.png")), 3840, 2160)
        lap("read")
        mapped = map_to_subgamut(Lab, gamut).Lab
        lap("map")
        x = invert(mapped, None, model).x
        lap("invert, in gamut")
        x = invert(Lab, None, model).x
        lap("invert, unmapped: out of gamut where it is")
        codes, _ = assemble(x, labels, model, 8, AssemblyOptions(method="dither"))
        lap("assemble")
        write_frame(folder / "4K.png", codes, 8)
        lap("write")
        seconds["all"] = time.perf_counter() - begin
    return seconds


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path)
    options.add_argument("--small", action="store_true", help="480 x 270 projector pixels")
    chosen = options.parse_args()
    size = SMALL if chosen.small else DEMO_OVERRIDES
    runs: dict[str, tuple[str, dict[str, Any]]] = {
        "ultraviolet on fluorescent inks": ("uv-rgb", {}),
        "white light on red, green and blue": ("rgb", {}),
    }
    if "PAXEL_DATA" in os.environ:
        runs["ultraviolet on measured materials"] = ("uv-rgb", {"measured": True})
    result: dict[str, Any] = {"measured_on": "virtual bench, realistic", "the paper": PAPER}
    installations = {}
    for name, (preset, extra) in runs.items():
        folder = chosen.folder / name.replace(" ", "-").replace(",", "")
        own = measured_inks(chosen.folder, Path(os.environ["PAXEL_DATA"])) if extra else {}
        installations[name], result[name] = demonstrate(folder, preset, {**size, **own})
    first = next(iter(installations.values()))
    photographs_sheet(installations, RESULT.with_suffix(".jpg"))
    model = load_model(first.folder("calibration") / "model.json")
    result["Lab_volumes, Fig. 10"] = gamuts_picture(model, RESULT.with_name("monochrome_gamut.png"))
    result["seconds at 4K"] = seconds_at_4K(first, chosen.folder)
    RESULT.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
