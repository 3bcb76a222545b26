"""Adaptive against static mapping of picture pairs: contrast kept, colour, ghosts and times, with a contact sheet.

1920 x 1080 on 281 mm, seen from 4 m, models of the virtual bench (`bench_models`, quality realistic). The figures are
of the mapped pictures through the eye: what a view shows where projection and registration are ideal. A mark (20 L*,
a lattice of discs) is planted in the other picture and everything is mapped anew; ``ghost_L`` is the 99th percentile of
what differs above one cycle per degree, ``ghost_mark_L`` how much of the mark itself is in that (least squares): what
differs besides is this picture's own contrast, which makes room for the mark. ``text_size_px`` is the height of type.

Run from a checkout (two minutes)::

    python -m reports.adaptive_mapping
"""

from __future__ import annotations

import json
import time
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from paxel_design.gamut import JointGamut, sub_gamut
from paxel_runtime.gamut_mapping import (
    AdaptiveOptions,
    Mapped,
    apply_pair_curves,
    fit_pair_curves,
    map_pair,
    map_to_subgamut,
)
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import PairGamut, SubGamut
from paxel_runtime.observer import (
    Viewer,
    ghost_L,
    inner_mask,
    local_contrast,
    picture_to_Lab,
    plant_mark,
    planted_mark,
    view_to_sRGB,
)
from paxel_runtime.observer.smoothing import high_passed
from paxel_runtime.pictures import load_picture
from reports.bench_models import bench_model

RESULT = Path(__file__).parent / "reference" / "adaptive_mapping.json"
SHEET = RESULT.with_suffix(".jpg")
WIDTH, HEIGHT = 1920, 1080
VIEWER = Viewer(4000.0, 281.0 / WIDTH)
PAIRS = {
    "astronaut + coffee": ("astronaut.png", "coffee.png"),
    "chelsea + rocket": ("chelsea.png", "rocket.jpg"),
    "text + text": (60, 72),
}
"""On the pattern, on the white sheet: photographs of scikit-image, or heights of type in pixels."""
COUNTS = (2, 3)
SURFACES = ("pattern", "white")
WORDS = "all human beings are born free and equal in dignity and rights and should act towards one another kindly"
REDUCTION = 5

Picture = NDArray[np.float32]


def picture(source: str | int) -> Picture:
    """CIELAB (HEIGHT, WIDTH, 3) of a photograph's file name, or of a page of text by its height."""
    if isinstance(source, str):
        with as_file(files("skimage") / "data" / source) as path:
            return load_picture(path, WIDTH, HEIGHT)
    page, font, words = Image.new("L", (WIDTH, HEIGHT), 245), ImageFont.load_default(source), WORDS.split()
    draw, k = ImageDraw.Draw(page), source  # another word first on each page
    for y in range(source // 3, HEIGHT, int(1.3 * source)):
        line = ""
        while draw.textlength(line, font) < WIDTH:
            line, k = f"{line}{words[k % len(words)]} ", k + 1
        draw.text((source // 3, y), line, 20, font)
    Lab = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    Lab[..., 0] = np.asarray(page, np.float32) * (100 / 255)
    return Lab


def measure(sources: tuple[Picture, Picture], model: PredictionModel) -> tuple[dict[str, Any], list[list[Picture]]]:
    """Figures of one pair on one model, and source, static and adaptive target of each surface."""
    pairs = JointGamut(model).pairs
    sides = [sub_gamut(model, "dual-image", shown_on=surface) for surface in SURFACES]
    static = _static(sources, sides)
    options = AdaptiveOptions(VIEWER.px_per_degree)
    pair = map_pair(sources, static, pairs, options)
    inner = inner_mask(np.ones((HEIGHT, WIDTH), np.bool_), VIEWER.sigma_px)
    figures: dict[str, Any] = {"used": pair.method, "why": pair.why}
    for s, surface in enumerate(SURFACES):
        L = [seen_L(Lab, model) for Lab in (sources[s], static[s].Lab, pair.Lab[s])]
        of_source, of_static, of_adaptive = (local_contrast(one, inner, VIEWER.px_per_degree) for one in L)
        ghost, of_mark = _ghost(s, sources, pair.Lab[s], sides, pairs, options, model, inner)
        figures[surface] = {
            "contrast_kept_static": of_static / of_source,
            "contrast_kept": of_adaptive / of_source,
            "gain": of_adaptive / of_static,
            "chroma_over_static": pair.figures[f"chroma_{surface}"],
            "ghost_L": ghost,
            "ghost_mark_L": of_mark,
        }
    figures["gain"] = float(np.sqrt(np.prod([figures[surface]["gain"] for surface in SURFACES])))
    figures["pixels_pulled"] = pair.figures["pixels_pulled"]
    few = [Lab_to_XYZ(Lab[::3, ::3].astype(np.float64), pairs.white_point) for Lab in pair.Lab]
    figures["least_slack_XYZ"] = float(pairs.slack(*few).min())
    return figures, [[sources[s], static[s].Lab, pair.Lab[s]] for s in range(2)]


def seen_L(Lab: Picture, model: PredictionModel) -> NDArray[np.floating]:
    """L* of a mapped picture through the eye, (H, W)."""
    return picture_to_Lab(Lab, model.white_point, VIEWER.sigma_px)[..., 0]


def _static(sources: tuple[Picture, Picture], sides: list[SubGamut]) -> tuple[Mapped, Mapped]:
    return map_to_subgamut(sources[0], sides[0]), map_to_subgamut(sources[1], sides[1])


def _ghost(
    own: int,
    sources: tuple[Picture, Picture],
    before: Picture,
    sides: list[SubGamut],
    pairs: PairGamut,
    options: AdaptiveOptions,
    model: PredictionModel,
    inner: NDArray[np.bool_],
) -> tuple[float, float]:
    """The ghost of a mark in the picture of the surface that is not `own`, and the mark's own share in it, L*."""
    mark = planted_mark((HEIGHT, WIDTH), VIEWER.px_per_degree)
    marked = plant_mark(sources[1 - own], mark)
    planted = (sources[0], marked) if own == 0 else (marked, sources[1])
    after = map_pair(planted, _static(planted, sides), pairs, options).Lab[own]
    L = [seen_L(Lab, model) for Lab in (before, after)]
    change, sign = (
        high_passed(values, inner, VIEWER.px_per_degree)[inner]
        for values in (L[1] - L[0], np.sign(marked[..., 0] - sources[1 - own][..., 0]).astype(np.float64))
    )
    return ghost_L(L[0], L[1], inner, VIEWER.px_per_degree), abs(float(change @ sign / (sign @ sign)))


def times(sources: tuple[Picture, Picture], model: PredictionModel) -> dict[str, float]:
    """Seconds, wall clock and CPU, best of three: fit the curves; apply them, a megapixel."""
    pairs = JointGamut(model).pairs
    static = _static(sources, [sub_gamut(model, "dual-image", shown_on=surface) for surface in SURFACES])
    options = AdaptiveOptions(VIEWER.px_per_degree)
    times: dict[str, list[float]] = {"fit_s": [], "fit_cpu_s": [], "apply_s_per_mp": [], "apply_cpu_s_per_mp": []}
    for _ in range(3):
        start = time.perf_counter(), time.process_time()
        curves = fit_pair_curves(sources, static, pairs, options)
        middle = time.perf_counter(), time.process_time()
        apply_pair_curves(sources, (static[0].Lab, static[1].Lab), curves, pairs)
        end = time.perf_counter(), time.process_time()
        for key, seconds in zip(("fit_s", "fit_cpu_s"), np.subtract(middle, start), strict=True):
            times[key].append(float(seconds))
        for key, seconds in zip(("apply_s_per_mp", "apply_cpu_s_per_mp"), np.subtract(end, middle), strict=True):
            times[key].append(float(seconds) * 1e6 / (HEIGHT * WIDTH))
    return {key: min(values) for key, values in times.items()}


def contact_sheet(rows: list[list[Picture]], white: NDArray[np.float64]) -> Image.Image:
    """Rows of source, static and adaptive, each at the exposure of an eye that has adapted to it, reduced."""
    lines = []
    for row in rows:
        tiles = []
        for Lab in row:
            XYZ = Lab_to_XYZ(Lab.astype(np.float64), white)
            XYZ = XYZ.reshape(HEIGHT // REDUCTION, REDUCTION, WIDTH // REDUCTION, REDUCTION, 3).mean(axis=(1, 3))
            tiles.append(np.pad(view_to_sRGB(XYZ, "auto", white), ((0, 6), (0, 6), (0, 0)), constant_values=255))
        lines.append(np.concatenate(tiles, axis=1))
    return Image.fromarray(np.concatenate(lines, axis=0))


def main() -> None:
    """Measure every pair on every model; write the figures and the sheet."""
    table: dict[str, Any] = {
        "what": "adaptive over static mapping of picture pairs, mapped pictures through the eye, 4 m",
        "models": "virtual bench, quality realistic, black and white checkerboard",
        "frame": [WIDTH, HEIGHT],
    }
    rows: list[list[Picture]] = []
    for K in COUNTS:
        model = bench_model(f"K={K}")
        table[f"K={K}"] = {}
        for name, (first, second) in PAIRS.items():
            figures, shown = measure((picture(first), picture(second)), model)
            table[f"K={K}"][name] = figures
            if COUNTS.index(K) == 0:
                rows += shown
            gains = "  ".join(f"{s} {figures[s]['gain']:.2f}" for s in SURFACES)
            marks = "  ".join(f"{figures[s]['ghost_L']:.2f} ({figures[s]['ghost_mark_L']:.2f})" for s in SURFACES)
            print(
                f"K={K} {name}: {figures['used']}; gain {figures['gain']:.2f} ({gains}); ghost (of the mark) {marks}",
                flush=True,
            )
        table[f"K={K}"]["times"] = times((rows[0][0], rows[1][0]), model)
    RESULT.write_text(json.dumps(_rounded(table), indent=2) + "\n", encoding="utf-8")
    contact_sheet(rows, np.asarray(model.white_point, np.float64)).save(SHEET, quality=80)


def _rounded(value: Any) -> Any:
    """The same with 4 significant digits."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
