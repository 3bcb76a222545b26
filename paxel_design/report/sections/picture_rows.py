"""The pictures of one projection: the projection image; of each surface what was wanted, fitted, lost and is seen."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from paxel_design.report.charts.maps import MOST_GHOST_L, ghost_picture, moved_map
from paxel_design.report.content import Block, Paragraph, Picture, Pictures, Quantity
from paxel_design.report.sections.gamut_texts import surface_words
from paxel_design.report.sections.parts import Part, on_the_bench
from paxel_design.report.sections.seen import Seen, hiding_surfaces
from paxel_design.report.sections.shrunk import Lab_picture, block_means, codes_picture, middle, shrunk
from paxel_design.report.source import ReportSource, recorded
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.observer import EXPOSURES, Viewer
from paxel_runtime.observer.ghosting import GHOST_CYCLES_PER_DEGREE
from paxel_runtime.observer.smoothing import high_passed
from paxel_runtime.stages.projected import Projected
from paxel_runtime.storage import read_image

__all__ = ["picture_rows"]

_JUST_TOLD_DE00 = 1.0
_ONE_COLOUR, _MOST_OF_IT = 0.05, (2, 98)
"""Range of L*, a* and b* below which a picture is one colour, between these percentiles: some pixels may be moved."""


def picture_rows(source: ReportSource, key: str, projected: Projected, seen: Mapping[str, Seen]) -> Part:
    """Rows of pictures, and the figures under them.

    Parameters
    ----------
    source : ReportSource
    key : str
        Of the projection, in the names of quantities and anchors.
    projected : Projected
    seen : mapping of surface to Seen
    """
    words, bench = surface_words(source), on_the_bench(source)
    quantities: dict[str, Quantity] = {}
    frame = codes_picture(projected.codes, projected.bits)
    whole, detail = (
        Picture(shrunk(frame), "the projection image"),
        Picture(middle(frame), "its middle, pixels enlarged", pixelated=True),
    )
    blocks: list[Block] = [
        Pictures(
            f"pictures-{key}-frame", f"{projected.name}: what the projector shows, as on a screen.", (whole, detail)
        )
    ]
    for surface in projected.model.surfaces:
        looks = _looks(source, key, projected, surface, quantities)
        row = _fitting(key, projected, surface, quantities, always=not looks) + looks
        if surface in seen:
            row += (_ghost(source, key, projected, surface, seen[surface], quantities),)
        meant = "" if surface in projected.sources else f"; {_meant(projected, surface)}"
        caption = f"{projected.name} on the {words[surface]}{meant}{bench}."
        if row:
            blocks.append(Pictures(f"pictures-{key}-on-{surface}", caption, row))
    if f"preview/{projected.name}.json" not in source.records:
        blocks.append(Paragraph("It was not looked at yet: paxel preview DIR makes the views and their figures."))
    elif source.bench and hiding_surfaces(projected) and not seen:
        blocks.append(
            Paragraph(
                "Maps of ghosts are left out here: looking at so many large projections once more would take minutes.",
                small=True,
            )
        )
    return Part(blocks, quantities)


def _meant(projected: Projected, surface: str) -> str:
    """What a surface without a picture of its own is to show."""
    if surface not in projected.mapped:
        return "left free"
    return "meant: one colour all over" if _is_uniform(projected, surface) else "meant: what the effect asks for"


def _is_uniform(projected: Projected, surface: str) -> bool:
    low, high = np.percentile(projected.mapped[surface][projected.inside], _MOST_OF_IT, axis=0)
    return float((high - low).max()) < _ONE_COLOUR


def _fitting(
    key: str, projected: Projected, surface: str, quantities: dict[str, Quantity], *, always: bool
) -> tuple[Picture, ...]:
    """The picture wanted, the same in colours that can be shown, and what lay outside of those.

    Lightness is fitted as a whole; what is out of gamut then moves towards gray. The map shows the second alone, as
    dE00 between the fitted colour and the wanted one at the fitted lightness.
    """
    if surface not in projected.mapped:
        return ()
    fitted = block_means(projected.mapped[surface])
    if surface not in projected.sources:
        needed = always or not _is_uniform(projected, surface)
        return (Picture(Lab_picture(fitted), "meant to be seen"),) if needed else ()
    wanted = block_means(projected.sources[surface])
    relit = np.concatenate((fitted[..., :1], wanted[..., 1:]), axis=-1)
    moved = dE00(relit, fitted)
    counted = block_means(projected.mask(surface).astype(np.float32)) > 0.5
    own = f"pictures.{key}.on-{surface}"
    how = "computed for the report from the wanted and the fitted picture, at the fitted lightness"
    quantities |= {
        f"{own}.moved": Quantity(100 * float(np.mean(moved[counted] > _JUST_TOLD_DE00)), "%", how),
        f"{own}.moved_mean": Quantity(float(np.mean(moved[counted])), "dE00", how),
        f"{own}.moved_p95": Quantity(float(np.quantile(moved[counted], 0.95)), "dE00", how),
    }
    note = (
        f"{{{own}.moved}} % of the pixels moved by more than 1 dE00; mean {{{own}.moved_mean}}, 95 % "
        f"{{{own}.moved_p95}} dE00"
    )
    return (
        Picture(Lab_picture(wanted), "wanted"),
        Picture(Lab_picture(fitted), "fitted"),
        Picture(shrunk(moved_map(moved)), "out of gamut", note),
    )


def _looks(
    source: ReportSource, key: str, projected: Projected, surface: str, quantities: dict[str, Quantity]
) -> tuple[Picture, ...]:
    """The views of the preview, at both exposures."""
    record = f"preview/{projected.name}.json"
    if record not in source.records:
        return ()
    assert source.installation is not None
    folder = source.installation.folder("preview")
    labels = {"fixed": "seen, at true brightness", "auto": "seen, as the eye adapts"}
    own = f"pictures.{key}.on-{surface}"
    found = {name: recorded(source, f"{record}#/on_{surface}/{name}", "dE00") for name in ("dE00_mean", "dE00_p95")}
    quantities |= {f"{own}.{name}": value for name, value in found.items() if value is not None}
    note = f"mean {{{own}.dE00_mean}}, 95 % {{{own}.dE00_p95}} dE00 off the fitted" if all(found.values()) else ""
    pictures: list[Picture] = []
    for exposure, suffix in EXPOSURES.items():
        path = folder / f"{projected.name}.on-{surface}{suffix}.png"
        if path.is_file():
            pictures.append(Picture(shrunk(read_image(path)), labels[exposure], "" if pictures else note))
    return tuple(pictures)


def _ghost(
    source: ReportSource, key: str, projected: Projected, surface: str, seen: Seen, quantities: dict[str, Quantity]
) -> Picture:
    """What the view has more than its own picture, above one cycle per degree: there the other picture would show."""
    assert source.installation is not None
    s = source.installation.settings
    viewer = Viewer(s.viewing.distance_mm, s.projector.width_mm / s.projector.resolution[0])
    rest = seen.Lab[..., 0] - seen.Lab_target[..., 0]
    rest = high_passed(rest, seen.inner, viewer.px_per_degree, GHOST_CYCLES_PER_DEGREE)
    own = f"pictures.{key}.on-{surface}"
    how = "computed for the report from the view on the virtual bench, above 1 cycle per degree"
    quantities[f"{own}.rest_rms"] = Quantity(float(np.sqrt(np.mean(rest[seen.inner] ** 2))), "L*", how)
    ghost = recorded(source, f"preview/{projected.name}.json#/on_{surface}/ghosting_percent", "%")
    note = f"rms {{{own}.rest_rms}} L*, scale to {MOST_GHOST_L:g} L*"
    if ghost is not None:
        quantities[f"{own}.ghosting"] = ghost
        note += f"; ghosting {{{own}.ghosting}} %"
    picture = ghost_picture(block_means(np.where(seen.inner, rest, 0.0)))
    return Picture(shrunk(picture), "what is left of the other picture", note)
