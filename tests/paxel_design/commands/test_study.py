"""`paxel study` on the command line: its table, its exit codes, and what it says of a mistake."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from paxel_design.cli import app
from paxel_design.study import running
from paxel_runtime.errors import CalibrationError

run = CliRunner()


def paxel(*words):
    result = run.invoke(app, [str(word) for word in words])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(autouse=True)
def _quick_bench(monkeypatch):
    """The command is tested, not the bench: dots below 0.3 mm cannot be told apart, K = 9 has no grays in common."""

    def measure(folder, settings, tell, *, sibling=None, ghosting=True):
        if settings.pattern.dot_size_mm < 0.3:
            raise CalibrationError("pixels on black and on white must differ")
        (folder / "calibration").mkdir(parents=True)
        (folder / "calibration" / "model.json").write_text("{}", encoding="utf-8")
        errors = {"dE00_mean": 0.12, "dE00_p95": 0.3, "dE00_max": 0.5}
        bodies = {
            "lightness": {"area": 2000.0, "polygon": [[0, 0], [70, 70], [10, 60]],
                          "rectangle": {"L_pattern": [20.0, 43.2], "L_white": [45.0, 69.9]}},
            "hue": {"angle_deg": 180.0, "area_any": 3880.0, "area_all": 500.0, "polygon_any": [[1, 0], [0, 1], [-1, 0]],
                    "polygon_all": [[1, 0], [0, 1], [-1, 0]]},
            "dual_image": {"volume_pattern": 29300.0, "volume_white": 33500.0},
            "ghosting_percent": {"pattern": 0.2, "white": 1.1} if ghosting else None,
        }  # fmt: skip
        return {
            "measured_on": f"virtual bench, {settings.bench.quality}",
            **(bodies if settings.clusters.count < 9 else dict.fromkeys(bodies)),
            "prediction": {"n": 100, "model": "corrected", "pattern": errors, "white": errors,
                           "linear": {"pattern": errors, "white": errors}},
            "seconds": 1.0,
        }  # fmt: skip

    monkeypatch.setattr(running, "measure_case", measure)
    monkeypatch.setattr("paxel_design.study.figures.write_study_figure", lambda to, figures: to.write_bytes(b"chart"))


def test_it_prints_a_table_that_fits_a_terminal(tmp_path):
    code, out, err = paxel("study", tmp_path / "s", "--dot-size", 0.75, "--clusters", 3, "--clusters", 9, "--jobs", 1)
    assert code == 0, err
    assert "checkerboard at 30° (virtual bench, realistic)" in out
    assert "0.75  3  23.2 x 24.9      3880  29.3, 33.5  0.12, 0.12  0.12, 0.12  0.2, 1.1" in out
    assert "0.75  9         none      none        none" in out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert "finished; 0 to go" in err
    assert sorted(p.name for p in (tmp_path / "s").iterdir()) == ["cases", "study.csv", "study.json", "study.png"]


def test_json_is_the_record_and_a_failure_is_exit_code_1(tmp_path):
    words = ("study", tmp_path, "--dot-size", 0.2, "--dot-size", 1, "--clusters", 2, "--jobs", 1, "--no-ghosting")
    code, out, err = paxel(*words, "--set", "bench.quality=harsh", "--json")
    assert code == 1
    record = json.loads(out)
    assert record["failed"] == 1
    assert record["measured_on"] == "virtual bench, harsh"
    assert [case.get("error") for case in record["cases"]] == ["pixels on black and on white must differ", None]
    assert "checkerboard-0.2mm-30deg-K2: failed" in err
    code, out, _ = paxel(*words)
    assert code == 1
    assert "failed: checkerboard at 30°, 0.2 mm, K = 2: pixels on black and on white must differ" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--set", "pattern.dot_size_mm=0.5"], "use --dot-size"),
        (["--set", "projector.width_mm=600"], "--pitch, in mm"),
        (["--clusters", "1"], "clusters.count must be >= 2, got 1"),
        (["--layout", "hexagons"], "pattern.layout must be"),
        (["--pitch", "0"], "--pitch must be > 0 mm, got 0"),
        (["--jobs", "-1"], "--jobs must be >= 0, got -1"),
    ],
)
def test_what_cannot_be_is_told_and_nothing_is_written(tmp_path, words, message):
    code, _, err = paxel("study", tmp_path / "s", *words)
    assert code == 2
    assert message in " ".join(err.split())
    assert not (tmp_path / "s").exists()
