"""Spectra read from text: forms that people have, the grid, and every way in which a file can be wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.spectral_files import read_spectra, to_grid


def bell(nm: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.exp(-0.5 * ((nm - 560) / 40) ** 2)


@pytest.mark.parametrize("sign", [",", ";", "\t"])
@pytest.mark.parametrize("header", ["", "# a comment\nwavelength_nm,one,two\n"])
def test_columns_are_read_with_and_without_names(sign: str, header: str, tmp_path: Path) -> None:
    path = tmp_path / "two.csv"
    rows = "\n".join(f"{nm},{nm / 1000},1e-2" for nm in range(380, 781, 10))
    path.write_text((header + rows + "\n\n").replace(",", sign), encoding="utf-8-sig")
    columns = read_spectra(path, "here")
    assert list(columns) == (["one", "two"] if header else ["1", "2"])
    wavelengths_nm, values = columns[next(iter(columns))]
    np.testing.assert_allclose(values, wavelengths_nm / 1000)


def test_any_step_gives_the_same_spectrum() -> None:
    exact = bell(WAVELENGTHS_NM)
    for step, tolerance in ((1, 2e-3), (2, 2e-3), (5, 1e-12), (10, 9e-3)):
        # A triangle of +-5 nm, and straight lines over 10 nm, change a bell of sigma 40 nm by h^2 / (2 sigma^2).
        nm = np.arange(380.0, 781.0, step)
        np.testing.assert_allclose(to_grid(nm, bell(nm), "here"), exact, atol=tolerance)
    nm = np.array([380.0, 520.0, 523.0, 777.0])
    np.testing.assert_allclose(to_grid(nm, np.full(4, 0.5), "here"), 0.5)


def test_beyond_its_ends_a_spectrum_is_held_or_nothing() -> None:
    nm = np.arange(400.0, 701.0, 10.0)
    held, dark = (to_grid(nm, np.full(31, 0.4), "here", beyond=kind) for kind in ("hold", "zero"))
    np.testing.assert_allclose(held, 0.4)
    np.testing.assert_allclose(dark, np.where((WAVELENGTHS_NM >= 400) & (WAVELENGTHS_NM <= 700), 0.4, 0.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must hold lines such as 400,0.52"),
        ("400\n500\n", "must hold lines such as"),
        ("400,0.1\n", "two at least"),
        ("400,0.1\n500,x\n", "line 2: must hold 2 numbers, got '500,x'"),
        ("400;0,1\n500;0,2\n", "written with a point"),
        ("400,0.1\n500,0.2,0.3\n", "line 2"),
        ("400,0.1\n500,nan\n", "line 2: must be finite"),
        ("nm,a\n400,0.1\n400,0.2\n", "line 3: wavelengths must rise"),
    ],
)
def test_a_broken_table_is_named_with_its_line(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words) as error:
        read_spectra(path, "colorants.silver.reflectance")
    assert "colorants.silver.reflectance" in str(error.value)


def test_a_missing_or_binary_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"relative to the folder of paxel\.toml"):
        read_spectra(tmp_path / "none.csv", "here")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        read_spectra(tmp_path / "binary.csv", "here")


@pytest.mark.parametrize(
    "nm", [np.arange(0.38, 0.78, 0.01), np.arange(300.0, 400.0, 5.0), np.arange(500.0, 781.0, 10.0)]
)
def test_a_spectrum_beside_the_visible_range_is_refused(nm: NDArray[np.float64]) -> None:
    with pytest.raises(InputError, match="must cover 420 to 680 nm"):
        to_grid(nm, np.ones(len(nm)), "here")
