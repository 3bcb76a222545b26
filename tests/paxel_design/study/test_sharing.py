"""Pictures that a case takes over from another one of the same print."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paxel_design.study import Study, cases_of
from paxel_design.study.sharing import take_over
from paxel_runtime.captures.acquisition import plan_exposures
from paxel_runtime.installation import Installation
from paxel_runtime.storage import read_json, write_json, write_tiff


@pytest.fixture
def installations(tmp_path: Path) -> dict[tuple[float, int], Installation]:
    """One of each of two dot sizes and two K, without anything in it."""
    cases = cases_of(Study(dot_sizes_mm=(0.5, 1.0), clusters=(2, 3), overrides={"projector.resolution": [64, 64]}))
    return {
        (case.dot_size_mm, case.clusters): Installation.create(tmp_path / case.name, settings)
        for case, settings in cases.items()
    }


def _photographed(installation: Installation, count: int | None = None) -> None:
    """A print, and the first `count` pictures of the session."""
    with installation.writing("print") as folder:
        write_json(folder / "pattern.json", {"cells": 1})
    installation.folder("captures").mkdir()
    pictures = [e.name for e in plan_exposures(installation) if e.device == "camera"]
    for k, name in enumerate(pictures[:count]):
        write_tiff(installation.folder("captures") / f"{name}.tif", np.full((2, 2), k, np.uint16))


def test_pictures_of_the_whole_frame_are_taken_over(installations) -> None:
    old, new = installations[0.5, 2], installations[0.5, 3]
    _photographed(old)
    taken = take_over(new, old)
    whole = [e.name for e in plan_exposures(new) if e.device == "camera" and not e.clusters]
    assert taken == len(whole)
    for name in whole:
        assert (new.folder("captures") / f"{name}.tif").read_bytes() == (
            old.folder("captures") / f"{name}.tif"
        ).read_bytes()
    clusters = [e.name for e in plan_exposures(new) if e.device == "camera" and e.clusters]
    assert clusters  # those depend on K
    assert not any((new.folder("captures") / f"{name}.tif").exists() for name in clusters)
    assert not (new.folder("captures") / "measurements.csv").exists()
    assert {s.stage.name: s.state for s in new.status()}["captures"] == "missing"  # to be gone on with


def test_a_session_goes_on_with_what_was_taken_over(installations) -> None:
    """`capture` begins anew where its record does not name today's inputs."""
    old, new = installations[0.5, 2], installations[0.5, 3]
    _photographed(old, 7)
    assert take_over(new, old) == 7
    assert read_json(new.folder("captures") / "exposures.json")["inputs"] == new.inputs("captures")


def test_nothing_is_taken_from_another_print_or_into_a_session_under_way(installations) -> None:
    old, new = installations[0.5, 2], installations[0.5, 3]
    _photographed(installations[1.0, 2])
    assert take_over(new, installations[1.0, 2]) == 0
    assert take_over(new, old) == 0  # nothing printed there
    assert not new.folder("captures").exists()
    _photographed(old)
    _photographed(new, 3)
    assert take_over(new, old) == 0
    assert len(list(new.folder("captures").glob("*.tif"))) == 3
