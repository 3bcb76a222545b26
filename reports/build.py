"""Make every figure and table of the paper anew, into reports/build/, and compare the figures with reports/reference/.

Installations that several scripts use are made first and kept; then each script runs; then a summary. Exit code 1 where
a relation does not hold, a figure deviates or a reference is missing. Run from a checkout::

    python -m reports.build [--quick] [--only NAME ...] [--jobs N] [--fresh] [--installation DIR] [--write-reference]

Called as ``python reports/build.py`` it takes the installed toolkit, not the checkout's.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import multiprocessing
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: threads that wait for each other cost a third
if not __package__:  # python reports/build.py: the toolkit that is installed, and the scripts beside this one
    sys.path[0:1] = []
    sys.path.append(str(Path(__file__).resolve().parent.parent))

from paxel_runtime.errors import PaxelError
from paxel_runtime.storage import read_json, write_text
from reports.comparison import (
    README,
    REFERENCE,
    deviations,
    read_references,
    readme_table,
    summary,
    with_table,
    write_reference,
)
from reports.paper import BUILD, Item, run_item
from reports.shared_installations import adopt, shared

NAMES = (
    "fig02_colour_formation",
    "fig03_clusters",
    "table1_accuracy",
    "fig04_sub_gamuts",
    "fig06_hue_and_chroma",
    "fig07_dual_images",
    "fig08_dual_image_colour_pattern",
    "table2_monochrome",
    "fig09_uv_color",
    "fig10_uv_gamut",
    "section5c_times",
    "fig12_pattern_layouts",
    "fig13_dot_size_and_clusters",
    "fig15_image_based",
)
"""Scripts in the paper's order."""

LONG = ("fig08_dual_image_colour_pattern", "fig13_dot_size_and_clusters", "fig15_image_based")
"""Installations or calibrations of their own, minutes even when small: quick builds make them when they are named."""


@dataclass(frozen=True)
class Outcome:
    """How one script ended, and what it complained of."""

    name: str
    code: int
    said: str


def item_of(name: str) -> Item:
    """What a script says that it makes."""
    item: Item = import_module(f"reports.{name}").ITEM
    return item


def run_script(name: str, arguments: Sequence[str]) -> Outcome:
    """Run one script in this process."""
    said = io.StringIO()
    module = import_module(f"reports.{name}")
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = run_item(module.ITEM, module.make, arguments)
    return Outcome(name, code, said.getvalue().strip())


def make_installation(name: str, quick: bool) -> str:
    """Make or finish a shared installation; returns its name."""
    shared(name, quick, _progress)
    return name


def _progress(message: str, done: int, total: int) -> None:
    if done == 0:
        print(f"  {message}", flush=True)


def each(run: Callable[..., Any], names: Sequence[str], argument: Any, jobs: int) -> Iterable[Any]:
    """``run(name, argument)`` of every name, in order, `jobs` at a time."""
    if jobs == 1:
        yield from (run(name, argument) for name in names)
        return
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(run, names, [argument] * len(names))


def build(names: Sequence[str], quick: bool, jobs: int) -> list[Outcome]:
    """Make the installations that these scripts use, then run the scripts."""
    needed = list(dict.fromkeys(use for name in names for use in item_of(name).uses))
    for name in each(make_installation, needed, quick, jobs):
        print(f"installation {name}: ready", flush=True)
    folder = BUILD / "quick" if quick else BUILD
    for name in names:
        (folder / f"{name}.json").unlink(missing_ok=True)
    outcomes = []
    for outcome in each(run_script, names, [str(folder), *(["--quick"] if quick else [])], jobs):
        outcomes.append(outcome)
        print(f"[{len(outcomes)}/{len(names)}] {outcome.name}: {'made' if not outcome.code else 'FAILED'}", flush=True)
        if outcome.code:
            print(outcome.said, flush=True)
    return outcomes


def keep_as_reference(folder: Path, record: dict[str, Any], name: str) -> None:
    """Write the reference; the pictures of the full size with it."""
    write_reference(name, record, REFERENCE)
    for picture in record["pictures"] if record["size"] == "full" else ():
        shutil.copyfile(folder / picture, REFERENCE / picture)
    table = readme_table([item_of(each_name) for each_name in NAMES], REFERENCE)
    write_text(README, with_table(README.read_text(encoding="utf-8"), table))


def main(arguments: Sequence[str] | None = None) -> int:
    """Build, compare, tell."""
    options = argparse.ArgumentParser(description="The paper's figures and tables, made anew and checked")
    options.add_argument("--quick", action="store_true", help="small installations and samples")
    options.add_argument("--only", nargs="+", choices=NAMES, metavar="NAME", help=", ".join(NAMES))
    options.add_argument("--jobs", type=int, default=1, help="scripts at a time (each uses all cores where it can)")
    options.add_argument("--fresh", action="store_true", help="forget what is in reports/build, after a change of code")
    options.add_argument("--installation", type=Path, help="a ready one, used as the shared one of the same settings")
    options.add_argument("--write-reference", action="store_true", help="what was made is right from now on")
    chosen = options.parse_args(arguments)
    names = chosen.only or [name for name in NAMES if not (chosen.quick and name in LONG)]
    began = time.perf_counter()
    folder = BUILD / "quick" if chosen.quick else BUILD
    if chosen.fresh:
        for made in (BUILD / "installations" / ("quick" if chosen.quick else "full"), *folder.glob("*.json")):
            shutil.rmtree(made, ignore_errors=True) if made.is_dir() else made.unlink()
    try:
        if chosen.installation:
            print(f"{chosen.installation} is used as {adopt(chosen.installation, chosen.quick)}")
        outcomes = build(names, chosen.quick, chosen.jobs)
    except PaxelError as error:
        print(f"build: {error}", file=sys.stderr)
        return 1
    rows, failed = [], [outcome for outcome in outcomes if outcome.code]
    for outcome in outcomes:
        path = folder / f"{outcome.name}.json"
        if not path.is_file():
            continue
        record = read_json(path)
        if chosen.write_reference and not outcome.code:
            keep_as_reference(folder, record, outcome.name)
        found = deviations(outcome.name, record, read_references(outcome.name, REFERENCE))
        rows.append((record, found + [line for line in outcome.said.splitlines() if outcome.code]))
    print("\n" + summary(rows))
    print(f"\n{len(outcomes)} items in {(time.perf_counter() - began) / 60:.1f} minutes; pictures in {folder}")
    return 1 if failed or any(found for _, found in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
