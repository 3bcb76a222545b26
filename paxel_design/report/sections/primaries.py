"""The part of the gamut section on a print that turns one channel into colour: its primaries, and what limits white."""

from __future__ import annotations

import numpy as np

from paxel_design.gamut.primaries import primaries_figures
from paxel_design.report.charts.chromaticity import chromaticity_chart
from paxel_design.report.content import Block, Chart, Heading, Paragraph, Quantity, Table
from paxel_design.report.sections.gamut_sets import Figures, figures_of
from paxel_design.report.sections.parts import Part, on_the_bench
from paxel_design.report.source import ReportSource
from paxel_runtime.calibration.white_point import WHITES

__all__ = ["primaries"]

_LEAST_GAIN = 1.0
"""Percent of luminance below which other area shares are not worth a print: cells are counted in whole numbers."""


def primaries(source: ReportSource) -> Part:
    """The diagram of the primaries, their table and what limits each white.

    Parameters
    ----------
    source : ReportSource
        Of a model for which `has_primaries`.
    """
    clusters, bench = source.model.clusters, on_the_bench(source)
    equal = np.full(len(clusters), 1 / len(clusters))
    found = figures_of(source, "gamut/primaries.json", lambda: primaries_figures(source.model, equal))
    quantities: dict[str, Quantity] = {}
    rows = []
    for name in clusters:
        own = f"gamut.primaries.{name}"
        quantities |= {
            f"{own}.share": found.percent(f"shares/{name}"),
            f"{own}.x": found.quantity(f"primaries/{name}/xy/0"),
            f"{own}.y": found.quantity(f"primaries/{name}/xy/1"),
            f"{own}.luminance": found.percent(f"primaries/{name}/luminance"),
        }
        rows.append((name, *(f"{{{own}.{key}}}" for key in ("share", "x", "y", "luminance"))))
    chart = chromaticity_chart({n: found.at(f"primaries/{n}/xy") for n in clusters}, WHITES, found.at("full/xy"))
    caption = f"The primaries of the print and the colours between them, beside sRGB, in the CIE 1931 diagram{bench}."
    header = ("primary", "share of the area, %", "x", "y", "luminance of all at full, %")
    blocks: list[Block] = [
        Heading("Primaries and white"),
        Chart("gamut-primaries", caption, chart),
        Table("gamut-primaries-table", f"Primaries of the print, each at full{bench}.", header, tuple(rows)),
        *(_white(found, name, quantities) for name in WHITES),
    ]
    if not found.path:
        blocks.append(Paragraph("Area shares are taken as equal: a model on its own does not tell them.", small=True))
    return Part(blocks, quantities)


def _white(found: Figures, white: str, quantities: dict[str, Quantity]) -> Paragraph:
    """What limits one white, and the area shares that would not."""
    if found.at(f"whites/{white}") is None:
        return Paragraph(f"White {white} is outside the triangle of the primaries: no area shares give it.")
    own = f"gamut.primaries.{white}"
    quantities |= {
        f"{own}.limiting": found.quantity(f"whites/{white}/limiting"),
        f"{own}.luminance": found.percent(f"whites/{white}/luminance"),
    }
    text = (
        f"White {white} has {{{own}.luminance}} % of the light of all primaries at full; {{{own}.limiting}} limits it"
    )
    if "shares" not in found.at(f"whites/{white}"):
        return Paragraph(f"{text}.")
    gain = 100 * (found.at(f"whites/{white}/luminance_with_shares") / found.at(f"whites/{white}/luminance") - 1)
    quantities[f"{own}.gain"] = Quantity(gain, "%", "luminance with the best area shares over that of now, less one")
    if gain < _LEAST_GAIN:
        return Paragraph(f"{text}. The area shares fit: others would gain {{{own}.gain}} %.")
    names = list(found.at(f"whites/{white}/shares"))
    for name in names:
        quantities[f"{own}.share.{name}"] = found.percent(f"whites/{white}/shares/{name}")
    wanted = ", ".join(f"{name} {{{own}.share.{name}}} %" for name in names)
    return Paragraph(f"{text}. Printed with area shares {wanted} it would be {{{own}.gain}} % brighter.")
