"""All changes of cases whose measured model is a simulated print: then what a change foretells is what it simulates."""

from dataclasses import replace
from typing import Any

import pytest

from paxel_design.gamut.primaries import primaries_figures
from paxel_design.patterns import make_pattern
from paxel_design.what_if.case import Case, PrintCase
from paxel_design.what_if.changes import Change
from paxel_design.what_if.figures import Room, room_of
from paxel_design.what_if.print_changes import (
    cluster_counts,
    dot_sizes,
    finer_raster,
    inks,
    regular_layout,
    three_channels,
)
from paxel_design.what_if.recorded_changes import recorded_changes
from paxel_design.what_if.sheet_changes import sheet_changes
from paxel_design.what_if.simulated_print import Lighting, simulated_print
from paxel_design.what_if.viewing import least_distance_mm, view_changes
from paxel_runtime.settings import make_settings

SMALL = {"projector.resolution": [480, 270], "projector.width_mm": 70.3, "pattern.size_mm": [80, 50]}


def simulated_case(preset: str, room: Room | None = None, **overrides: Any) -> Case:
    """A case whose calibration found what the simulation says; `room` stands for its own where that does not matter."""
    settings = make_settings(preset, SMALL | overrides)
    p = settings.pattern
    pattern = make_pattern(p.layout, p.colorants, p.dot_size_mm, p.angle_deg, p.size_mm, tile_order=p.tile_order)
    lit = Lighting(
        settings.projector.width_mm / settings.projector.resolution[0],
        settings.clusters.count or (3 if len(p.colorants) == 2 else len(p.colorants)),
        settings.projector.channels,
        settings.clusters.method,
        settings.model.second_surface != "none",
    )
    model = simulated_print(pattern, lit)
    room = room or room_of(model)
    return Case(model, room, PrintCase(pattern, lit, settings, model, room))


def by_key(changes: Any) -> dict[str, Change]:
    found = {change.key: change for change in changes}
    assert found
    return found


def printed(case: Case) -> PrintCase:
    assert case.printed is not None
    return case.printed


@pytest.fixture(scope="module")
def bw() -> Case:
    return simulated_case("bw-checkerboard", **{"clusters.count": 2})


@pytest.fixture(scope="module")
def bw_changes(bw: Case) -> dict[str, Change]:
    makers = (dot_sizes, cluster_counts, finer_raster, inks)
    return by_key(change for make in makers for change in make(bw, printed(bw)))


def test_what_is_foretold_is_what_is_simulated(bw: Case, bw_changes: dict[str, Change]) -> None:
    lighting, pattern = printed(bw).lighting, printed(bw).pattern
    for key, there in (
        ("clusters-3", simulated_print(pattern, replace(lighting, K=3))),
        ("dot-size-1", simulated_print(replace(pattern, dot_size_mm=1.0), lighting)),
        ("finer-raster", simulated_print(pattern, replace(lighting, pitch_mm=lighting.pitch_mm / 2))),
    ):
        room, change = room_of(there), bw_changes[key]
        assert change.after == pytest.approx(room.contrast, rel=1e-9)
        assert change.volume_gain == pytest.approx(room.volume / bw.room.volume - 1, rel=1e-6)
        assert (change.before, change.unit) == (bw.room.contrast, "L*")


def test_a_darker_ink_is_that_of_a_simulation_with_it(bw: Case, bw_changes: dict[str, Change]) -> None:
    pattern = printed(bw).pattern
    ink = replace(pattern.library["black"], reflectance=pattern.library["black"].reflectance / 2)
    there = simulated_print(replace(pattern, library={**pattern.library, "black": ink}), printed(bw).lighting)
    change = bw_changes["darker-ink"]
    # its darker pixels may be sorted a little differently; here they stay in their clusters' columns all the same
    assert change.after == pytest.approx(room_of(there).contrast, rel=0.01)
    assert change.helps


def test_larger_dots_gain_and_are_seen_from_farther(bw_changes: dict[str, Change]) -> None:
    larger, largest, smaller = (bw_changes[f"dot-size-{size}"] for size in ("1", "1.25", "0.62"))
    assert bw_changes["dot-size-1"].before < larger.after < largest.after
    assert larger.values["distance"].value == pytest.approx(smaller.before * 1.0 / 0.75)
    assert smaller.after == pytest.approx(smaller.before * 0.62 / 0.75)
    assert smaller.less_is_better
    assert float(str(smaller.values["effect"].value)) < 0


def test_the_least_distance_is_that_of_the_previews(bw: Case) -> None:
    previews = {
        f"preview/{k}.json": {"on_pattern": {"minimum_distance_mm": mm}} for k, mm in enumerate((1800.0, 900.0))
    }
    assert least_distance_mm(replace(bw, records=previews)) == 1800.0
    # without previews the print is asked: a checkerboard's diagonal of 0.53 mm at some 40 cycles a degree
    assert 2000.0 < least_distance_mm(bw) < 3000.0


def test_one_channel_gets_shares_and_no_second_sheet() -> None:
    case = simulated_case("uv-rgb")
    changes = by_key((*sheet_changes(case), next(view_changes(case)), *cluster_counts(case, printed(case))))
    white = primaries_figures(case.model, printed(case).pattern.shares())["whites"]["D65"]
    shares = changes["shares"]
    assert (shares.before, shares.after) == (white["luminance"], white["luminance_with_shares"])
    assert sum(shares.values["shares"].value) == pytest.approx(1.0, abs=1e-9)  # type: ignore[arg-type]
    assert not any(key.startswith("gray") for key in changes)
    assert changes["tile-order"].gain == 0.0
    assert changes["clusters-4"].unit == "CIELAB^3"
    assert changes["clusters-4"].helps
    assert not list(three_channels(case, printed(case)))  # without UV these inks all look alike


def test_inks_that_reflect_may_have_three_channels() -> None:
    case = simulated_case("rgb")
    assert by_key(three_channels(case, printed(case)))["three-channels"].helps


def test_blue_noise_may_become_regular() -> None:
    case = simulated_case("bw-blue-noise", **{"pattern.size_mm": [15, 10], "clusters.count": 2})
    (change,) = regular_layout(case, printed(case))
    assert change.values["layout"].value == "checkerboard"
    # single cells of a checkerboard have more edges than the clumps of blue noise, where pixels are mixed
    assert change.after < change.before


def test_eighteen_inputs_are_the_most() -> None:
    case = simulated_case("cmyrgb", Room(18.0, 20_000.0))
    assert case.model.n == 18
    assert not list(cluster_counts(case, printed(case)))
    assert not list(inks(case, printed(case)))  # its darkest ink is a blue, and it has no bare paper


RECORDS: dict[str, dict[str, Any]] = {
    "projection/dual-image.json": {
        "name": "dual-image",
        "mapping": {"method": "adaptive", "adaptive": {"gain": 1.25}},
    },
    "projection/neutralize.json": {"name": "neutralize", "mapping": {}},
    "calibration/accuracy.json": {
        "model": "corrected",
        "pattern": {"dE00_mean": 0.2},
        "white": {"dE00_mean": 0.4},
        "linear": {"pattern": {"dE00_mean": 0.5}, "white": {"dE00_mean": 0.7}},
        "noise_floor": {"pattern": {"dE00_mean": 0.1}, "white": {"dE00_mean": 0.1}},
    },
}


def test_records_tell_what_is_in_use(bw: Case) -> None:
    changes = by_key(recorded_changes(replace(bw, records=RECORDS)))
    assert set(changes) == {"adaptive-dual-image", "correction", "better-readings"}
    assert changes["adaptive-dual-image"].in_use
    assert changes["adaptive-dual-image"].gain == pytest.approx(0.25)
    correction, better = changes["correction"], changes["better-readings"]
    assert (correction.before, correction.after, correction.in_use) == (pytest.approx(0.6), pytest.approx(0.3), True)
    assert (better.before, better.after, better.helps) == (pytest.approx(0.3), pytest.approx(0.1), True)


def test_a_correction_that_is_off_can_come_down_to_the_noise(bw: Case) -> None:
    accuracy = {**RECORDS["calibration/accuracy.json"], "model": "linear"}
    changes = by_key(recorded_changes(replace(bw, records={"calibration/accuracy.json": accuracy})))
    assert set(changes) == {"correction"}
    assert not changes["correction"].in_use
    assert changes["correction"].after == pytest.approx(0.1)
