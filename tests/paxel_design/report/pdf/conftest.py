"""An invented report with all that a page can hold: long tables, long words, many pictures, nothing at all."""

from collections.abc import Callable

import matplotlib
import numpy as np
import pytest

from paxel_design.report.charts import LINE_STYLES, PALETTE, new_figure, style
from paxel_design.report.content import (
    Block,
    Bullets,
    Chart,
    Heading,
    Paragraph,
    Picture,
    Pictures,
    Quantity,
    Section,
    Table,
    Verdict,
    Verdicts,
)

Sections = tuple[Section, ...]

_LOREM = (
    "The pattern mixes two colorants finer than the eye resolves, so that one projection shows one picture on it and "
    "another on the white sheet beside it. "
)


def photograph(height: int, width: int, seed: int = 0) -> np.ndarray:
    """Smooth colours with a little noise: what JPEG is made for."""
    y, x = np.mgrid[0 : 1 : complex(height), 0 : 1 : complex(width)]
    smooth = np.stack((0.5 + 0.4 * np.sin(5 * x + seed), 0.5 + 0.4 * np.cos(4 * y), 0.3 + 0.5 * x * y), axis=-1)
    noise = np.random.default_rng(seed).normal(0, 0.01, smooth.shape)
    return np.rint(255 * np.clip(smooth + noise, 0, 1)).astype(np.uint8)


def label_map(height: int, width: int) -> np.ndarray:
    """Flat colours with hard edges: what a palette is made for."""
    cells = np.random.default_rng(1).integers(0, 2, (height, width))
    return np.array([[20, 20, 20], [240, 240, 240]], dtype=np.uint8)[cells]


def chart(name: str, caption: str, height_mm: float = 60.0, word: str = "reachable") -> Chart:
    """A few curves with a word that is searched for."""
    with matplotlib.rc_context(style()):
        figure = new_figure(height_mm)
        axes = figure.subplots()
        t = np.linspace(0, 1, 30)
        for k in range(3):
            axes.plot(t, t ** (k + 1), LINE_STYLES[k], color=PALETTE[k], label=f"{word} {k}")
        axes.set_xlabel("L* on the pattern")
        axes.set_ylabel("ΔE₀₀")
        axes.legend()
    return Chart(name, caption, figure)


def _summary() -> Section:
    return Section(
        "summary",
        "Summary",
        (
            Paragraph(_LOREM * 2 + "It shows {gamut.full.volume} cubic units & 2 < 3."),
            Pictures(
                "three",
                "What it shows (virtual bench)",
                tuple(Picture(photograph(90, 160, k), f"picture {k}", "mean ΔE00 {gamut.dE}") for k in range(3)),
            ),
            Verdicts(
                "verdicts",
                "Verdicts (virtual bench)",
                (
                    Verdict("colours", "gamut.full.volume", "good", "good above 100 000", "Nothing to do."),
                    Verdict("accuracy", "gamut.dE", "usable", "good below 0.5, usable below 1.5 dE00", _LOREM),
                    Verdict("visibility", "pattern.visible", "weak", "good below 1", "Print finer dots."),
                ),
            ),
        ),
    )


def _gamut(rows: int) -> Section:
    long_word = "sha256:" + "0123456789abcdef" * 8
    numbers = tuple(
        (f"effect {k}", f"{1.5**k:.3f}", f"{k} %", "none" if k % 5 == 0 else f"-{k}.{k}") for k in range(rows)
    )
    return Section(
        "gamut",
        "Gamuts",
        (
            Heading("Volumes"),
            Paragraph(_LOREM * 3),
            Table("volumes", "Volumes of all effects. Long.", ("effect", "volume", "share", "change"), numbers),
            Heading("Words"),
            Table(
                "words",
                "Words that do not fit",
                ("term", "meaning", "hash"),
                (("one", _LOREM * 2, long_word), ("two", "short", "x"), ("three", _LOREM * 30, "3")),
                words=True,
            ),
            Heading("Curves"),
            chart("curves", "Curves (virtual bench)"),
            chart("higher", "Higher curves (virtual bench)", 120.0, "impossible"),
            Bullets((_LOREM, "b", "c {gamut.dE}")),
            Paragraph("A note.", small=True),
        ),
        {
            "gamut.full.volume": Quantity(833500.0, "CIELAB^3", digits=4),
            "gamut.dE": Quantity(0.62, "dE00"),
        },
    )


def _pattern() -> Section:
    crop = Picture(label_map(40, 56), "true scale", "0.75 mm dots", width_mm=42.0, pixelated=True)
    many = tuple(Picture(photograph(45, 60, k), f"number {k}", _LOREM[: 10 * k]) for k in range(24))
    return Section(
        "pattern",
        "The pattern, with a title that is much too long for the running head of a page, whatever the typeface",
        (
            Pictures("crops", "Crops at true scale", (crop, Picture(photograph(200, 300), "seen"), crop)),
            Heading("Many"),
            Pictures("many", "Many pictures", many),
            Pictures("one", "A tall picture", (Picture(photograph(300, 100), "tall"),)),
            Pictures("nothing", "No picture", ()),
            Table("empty", "No row", ("a", "b"), ()),
            Verdicts("no-verdicts", "No verdict", ()),
            Bullets(()),
            Heading("At the end of a section"),
        ),
        {"pattern.visible": Quantity(2.345, "JND")},
    )


@pytest.fixture(scope="session")
def invented_report() -> Callable[[int], Sections]:
    """Sections whose long table has so many rows."""

    def make(rows: int = 70) -> Sections:
        nothing: tuple[Block, ...] = ()
        return (_summary(), _pattern(), _gamut(rows), Section("provenance", "Provenance", nothing))

    return make
