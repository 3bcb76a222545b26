"""Readings of other people's meters: every format gives the same spectra, and bad rows are named."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import plan_readings
from paxel_runtime.captures.measurements import append_measurement
from paxel_runtime.captures.readings import XYZ_to_spectra, load_readings, match_to_plan, readings_from_colour
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ

PLAN = plan_readings(("red", "green", "blue"), (2,), bits=8, seed=0, surfaces=("pattern", "white"))


def _spectra(count: int = 3) -> dict[str, NDArray[np.float64]]:
    """Smooth spectra under names of the plan."""
    names = [e.name for e in PLAN if e.device == "meter"][:count]
    return {name: 0.01 + np.exp(-(((WAVELENGTHS_NM - 450 - 60 * i) / 40) ** 2)) for i, name in enumerate(names)}


def _table(spectra: dict[str, NDArray[np.float64]], head: str = "exposure,surface,") -> str:
    lines = [head + ",".join(f"{w:g}" for w in WAVELENGTHS_NM)]
    filler = "x," * (head.count(",") - 1)
    lines += [f"{name},{filler}" + ",".join(f"{v:.9g}" for v in spectrum) for name, spectrum in spectra.items()]
    return "\n".join(lines) + "\n"


def _same(read: dict[str, NDArray[np.float64]], spectra: dict[str, NDArray[np.float64]]) -> bool:
    return list(read) == list(spectra) and all(np.allclose(read[name], spectra[name], rtol=1e-8) for name in spectra)


def test_paxels_own_table_is_read_back(tmp_path: Path) -> None:
    spectra = _spectra()
    for name, spectrum in spectra.items():
        append_measurement(tmp_path / "measurements.csv", name, "white", spectrum)
    assert _same(load_readings(tmp_path / "measurements.csv"), spectra)


@pytest.mark.parametrize("head", ["name,", "Exposure,", "SAMPLE_NAME,operator,lamp,"])
def test_a_line_a_reading_under_any_usual_header(tmp_path: Path, head: str) -> None:
    spectra = _spectra()
    (tmp_path / "a.csv").write_text("# a comment\n" + _table(spectra, head), encoding="utf-8")
    assert _same(load_readings(tmp_path / "a.csv"), spectra)
    (tmp_path / "b.txt").write_text(_table(spectra, head).replace(",", "\t"), encoding="utf-8")
    assert _same(load_readings(tmp_path / "b.txt"), spectra)


def test_a_column_a_reading(tmp_path: Path) -> None:
    spectra = _spectra()
    table = np.column_stack([WAVELENGTHS_NM, *spectra.values()])
    lines = ["nm;" + ";".join(spectra), *(";".join(f"{v:.9g}" for v in row) for row in table)]
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="utf-8")
    assert _same(load_readings(tmp_path / "a.csv"), spectra)


def test_cgats_with_spectra_and_with_XYZ(tmp_path: Path) -> None:
    spectra = _spectra()
    fields = " ".join(["SAMPLE_ID", "SAMPLE_NAME", *(f"SPEC_{w:.0f}" for w in WAVELENGTHS_NM)])
    rows = [f'{i} "{name}" ' + " ".join(f"{v:.9g}" for v in s) for i, (name, s) in enumerate(spectra.items(), 1)]
    head = 'CTI3\n\nDESCRIPTOR "readings"\nNUMBER_OF_FIELDS 83\nBEGIN_DATA_FORMAT\n'
    text = head + fields + "\nEND_DATA_FORMAT\n\nNUMBER_OF_SETS 3\nBEGIN_DATA\n" + "\n".join(rows) + "\nEND_DATA\n"
    (tmp_path / "a.ti3").write_text(text, encoding="utf-8")
    assert _same(load_readings(tmp_path / "a.ti3"), spectra)

    XYZ = {name: spectra_to_XYZ(s) for name, s in spectra.items()}
    rows = [f"{name} " + " ".join(f"{v:.9g}" for v in xyz) for name, xyz in XYZ.items()]
    text = "CGATS.17\nBEGIN_DATA_FORMAT\nSAMPLE_NAME XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\nBEGIN_DATA\n"
    (tmp_path / "b.txt").write_text(text + "\n".join(rows) + "\nEND_DATA\n", encoding="utf-8")
    read = load_readings(tmp_path / "b.txt")
    for name in spectra:
        np.testing.assert_allclose(spectra_to_XYZ(read[name]), XYZ[name], rtol=1e-7)  # nine digits in the file


def test_a_folder_of_tm27_files(tmp_path: Path) -> None:
    spectra = _spectra()
    for name, spectrum in spectra.items():
        points = "".join(
            f'<SpectralData wavelength="{w:g}">{v:.9g}</SpectralData>'
            for w, v in zip(WAVELENGTHS_NM, spectrum, strict=True)
        )
        (tmp_path / f"{name}.spdx").write_text(
            '<?xml version="1.0" encoding="utf-8"?>\n<IESTM2714 xmlns="http://www.ies.org/iestm2714" version="1.0">'
            f"<Header><Description>lamp</Description></Header><SpectralDistribution>{points}"
            "</SpectralDistribution></IESTM2714>",
            encoding="utf-8",
        )
    read = load_readings(tmp_path)
    assert _same(dict(sorted(read.items())), dict(sorted(spectra.items())))


def test_colour_science_reads_and_writes_the_same(tmp_path: Path) -> None:
    colour = pytest.importorskip("colour", reason="colour-science is a test extra")
    spectra = _spectra()
    many = colour.MultiSpectralDistributions(
        np.column_stack(list(spectra.values())), WAVELENGTHS_NM, labels=list(spectra)
    )
    assert _same(readings_from_colour(many), spectra)
    single = [colour.SpectralDistribution(s, WAVELENGTHS_NM, name=name) for name, s in spectra.items()]
    assert _same(readings_from_colour(single), spectra)
    assert _same(readings_from_colour(dict(zip(spectra, single, strict=True))), spectra)
    with pytest.raises(InputError, match="different names"):
        readings_from_colour([single[0], single[0]])


def test_other_steps_are_brought_to_the_grid(tmp_path: Path) -> None:
    nm = np.arange(400.0, 701.0, 1.0)
    lines = ["name," + ",".join(f"{w:g}" for w in nm), "white," + ",".join(f"{v:g}" for v in nm / 1000)]
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="utf-8")
    spectrum = load_readings(tmp_path / "a.csv")["white"]
    inner = (WAVELENGTHS_NM > 405) & (WAVELENGTHS_NM < 695)
    np.testing.assert_allclose(spectrum[inner], WAVELENGTHS_NM[inner] / 1000, rtol=1e-9)  # a line stays a line
    assert np.all(spectrum[(WAVELENGTHS_NM < 395) | (WAVELENGTHS_NM > 705)] == 0)  # the meter saw nothing there


@given(st.lists(st.floats(0, 100), min_size=3, max_size=3))
def test_spectra_of_XYZ_have_that_XYZ(XYZ: list[float]) -> None:
    np.testing.assert_allclose(spectra_to_XYZ(XYZ_to_spectra(XYZ)), XYZ, atol=1e-9)


def test_readings_meet_the_plan_by_name_or_by_number() -> None:
    planned = [e.name for e in PLAN if e.device == "meter"]
    spectra = _spectra(len(planned))
    shuffled = {name: spectra[name] for name in reversed(planned)}
    assert list(match_to_plan(shuffled, PLAN)) == planned
    counted = {f"{i:03d}": spectra[name] for i, name in enumerate(planned, 1)}
    matched = match_to_plan(counted, PLAN)
    assert all(np.array_equal(matched[name], spectra[name]) for name in planned)
    del counted["002"]
    with pytest.raises(InputError, match=f"{len(planned)} readings are planned, got {len(planned) - 1}"):
        match_to_plan(counted, PLAN)
    with pytest.raises(InputError, match="got 'white paper' and 1 more"):
        match_to_plan({"white paper": spectra[planned[0]], "black": spectra[planned[1]]}, PLAN)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            lambda t: re.sub(r"-white,x,[^,]+", "-white,x,nan", t, count=1),
            r"line 2 \(reading read-white-white\) must hold finite numbers",
        ),
        (
            lambda t: re.sub(r"-white,x,[^,]+", "-white,x,dark", t, count=1),
            r"line 2 .* must hold numbers with a decimal point",
        ),
        (lambda t: t.rstrip().rsplit(",", 1)[0], r"line 4 .* must have 83 cells as the header, got 82"),
        (lambda t: t.replace("read-white-black", "read-white-white"), r"line 3 .* stands twice: are rows mixed up"),
        (
            lambda t: "\n".join(line.rsplit(",", 60)[0] for line in t.splitlines()),
            r"line 2 .* must cover 420 to 680 nm",
        ),
        (lambda t: t.splitlines()[0], "holds no reading"),
        (lambda t: "no table at all", "must hold lines such as"),
    ],
)
def test_bad_rows_are_named(tmp_path: Path, change, says: str) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "a.csv"
    text = _table(_spectra())
    assert change(text) != text
    path.write_text(change(text), encoding="utf-8")
    with pytest.raises(InputError, match=says):
        load_readings(path)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no file of readings"):
        load_readings(tmp_path / "a.csv")
    with pytest.raises(InputError, match="must hold readings"):
        load_readings(tmp_path)
    (tmp_path / "a.spdx").write_text("<IESTM2714", encoding="utf-8")
    with pytest.raises(InputError, match="is not an IES TM-27 file"):
        load_readings(tmp_path / "a.spdx")
    (tmp_path / "a.ti3").write_text("CTI3\n", encoding="utf-8")
    with pytest.raises(InputError, match="must hold a CGATS table"):
        load_readings(tmp_path / "a.ti3")
