"""Compare the methods of blue noise at exactly 50 %, the two that Paxel leaves out included.

Writes ``reports/reference/blue_noise_methods.json`` (figures) and ``.png`` (a corner of each field above its
spectrum). All spectra are mean periodograms of 64 Hann-windowed blocks of 128 x 128 cells of 1024 x 1024 cells
(8 x 8 tori of 128 where the method makes a torus; then without window), over that of white noise. Figures:

peak_over_mean        highest value of the spectrum over its mean (a checkerboard: one peak that is all)
low_power             mean below 0.1 cycle/cell; white noise has 1
across, along         share of horizontal and vertical neighbours that differ
checkerboard          share of cells that differ from all four neighbours

and of the swap method with several classes, the lowest and highest `low_power` of all single classes and all unions.

Run from a checkout::

    python reports/blue_noise_methods.py
"""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from time import perf_counter

import numpy as np
from numba import njit
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from paxel_design.patterns.error_diffusion_kernels import diffuse
from paxel_design.patterns.swap import swap_classes
from paxel_design.patterns.void_and_cluster import void_and_cluster_ones
from paxel_design.patterns.zhou_fang import zhou_fang_sheet
from paxel_runtime.version import __version__

OUTPUT = Path(__file__).parent / "reference" / "blue_noise_methods"
BLOCK = 128
BLOCKS = 8  # a side
TORI = 8
LOW = 0.1  # cycle/cell
SHOWN = 96
ZOOM = 2
COLUMNS = 4
MULTI_CLASS = ((1 / 6,) * 6, (0.5, 0.3, 0.2), (0.4, 0.3, 0.2, 0.1), (0.6, 0.1, 0.1, 0.1, 0.1))


@njit(cache=True)
def floyd_steinberg(share: float, rows: int, columns: int) -> NDArray[np.uint8]:
    """Error diffusion to four neighbours, 7, 3, 5, 1 of 16, in raster order (Floyd & Steinberg 1976)."""
    error = np.full((rows + 1, columns + 2), share)
    ones = np.empty((rows, columns), np.uint8)
    for r in range(rows):
        for c in range(1, columns + 1):
            ones[r, c - 1] = error[r, c] >= 0.5
            rest = error[r, c] - ones[r, c - 1]
            error[r, c + 1] += rest * 7 / 16
            error[r + 1, c - 1] += rest * 3 / 16
            error[r + 1, c] += rest * 5 / 16
            error[r + 1, c + 1] += rest * 1 / 16
    return ones


def ostromoukhov(share: float, rows: int, columns: int) -> NDArray[np.uint8]:
    """Serpentine error diffusion with Ostromoukhov's parts at level 127: right 4, down left 1, down 1 of 6 (2001)."""
    return diffuse(share, 4 / 6, 1 / 6, 1 / 6, 0.0, rows, columns, 64, np.uint64(0))


def sheet_blocks(make: Callable[[int, int], NDArray[np.uint8]]) -> list[NDArray[np.uint8]]:
    """All blocks of a sheet."""
    sheet = make(BLOCK * BLOCKS, BLOCK * BLOCKS)
    return list(sheet.reshape(BLOCKS, BLOCK, BLOCKS, BLOCK).swapaxes(1, 2).reshape(-1, BLOCK, BLOCK))


def tori(make: Callable[[int], NDArray[np.uint8]]) -> list[NDArray[np.uint8]]:
    """Tori of several seeds."""
    return [make(seed) for seed in range(TORI)]


METHODS: dict[str, tuple[bool, Callable[[], list[NDArray[np.uint8]]]]] = {
    "floyd-steinberg": (False, lambda: sheet_blocks(lambda rows, columns: floyd_steinberg(0.5, rows, columns))),
    "ostromoukhov": (False, lambda: sheet_blocks(lambda rows, columns: ostromoukhov(0.5, rows, columns))),
    "zhou-fang": (False, lambda: sheet_blocks(lambda rows, columns: zhou_fang_sheet(0.5, (rows, columns), 0))),
    "void-and-cluster": (
        True,
        lambda: tori(lambda seed: void_and_cluster_ones(BLOCK * BLOCK // 2, (BLOCK, BLOCK), seed)),
    ),
} | {
    f"swap {flatness:g}": (
        True,
        lambda flatness=flatness: tori(lambda seed: swap_classes((0.5, 0.5), (BLOCK, BLOCK), flatness, seed)),
    )
    for flatness in (0.6, 1.0, 2.0, 4.0)
}
"""Whether the method makes tori, and its fields of 128 x 128 cells; "swap" with its flatness."""


def spectrum_of(fields: list[NDArray[np.uint8]], torus: bool) -> NDArray[np.float64]:
    """Mean periodogram over that of white noise, (128, 128), frequency 0 first."""
    window = np.ones((BLOCK, BLOCK)) if torus else np.outer(np.hanning(BLOCK), np.hanning(BLOCK))
    share = np.mean(fields)
    power = [np.abs(np.fft.fft2((field - share) * window)) ** 2 for field in fields]
    return np.mean(power, axis=0) / ((window**2).sum() * share * (1 - share))


def frequencies() -> NDArray[np.float64]:
    """Cycles per cell of each bin of a spectrum."""
    f = np.fft.fftfreq(BLOCK)
    return np.hypot(f[:, None], f)


def figures_of(fields: list[NDArray[np.uint8]], torus: bool) -> dict[str, float]:
    """The figures of the head of this file."""
    spectrum, f = spectrum_of(fields, torus), frequencies()
    used = f > (0 if torus else 1.5 / BLOCK)  # the window spreads the mean over the first bins
    b = np.array(fields)
    inner = b[:, 1:-1, 1:-1]
    neighbours = (b[:, :-2, 1:-1], b[:, 2:, 1:-1], b[:, 1:-1, :-2], b[:, 1:-1, 2:])
    return {
        "share": float(b.mean()),
        "peak_over_mean": float(spectrum[used].max() / spectrum[used].mean()),
        "low_power": float(spectrum[used & (f < LOW)].mean()),
        "across": float(np.mean(b[:, :, 1:] != b[:, :, :-1])),
        "along": float(np.mean(b[:, 1:] != b[:, :-1])),
        "checkerboard": float(np.mean(np.all([inner != neighbour for neighbour in neighbours], axis=0))),
    }


def multi_class_figures() -> dict[str, dict[str, float]]:
    """Lowest and highest low power of every class and union of the swap method, two tori each."""
    figures = {}
    for shares in MULTI_CLASS:
        fields = [swap_classes(shares, (BLOCK, BLOCK), 2.0, seed) for seed in range(2)]
        unions = [u for size in range(1, len(shares)) for u in combinations(range(len(shares)), size)]
        low = [
            figures_of([np.isin(cells, u).astype(np.uint8) for cells in fields], torus=True)["low_power"]
            for u in unions
        ]
        name = ", ".join(f"{share:.3g}" for share in shares)
        figures[name] = {"unions": len(unions), "lowest": round(min(low), 5), "highest": round(max(low), 5)}
    return figures


def picture_of(name: str, fields: list[NDArray[np.uint8]], torus: bool) -> Image.Image:
    """A corner of the field, and its spectrum below: frequency 0 in the middle, white noise is mid gray."""
    side = SHOWN * ZOOM
    picture = Image.new("L", (side + 12, 2 * side + 36), 255)
    ImageDraw.Draw(picture).text((6, 4), name, fill=0)
    corner = 255 * fields[0][:SHOWN, :SHOWN].repeat(ZOOM, 0).repeat(ZOOM, 1)
    picture.paste(Image.fromarray(corner), (6, 20))
    spectrum = np.clip(128 * np.sqrt(np.fft.fftshift(spectrum_of(fields, torus))), 0, 255).astype(np.uint8)
    picture.paste(Image.fromarray(spectrum).resize((side, side), Image.Resampling.NEAREST), (6, side + 28))
    return picture


def main() -> None:
    """Measure every method, write figures and pictures."""
    figures, pictures = {}, []
    for name, (torus, make) in METHODS.items():
        start = perf_counter()
        fields = make()
        seconds = perf_counter() - start
        figures[name] = {key: round(value, 5) for key, value in figures_of(fields, torus).items()}
        pictures.append(picture_of(name, fields, torus))
        cells = sum(field.size for field in fields)
        print(f"{name:17}", *(f"{key} {value:.4g}" for key, value in figures[name].items()), end="; ")
        print(f"{seconds * 1e6 / cells:.2f} s for a million cells")
    rows = -(-len(pictures) // COLUMNS)
    width, height = pictures[0].size
    sheet = Image.new("L", (COLUMNS * width, rows * height), 255)
    for i, picture in enumerate(pictures):
        sheet.paste(picture, ((i % COLUMNS) * width, (i // COLUMNS) * height))
    OUTPUT.parent.mkdir(exist_ok=True)
    sheet.save(OUTPUT.with_suffix(".png"), optimize=True)
    multi_class = multi_class_figures()
    for name, found in multi_class.items():
        print(f"swap 2, classes {name}:", *(f"{key} {value:.4g}" for key, value in found.items()))
    document = {"schema": "paxel-report", "version": 1, "writer": f"paxel {__version__}", "share": 0.5}
    text = json.dumps(document | {"methods": figures, "multi_class": multi_class}, indent=2) + "\n"
    OUTPUT.with_suffix(".json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
