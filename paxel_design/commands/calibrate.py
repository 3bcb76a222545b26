"""`paxel calibrate`: from captures to a prediction model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paxel_design.commands.options import Dir, Force, Json
from paxel_design.commands.running import run_stage
from paxel_design.console import say

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation

__all__ = ["calibrate"]

_DRIFT_TOLD = 0.5
"""Percent of drift that is worth a line."""

_SPREADS = ("as_read", "local_white")


def calibrate(
    dir: Dir,
    readings: Annotated[
        Path | None,
        typer.Option(
            help="readings of your own meter, named after their exposures: CSV, CGATS/.ti3, .spdx or a folder"
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Fit the prediction model from the captures and state its error on random projections (dE00).

    Tells whether the projector is honest (light adds up, no sharpening or scaling) and what to switch off, how far
    the light drifted, and whether another number of clusters is advised. A correction is learnt from extra readings
    where it helps ([model] correction). Pictures: calibration/accuracy.png, registration.png, cluster-map.png.
    """
    from paxel_runtime.stages import calibrate as run_calibrate

    def run(installation: Installation, progress: Callable[[str, int, int], None]) -> dict[str, Any]:
        return run_calibrate(installation, lambda message: progress(message, 0, 1), readings_file=readings)

    run_stage(dir, "calibration", force or readings is not None, as_json, run, "calibration/accuracy.json")
    for line in _told(dir):
        say(line)


def _told(dir: Path) -> list[str]:
    """What a person should hear of a calibration besides its error."""
    from paxel_runtime.installation import Installation
    from paxel_runtime.storage import read_json

    installation = Installation.open(dir)
    record = read_json(installation.folder("calibration") / "calibration.json")
    K = str(installation.settings.clusters.count)
    lines = [f"warning: {text}" for text in record.get("warnings", [])]
    if honesty := record.get("honesty", {}).get("findings"):
        told = [f"  {f['question']}: {f['verdict']}" for f in honesty if f["word"] != "honest"]
        worst = record["honesty"]["word"]
        lines.append(
            {"honest": "the projector is honest", "noticeable": "the projector is nearly honest:"}.get(
                worst, "the projector changes what it is sent; mend this, then run: paxel capture --force"
            )
        )
        lines += told
    for surface, drift in record.get("drift", {}).items():
        if drift["range_percent"] > _DRIFT_TOLD:
            after = f"a straight line was taken out, {drift['rms_percent']:.1f} % rms is left"
            lines.append(
                f"the light drifted by {drift['range_percent']:.1f} % during the readings on {surface}"
                + (f"; {after}" if drift["corrected"] else "; it follows no line, and is left as it is")
            )
    if spread := _spread(record.get("positions", {})):
        lines += spread
        if installation.settings.model.kind == "spectral":
            lines.append("  the model is that of their mean; its errors above are those of readings at the centre")
    clusters = record["clusters"][K]
    if clusters.get("suggested_count", int(K)) != int(K):
        lines.append(f"clusters.count: {clusters['suggested_count']} is suggested, not {K}: {clusters['reason']}")
    if check := record.get("cross_check", {}).get(K):
        lines.append(f"clusters of the design agree with k-means in {check['agreement']:.1%} of the pixels")
    return lines


def _spread(positions: dict[str, Any]) -> list[str]:
    """How far the positions of the meter lie apart, as a small table."""
    if not positions:
        return []
    dimmest = min(positions["white_percent"])
    lines = [
        f"{len(positions['positions_mm'])} positions of the meter, full white down to {dimmest:.0f} % of the centre's; "
        "dE00 of the clusters from their mean:",
        f"  {'':8} {'as read':>13}  {'to the local white':>18}",
    ]
    for surface, spread in positions["surfaces"].items():
        cells = [f"{spread[kind]['dE00_mean']:.2f}, max {spread[kind]['dE00_max']:.2f}" for kind in _SPREADS]
        lines.append(f"  {surface:8} {cells[0]:>13}  {cells[1]:>18}")
    return lines
