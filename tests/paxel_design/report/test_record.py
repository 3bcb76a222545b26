"""report.json: every figure once, and what was judged."""

import json

import pytest

from paxel_design.report.content import Quantity, Section, Verdict
from paxel_design.report.record import all_quantities, report_record
from paxel_runtime.errors import InputError

VERDICT = Verdict("a name", "one.x", "usable", "good up to 1", "do this")


def _sections() -> list[Section]:
    return [
        Section("summary", "S", (), {}, (VERDICT,)),
        Section("one", "One", (), {"one.x": Quantity(1.5, "dE00", "a.json#/x")}, (VERDICT,)),
        Section("two", "Two", (), {"two.y": Quantity((1.0, float("nan"))), "two.z": Quantity(("a", "b"))}),
    ]


def test_the_record_holds_every_quantity_and_every_verdict_once() -> None:
    record = report_record(_sections(), title="T", subtitle="S", bench="", date="2026-03-04", inputs={"files": {}})
    assert record["quantities"]["one.x"] == {"value": 1.5, "unit": "dE00", "source": "a.json#/x"}
    assert record["quantities"]["two.y"]["value"] == [1.0, None]  # JSON has no NaN
    assert record["quantities"]["two.z"]["value"] == ["a", "b"]
    assert [row["section"] for row in record["verdicts"]] == ["one"]
    assert record["verdicts"][0]["value"] == 1.5
    assert record["sections"] == ["summary", "one", "two"]
    json.dumps(record, allow_nan=False)


def test_one_name_has_one_figure() -> None:
    sections = _sections()
    again = Section("three", "Three", (), {"one.x": Quantity(1.5, "dE00", "a.json#/x")})
    assert all_quantities([*sections, again])["one.x"].value == 1.5
    other = Section("three", "Three", (), {"one.x": Quantity(2.0)})
    with pytest.raises(InputError, match=r"different quantities 'one\.x'"):
        all_quantities([*sections, other])
