"""What a report says, before it is set in type: sections of blocks, and the quantities that they quote.

A section is pure content. It knows nothing of pages or tags: `report.pdf` and `report.html` set the same sections, and
report.json lists their quantities. A number of this installation never stands in a text by itself; the text names the
quantity, ``{calibration.accuracy.pattern.dE00_mean}``, and `filled` writes it. So what is printed is what the JSON
says.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from paxel_design.gamut.scenes import SceneBody

__all__ = [
    "Block",
    "Bullets",
    "Chart",
    "Heading",
    "Paragraph",
    "Picture",
    "Pictures",
    "Quantity",
    "Scene",
    "Section",
    "Table",
    "Verdict",
    "Verdicts",
    "filled",
    "numbered",
    "quoted",
    "unit_words",
]

sRGB8 = NDArray[np.uint8]
"""(h, w, 3) sRGB codes."""

Value = float | int | str | bool | tuple[float, ...] | tuple[str, ...]


@dataclass(frozen=True)
class Quantity:
    """A figure of this installation, as report.json holds it.

    Attributes
    ----------
    value : float, int, str, bool, tuple of float or tuple of str
    unit : str
        "dE00", "L*", "CIELAB^3", "mm", "%", ...; empty for counts and words.
    source : str
        Where it stands: a file of the installation and a JSON pointer in it, ``"calibration/accuracy.json#/n"``; or
        words on how it was computed. A test follows every pointer.
    digits : int
        Significant digits in texts; whole units are always written, in groups of three that no line parts, never with
        an exponent.
    """

    value: Value
    unit: str = ""
    source: str = ""
    digits: int = 3


@dataclass(frozen=True)
class Heading:
    """A heading inside a section; it also stands in the contents."""

    text: str


@dataclass(frozen=True)
class Paragraph:
    """Text with quantities in braces. `small`: a note, set smaller."""

    text: str
    small: bool = False


@dataclass(frozen=True)
class Bullets:
    """A list; each item as a paragraph."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """Rows of texts under a header; the first column is left-aligned, the others are numbers unless `words`.

    Attributes
    ----------
    name : str
        Anchor; unique in the report.
    caption : str
    header : tuple of str
    rows : tuple of tuple of str
        Each as long as the header; texts with quantities in braces.
    words : bool
        All columns hold words and are left-aligned and wrapped.
    """

    name: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: bool = False


@dataclass(frozen=True, eq=False)
class Chart:
    """A drawing in lines and text, set as vectors.

    Attributes
    ----------
    name : str
        Anchor, and the stem of a file name; unique in the report.
    caption : str
    figure : matplotlib Figure
        Made by `paxel_design.report.charts.new_figure`, at its final size.
    """

    name: str
    caption: str
    figure: Figure


@dataclass(frozen=True, eq=False)
class Picture:
    """Pixels.

    Attributes
    ----------
    picture : (h, w, 3) uint8 array
        sRGB.
    label : str
        A few words above it.
    note : str
        Figures below it, with quantities in braces.
    width_mm : float or None
        Set at exactly this width (a crop at true scale); None shares the line's width.
    pixelated : bool
        Enlarge with its pixels kept.
    """

    picture: sRGB8
    label: str
    note: str = ""
    width_mm: float | None = None
    pixelated: bool = False


@dataclass(frozen=True, eq=False)
class Pictures:
    """A row of pictures under one caption."""

    name: str
    caption: str
    pictures: tuple[Picture, ...]


@dataclass(frozen=True, eq=False)
class Scene:
    """Bodies in one CIELAB space: interactive in report.html, rendered from two sides in report.pdf.

    Attributes
    ----------
    name : str
    caption : str
    bodies : tuple of SceneBody
        The outermost first.
    """

    name: str
    caption: str
    bodies: tuple[SceneBody, ...]


Judgement = Literal["good", "usable", "weak"]


@dataclass(frozen=True)
class Verdict:
    """A quantity against its thresholds.

    Attributes
    ----------
    name : str
        What is judged, in a few words.
    quantity : str
        Name of the quantity that decides.
    judgement : "good" | "usable" | "weak"
    rule : str
        The thresholds in words: "good below 0.5, usable below 1.5 dE00".
    advice : str
        What to do about it, or what it means; may be empty.
    """

    name: str
    quantity: str
    judgement: Judgement
    rule: str
    advice: str = ""


@dataclass(frozen=True)
class Verdicts:
    """A table of verdicts."""

    name: str
    caption: str
    verdicts: tuple[Verdict, ...]


Block = Heading | Paragraph | Bullets | Table | Chart | Pictures | Scene | Verdicts


@dataclass(frozen=True, eq=False)
class Section:
    """A chapter of the report, on a page of its own.

    Attributes
    ----------
    key : str
        Anchor, and the first part of its quantities' names: "summary", "pattern", "calibration", "gamut", "pictures",
        "recommendations", "definitions", "provenance".
    title : str
    blocks : tuple of Block
    quantities : mapping of str to Quantity
        By full name, ``"gamut.full.on-pattern.volume"``.
    verdicts : tuple of Verdict
        What this section judges; the summary gathers them.
    """

    key: str
    title: str
    blocks: tuple[Block, ...]
    quantities: Mapping[str, Quantity] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()


def numbered(sections: Sequence[Section]) -> dict[str, str]:
    """What captions begin with, by the block's name: ``"Fig. 3"``, ``"Table 1"``; each kind counted through the report.

    Raises
    ------
    InputError
        If two blocks have one name.
    """
    numbers: dict[str, str] = {}
    counts = {"Fig.": 0, "Table": 0}
    for block in (block for section in sections for block in section.blocks):
        if isinstance(block, Heading | Paragraph | Bullets):
            continue
        if block.name in numbers:
            raise InputError(f"two blocks of the report have the name {block.name!r}; give one of them another")
        kind = "Table" if isinstance(block, Table | Verdicts) else "Fig."
        counts[kind] += 1
        numbers[block.name] = f"{kind} {counts[kind]}"
    return numbers


def quoted(quantity: Quantity) -> str:
    """A quantity as texts write it, without its unit: 0.124, 833 500, 19.0 to 42.0 (a tuple of two), yes."""
    value = quantity.value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        words = [part if isinstance(part, str) else _number(part, quantity.digits) for part in value]
        numbers = not any(isinstance(part, str) for part in value)
        return " to ".join(words) if len(words) == 2 and numbers else ", ".join(words)
    return _number(value, quantity.digits)


_REFERENCE = re.compile(r"\{([A-Za-z0-9_.+:-]+)\}")


def unit_words(unit: str) -> str:
    """A unit as texts write it: CIELAB³ of ``"CIELAB^3"``."""
    return unit.replace("^2", "²").replace("^3", "³")


def filled(text: str, quantities: Mapping[str, Quantity]) -> str:
    """A text with its quantities written out.

    Parameters
    ----------
    text : str
    quantities : mapping of str to Quantity
        All of the report, by full name.

    Raises
    ------
    InputError
        If the text names a quantity that is not there.
    """

    def written(match: re.Match[str]) -> str:
        name = match.group(1)
        if name not in quantities:
            raise InputError(f"a text of the report names the quantity {name!r}, which no section has: {text!r}")
        return quoted(quantities[name])

    return _REFERENCE.sub(written, text)


def _number(value: float, digits: int) -> str:
    if isinstance(value, int) and abs(value) < 1000:
        return str(value)
    if not np.isfinite(value):
        return "none"
    leading = int(np.floor(np.log10(abs(value)))) if value else 0
    return f"{value:,.{min(max(0, digits - 1 - leading), 6)}f}".replace(",", "\u00a0")
