"""Changes whose gain the installation's own records tell: adaptive mapping, and what extra readings teach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from paxel_design.what_if.case import Case
from paxel_design.what_if.changes import Change, Number

__all__ = ["recorded_changes"]

_ERROR = ("error of predicted colours, mean", "dE00")


def recorded_changes(case: Case) -> Iterator[Change]:
    """What adaptive mapping gains, what the correction does, and what better readings could do at best."""
    for path, record in sorted(case.records.items()):
        if path.startswith("projection/"):
            yield from _adaptive(record)
    accuracy = case.records.get("calibration/accuracy.json")
    if accuracy is not None:
        yield from _accuracy(accuracy)


def _adaptive(record: Mapping[str, Any]) -> Iterator[Change]:
    mapping = record.get("mapping") or {}
    gain = (mapping.get("adaptive") or {}).get("gain")
    if gain is None:
        return
    yield Change(
        f"adaptive-{record['name']}",
        "effect",
        "Adaptive mapping ({name})",
        "local contrast of both pictures",
        "times that of static mapping",
        1.0,
        float(gain),
        "records",
        "computing time alone",
        'method = "adaptive" under [mapping], then paxel project',
        in_use=mapping.get("method") == "adaptive",
        values={"name": Number(str(record["name"]))},
    )


def _accuracy(record: Mapping[str, Any]) -> Iterator[Change]:
    linear, now, floor = (_mean(part) for part in (record.get("linear"), record, record.get("noise_floor")))
    corrected = record.get("model") == "corrected"
    if corrected and linear is not None and now is not None:
        yield Change(
            "correction",
            "true",
            "The correction that the extra readings teach",
            *_ERROR,
            linear,
            now,
            "records",
            "nothing: every capture takes the extra readings",
            'correction = "auto" under [model], then paxel calibrate',
            less_is_better=True,
            in_use=True,
        )
    if now is None or floor is None:
        return
    values = {"floor": Number(floor, "dE00", 2)}
    if corrected:
        yield Change(
            "better-readings",
            "true",
            "More or quieter readings, at best (the readings' own noise is {floor} dE00)",
            *_ERROR,
            now,
            min(now, floor),
            "records",
            "a longer session",
            "positions = 5 under [meter], longer readings; then paxel capture, paxel calibrate",
            less_is_better=True,
            values=values,
        )
    else:
        yield Change(
            "correction",
            "true",
            "The correction that the extra readings teach, at best (down to their noise of {floor} dE00)",
            *_ERROR,
            now,
            min(now, floor),
            "records",
            "nothing: every capture takes the extra readings",
            'correction = "auto" under [model], then paxel calibrate',
            less_is_better=True,
            values=values,
        )


def _mean(figures: Mapping[str, Any] | None) -> float | None:
    """Mean dE00 over the surfaces of a part of ``accuracy.json``; None where it tells of none."""
    told = [(figures or {}).get(surface) or {} for surface in ("pattern", "white")]
    means = [float(one["dE00_mean"]) for one in told if one.get("dE00_mean") is not None]
    return float(np.mean(means)) if means else None
