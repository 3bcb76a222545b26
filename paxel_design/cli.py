"""The one command, `paxel`: parsing and messages only; the work is done by the stages, imported inside the commands."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.core
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from paxel_design.console import messages, print_json, print_table, progress_bar, report, report_records, say
from paxel_runtime.errors import InputError, PaxelError, UsageError

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation

__all__ = ["app", "main"]


class _Group(typer.core.TyperGroup):
    """Tells Paxel's errors in one place: text on standard error, exit code 1 (failed), 2 (usage), 130 (Ctrl-C)."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except PaxelError as error:
            messages.print(f"paxel: {error}", style="red", markup=False, soft_wrap=True)
            raise SystemExit(error.exit_code) from None
        except BrokenPipeError:
            raise SystemExit(0) from None  # whoever read the output has seen enough
        except OSError as error:  # no space, no permission: the system's words name the file
            say(f"paxel: {error}; every finished stage is as it was, so mend that and run the same command again")
            raise SystemExit(1) from None
        except KeyboardInterrupt:
            say("paxel: interrupted; finished captures are kept, every other stage is as it was")
            raise SystemExit(130) from None


app = typer.Typer(
    name="paxel",
    cls=_Group,
    help=(
        "Print a high-frequency colour pattern, register a projector to it, and project pictures that look one way "
        "on the pattern and another way on a white sheet.\n\n"
        "Everything at once, on the embedded virtual bench:  paxel demo my-show\n\n"
        "Step by step:  paxel new my-show, then pattern, capture, calibrate, gamut, project, preview; "
        "paxel status my-show always tells what comes next."
    ),
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

Dir = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the installation.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object on standard output.")]
Force = Annotated[bool, typer.Option("--force", help="Make it anew although nothing changed.")]
Preset = Annotated[str, typer.Option(help="Whole installation to start from: bw-checkerboard, bw-blue-noise, cmyrgb.")]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Any key of paxel.toml, such as pattern.dot_size_mm=0.5; repeat."),
]


def main() -> None:
    """Run the command line: exit code 0, 1 (failed), 2 (usage) or 130 (Ctrl-C)."""
    app(prog_name="paxel")


@app.command()
def new(dir: Dir, preset: Preset = "bw-checkerboard", set: Set = None, as_json: Json = False) -> None:
    """Start an installation: write paxel.toml with every key, its unit and its choices.

    Example:  paxel new my-show --set pattern.dot_size_mm=0.5
    """
    from paxel_runtime.installation import Installation
    from paxel_runtime.settings import make_settings

    settings = make_settings(preset, _overrides(set))
    Installation.create(dir, settings)
    path = dir / "paxel.toml"
    report(
        as_json, {"paxel_toml": str(path), "settings": settings.values()}, f"wrote {path}; next: paxel pattern {dir}"
    )


@app.command()
def pattern(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    list_colorants: Annotated[
        bool, typer.Option("--list-colorants", help="Tell the built-in inks that pattern.colorants may name.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make the print sheet: a PDF in true millimetres, a PNG preview and a note for the print shop."""
    if list_colorants:
        _list_colorants(as_json)
        return
    if dir is None:
        raise UsageError("give the installation's folder: paxel pattern my-show")
    from paxel_design.stages.print_sheet import make_print

    _run_stage(dir, "print", force, as_json, lambda inst, _: make_print(inst), "print/pattern.json")


@app.command()
def capture(dir: Dir, force: Force = False, as_json: Json = False) -> None:
    """Project and capture everything a calibration needs; goes on where it stopped.

    Structured light, white and black, then single clusters, ramps and random test projections. Geometry is decoded
    on the way, so a bad set-up is told before the readings start. Old captures are kept as captures-<n>.
    """
    from paxel_runtime.acquisition import capture as run_capture
    from paxel_runtime.acquisition import plan_exposures
    from paxel_runtime.stages import open_devices

    def run(installation: Installation, progress: Callable[[str, int, int], None]) -> dict[str, Any]:
        plan = plan_exposures(installation)
        pictures = sum(exposure.device == "camera" for exposure in plan)
        say(f"capturing {pictures} pictures and {len(plan) - pictures} readings")
        return run_capture(installation, open_devices(installation), progress, force=force)

    _run_stage(dir, "captures", force, as_json, run, "captures/complete.json")


@app.command()
def calibrate(dir: Dir, force: Force = False, as_json: Json = False) -> None:
    """Fit the prediction model from the captures and state its error on random projections (dE00)."""
    from paxel_runtime.stages import calibrate as run_calibrate

    _run_stage(dir, "calibration", force, as_json, lambda inst, _: run_calibrate(inst), "calibration/accuracy.json")


@app.command()
def gamut(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    effect: Annotated[
        str,
        typer.Option(help="Only this effect's sub-gamut: full, dual-image, neutralize[:L,a,b].", show_default=False),
    ] = "",
    shown_on: Annotated[str, typer.Option(help="Surface of the picture: pattern or white.")] = "pattern",
    lab: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--lab", metavar="L A B", help="Uniform colour of neutralize.", show_default=False),
    ] = None,
    model: Annotated[
        Path | None, typer.Option(help="A model.json instead of an installation.", show_default=False)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="With --model: folder to write to.", show_default=False)] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compute what the pattern can show: lightness area, joint gamut, sub-gamuts as closed meshes.

    Without --effect: lightness, joint, full, dual-image and neutralize. With --model FILE no installation is needed;
    nothing is written then unless --out is given.
    """
    from paxel_design.stages.gamut import gamut_files, make_gamut, make_gamut_of_model

    chosen = _effect(effect, lab) if effect else None
    if (dir is None) == (model is None):
        raise UsageError("give a folder, or --model FILE: paxel gamut my-show")
    if model is not None:
        report_records(as_json, make_gamut_of_model(model, chosen, shown_on, out), out or model)
        return
    assert dir is not None
    installation = _open(dir)
    installation.require("calibration")
    names = gamut_files(installation, chosen, shown_on)
    if not force and _up_to_date(installation, "gamut", names):
        result = _records(installation, "gamut", names)
        say("gamut is up to date; nothing to do (--force makes it anew)")
    else:
        with progress_bar() as progress:
            result = make_gamut(installation, chosen, shown_on, progress)
    report_records(as_json, result, installation.folder("gamut"))


@app.command()
def project(
    dir: Dir,
    effect: Annotated[str, typer.Option(help="full, dual-image, or neutralize[:L,a,b].", show_default=False)] = "",
    image: Annotated[Path | None, typer.Option(help="The picture of a one-picture effect.", show_default=False)] = None,
    on_pattern: Annotated[Path | None, typer.Option(help="Picture for the pattern.", show_default=False)] = None,
    on_white: Annotated[Path | None, typer.Option(help="Picture for the white sheet.", show_default=False)] = None,
    shown_on: Annotated[str, typer.Option(help="Surface that shows --image: pattern or white.")] = "pattern",
    lab: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--lab", metavar="L A B", help="Uniform colour of neutralize.", show_default=False),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the projection (default: the effect).", show_default=False)] = "",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Turn pictures into a projection image at native projector resolution.

    \b
    paxel project my-show --effect dual-image --on-pattern a.jpg --on-white b.jpg
    paxel project my-show --effect neutralize --image a.jpg      (shows on the pattern, hides on white)

    Without --effect every projection that is out of date is made anew from its own pictures.
    """
    from paxel_design.stages.projection import make_projection_stage, recorded_projections

    installation = _open(dir)
    installation.require("calibration")
    if effect:
        given = {"image": image, "on_pattern": on_pattern, "on_white": on_white}
        chosen = _effect(effect, lab)
        wanted = [(chosen, _pictures(chosen, given), name or chosen.key, shown_on)]
    else:
        wanted = recorded_projections(installation)
        if not wanted:
            raise UsageError("no projection yet: give --effect and its pictures; see paxel project --help")
    results = {}
    for chosen, pictures, projection_name, surface in wanted:
        with progress_bar() as progress:
            results[f"{projection_name}.json"], fresh = make_projection_stage(
                installation, chosen, pictures, name=projection_name, shown_on=surface, force=force, progress=progress
            )
        if not fresh:
            say(f"projection {projection_name} is up to date; nothing to do (--force makes it anew)")
    report_records(as_json, results, installation.folder("projection"))


@app.command()
def preview(
    dir: Dir,
    name: Annotated[str, typer.Option(help="Only this projection.", show_default=False)] = "",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Photograph the projections on both surfaces of the virtual bench, as a viewer at the set distance sees them."""
    from paxel_design.stages.projection import make_previews

    installation = _open(dir)
    with progress_bar() as progress:
        results, fresh = make_previews(installation, [name] if name else [], force, progress)
    if not fresh:
        say("preview is up to date; nothing to do (--force makes it anew)")
    report_records(as_json, results, installation.folder("preview"))


@app.command()
def status(dir: Dir, as_json: Json = False) -> None:
    """Tell what is done, stale or missing, why, and which command comes next."""
    installation = _open(dir)
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
    console = Console(highlight=False)
    console.print(table)
    console.print(f"next: {next_command}" if next_command else "everything is up to date")


@app.command()
def demo(dir: Dir, preset: Preset = "bw-checkerboard", set: Set = None, as_json: Json = False) -> None:
    """Everything from design to picture on the virtual bench, with two real photographs.

    Writes an installation folder and demo.png, a contact sheet. Run again, it makes only what is missing.
    """
    from paxel_design.demo import run_demo

    with progress_bar() as progress:
        result = run_demo(dir, preset, _overrides(set), progress, say)
    if as_json:
        print_json(result)
        return
    print_table("figures (virtual bench)", result["figures"])
    print_table("files", result["files"])


# Parsing ------------------------------------------------------------------------------------------------------------


def _overrides(pairs: list[str] | None) -> dict[str, Any]:
    overrides = {}
    for pair in pairs or []:
        key, equals, text = pair.partition("=")
        if not equals:
            raise UsageError(f"--set must be KEY=VALUE, such as pattern.dot_size_mm=0.5; got {pair!r}")
        try:
            overrides[key.strip()] = tomllib.loads(f"v = {text}")["v"]
        except tomllib.TOMLDecodeError:
            overrides[key.strip()] = text.strip()  # a bare word is a string
    return overrides


def _effect(text: str, lab: tuple[float, float, float] | None) -> Any:
    from paxel_runtime.model.effects import parse_effect

    if lab is not None:
        if text != "neutralize":
            raise UsageError(f"--lab belongs to --effect neutralize, got --effect {text}")
        text = f"neutralize:{','.join(f'{v:g}' for v in lab)}"
    return parse_effect(text)


def _pictures(effect: Any, given: dict[str, Path | None]) -> dict[str, Path]:
    pictures = {name: path for name, path in given.items() if path is not None}
    flags = {name: f"--{name.replace('_', '-')}" for name in given}
    if set(pictures) != set(effect.pictures):
        wanted = " and ".join(flags[name] for name in effect.pictures)
        found = ", ".join(flags[name] for name in pictures) or "none"
        raise InputError(f"--effect {effect.key} needs {wanted}; got {found}")
    return pictures


def _open(dir: Path) -> Installation:
    from paxel_runtime.installation import Installation

    return Installation.open(dir)


def _list_colorants(as_json: bool) -> None:
    """The library of colorants: the printer's recipe, and XYZ under equal energy with Y = 1 for the paper."""
    from paxel_runtime.model.colorimetry import spectra_to_XYZ
    from paxel_runtime.model.pattern import colorant_library

    library = colorant_library()
    paper_Y = spectra_to_XYZ(library["white"].reflectance)[1]
    rows = {
        name: {"cmyk": list(c.cmyk), "XYZ": (spectra_to_XYZ(c.reflectance) / paper_Y).round(4).tolist()}
        for name, c in library.items()
    }
    report(as_json, rows, "colorants (solid on FOGRA39 coated paper; white is the bare paper)")


# Running and telling ------------------------------------------------------------------------------------------------


def _run_stage(
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

    installation = _open(dir)
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


def _up_to_date(installation: Installation, stage: str, records: list[str]) -> bool:
    folder = installation.folder(stage)
    if not all((folder / record).is_file() for record in records):
        return False
    from paxel_runtime.storage import read_json

    today = installation.inputs(stage)
    return all(read_json(folder / record).get("inputs") == today for record in records)


def _records(installation: Installation, stage: str, names: list[str]) -> dict[str, Any]:
    from paxel_runtime.storage import read_json

    return {name: read_json(installation.folder(stage) / name) for name in names}


if __name__ == "__main__":
    main()
