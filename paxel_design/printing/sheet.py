"""The furniture of a print sheet: sizes, crop marks, rulers, colour patches and caption, as data in millimetres.

PDF and preview draw the same `Sheet`, so they cannot differ. Same geometry as `Pattern`: origin at the centre
of the pattern, +x right, +y up. The border between pattern and trim is bare paper but for the furniture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from paxel_design.patterns import colorants_of
from paxel_design.printing.font import missing_characters, text_width_mm
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant, Pattern
from paxel_runtime.version import WRITER

__all__ = [
    "BLEED_MM",
    "RULER_MM",
    "SLUG_MM",
    "Line",
    "Patch",
    "Sheet",
    "Text",
    "pattern_summary",
    "recipe_of",
    "sheet_of",
]

BLEED_MM = 3.0
"""Paper beyond the trim that a shop asks for; nothing of the sheet reaches into it."""

SLUG_MM = 12.0
"""Paper beyond the trim that holds the crop marks."""

RULER_MM = 100
"""Length of the two rulers, between the centres of their outer ticks."""

_SIDE_MM = 25.0
_END_MM = 40.0
_PATCH_MM = 22.0
_PATCH_PITCH_MM = 30.0
_MARK_MM = 5.0
_HAIRLINE_MM = 0.1
_SMALL_TEXT_MM = 2.4
_TEXT_MM = 2.8
_CAPTION_LIMIT = 120
_LARGEST_PAGE_MM = 5080.0  # 14400 pt, the largest page of a PDF without UserUnit


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
class Sheet:
    """One printed sheet around a pattern.

    Attributes
    ----------
    trim_mm : (float, float)
        Width and height of the sheet after cutting; the pattern lies at its centre.
    lines, patches, texts
        The furniture.
    """

    trim_mm: tuple[float, float]
    lines: tuple[Line, ...]
    patches: tuple[Patch, ...]
    texts: tuple[Text, ...]

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


def sheet_of(pattern: Pattern, *, dpi: float, ink_spread_um: float, caption: str) -> Sheet:
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

    Raises
    ------
    InputError
        If a dot has less than 3 dots of the printer, the page exceeds 5080 mm, the caption is no single line of at
        most 120 characters, or a colorant is unknown.
    """
    _check(pattern, dpi, caption)
    half_height = pattern.size_mm[1] / 2
    colorants = colorants_of(pattern.colorants)
    captions = _captions(pattern, dpi, ink_spread_um, caption)
    solids = _solids(colorants)
    band_mm = max(
        pattern.size_mm[0],
        RULER_MM + 10.0,
        len(solids) * _PATCH_PITCH_MM,
        max(text_width_mm(line, _TEXT_MM) for line in captions),
    )
    trim_mm = (band_mm + 2 * _SIDE_MM, max(pattern.size_mm[1] + 2 * _END_MM, RULER_MM + 30.0))
    if max(trim_mm) + 2 * SLUG_MM > _LARGEST_PAGE_MM:
        raise InputError(
            f"a sheet must be at most {_LARGEST_PAGE_MM - 2 * SLUG_MM:g} mm on each side with its border, "
            f"got {trim_mm[0]:g} x {trim_mm[1]:g} mm: print the pattern in several parts"
        )
    left = -band_mm / 2
    x_ruler = _ruler((left, -half_height - 12.0), along_x=True)
    y_start = -half_height if pattern.size_mm[1] >= RULER_MM else -RULER_MM / 2
    y_ruler = _ruler((left - 9.0, y_start), along_x=False)
    patches, patch_texts = _patches(solids, left, half_height + 8.0)
    texts = [Text(line, (left, -half_height - 23.0 - 4.6 * i), _TEXT_MM) for i, line in enumerate(captions)]
    return Sheet(
        trim_mm,
        (*_crop_marks(trim_mm), *x_ruler[0], *y_ruler[0]),
        tuple(patches),
        (*texts, *x_ruler[1], *y_ruler[1], *patch_texts),
    )


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


def _captions(pattern: Pattern, dpi: float, ink_spread_um: float, caption: str) -> list[str]:
    compensation = f"dots shrunk by {ink_spread_um:.1f} µm" if ink_spread_um else "no ink-spread compensation"
    made = f"{dpi:g} dpi, {compensation}, print at 100 % (no scaling), {WRITER}"
    return [line for line in (caption, pattern_summary(pattern), made) if line]


def _crop_marks(trim_mm: tuple[float, float]) -> list[Line]:
    marks = []
    for side_x in (-1, 1):
        for side_y in (-1, 1):
            x, y = side_x * trim_mm[0] / 2, side_y * trim_mm[1] / 2
            near, far = BLEED_MM + 1.0, BLEED_MM + 1.0 + _MARK_MM
            marks.append(Line((x + side_x * near, y), (x + side_x * far, y)))
            marks.append(Line((x, y + side_y * near), (x, y + side_y * far)))
    return marks


def _ruler(start_mm: tuple[float, float], *, along_x: bool) -> tuple[list[Line], list[Text]]:
    """A 100 mm ruler with millimetre ticks, the long ones at 0 and 100 mm, its figures on the outer side."""
    x, y = start_mm
    lines, texts = [], []
    for mm in range(RULER_MM + 1):
        length = 7.0 if mm in (0, RULER_MM) else 4.0 if mm % 10 == 0 else 2.5 if mm % 5 == 0 else 1.5
        at = (x + mm, y) if along_x else (x, y + mm)
        lines.append(Line(at, (at[0], y + length) if along_x else (x + length, at[1])))
        if mm % 10 == 0:
            figure = f"{mm} mm" if mm == RULER_MM else str(mm)
            middle = (at[0], y - 3.0) if along_x else (x - 1.0, at[1] - 0.35 * _SMALL_TEXT_MM)
            texts.append(Text(figure, middle, _SMALL_TEXT_MM, "middle" if along_x else "right"))
    end = (x + RULER_MM, y) if along_x else (x, y + RULER_MM)
    return [Line(start_mm, end), *lines], texts


def _solids(colorants: tuple[Colorant, ...]) -> list[tuple[str, Colorant | None]]:
    """Names and solids of the patches: every colorant, and bare paper (None) if it is not one of them."""
    solids = [(colorant.name, colorant if max(colorant.cmyk) > 0 else None) for colorant in colorants]
    return solids if any(colorant is None for _, colorant in solids) else [*solids, ("bare paper", None)]


def _patches(
    solids: list[tuple[str, Colorant | None]], left_mm: float, bottom_mm: float
) -> tuple[list[Patch], list[Text]]:
    """A row of solid patches, each under its name and recipe."""
    patches, texts = [], []
    for i, (name, colorant) in enumerate(solids):
        x, top = left_mm + i * _PATCH_PITCH_MM, bottom_mm + _PATCH_MM
        patches.append(Patch((x, bottom_mm), (_PATCH_MM, _PATCH_MM), colorant))
        texts.append(Text(name, (x, top + 4.6), _SMALL_TEXT_MM))
        texts.append(Text(recipe_of(colorant), (x, top + 1.4), 0.85 * _SMALL_TEXT_MM))
    return patches, texts


def recipe_of(colorant: Colorant | None) -> str:
    """The printer's recipe of a colorant, such as ``"M100 Y100"``; None is bare paper."""
    shares = zip("CMYK", colorant.cmyk if colorant else (0.0,) * 4, strict=True)
    return " ".join(f"{ink}{100 * share:g}" for ink, share in shares if share) or "no ink"
