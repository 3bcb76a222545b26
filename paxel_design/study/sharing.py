"""Pictures that two cases have in common: those of one print do not depend on the number of clusters.

Structured light, white and black see the print as a whole. A case takes them over from another one that differs in
its clusters alone, as hard links; it sorts its pixels, takes its readings and fits its model by itself.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from paxel_runtime.captures.acquisition import plan_exposures
from paxel_runtime.installation import Installation
from paxel_runtime.storage import write_json

__all__ = ["take_over"]


def take_over(installation: Installation, other: Installation) -> int:
    """Give a new installation the print and the pictures of another one, as far as they would be the same.

    Parameters
    ----------
    installation : Installation
        Without a print and captures so far. `capture` then goes on as after an interruption.
    other : Installation

    Returns
    -------
    int
        How many pictures were taken over; 0 if the two differ in more than their clusters.
    """
    if not _same_but_clusters(installation, other) or not other.folder("print").is_dir():
        return 0
    if not installation.folder("print").is_dir():
        with installation.writing("print") as folder:
            for file in other.folder("print").iterdir():
                _link(file, folder / file.name)
    pictures, taken = installation.folder("captures"), 0
    if pictures.exists():
        return 0
    pictures.mkdir()
    for exposure in plan_exposures(installation):
        file = other.folder("captures") / f"{exposure.name}.tif"
        if exposure.device == "camera" and not exposure.clusters and file.is_file():
            _link(file, pictures / file.name)
            taken += 1
    inputs = installation.inputs("captures")
    write_json(pictures / "exposures.json", {"inputs": inputs, "device": "virtual", "exposures": []})
    return taken


def _same_but_clusters(one: Installation, other: Installation) -> bool:
    """Whether print, projector, camera and bench are the same."""
    mine, theirs = (
        {key: value for key, value in installation.settings.values().items() if key != "clusters.count"}
        for installation in (one, other)
    )
    return mine == theirs


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # a file system without links
        shutil.copy2(source, target)
