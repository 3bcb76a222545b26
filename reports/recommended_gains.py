"""Gains that a report recommends, against whole calibrations of the changed installation on the virtual bench.

A small installation is printed, captured and calibrated as it is, and once more for each change. What
`paxel_design.what_if` foretells from the first alone is compared with what the others measured. Figures go to
reports/reference/recommended_gains.json; the report quotes the largest deviation.

Run from a checkout (a quarter of an hour)::

    python -m reports.recommended_gains
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from paxel_design.stages.print_sheet import make_print
from paxel_design.what_if import case_of, common_range, possible_changes, room_of
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibrate, open_devices
from paxel_runtime.storage import load_model

RESULT = Path(__file__).parent / "reference" / "recommended_gains.json"
SIZE: dict[str, Any] = {
    "projector.resolution": [480, 270],
    "projector.width_mm": 70.3,
    "pattern.size_mm": [80, 50],
    "camera.resolution": [1024, 768],
}
BEGINS: dict[str, dict[str, Any]] = {
    "0.75 mm, K = 3": {},
    "0.75 mm, K = 2": {"clusters.count": 2},
    "0.5 mm, K = 3": {"pattern.dot_size_mm": 0.5},
}
CHANGES: dict[str, tuple[tuple[str, str, dict[str, Any]], ...]] = {
    "0.75 mm, K = 3": (
        ("dot-size-0.62", "dots of 0.62 mm", {"pattern.dot_size_mm": 0.62}),
        ("dot-size-1", "dots of 1 mm", {"pattern.dot_size_mm": 1.0}),
        ("clusters-5", "K = 5", {"clusters.count": 5}),
        ("sorted-by-design", "sorted by the design", {"clusters.method": "design"}),
        ("darker-ink", "black ink of half the reflectance", {"colorants.black.reflectance": "black.csv"}),
        ("finer-raster", "twice the pixels across",
         {"projector.resolution": [960, 540], "camera.resolution": [2048, 1536]}),
        ("ambient", "room light of 1 %", {"bench.ambient": 0.01}),
        ("gray-sheet-0.5", "a gray second sheet", {"model.second_surface": "gray"}),
    ),
    "0.75 mm, K = 2": (("clusters-3", "K = 3", {"clusters.count": 3}),),
    "0.5 mm, K = 3": (("dot-size-0.75", "dots of 0.75 mm", {"pattern.dot_size_mm": 0.75}),),
}  # fmt: skip


def calibrated(folder: Path, changes: dict[str, Any]) -> tuple[Installation, PredictionModel]:
    """An installation printed, captured and calibrated on the bench, and its model."""
    folder.mkdir(parents=True)
    ink = colorant_library()["black"].reflectance / 2
    rows = [f"{nm},{value:.6f}" for nm, value in zip(range(380, 785, 5), ink, strict=True)]
    (folder / "black.csv").write_text("wavelength_nm,reflectance\n" + "\n".join(rows) + "\n", encoding="utf-8")
    installation = Installation.create(folder, make_settings("bw-checkerboard", SIZE | changes))
    make_print(installation)
    capture(installation, open_devices(installation), lambda *_: None)
    calibrate(installation)
    return installation, load_model(folder / "calibration" / "model.json")


def compared(key: str, installation: Installation, model: PredictionModel, then: PredictionModel) -> dict[str, Any]:
    """A change's figure foretold from the model as it is, and measured on the changed installation."""
    change = next(c for c in possible_changes(case_of(model, installation)) if c.key == key)
    if change.aim == "shared":
        shared = common_range(then)
        measured = shared[1] - shared[0] if shared else 0.0
    else:
        measured = room_of(then).contrast
    row: dict[str, Any] = {
        "figure": change.figure,
        "unit": change.unit,
        "before": change.before,
        "foretold": change.after,
        "measured": measured,
        "off": change.after - measured,
    }
    if change.aim == "seen":  # a smaller dot is told by its least distance; here by what it costs
        row |= {"figure": "contrast of two free pictures", "unit": "L*", "before": room_of(model).contrast}
        row["foretold"] = row["before"] * (1 + float(change.values["effect"].value) / 100)  # type: ignore[arg-type]
        row["off"] = row["foretold"] - measured
    if change.volume_gain is not None:
        now, later = room_of(model).volume, room_of(then).volume
        row["volume"] = {"foretold_gain": change.volume_gain, "measured_gain": later / now - 1}
    return row


def main() -> None:
    result: dict[str, Any] = {
        "what": "gains that a report recommends, foretold from the present calibration and measured after the change",
        "measured_on": "virtual bench, realistic",
        "changes": [],
    }
    with tempfile.TemporaryDirectory() as scratch:
        for k, (begin, settings) in enumerate(BEGINS.items()):
            installation, model = calibrated(Path(scratch) / f"begin-{k}", settings)
            for key, words, changed in CHANGES[begin]:
                _, then = calibrated(Path(scratch) / f"then-{k}-{key}", settings | changed)
                row = {"from": begin, "to": words, **compared(key, installation, model, then)}
                result["changes"].append(row)
                print(row, flush=True)
    off = [row["off"] for row in result["changes"] if row["unit"] == "L*"]
    result["largest_deviation_L"] = float(np.max(np.abs(off)))
    RESULT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(f"largest deviation: {result['largest_deviation_L']:.2f} L*")


if __name__ == "__main__":
    main()
