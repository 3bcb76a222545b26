"""Where the report comes from: dates, devices, settings that are not the default, versions, hashes of what was read."""

from __future__ import annotations

import json
import platform
from importlib.metadata import PackageNotFoundError, version

from paxel_design.report.content import Block, Heading, Paragraph, Quantity, Section, Table
from paxel_design.report.source import ReportSource, quantities_at
from paxel_runtime.settings import Settings
from paxel_runtime.storage import file_sha256
from paxel_runtime.version import WRITER

__all__ = ["LIBRARIES", "section"]

LIBRARIES = (
    "numpy", "scipy", "numba", "scikit-image", "colour-science", "trimesh", "manifold3d", "pyvista", "reportlab",
    "matplotlib", "plotly", "pikepdf", "opencv-python-headless", "pydantic",
)  # fmt: skip
"""Distributions whose versions can change a figure or the look of the report."""

_DIGITS = 16
_VERSION, _SHA256 = "provenance.version.", "provenance.sha256."


def section(source: ReportSource) -> Section:
    """The chapter."""
    quantities = _session(source) | _settings(source) | _versions() | _hashes(source)
    rows = [("report written by", "{provenance.writer}"), ("date of what it tells", "{provenance.date}")]
    rows += [
        (words, f"{{{name}}}")
        for name, words in (
            ("provenance.devices", "devices"),
            ("provenance.resolution", "projector, pixels"),
            ("provenance.pictures", "pictures taken"),
            ("provenance.readings", "readings of the meter"),
            ("provenance.finished", "captures finished"),
            ("provenance.readings_from", "readings from"),
        )
        if name in quantities
    ]
    blocks: list[Block] = [
        Table("provenance-session", "The session.", ("what", "is"), tuple(rows), words=True),
    ]
    settings = [name for name in quantities if name.startswith("provenance.setting.")]
    if settings:
        cells = tuple((name.removeprefix("provenance.setting."), f"{{{name}}}") for name in settings)
        blocks += [
            Heading("Settings"),
            Paragraph("Keys of paxel.toml that are not the default; all others are as paxel new writes them."),
            Table(
                "provenance-settings-table",
                "Settings that differ from the default.",
                ("key", "value"),
                cells,
                words=True,
            ),
        ]
    versions = [(name.removeprefix(_VERSION), f"{{{name}}}") for name in quantities if name.startswith(_VERSION)]
    files = [(quantity.source, f"{{{name}}}") for name, quantity in quantities.items() if name.startswith(_SHA256)]
    read = f"What was read, with the first {_DIGITS} digits of its SHA-256; report.json holds all of them."
    blocks += [
        Heading("Versions and files"),
        Table("provenance-versions", "Versions.", ("library", "version"), tuple(versions), words=True),
        Table("provenance-files", read, ("file", "SHA-256"), tuple(files), words=True),
    ]
    return Section("provenance", "Provenance", tuple(blocks), quantities)


def _session(source: ReportSource) -> dict[str, Quantity]:
    quantities = {
        "provenance.writer": Quantity(WRITER, "", "this program"),
        "provenance.date": Quantity(source.date, "", "captures/complete.json, or the model's file"),
    }
    quantities |= quantities_at(
        source,
        {
            "provenance.pictures": ("captures/complete.json#/pictures", "pictures"),
            "provenance.readings": ("captures/complete.json#/readings", "readings"),
            "provenance.finished": ("captures/complete.json#/finished", ""),
            "provenance.readings_from": ("calibration/calibration.json#/readings_from", ""),
        },
    )
    if source.installation is not None:
        width, height = source.installation.settings.projector.resolution
        quantities["provenance.devices"] = Quantity(
            source.bench or "own devices, " + source.installation.settings.devices.kind, "", "captures/complete.json"
        )
        quantities["provenance.resolution"] = Quantity(
            f"{width} x {height}", "pixels", "paxel.toml: projector.resolution"
        )
    return quantities


def _settings(source: ReportSource) -> dict[str, Quantity]:
    if source.installation is None:
        return {}
    default, own = Settings().values(), source.installation.settings.values()
    return {
        f"provenance.setting.{key}": Quantity(json.dumps(value, ensure_ascii=False), "", f"paxel.toml: {key}")
        for key, value in own.items()
        if value != default[key]
    }


def _versions() -> dict[str, Quantity]:
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return {_VERSION + name: Quantity(text, "", "this program") for name, text in found.items()}


def _hashes(source: ReportSource) -> dict[str, Quantity]:
    """Of every record, of the cluster map, and of the model."""
    if source.installation is None:
        paths = {source.model_path.name: source.model_path}
    else:
        folder = source.installation.path
        paths = {name: folder / name for name in (*source.records, "calibration/clusters.png")}
    return {
        _SHA256 + name.replace("/", "."): Quantity(file_sha256(path)[:_DIGITS], "", name)
        for name, path in paths.items()
        if path.is_file()
    }
