"""All changes of an installation, each with its gain."""

from __future__ import annotations

from paxel_design.what_if.case import Case
from paxel_design.what_if.changes import Change
from paxel_design.what_if.print_changes import print_changes
from paxel_design.what_if.recorded_changes import recorded_changes
from paxel_design.what_if.sheet_changes import sheet_changes
from paxel_design.what_if.viewing import view_changes

__all__ = ["possible_changes"]


def possible_changes(case: Case) -> tuple[Change, ...]:
    """Every change that applies to a case, with its gain, whether it helps or not."""
    return (*print_changes(case), *sheet_changes(case), *view_changes(case), *recorded_changes(case))
