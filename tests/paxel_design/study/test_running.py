"""The folder of a study: what is measured, what is kept, what a failure and an interruption cost."""

from __future__ import annotations

import csv
import io
import json

import pytest

from paxel_design.study import Study, run_study, running
from paxel_design.study.running import COLUMNS
from paxel_runtime.errors import InputError, UsageError

ASKED = Study(dot_sizes_mm=(0.5, 1.0), clusters=(2, 3))
NAMES = [f"checkerboard-{mm}mm-30deg-K{K}" for mm in ("0.5", "1") for K in (2, 3)]


def _measured(bench) -> list[str]:
    names = [name for name, _ in bench.measured]
    bench.measured.clear()
    return names


def test_a_study_is_a_table_and_a_chart(bench, tmp_path) -> None:
    told = []
    record = run_study(ASKED, tmp_path, jobs=1, progress=lambda *words: told.append(words))
    assert record["failed"] == 0
    assert record["measured_on"] == "virtual bench, realistic"
    on_disk = json.loads((tmp_path / "study.json").read_text(encoding="utf-8"))
    assert on_disk["cases"] == record["cases"]
    first = record["cases"][0]
    assert (first["dot_size_mm"], first["clusters"]) == (0.5, 2)
    assert first["lightness"]["rectangle_area"] == pytest.approx(12 * 13)
    assert "polygon" not in first["lightness"]
    rows = list(csv.DictReader(io.StringIO((tmp_path / "study.csv").read_text(encoding="utf-8"))))
    assert len(rows) == 4
    assert list(rows[0]) == list(COLUMNS)
    assert float(rows[3]["rectangle_area"]) == pytest.approx(23 * 24)
    assert float(rows[3]["linear_white_dE00_p95"]) == 0.2
    assert (rows[3]["ghosting_pattern_percent"], rows[3]["ghosting_white_percent"], rows[3]["error"]) == ("0.3", "", "")
    assert (tmp_path / "study.png").read_bytes() == b"chart"
    assert not (tmp_path / "work").exists()
    assert json.loads((tmp_path / "cases" / f"{NAMES[0]}.model.json").read_text(encoding="utf-8")) == {"of": NAMES[0]}
    assert any(message == "0.5 mm K 2 capture" and (done, total) == (50, 400) for message, done, total in told)


def test_each_print_has_one_case_that_takes_the_pictures(bench, tmp_path) -> None:
    run_study(ASKED, tmp_path, jobs=1, keep=True)
    first = dict(bench.measured)
    assert first == {NAMES[0]: None, NAMES[1]: NAMES[0], NAMES[2]: None, NAMES[3]: NAMES[2]}
    assert sorted(path.name for path in (tmp_path / "work").iterdir()) == sorted(NAMES)
    _measured(bench)
    run_study(Study(dot_sizes_mm=(1.0,), clusters=(3, 5)), tmp_path, jobs=1)
    assert bench.measured == [("checkerboard-1mm-30deg-K5", NAMES[3])]  # what was kept is used


def test_only_what_is_missing_or_was_made_otherwise_is_measured(bench, tmp_path) -> None:
    run_study(ASKED, tmp_path, jobs=1)
    assert sorted(_measured(bench)) == NAMES
    run_study(ASKED, tmp_path, jobs=1)
    assert not _measured(bench)
    (tmp_path / "cases" / f"{NAMES[2]}.json").unlink()
    (tmp_path / "cases" / f"{NAMES[1]}.json").write_text('{"figures": {', encoding="utf-8")  # a damaged one
    run_study(ASKED, tmp_path, jobs=1)
    assert sorted(_measured(bench)) == [NAMES[1], NAMES[2]]
    run_study(Study(dot_sizes_mm=(0.5, 1.0), clusters=(2, 3, 5)), tmp_path, jobs=1)
    assert sorted(_measured(bench)) == ["checkerboard-0.5mm-30deg-K5", "checkerboard-1mm-30deg-K5"]
    harsh = Study(dot_sizes_mm=(0.5,), clusters=(2,), overrides={"bench.quality": "harsh"})
    run_study(harsh, tmp_path, jobs=1)
    assert _measured(bench) == NAMES[:1]
    run_study(ASKED, tmp_path, jobs=1, force=True)
    assert sorted(_measured(bench)) == NAMES


def test_ghosts_that_were_not_measured_are_measured_when_they_are_asked_for(bench, tmp_path) -> None:
    without = Study(dot_sizes_mm=(0.5,), clusters=(2,), ghosting=False)
    record = run_study(without, tmp_path, jobs=1)
    assert record["cases"][0]["ghosting_percent"] is None
    run_study(Study(dot_sizes_mm=(0.5,), clusters=(2,)), tmp_path, jobs=1)
    assert len(_measured(bench)) == 2
    run_study(without, tmp_path, jobs=1)
    assert not _measured(bench)


def test_a_case_that_fails_stops_no_other_and_is_tried_again(bench, tmp_path) -> None:
    bench.fails = {NAMES[0]}
    record = run_study(ASKED, tmp_path, jobs=1)
    assert record["failed"] == 1
    assert [case.get("error") for case in record["cases"]] == ["clusters cannot be told apart", None, None, None]
    assert ",clusters cannot be told apart\n" in (tmp_path / "study.csv").read_text(encoding="utf-8")
    assert sorted(_measured(bench)) == NAMES
    bench.fails = set()
    assert run_study(ASKED, tmp_path, jobs=1)["failed"] == 0
    assert _measured(bench) == NAMES[:1]


def test_all_may_fail(bench, tmp_path) -> None:
    bench.fails = set(NAMES)
    record = run_study(ASKED, tmp_path, jobs=1)
    assert (record["failed"], record["measured_on"]) == (4, "")
    assert not (tmp_path / "study.png").exists()


def test_an_interruption_costs_the_case_under_way(bench, tmp_path) -> None:
    bench.stops_at = NAMES[1]
    with pytest.raises(KeyboardInterrupt):
        run_study(ASKED, tmp_path, jobs=1)
    finished = _measured(bench)
    assert finished == [NAMES[0], NAMES[2]]  # one of each print goes first
    assert (tmp_path / "work" / NAMES[0] / "captures").is_dir()  # its pictures are not lost
    bench.stops_at = ""
    record = run_study(ASKED, tmp_path, jobs=1)
    assert record["failed"] == 0
    assert dict(bench.measured) == {NAMES[1]: NAMES[0], NAMES[3]: NAMES[2]}


def test_what_has_no_grays_in_common_has_empty_cells(bench, tmp_path, monkeypatch) -> None:
    def blind(*words, **named):
        nothing = dict.fromkeys(("lightness", "hue", "dual_image", "ghosting_percent"))
        return bench.measure(*words, **named) | nothing

    monkeypatch.setattr(running, "measure_case", blind)
    record = run_study(Study(dot_sizes_mm=(0.5,), angles_deg=(0.0, 30.0)), tmp_path, jobs=1)
    assert [case["angle_deg"] for case in record["cases"]] == [0.0] * 3 + [30.0] * 3
    row = (tmp_path / "study.csv").read_text(encoding="utf-8").splitlines()[1].split(",")
    assert row[list(COLUMNS).index("rectangle_area")] == ""
    assert row[list(COLUMNS).index("pattern_dE00_mean")] == "0.1"


def test_a_folder_that_is_something_else_stays_as_it_is(bench, tmp_path) -> None:
    file = tmp_path / "notes"
    file.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="is a file, and a study needs a folder"):
        run_study(ASKED, file, jobs=1)
    show = tmp_path / "show"
    show.mkdir()
    (show / "paxel.toml").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="is an installation; a study needs a folder of its own"):
        run_study(ASKED, show, jobs=1)
    own = Study(overrides={"colorants.silver.reflectance": "silver.csv", "pattern.colorants": ["silver", "white"]})
    with pytest.raises(InputError, match=r"colorants.silver.reflectance must be the whole path"):
        run_study(own, tmp_path / "new", jobs=1)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["notes", "paxel.toml", "show"]
    assert not bench.measured
