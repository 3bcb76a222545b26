"""What a chapter is put together from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from paxel_design.report.content import Block, Quantity, Verdict
from paxel_design.report.source import ReportSource

__all__ = ["NO_PART", "Part", "on_the_bench"]


@dataclass(frozen=True, eq=False)
class Part:
    """Blocks of a chapter, with the quantities they name and what is judged."""

    blocks: Sequence[Block] = ()
    quantities: Mapping[str, Quantity] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()


NO_PART = Part()
"""Of what was not recorded."""


def on_the_bench(source: ReportSource) -> str:
    """What a caption of measured figures ends with: " (virtual bench)", or nothing for hardware."""
    return " (virtual bench)" if source.bench else ""
