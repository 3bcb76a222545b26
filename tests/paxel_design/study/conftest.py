"""A measurement that takes no time, for tests of the folder of a study and of its command."""

from __future__ import annotations

from pathlib import Path

import pytest

from paxel_design.study import running
from paxel_runtime.errors import CalibrationError


class FakeBench:
    """Stands in for `measure_case`: figures that follow from dot size and K; `fails` and `stops_at` are case names."""

    def __init__(self) -> None:
        self.measured: list[tuple[str, str | None]] = []
        self.fails: set[str] = set()
        self.stops_at = ""

    def measure(self, folder: Path, settings, tell, *, sibling=None, ghosting=True):
        name = folder.name
        if name == self.stops_at:
            raise KeyboardInterrupt
        self.measured.append((name, sibling.name if sibling else None))
        (folder / "captures").mkdir(parents=True, exist_ok=True)
        tell("capture", 0.5)
        if name in self.fails:
            raise CalibrationError("clusters cannot be told apart")
        (folder / "calibration").mkdir()
        (folder / "calibration" / "model.json").write_text(f'{{"of": "{name}"}}', encoding="utf-8")
        return figures_of(settings.pattern.dot_size_mm, settings.clusters.count, ghosting)


def figures_of(dot_mm: float, K: int, ghosting: bool = True):
    """Figures as `measure_case` gives them."""
    side = 20 * dot_mm + K
    corner = [[0, 0], [70, 70], [70, 100], [10, 60]]
    ring = [[side, 0], [0, side], [-side, 0], [0, -side]]
    errors = {"dE00_mean": 0.1, "dE00_p95": 0.2, "dE00_max": 0.4}
    return {
        "measured_on": "virtual bench, realistic",
        "lightness": {
            "area": 2000.0,
            "polygon": corner,
            "rectangle": {"L_pattern": [20.0, 20 + side], "L_white": [50.0, 51 + side]},
        },
        "hue": {"angle_deg": 180.0, "area_any": 2 * side**2, "area_all": side**2, "polygon_any": ring,
                "polygon_all": ring},
        "dual_image": {"volume_pattern": 20000.0, "volume_white": 25000.0},
        "prediction": {"n": 100, "model": "corrected", "pattern": errors, "white": errors,
                       "linear": {"pattern": errors, "white": errors}},
        "ghosting_percent": {"pattern": 0.3, "white": None} if ghosting else None,
        "shared_pictures": 0,
        "seconds": 1.0,
    }  # fmt: skip


@pytest.fixture
def bench(monkeypatch):
    """In place of the virtual bench, and of the charts, which take seconds."""
    fake = FakeBench()
    monkeypatch.setattr(running, "measure_case", fake.measure)
    monkeypatch.setattr("paxel_design.study.figures.write_study_figure", lambda to, figures: to.write_bytes(b"chart"))
    return fake


@pytest.fixture
def figures():
    """Figures of a case by dot size and K."""
    return figures_of
