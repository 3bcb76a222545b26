"""`paxel advise` on the command line: what it writes, and how it answers what it cannot do."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from paxel_design.advice import ranking
from paxel_design.cli import app
from paxel_runtime.settings import load_settings, make_settings, settings_to_toml

run = CliRunner()
ASKED = ("advise", "--projector", "1920x1080", "--width", "28.1cm", "--distance", "2.7m")


def paxel(*words):
    result = run.invoke(app, [str(word) for word in words])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(autouse=True)
def _few_candidates(monkeypatch):
    """A corner of the table on small pieces: the command is tested, not the figures."""
    for name, value in {"ANGLES_DEG": (30.0,), "DOTS_PX": (3.2, 5.1), "_ZOOMS": (1.0,), "_PIECE_PX": 64, "_SAMPLES": 21,
                        "_FINE_ZOOMS": (1.0,), "_FINE_PIECE_PX": 64, "_FINE_SAMPLES": 21,
                        "_BLUE_NOISE_CELLS": 24}.items():  # fmt: skip
        monkeypatch.setattr(ranking, name, value)


def test_it_writes_its_record_its_pictures_and_the_choice(tmp_path):
    toml = tmp_path / "show" / "paxel.toml"
    code, out, err = paxel(*ASKED, "--out", tmp_path / "advice", "--write", toml, "--json")
    assert code == 0, err
    record = json.loads(out)
    assert sorted(p.name for p in (tmp_path / "advice").iterdir()) == ["advice.json", "advice.png", "pareto.png"]
    best, settings = record["best"][0], load_settings(toml)
    assert settings.pattern.dot_size_mm == pytest.approx(best["dot_size_mm"], abs=1e-6)
    assert settings.pattern.layout == best["layout"]
    assert settings.projector.width_mm == 281.0
    assert settings.viewing.distance_mm == 2700.0
    assert any(candidate["pareto"] for candidate in record["candidates"])


def test_a_paxel_toml_that_is_there_keeps_its_comments_and_other_keys(tmp_path):
    toml = tmp_path / "paxel.toml"
    text = settings_to_toml(make_settings(overrides={"bench.seed": 7})).replace("# The projector", "# our projector #2")
    toml.write_text(text, encoding="utf-8")
    code, out, err = paxel(*ASKED, "--write", toml)
    assert code == 0, err
    assert "moire:" in out
    assert "1. checkerboard" in out
    after = toml.read_text(encoding="utf-8")
    changed = [pair for pair in zip(text.splitlines(), after.splitlines(), strict=True) if pair[0] != pair[1]]
    assert "# our projector #2" in after
    assert load_settings(toml).bench.seed == 7
    assert {new.split(" = ")[0] for _, new in changed} <= {
        "dot_size_mm", "angle_deg", "snap", "layout", "resolution", "width_mm", "distance_mm", "count",
    }  # fmt: skip
    assert all(old.partition("#")[2] == new.partition("#")[2] for old, new in changed)


def test_a_broken_paxel_toml_stays_as_it_was(tmp_path):
    toml = tmp_path / "paxel.toml"
    toml.write_text("[pattern]\ndot_size_mm = -1\n", encoding="utf-8")
    code, _, err = paxel(*ASKED, "--write", toml)
    assert code == 2
    assert "pattern.dot_size_mm must be > 0" in err
    assert toml.read_text(encoding="utf-8") == "[pattern]\ndot_size_mm = -1\n"


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (("advise", "--distance", "3m"), "--width must be given"),
        (("advise", "--width", "3 parsec", "--distance", "3m"), "--width must be a length"),
        (("advise", "--projector", "4K", "--width", "60cm", "--distance", "3m"), "such as 3840x2160"),
        ((*ASKED, "--sorted-by", "hue"), "lab or light"),
        ((*ASKED, "--colorants", "black,wite"), "wite"),
        (("advise", "--monochrome"), "three to 6"),
    ],
)
def test_what_it_cannot_do_is_told(words, answer):
    code, _, err = paxel(*words)
    assert code in (1, 2)
    assert answer in err


def test_shares_for_one_channel():
    code, out, err = paxel("advise", "--monochrome", "--colorants", "uv-red,uv-green,uv-blue", "--json")
    assert code == 0, err
    assert set(json.loads(out)) == {"equal", "neutral", "largest_gamut"}
    code, out, err = paxel("advise", "--monochrome", "--colorants", "uv-red,uv-green,uv-blue")
    assert "shares = [" in err
