"""What every script of the paper's figures and tables shares: its record, its tolerances and its command line.

A script ``reports/<name>.py`` holds an `Item` and a function ``make(run) -> Result`` and ends with::

    if __name__ == "__main__":
        sys.exit(run_item(ITEM, make))

It writes ``<name>.json`` (`record`) and its pictures into the folder that it is given, and fails where a relation that
it states does not hold. Nothing is known here of single items, of reference figures or of installations; those stand in
``build.py`` and ``shared_installations.py``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paxel_runtime.errors import PaxelError
from paxel_runtime.storage import write_json

BUILD = Path(__file__).parent / "build"
BENCH = "virtual bench, realistic"


@dataclass(frozen=True)
class Tolerance:
    """How far a figure may be from its reference, ``absolute + relative * |reference|``, and why."""

    absolute: float
    relative: float
    reason: str


TOLERANCES: dict[str, Tolerance | None] = {
    "colour difference": Tolerance(0.05, 0.1, "readings are seeded; single pixels near an edge change cluster"),
    "CIELAB": Tolerance(0.5, 0.02, "L*, a*, b* or chroma of a view or a set: half a unit is not seen"),
    "hue angle": Tolerance(3.0, 0.0, "degrees, around the circle; the meter's noise at a chroma of 10 turns hue by 2"),
    "volume": Tolerance(0.0, 0.03, "exact for a model; the model carries the meter's noise, 0.3 % a band, cubed"),
    "area": Tolerance(0.0, 0.03, "as volumes"),
    "share": Tolerance(0.02, 0.0, "of pixels, or of light: edges are decided by the camera's noise"),
    "percent": Tolerance(0.5, 0.1, "ghosting and the like: fits to pictures whose pixels are assembled to codes"),
    "ratio": Tolerance(0.05, 0.1, "quotient of two of these"),
    "count": Tolerance(0.0, 0.0, "whole numbers do not waver"),
    "time": None,
}
"""Kinds of figures; None: told and not compared, as another machine has another.

The bench, its noise and every sample are seeded, so that two runs on one machine agree to the last digits. What is left
is another processor's or library's rounding, which a threshold (a pixel's cluster, a stopping rule) can enlarge.
"""


@dataclass(frozen=True)
class Figure:
    """One number of ours.

    Attributes
    ----------
    value : float
    unit : str
        ``"dE00"``, ``"L*"``, ``"CIELAB units cubed"``, ``"%"``, ``"s"``, ...; empty for a pure number.
    kind : str
        A key of `TOLERANCES`.
    paper : float, optional
        The paper's own, measured on its hardware.
    """

    value: float
    unit: str
    kind: str
    paper: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in TOLERANCES:
            raise ValueError(f"kind must be one of {', '.join(TOLERANCES)}; got {self.kind!r}")


@dataclass(frozen=True)
class Item:
    """A figure or table of the paper.

    Attributes
    ----------
    name : str
        Of the script and its files.
    number : str
        In the paper: ``"Fig. 4"``.
    paper : str
        What the paper shows, in words with its figures.
    uses : tuple of str
        Shared installations that it needs.
    """

    name: str
    number: str
    paper: str
    uses: tuple[str, ...] = ()


@dataclass(frozen=True)
class Run:
    """Where to write (`folder` exists), and whether small installations and samples will do."""

    folder: Path
    quick: bool


@dataclass(frozen=True)
class Result:
    """What a script found.

    Attributes
    ----------
    ours : str
        One line for the table: what we get, with the figures that matter.
    figures : dict of name -> Figure
    relations : dict of statement -> bool
        What has to be true of the figures whatever their values; the script fails where one is not.
    pictures : tuple of str
        Files beside the record.
    measured_on : str
        `BENCH`, or what else the figures come from.
    """

    ours: str
    figures: Mapping[str, Figure]
    relations: Mapping[str, bool] = field(default_factory=dict)
    pictures: tuple[str, ...] = ()
    measured_on: str = BENCH


def record(item: Item, run: Run, result: Result, minutes: float) -> dict[str, Any]:
    """``<name>.json``: every figure with its unit and where it was measured, the paper's beside it."""
    figures = {}
    for name, figure in result.figures.items():
        value = float(f"{float(figure.value):.6g}")
        figures[name] = {"value": value, "unit": figure.unit, "kind": figure.kind, "measured_on": result.measured_on}
        if figure.paper is not None:
            figures[name]["paper"] = {"value": figure.paper, "measured_on": f"hardware (the paper, {item.number})"}
    return {
        "item": item.number,
        "size": "quick" if run.quick else "full",
        "measured_on": result.measured_on,
        "paper": item.paper,
        "ours": result.ours,
        "figures": figures,
        "relations": {words: bool(holds) for words, holds in result.relations.items()},
        "pictures": list(result.pictures),
        "minutes": round(minutes, 2),
    }


def run_item(item: Item, make: Callable[[Run], Result], arguments: Sequence[str] | None = None) -> int:
    """Parse ``[FOLDER] [--quick]``, make the item, write its record; returns the exit code."""
    options = argparse.ArgumentParser(prog=f"python -m reports.{item.name}", description=f"{item.number} of the paper")
    options.add_argument("folder", type=Path, nargs="?", help="default: reports/build, or reports/build/quick")
    options.add_argument("--quick", action="store_true", help="small installations: seconds instead of minutes")
    chosen = options.parse_args(arguments)
    run = Run(chosen.folder or (BUILD / "quick" if chosen.quick else BUILD), chosen.quick)
    run.folder.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    try:
        result = make(run)
    except PaxelError as error:
        print(f"{item.name}: {error}", file=sys.stderr)
        return 1
    write_json(run.folder / f"{item.name}.json", record(item, run, result, (time.perf_counter() - began) / 60))
    print(f"{item.number}: {result.ours} ({result.measured_on})")
    broken = [words for words, holds in result.relations.items() if not holds]
    for words in broken:
        print(f"{item.name}: this does not hold: {words}", file=sys.stderr)
    return 1 if broken else 0
