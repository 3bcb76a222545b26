"""Printing plates as colour spaces of a PDF: DeviceCMYK, or DeviceN with every spot ink as a plate of its own.

PDF 1.7, 8.6.6 (ISO 32000-1). A viewer without the plates shows a spot ink as its colorant's CMYK recipe; amounts of
inks that meet (they never do in a pattern) add up to at most 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import pikepdf
from pikepdf import Array, Dictionary, Name

from paxel_design.printing.plates import PROCESS_INKS, Plates
from paxel_runtime.model.pattern import Colorant

__all__ = ["indexed_space", "plate_space", "separation_spaces", "tint_program"]


def plate_space(pdf: pikepdf.Pdf, plates: Plates, separations: dict[str, pikepdf.Object]) -> pikepdf.Object:
    """The colour space whose components are the plates, as an object of `pdf`.

    Parameters
    ----------
    separations : dict
        From `separation_spaces`: every spot ink means the same wherever it is used.
    """
    if not plates.spots:
        return Name.DeviceCMYK
    transform = pikepdf.Stream(
        pdf,
        tint_program(plates).encode("ascii"),
        FunctionType=4,
        Domain=Array([0, 1] * len(plates.names)),
        Range=Array([0, 1] * len(PROCESS_INKS)),
    )
    attributes = Dictionary(Subtype=Name.DeviceN, Colorants=Dictionary())
    for name, space in separations.items():
        attributes.Colorants[f"/{name}"] = space
    if any(name in PROCESS_INKS for name in plates.names):
        components = Array([Name(f"/{ink}") for ink in PROCESS_INKS])
        attributes.Process = Dictionary(ColorSpace=Name.DeviceCMYK, Components=components)
    names = Array([Name(f"/{name}") for name in plates.names])
    return pdf.make_indirect(Array([Name.DeviceN, names, Name.DeviceCMYK, transform, attributes]))


def separation_spaces(pdf: pikepdf.Pdf, plates: Plates) -> dict[str, pikepdf.Object]:
    """A Separation colour space for the plate of every spot ink, by its name."""
    return {colorant.spot: pdf.make_indirect(_separation(colorant)) for colorant in plates.spots}


def indexed_space(base: pikepdf.Object, palette: Sequence[Sequence[float]]) -> Array:
    """A palette over a colour space: amounts of ink, 0..1, in 8 bits."""
    table = bytes(round(255 * amount) for amounts in palette for amount in amounts)
    return Array([Name.Indexed, base, len(palette) - 1, pikepdf.String(table)])


def tint_program(plates: Plates) -> str:
    """The amounts on all plates -> CMYK as a PostScript calculator function (type 4).

    Each output is min(1, sum of amount x recipe): while the j-th is computed, input i of n lies n - 1 - i + j deep
    below the sum, which lies on top.
    """
    recipes = [_recipe(plates, name) for name in plates.names]
    n = len(recipes)
    steps = []
    for j in range(len(PROCESS_INKS)):
        steps.append("0")
        for i, recipe in enumerate(recipes):
            if recipe[j] > 0:
                steps.append(f"{n - i + j} index {recipe[j]:g} mul add")
        steps.append("dup 1 gt {pop 1} if")
    steps.append(f"{n + len(PROCESS_INKS)} {len(PROCESS_INKS)} roll" + " pop" * n)
    return "{" + " ".join(steps) + "}"


def _recipe(plates: Plates, name: str) -> tuple[float, ...]:
    if name in PROCESS_INKS:
        return tuple(float(ink == name) for ink in PROCESS_INKS)
    return next(tuple(colorant.cmyk) for colorant in plates.spots if colorant.spot == name)


def _separation(colorant: Colorant) -> Array:
    tint = Dictionary(FunctionType=2, Domain=[0, 1], C0=[0, 0, 0, 0], C1=[float(v) for v in colorant.cmyk], N=1)
    return Array([Name.Separation, Name(f"/{colorant.spot}"), Name.DeviceCMYK, tint])
