"""Fig. 12 of the paper: checkerboards at 0 and at 30 degrees and blue noise, one cluster lit green.

Writes reports/reference/fig12_pattern_layouts.json and .jpg.

Three parts. *Foretold*: moire by `paxel_design.visibility`, the worst over zooms of 3 % to either side, for the paper's
sorting of pixels (k-means in CIELAB) and for sorting by light. *Photographed*: the virtual bench's camera takes the lit
cluster of 30 layouts; its low-frequency contrast is compared with the one foretold, by rank. *Shown*: photographs and
their spectra. The bench shares no code with what is foretold.

Run from a checkout (some minutes)::

    python -m reports.fig12_pattern_layouts
    python -m reports.fig12_pattern_layouts --part photographed     # or foretold, shown
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.stats import spearmanr

from paxel_design.patterns import make_pattern
from paxel_design.visibility import moire, moire_of_picture, moire_picture, pattern_visibility
from paxel_design.visibility.moire import Partition
from paxel_runtime.clustering.kmeans import lloyd, nearest
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.pattern import Pattern
from reports.bench_floors import rounded

RESULT = Path(__file__).parent / "reference" / "fig12_pattern_layouts.json"
PICTURE = RESULT.with_suffix(".jpg")

RESOLUTION = (480, 270)
PITCH_MM = 281.0 / 1920.0
DISTANCE_MM = 4000.0
QUALITY = "realistic"
CAMERA = (1440, 1080)
PIECE_PX = 256
SAMPLES = 89
ZOOMS = np.linspace(0.97, 1.03, 13)
DOTS_MM = (0.5, 0.75, 1.0)
ONE_THIRD = float(np.rad2deg(np.arctan(1 / 3)))
SORTINGS: tuple[tuple[Partition, int], ...] = (("lab", 2), ("light", 2), ("light", 3))
RANKED_SORTINGS: tuple[tuple[Partition, int], ...] = (("lab", 3), ("light", 3), ("lab", 2))
RANKED_DOTS_MM = (0.5, 0.62, 0.75, 1.0)
RANKED_ANGLES_DEG = (0.0, 10.0, ONE_THIRD, 26.565, 30.0, 37.0, 45.0)
RANKED_PX = 224
"""Edge of the piece that is compared: the middle of the projection."""

PRINT_SCALE = (1.002, 0.999)
"""What the rulers of the bench's print measure (design: section 6, realistic)."""

SIZE_MM = (80.0, 50.0)


def layout(dot_mm: float, angle_deg: float, name: str = "checkerboard") -> Pattern:
    """A black-and-white layout somewhat larger than the projection."""
    return make_pattern(name, ("black", "white"), dot_mm, angle_deg, SIZE_MM)


def foretold() -> dict[str, Any]:
    """Worst moire of every layout, ratios to 30 degrees, and the grid that is aligned exactly."""
    layouts = {"0": (0.0, "checkerboard"), "30": (30.0, "checkerboard"), "atan(1/3)": (ONE_THIRD, "checkerboard"),
               "blue noise": (0.0, "blue-noise")}  # fmt: skip
    table: dict[str, Any] = {}
    for partition, K in SORTINGS:
        for dot in DOTS_MM:
            rows = {}
            for name, (angle, kind) in layouts.items():
                pattern = layout(dot, angle, kind)
                found = [
                    moire(pattern, PITCH_MM * zoom, DISTANCE_MM, K=K, partition=partition, size_px=PIECE_PX,
                          samples=SAMPLES, offset_px=(0.37 * k % 1, 0.71 * k % 1))
                    for k, zoom in enumerate(ZOOMS)
                ]  # fmt: skip
                rows[name] = {
                    "visibility": max(m.visibility for m in found),
                    "contrast": max(m.contrast for m in found),
                    "visibility_mean": float(np.mean([m.visibility for m in found])),
                    "worst_zoom": float(ZOOMS[int(np.argmax([m.visibility for m in found]))]),
                }
            ratios = {
                f"{name} over 30": {key: rows[name][key] / rows["30"][key] for key in ("visibility", "contrast")}
                for name in ("0", "atan(1/3)")
            }
            table.setdefault(f"{partition}, K = {K}", {})[f"{dot:g} mm"] = {**rows, "ratios": ratios}
            told = "  ".join(f"{name} {row['visibility']:.1f}" for name, row in rows.items())
            print(f"{partition}, K = {K}, {dot:g} mm: {told}; 0 over 30: {ratios['0 over 30']['visibility']:.2f}")
    aligned = {
        f"zoom {zoom:g}": moire(layout(5 * PITCH_MM, 0.0), PITCH_MM * zoom, DISTANCE_MM, size_px=384).contrast
        for zoom in (1.0, 1.001)
    }
    print("a grid of exactly 5 pixels, contrast:", aligned)
    seen = {
        name: pattern_visibility(layout(0.75, angle, kind), DISTANCE_MM).luminance
        for name, (angle, kind) in layouts.items()
    }
    lines = {name: line_share(moire_picture(layout(0.75, angle, kind), PITCH_MM, size_px=PIECE_PX))
             for name, (angle, kind) in layouts.items()}  # fmt: skip
    return {"worst": table, "aligned_grid_contrast": aligned, "print_visibility_0.75mm": seen,
            "strongest_line_share_0.75mm": lines}  # fmt: skip


def line_share(view: NDArray[np.floating]) -> float:
    """Share of the slow variance (below 0.35 cycles a dot of 0.75 mm) in its strongest line: 1 = stripes, 0 = noise."""
    window = np.outer(*(np.hanning(size) for size in view.shape))
    power = np.abs(np.fft.fft2((view / view.mean() - 1) * window)) ** 2
    fy, fx = (np.fft.fftfreq(size, PITCH_MM) for size in view.shape)
    radius = np.hypot(fy[:, None], fx[None])
    power[(radius > 0.35 / 0.75) | (radius < 2.5 / (min(view.shape) * PITCH_MM))] = 0
    row, column = np.unravel_index(int(np.argmax(power)), power.shape)
    near = power[np.ix_(np.arange(row - 1, row + 2) % len(power), np.arange(column - 1, column + 2) % power.shape[1])]
    return float(2 * near.sum() / power.sum())


def photograph(pattern: Pattern, partition: Partition, K: int) -> tuple[NDArray[np.float64], float]:
    """The bench's camera on the lit cluster, green, over its picture of the white sheet; and mm of a camera pixel."""
    bench = VirtualBench(
        BenchSetup(
            pattern=pattern,
            resolution=RESOLUTION,
            width_mm=RESOLUTION[0] * PITCH_MM,
            channels=("red", "green", "blue"),
            bits=8,
            camera_resolution=CAMERA,
            camera_bits=14,
            aperture_mm=20.0,
            quality=QUALITY,
            seed=1,
        )
    )
    full = np.full((RESOLUTION[1], RESOLUTION[0], 3), 255, np.uint8)
    on_pattern, on_white = (bench.view_XYZ(full, surface) for surface in ("pattern", "white"))
    reflectance = (on_pattern / on_white).reshape(-1, 3).astype(np.float64)
    dark, bright = np.quantile(reflectance, (0.02, 0.98), axis=0)
    starts = np.array([dark, bright, (dark + bright) / 2])[:K]
    if partition == "lab":
        reflectance, starts = (np.asarray(XYZ_to_Lab(XYZ, np.ones(3)), np.float64) for XYZ in (reflectance, starts))
        starts, _ = lloyd(reflectance, starts)
    labels = nearest(reflectance, starts)[0] == 1
    green = np.zeros_like(full)
    green[..., 1] = 255 * labels.reshape(RESOLUTION[::-1])
    bench.place("pattern")
    bench.show(green)
    lit = bench.capture("green").astype(np.float64)
    bench.place("white")
    bench.show(np.where(np.arange(3) == 1, full, 0).astype(np.uint8))
    flat = bench.capture("green").astype(np.float64)
    return np.squeeze(lit) / np.maximum(np.squeeze(flat), 1.0), float(bench.truth.maps.camera_px_mm)


def middle_of(picture: NDArray[np.float64], size_px: int) -> NDArray[np.float64]:
    """The middle of a photograph, square."""
    top, left = ((n - size_px) // 2 for n in picture.shape)
    return picture[top : top + size_px, left : left + size_px]


def photographed() -> dict[str, Any]:
    """Rank correlation between foretold and photographed low-frequency contrast."""
    result: dict[str, Any] = {"piece_px": RANKED_PX}
    cases = [(dot, angle, "checkerboard") for dot in RANKED_DOTS_MM for angle in RANKED_ANGLES_DEG]
    cases += [(dot, 0.0, "blue-noise") for dot in (0.5, 0.75)]
    for partition, K in RANKED_SORTINGS:
        rows = []
        for dot, angle, kind in cases:
            pattern = layout(dot, angle, kind)
            printed = replace(pattern, print_scale=PRINT_SCALE)
            expected = moire(
                printed, PITCH_MM, DISTANCE_MM, K=K, partition=partition, size_px=RANKED_PX, samples=SAMPLES
            )
            picture, mm = photograph(pattern, partition, K)
            view = middle_of(picture, round(RANKED_PX * PITCH_MM / mm))
            seen = moire_of_picture(view, dot, mm, DISTANCE_MM)
            rows.append({
                "layout": kind, "angle_deg": angle, "dot_mm": dot,
                "foretold": {"contrast": expected.contrast, "visibility": expected.visibility},
                "photographed": {"contrast": seen.contrast, "visibility": seen.visibility},
            })  # fmt: skip
            print(f"{partition}, K = {K}: {kind} {angle:.1f} degrees {dot:g} mm: foretold {expected.contrast:.4f} "
                  f"({expected.visibility:.2f}), seen {seen.contrast:.4f} ({seen.visibility:.2f})")  # fmt: skip
        regular = [row for row in rows if row["layout"] != "blue-noise"]
        result[f"{partition}, K = {K}"] = {
            "layouts": len(rows),
            "spearman": {key: rank_correlation(rows, key) for key in ("contrast", "visibility")},
            "spearman_of_checkerboards": {key: rank_correlation(regular, key) for key in ("contrast", "visibility")},
            "rows": rows,
        }
        print(f"{partition}, K = {K}: Spearman {result[f'{partition}, K = {K}']['spearman']}, checkerboards alone "
              f"{result[f'{partition}, K = {K}']['spearman_of_checkerboards']}")  # fmt: skip
    return result


def rank_correlation(rows: list[dict[str, Any]], key: str) -> float:
    """Spearman's, between what was foretold and what was photographed."""
    return float(spearmanr(*([row[what][key] for row in rows] for what in ("foretold", "photographed"))).statistic)


def shown() -> None:
    """Photographs of the three layouts, and their spectra, as one picture."""
    side, gap, head = 360, 8, 26
    board = Image.new("RGB", (3 * side + 4 * gap, 2 * side + 3 * gap + head), "white")
    draw = ImageDraw.Draw(board)
    for k, (angle, kind, words) in enumerate((
        (0.0, "checkerboard", "checkerboard, 0 degrees"),
        (0.0, "blue-noise", "blue noise"),
        (30.0, "checkerboard", "checkerboard, 30 degrees"),
    )):  # fmt: skip
        picture, mm = photograph(layout(0.75, angle, kind), "lab", 2)
        size = round(RANKED_PX * PITCH_MM / mm)
        view = middle_of(picture, size)
        tone = np.clip(view / np.quantile(view, 0.98), 0, 1) ** (1 / 2.2)
        green = np.zeros((*view.shape, 3))
        green[..., 1], green[..., 0], green[..., 2] = tone, 0.1 * tone, 0.1 * tone
        window = np.outer(np.hanning(size), np.hanning(size))
        power = np.abs(np.fft.fftshift(np.fft.fft2((view / view.mean() - 1) * window)))
        reach = int(1.6 / 0.75 * size * mm)  # cycles in the piece
        centre = size // 2
        power = power[centre - reach : centre + reach, centre - reach : centre + reach]
        log = np.clip((np.log10(power / power.max()) + 3.5) / 3.5, 0, 1)
        left = gap + k * (side + gap)
        draw.text((left, 6), f"{words}, 0.75 mm, white cluster (virtual bench)", fill="black")
        for row, panel in enumerate((green, np.repeat(log[..., None], 3, axis=2))):
            image = Image.fromarray(np.rint(255 * panel).astype(np.uint8))
            kind_of = Image.Resampling.LANCZOS if row == 0 else Image.Resampling.BICUBIC
            board.paste(image.resize((side, side), kind_of), (left, head + row * (side + gap)))
    board.save(PICTURE, quality=85)
    print(PICTURE)


def main() -> None:
    """Compute the parts asked for, and keep the others' figures."""
    options = argparse.ArgumentParser(description="Fig. 12 of the paper")
    options.add_argument("--part", choices=("foretold", "photographed", "shown"))
    part = options.parse_args().part
    computed: dict[str, Any] = {
        "what": "Fig. 12 of the paper: moire of layouts, foretold and photographed on the virtual bench",
        "pixel_pitch_mm": PITCH_MM,
        "zooms": [float(ZOOMS[0]), float(ZOOMS[-1])],
        "distance_mm": DISTANCE_MM,
        "samples_in_a_pixel": SAMPLES,
        "bench_quality": QUALITY,
    }
    for name, compute in (("foretold", foretold), ("photographed", photographed)):
        if part in (None, name):
            computed[name] = compute()
    if part in (None, "shown"):
        shown()
    before: dict[str, Any] = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.is_file() else {}
    RESULT.write_text(json.dumps(rounded(before | computed), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
