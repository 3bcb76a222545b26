"""`paxel advise`: its table, its pictures, its record, and the chosen layout in a paxel.toml."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from paxel_design.advice import Advice, Candidate
from paxel_design.advice.ranking import pareto
from paxel_runtime.errors import InputError
from paxel_runtime.settings import change_toml, load_settings, make_settings, settings_to_toml
from paxel_runtime.storage import write_atomically, write_json

__all__ = ["advice_record", "write_advice", "write_choice"]


def advice_record(advice: Advice) -> dict[str, Any]:
    """``advice.json``: the setup, every candidate's figures, the best with their reasons."""
    front = {candidate.name for candidate in pareto(advice.candidates)}
    return {
        "setup": {**asdict(advice.setup), "K": advice.setup.clusters, "pixel_pitch_mm": advice.setup.pitch_mm},
        "unit": "visibilities are thresholds of contrast: 1 is just seen, 10 is plain",
        "best": [_row(candidate) for candidate in advice.best],
        "candidates": [{**_row(c), "pareto": c.name in front} for c in advice.candidates],
    }


def _row(candidate: Candidate) -> dict[str, Any]:
    effect = candidate.effect
    period_mm = candidate.moire.period_mm
    row: dict[str, Any] = {
        "layout": candidate.layout,
        "angle_deg": candidate.angle_deg,
        "dot_size_mm": candidate.dot_size_mm,
        "dot_px": candidate.asked_dot_px,
        "printer_step_px": list(candidate.step_px) if candidate.step_px else None,
        "score": candidate.score,
        "print_visibility": candidate.seen,
        "moire_visibility": candidate.moire.visibility,
        "moire_period_mm": period_mm if period_mm != float("inf") else None,
        "L_pattern": effect.L_pattern,
        "L_white": effect.L_white,
    }
    if effect.volume_pattern is not None:
        row |= {"volume_pattern": effect.volume_pattern, "volume_white": effect.volume_white}
    return row | ({"reasons": list(candidate.reasons)} if candidate.reasons else {})


def write_advice(advice: Advice, out: Path) -> dict[str, Any]:
    """Write ``advice.json``, ``advice.png`` (heat maps) and ``pareto.png`` into a folder; returns the record."""
    from paxel_design.advice.figures import write_heat_map, write_pareto  # matplotlib is heavy

    if out.exists() and not out.is_dir():
        raise InputError(f"--out must be a folder, and {out} is a file")
    out.mkdir(parents=True, exist_ok=True)
    record = advice_record(advice)
    write_json(out / "advice.json", record)
    for name, write in (("advice.png", write_heat_map), ("pareto.png", write_pareto)):
        write_atomically(out / name, partial(write, advice=advice))
    return record


def write_choice(advice: Advice, path: Path) -> dict[str, Any]:
    """Write the best layout, and the setup it was chosen for, into a paxel.toml; returns the keys that it set.

    A file that is there keeps its other keys and its comments; one that is not is made with every key.

    Raises
    ------
    SettingsError
        If the file that is there cannot be read, or a key does not go with its others; it stays as it was.
    """
    setup, best = advice.setup, advice.best[0]
    values: dict[str, Any] = {
        "pattern.layout": best.layout,
        "pattern.colorants": list(setup.colorants),
        "pattern.dot_size_mm": round(best.dot_size_mm, 6),
        "pattern.angle_deg": round(best.angle_deg, 6),
        "pattern.snap": best.step_px is not None,
        "printer.dpi": round(setup.dpi),
        "projector.resolution": list(setup.resolution),
        "projector.width_mm": setup.width_mm,
        "clusters.count": setup.clusters,
        "viewing.distance_mm": setup.distance_mm,
        "viewing.luminance_cd_m2": setup.luminance_cd_m2,
    }
    if path.exists():
        load_settings(path)  # an error of the file as it is tells its own line
        text = change_toml(path.read_text(encoding="utf-8"), values)
    else:
        columns, rows = setup.resolution
        size_mm = [setup.width_mm, round(setup.width_mm * rows / columns, 1)]
        text = settings_to_toml(make_settings(overrides={**values, "pattern.size_mm": size_mm}))

    def checked(to: Path) -> None:
        to.write_text(text, encoding="utf-8")
        load_settings(to)

    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, checked)
    return values
