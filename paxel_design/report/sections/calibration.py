"""How good the calibration is: prediction beside the paper's, registration, clusters, response, honesty, stability.

A chapter of parts; each part is a list of blocks, its quantities and its verdicts, and is left out where nothing of it
was recorded. Accuracy stands in `prediction`, the model itself in `model_facts`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from paxel_design.report.charts.calibration import cluster_chart, cluster_shades, residual_chart, response_chart
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
from paxel_design.report.rules import judged, judged_honesty
from paxel_design.report.sections.model_facts import model_facts
from paxel_design.report.sections.parts import NO_PART, Part, on_the_bench
from paxel_design.report.sections.prediction import prediction
from paxel_design.report.source import ReportSource, found, quantities_at, recorded
from paxel_runtime.registration.residuals import BLOCK_PX
from paxel_runtime.storage import read_image, read_npz

__all__ = ["section"]

_RECORD = "calibration/calibration.json"
_LARGEST_PICTURE_PX = 1400


def section(source: ReportSource) -> Section:
    """The chapter; of a model.json alone, the response curves and what the model says of itself."""
    parts = [prediction(source), _registration(source), _clusters(source), _response(source), model_facts(source),
             _honesty(source), _stability(source), _warnings(source)]  # fmt: skip
    quantities = {name: quantity for part in parts for name, quantity in part.quantities.items()}
    verdicts = tuple(verdict for part in parts for verdict in part.verdicts)
    blocks = [block for part in parts for block in part.blocks]
    if source.installation is None:
        introduction = (
            "A model.json tells how light adds up. How it was measured, and how well it predicts, stands in the "
            "installation it came from."
        )
        return Section("calibration", "Calibration quality", (Paragraph(introduction), *blocks), quantities, verdicts)
    introduction = (
        "Calibration finds where each projector pixel falls, which ink it lights, and which colour every input makes "
        "on each surface. All that follows rests on it."
    )
    first: tuple[Block, ...] = (Paragraph(introduction),)
    if verdicts:
        caption = f"The calibration at a glance{on_the_bench(source)}."
        first += (Verdicts("calibration-verdicts", caption, verdicts),)
    return Section("calibration", "Calibration quality", (*first, *blocks), quantities, verdicts)


_REGISTRATION = {
    "residual_rms_px": "camera pixels",
    "residual_p95_px": "camera pixels",
    "residual_max_px": "camera pixels",
    "coverage": "share",
    "outliers": "share",
    "plane_rms_px": "camera pixels",
}


def _registration(source: ReportSource) -> Part:
    """Where the camera sees each projector pixel."""
    channels = list(found(source, f"{_RECORD}#/registration") or ())
    if not channels:
        return NO_PART
    rows = {
        f"calibration.registration.{channel}.{key}": (f"{_RECORD}#/registration/{channel}/{key}", unit)
        for channel in channels
        for key, unit in _REGISTRATION.items()
    }
    aberration = f"{_RECORD}#/registration_report/chromatic_aberration"
    rows |= {
        f"calibration.aberration.{channel}.{key}": (f"{aberration}/{channel}/{key}", "camera pixels")
        for channel in found(source, aberration) or ()
        for key in ("rms_px", "max_px")
    }
    quantities = quantities_at(source, rows)
    verdicts = [
        _worst_of("registration", [f"calibration.registration.{c}.residual_rms_px" for c in channels], quantities),
        _worst_of("coverage", [f"calibration.registration.{c}.coverage" for c in channels], quantities, least=True),
    ]
    blocks: list[Block] = [
        Heading("Registration"),
        Paragraph(
            "Structured light tells each camera pixel which projector pixel it sees; one smooth table for each channel "
            "goes through all of these points. The scatter of single points is noise and ink; the table itself is "
            "finer by the root of their number. A shift of a tenth of a projector pixel is not seen, of half a pixel "
            "it ghosts plainly."
        ),
        _table_of_channels(channels, quantities, on_the_bench(source)),
    ]
    if shifts := [name for name in quantities if name.startswith("calibration.aberration.")]:
        moved = dict.fromkeys(name.split(".")[2] for name in shifts)
        told = ", ".join(
            f"{c} {{calibration.aberration.{c}.rms_px}} rms and {{calibration.aberration.{c}.max_px}} at most"
            for c in moved
        )
        blocks.append(Paragraph(f"Light of the other channels falls beside the guide's, camera pixels: {told}."))
    blocks += _residual_maps(source, channels)
    return Part(blocks, quantities, tuple(v for v in verdicts if v is not None))


def _table_of_channels(channels: list[str], quantities: dict[str, Quantity], bench: str) -> Table:
    columns = {
        "residual_rms_px": "scatter rms, px",
        "residual_p95_px": "95 %, px",
        "residual_max_px": "largest, px",
        "coverage": "covered, %",
        "outliers": "outliers, %",
        "plane_rms_px": "off a flat wall, px",
    }
    rows = tuple(
        (channel, *(_cell(f"calibration.registration.{channel}.{key}", quantities) for key in columns))
        for channel in channels
    )
    caption = f"Points against the lookup table, camera pixels, by channel{bench}."
    return Table("calibration-registration-table", caption, ("channel", *columns.values()), rows)


def _residual_maps(source: ReportSource, channels: list[str]) -> list[Block]:
    """Drawn from the maps where the captures kept them; captures of older versions have a picture."""
    assert source.installation is not None
    captures, bench = source.installation.folder("captures"), on_the_bench(source)
    tables = read_npz(captures / "registration.npz")
    maps = {c: tables[f"residual_rms_px_{c}"] for c in channels if f"residual_rms_px_{c}" in tables}
    if maps and any(values.size > 1 for values in maps.values()):
        caption = (
            f"Residuals over the projection{bench}. Even is good; a dark corner or stripe is blur, stray light, or "
            "something that moved."
        )
        return [Chart("calibration-residual-maps", caption, residual_chart(maps, BLOCK_PX))]
    if not (captures / "registration.png").is_file():
        return []
    picture = Picture(read_image(captures / "registration.png")[..., :3], "residuals and coverage by channel")
    return [Pictures("calibration-residual-maps", f"Residuals over the projection{bench}.", (picture,))]


def _clusters(source: ReportSource) -> Part:
    """Which ink each projector pixel lights."""
    if source.installation is None:
        return NO_PART
    names, K = source.model.clusters, len(source.model.clusters)
    record = found(source, f"{_RECORD}#/clusters/{K}")
    if not record:
        return NO_PART
    at = f"{_RECORD}#/clusters/{K}"
    colorants = tuple(source.records["print/pattern.json"]["colorants"])
    rows = {f"calibration.clusters.{name}.share": (f"{at}/shares/{k}", "share") for k, name in enumerate(names)}
    rows |= {
        f"calibration.clusters.{name}.of.{ink}": (f"{at}/purity/{name}/{ink}", "share")
        for name in names
        for ink in colorants
    }
    rows["calibration.clusters.reason"] = (f"{at}/reason", "")
    rows["calibration.clusters.suggested"] = (f"{at}/suggested_count", "clusters")
    quantities = quantities_at(source, rows)
    quantities["calibration.clusters.count"] = Quantity(K, "clusters", "clusters named in calibration/model.json")
    own = [f"calibration.clusters.{ink}.of.{ink}" for ink in colorants]
    verdict = _worst_of("purity", [name for name in own if name in quantities], quantities, least=True)
    folder, bench = source.installation.folder("calibration"), on_the_bench(source)
    labels = read_image(folder / "clusters.png")
    one_plane = labels if labels.ndim == 2 else labels[..., 0]
    shades = cluster_shades(record["centres_Lab"])
    table = np.full((256, 3), 255, np.uint8)
    table[:K] = shades
    blocks: list[Block] = [
        Heading("Clusters"),
        Paragraph(
            "Projector pixels are sorted into {calibration.clusters.count} clusters by the ink they light. The purer a "
            "cluster, the more colour it commands; an edge cluster (named with a +) keeps pixels that light two inks "
            "out of the others. Suggested for this print under this projector: {calibration.clusters.suggested} "
            "({calibration.clusters.reason})."
        ),
        Chart(
            "calibration-cluster-chart",
            f"Clusters and the ink their light meets{bench}.",
            cluster_chart(one_plane, names, colorants, record["purity"], record["shares"], shades),
        ),
        Table(
            "calibration-purity",
            f"Of each cluster's light, the share that meets each ink, %{bench}.",
            ("cluster", "of the pixels, %", *colorants),
            tuple(
                (
                    name,
                    f"{{calibration.clusters.{name}.share}}",
                    *(_cell(f"calibration.clusters.{name}.of.{ink}", quantities) for ink in colorants),
                )
                for name in names
            ),
        ),
    ]
    pictures = [Picture(table[_shrunk(one_plane)], "cluster map, the whole projection")]
    if (folder / "nodal.png").is_file():
        pictures.append(Picture(_shrunk(read_image(folder / "nodal.png")[..., :3]), "what each pixel lights"))
    blocks.append(
        Pictures(
            "calibration-maps",
            f"The cluster map, and the nodal image it is made from{bench}. In the map white lies outside; the other "
            "shades are those of the chart.",
            tuple(pictures),
        )
    )
    return Part(blocks, quantities, (verdict,) if verdict else ())


def _response(source: ReportSource) -> Part:
    chart = response_chart(source.model.response, source.model.channels)
    caption = (
        f"Response curves, as measured{on_the_bench(source)}. A smooth curve that rises from the first codes on is "
        "what counts, not its exponent."
    )
    return Part([Heading("Response curves"), Chart("calibration-response-chart", caption, chart)])


def _honesty(source: ReportSource) -> Part:
    """Whether the projector shows what it is sent."""
    findings: list[Any] = found(source, f"{_RECORD}#/honesty/findings") or []
    if not findings:
        return NO_PART
    rows = {"calibration.honesty": (f"{_RECORD}#/honesty/word", "")}
    for k, finding in enumerate(findings):
        name = "calibration.honesty." + finding["question"].replace(" ", "-")
        rows[name] = (f"{_RECORD}#/honesty/findings/{k}/word", "")
        rows[f"{name}.verdict"] = (f"{_RECORD}#/honesty/findings/{k}/verdict", "")
    quantities = quantities_at(source, rows)
    named = [(f["question"], "calibration.honesty." + f["question"].replace(" ", "-")) for f in findings]
    blocks: list[Block] = [
        Heading("Honesty of the projector"),
        Paragraph(
            "The model takes channels and pixels for independent lights. Image improvements of a projector break that; "
            "a few readings tell which, and what to switch off."
        ),
        Table(
            "calibration-honesty",
            f"What the projector was asked, and its answers{on_the_bench(source)}.",
            ("question", "it is", "found"),
            tuple((question, f"{{{name}}}", f"{{{name}.verdict}}") for question, name in named),
            words=True,
        ),
    ]
    return Part(blocks, quantities, (judged_honesty("calibration.honesty", quantities),))


def _stability(source: ReportSource) -> Part:
    """Drift over the session, and how even the field is."""
    surfaces = list(found(source, f"{_RECORD}#/drift") or ())
    keys = {"checks": "", "range_percent": "%", "rms_percent": "%", "corrected": ""}
    rows = {
        f"calibration.drift.{s}.{key}": (f"{_RECORD}#/drift/{s}/{key}", unit)
        for s in surfaces
        for key, unit in keys.items()
    }
    field: dict[str, Any] = found(source, f"{_RECORD}#/field_ratios") or {}
    rows |= {
        f"calibration.field.{cluster}.{channel}": (f"{_RECORD}#/field_ratios/{cluster}/{channel}", "")
        for cluster, by_channel in field.items()
        for channel in by_channel
    }
    quantities = quantities_at(source, rows)
    blocks: list[Block] = []
    bench = on_the_bench(source)
    if surfaces:
        header = ("surface", "frames read again", "range, %", "rms, %", "drift taken out")
        cells = tuple((s, *(_cell(f"calibration.drift.{s}.{key}", quantities) for key in keys)) for s in surfaces)
        blocks += [Heading("Stability"), Table("calibration-drift", f"The same frame over the session{bench}.", header,
                                               cells)]  # fmt: skip
    if field:
        channels = list(next(iter(field.values())))
        what = "each cluster's part of the light" if source.model.white is None else "what the pattern returns of it"
        caption = (
            f"Evenness of each cluster's light, {what}: as 5 %, 50 % and 95 % of the field have it{bench}. Where these "
            "lie far apart, one spot of the meter does not speak for the whole field."
        )
        cells = tuple(
            (cluster, *(_cell(f"calibration.field.{cluster}.{channel}", quantities) for channel in channels))
            for cluster in field
        )
        blocks.append(Table("calibration-field", caption, ("cluster", *channels), cells))
    return Part(blocks, quantities)


def _warnings(source: ReportSource) -> Part:
    warnings: list[str] = found(source, f"{_RECORD}#/warnings") or []
    if not warnings:
        return NO_PART
    taken = {f"calibration.warning.{k}": recorded(source, f"{_RECORD}#/warnings/{k}") for k in range(len(warnings))}
    quantities = {name: quantity for name, quantity in taken.items() if quantity is not None}
    return Part([Heading("Warnings"), Bullets(tuple(f"{{{name}}}" for name in quantities))], quantities)


def _worst_of(rule: str, names: list[str], quantities: dict[str, Quantity], *, least: bool = False) -> Verdict | None:
    """The verdict on the worst of several figures: the largest, or the least."""
    there = [name for name in names if name in quantities]
    if not there:
        return None
    worst = (min if least else max)(there, key=lambda name: float(np.real(quantities[name].value)))
    of = worst.split(".")[2] if len(there) > 1 else ""
    return judged(rule, worst, quantities, of=f"({of})" if of else "")


def _cell(name: str, quantities: dict[str, Quantity]) -> str:
    return f"{{{name}}}" if name in quantities else "-"


def _shrunk(picture: Any) -> Any:
    """A picture of at most `_LARGEST_PICTURE_PX` columns: every k-th pixel of a larger one."""
    step = -(-picture.shape[1] // _LARGEST_PICTURE_PX)
    return np.ascontiguousarray(picture[::step, ::step])
