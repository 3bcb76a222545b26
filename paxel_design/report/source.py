"""What a report is made from: an installation with its records, or a model.json alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paxel_design.report.content import Quantity
from paxel_runtime.errors import InstallationError
from paxel_runtime.storage import load_model, read_json

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation
    from paxel_runtime.model.prediction import PredictionModel

__all__ = ["ReportSource", "found", "installation_source", "model_source", "quantities_at", "recorded"]


@dataclass(frozen=True, eq=False)
class ReportSource:
    """What the sections read.

    Attributes
    ----------
    model : PredictionModel
    model_path : Path
        The model.json.
    bench : str
        "virtual bench, realistic" where the figures come from there; empty where they were measured on hardware.
    installation : Installation or None
        None for a model.json alone: then there are no captures, clusters or pictures, and gamuts are computed.
    records : mapping of str to dict
        The JSON records of the installation's stages that are done, by path: ``"calibration/accuracy.json"``. What is
        missing or stale is not in it.
    date : str
        Of what it tells, ``"2026-11-22"``: when the captures were finished, or the model.json was written.
    """

    model: PredictionModel
    model_path: Path
    bench: str = ""
    installation: Installation | None = None
    records: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    date: str = ""


def installation_source(installation: Installation) -> ReportSource:
    """What there is to tell of a calibrated installation.

    Raises
    ------
    InstallationError
        If it is not calibrated, or that is out of date: why, and which command makes it.
    """
    installation.require("calibration")
    folder = installation.folder("calibration")
    records = {f"{path.parent.name}/{path.name}": read_json(path) for path in _fresh_records(installation)}
    finished = str(records.get("captures/complete.json", {}).get("finished", ""))
    virtual = installation.settings.devices.kind == "virtual"
    return ReportSource(
        load_model(folder / "model.json"),
        folder / "model.json",
        str(records["calibration/accuracy.json"]["measured_on"]) if virtual else "",
        installation,
        records,
        finished[:10] or _date_of(folder / "model.json"),
    )


def model_source(path: Path) -> ReportSource:
    """What there is to tell of a model.json alone.

    Raises
    ------
    InputError
        If there is no such file, or it breaks a rule of the format.
    """
    return ReportSource(load_model(path), path, date=_date_of(path))


def found(source: ReportSource, pointer: str) -> Any:
    """What stands at ``"calibration/accuracy.json#/pattern/dE00_mean"``; None where there is no such record or key."""
    file, _, path = pointer.partition("#/")
    value: Any = source.records.get(file)
    for key in path.split("/") if path else ():
        key = key.replace("~1", "/").replace("~0", "~")
        if isinstance(value, Mapping):
            value = value.get(key)
        elif isinstance(value, list) and key.isdigit() and int(key) < len(value):
            value = value[int(key)]
        else:
            return None
    return value


def recorded(
    source: ReportSource, pointer: str, unit: str = "", digits: int = 3, *, percent: bool = False
) -> Quantity | None:
    """The quantity at a pointer, which is its source; None where nothing stands there.

    With `percent` a recorded share 0..1 is told in per cent; the source then ends in ``" x 100"``.
    """
    value = found(source, pointer)
    if value is None or isinstance(value, Mapping):
        return None
    if percent:
        return Quantity(100.0 * value, "%", f"{pointer} x 100", digits)
    return Quantity(tuple(value) if isinstance(value, list) else value, unit, pointer, digits)


def quantities_at(source: ReportSource, pointers: Mapping[str, tuple[str, str]]) -> dict[str, Quantity]:
    """Quantities by full name from ``{name: (pointer, unit)}``; those that are not recorded are left out.

    The unit ``"share"`` tells a recorded share 0..1 in per cent.
    """
    taken = {
        name: recorded(source, pointer, percent=True) if unit == "share" else recorded(source, pointer, unit)
        for name, (pointer, unit) in pointers.items()
    }
    return {name: quantity for name, quantity in taken.items() if quantity is not None}


_STAGES = ("print", "captures", "calibration", "gamut", "projection", "preview")


def _fresh_records(installation: Installation) -> Iterator[Path]:
    """JSON files of every stage that is done; of stages with a record a result, those results that are up to date."""
    for stage in _STAGES[:3]:
        yield from sorted(installation.folder(stage).glob("*.json"))
    fresh: set[str] = set()
    for stage in _STAGES[3:]:
        for path in sorted(installation.folder(stage).glob("*.json")):
            if stage == "preview" and path.stem not in fresh:
                continue  # of a projection that is out of date
            if _is_fresh(installation, stage, path):
                yield path
                if stage == "projection":
                    fresh.add(path.stem)


def _is_fresh(installation: Installation, stage: str, path: Path) -> bool:
    """Whether a record was made from today's settings and files; pictures from outside do not count."""
    try:
        then, now = read_json(path).get("inputs", {}), installation.inputs(stage, stem=path.stem)
    except InstallationError:
        return False
    same_files = all(then.get("files", {}).get(name) == digest for name, digest in now["files"].items())
    return then.get("settings") == now["settings"] and same_files


def _date_of(path: Path) -> str:
    return datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat()
