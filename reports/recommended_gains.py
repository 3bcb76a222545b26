"""Gains that a report recommends, against whole calibrations of the changed installation on the virtual bench.

A small installation is printed, captured and calibrated as it is, and once more for each change. What
`paxel_design.what_if` foretells from the first alone is compared with what the others measured. Figures go to
reports/reference/recommended_gains.json; the report quotes the largest deviations.

Run from a checkout (a quarter of an hour)::

    python -m reports.recommended_gains
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from paxel_design.stages.print_sheet import make_print
from paxel_design.what_if import Change, case_of, common_range, possible_changes, room_of
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
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
Settings = dict[str, Any]
BEGINS: dict[str, tuple[str, Settings]] = {
    "0.75 mm, K = 3": ("bw-checkerboard", {}),
    "0.75 mm, K = 2": ("bw-checkerboard", {"clusters.count": 2}),
    "0.5 mm, K = 3": ("bw-checkerboard", {"pattern.dot_size_mm": 0.5}),
    "UV inks, K = 3": ("uv-rgb", {}),
}
"""What is calibrated first: a preset, and what is changed in it."""

CHANGES: dict[str, tuple[tuple[str, str, Settings], ...]] = {
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
    "UV inks, K = 3": (
        ("dot-size-1", "dots of 1 mm", {"pattern.dot_size_mm": 1.0}),
        ("clusters-4", "K = 4", {"clusters.count": 4}),
    ),
}  # fmt: skip
"""Keys of `Change`, and the settings that make it."""


def calibrated(folder: Path, preset: str, changes: Settings) -> tuple[Installation, PredictionModel]:
    """An installation printed, captured and calibrated on the bench, and its model."""
    folder.mkdir(parents=True)
    ink = colorant_library()["black"].reflectance / 2
    rows = [f"{nm},{value:.6f}" for nm, value in zip(WAVELENGTHS_NM, ink, strict=True)]
    (folder / "black.csv").write_text("\n".join(["wavelength_nm,reflectance", *rows]) + "\n", encoding="utf-8")
    installation = Installation.create(folder, make_settings(preset, SIZE | changes))
    make_print(installation)
    capture(installation, open_devices(installation), lambda *_: None)
    calibrate(installation)
    return installation, load_model(folder / "calibration" / "model.json")


def compared(change: Change, model: PredictionModel, then: PredictionModel) -> dict[str, Any]:
    """The effect that a change foretells from the model as it is, and what the changed installation has."""
    now, later = room_of(model), room_of(then)
    figure, before, foretold, measured = change.figure, change.before, change.after, later.contrast
    if change.aim == "shared":
        shared = common_range(then)
        measured = shared[1] - shared[0] if shared else 0.0
    elif change.aim == "seen":  # smaller dots are told by their distance; here by what they cost
        effect = change.values["effect"].value
        assert isinstance(effect, float)
        figure, before = "contrast of two free pictures", now.contrast
        foretold = before * (1 + effect / 100)
    elif model.white is None:
        measured = later.volume
    row: dict[str, Any] = {
        "figure": figure,
        "unit": "CIELAB^3" if model.white is None else "L*",
        "before": before,
        "foretold": foretold,
        "measured": measured,
    }
    if change.volume_gain is not None:
        row["volume_gain"] = {"foretold": change.volume_gain, "measured": later.volume / now.volume - 1}
    return row


def main() -> None:
    changes: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as scratch:
        for k, (begin, (preset, settings)) in enumerate(BEGINS.items()):
            installation, model = calibrated(Path(scratch) / f"begin-{k}", preset, settings)
            foretold = {change.key: change for change in possible_changes(case_of(model, installation))}
            for key, words, changed in CHANGES[begin]:
                _, then = calibrated(Path(scratch) / f"then-{k}-{key}", preset, settings | changed)
                changes.append({"from": begin, "to": words, **compared(foretold[key], model, then)})
                print(changes[-1], flush=True)
    off = [abs(row["foretold"] - row["measured"]) for row in changes if row["unit"] == "L*"]
    share = [abs(row["foretold"] / row["measured"] - 1) for row in changes if row["unit"] == "CIELAB^3"]
    result = {
        "what": "gains that a report recommends, foretold from the present calibration and measured after the change",
        "measured_on": "virtual bench, realistic",
        "largest_deviation_L": max(off),
        "largest_deviation_of_volume": max(share),
        "changes": changes,
    }
    RESULT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(f"foretold to {max(off):.2f} L*, and volumes of one surface to {max(share):.1%}")


if __name__ == "__main__":
    main()
