"""What a report is made from: an installation with its records, or a model.json alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation
    from paxel_runtime.model.prediction import PredictionModel

__all__ = ["ReportSource"]


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
    """

    model: PredictionModel
    model_path: Path
    bench: str = ""
    installation: Installation | None = None
    records: Mapping[str, dict[str, Any]] = field(default_factory=dict)
