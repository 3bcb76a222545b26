"""Inks and papers of paxel.toml: what a table means, that everything sees it, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paxel_design.stages.print_sheet import make_print
from paxel_runtime.colorants import load_colorants
from paxel_runtime.errors import InputError, InstallationError, SettingsError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, illuminant_D50, spectra_to_XYZ
from paxel_runtime.model.fluorescence import EXCITATION_NM
from paxel_runtime.model.pattern import Colorant, colorant_library
from paxel_runtime.printed import load_pattern
from paxel_runtime.settings import load_settings, make_settings, settings_to_toml
from paxel_runtime.stages import open_bench

SMALL: dict[str, Any] = {
    "pattern.size_mm": [40.0, 30.0],
    "projector.resolution": [64, 48],
    "projector.width_mm": 9.4,
    "camera.resolution": [160, 120],
    "meter.aperture_mm": 5.0,
    "clusters.count": 2,
}


def write_spectrum(path: Path, value: float | np.ndarray) -> None:
    values = np.broadcast_to(value, (41,))
    rows = [f"{nm:g},{v:g}" for nm, v in zip(np.arange(380, 781, 10), values, strict=True)]
    path.write_text("\n".join(["wavelength_nm,value", *rows]) + "\n", encoding="utf-8")


def colorants(folder: Path, **tables: dict[str, Any]) -> dict[str, Colorant]:
    overrides = {f"colorants.{name}.{key}": value for name, table in tables.items() for key, value in table.items()}
    return load_colorants(make_settings(overrides=overrides), folder)


def test_without_tables_there_is_the_library(tmp_path: Path) -> None:
    assert colorants(tmp_path) == colorant_library()


def test_a_file_of_reflectance(tmp_path: Path) -> None:
    write_spectrum(tmp_path / "silver.csv", 0.4)
    silver = colorants(tmp_path, silver={"reflectance": "silver.csv"})["silver"]
    np.testing.assert_allclose(silver.reflectance, 0.4)
    assert silver.spot == "silver"  # a plate of its own, shown in proofs as a gray
    assert len(set(silver.cmyk[:3])) == 1
    assert 0.2 < silver.cmyk[0] < 0.5


def test_a_recipe_or_a_plate_is_taken_as_given(tmp_path: Path) -> None:
    write_spectrum(tmp_path / "ink.csv", 0.2)
    found = colorants(
        tmp_path,
        mixed={"reflectance": "ink.csv", "cmyk": [0.0, 0.5, 0.1, 0.0]},
        plate={"reflectance": "ink.csv", "spot": "PANTONE 877 C"},
        both={"reflectance": "ink.csv", "spot": "Foil", "cmyk": [0.0, 0.0, 0.0, 0.3]},
        black={"reflectance": "ink.csv"},
    )
    assert (found["mixed"].cmyk, found["mixed"].spot) == ((0.0, 0.5, 0.1, 0.0), "")
    assert found["plate"].spot == "PANTONE 877 C"
    assert (found["both"].cmyk, found["both"].spot) == ((0.0, 0.0, 0.0, 0.3), "Foil")
    assert (found["black"].cmyk, found["black"].spot) == (colorant_library()["black"].cmyk, "")  # printed as ever
    np.testing.assert_allclose(found["black"].reflectance, 0.2)


def test_XYZ_is_recovered(tmp_path: Path) -> None:
    wanted = [0.20, 0.15, 0.05]
    D50 = illuminant_D50()
    rust = colorants(tmp_path, rust={"XYZ": wanted})["rust"]
    np.testing.assert_allclose(spectra_to_XYZ(rust.reflectance * D50) / spectra_to_XYZ(D50)[1], wanted, atol=1e-8)


def test_an_emission_is_a_row_of_the_donaldson_matrix(tmp_path: Path) -> None:
    nm = np.arange(380, 781, 10)
    row = 0.004 * np.exp(-0.5 * ((nm - 520) / 20.0) ** 2)
    write_spectrum(tmp_path / "glow.csv", row)
    write_spectrum(tmp_path / "paper.csv", 0.8)
    found = colorants(
        tmp_path,
        glow={"emission": "glow.csv"},
        weak={"emission": "glow.csv", "efficiency": 0.05, "excitation_nm": [430.0, 480.0]},
        white={"reflectance": "paper.csv"},
    )
    glow = found["glow"].fluorescence
    assert glow is not None
    np.testing.assert_allclose(found["glow"].reflectance, 0.8)  # colourless: it looks like the paper of the table
    at_365 = float(np.interp(365, EXCITATION_NM, glow.excitation))
    np.testing.assert_allclose(glow.emission * at_365, np.interp(WAVELENGTHS_NM, nm, row), rtol=0.01, atol=1e-12)
    weak = found["weak"].fluorescence
    assert weak is not None
    assert float(np.interp(455, EXCITATION_NM, weak.excitation)) == pytest.approx(0.05, rel=0.02)
    assert float(np.interp(365, EXCITATION_NM, weak.excitation)) < 1e-6


def test_inks_of_the_library_on_a_paper_of_one_s_own(tmp_path: Path) -> None:
    write_spectrum(tmp_path / "paper.csv", 0.6)
    ours, library = colorants(tmp_path, white={"reflectance": "paper.csv"}), colorant_library()
    np.testing.assert_allclose(ours["uv-red"].reflectance, 0.6)  # colourless, as before
    through = ours["cyan"].reflectance / ours["white"].reflectance
    np.testing.assert_allclose(through, library["cyan"].reflectance / library["white"].reflectance)
    assert ours["white"].cmyk == (0.0, 0.0, 0.0, 0.0)
    assert not ours["white"].spot


@pytest.mark.parametrize(
    ("table", "value", "words"),
    [
        ({"reflectance": "none.csv"}, 0.5, r"colorants\.ink\.reflectance: there is no file"),
        ({"reflectance": "ink.csv"}, -0.1, "must be >= 0, got -0.1 at 380 nm"),
        ({"reflectance": "ink.csv"}, 45.0, "not percent"),
        ({"reflectance": "ink.csv"}, np.nan, "finite"),
        ({"XYZ": [0.9, 0.9, 0.1]}, 0.5, r"colorants\.ink\.XYZ"),
        ({"emission": "ink.csv"}, -0.1, "must be >= 0"),
        ({"emission": "ink.csv"}, 0.0, "some visible light"),
        ({"emission": "ink.csv"}, 0.5, "set efficiency"),
    ],
)
def test_an_impossible_ink_is_named(table: dict[str, Any], value: float, words: str, tmp_path: Path) -> None:
    write_spectrum(tmp_path / "ink.csv", value)
    with pytest.raises(InputError, match=words):
        colorants(tmp_path, ink=table)


def test_a_paper_must_reflect(tmp_path: Path) -> None:
    write_spectrum(tmp_path / "ink.csv", 0.0)
    with pytest.raises(InputError, match="the paper must reflect"):
        colorants(tmp_path, white={"reflectance": "ink.csv"})


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"spot": "Foil"}, "reflectance, XYZ or emission must be given"),
        ({"reflectance": "a.csv", "XYZ": [0.1, 0.1, 0.1]}, "exclude each other"),
        ({"reflectance": "a.csv", "efficiency": 0.3}, "belong to an emission"),
        ({"emission": "a.csv", "excitation_nm": [400.0, 350.0]}, "a shorter and a longer"),
        ({"reflectance": "a.csv", "cmyk": [0.0, 0.0, 0.0, 1.5]}, r"colorants\.ink\.cmyk\[3\] must be <= 1, got 1.5"),
        ({"XYZ": [20.0, 20.0, 20.0]}, r"colorants\.ink\.XYZ\[0\] must be <= 1.2"),
        ({"colour": "red"}, r"colorants\.ink\.colour is not a known key.*has reflectance, XYZ, emission"),
    ],
)
def test_a_broken_table_is_named(table: dict[str, Any], words: str) -> None:
    with pytest.raises(SettingsError, match=words):
        make_settings(overrides={f"colorants.ink.{key}": value for key, value in table.items()})


def test_names_are_plain_and_known() -> None:
    with pytest.raises(SettingsError, match="letters, digits"):
        make_settings(overrides={"colorants.my ink.XYZ": [0.1, 0.1, 0.1]})
    with pytest.raises(SettingsError, match="described in a table"):
        make_settings(overrides={"pattern.colorants": ["silver", "white"]})
    with pytest.raises(SettingsError, match=r"bench\.white_sheet must be among"):
        make_settings(overrides={"bench.white_sheet": "silver"})


def test_tables_are_written_and_read_back(tmp_path: Path) -> None:
    settings = make_settings(
        overrides={
            "pattern.colorants": ["silver", "white"],
            "colorants.silver.reflectance": "silver.csv",
            "colorants.silver.cmyk": [0.0, 0.0, 0.0, 0.5],
            "colorants.glow-2.emission": "glow.csv",
            "colorants.glow-2.excitation_nm": [300.0, 410.0],
            "colorants.glow-2.spot": 'a "plate"',
            "colorants.white.XYZ": [0.8, 0.84, 0.7],
        }
    )
    path = tmp_path / "paxel.toml"
    path.write_text(settings_to_toml(settings), encoding="utf-8")
    assert load_settings(path) == settings
    path.write_text(settings_to_toml(settings).replace("[0.8, 0.84, 0.7]", "[0.8, 8.4, 0.7]"), encoding="utf-8")
    line = 1 + settings_to_toml(settings).split("XYZ = [0.8")[0].count("\n")
    with pytest.raises(SettingsError, match=rf"colorants\.white\.XYZ\[1\] must be <= 1.2, got 8.4 \(line {line}\)"):
        load_settings(path)


def test_print_and_bench_use_them_and_a_changed_file_is_noticed(tmp_path: Path) -> None:
    overrides = SMALL | {
        "pattern.colorants": ["silver", "white"],
        "colorants.silver.reflectance": "silver.csv",
        "bench.white_sheet": "silver",
        "bench.quality": "ideal",
    }
    installation = Installation.create(tmp_path, make_settings(overrides=overrides))
    write_spectrum(tmp_path / "silver.csv", 0.4)
    make_print(installation)
    assert installation.status()[0].state == "done"
    np.testing.assert_allclose(load_pattern(installation).palette[0].reflectance, 0.4)
    bench = open_bench(installation)
    codes = np.full((48, 64, 3), 255, np.uint8)
    readings = {}
    for surface in ("paper", "white"):
        bench.place(surface)
        bench.show(codes)
        readings[surface] = bench.measure()
    paper = colorant_library()["white"].reflectance
    np.testing.assert_allclose(readings["white"] / readings["paper"], 0.4 / paper, rtol=1e-5)  # float32

    write_spectrum(tmp_path / "silver.csv", 0.5)
    status = installation.status()[0]
    assert (status.state, status.reasons) == ("stale", ("silver.csv changed",))
    (tmp_path / "silver.csv").unlink()
    assert "there is no file" in installation.status()[0].reasons[0]
    with pytest.raises(InstallationError, match=r"colorants\.silver\.reflectance"):
        installation.inputs("captures")
    gone = Installation(tmp_path, make_settings(overrides=SMALL | {"bench.quality": "ideal"}))
    assert any("colorants was" in reason for reason in gone.status()[0].reasons)
