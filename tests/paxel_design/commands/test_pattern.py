"""`paxel pattern` on the command line."""

import json

import pytest
from typer.testing import CliRunner

from paxel_design.cli import app

run = CliRunner()


def paxel(*words):
    result = run.invoke(app, [str(word) for word in words])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def test_help_teaches_what_can_be_set_and_how_ink_spread_is_measured():
    code, out, _ = paxel("pattern", "--help")
    assert code == 0
    for word in ("snap = true", 'page = "A4"', "measured_ruler_mm", "--test-sheet", "--ink-spread-from"):
        assert word in " ".join(out.split())


@pytest.mark.parametrize("preset", ["rgb", "uv-rgb"])  # all presets: test_print_sheet.py
def test_a_preset_for_one_channel_is_printed(preset, tmp_path):
    code, _, err = paxel("new", tmp_path / "show", "--preset", preset, "--set", "pattern.size_mm=[60, 40]")
    assert code == 0, err
    code, out, err = paxel("pattern", tmp_path / "show", "--json")
    assert code == 0, err
    record = json.loads(out)
    assert record["pdf"]["bytes"] == (tmp_path / "show" / "print" / "pattern.pdf").stat().st_size
    code, _, err = paxel("pattern", tmp_path / "show")
    assert (code, "nothing to do" in err) == (0, True)


def test_the_test_sheet_and_its_readings(tmp_path):
    paxel("new", tmp_path / "show", "--set", "pattern.size_mm=[60, 40]")
    code, out, err = paxel("pattern", tmp_path / "show", "--test-sheet", "--json")
    assert code == 0, err
    table = tmp_path / "show" / "test-sheet" / "measurements.csv"
    assert json.loads(out)["measurements"] == str(table)
    code, _, err = paxel("pattern", "--ink-spread-from", table)
    assert code == 2
    assert "fill it in" in err
    table.write_text(
        "patch,colorant,dots_mm,Y\n1,white,paper,85\n2,black,solid,1.7\n3,black,0.15,16.0\n4,black,0.3,26.7\n"
        "5,black,0.6,34.3\n",
        encoding="utf-8",
    )
    code, out, err = paxel("pattern", "--ink-spread-from", table, "--json")
    assert code == 0, err
    found = json.loads(out)
    code, out, err = paxel("pattern", "--ink-spread-from", table)
    assert code == 0
    assert f"ink_spread_um = {found['ink_spread_um']:.1f}" in err
    assert "black, 0.15 mm" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "give the installation's folder"),
        (["--list-colorants", "--test-sheet"], "give one of them"),
        (["--ink-spread-from", "no.csv"], "no.csv cannot be read"),
    ],
)
def test_what_cannot_be_done_is_told(words, message):
    code, out, err = paxel("pattern", *words)
    assert code == 2
    assert message in err
    assert not out


def test_inks_are_listed_with_those_of_the_installation(tmp_path):
    code, out, _ = paxel("pattern", "--list-colorants", "--json")
    assert code == 0
    library = json.loads(out)
    assert library["white"]["XYZ"][1] == 1.0
    assert library["uv-red"]["fluorescent"]
    assert library["black"]["cmyk"] == [0, 0, 0, 1]
    paxel("new", tmp_path / "show", "--set", "colorants.silver.XYZ=[0.4, 0.42, 0.4]")
    code, out, err = paxel("pattern", tmp_path / "show", "--list-colorants", "--json")
    assert code == 0, err
    assert json.loads(out)["silver"]["spot"] == "silver"
