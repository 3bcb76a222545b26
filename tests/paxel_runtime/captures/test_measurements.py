"""The table of readings: written a line at a time, read whole, and never with half a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paxel_runtime.captures.measurements import append_measurement, read_measurements
from paxel_runtime.errors import InstallationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM


def test_what_is_appended_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "measurements.csv"
    assert read_measurements(path) == {}
    spectra = np.random.default_rng(0).random((3, WAVELENGTHS_NM.size))
    for i, spectrum in enumerate(spectra):
        append_measurement(path, f"read-{i}", "white", spectrum)
    readings = read_measurements(path)
    assert list(readings) == ["read-0", "read-1", "read-2"]
    assert np.allclose(list(readings.values()), spectra, rtol=1e-8)  # nine digits


def test_a_line_cut_short_is_left_out_and_measured_again(tmp_path: Path) -> None:
    path = tmp_path / "measurements.csv"
    spectrum = np.full(WAVELENGTHS_NM.shape, 0.25)
    append_measurement(path, "one", "white", spectrum)
    append_measurement(path, "two", "white", spectrum)
    path.write_bytes(path.read_bytes()[:-40])
    assert list(read_measurements(path)) == ["one"]
    append_measurement(path, "two", "white", 2 * spectrum)
    readings = read_measurements(path)
    assert list(readings) == ["one", "two"]
    assert np.all(readings["two"] == 0.5)


@pytest.mark.parametrize(("line", "words"), [("x,white,1,2", "line 3: a reading needs 81"), ("x,white,a", "line 3")])
def test_a_line_that_is_no_reading_is_named(tmp_path: Path, line: str, words: str) -> None:
    path = tmp_path / "measurements.csv"
    append_measurement(path, "one", "white", np.ones(WAVELENGTHS_NM.shape))
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(InstallationError, match=words):
        read_measurements(path)
