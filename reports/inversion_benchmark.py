"""The inversion beside the paper's own solver, in one run: reports/reference/inversion_benchmark.json.

Builds `dlib_bobyqa.cpp` (dlib's `find_min_bobyqa`, 2 threads) and lets both solve the same pixels: two pairs of real
photographs, mapped by L* x 0.43 + 12 on the pattern and x 0.45 + 40 on white, chroma x 0.5, most of which is out of
gamut; and colours of random inputs, all of which can be reached. Time is CPU seconds a pixel on 2 threads; quality is
dE00^2 + dE00^2 recomputed from x, against dlib from the middle with a final radius of 1e-6. Whole 4K frames are
measured, not extrapolated.

Models are made from measured spectra: DLP primaries, FOGRA39 inks, 15 % of the light of a cluster on its neighbours.

Run from a checkout, on a machine that does nothing else (Debian: apt-get install g++ libdlib-dev; 6 minutes)::

    python -m reports.inversion_benchmark            (--quick: a tenth of the pixels)
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage import data
from skimage.transform import resize

from paxel_runtime.inversion import Inversion, invert
from paxel_runtime.inversion.frame_plan import AffineMapping, frame_to_codes, plan_frame
from paxel_runtime.model.colorimetry import spectra_to_XYZ, sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.optics.spectra import primaries

Floats = NDArray[np.floating]
Pair = tuple[Floats, Floats | None]

RESULT = Path(__file__).parent / "reference" / "inversion_benchmark.json"
SOURCE = Path(__file__).parent / "dlib_bobyqa.cpp"
FRAME = (2160, 3840)
PAIRS = (("astronaut", "coffee"), ("chelsea", "rocket"))
SPILL, BLACK_LEVEL = 0.15, 1e-3
CHANNELS = ("red", "green", "blue")


def measured_model(colorants: tuple[str, ...], channels: tuple[str, ...] = CHANNELS, white: bool = True) -> Any:
    """A model from measured spectra; a mixed cluster is named ``black+white``; one channel is all primaries at once."""
    library = colorant_library()
    paper = library["white"].reflectance
    inks = [np.mean([library[part].reflectance for part in name.split("+")], axis=0) for name in colorants]
    own, rest = np.array(inks), np.mean(inks, axis=0)
    seen = (1 - SPILL) * own + SPILL * rest
    light = primaries(CHANNELS)
    light = light if len(channels) == 3 else light.sum(axis=0, keepdims=True)
    K = len(colorants)
    on_paper = np.array([light_j * paper / K for _ in range(K) for light_j in light])
    on_print = np.array([light_j * ink / K for ink in seen for light_j in light])
    scale = float(spectra_to_XYZ(on_paper.sum(axis=0) if white else on_print.sum(axis=0))[1])
    A = {name: spectra_to_XYZ(s).T / scale for name, s in (("pattern", on_print), ("white", on_paper))}
    surfaces = {name: SurfaceModel((1 - BLACK_LEVEL) * a, BLACK_LEVEL * a.sum(axis=1)) for name, a in A.items()}
    ramp = np.tile([0.0, 1.0], (len(channels), 1))
    return PredictionModel(
        channels=channels,
        clusters=colorants,
        pattern=surfaces["pattern"],
        white=surfaces["white"] if white else None,
        white_point=A["white" if white else "pattern"].sum(axis=1),
        response=ProjectorResponse(ramp, ramp),
    )


MODELS: dict[str, Callable[[], PredictionModel]] = {
    "K=2": lambda: measured_model(("black", "white")),
    "K=3": lambda: measured_model(("black", "white", "black+white")),
    "single channel": lambda: measured_model(("red", "green", "blue"), ("white",), white=False),
    "K=6": lambda: measured_model(("cyan", "magenta", "yellow", "red", "green", "blue")),
}


def photographs(pair: tuple[str, str], shape: tuple[int, int], two: bool) -> Pair:
    """Two photographs as wanted colours, float32."""
    wanted: list[Floats] = []
    for name, (gain, offset) in zip(pair, ((0.43, 12.0), (0.45, 40.0)), strict=True):
        sRGB = resize(getattr(data, name)()[..., :3], shape, order=1, anti_aliasing=False)
        Lab = sRGB_to_Lab(sRGB).astype(np.float32)
        wanted.append(Lab * np.float32([gain, 0.5, 0.5]) + np.float32([offset, 0.0, 0.0]))
    return wanted[0], wanted[1] if two else None


def sample(pair: Pair, count: int, seed: int) -> Pair:
    """Random pixels of two pictures."""
    at = np.random.default_rng(seed).integers(0, pair[0][..., 0].size, count)
    first, second = (None if Lab is None else Lab.reshape(-1, 3)[at].astype(np.float64) for Lab in pair)
    assert first is not None
    return first, second


def reachable(model: PredictionModel, count: int, seed: int) -> Pair:
    """Colours of random inputs."""
    return model.predict(np.random.default_rng(seed).uniform(0, 1, (count, model.n)))


def dlib(program: Path, pair: Pair, model: PredictionModel, start: Floats, rho_end: float) -> tuple[Floats, float]:
    """x of dlib's BOBYQA and its CPU seconds a pixel."""
    surfaces = [model.pattern] if pair[1] is None else [model.pattern, model.white]
    Lab = np.stack([Lab for Lab in pair if Lab is not None], axis=1)
    parts = [[s.A for s in surfaces if s], [s.black for s in surfaces if s], model.white_point, Lab, start]
    with tempfile.TemporaryDirectory() as folder:
        problem, answer = Path(folder) / "problem.bin", Path(folder) / "answer.bin"
        with problem.open("wb") as file:
            np.array([model.n, len(surfaces), len(Lab)], np.int64).tofile(file)
            for part in parts:
                np.ascontiguousarray(part, np.float64).tofile(file)
        subprocess.run([program, problem, answer, str(rho_end)], check=True)
        result = np.fromfile(answer)
    return result[:-1].reshape(len(Lab), model.n), float(result[-1]) / len(Lab)


def objective(x: Floats, pair: Pair, model: PredictionModel) -> Floats:
    """dE00^2 + dE00^2 at given inputs."""

    seen = model.predict(x)
    return sum(
        dE00(Lab, view) ** 2 for Lab, view in zip(pair, seen, strict=True) if Lab is not None and view is not None
    )


def timed(pair: Pair, model: PredictionModel, least_seconds: float = 1.0) -> tuple[Inversion, float]:
    """Our answer, and CPU seconds a pixel over at least a second of work."""
    result = invert(*pair, model)
    runs, begin = 0, time.process_time()
    while time.process_time() - begin < least_seconds:
        invert(*pair, model)
        runs += 1
    return result, (time.process_time() - begin) / runs / len(pair[0])


def compare(name: str, model: PredictionModel, program: Path, count: int) -> dict[str, Any]:
    """Ratios of CPU time and figures of quality on both pairs, and on reachable colours."""
    two = model.white is not None
    shape = (540, 960)
    pictures = [sample(photographs(pair, shape, two), count // 2, seed) for seed, pair in enumerate(PAIRS)]
    wanted: Pair = (
        np.concatenate([p[0] for p in pictures]),
        np.concatenate([p[1] for p in pictures if p[1] is not None]) if two else None,
    )
    every, _ = timed(wanted, model)
    out = every.status != 0
    missed: Pair = (wanted[0][out], None if wanted[1] is None else wanted[1][out])
    middle = np.full((int(out.sum()), model.n), 0.5)
    ours, our_seconds = timed(missed, model)
    _, paper_seconds = dlib(program, missed, model, middle, 1e-4)
    clipped = np.clip(ours.x, 0.02, 0.98)
    _, clipped_seconds = dlib(program, missed, model, clipped, 1e-4)
    fine, _ = dlib(program, missed, model, middle, 1e-6)
    gap = objective(ours.x, missed, model) - objective(fine, missed, model)
    inside = reachable(model, max(count // 4, 200), 5)
    many = reachable(model, 200_000, 6)
    _, our_inside = timed(many, model)
    _, paper_inside = dlib(program, inside, model, np.full((len(inside[0]), model.n), 0.5), 1e-4)
    return {
        "pixels": len(missed[0]),
        "out_of_gamut_share": float(out.mean()),
        "our_us_a_pixel": our_seconds * 1e6,
        "dlib_us_a_pixel": paper_seconds * 1e6,
        "ratio_out_of_gamut": paper_seconds / our_seconds,
        "ratio_from_our_answer": clipped_seconds / our_seconds,
        "our_us_a_reachable_pixel": our_inside * 1e6,
        "ratio_reachable": paper_inside / our_inside,
        "share_not_worse_than_dlib_by_1e-3": float(np.mean(gap <= 1e-3)),
        "worst_against_dlib": float(gap.max()),
        "share_better_than_dlib_by_1e-3": float(np.mean(gap < -1e-3)),
    }


def whole_frame(model: PredictionModel) -> dict[str, Any]:
    """Seconds of wall time for a 4K frame of photographs, and of reachable colours."""
    two = model.white is not None
    pair = photographs(PAIRS[0], FRAME, two)
    begin = time.perf_counter()
    counts = invert(*pair, model).counts()
    photos = time.perf_counter() - begin
    x = np.random.default_rng(0).uniform(0, 1, (*FRAME, model.n)).astype(np.float32)
    inside = tuple(None if Lab is None else Lab.astype(np.float32) for Lab in model.predict(x))
    del x
    begin = time.perf_counter()
    invert(*inside, model)  # type: ignore[arg-type]
    figures = {"photographs_s": photos, "reachable_s": time.perf_counter() - begin, "status": counts}
    return figures | {"frame_plan_s": frame_plan_seconds(model)} if two and model.n <= 9 else figures


def frame_plan_seconds(model: PredictionModel) -> float:
    """Least wall time of five 4K frames, from two 8-bit pictures in memory to codes."""
    labels = np.random.default_rng(0).integers(0, len(model.clusters), FRAME).astype(np.uint8)
    frames = [
        np.rint(255 * resize(getattr(data, name)()[..., :3], FRAME, order=1)).astype(np.uint8) for name in PAIRS[0]
    ]
    plan = plan_frame(model, labels, AffineMapping(0.12, 24.0, 0.3), AffineMapping(0.15, 55.0, 0.3))
    frame_to_codes(plan, *frames)
    return min(timeit.repeat(lambda: frame_to_codes(plan, *frames), number=1, repeat=5))


def main() -> None:
    """Build dlib's program, measure every model and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the pixels, no whole frames")
    quick = parser.parse_args().quick
    table: dict[str, Any] = {"what": "inversion against dlib's BOBYQA in one run, 2 threads", "pairs": PAIRS}
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "dlib_bobyqa"
        flags = ["-O3", "-march=native", "-std=c++17"]
        subprocess.run(["g++", *flags, str(SOURCE), "-o", str(program), "-lpthread", "-ldlib"], check=True)
        for name, make in MODELS.items():
            model = make()
            count = {"K=6": 1200}.get(name, 6000) // (10 if quick else 1)
            table[name] = compare(name, model, program, count)
            if not quick:
                table[name]["frame_3840x2160"] = whole_frame(model)
            print(name, json.dumps(table[name], indent=1))
    RESULT.write_text(json.dumps(rounded(table), indent=2) + "\n", encoding="utf-8")


def rounded(value: Any) -> Any:
    """The same with 4 significant digits."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
