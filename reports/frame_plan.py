"""Frame plans at video speed: reference/frame_plan.json.

Wall time from two 8-bit pictures in memory to projection codes, at 3840 x 2160 and 1920 x 1080, for n = 6 (K = 2) and
n = 9 (K = 3, 16 rounds of clip and correct), with affine mappings and with tables of 33 nodes; and how good the codes
are: against `invert` in codes (n = 6), and in predicted colour of the codes' own x on reachable pairs (n = 9). Labels
are random, which is the worst case for a table of clusters.

Run from a checkout, on a machine that does nothing else (a minute)::

    python -m reports.frame_plan
"""

from __future__ import annotations

import json
import timeit
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage import data
from skimage.transform import resize

from paxel_runtime.inversion import (
    EXACT,
    AffineMapping,
    MappingTable,
    build_mapping_table,
    frame_to_codes,
    invert,
    plan_frame,
)
from paxel_runtime.model.colorimetry import sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel
from reports.inversion_benchmark import MODELS, PAIRS

RESULT = Path(__file__).parent / "reference" / "frame_plan.json"
FRAMES = {"3840x2160": (2160, 3840), "1920x1080": (1080, 1920)}
SMALL = (270, 480)
MAPPINGS = AffineMapping(0.12, 24.0, 0.3), AffineMapping(0.15, 55.0, 0.3)
Pictures = list[NDArray[np.uint8]]


def pictures(shape: tuple[int, int]) -> Pictures:
    """Two photographs, 8-bit sRGB."""
    return [np.rint(255 * resize(getattr(data, name)()[..., :3], shape, order=1)).astype(np.uint8) for name in PAIRS[0]]


def mapped(Lab: NDArray[np.floating], mapping: AffineMapping) -> NDArray[np.floating]:
    """What an affine mapping is defined to do."""
    factors = np.array([mapping.L_gain, mapping.chroma_scale, mapping.chroma_scale])
    return Lab * factors + np.array([mapping.L_offset, 0.0, 0.0])


def tables() -> tuple[MappingTable, MappingTable]:
    """Tables of the two mappings."""
    first, second = (build_mapping_table(lambda Lab, m=m: mapped(Lab, m)) for m in MAPPINGS)
    return first, second


def seconds(model: PredictionModel, shape: tuple[int, int], by_table: bool) -> float:
    """Least wall time of nine frames."""
    labels = np.random.default_rng(0).integers(0, len(model.clusters), shape).astype(np.uint8)
    plan = plan_frame(model, labels, *(tables() if by_table else MAPPINGS))
    frames = pictures(shape)
    return min(timeit.repeat(lambda: frame_to_codes(plan, *frames), number=1, repeat=9))


def quality(model: PredictionModel) -> dict[str, Any]:
    """Share of reachable pixels within a code of the inversion, and dE00 of what the codes show there."""
    frames = pictures(SMALL)
    wanted = [mapped(sRGB_to_Lab(frame / 255), mapping) for frame, mapping in zip(frames, MAPPINGS, strict=True)]
    best = invert(wanted[0], wanted[1], model)
    reached = best.status == EXACT
    exact, found, rows = [], [], []
    for cluster in range(len(model.clusters)):
        labels = np.full(SMALL, cluster, np.uint8)
        channels = slice(cluster * len(model.channels), (cluster + 1) * len(model.channels))
        exact.append(np.rint(255 * model.response.x_to_P(best.x[..., channels])))
        found.append(frame_to_codes(plan_frame(model, labels, *MAPPINGS), *frames))
        fine = frame_to_codes(plan_frame(model, labels, *MAPPINGS, bits=16), *frames)
        rows.append(model.response.P_to_x(fine / 65535))
    apart = np.abs(np.concatenate(found, axis=-1) - np.concatenate(exact, axis=-1)).max(axis=-1)[reached]
    seen = model.predict(np.concatenate(rows, axis=-1))
    error = np.maximum(*(dE00(Lab, view)[reached] for Lab, view in zip(wanted, seen, strict=True) if view is not None))
    return {
        "reachable_share": float(reached.mean()),
        "within_one_code_of_invert": float(np.mean(apart <= 1)),
        "dE00_at_most_0.6": float(np.mean(error <= 0.6)),
        "dE00_p999": float(np.quantile(error, 0.999)),
        "dE00_max": float(error.max()),
    }


def main() -> None:
    """Measure both models and write the figures."""
    table: dict[str, Any] = {
        "what": "frame plans, two pictures, 2 threads: seconds a frame; quality on reachable pairs"
    }
    for name in ("K=2", "K=3"):
        model = MODELS[name]()
        times = {
            f"{size}_{kind}_s": seconds(model, shape, kind == "table")
            for size, shape in FRAMES.items()
            for kind in ("affine", "table")
        }
        figures = {key: float(f"{value:.4g}") for key, value in (times | quality(model)).items()}
        print(name, json.dumps(figures, indent=1))
        table[name] = figures
    RESULT.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
