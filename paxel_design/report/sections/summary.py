"""The first page: what this installation can show, in words and three pictures, and how good it is.

Written last, of what the other sections found; it computes nothing but counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from paxel_design.report.charts.glance import glance_chart
from paxel_design.report.content import (
    Block,
    Chart,
    Paragraph,
    Picture,
    Pictures,
    Quantity,
    Section,
    Verdict,
    Verdicts,
    sRGB8,
)
from paxel_design.report.record import all_quantities
from paxel_design.report.sections.parts import on_the_bench
from paxel_design.report.source import ReportSource, quantities_at
from paxel_runtime.model.colorimetry import Lab_to_sRGB, linear_sRGB_to_sRGB, sRGB_to_linear_sRGB
from paxel_runtime.observer.judgement import VERDICTS
from paxel_runtime.storage import read_image, read_npz

__all__ = ["section"]

_WIDEST_PX = 960


def section(source: ReportSource, others: Sequence[Section]) -> Section:
    """The chapter.

    Parameters
    ----------
    source : ReportSource
    others : sequence of Section
        All other sections of the report; their quantities are named, and their verdicts gathered.
    """
    known = all_quantities(others)
    shown = _shown(source)
    own = _view_quantities(source, shown) | _counts(others)
    verdicts = _gathered(others)
    blocks: list[Block] = [Paragraph(" ".join(_sentences(source, known)))]
    blocks += [_pictures(source, shown, own)] if shown else [_glance(source)]
    if verdicts:
        caption = f"The worst figure of each kind; the chapters have all of them{on_the_bench(source)}."
        blocks += [Paragraph(_judged_words(verdicts)), Verdicts("summary-verdicts", caption, verdicts)]
    return Section("summary", "Summary", tuple(blocks), own, verdicts)


_ONE_SURFACE = "This installation turns one channel of light into full colour, by a printed pattern."
_ONE_SURFACE_SEVERAL = "This installation shows pictures on a printed pattern alone."
_TWO_SURFACES = (
    "This installation shows one picture on a printed pattern and another, or none, on a sheet that is held before it; "
    "the projection stays the same."
)

_SENTENCES = (
    (
        ("gamut.lightness.L_pattern", "gamut.lightness.L_white"),
        "Two pictures that have nothing to do with each other get the lightnesses L* {gamut.lightness.L_pattern} on "
        "the pattern and {gamut.lightness.L_white} on the sheet, of 100.",
    ),
    (
        ("gamut.neutralize-50_0_0.on-pattern.L_range",),
        "A picture that vanishes on the sheet gets {gamut.neutralize-50_0_0.on-pattern.L_range} units of lightness.",
    ),
    (
        ("gamut.full.on-pattern.volume", "gamut.full.on-pattern.srgb_held"),
        "A picture alone on the pattern has {gamut.full.on-pattern.volume} cubic CIELAB units of colours, "
        "{gamut.full.on-pattern.srgb_held} % of those of an ordinary screen (sRGB).",
    ),
    (
        ("calibration.prediction.pattern.dE00_mean", "calibration.prediction.white.dE00_mean"),
        "Colours come out as predicted to {calibration.prediction.pattern.dE00_mean} dE00 on the pattern and "
        "{calibration.prediction.white.dE00_mean} on the sheet; 1 is just told side by side.",
    ),
    (
        ("calibration.prediction.pattern.dE00_mean",),
        "Colours come out as predicted to {calibration.prediction.pattern.dE00_mean} dE00; 1 is just told side by "
        "side.",
    ),
)
"""What is told where all of these quantities are there; of sentences that begin alike, the first."""


def _sentences(source: ReportSource, known: Mapping[str, Quantity]) -> Iterator[str]:
    if source.model.white is not None:
        yield _TWO_SURFACES
    else:
        yield _ONE_SURFACE if len(source.model.channels) == 1 else _ONE_SURFACE_SEVERAL
    told: set[str] = set()
    for names, sentence in _SENTENCES:
        if all(name in known for name in names) and sentence[:12] not in told:
            told.add(sentence[:12])
            yield sentence
    if source.installation is None:
        yield (
            "It is known by its model.json alone: what hangs on the wall, how well it is registered, and what pictures "
            "look like is told by the report of an installation (paxel new, paxel project)."
        )


def _shown(source: ReportSource) -> str:
    """Name of the projection whose pictures stand on the page; empty where none was projected and looked at."""
    names = [path.partition("/")[2].removesuffix(".json") for path in source.records if path.startswith("preview/")]
    return "dual-image" if "dual-image" in names else next(iter(names), "")


def _view_quantities(source: ReportSource, shown: str) -> dict[str, Quantity]:
    """Figures under the pictures."""
    rows = {
        f"summary.seen.{surface}.{key}": (f"preview/{shown}.json#/on_{surface}/{key}", unit)
        for surface in ("pattern", "white")
        for key, unit in (("dE00_mean", "dE00"), ("ghosting_percent", "%"))
    }
    return quantities_at(source, rows) if shown else {}


def _pictures(source: ReportSource, shown: str, own: Mapping[str, Quantity]) -> Pictures:
    """What is sent and what is seen on each surface; with one surface, first what was wanted."""
    assert source.installation is not None
    path = source.installation.path
    sent = Picture(_reduced(read_image(path / "projection" / f"{shown}.png")), "sent: the projection image")
    seen = [
        Picture(
            _reduced(read_image(path / "preview" / f"{shown}.on-{surface}.auto.png")),
            f"seen on the {surface if surface == 'pattern' else 'sheet'}",
            _view_words(surface, own),
        )
        for surface in ("pattern", "white")
        if f"on_{surface}" in source.records[f"preview/{shown}.json"]
    ]
    mapped = path / "projection" / f"{shown}.npz"
    wanted = []
    if len(seen) == 1 and mapped.is_file():
        sRGB = np.clip(Lab_to_sRGB(read_npz(mapped)["Lab_pattern"].astype(np.float32)), 0, 1)
        wanted = [Picture(_reduced(np.rint(255 * sRGB).astype(np.uint8)), "wanted: in the colours there are")]
    caption = (
        f"One projection ({shown}), as the eye sees it when it has adapted to each surface{on_the_bench(source)}."
        if len(seen) == 2
        else f"One projection ({shown}), as the eye sees it when it has adapted{on_the_bench(source)}."
    )
    return Pictures("summary-pictures", caption, (*wanted, sent, *seen))


def _view_words(surface: str, own: Mapping[str, Quantity]) -> str:
    name = f"summary.seen.{surface}"
    words = [f"{{{name}.dE00_mean}} dE00 from its target"] if f"{name}.dE00_mean" in own else []
    words += [f"{{{name}.ghosting_percent}} % of the other shines through"] if f"{name}.ghosting_percent" in own else []
    return "; ".join(words)


def _glance(source: ReportSource) -> Chart:
    how = (
        "No pictures were projected yet: paxel project, then paxel preview, and this page shows them"
        if source.installation is not None
        else "A model.json alone has no pictures"
    )
    caption = (
        f"What light can do here: the colour of each input alone, black to full, and all colours seen along the gray "
        f"axis{on_the_bench(source)}. {how}."
    )
    return Chart("summary-glance", caption, glance_chart(source.model))


def _counts(others: Sequence[Section]) -> dict[str, Quantity]:
    """How many figures were judged how."""
    judgements = [verdict.judgement for section in others for verdict in section.verdicts]
    if not judgements:
        return {}
    words = "counted over the report"
    counted = {word: judgements.count(word) for word in ("good", "usable", "weak")}
    return {
        "summary.judged": Quantity(len(judgements), "figures", words),
        **{f"summary.{word}": Quantity(number, "figures", words) for word, number in counted.items()},
    }


def _judged_words(verdicts: Sequence[Verdict]) -> str:
    text = "Figures judged: {summary.judged}; good {summary.good}, usable {summary.usable}, weak {summary.weak}."
    weak = [verdict.name for verdict in verdicts if verdict.judgement == "weak"]
    return text + (f" Look first at: {', '.join(weak)}." if weak else "")


def _gathered(others: Sequence[Section]) -> tuple[Verdict, ...]:
    """Of each section and rule the worst verdict, the first of equals; in the sections' order."""
    worst: dict[tuple[str, str], Verdict] = {}
    for section in others:
        for verdict in section.verdicts:
            key = (section.key, verdict.rule)
            if key not in worst or _rank(verdict) > _rank(worst[key]):
                worst[key] = verdict
    return tuple(worst.values())


def _rank(verdict: Verdict) -> int:
    return VERDICTS.index(verdict.judgement)


def _reduced(picture: NDArray[np.uint8]) -> sRGB8:
    """A picture for a third of the line: at most `_WIDEST_PX` wide, in three planes, reduced in linear light."""
    colour = np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture[..., :3]
    step = -(-colour.shape[1] // _WIDEST_PX)
    if step == 1:
        return np.ascontiguousarray(colour)
    rows, columns = (size // step * step for size in colour.shape[:2])
    linear = sRGB_to_linear_sRGB(colour[:rows, :columns] / np.float32(255))
    mean = linear.reshape(rows // step, step, columns // step, step, 3).mean(axis=(1, 3))
    return np.rint(255 * linear_sRGB_to_sRGB(mean)).astype(np.uint8)
