"""Table I: how well the spectral model predicts colours of the colour-changing effect.

The paper tests K = 2 on the 30 degree checkerboard with 100 random projections. Our installation is calibrated with
K = 3, and with K = 2 beside it from the same captures; the readings that test the models were not used to fit them.
`accuracy.py` goes into it: every quality of the bench, more extra readings, the image-based model.
"""

from __future__ import annotations

import sys

from paxel_runtime.storage import read_json
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import shared

PAPER = {
    "pattern": {"dE00_mean": 1.9, "dE00_p95": 3.0, "dE00_max": 5.9},
    "white": {"dE00_mean": 2.36, "dE00_p95": 3.8, "dE00_max": 8.5},
}
"""K = 2, measured on hardware."""

ITEM = Item(
    "table1_accuracy",
    "Table I",
    "b/w checkerboard at 30 degrees, K = 2, 100 random projections, dE00 mean / 95 % / max: pattern 1.9 / 3.0 / 5.9, "
    "white 2.36 / 3.8 / 8.5",
    ("bw-checkerboard",),
)


def make(run: Run) -> Result:
    """Errors of three models on both surfaces."""
    accuracy = read_json(shared("bw-checkerboard", run.quick).folder("calibration") / "accuracy.json")
    models = {"K = 2": accuracy["other_K"]["2"], "K = 3 linear": accuracy["linear"], "K = 3": accuracy}
    figures = {
        f"{model}, {surface}, {key[5:]}": Figure(
            errors[surface][key], "dE00", "colour difference", PAPER[surface][key] if model == "K = 2" else None
        )
        for model, errors in models.items()
        for surface in PAPER
        for key in PAPER[surface]
    }
    words = "; ".join(
        f"{model}: " + ", ".join(f"{surface} {_short(errors[surface])}" for surface in PAPER)
        for model, errors in models.items()
        if model != "K = 3 linear"
    )
    means = {model: [errors[s]["dE00_mean"] for s in PAPER] for model, errors in models.items()}
    relations = {
        "100 projections were tested": accuracy["n"] == 100,
        "the measured correction is better than the linear model on both surfaces": all(
            a < b for a, b in zip(means["K = 3"], means["K = 3 linear"], strict=True)
        ),
        "the linear model of the realistic bench errs by 0.2 dE00 or more on a surface": max(means["K = 3 linear"])
        > 0.2,
    }
    return Result(words, figures, relations)


def _short(errors: dict[str, float]) -> str:
    return " / ".join(f"{errors[key]:.2f}" for key in ("dE00_mean", "dE00_p95", "dE00_max"))


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
