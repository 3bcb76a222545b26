"""Rows of pictures: equal heights, true scale where it is asked for, as many to a line as can be read.

Computes widths and heights only; `Cell` says what is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from reportlab.platypus import Paragraph

from paxel_design.report.content import Picture, Quantity
from paxel_design.report.pdf.figures import GAP_PT, Cell
from paxel_design.report.pdf.layout import FRAME_HEIGHT_PT, PT_PER_MM, TEXT_WIDTH_PT
from paxel_design.report.pdf.objects import Objects
from paxel_design.report.pdf.typography import Typography, markup
from paxel_runtime.errors import InputError

__all__ = ["picture_lines"]

_LEAST_HEIGHT_PT = 30 * PT_PER_MM
"""Pictures go to a further line before they get lower than this."""

_LARGEST_HEIGHT_PT = 105 * PT_PER_MM

_LEAST_ROOM_PT = 22 * PT_PER_MM
"""For label and note of a narrow picture."""


def picture_lines(
    pictures: Sequence[Picture], type_: Typography, objects: Objects, quantities: Mapping[str, Quantity]
) -> list[list[Cell]]:
    """Pictures in lines; all that have no width of their own are equally high.

    Raises
    ------
    InputError
        If a picture at true scale is larger than a page's text, or has no pixels.
    """
    for picture in pictures:
        _check(picture)
    lines = _lines(pictures)
    height = type_.size * min((_common_height(line) for line in lines), default=0.0)
    return [[_cell(picture, height, type_, objects, quantities) for picture in line] for line in lines]


def _check(picture: Picture) -> None:
    h, w = picture.picture.shape[:2]
    if h == 0 or w == 0:
        raise InputError(f"the picture {picture.label!r} of the report has no pixels, got {w} x {h}")
    if picture.width_mm is None:
        return
    height_mm = picture.width_mm * h / w
    largest_mm = (TEXT_WIDTH_PT / PT_PER_MM, 0.85 * FRAME_HEIGHT_PT / PT_PER_MM)
    if not 0 < picture.width_mm <= largest_mm[0] + 1e-6 or height_mm > largest_mm[1]:
        raise InputError(
            f"the picture {picture.label!r} of the report is to be {picture.width_mm:g} x {height_mm:g} mm at true "
            f"scale, a page holds {largest_mm[0]:g} x {largest_mm[1]:.0f} mm; cut a smaller crop"
        )


def _ratio(picture: Picture) -> float:
    """Width over height."""
    return float(picture.picture.shape[1] / picture.picture.shape[0])


def _room(picture: Picture, height: float) -> float:
    """Width of the cell of a picture that is `height` high, unless it has a width of its own."""
    width = height * _ratio(picture) if picture.width_mm is None else picture.width_mm * PT_PER_MM
    return min(max(width, _LEAST_ROOM_PT), TEXT_WIDTH_PT)


def _taken(line: Sequence[Picture], height: float) -> float:
    return sum(_room(picture, height) for picture in line) + GAP_PT * (len(line) - 1)


def _lines(pictures: Sequence[Picture]) -> list[list[Picture]]:
    """As few lines as the least height allows, with equally many pictures where none has a width of its own."""
    lines: list[list[Picture]] = []
    for picture in pictures:
        if lines and _taken([*lines[-1], picture], _LEAST_HEIGHT_PT) <= TEXT_WIDTH_PT + 1e-6:
            lines[-1].append(picture)
        else:
            lines.append([picture])
    count = -(-len(pictures) // max(1, len(lines)))
    even = [list(pictures[k : k + count]) for k in range(0, len(pictures), max(1, count))]
    fits = all(_taken(line, _LEAST_HEIGHT_PT) <= TEXT_WIDTH_PT + 1e-6 for line in even)
    return even if fits and len(even) <= len(lines) else lines


def _common_height(line: Sequence[Picture]) -> float:
    """The largest height in which a line is no wider than the text."""
    low, high = 0.0, min(_LARGEST_HEIGHT_PT, *(TEXT_WIDTH_PT / _ratio(p) for p in line if p.width_mm is None), 1e9)
    if _taken(line, high) <= TEXT_WIDTH_PT:
        return high
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if _taken(line, middle) <= TEXT_WIDTH_PT else (low, middle)
    return low


def _cell(
    picture: Picture, height: float, type_: Typography, objects: Objects, quantities: Mapping[str, Quantity]
) -> Cell:
    width = height * _ratio(picture) if picture.width_mm is None else picture.width_mm * PT_PER_MM
    return Cell(
        objects.picture(picture, width / PT_PER_MM),
        width,
        width / _ratio(picture),
        _room(picture, height),
        Paragraph(markup(picture.label, quantities), type_.label) if picture.label else None,
        Paragraph(markup(picture.note, quantities), type_.note) if picture.note else None,
        framed=True,
        exact=picture.width_mm is not None,
    )
