"""Response curves of measured devices: fitted to every second level, they predict the levels between.

The data are other people's (environment variable PAXEL_DATA); without them these tests skip. All figures, of more
devices, stand in ``reports/reference/response_measured.json``.
"""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.calibration.ramps import fit_curve, spectral_shares
from paxel_runtime.model.response import ProjectorResponse

DATA = os.environ.get("PAXEL_DATA", "")

pytestmark = pytest.mark.skipif(not DATA, reason="PAXEL_DATA is not set: the measured devices are not at hand")


def _ramps(device: str) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """(code, share of full light) of every channel."""
    with (Path(DATA) / "projector" / f"{device}.csv").open(encoding="utf-8") as file:
        table = np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])
    ramps = []
    for channel in np.unique(table[:, 0]):
        rows = table[table[:, 0] == channel]
        rows = rows[np.argsort(rows[:, 1])]
        ramps.append((rows[:, 1] / rows[-1, 1], spectral_shares(rows[:, 2:])))
    return ramps


# Largest error of a level that was left out, as a share of full light; levels left in are 26 to 30 codes of 255 apart.
# VirtualSky starts to shine between two of them (level 13 of 260), and the meter quantises the CRT's dim blue.
@pytest.mark.parametrize(
    ("device", "channels", "largest"), [("ProPixx", 3, 0.02), ("VirtualSky", 4, 0.015), ("CRT", 3, 0.02)]
)
def test_every_second_level_predicts_the_others(device: str, channels: int, largest: float) -> None:
    ramps = _ramps(device)
    assert len(ramps) == channels
    for code, shares in ramps:
        keep = np.arange(len(code)) % 2 == 0
        keep[-1] = True
        names = [f"level {c:.3f}" for c in code[keep]]
        response = ProjectorResponse(*((points,) for points in fit_curve(code[keep], shares[keep], names, device)))
        predicted = response.P_to_x(code[~keep, None])[:, 0]
        assert np.abs(predicted - shares[~keep]).max() < largest
        P = np.linspace(0, 1, 2000)[:, None]
        x = response.P_to_x(P)
        assert np.all(np.diff(x[:, 0]) >= 0)
        assert np.abs(response.P_to_x(response.x_to_P(x)) - x).max() < 1e-6  # the figure
