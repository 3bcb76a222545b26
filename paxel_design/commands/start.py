"""`paxel new`, `paxel status` and `paxel demo`: an installation as a whole."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from paxel_design.commands.options import Dir, Json, Preset, Set, open_installation, overrides_of
from paxel_design.console import print_json, print_table, progress_bar, report, say

__all__ = ["demo", "new", "status"]


def new(dir: Dir, preset: Preset = "bw-checkerboard", set: Set = None, as_json: Json = False) -> None:
    """Start an installation: write paxel.toml with every key, its unit and its choices.

    Example:  paxel new my-show --set pattern.dot_size_mm=0.5
    """
    from paxel_runtime.installation import Installation
    from paxel_runtime.settings import make_settings

    settings = make_settings(preset, overrides_of(set))
    Installation.create(dir, settings)
    path = dir / "paxel.toml"
    report(
        as_json, {"paxel_toml": str(path), "settings": settings.values()}, f"wrote {path}; next: paxel pattern {dir}"
    )


def status(dir: Dir, as_json: Json = False) -> None:
    """Tell what is done, stale or missing, why, and which command comes next."""
    from paxel_runtime.installation import STAGES

    installation = open_installation(dir)
    stages = installation.status()
    todo = next((s for s in stages if s.state != "done"), None)
    next_command = f"paxel {todo.stage.command} {dir}" if todo else ""
    if as_json:
        rows = [{"stage": s.stage.name, "state": s.state, "reasons": list(s.reasons)} for s in stages]
        print_json({"stages": rows, "next": next_command})
        return
    table = Table("stage", "state", "why")
    colours = {"done": "green", "stale": "yellow", "missing": "red"}
    for s in stages:
        table.add_row(s.stage.name, f"[{colours[s.state]}]{s.state}[/]", escape("\n".join(s.reasons)))
    told = {s.stage.name for s in stages}
    for stage in STAGES:
        if stage.name not in told:
            table.add_row(stage.name, "-", escape(f"when you like: paxel {stage.command} {dir}"))
    console = Console(highlight=False)
    console.print(table)
    console.print(f"next: {next_command}" if next_command else "everything is up to date")


def demo(dir: Dir, preset: Preset = "bw-checkerboard", set: Set = None, as_json: Json = False) -> None:
    """Everything from design to picture on the virtual bench, with two real photographs.

    Writes an installation folder and demo.png, a contact sheet. Run again, it makes only what is missing.
    """
    from paxel_design.demo import run_demo

    with progress_bar() as progress:
        result = run_demo(dir, preset, overrides_of(set), progress, say)
    if as_json:
        print_json(result)
        return
    print_table("figures (virtual bench)", result["figures"])
    print_table("files", result["files"])
