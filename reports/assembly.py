"""What a viewer sees of `combine`, `dither`, `refine` on the virtual bench: reports/reference/assembly.json and .jpg.

Two pairs of photographs and a pair of pages of text, statically mapped, K = 2 and 3, `ideal` and `realistic`: each
surface against its mapped picture from 4 m and 2.7 m, edges and flats by themselves, coherent gain, and ghosting, also
with the print moved by parts of a pixel since; seconds and memory of `refine` at 1080p and 4K. Installations are made
in FOLDER where they are not there yet: print, capture, calibrate, gamut. Run from a checkout, on a machine that does
nothing else (1920: some 2 hours; 480: 15 minutes)::

    python -m reports.assembly FOLDER                       (1920 x 1080 on 281 mm)
    python -m reports.assembly FOLDER --width 480           (pixels of the same size on 70 mm)
    python -m reports.assembly FOLDER --only times          (one part anew: seconds and memory, without a bench)
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_runtime.assembly import METHODS, AssemblyOptions, assemble, refine
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.devices.virtual import VirtualBench
from paxel_runtime.gamut_mapping import map_to_subgamut
from paxel_runtime.installation import Installation
from paxel_runtime.inversion import invert
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.effects import DualImage
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.observer import (
    coherent_gain,
    eye_sigma_mm,
    fall_off,
    ghosting_percent,
    inner_mask,
    leveled,
    picture_to_Lab,
    view_to_Lab,
    view_to_sRGB,
)
from paxel_runtime.pictures import load_picture
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibrate, open_bench, open_devices
from paxel_runtime.stages.projection import assembly_options, load_sub_gamut
from paxel_runtime.storage import load_model, read_image
from reports.inversion_benchmark import measured_model, rounded

Floats = NDArray[np.floating]

RESULT = Path(__file__).parent / "reference" / "assembly.json"
PICTURE = RESULT.with_suffix(".jpg")
PHOTOGRAPHS = Path(str(files("skimage") / "data"))
PAIRS = {
    "astronaut + coffee": (PHOTOGRAPHS / "astronaut.png", PHOTOGRAPHS / "coffee.png"),
    "chelsea + rocket": (PHOTOGRAPHS / "chelsea.png", PHOTOGRAPHS / "rocket.jpg"),
    "text + text": (Path("text-a.png"), Path("text-b.png")),
}
WORDS = (
    "The quick brown fox jumps over the lazy dog while five wizards box nearby",
    "PACK MY BOX WITH FIVE DOZEN LIQUOR JUGS AND SPHINX OF BLACK QUARTZ",
)
DISTANCES_MM = (4000.0, 2700.0)
SHIFTS_PX = (0.1, 0.3, 0.5)
EDGES, FLATS = 0.8, 0.5
"""Quantiles of the pictures' gradients: edges are the steepest fifth of the pixels, flats the flatter half."""
SURFACES = ("pattern", "white")


def pages_of_text(folder: Path, width: int, height: int) -> None:
    """Two pages whose lines do not fall on each other."""
    for k, (name, words) in enumerate(zip(PAIRS["text + text"], WORDS, strict=True)):
        page = Image.new("RGB", (width, height), "white")
        draw, size = ImageDraw.Draw(page), height // (9 + 3 * k)
        font = ImageFont.load_default(size)
        for line in range(9 + 3 * k):
            start = 7 * line % len(words)
            draw.text((size // 3, line * size), (words + " " + words)[start : start + len(words)], "black", font)
        page.save(folder / name)


def installation_of(folder: Path, width: int, quality: str, K: int) -> Installation:
    """An installation that is calibrated and has the gamut of dual images; made where it is not there."""
    height, path = width * 9 // 16, folder / f"{width}-{quality}-K{K}"
    if not (path / "gamut").is_dir():
        keys = {
            "pattern.size_mm": [0.161 * width, 0.168 * height],
            "projector.resolution": [width, height],
            "projector.width_mm": 281 / 1920 * width,
            "camera.resolution": [int(2.1 * width), int(2.3 * height)],
            "clusters.count": K,
            "clusters.method": "design",
            "bench.quality": quality,
        }
        installation = Installation.create(path, make_settings("bw-checkerboard", keys))
        make_print(installation)
        capture(installation, open_devices(installation), progress=lambda message, done, total: None)
        calibrate(installation)
        make_gamut(installation, DualImage(), "pattern")
    return Installation.open(path)


def targets_of(installation: Installation, pair: tuple[Path, Path], folder: Path) -> dict[str, NDArray[np.float32]]:
    """Mapped pictures of both surfaces."""
    size = installation.settings.projector.resolution
    gamuts = {s: load_sub_gamut(installation.folder("gamut"), DualImage(), s) for s in SURFACES}
    return {
        surface: map_to_subgamut(load_picture(folder / path, *size), gamuts[surface]).Lab
        for surface, path in zip(SURFACES, pair, strict=True)
    }


def seen_figures(
    view: Floats, share: Floats, targets: dict[str, Floats], surface: str, white: Floats, sigma_px: float, inner: Floats
) -> dict[str, Any]:
    """Errors of a view against its mapped picture, everything through the eye."""
    other = targets[SURFACES[1 - SURFACES.index(surface)]]
    seen = view_to_Lab(leveled(view, share), white, sigma_px)
    own, hidden = picture_to_Lab(targets[surface], white, sigma_px), picture_to_Lab(other, white, sigma_px)
    dE = dE00(seen, own)
    steep = np.max([np.hypot(*np.gradient(Lab[..., 0])) for Lab in (own, hidden)], axis=0)
    edges, flats = steep >= np.quantile(steep[inner], EDGES), steep <= np.quantile(steep[inner], FLATS)
    return {
        "dE00_mean": float(dE[inner].mean()),
        "dE00_p95": float(np.quantile(dE[inner], 0.95)),
        "dE00_edges": float(dE[inner & edges].mean()),
        "dE00_flats": float(dE[inner & flats].mean()),
        "ghosting_percent": ghosting_percent(seen[..., 0], own[..., 0], hidden[..., 0], inner),
        "coherent_gain": coherent_gain(seen[..., 0], own[..., 0], inner),
    }


def look(installation: Installation, folder: Path, pictures: dict[str, Any] | None) -> dict[str, Any]:
    """Every pair, method, distance and surface on one installation; views to show go into `pictures`."""
    settings, model = installation.settings, load_model(installation.folder("calibration") / "model.json")
    labels = read_image(installation.folder("calibration") / "clusters.png")
    pitch_mm = settings.projector.width_mm / settings.projector.resolution[0]
    full = np.full((*labels.shape, 3), 2**settings.projector.bits - 1, np.uint8)
    benches = {0.0: open_bench(installation)} | {
        shift: open_bench(installation, print_offset_mm=(shift * pitch_mm, 0.0)) for shift in SHIFTS_PX
    }
    white_view = benches[0.0].view_XYZ(full, "white")
    table: dict[str, Any] = {}
    for pair, paths in PAIRS.items():
        targets = targets_of(installation, paths, folder)
        inversion = invert(targets["pattern"], targets["white"], model)
        x = inversion.x.astype(np.float32)
        shown = model.predict(x)  # reachable pairs: what was asked for, moved into the joint gamut
        reachable = {s: np.asarray(Lab, np.float32) for s, Lab in zip(SURFACES, shown, strict=True)}
        table[pair] = {"moved_dE00_max": float(inversion.dE_pattern.max())}
        for method in METHODS:
            codes, did = assemble(x, labels, model, settings.projector.bits, assembly_options(installation, method))
            views = {surface: benches[0.0].view_XYZ(codes, surface) for surface in SURFACES}
            table[pair][method] = {"did": did} | {
                f"{distance_mm / 1000:g} m": {
                    surface: seen_figures(
                        views[surface],
                        fall_off(white_view, model.white_point, sigma_px),
                        reachable,
                        surface,
                        model.white_point,
                        sigma_px,
                        inner_mask(labels != 255, sigma_px),
                    )
                    for surface in SURFACES
                }
                for distance_mm in DISTANCES_MM
                for sigma_px in [eye_sigma_mm(distance_mm) / pitch_mm]
            }
            if method == "refine":
                table[pair]["ghosting_percent_of_shifts"] = shifted(benches, codes, reachable, model, labels, pitch_mm)
            if pictures is not None:
                pictures[f"{pair}, {method}"] = views
        print(installation.path.name, pair, json.dumps(rounded(table[pair]), indent=1), flush=True)
    return table


def shifted(
    benches: dict[float, VirtualBench],
    codes: NDArray[np.unsignedinteger],
    targets: dict[str, Floats],
    model: PredictionModel,
    labels: NDArray[np.uint8],
    pitch_mm: float,
) -> dict[str, float | None]:
    """Ghosting on the pattern at 4 m when the print has moved by parts of a pixel since calibration."""
    sigma_px = eye_sigma_mm(DISTANCES_MM[0]) / pitch_mm
    inner = inner_mask(labels != 255, sigma_px)
    share = fall_off(benches[0.0].view_XYZ(np.full_like(codes, codes.max()), "white"), model.white_point, sigma_px)
    own, other = (picture_to_Lab(targets[s], model.white_point, sigma_px)[..., 0] for s in SURFACES)
    return {
        f"{shift:g} px": ghosting_percent(
            view_to_Lab(leveled(bench.view_XYZ(codes, "pattern"), share), model.white_point, sigma_px)[..., 0],
            own, other, inner,
        )
        for shift, bench in benches.items()
        if shift
    }  # fmt: skip


def side_by_side(pictures: dict[str, Any], model: PredictionModel, sigma_px: float) -> None:
    """Crops at 100 % of the last pair's views: a column a method, a row a surface; exposure as a camera adapts."""
    columns = []
    for views in pictures.values():
        rows = [view_to_sRGB(views[s], "auto", model.white_point, sigma_px) for s in SURFACES]
        h, w = rows[0].shape[:2]
        crop = slice(h // 4, h // 4 + min(h // 2, 270)), slice(w // 4, w // 4 + min(w // 2, 360))
        columns.append(np.concatenate([row[crop] for row in rows]))
    Image.fromarray(np.concatenate(columns, axis=1)).save(PICTURE, quality=88)


def refine_times() -> dict[str, Any]:
    """Least wall time of three runs of `refine`, and the process's largest memory, inputs included."""
    figures: dict[str, Any] = {}
    for name, K in (("1920 x 1080", 2), ("1920 x 1080", 3), ("3840 x 2160", 3)):
        width, height = map(int, name.split(" x "))
        model = measured_model(("black", "white", "black+white")[:K])
        rng = np.random.default_rng(0)
        labels = rng.integers(0, K, (height, width)).astype(np.uint8)
        share = rng.integers(0, 256, (height, width, 1), np.uint8)
        coverage = np.stack([share, 255 - share], axis=-1)
        x = rng.random((height, width, 3 * K), np.float32)
        seconds = []
        for _ in range(3):
            begin = time.perf_counter()
            refine(x, labels, model, coverage, 4.1)
            seconds.append(time.perf_counter() - begin)
        begin = time.perf_counter()
        assemble(x, labels, model, 8, AssemblyOptions(dot_px=5.12, eye_px=4.0, coverage=coverage))
        figures[f"{name}, K = {K}"] = {
            "refine_s": min(seconds),
            "assemble_s": time.perf_counter() - begin,
            "peak_GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        }
        print(name, K, figures[f"{name}, K = {K}"], flush=True)
    return figures


def main() -> None:
    """Make the installations, look at everything, write the table and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--width", type=int, default=1920, help="pixels of the projector's width")
    parser.add_argument("--only", default="", help="one of: ideal-K2, ideal-K3, realistic-K2, realistic-K3, times")
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    pages_of_text(chosen.folder, chosen.width, chosen.width * 9 // 16)
    table = json.loads(RESULT.read_text(encoding="utf-8")) if chosen.only and RESULT.is_file() else {}
    table["what"] = f"virtual bench, {chosen.width} pixels of 281/1920 mm wide, 0.75 mm dots (5.12 px), static mapping"
    for quality in ("ideal", "realistic"):
        for K in (2, 3):
            if chosen.only not in ("", f"{quality}-K{K}"):
                continue
            installation = installation_of(chosen.folder, chosen.width, quality, K)
            pictures: dict[str, Any] = {}
            table[f"{quality}, K = {K}"] = look(installation, chosen.folder, pictures)
            model = load_model(installation.folder("calibration") / "model.json")
            photographs = {key: views for key, views in pictures.items() if key.startswith("astronaut")}
            side_by_side(photographs, model, eye_sigma_mm(DISTANCES_MM[0]) / (281 / 1920))
    if chosen.only in ("", "times"):
        table["refine"] = refine_times()
    RESULT.write_text(json.dumps(rounded(table), indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
