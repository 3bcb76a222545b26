"""Running a stage, or telling that nothing changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paxel_design.commands.options import open_installation
from paxel_design.console import progress_bar, report, say

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation

__all__ = ["records_of", "run_stage", "up_to_date"]


def run_stage(
    dir: Path,
    stage: str,
    force: bool,
    as_json: bool,
    run: Callable[[Installation, Callable[[str, int, int], None]], dict[str, Any]],
    record: str,
) -> None:
    """Run a stage with one record, or say that nothing changed."""
    from paxel_runtime.installation import STAGES
    from paxel_runtime.storage import read_json

    installation = open_installation(dir)
    before = [s.name for s in STAGES[: [s.name for s in STAGES].index(stage)]]
    if before:
        installation.require(before[-1])
    state = next(s.state for s in installation.status() if s.stage.name == stage)
    if state == "done" and not force:
        say(f"{stage} is up to date; nothing to do (--force makes it anew)")
        result = read_json(installation.path / record)
    else:
        with progress_bar() as progress:
            result = run(installation, progress)
    report(as_json, result, f"{stage}: {installation.folder(stage)}")


def up_to_date(installation: Installation, stage: str, records: list[str]) -> bool:
    """Whether every record of a stage is there and was made from what there is today."""
    folder = installation.folder(stage)
    if not all((folder / record).is_file() for record in records):
        return False
    from paxel_runtime.storage import read_json

    today = installation.inputs(stage)
    return all(read_json(folder / record).get("inputs") == today for record in records)


def records_of(installation: Installation, stage: str, names: list[str]) -> dict[str, Any]:
    """Records of a stage by file name."""
    from paxel_runtime.storage import read_json

    return {name: read_json(installation.folder(stage) / name) for name in names}
