"""The print sheet around a pattern: how large it is, and where its furniture lies, as data in millimetres.

PDF and preview draw the same `Sheet`, so they cannot differ. Same geometry as `Pattern`: origin at the centre of the
pattern, which is the centre of the sheet too, +x right, +y up. The border between pattern and trim is bare paper but
for the furniture: a fiducial beyond each corner, the patches above, the y ruler on the left, the x ruler, the captions
and the code below. On a large sheet all that lies between the fiducials; on a small one, beyond them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from paxel_design.printing.fiducials import (
    FIDUCIAL_GAP_MM,
    FIDUCIAL_MM,
    FIDUCIAL_MODULES,
    Fiducial,
    fiducials_of,
)
from paxel_design.printing.font import missing_characters
from paxel_design.printing.furniture import (
    PATCH_PITCH_MM,
    PATCH_ROW_MM,
    RULER_MM,
    Line,
    Modules,
    Patch,
    Text,
    crop_marks,
    patch_rows,
    ruler,
    solids_of,
    wrap_text,
)
from paxel_design.printing.plates import Plates, plates_of
from paxel_design.printing.sheet_code import code_modules, code_text
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant, Pattern
from paxel_runtime.version import WRITER

__all__ = ["BLEED_MM", "SLUG_MM", "Sheet", "pattern_summary", "sheet_of"]

BLEED_MM = 3.0
"""Paper beyond the trim that a shop asks for; nothing of the sheet reaches into it."""

SLUG_MM = 12.0
"""Paper beyond the trim that holds the crop marks."""

_EDGE_MM = 4.0  # between the furniture and the trim
_CORNER_MM = FIDUCIAL_GAP_MM + FIDUCIAL_MM  # beyond the pattern, in x and in y
_BELT_MM = _CORNER_MM + 4.0
_SIDE_RULER_MM = 9.0  # from the pattern, or from what lies between, to the line of the y ruler
_SIDE_RULER_WIDTH_MM = 22.0
_RULER_TEXTS_MM = 2.0  # of the y ruler beyond its ends
_ROW_GAP_MM = 4.0
_CODE_MODULE_MM = 0.6  # 7 pixels at 300 dpi
_CODE_QUIET_MM = 4 * _CODE_MODULE_MM  # of bare paper around a QR code (ISO 18004)
_TEXT_MM = 2.8
_LINE_MM = 4.6
_CAPTION_LIMIT = 120


@dataclass(frozen=True)
class Sheet:
    """One printed sheet around a pattern.

    Attributes
    ----------
    trim_mm : (float, float)
        Width and height of the sheet after cutting; the pattern lies at its centre.
    colorants : tuple of Colorant
        Those of the pattern, in its order.
    plates : Plates
        What prints them.
    lines, patches, texts, modules
        The furniture.
    fiducials : tuple of Fiducial
        The markers among `modules`.
    code : str
        The text of the QR code.
    """

    trim_mm: tuple[float, float]
    colorants: tuple[Colorant, ...]
    plates: Plates
    lines: tuple[Line, ...]
    patches: tuple[Patch, ...]
    texts: tuple[Text, ...]
    modules: tuple[Modules, ...]
    fiducials: tuple[Fiducial, ...]
    code: str

    @property
    def page_mm(self) -> tuple[float, float]:
        """Width and height of the page, crop marks included."""
        return self.trim_mm[0] + 2 * SLUG_MM, self.trim_mm[1] + 2 * SLUG_MM


def pattern_summary(pattern: Pattern) -> str:
    """The pattern in one line, as it stands on the sheet."""
    width_mm, height_mm = pattern.size_mm
    return (
        f"{pattern.layout}, {' + '.join(pattern.colorants)}, dot {pattern.dot_size_mm:g} mm, "
        f"{pattern.angle_deg:g}°, {width_mm:g} × {height_mm:g} mm"
    )


def sheet_of(
    pattern: Pattern,
    *,
    dpi: float,
    ink_spread_um: float,
    caption: str,
    recipe: Mapping[str, Any] | None = None,
) -> Sheet:
    """Lay out the sheet of a pattern.

    Parameters
    ----------
    pattern : Pattern
        What lies in the middle.
    dpi : float
        Resolution of the printer, dots per inch, > 0.
    ink_spread_um : float
        The compensation that is realised, for the caption.
    caption : str
        The user's own line, at most 120 characters; may be empty.
    recipe : mapping, optional
        See `paxel_design.printing.sheet_code.code_text`.

    Raises
    ------
    InputError
        If a dot has less than 3 dots of the printer, the caption is no single line of at most 120 characters,
        or a spot plate or the code of the sheet is impossible.
    """
    inks = pattern.palette
    _check(pattern, dpi, caption)
    code = code_text(pattern, recipe)
    matrix = code_modules(code)
    code_mm = len(matrix) * _CODE_MODULE_MM + 2 * _CODE_QUIET_MM
    frame = _frame(pattern.size_mm, RULER_MM + 10.0 + _ROW_GAP_MM + code_mm)
    y_ruler = ruler(frame.y_ruler_mm, along_x=False)
    x_ruler = ruler((-frame.row_mm / 2, -frame.rows_from_mm - 10.0), along_x=True)
    solids, per_row = solids_of(inks), int(frame.row_mm / PATCH_PITCH_MM)
    patches, patch_texts = patch_rows(solids, (-frame.row_mm / 2, frame.rows_from_mm + 2.0), per_row)
    column_mm = frame.row_mm - _ROW_GAP_MM - code_mm
    captions = _captions(pattern, dpi, ink_spread_um, caption, column_mm)
    baselines_mm = [-frame.rows_from_mm - 20.0 - _LINE_MM * i for i in range(len(captions))]
    texts = [Text(line, (-frame.row_mm / 2, y), _TEXT_MM) for line, y in zip(captions, baselines_mm, strict=True)]
    code_at = (frame.row_mm / 2 - code_mm + _CODE_QUIET_MM, -frame.rows_from_mm - _CODE_QUIET_MM)
    fiducials = fiducials_of(pattern.size_mm)
    half_height = max(
        frame.half_mm[1],
        frame.rows_from_mm + 2.0 + PATCH_ROW_MM * -(-len(solids) // per_row),
        frame.rows_from_mm + code_mm,
        1.0 - baselines_mm[-1],
    )
    trim_mm = (2 * (frame.half_mm[0] + _EDGE_MM), 2 * (half_height + _EDGE_MM))
    return Sheet(
        trim_mm,
        inks,
        plates_of(inks),
        (*crop_marks(trim_mm, BLEED_MM + 1.0), *x_ruler[0], *y_ruler[0]),
        tuple(patches),
        (*texts, *x_ruler[1], *y_ruler[1], *patch_texts),
        (*map(_marker, fiducials), Modules(matrix, code_at, _CODE_MODULE_MM)),
        fiducials,
        code,
    )


@dataclass(frozen=True)
class _Frame:
    """Where furniture may lie: rows `row_mm` wide about x = 0, at least `rows_from_mm` above and below the centre.

    `half_mm` is what the sheet needs on each side of the centre, the rows apart.
    """

    row_mm: float
    rows_from_mm: float
    y_ruler_mm: tuple[float, float]
    half_mm: tuple[float, float]


def _frame(size_mm: tuple[float, float], least_row_mm: float) -> _Frame:
    """Between the fiducials what fits there, beyond them what does not."""
    half_width, half_height = size_mm[0] / 2, size_mm[1] / 2
    row_mm = max(size_mm[0], least_row_mm)
    between, tall = size_mm[0] >= least_row_mm, size_mm[1] >= RULER_MM + 2 * _RULER_TEXTS_MM
    rows_from_mm = half_height + FIDUCIAL_GAP_MM if between else half_height + _BELT_MM
    ruler_right_mm = half_width if tall else half_width + _BELT_MM
    if not (tall or between):
        rows_from_mm = max(rows_from_mm, RULER_MM / 2 + _RULER_TEXTS_MM)
    return _Frame(
        row_mm,
        rows_from_mm,
        (-ruler_right_mm - _SIDE_RULER_MM, _RULER_TEXTS_MM - half_height if tall else -RULER_MM / 2),
        (
            max(row_mm / 2, half_width + _CORNER_MM, ruler_right_mm + _SIDE_RULER_WIDTH_MM),
            max(half_height + _CORNER_MM, RULER_MM / 2 + _RULER_TEXTS_MM),
        ),
    )


def _marker(fiducial: Fiducial) -> Modules:
    return Modules(FIDUCIAL_MODULES[fiducial.id], fiducial.corners_mm[0], FIDUCIAL_MM / len(FIDUCIAL_MODULES[0]))


def _check(pattern: Pattern, dpi: float, caption: str) -> None:
    if not dpi > 0:
        raise InputError(f"dpi must be > 0, got {dpi:g}")
    printer_dots = pattern.dot_size_mm * dpi / 25.4
    if printer_dots < 3:
        raise InputError(
            f"a dot must be at least 3 dots of the printer, got {printer_dots:.2f} ({pattern.dot_size_mm:g} mm at "
            f"{dpi:g} dpi): use at least {3 * 25.4 / dpi:.3f} mm or {3 * 25.4 / pattern.dot_size_mm:.0f} dpi"
        )
    if len(caption) > _CAPTION_LIMIT or not caption.isprintable():
        raise InputError(
            f"caption must be one line of at most {_CAPTION_LIMIT} characters, got {len(caption)} "
            f"({caption[:20]!r}...): shorten it"
        )
    if missing := missing_characters(caption):
        raise InputError(f"caption must be in Latin letters, digits and signs, got {missing!r}: write it without these")


def _captions(pattern: Pattern, dpi: float, ink_spread_um: float, caption: str, width_mm: float) -> list[str]:
    compensation = f"dots shrunk by {ink_spread_um:.1f} µm" if ink_spread_um else "no ink-spread compensation"
    made = f"{dpi:g} dpi, {compensation}, print at 100 % (no scaling), {WRITER}"
    glows = any(colorant.fluorescence is not None for colorant in pattern.palette)
    paper = "fluorescent inks: paper without optical brightener" if glows else ""
    paragraphs = (caption, pattern_summary(pattern), made, paper)
    return [line for paragraph in paragraphs for line in wrap_text(paragraph, _TEXT_MM, width_mm)]
