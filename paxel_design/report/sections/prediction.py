"""How well colours are predicted, beside what the paper measured on hardware."""

from __future__ import annotations

from paxel_design.report.charts.calibration import ErrorRow, accuracy_chart
from paxel_design.report.content import Block, Chart, Heading, Paragraph, Quantity, Table, filled
from paxel_design.report.rules import judged
from paxel_design.report.sections.parts import NO_PART, Part, on_the_bench
from paxel_design.report.source import ReportSource, found, quantities_at

__all__ = ["PAPER_TABLE_I", "PAPER_TABLE_II", "prediction"]

PAPER_TABLE_I = {"pattern": (1.9, 3.0, 5.9), "white": (2.36, 3.8, 8.5)}
"""dE00 mean, 95 % and largest on 100 random projections: black and white, 30 degrees, K = 2, hardware (Table I)."""
PAPER_TABLE_II = {"pattern": (2.56, 4.5, 5.6)}
"""The same of one ultraviolet channel on fluorescent red, green and blue, K = 3, 125 projections (Table II)."""

_FILE = "calibration/accuracy.json"
_KEYS = ("dE00_mean", "dE00_p95", "dE00_max")
_SURFACES = {"pattern": "on the pattern", "white": "on the white surface"}


def prediction(source: ReportSource) -> Part:
    """Errors of the model, of what it would be without its correction and with other K, and the paper's."""
    if found(source, f"{_FILE}#/pattern") is None:
        return NO_PART
    surfaces = [surface for surface in _SURFACES if found(source, f"{_FILE}#/{surface}") is not None]
    K, bench = len(source.model.clusters), on_the_bench(source)
    paths = {"this installation, K = {calibration.prediction.K}": ("calibration.prediction", "")}
    if found(source, f"{_FILE}#/model") == "corrected":
        paths["the same without its correction"] = ("calibration.prediction.linear", "linear/")
    quantities = quantities_at(source, {"calibration.prediction.n": (f"{_FILE}#/n", "projections")})
    quantities["calibration.prediction.K"] = Quantity(K, "clusters", "clusters named in calibration/model.json")
    for count in found(source, f"{_FILE}#/other_K") or ():
        name = f"calibration.prediction.K{count}"
        quantities[name] = Quantity(int(count), "clusters", f"a key of {_FILE}#/other_K")
        paths[f"linear model, K = {{{name}}}"] = (name, f"other_K/{count}/")
    for name, path in paths.values():
        quantities |= quantities_at(
            source,
            {
                f"{name}.{surface}.{key}": (f"{_FILE}#/{path}{surface}/{key}", "dE00")
                for surface in surfaces
                for key in _KEYS
            },
        )
    quantities |= _further(source, surfaces)
    verdicts = tuple(
        judged("prediction", f"calibration.prediction.{surface}.dE00_mean", quantities, of=_SURFACES[surface])
        for surface in surfaces
    )
    table_number, paper = ("II", PAPER_TABLE_II) if len(source.model.channels) == 1 else ("I", PAPER_TABLE_I)
    paper_label = f"the paper, Table {table_number} (hardware, K = {3 if table_number == 'II' else 2})"
    blocks: list[Block] = [
        Heading("Prediction of colours"),
        Paragraph(
            "{calibration.prediction.n} test projections that the model had not seen were shown and read; the error is "
            "the CIEDE2000 difference (dE00) between the predicted and the measured colour. About 1 is just told side "
            "by side."
        ),
        _table(paths, surfaces, paper, paper_label, bench),
        Chart(
            "calibration-errors",
            f"Prediction errors: bar mean, whisker 95 %, diamond largest; hatched the paper's, on hardware{bench}.",
            accuracy_chart(_rows(paths, surfaces, paper, quantities, table_number), surfaces),
        ),
        *_about(quantities, surfaces, bench),
    ]
    return Part(blocks, quantities, verdicts)


def _table(
    paths: dict[str, tuple[str, str]],
    surfaces: list[str],
    paper: dict[str, tuple[float, float, float]],
    paper_label: str,
    bench: str,
) -> Table:
    header = ("dE00", *(f"{surface}: {word}" for surface in surfaces for word in ("mean", "95 %", "largest")))
    rows = [
        (label, *(f"{{{name}.{surface}.{key}}}" for surface in surfaces for key in _KEYS))
        for label, (name, _) in paths.items()
    ]
    theirs = [f"{value:g}" for surface in surfaces for value in paper.get(surface, (float("nan"),) * 3)]
    rows.append((paper_label, *("-" if value == "nan" else value for value in theirs)))
    caption = f"Prediction errors beside the paper's. The paper's are of its own projector and print{bench}."
    return Table("calibration-prediction-table", caption, header, tuple(rows))


def _rows(
    paths: dict[str, tuple[str, str]],
    surfaces: list[str],
    paper: dict[str, tuple[float, float, float]],
    quantities: dict[str, Quantity],
    table_number: str,
) -> list[ErrorRow]:
    def errors(name: str, surface: str) -> tuple[float, float, float]:
        mean, p95, largest = (float(quantities[f"{name}.{surface}.{key}"].value) for key in _KEYS)  # type: ignore[arg-type]
        return mean, p95, largest

    rows = [
        ErrorRow(filled(label, quantities), {surface: errors(name, surface) for surface in surfaces})
        for label, (name, _) in paths.items()
    ]
    return [*rows, ErrorRow(f"the paper, Table {table_number}", paper, hatched=True)]


def _further(source: ReportSource, surfaces: list[str]) -> dict[str, Quantity]:
    """Noise floor, a second metric, where errors lie, and what the extra readings gave."""
    rows = {"calibration.extra.readings": (f"{_FILE}#/extra_readings/readings", "readings")}
    for surface in surfaces:
        rows[f"calibration.noise.{surface}"] = (f"{_FILE}#/noise_floor/{surface}/dE00_mean", "dE00")
        rows[f"calibration.CAM16.{surface}"] = (f"{_FILE}#/CAM16_UCS/{surface}/dE_mean", "CAM16-UCS")
        for kind in ("per_cluster", "per_channel"):
            for name in found(source, f"{_FILE}#/by_input/{surface}/{kind}") or ():
                pointer = f"{_FILE}#/by_input/{surface}/{kind}/{name}"
                rows[f"calibration.{kind}.{name}.{surface}"] = (pointer, "dE00")
        for step in ("refined_A", "correction"):
            for key in ("dE00_mean_before", "dE00_mean_after"):
                pointer = f"{_FILE}#/extra_readings/{step}/{surface}/{key}"
                rows[f"calibration.extra.{step}.{surface}.{key}"] = (pointer, "dE00")
    for step in ("refined_A", "correction"):
        rows[f"calibration.extra.{step}.used"] = (f"{_FILE}#/extra_readings/{step}/used", "")
        rows[f"calibration.extra.{step}.gain"] = (f"{_FILE}#/extra_readings/{step}/gain_dE00", "dE00")
    return quantities_at(source, rows)


def _about(quantities: dict[str, Quantity], surfaces: list[str], bench: str) -> list[Block]:
    """What the errors consist of."""
    blocks: list[Block] = []
    noise = [s for s in surfaces if f"calibration.noise.{s}" in quantities]
    if noise:
        told = ", ".join(f"{{calibration.noise.{s}}} {_SURFACES[s]}" for s in noise)
        second = ", ".join(f"{{calibration.CAM16.{s}}} {_SURFACES[s]}" for s in surfaces)
        blocks.append(
            Paragraph(
                f"The same frame read again differs by {told}: errors of that size are the meter's and the "
                f"projector's, not the model's. In CAM16-UCS, a second opinion, the mean errors are {second}.",
                small=True,
            )
        )
    header = ("mean dE00 of projections that light mostly", *(_SURFACES[s] for s in surfaces))
    rows = []
    for kind, prefix in (("per_cluster", "cluster"), ("per_channel", "channel")):
        start = f"calibration.{kind}."
        names = dict.fromkeys(n[len(start) :].rpartition(".")[0] for n in quantities if n.startswith(start))
        rows += [(f"{prefix} {name}", *(f"{{{start}{name}.{s}}}" for s in surfaces)) for name in names]
    if rows:
        blocks.append(Table("calibration-by-input", f"Where the errors lie{bench}.", header, tuple(rows)))
    if "calibration.extra.readings" in quantities:
        blocks += _extra(quantities, surfaces, bench)
    return blocks


_STEPS = {
    "refined_A": "the linear model fitted to them too",
    "correction": "a correction beyond the linear model",
}


def _extra(quantities: dict[str, Quantity], surfaces: list[str], bench: str) -> list[Block]:
    header = ("step", "taken", "gain", *(f"{s}: {w}" for s in surfaces for w in ("before", "after")))
    rows = tuple(
        (
            words,
            f"{{calibration.extra.{step}.used}}",
            f"{{calibration.extra.{step}.gain}}",
            *(f"{{calibration.extra.{step}.{s}.dE00_mean_{w}}}" for s in surfaces for w in ("before", "after")),
        )
        for step, words in _STEPS.items()
        if f"calibration.extra.{step}.used" in quantities
        and all(f"calibration.extra.{step}.{s}.dE00_mean_after" in quantities for s in surfaces)
    )
    blocks: list[Block] = [
        Paragraph(
            "{calibration.extra.readings} extra readings teach what the linear model leaves out: cross-talk of the "
            "channels, and neighbouring pixels that touch each other. A step is taken only where readings that it was "
            "not fitted to get better."
        )
    ]
    if rows:
        caption = f"What the extra readings gave, mean dE00 in cross-validation{bench}."
        blocks.append(Table("calibration-extra", caption, header, rows))
    return blocks
