"""The one command, `paxel`: what it is made of and how it tells an error (commands: `paxel_design.commands`)."""

from __future__ import annotations

from typing import Any

import typer
import typer.core

from paxel_design.commands import (
    advise,
    calibrate,
    capture,
    decode,
    gamut,
    pattern,
    pictures,
    register,
    report,
    start,
    study,
)
from paxel_design.console import messages, say
from paxel_runtime.errors import PaxelError

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
        "Step by step:  paxel new my-show, then pattern, capture, calibrate, gamut, project, preview, report; "
        "paxel status my-show always tells what comes next."
    ),
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

for command in (
    start.new,
    advise.advise,
    study.study,
    pattern.pattern,
    capture.capture,
    calibrate.calibrate,
    gamut.gamut,
    pictures.project,
    pictures.preview,
    report.report,
    decode.decode,
    register.register,
    start.status,
    start.demo,
):
    app.command()(command)


def main() -> None:
    """Run the command line: exit code 0, 1 (failed), 2 (usage) or 130 (Ctrl-C)."""
    app(prog_name="paxel")


if __name__ == "__main__":
    main()
