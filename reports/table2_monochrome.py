"""Table II: how well the spectral model predicts colours made from one ultraviolet channel.

As in the paper every combination of 0, 25, 50, 75 and 100 % on three clusters is projected and read: 125 projections.
`monochrome.py` does the same for white light on printed inks and for three measured fluorescent materials.
"""

from __future__ import annotations

import sys

from paxel_runtime.storage import read_json
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import shared

PAPER = {"dE00_mean": 2.56, "dE00_p95": 4.5, "dE00_max": 5.6}
"""Measured on hardware."""

ITEM = Item(
    "table2_monochrome",
    "Table II",
    "one UV channel on red, green and blue fluorescent tiles, K = 3, 125 projections, dE00 mean / 95 % / max: 2.56 / "
    "4.5 / 5.6",
    ("uv-rgb",),
)


def make(run: Run) -> Result:
    """Errors of the corrected and of the linear model."""
    accuracy = read_json(shared("uv-rgb", run.quick).folder("calibration") / "accuracy.json")
    models = {"corrected": accuracy["pattern"], "linear": accuracy["linear"]["pattern"]}
    figures = {
        f"{model}, {key[5:]}": Figure(errors[key], "dE00", "colour difference", PAPER[key])
        for model, errors in models.items()
        for key in PAPER
    }
    words = "; ".join(f"{m}: " + " / ".join(f"{errors[key]:.2f}" for key in PAPER) for m, errors in models.items())
    relations = {
        "the whole grid of 5^3 = 125 projections was tested": accuracy["n"] == 125,
        "the measured correction is better than the linear model": models["corrected"]["dE00_mean"]
        < models["linear"]["dE00_mean"],
    }
    return Result(words, figures, relations)


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
