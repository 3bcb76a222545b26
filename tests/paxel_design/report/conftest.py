"""A calibrated installation with stand-in records, and what every figure of a report has to keep."""

import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paxel_design.report.content import Quantity
from paxel_design.stages.print_sheet import make_print
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.printed import load_pattern
from paxel_runtime.settings import make_settings
from paxel_runtime.storage import model_to_dict, write_image, write_json, write_npz

W, H = 240, 135
SETTINGS = {
    "projector.resolution": [W, H],
    "projector.width_mm": 35.1,
    "pattern.size_mm": [50.0, 40.0],
    "camera.resolution": [320, 240],
    "meter.aperture_mm": 10.0,
    "clusters.count": 2,
}
FINISHED = "2026-03-04T05:06:07+00:00"


def _errors(mean: float) -> dict[str, float]:
    return {"dE00_mean": mean, "dE00_p95": 2 * mean, "dE00_max": 5 * mean}


def _both(mean: float) -> dict[str, Any]:
    return {"pattern": _errors(mean), "white": _errors(1.25 * mean)}


ACCURACY: dict[str, Any] = {
    "n": 100,
    "model": "corrected",
    "kind": "spectral",
    "measured_on": "virtual bench, realistic",
    **_both(0.3),
    "linear": _both(0.7),
    "CAM16_UCS": {s: {"dE_mean": 0.31, "dE_p95": 0.6, "dE_max": 1.1} for s in ("pattern", "white")},
    "by_input": {
        s: {"per_cluster": {"black": 0.21, "white": 0.35}, "per_channel": {"red": 0.3, "green": 0.29, "blue": 0.32}}
        for s in ("pattern", "white")
    },
    "noise_floor": {s: {"readings": 7, "dE00_mean": 0.16, "dE00_max": 0.33} for s in ("pattern", "white")},
    "other_K": {"3": _both(0.2)},
    "extra_readings": {
        "readings": 60,
        "refined_A": {
            "used": True,
            "gain_dE00": 0.23,
            "standard_error": 0.02,
            **{
                s: {"dE00_mean_before": 0.5, "dE00_mean_after": 0.3, "dE00_max_after": 1.4}
                for s in ("pattern", "white")
            },
        },
        "correction": {"used": False, "gain_dE00": 0.01, "standard_error": 0.02},
    },
}

CALIBRATION: dict[str, Any] = {
    "registration": {
        channel: {
            "verdict": "good: points scatter little",
            "residual_rms_px": rms,
            "residual_p95_px": 2.4 * rms,
            "residual_max_px": 5 * rms,
            "coverage": 0.99,
            "measured": 0.81,
            "outliers": 0.001,
            "plane_rms_px": 0.24,
            "plane_max_px": 0.75,
        }
        for channel, rms in (("red", 0.18), ("green", 0.17), ("blue", 0.7))
    },
    "registration_report": {
        "verdict": "good",
        "why": "points scatter little",
        "chromatic_aberration": {c: {"rms_px": 0.14, "max_px": 0.26, "mean_px": 0.002} for c in ("red", "blue")},
    },
    "clusters": {
        "2": {
            "names": ["black", "white"],
            "shares": [0.5346, 0.4654],
            "purity": {"black": {"black": 0.91, "white": 0.09}, "white": {"black": 0.26, "white": 0.74}},
            "centres_Lab": [[29.9, 0.1, 0.2], [88.6, 0.0, 0.1]],
            "suggested_count": 3,
            "reason": "of the pixels light about equally black and white 16%: an edge cluster keeps them out of both",
        }
    },
    "field_ratios": {k: {c: [0.06, 0.07, 0.09] for c in ("red", "green", "blue")} for k in ("black", "white")},
    "honesty": {
        "word": "noticeable",
        "findings": [
            {
                "question": "white",
                "word": "noticeable",
                "figure": -0.02,
                "verdict": "full white has 97.7% of the light",
            },
            {
                "question": "near black",
                "word": "honest",
                "figure": 0.0,
                "verdict": "codes 4, 8, 16 are told from black",
            },
        ],
    },
    "drift": {
        s: {"checks": 9, "range_percent": 0.57, "slope_percent": -0.4, "corrected": True, "rms_percent": 0.13}
        for s in ("white", "pattern")
    },
    "readings_from": "captures/measurements.csv",
    "warnings": ["meter.aperture_mm: the spot holds few periods of the pattern"],
}


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory: pytest.TempPathFactory, bw_model: Callable[[int], PredictionModel]) -> Installation:
    """From print to calibration, on the virtual bench as its records say; nobody changes it."""
    installation = Installation.create(
        tmp_path_factory.mktemp("report") / "show", make_settings("bw-checkerboard", SETTINGS)
    )
    make_print(installation)
    for name in ("captures", "calibration"):
        installation.folder(name).mkdir()
    captures, calibration = installation.folder("captures"), installation.folder("calibration")
    x = (np.arange(W) - W / 2 + 0.5) * 35.1 / W
    y = (H / 2 - 0.5 - np.arange(H)) * 35.1 / W
    write_image(calibration / "clusters.png", load_pattern(installation).label(x[None], y[:, None]))
    rng = np.random.default_rng(5)
    maps = {f"residual_rms_px_{c}": rng.random((17, 30), np.float32) for c in ("red", "green", "blue")}
    maps["residual_rms_px_blue"][:4] = np.nan
    write_npz(captures / "registration.npz", **maps)
    write_json(captures / "complete.json", {"finished": FINISHED, "pictures": 120, "readings": 676})
    write_json(captures / "exposures.json", {"inputs": installation.inputs("captures"), "exposures": []})
    write_json(calibration / "model.json", model_to_dict(bw_model(2)))
    write_json(calibration / "accuracy.json", ACCURACY)
    write_json(calibration / "calibration.json", {"inputs": installation.inputs("calibration"), **CALIBRATION})
    return installation


@pytest.fixture(scope="session")
def check_sources() -> Callable[[Mapping[str, Quantity], Path], int]:
    """Follow every JSON pointer of quantities into an installation's files; returns how many there were."""

    def check(quantities: Mapping[str, Quantity], root: Path) -> int:
        followed = 0
        for name, quantity in quantities.items():
            assert quantity.source, name
            match = re.fullmatch(r"([^ #]+\.json)#/(.+?)( x 100)?", quantity.source)
            if match is None:
                assert "#/" not in quantity.source or " " in quantity.source, name
                continue
            value = json.loads((root / match[1]).read_text(encoding="utf-8"))
            for key in match[2].split("/"):
                value = value[int(key)] if isinstance(value, list) else value[key]
            told = list(quantity.value) if isinstance(quantity.value, tuple) else quantity.value
            if match[3]:
                assert math.isclose(float(told), 100 * value, rel_tol=1e-12), name  # type: ignore[arg-type]
            else:
                assert told == value, name
            followed += 1
        return followed

    return check
