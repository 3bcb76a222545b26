"""Figures of a build beside their references: what deviates, the summary, the README's table.

A reference is ``reference/<name>.json``: the record (`paper.record`) of the full size, of the quick one, or of both.
Knows nothing of how a record is made.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from paxel_runtime.storage import write_text
from reports.paper import TOLERANCES, Item

REFERENCE = Path(__file__).parent / "reference"
README = Path(__file__).parent / "README.md"
TABLE_BEGIN = "<!-- table: made by reports/build.py, from the references -->"
TABLE_END = "<!-- end of the table -->"

Record = Mapping[str, Any]


def read_references(name: str, folder: Path) -> dict[str, Any]:
    """References of an item by size, ``{"full": {...}, "quick": {...}}``; what is missing is left out."""
    path = folder / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def write_reference(name: str, ours: Record, folder: Path) -> None:
    """Make today's record the reference of its size; the other size's stays."""
    both = {**read_references(name, folder), ours["size"]: ours}
    ordered = {size: both[size] for size in ("full", "quick") if size in both}
    write_text(folder / f"{name}.json", json.dumps(ordered, indent=1, ensure_ascii=False) + "\n")


def deviations(name: str, ours: Record, references: Mapping[str, Any]) -> list[str]:
    """What is not as in the reference, a line each.

    Parameters
    ----------
    name : str
        Of the item.
    ours : dict
        Its record.
    references : dict of size -> record
    """
    size = ours["size"]
    command = f"python -m reports.build {'--quick ' if size == 'quick' else ''}--only {name} --write-reference"
    if size not in references:
        return [f"there is no {size} reference; look at the pictures, then make it with: {command}"]
    before, now = references[size]["figures"], ours["figures"]
    lines = [f"{key!r} is in the reference and was not made" for key in before if key not in now]
    lines += [f"{key!r} has no reference; make it with: {command}" for key in now if key not in before]
    for key in now:
        if key in before:
            lines += _figure_deviates(key, now[key], before[key])
    return lines


def _figure_deviates(key: str, now: Record, before: Record) -> list[str]:
    if (now["unit"], now["kind"]) != (before["unit"], before["kind"]):
        return [f"{key!r} is now a {now['kind']} in {now['unit']!r}, was a {before['kind']} in {before['unit']!r}"]
    tolerance = TOLERANCES[now["kind"]]
    if tolerance is None:
        return []
    away = abs(now["value"] - before["value"])
    if now["kind"] == "hue angle":
        away = min(away % 360, -away % 360)
    allowed = tolerance.absolute + tolerance.relative * abs(before["value"])
    if away <= allowed:  # not so for a value that is no number
        return []
    return [
        f"{key!r}: {now['value']:.4g} {now['unit']}, reference {before['value']:.4g}, "
        f"may be {allowed:.2g} away ({tolerance.reason})".replace(" ,", ",")
    ]


def summary(rows: Iterable[tuple[Record, Sequence[str]]]) -> str:
    """The end of a build: item, the paper, ours, reference, ok, minutes; a line each, then what deviates."""
    lines, wrong = [], []
    for ours, found in rows:
        verdict = "ok" if not found else f"NOT OK ({len(found)})"
        lines.append(f"{ours['item']:10} {verdict:12} {len(ours['figures']):3} figures {ours['minutes']:5.1f} min")
        lines += [f"           paper: {ours['paper']}", f"           ours:  {ours['ours']} ({ours['measured_on']})"]
        wrong += [f"{ours['item']}: {line}" for line in found]
    return "\n".join([*lines, *wrong])


def readme_table(items: Iterable[Item], folder: Path) -> str:
    """The README's table of the paper's items, from the references of full size."""
    lines = ["| Item | The paper (hardware) | Ours | Command | Minutes |", "|---|---|---|---|---|"]
    for item in items:
        references = read_references(item.name, folder)
        record = references.get("full") or references.get("quick")
        if record is None:
            continue
        pictures = [f"[picture](reference/{name})" for name in record["pictures"] if (folder / name).is_file()]
        ours = f"{record['ours']} ({record['measured_on']}{', quick' if 'full' not in references else ''})"
        cells = [" ".join([item.number, *pictures]), item.paper, ours, f"`python -m reports.{item.name}`"]
        lines.append("| " + " | ".join([*cells, f"{record['minutes']:.1f}"]) + " |")
    return "\n".join(lines)


def with_table(readme: str, table: str) -> str:
    """The README's text with this table in its place."""
    head, rest = readme.split(TABLE_BEGIN)
    return f"{head}{TABLE_BEGIN}\n{table}\n{TABLE_END}{rest.split(TABLE_END)[1]}"
