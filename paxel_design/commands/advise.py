"""`paxel advise`: which layout to print, before anything is printed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from paxel_design.commands.options import Json
from paxel_design.console import print_json, progress_bar, say
from paxel_runtime.errors import UsageError

if TYPE_CHECKING:
    from paxel_design.advice import Advice

__all__ = ["advise"]

_UNITS_MM = {"": 1.0, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
_SHOWN = 12


def _option(help: str, *names: str, metavar: str | None = None) -> Any:
    return typer.Option(*names, help=help, metavar=metavar, show_default=False)


def advise(
    projector: Annotated[str, _option("Resolution, such as 3840x2160.", metavar="WxH")] = "1920x1080",
    width: Annotated[str, _option("Width of the projection on the wall: 600mm, 60cm, 0.6m.", metavar="LENGTH")] = "",
    distance: Annotated[str, _option("Distance of the viewer from the wall, such as 3m.", metavar="LENGTH")] = "",
    dpi: Annotated[float, typer.Option(help="Dots per inch of the printer.")] = 1440.0,
    colorants: Annotated[str, typer.Option(help="Inks of the print, white for bare paper.")] = "black,white",
    clusters: Annotated[int, _option("K: as many as colorants, or one more (3 for two, else as many).")] = 0,
    luminance: Annotated[float, typer.Option(help="Mean luminance of the lit print, cd/m2.")] = 100.0,
    sorted_by: Annotated[
        str,
        typer.Option(
            help="How pixels are sorted: lab (k-means in CIELAB, clusters.method kmeans) or light (method design)."
        ),
    ] = "lab",
    monochrome: Annotated[
        bool,
        _option(
            "Instead, propose area shares of three or more --colorants for a projector of one channel.", "--monochrome"
        ),
    ] = False,
    out: Annotated[Path | None, _option("Folder for advice.json, advice.png (heat maps) and pareto.png.")] = None,
    write: Annotated[
        Path | None, _option("Set the best in this paxel.toml, and the projector and viewer it is for.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Advise which layout, angle and dot size to print for a projector, a printer and a viewer.

    Every candidate is simulated: how plainly the eye sees the print itself, the moire of a cluster that is lit alone
    (at the worst zoom within 3 %), and how far lightness can be changed freely on both surfaces. Visibilities are in
    thresholds of contrast (Barten): 1 is just seen, 10 is plain. Larger dots change more and are seen sooner; the score
    weighs that, pareto.png shows what is given up for what. Dots are moved onto the printer's grid where one is near.

    \b
    paxel advise --projector 3840x2160 --width 600mm --distance 3m
    paxel advise --projector 1920x1080 --width 28cm --distance 2.7m --out advice
    paxel advise --projector 3840x2160 --width 600mm --distance 3m --write my-show/paxel.toml
    paxel advise --monochrome --colorants uv-red,uv-green,uv-blue
    """
    names = tuple(name.strip() for name in colorants.split(",") if name.strip())
    if monochrome:
        _propose_shares(names, as_json)
        return
    missing = [flag for flag, text in (("--width", width), ("--distance", distance)) if not text]
    if missing:
        raise UsageError(
            f"{' and '.join(missing)} must be given: paxel advise --projector 3840x2160 --width 600mm --distance 3m"
        )
    if sorted_by not in ("lab", "light"):
        raise UsageError(f"--sorted-by must be lab or light, got {sorted_by!r}")
    from paxel_design.advice import Setup
    from paxel_design.advice import advise as find
    from paxel_design.stages.advice import advice_record, write_advice, write_choice

    setup = Setup(
        _resolution(projector),
        _length_mm("--width", width),
        _length_mm("--distance", distance),
        dpi,
        names,
        clusters,
        luminance,
        "light" if sorted_by == "light" else "lab",
    )
    if write is not None and write.exists():
        from paxel_runtime.settings import load_settings

        load_settings(write)  # a mistake in it is told before the simulation
    with progress_bar() as progress:
        advice = find(setup, progress)
    record = advice_record(advice) if out is None else write_advice(advice, out)
    if out is not None:
        say(f"wrote {out / 'advice.json'}, advice.png and pareto.png")
    if write is not None:
        record["set"] = write_choice(advice, write)
        say(f"wrote {advice.best[0].name} into {write}; next: paxel pattern {write.parent}")
    if as_json:
        print_json(record)
        return
    _print_advice(advice)


def _print_advice(advice: Advice) -> None:
    console = Console(highlight=False)
    table = Table(title="candidates, best first (visibilities in thresholds: 1 = just seen)", title_justify="left")
    for column in ("layout", "angle", "mm", "px", "print", "moire", "L* pattern", "L* white", "score"):
        table.add_column(column, justify="left" if column == "layout" else "right")
    for c in advice.candidates[:_SHOWN]:
        ranges = (f"{length:.0f}" for length in (c.effect.L_pattern, c.effect.L_white))
        place = (c.layout, f"{c.angle_deg:.1f}", f"{c.dot_size_mm:.3f}", f"{c.asked_dot_px:g}")
        table.add_row(*place, _short(c.seen), _short(c.moire.visibility), *ranges, f"{c.score:.1f}")
    console.print(table)
    if len(advice.candidates) > _SHOWN:
        console.print(f"and {len(advice.candidates) - _SHOWN} more: --json or --out has them all")
    for k, best in enumerate(advice.best, 1):
        volumes = ""
        if best.effect.volume_pattern is not None and best.effect.volume_white is not None:
            volumes = f"; two pictures: {best.effect.volume_pattern:.0f} x {best.effect.volume_white:.0f} CIELAB^3"
        console.print(f"\n{k}. {best.name} (score {best.score:.1f}{volumes})", markup=False, soft_wrap=True)
        for reason in best.reasons:
            console.print(f"   {reason}", markup=False, soft_wrap=True)


def _short(thresholds: float) -> str:
    return f"{thresholds:.0f}" if thresholds >= 10 else f"{thresholds:.1f}"


def _propose_shares(names: tuple[str, ...], as_json: bool) -> None:
    from paxel_design.advice import proposed_shares

    found = proposed_shares(names)
    if as_json:
        print_json(found)
        return
    table = Table(title="area shares for one channel of light", title_justify="left")
    for column in ("", *names, "white x, y", "luminance", "gamut, CIELAB^3"):
        table.add_column(column, justify="right" if column else "left", no_wrap=True)
    for key, figures in found.items():
        if figures is None:
            table.add_row(key, *("-" for _ in names), "none: these colorants cannot mix D65", "", "")
            continue
        table.add_row(
            key.replace("_", " "),
            *(f"{share:.3f}" for share in figures["shares"].values()),
            "{:.4f}, {:.4f}".format(*figures["white_xy"]),
            f"{figures['white_Y']:.3f}",
            f"{figures['volume']:.0f}",
        )
    Console(highlight=False).print(table)
    chosen = found["neutral"] or found["largest_gamut"]
    shares = ", ".join(f"{share:.4f}" for share in chosen["shares"].values())
    say(f"write into paxel.toml, [pattern]:  shares = [{shares}]")


def _resolution(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"\s*(\d{2,5})\s*[xX]\s*(\d{2,5})\s*", text)
    if not match:
        raise UsageError(f"--projector must be its width and height in pixels, such as 3840x2160; got {text!r}")
    return int(match.group(1)), int(match.group(2))


def _length_mm(flag: str, text: str) -> float:
    match = re.fullmatch(r"\s*([0-9.]+)\s*([a-z]*)\s*", text)
    try:
        return float(match.group(1)) * _UNITS_MM[match.group(2)]  # type: ignore[union-attr]
    except (AttributeError, KeyError, ValueError):
        raise UsageError(f"{flag} must be a length, such as 600mm, 60cm or 3m; got {text!r}") from None
