"""report.json: every figure of a report with its unit and where it comes from, and what was judged."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from paxel_design.report.content import Quantity, Section, Value
from paxel_runtime.errors import InputError

__all__ = ["all_quantities", "report_record"]


def all_quantities(sections: Sequence[Section]) -> dict[str, Quantity]:
    """The quantities of all sections by full name.

    Raises
    ------
    InputError
        If two sections, or two blocks of a section, give different figures one name.
    """
    quantities: dict[str, Quantity] = {}
    for section in sections:
        for name, quantity in section.quantities.items():
            if quantities.get(name, quantity) != quantity:
                raise InputError(f"two sections of the report have different quantities {name!r}")
            quantities[name] = quantity
    return quantities


def report_record(
    sections: Sequence[Section], *, title: str, subtitle: str, bench: str, date: str, inputs: Mapping[str, Any]
) -> dict[str, Any]:
    """What ``report.json`` holds (without its writer).

    Parameters
    ----------
    sections : sequence of Section
    title, subtitle : str
    bench : str
        Where measured figures come from; empty for hardware.
    date : str
    inputs : mapping
        Settings and hashes of the files it was made from.

    Returns
    -------
    dict
        ``quantities``: ``{name: {"value", "unit", "source"}}``; ``verdicts``: what was judged, by what rule, and what
        helps; the rest as given.
    """
    quantities = all_quantities(sections)
    verdicts = [
        {
            "section": section.key,
            "name": verdict.name,
            "judgement": verdict.judgement,
            "quantity": verdict.quantity,
            "value": _plain(quantities[verdict.quantity].value),
            "rule": verdict.rule,
            "advice": verdict.advice,
        }
        for section in sections
        if section.key != "summary"  # it repeats theirs
        for verdict in section.verdicts
    ]
    return {
        "title": title,
        "subtitle": subtitle,
        "measured_on": bench,
        "date": date,
        "sections": [section.key for section in sections],
        "verdicts": verdicts,
        "quantities": {
            name: {"value": _plain(q.value), "unit": q.unit, "source": q.source} for name, q in quantities.items()
        },
        "inputs": dict(inputs),
    }


def _plain(value: Value) -> Any:
    """As JSON has it: a tuple as a list, what is no number as null."""
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
