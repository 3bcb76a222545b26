"""`paxel study`: what another dot size, layout or number of clusters would give."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from paxel_design.commands.options import Json, Preset, overrides_of
from paxel_design.console import print_json, progress_bar, say

__all__ = ["study"]

_LEGEND = """\
On the pattern, on white: free L*, lengths of the lightness rectangle; 2
pictures, volumes of the product pair, 1000 CIELAB^3; dE00, mean error of
prediction, and that of the linear model; ghost of the other photograph.
Hue 180°: area in a* x b* of the colours whose hue can turn that far."""


def _option(help: str, *names: str, metavar: str | None = None) -> Any:
    return typer.Option(*names, help=help, metavar=metavar, show_default=False)


def study(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder of the study.", show_default=False)],
    dot_size: Annotated[list[float] | None, _option("Edge of a dot; repeat (0.5, 0.75 and 1).", metavar="MM")] = None,
    layout: Annotated[
        list[str] | None,
        _option("checkerboard, blue-noise, tiles or stripes; repeat (the preset's).", metavar="LAYOUT"),
    ] = None,
    angle: Annotated[list[float] | None, _option("Rotation of the print; repeat (30).", metavar="DEG")] = None,
    clusters: Annotated[
        list[int] | None,
        _option("K; repeat (2, 3 and 5 for two colorants, else as many as colorants).", metavar="K"),
    ] = None,
    pitch: Annotated[
        float | None,
        _option(
            "Width of a projector pixel on the wall: the projection's width / its pixels (281/1920).", metavar="MM"
        ),
    ] = None,
    preset: Preset = "bw-checkerboard",
    set: Annotated[
        list[str] | None,
        _option("Any other key of paxel.toml, such as bench.quality=harsh; repeat.", "--set", metavar="KEY=VALUE"),
    ] = None,
    ghosting: Annotated[
        bool, typer.Option("--ghosting/--no-ghosting", help="Show two photographs at once and measure their ghosts.")
    ] = True,
    jobs: Annotated[
        int, _option("Cases side by side, each a process of about 0.5 GB (as many as cores and memory allow).")
    ] = 0,
    keep: Annotated[bool, typer.Option("--keep", help="Leave each case's installation in OUT/work.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Measure every case anew.")] = False,
    as_json: Json = False,
) -> None:
    """Try dot sizes, layouts and numbers of clusters K on the virtual bench, before anything is printed.

    Every combination is printed, captured and calibrated as a whole, on a small frame (480 x 270 pixels) that stands
    for any larger one. Told are: the free range of L* on both surfaces (the lightness rectangle), the area of colours
    whose hue can turn by 180 degrees, the two volumes in which any two pictures go together, the error of prediction
    and the ghost of one photograph in the other. Larger dots and more clusters change more; larger dots are seen
    sooner (paxel advise weighs that), and from K = 3 on more clusters bring little.

    \b
    paxel study what-if             3 dot sizes x K = 2, 3, 5: some minutes
    paxel study what-if --dot-size 0.6 --dot-size 0.75 --clusters 3
    paxel study what-if --layout checkerboard --layout blue-noise
    paxel study what-if --pitch 0.156 --set viewing.distance_mm=3000
    paxel study what-if --set bench.quality=harsh --no-ghosting

    Writes study.json, study.csv and study.png (charts as in the paper's Fig. 13) into OUT, and of each case its
    figures and its model, for paxel gamut --model. Ctrl-C at any time; the same command goes on, and measures only what
    is missing or was made with other settings. A case that fails is told and does not stop the others (exit code 1).
    """
    from paxel_design.study import Study, run_study

    asked = Study(
        dot_sizes_mm=tuple(dot_size or ()),
        layouts=tuple(layout or ()),
        angles_deg=tuple(angle or ()),
        clusters=tuple(clusters or ()),
        preset=preset,
        overrides=overrides_of(set),
        ghosting=ghosting,
        **({} if pitch is None else {"pitch_mm": pitch}),
    )
    with progress_bar() as progress:
        record = run_study(asked, out, jobs=jobs, force=force, keep=keep, progress=progress, say=say)
    say(
        f"wrote {out / 'study.json'}, study.csv and study.png" if record["measured_on"] else "no case could be measured"
    )
    if as_json:
        print_json(record)
    else:
        _print_study(record)
    if record["failed"]:
        raise typer.Exit(1)


def _print_study(record: dict[str, Any]) -> None:
    console = Console(highlight=False)
    by_layout: dict[str, list[dict[str, Any]]] = {}
    for case in record["cases"]:
        by_layout.setdefault("{layout} at {angle_deg:.4g}°".format(**case), []).append(case)
    for name, cases in by_layout.items():
        title = f"{name} ({record['measured_on'] or 'nothing measured'})"
        table = Table(
            title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False
        )
        for column in ("mm", "K", "free L*", "hue 180°", "2 pictures", "dE00", "linear", "ghost %"):
            table.add_column(column, justify="right", no_wrap=True)
        for case in cases:
            table.add_row(f"{case['dot_size_mm']:g}", str(case["clusters"]), *_cells(case))
        console.print(table)
    console.print(_LEGEND)
    for case in record["cases"]:
        if "error" in case:
            told = "{layout} at {angle_deg:.4g}°, {dot_size_mm:g} mm, K = {clusters}: {error}".format(**case)
            console.print(f"failed: {told}", markup=False, soft_wrap=True, style="red")


def _cells(case: dict[str, Any]) -> list[str]:
    """The figures of a case, each on the pattern and on the white surface."""
    if "error" in case:
        return ["failed"]
    cells = ["none"] * 3
    if case["lightness"] is not None:
        lengths = (f"{high - low:.1f}" for low, high in case["lightness"]["rectangle"].values())
        cells[0] = " x ".join(lengths)
    if case["hue"] is not None:
        cells[1] = f"{case['hue']['area_any']:.0f}"
    if case["dual_image"] is not None:
        cells[2] = ", ".join(f"{volume / 1000:.1f}" for volume in case["dual_image"].values())
    prediction, ghosts = case["prediction"], case["ghosting_percent"]
    surfaces = [surface for surface in ("pattern", "white") if surface in prediction]
    corrected, linear = (
        ", ".join(f"{errors[surface]['dE00_mean']:.2f}" for surface in surfaces)
        for errors in (prediction, prediction["linear"])
    )
    shares = [] if ghosts is None else [f"{share:.1f}" for share in ghosts.values() if share is not None]
    return [*cells, corrected, linear, ", ".join(shares) or "-"]
