"""The print stage: what its record holds, what makes it stale, and that impossible requests leave files alone."""

import numpy as np
import pytest

from paxel_design.patterns import make_pattern
from paxel_design.stages.print_sheet import design_of, ink_spread_from, make_print, make_test_sheet, visibility_of
from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation
from paxel_runtime.printed import load_pattern, printed_pattern
from paxel_runtime.settings import PRESETS, make_settings
from paxel_runtime.storage import read_json

SMALL = {"pattern.size_mm": [60.0, 40.0]}


def installation_of(path, preset="bw-checkerboard", **overrides):
    keys = {key.replace("__", "."): value for key, value in overrides.items()}
    return Installation.create(path, make_settings(preset, SMALL | keys))


def test_the_folder_tells_how_visible_the_print_is(tmp_path):
    """Beside the record, so that another viewer or projector makes no print stale; nearer, both are seen better."""
    installation = installation_of(tmp_path)
    make_print(installation)
    told = read_json(tmp_path / "print" / "visibility.json")
    assert told["pixel_pitch_mm"] == pytest.approx(281 / 1920)
    assert told["moire"]["clusters"] == 3
    assert told["moire"]["visibility"] > 0
    assert {"period_mm", "direction_deg", "orders"} <= set(told["beats"][0])
    nearer = again(installation, viewing__distance_mm=1500.0, viewing__luminance_cd_m2=300.0)
    assert states(nearer)["print"].state == "done"
    at_hand = visibility_of(load_pattern(installation), nearer.settings)
    assert at_hand["print"]["luminance"] > 10 * told["print"]["luminance"]
    assert at_hand["luminance_cd_m2"] == 300.0


def again(installation, **overrides):
    """The same folder with other settings."""
    keys = {key.replace("__", "."): value for key, value in overrides.items()}
    return Installation(installation.path, make_settings(overrides=SMALL | keys))


def states(installation):
    return {status.stage.name: status for status in installation.status()}


@pytest.mark.parametrize("preset", PRESETS)
def test_the_record_makes_the_same_cells_again(preset, tmp_path):
    installation = installation_of(tmp_path, preset, pattern__seed=7)
    record = make_print(installation)
    assert read_json(tmp_path / "print" / "pattern.json")["recipe"] == record["recipe"]
    again = make_pattern(
        record["layout"],
        record["colorants"],
        record["dot_size_mm"],
        record["angle_deg"],
        record["size_mm"],
        record["seed"],
        **record["recipe"],
    )
    assert np.array_equal(again.cells, load_pattern(installation).cells)
    assert record["shares"] == pytest.approx(dict(zip(again.colorants, again.shares(), strict=True)))
    assert sorted(p.name for p in (tmp_path / "print").iterdir()) == [
        "cells.png",
        "pattern.json",
        "pattern.pdf",
        "preview.png",
        "print-sheet.txt",
        "visibility.json",
    ]


@pytest.mark.parametrize(
    "asked",
    [
        {"pattern.layout": "tiles", "pattern.shares": [0.2, 0.8]},
        {"pattern.layout": "stripes", "pattern.colorants": ["cyan", "red", "white"]},
        {"pattern.layout": "blue-noise", "pattern.shares": [0.3, 0.7], "pattern.flatness": 1.0},
        {"pattern.layout": "blue-noise", "pattern.blue_noise": "zhou-fang", "pattern.shares": [0.4, 0.6]},
        {"pattern.layout": "blue-noise", "pattern.blue_noise": "void-and-cluster"},
    ],
)
def test_whatever_a_layout_was_asked_for_its_recipe_makes_the_same_cells(asked, tmp_path):
    design = design_of(Installation(tmp_path, make_settings(overrides=SMALL | asked)))
    p = design.pattern
    again = make_pattern(p.layout, p.colorants, p.dot_size_mm, p.angle_deg, p.size_mm, p.seed, **design.recipe)
    assert np.array_equal(again.cells, p.cells)


def test_snapping_moves_dot_and_angle_and_says_so(tmp_path):
    installation = installation_of(tmp_path, pattern__snap=True)
    record = make_print(installation)
    # 42.5 pixels at 30 degrees: the nearest whole step is 37 across, 21 up
    assert record["snap"]["step_px"] == (37, 21)
    assert record["dot_size_mm"] == pytest.approx(np.hypot(37, 21) * 25.4 / 1440)
    assert record["angle_deg"] == pytest.approx(np.rad2deg(np.arctan2(21, 37)))
    assert (record["snap"]["asked_dot_size_mm"], record["snap"]["asked_angle_deg"]) == (0.75, 30.0)
    pattern = load_pattern(installation)
    assert (pattern.dot_size_mm, pattern.angle_deg) == (record["dot_size_mm"], record["angle_deg"])
    assert "0.750431 mm" in (tmp_path / "print" / "print-sheet.txt").read_text(encoding="utf-8")
    assert make_print(installation_of(tmp_path / "off"))["snap"] is None


def test_the_measured_ruler_scales_the_pattern_and_leaves_the_print_as_it_is(tmp_path):
    installation = installation_of(tmp_path)
    make_print(installation)
    measured = again(installation, printer__measured_ruler_mm=[100.4, 99.8])
    assert states(measured)["print"].state == "done"
    hung, designed = printed_pattern(measured), load_pattern(measured)
    assert hung.print_scale == pytest.approx((1.004, 0.998))
    x, y = np.random.default_rng(0).uniform(-19, 19, (2, 500))
    assert np.array_equal(hung.label(1.004 * x, 0.998 * y), designed.label(x, y))
    assert hung.label(np.array(30.1), np.array(0.0)) != 255  # 30.12 is the edge now
    assert designed.label(np.array(30.1), np.array(0.0)) == 255
    assert printed_pattern(installation).print_scale == (1.0, 1.0)


@pytest.mark.parametrize("key", ["printer__dpi", "printer__ink_spread_um", "printer__page"])
def test_other_keys_of_the_printer_make_the_print_stale(key, tmp_path):
    installation = installation_of(tmp_path)
    make_print(installation)
    value = {"printer__dpi": 2400, "printer__ink_spread_um": 10.0, "printer__page": "A3"}[key]
    assert states(again(installation, **{key: value}))["print"].state == "stale"


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"printer__dpi": 72}, "at least 3 dots of the printer"),
        ({"pattern__snap": True, "printer__dpi": 360}, "pattern.snap must find"),
        ({"printer__page": [50.0, 50.0]}, "at least 40 mm of the sheet"),
        ({"pattern__size_mm": [6000.0, 40.0]}, "at most 5080 mm on each side"),
        ({"pattern__layout": "tiles", "pattern__shares": [0.99, 0.01]}, "leave each colorant a cell"),
    ],
)
def test_an_impossible_request_is_one_error_and_leaves_the_print_as_it_was(asked, message, tmp_path):
    installation = installation_of(tmp_path)
    make_print(installation)
    before = {p.name: p.read_bytes() for p in (tmp_path / "print").iterdir()}
    with pytest.raises(InputError, match=message):
        make_print(again(installation, **asked))
    assert {p.name: p.read_bytes() for p in (tmp_path / "print").iterdir()} == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["paxel.toml", "print"]


def test_a_sheet_in_pages_is_stated(tmp_path):
    record = make_print(installation_of(tmp_path, printer__page="A4", pattern__size_mm=[300.0, 200.0]))
    assert record["pdf"]["page_mm"] in ((210.0, 297.0), (297.0, 210.0))
    assert record["pdf"]["pages"] > 2


def test_the_test_sheet_stands_beside_the_print_and_never_over_readings(tmp_path):
    installation = installation_of(tmp_path)
    made = make_test_sheet(installation)
    assert made["patches"] == 5
    table = tmp_path / "test-sheet" / "measurements.csv"
    assert (tmp_path / "test-sheet" / "test-sheet.pdf").is_file()
    make_test_sheet(installation)  # nothing was filled in
    assert not (tmp_path / "print").exists()
    values = {"paper": 85.0, "solid": 1.7, "0.15": 22.0, "0.3": 30.9, "0.6": 36.0}
    lines = []
    for line in table.read_text(encoding="utf-8").splitlines():
        kind = line.split(",")[2] if line[0].isdigit() else ""
        lines.append(line.replace(",,,", f",{values[kind]},{values[kind]},{values[kind]}") if kind else line)
    table.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match="is filled in"):
        make_test_sheet(installation)
    found = ink_spread_from(table)
    assert found["set"] == f"printer.ink_spread_um = {found['ink_spread_um']:.1f}"
    assert 0 < found["ink_spread_uncertainty_um"] < 10
    assert [patch["patch"] for patch in found["patches"]] == ["3", "4", "5"]
    with pytest.raises(InputError, match=r"none.csv cannot be read"):
        ink_spread_from(tmp_path / "none.csv")
    make_test_sheet(installation, force=True)
    with pytest.raises(InputError, match="fill it in"):
        ink_spread_from(table)
