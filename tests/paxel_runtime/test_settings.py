"""paxel.toml: every key is written and read back, and a broken one is answered with key, rule, value and line."""

from pathlib import Path

import pytest

from paxel_runtime.errors import SettingsError
from paxel_runtime.settings import (
    DEMO_OVERRIDES,
    PRESETS,
    Settings,
    change_toml,
    load_settings,
    make_settings,
    settings_to_toml,
)


@pytest.mark.parametrize("preset", PRESETS)
def test_what_is_written_is_what_is_read(preset: str, tmp_path: Path) -> None:
    settings = make_settings(preset, {**DEMO_OVERRIDES, "bench.seed": 7})
    path = tmp_path / "paxel.toml"
    path.write_text(settings_to_toml(settings), encoding="utf-8")
    assert load_settings(path) == settings


def test_every_key_stands_on_a_line_of_its_own_with_a_comment() -> None:
    lines = settings_to_toml(Settings()).splitlines()
    for key in Settings().values():
        name = key.rpartition(".")[2]
        if name == "colorants" and key != "pattern.colorants":  # tables of their own, none by default
            continue
        assert any(line.startswith(f"{name} = ") and "# " in line for line in lines), key


BROKEN = [
    ("dot_size_mm = 0.75", "dot_size_mm = -0.5", "pattern.dot_size_mm must be > 0, got -0.5 (line N)"),
    ("dot_size_mm = 0.75", "dot_sise_mm = 0.75", "pattern.dot_sise_mm is not a known key (line N)"),
    ("[600.0, 400.0]", "[600.0]", "pattern.size_mm must have more values, got [600.0] (line N)"),
    (
        '"checkerboard"',
        '"checker"',
        'pattern.layout must be "checkerboard", "tiles", "stripes" or "blue-noise", got \'checker\' (line N)',
    ),
    ("count = 3", "count = 1", "clusters.count must be >= 2, got 1"),
    ("count = 3", "count = 'x'", "clusters.count must be a valid integer, got 'x'"),
    ('["black", "white"]', '["black", "wite"]', "got 'wite' (line N)"),
    ('["black", "white"]', '["black"]', "must be two or more different ones, got ['black'] (line N)"),
    ("[printer]", "[prinfer]", "prinfer is not a known key (line N)"),
    ("[1920, 1080]", "[1920, 8]", "projector.resolution[1] must be >= 16, got 8 (line N)"),
    ("angle_deg = 30.0", "angle_deg = nan", "pattern.angle_deg must be a finite number, got nan (line N)"),
    ('quality = "realistic"', 'quality = "real"', 'bench.quality must be "realistic", "ideal" or "harsh"'),
    (
        "shares = []",
        "shares = [0.5, 0.4]",
        "shares must be 2 numbers that sum to 1, one a colorant, got [0.5, 0.4] (line N)",
    ),
    ('tile_order = "search"', "tile_order = 3", "pattern.tile_order"),
    (
        'page = "auto"',
        'page = "A9"',
        'printer.page must be "auto", A0, A1, A2, A3, A4, A3+, letter, legal, tabloid, or [width, height] in mm, '
        "got 'A9' (line N)",
    ),
    ('page = "auto"', "page = [210]", "or [width, height] in mm, got [210] (line N)"),
    ("snap = false", "snap = 1.5", "pattern.snap must be a valid boolean"),
    ("[100.0, 100.0]", "[10.0, 10.0]", "printer.measured_ruler_mm[0] must be >= 90, got 10.0"),
    ("seed = 0", "seed = ", "paxel.toml is not TOML"),
]


@pytest.mark.parametrize(("right", "wrong", "message"), BROKEN)
def test_a_broken_key_is_named_with_rule_value_and_line(right: str, wrong: str, message: str, tmp_path: Path) -> None:
    text = settings_to_toml(Settings())
    assert right in text
    path = tmp_path / "paxel.toml"
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    with pytest.raises(SettingsError) as error:
        load_settings(path)
    line = 1 + text[: text.index(right)].count("\n")
    assert message.replace("(line N)", f"(line {line})") in str(error.value)
    assert str(error.value).startswith("paxel.toml")
    assert error.value.exit_code == 2


@pytest.mark.parametrize("page", ["auto", "A3", [914.0, 2000.0]])
def test_a_page_is_a_name_or_two_lengths(page: str | list[float], tmp_path: Path) -> None:
    settings = make_settings(overrides={"printer.page": page})
    (tmp_path / "paxel.toml").write_text(settings_to_toml(settings), encoding="utf-8")
    read = load_settings(tmp_path / "paxel.toml").printer.page
    assert read == (tuple(page) if isinstance(page, list) else page)


def test_values_are_of_tables_and_of_single_keys() -> None:
    values = Settings().values("printer.dpi", "meter")
    assert "printer.dpi" in values
    assert "printer.page" not in values
    assert {key.split(".")[0] for key in values} == {"printer", "meter"}


def test_two_broken_keys_are_both_named(tmp_path: Path) -> None:
    text = settings_to_toml(Settings()).replace("dpi = 1440", "dpi = 1").replace("seed = 0", "seed = -1")
    (tmp_path / "paxel.toml").write_text(text, encoding="utf-8")
    with pytest.raises(SettingsError) as error:
        load_settings(tmp_path / "paxel.toml")
    assert "printer.dpi" in str(error.value)
    assert "bench.seed" in str(error.value)


def test_a_missing_file_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="paxel new"):
        load_settings(tmp_path / "paxel.toml")


@pytest.mark.parametrize(
    ("key", "named"),
    [("dot_size_mm", "dot_size_mm"), ("pattern.dots", "pattern.dots"), ("patern.dot_size_mm", "patern")],
)
def test_an_unknown_override_is_refused(key: str, named: str) -> None:
    with pytest.raises(SettingsError, match=named):
        make_settings(overrides={key: 1})


def test_demo_never_has_a_whole_number_of_pixels_a_dot() -> None:
    settings = make_settings(overrides=DEMO_OVERRIDES)
    pixels_a_dot = settings.pattern.dot_size_mm * settings.projector.resolution[0] / settings.projector.width_mm
    assert abs(pixels_a_dot - round(pixels_a_dot)) > 0.05  # a whole number would hide moire


def test_single_keys_change_and_all_else_stays() -> None:
    text = settings_to_toml(Settings()).replace("[devices]", "[devices]  # the box under the #2 table")
    changed = change_toml(text, {"pattern.dot_size_mm": 0.5, "pattern.tile_order": ["white", "black"], "meter.new": 1})
    for before, after in zip(text.splitlines(), [x for x in changed.splitlines() if x != "new = 1"], strict=True):
        if before.startswith(("dot_size_mm", "tile_order")):
            assert before.partition(" # ")[2] == after.partition(" # ")[2]
            assert before != after
        else:
            assert before == after
    assert "[meter]" in changed.split("new = 1")[0].splitlines()[-2] + changed.split("new = 1")[0].splitlines()[-1]
    assert change_toml('[pattern]\ntile_order = "a#b"  # why\n', {"pattern.tile_order": "c"}).endswith(" # why\n")
    assert change_toml("", {"pattern.snap": True}).strip() == "[pattern]\nsnap = true"
