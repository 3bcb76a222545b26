"""No estimator, stage or command looks at the bench's ground truth: it is for tests and reports."""

from __future__ import annotations

import ast
from pathlib import Path

import paxel_design
import paxel_runtime

SOURCES = [
    path for package in (paxel_runtime, paxel_design) for path in Path(str(package.__file__)).parent.rglob("*.py")
]
ITS_OWN = {"bench_truth.py", "virtual.py"}


def looks_at_truth(source: str) -> bool:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and node.attr in ("truth", "bench_truth"):
            return True
        if isinstance(node, ast.ImportFrom) and "bench_truth" in f"{node.module}.{[n.name for n in node.names]}":
            return True
        if isinstance(node, ast.Import) and any("bench_truth" in name.name for name in node.names):
            return True
    return False


def test_the_check_sees_what_it_is_to_see() -> None:
    for source in (
        "bench.truth.coverage()",
        "from paxel_runtime.devices.bench_truth import BenchTruth",
        "from paxel_runtime.devices import bench_truth",
        "import paxel_runtime.devices.bench_truth",
    ):
        assert looks_at_truth(source)
    assert not looks_at_truth("truth = 1")


def test_no_one_looks_at_the_truth() -> None:
    assert len(SOURCES) > 100
    found = [path for path in SOURCES if path.name not in ITS_OWN and looks_at_truth(path.read_text(encoding="utf-8"))]
    assert not found
