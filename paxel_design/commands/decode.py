"""`paxel decode`: structured light that other tools captured."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from paxel_design.commands.options import Json
from paxel_design.console import progress_bar, report, say
from paxel_runtime.errors import UsageError

__all__ = ["decode"]


def decode(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the captures.", show_default=False)],
    projector: Annotated[str, typer.Option(metavar="WxH", help="Projector's pixels, as 1024x768.", show_default=False)],
    scheme: Annotated[str, typer.Option(help="What was shown: opencv-gray.")] = "opencv-gray",
    out: Annotated[Path, typer.Option(help="File of the result.")] = Path("decoded.npz"),
    as_json: Json = False,
) -> None:
    """Decode Gray-code captures of another tool: where each camera pixel lies on the projector, to sub-pixels.

    One picture a frame, in the order of their names: each pattern and its inverse, columns then rows, coarse stripes
    first; then white and black (OpenCV's GrayCodePattern). Writes camera-size float32 arrays column and row (NaN where
    a pixel was not decoded) and confidence (0 to 1). The captures are checked first and never changed.

    Example:  paxel decode captures --projector 1024x768 --out decoded.npz
    """
    from paxel_runtime.captures.foreign import decode_folder
    from paxel_runtime.storage import write_npz

    size = re.fullmatch(r"(\d+)[xX×](\d+)", projector.strip())
    if size is None:
        raise UsageError(f"--projector must be WIDTHxHEIGHT in pixels, such as 1024x768; got {projector!r}")
    if out.suffix.lower() != ".npz":
        raise UsageError(f"--out must end in .npz, got {out}")
    if not out.absolute().parent.is_dir():
        raise UsageError(f"--out: there is no folder {out.absolute().parent}; make it first")
    with progress_bar() as progress:
        decoded, figures = decode_folder(folder, int(size[1]), int(size[2]), scheme, progress)
    if figures["mirrored"]:
        say(
            "the projection is seen mirrored: if there is no mirror and no rear projection, the first two captures are "
            "exchanged, or the first two of the rows"
        )
    column, row = decoded.projector_xy[..., 0], decoded.projector_xy[..., 1]
    write_npz(out, column=column.copy(), row=row.copy(), confidence=decoded.confidence)
    report(as_json, {**figures, "file": str(out)}, f"wrote {out}")
