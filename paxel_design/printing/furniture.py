"""Pieces of a sheet's furniture as data in millimetres: lines, patches, texts, modules, and how each kind is built.

Same geometry as `Pattern`: origin at the centre of the pattern, +x right, +y up. Where each piece lies on the sheet is
decided in `sheet`; nothing here knows a file format.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from paxel_design.printing.font import text_width_mm
from paxel_design.printing.plates import is_paper, recipe_of
from paxel_runtime.model.pattern import Colorant
from paxel_runtime.printed import RULER_MM

__all__ = [
    "PATCH_MM",
    "PATCH_PITCH_MM",
    "PATCH_ROW_MM",
    "RULER_MM",
    "SMALL_TEXT_MM",
    "Line",
    "Modules",
    "Patch",
    "Text",
    "crop_marks",
    "patch_rows",
    "ruler",
    "solids_of",
    "wrap_text",
]

PATCH_MM = 22.0
"""Edge of a solid patch: the usual aperture of a meter is 20 mm, a spectrophotometer's 8 mm and its foot 15 mm."""

PATCH_PITCH_MM = 30.0
"""From patch to patch along a row."""

PATCH_ROW_MM = 32.0
"""From row to row of patches, the names above each included."""

SMALL_TEXT_MM = 2.4

_HAIRLINE_MM = 0.1
_MARK_MM = 5.0


@dataclass(frozen=True)
class Line:
    """A thin black line."""

    start_mm: tuple[float, float]
    end_mm: tuple[float, float]
    width_mm: float = _HAIRLINE_MM


@dataclass(frozen=True)
class Patch:
    """A rectangle of one solid colorant, or of bare paper (`colorant` is None) within an outline."""

    lower_left_mm: tuple[float, float]
    size_mm: tuple[float, float]
    colorant: Colorant | None


@dataclass(frozen=True)
class Text:
    """A line of black text on its baseline; `height_mm` is the font size."""

    text: str
    at_mm: tuple[float, float]
    height_mm: float
    anchor: Literal["left", "middle", "right"] = "left"


@dataclass(frozen=True)
class Modules:
    """Black squares on a grid, such as a QR code: rows from the top, ``#`` is black."""

    rows: tuple[str, ...]
    upper_left_mm: tuple[float, float]
    module_mm: float

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height."""
        return len(self.rows[0]) * self.module_mm, len(self.rows) * self.module_mm

    def runs(self) -> Iterator[tuple[int, int, int]]:
        """Row, first column and length of every black run."""
        for i, row in enumerate(self.rows):
            start = 0
            for run in row.replace("#.", "# .").replace(".#", ". #").split(" "):
                if run[0] == "#":
                    yield i, start, len(run)
                start += len(run)


def crop_marks(trim_mm: tuple[float, float], from_trim_mm: float) -> list[Line]:
    """Two lines of 5 mm at every corner of the trim, from `from_trim_mm` outward."""
    marks = []
    near, far = from_trim_mm, from_trim_mm + _MARK_MM
    for side_x in (-1, 1):
        for side_y in (-1, 1):
            x, y = side_x * trim_mm[0] / 2, side_y * trim_mm[1] / 2
            marks.append(Line((x + side_x * near, y), (x + side_x * far, y)))
            marks.append(Line((x, y + side_y * near), (x, y + side_y * far)))
    return marks


def ruler(start_mm: tuple[float, float], *, along_x: bool) -> tuple[list[Line], list[Text]]:
    """A 100 mm ruler with millimetre ticks, the long ones at 0 and 100 mm, its figures on the outer side."""
    x, y = start_mm
    lines, texts = [], []
    for mm in range(RULER_MM + 1):
        length = 7.0 if mm in (0, RULER_MM) else 4.0 if mm % 10 == 0 else 2.5 if mm % 5 == 0 else 1.5
        at = (x + mm, y) if along_x else (x, y + mm)
        lines.append(Line(at, (at[0], y + length) if along_x else (x + length, at[1])))
        if mm % 10 == 0:
            figure = f"{mm} mm" if mm == RULER_MM else str(mm)
            middle = (at[0], y - 3.0) if along_x else (x - 1.0, at[1] - 0.35 * SMALL_TEXT_MM)
            texts.append(Text(figure, middle, SMALL_TEXT_MM, "middle" if along_x else "right"))
    end = (x + RULER_MM, y) if along_x else (x, y + RULER_MM)
    return [Line(start_mm, end), *lines], texts


def solids_of(colorants: Sequence[Colorant]) -> list[tuple[str, Colorant | None]]:
    """Names and solids of the patches: every colorant, and bare paper (None) if it is not one of them."""
    solids = [(colorant.name, None if is_paper(colorant) else colorant) for colorant in colorants]
    return solids if any(colorant is None for _, colorant in solids) else [*solids, ("bare paper", None)]


def patch_rows(
    solids: Sequence[tuple[str, Colorant | None]], lower_left_mm: tuple[float, float], per_row: int
) -> tuple[list[Patch], list[Text]]:
    """Rows of solid patches from the bottom up, each patch under its name and recipe."""
    patches, texts = [], []
    for i, (name, colorant) in enumerate(solids):
        row, column = divmod(i, per_row)
        x, y = lower_left_mm[0] + column * PATCH_PITCH_MM, lower_left_mm[1] + row * PATCH_ROW_MM
        patches.append(Patch((x, y), (PATCH_MM, PATCH_MM), colorant))
        texts.append(_fitted(name, (x, y + PATCH_MM + 4.6), SMALL_TEXT_MM))
        texts.append(_fitted(recipe_of(colorant), (x, y + PATCH_MM + 1.4), 0.85 * SMALL_TEXT_MM))
    return patches, texts


def _fitted(text: str, at_mm: tuple[float, float], height_mm: float) -> Text:
    """A text in at most its own height, smaller where it would run into the next patch's."""
    room_mm = PATCH_PITCH_MM - 1.0
    return Text(text, at_mm, min(height_mm, height_mm * room_mm / max(room_mm, text_width_mm(text, height_mm))))


def wrap_text(text: str, height_mm: float, width_mm: float) -> list[str]:
    """Lines of at most `width_mm`, broken between words, and within a word that is wider than a line."""
    lines = [""]
    for word in text.split(" "):
        candidate = f"{lines[-1]} {word}" if lines[-1] else word
        if text_width_mm(candidate, height_mm) <= width_mm:
            lines[-1] = candidate
            continue
        if lines[-1]:
            lines.append("")
        for character in word:
            if text_width_mm(lines[-1] + character, height_mm) > width_mm:
                lines.append("")
            lines[-1] += character
    return [line for line in lines if line]
