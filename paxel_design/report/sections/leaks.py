"""The part of the pictures section on what is hidden: what is left of it for whom, against what the eye just sees."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from paxel_design.report.content import Block, Bullets, Heading, Paragraph, Quantity, Verdict
from paxel_design.report.hidden import hidden_picture
from paxel_design.report.rules import judged
from paxel_design.report.sections.gamut_texts import surface_words
from paxel_design.report.sections.parts import NO_PART, Part
from paxel_design.report.sections.seen import Seen, hiding_surfaces
from paxel_design.report.source import ReportSource, recorded
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.stages.projected import Projected, other_surface

__all__ = ["leaks"]

_WITHOUT = {True: "what leaks without the pattern, or without the sheet", False: "what is left without the print"}
"""By whether there are two surfaces."""


def leaks(source: ReportSource, key: str, projected: Projected, seen: Mapping[str, Seen]) -> Part:
    """What each surface gives away of the other's picture, and what the projection image does.

    Parameters
    ----------
    source : ReportSource
    key : str
        Of the projection, in the names of quantities.
    projected : Projected
    seen : mapping of surface to Seen
        Empty where it was not looked at.
    """
    words = surface_words(source)
    quantities: dict[str, Quantity] = {}
    verdicts: list[Verdict] = []
    items: list[str] = []
    for surface in hiding_surfaces(projected):
        own = f"pictures.{key}.on-{surface}"
        text = (
            f"Whoever looks at the {words[surface]} alone should not see the picture of the "
            f"{words[other_surface(surface)]}."
        )
        if surface in seen:
            quantities |= _hidden(source, own, surface, projected, seen[surface])
            where = f"the {words[surface]} ({projected.name})"
            verdicts.append(judged("hidden-seen", f"{own}.hidden_seen", quantities, of=where))
            text += (
                f" What is left of it has {{{own}.hidden_seen}} times the contrast that is just seen on a plain "
                f"surface (where it is shown: {{{own}.hidden_shown}} times), an rms of {{{own}.hidden_rms}} % of the "
                f"light: {_plainly(float(str(quantities[f'{own}.hidden_seen'].value)))}."
            )
        record = f"preview/{projected.name}.json#/on_{surface}"
        ghost = recorded(source, f"{record}/ghosting_percent", "%")
        fine = recorded(source, f"{record}/ghosting_fine_percent", "%")
        if ghost is not None and fine is not None:
            quantities |= {f"{own}.ghosting": ghost, f"{own}.ghosting_fine": fine}
            text += f" Ghosting: {{{own}.ghosting}} % of its contrast, {{{own}.ghosting_fine}} % of its details."
        items.append(text)
    items += _of_the_file(source, key, projected, quantities, words)
    if not items:
        return NO_PART
    blocks: list[Block] = [
        Heading(f"{projected.name}: {_WITHOUT[source.model.white is not None]}"),
        Bullets(tuple(items)),
    ]
    if verdicts:
        note = (
            "Just seen: by half of the observers, after Barten's contrast sensitivity at the set distance and "
            "luminance. A second picture on the same surface hides more than a plain one; the figure does not count on "
            "that."
        )
        blocks.append(Paragraph(note, small=True))
    return Part(blocks, quantities, tuple(verdicts))


def _hidden(source: ReportSource, own: str, surface: str, projected: Projected, seen: Seen) -> dict[str, Quantity]:
    installation = source.installation
    assert installation is not None
    s = installation.settings
    found = hidden_picture(
        seen.Y,
        _luminance(projected.mapped[surface]),
        _luminance(projected.mapped[other_surface(surface)]),
        seen.inner,
        s.projector.width_mm / s.projector.resolution[0],
        s.viewing.distance_mm,
        s.viewing.luminance_cd_m2,
    )
    how = "computed for the report from the view on the virtual bench"
    return {
        f"{own}.hidden_seen": Quantity(found.seen, "thresholds", how, 2),
        f"{own}.hidden_shown": Quantity(found.shown, "thresholds", f"{how}, of the picture itself", 2),
        f"{own}.hidden_rms": Quantity(found.rms_percent, "%", how, 2),
    }


def _plainly(thresholds: float) -> str:
    if thresholds < 1:
        return "below what is seen"
    return "at the edge of what is seen" if thresholds < 3 else "it can be made out"


def _of_the_file(
    source: ReportSource, key: str, projected: Projected, quantities: dict[str, Quantity], words: Mapping[str, str]
) -> list[str]:
    """What the projection image tells to somebody who has only the file, such as on a screen."""
    parts = []
    for surface in projected.mapped:
        own = f"pictures.{key}.on-{surface}.file"
        pointer = f"preview/{projected.name}.json#/projection_image/on_{surface}"
        found = {name: recorded(source, f"{pointer}/{name}", "correlation", 2) for name in ("blurred", "texture")}
        if any(value is None for value in found.values()):
            continue
        quantities |= {f"{own}.{name}": value for name, value in found.items() if value is not None}
        parts.append(
            f"that of the {words[surface]} with correlation {{{own}.blurred}} in the blurred image and "
            f"{{{own}.texture}} in the strength of its dots"
        )
    if not parts:
        return []
    return [
        f"Whoever has only the projection image, as a file on a screen, finds in it the picture: {'; '.join(parts)} "
        "(0 nothing, 1 the picture itself). Do not hand it out where a picture shall stay a surprise."
    ]


def _luminance(Lab: NDArray[np.float32]) -> NDArray[np.floating]:
    """Y = 1 for white, of L* alone."""
    gray = np.zeros_like(Lab)
    gray[..., 0] = Lab[..., 0]
    return Lab_to_XYZ(gray, np.ones(3))[..., 1]
