"""The inversion beside the paper's own solver, in one run: reports/reference/inversion_benchmark.json.

Builds `dlib_bobyqa.cpp` (dlib's `find_min_bobyqa`, 2 threads) and lets both solve the same pixels: two pairs of real
photographs, mapped by L* x 0.43 + 12 on the pattern and x 0.45 + 40 on white, chroma x 0.5, most of which is out of
gamut; two photographs as they are for a single channel, which shows nearly every colour once it is mapped; and colours
of random inputs, all of which can be reached. Models: `measured` are made from measured spectra (DLP primaries, FOGRA39
inks, 15 % of the light of a cluster on its neighbours), `bench` are readings of the virtual bench (`bench_models.py`).

Time is CPU seconds a pixel, ours over at least a second of work; quality is dE00^2 + dE00^2 recomputed from x, against
dlib from the middle with a final radius of 1e-6, and against 20 random starts of dlib. With PAXEL_DATA set, quality is
measured on two more photographs that nothing was developed with. Whole 4K frames are timed, not extrapolated.

Run from a checkout, on a machine that does nothing else (Debian: apt-get install g++ libdlib-dev; eight minutes)::

    python -m reports.inversion_benchmark            (--quick: a tenth of the pixels, no frames, nothing written)
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
import timeit
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage import data, io
from skimage.transform import resize

from paxel_runtime.inversion import EXACT, AffineMapping, Inversion, frame_to_codes, invert, plan_frame
from paxel_runtime.model.colorimetry import Lab_to_XYZ, spectra_to_XYZ, sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.optics.spectra import primaries
from reports.bench_models import bench_model

Floats = NDArray[np.floating]
Pair = tuple[Floats, Floats | None]

RESULT = Path(__file__).parent / "reference" / "inversion_benchmark.json"
SOURCE = Path(__file__).parent / "dlib_bobyqa.cpp"
FRAME, SMALL = (2160, 3840), (540, 960)
PAIRS = (("rocket", "coffee"), ("rocket", "chelsea"))
SINGLES = ("coffee", "astronaut")
HELD_OUT = ("picosdeeuropa_by_Aitzol_Berasategi.jpg", "sunset_by_Aitzol_Berasategi.jpg")
ON_PATTERN, ON_WHITE, AS_IT_IS = (0.43, 12.0, 0.5), (0.45, 40.0, 0.5), (1.0, 0.0, 1.0)  # L* gain, offset, chroma scale
SPILL, BLACK_LEVEL = 0.15, 1e-3
CHANNELS = ("red", "green", "blue")
OUR_PIXELS = 60_000


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
DLIB_PIXELS = {"K=2": 2000, "K=3": 1200, "single channel": 6000, "K=6": 100}
RANDOM_START_PIXELS = {"K=2": 1000, "K=3": 1000, "single channel": 1000, "K=6": 30}


@cache
def photograph(name: str, shape: tuple[int, int], mapping: tuple[float, float, float]) -> Floats:
    """A photograph as wanted colours, (H, W, 3) float32; of skimage, or of PAXEL_DATA."""
    if name.endswith(".jpg"):
        sRGB = io.imread(Path(os.environ["PAXEL_DATA"]) / "pictures" / name)
    else:
        sRGB = getattr(data, name)()
    gain, offset, chroma = mapping
    Lab = resize(sRGB_to_Lab(sRGB[..., :3] / 255.0).astype(np.float32), shape, order=1, anti_aliasing=False)
    return Lab * np.float32([gain, chroma, chroma]) + np.float32([offset, 0.0, 0.0])


def photographs(pair: tuple[str, str], shape: tuple[int, int], two: bool) -> Pair:
    """Two photographs, or one for a single surface (the first of a pair)."""
    if not two:
        return photograph(pair[0], shape, AS_IT_IS), None
    return photograph(pair[0], shape, ON_PATTERN), photograph(pair[1], shape, ON_WHITE)


def sample(pair: Pair, count: int, seed: int) -> Pair:
    """Random pixels of two pictures."""
    at = np.random.default_rng(seed).integers(0, pair[0][..., 0].size, count)
    return _each(pair, lambda Lab: Lab.reshape(-1, 3)[at].astype(np.float64))


def _each(pair: Pair, change: Callable[[Floats], Floats]) -> Pair:
    return change(pair[0]), None if pair[1] is None else change(pair[1])


def pixels_of_pictures(two: bool, count: int) -> Pair:
    """Random pixels of both pairs, or of both single pictures."""
    names = PAIRS if two else [(name, name) for name in SINGLES]
    parts = [sample(photographs(pair, SMALL, two), count // 2, seed) for seed, pair in enumerate(names)]
    order = np.random.default_rng(9).permutation(count // 2 * 2)
    pattern = np.concatenate([part[0] for part in parts])[order]
    return pattern, np.concatenate([part[1] for part in parts if part[1] is not None])[order] if two else None


def out_of_gamut(pair: Pair, model: PredictionModel) -> tuple[Pair, float]:
    """The pixels that cannot be reached, and their share."""
    out = invert(*pair, model).status != EXACT
    return _each(pair, lambda Lab: Lab[out]), float(out.mean())


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


def middle(pair: Pair, model: PredictionModel) -> Floats:
    """The paper's start."""
    return np.full((len(pair[0]), model.n), 0.5)


def clipped_start(pair: Pair, model: PredictionModel) -> Floats:
    """The linear solution about the middle, clipped to the box."""
    surfaces = list(model.surfaces.values())
    A = np.concatenate([s.A for s in surfaces])
    black = np.concatenate([s.black for s in surfaces])
    XYZ = np.concatenate([Lab_to_XYZ(Lab, model.white_point) for Lab in pair if Lab is not None], axis=1)
    return np.clip(0.5 + (XYZ - black - A.sum(axis=1) / 2) @ np.linalg.pinv(A).T, 0.0, 1.0)


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


def speed(name: str, model: PredictionModel, program: Path, quick: bool) -> dict[str, Any]:
    """CPU time a pixel against dlib's, out of gamut and reachable."""
    two, few = model.white is not None, max(DLIB_PIXELS[name] // (10 if quick else 1), 20)
    missed, share = out_of_gamut(pixels_of_pictures(two, OUR_PIXELS // (10 if model.n > 12 else 1)), model)
    result, ours = timed(missed, model)
    some = _each(missed, lambda Lab: Lab[:few])
    _, from_middle = dlib(program, some, model, middle(some, model), 1e-4)
    _, from_clipped = dlib(program, some, model, clipped_start(some, model), 1e-4)
    inside = reachable(model, max(few // 4, 20), 5)
    _, dlib_inside = dlib(program, inside, model, middle(inside, model), 1e-4)
    _, ours_inside = timed(reachable(model, 200_000, 6), model)
    return {
        "out_of_gamut_share": share,
        "status": result.counts(),
        "our_us_a_pixel": ours * 1e6,
        "dlib_us_a_pixel": from_middle * 1e6,
        "ratio_out_of_gamut": from_middle / ours,
        "ratio_from_clipped_start": from_clipped / ours,
        "our_us_a_reachable_pixel": ours_inside * 1e6,
        "ratio_reachable": dlib_inside / ours_inside,
    }


def quality(pair: Pair, model: PredictionModel, program: Path) -> dict[str, Any]:
    """Our objective against dlib's with a final radius of 1e-6, out-of-gamut pixels alone."""
    ours = objective(invert(*pair, model).x, pair, model)
    fine, _ = dlib(program, pair, model, middle(pair, model), 1e-6)
    gap = ours - objective(fine, pair, model)
    return {
        "pixels": len(gap),
        "share_not_worse_than_dlib_by_1e-3": float(np.mean(gap <= 1e-3)),
        "worst_against_dlib": float(gap.max()),
        "share_better_than_dlib_by_1e-3": float(np.mean(gap < -1e-3)),
    }


def random_starts(pair: Pair, model: PredictionModel, program: Path) -> dict[str, Any]:
    """Our objective against the best of 20 random starts of dlib and one from the middle."""
    rng, ours = np.random.default_rng(3), objective(invert(*pair, model).x, pair, model)
    starts = [rng.random((len(ours), model.n)) for _ in range(20)]
    found = [dlib(program, pair, model, start, 1e-4)[0] for start in [middle(pair, model), *starts]]
    gap = ours - np.min([objective(x, pair, model) for x in found], axis=0)
    return {
        "pixels": len(gap),
        "share_of_pixels_with_a_better_one_by_1e-3": float(np.mean(gap > 1e-3)),
        "worst_against_best": float(gap.max()),
    }


def compare(name: str, kind: str, model: PredictionModel, program: Path, quick: bool) -> dict[str, Any]:
    """All figures of a model but whole frames."""
    two, tenth = model.white is not None, 10 if quick else 1
    figures = speed(name, model, program, quick)
    missed, _ = out_of_gamut(pixels_of_pictures(two, 10 * DLIB_PIXELS[name]), model)
    few = max(DLIB_PIXELS[name] // tenth, 20)
    figures["quality"] = quality(_each(missed, lambda Lab: Lab[-few:]), model, program)
    if kind == "bench":
        return figures
    if "PAXEL_DATA" in os.environ:
        unseen = sample(photographs(HELD_OUT, SMALL, two), 20 * few, 7)
        pair, share = out_of_gamut(unseen, model)
        if len(pair[0]):
            figures["quality_held_out"] = quality(_each(pair, lambda Lab: Lab[:few]), model, program)
            figures["quality_held_out"]["out_of_gamut_share"] = share
    few = max(RANDOM_START_PIXELS[name] // tenth, 10)
    figures["random_starts"] = random_starts(_each(missed, lambda Lab: Lab[:few]), model, program)
    return figures


def whole_frame(model: PredictionModel) -> dict[str, Any]:
    """Seconds of wall time for a 4K frame of photographs, and of reachable colours."""
    two = model.white is not None
    pair = photographs(PAIRS[0] if two else (SINGLES[0], ""), FRAME, two)
    invert(*_each(pair, lambda Lab: Lab[::40, ::40]), model)  # the compiler's time is none of the frame's
    begin = time.perf_counter()
    result = invert(*pair, model)
    figures: dict[str, Any] = {"photographs_s": time.perf_counter() - begin}
    figures["out_of_gamut_share"] = float(np.mean(result.status != EXACT))
    del result
    if model.n > 12:
        return figures
    rng = np.random.default_rng(0)  # of rows: the frame's float64 pictures would fill the memory
    rows = [model.predict(rng.random((FRAME[0] // 8, FRAME[1], model.n))) for _ in range(8)]
    inside = (
        np.concatenate([row[0].astype(np.float32) for row in rows]),
        np.concatenate([row[1].astype(np.float32) for row in rows if row[1] is not None]) if two else None,
    )
    figures["reachable_s"] = min(timeit.repeat(lambda: invert(*inside, model), number=1, repeat=2))
    return figures | ({"frame_plan_s": frame_plan_seconds(model)} if two else {})


def frame_plan_seconds(model: PredictionModel) -> float:
    """Least wall time of five 4K frames, from two 8-bit pictures in memory to codes."""
    labels = np.random.default_rng(0).integers(0, len(model.clusters), FRAME).astype(np.uint8)
    frames = [
        np.rint(resize(getattr(data, name)()[..., :3].astype(np.float32), FRAME, order=1)).astype(np.uint8)
        for name in PAIRS[0]
    ]
    plan = plan_frame(model, labels, AffineMapping(0.12, 24.0, 0.3), AffineMapping(0.15, 55.0, 0.3))
    frame_to_codes(plan, *frames)
    return min(timeit.repeat(lambda: frame_to_codes(plan, *frames), number=1, repeat=5))


def main() -> None:
    """Build dlib's program, measure every model and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the pixels, no whole frames, nothing written")
    quick = parser.parse_args().quick
    table: dict[str, Any] = {"what": "inversion against dlib's BOBYQA in one run, 2 threads", "pairs": PAIRS}
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "dlib_bobyqa"
        flags = ["-O3", "-march=native", "-std=c++17"]
        subprocess.run(["g++", *flags, str(SOURCE), "-o", str(program), "-lpthread", "-ldlib"], check=True)
        for name, make in MODELS.items():
            table[name] = {
                kind: compare(name, kind, model, program, quick)
                for kind, model in (("measured", make()), ("bench", bench_model(name)))
            }
            if not quick:
                table[name]["frame_3840x2160"] = whole_frame(make())
            print(name, json.dumps(rounded(table[name]), indent=1), flush=True)
    if not quick:
        RESULT.write_text(json.dumps(rounded(table), indent=2) + "\n", encoding="utf-8")


def rounded(value: Any) -> Any:
    """The same with 4 significant digits."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
