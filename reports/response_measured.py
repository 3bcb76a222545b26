"""Response curves of measured devices: reports/reference/response_measured.json.

Every channel of the devices in ``PAXEL_DATA/projector`` (a DLP-LED projector, a four-channel lamp, a CRT, six display
calibrations) is fitted to every second of its measured levels, by a curve through the points and by a gamma model, and
predicts the levels between. Errors are shares of full light. The paper's section IV-C1 gives no figures.

Run from a checkout (seconds)::

    PAXEL_DATA=... python -m reports.response_measured
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from paxel_runtime.calibration.ramps import Curve, fit_curve, spectral_shares
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.response import ProjectorResponse

RESULT = Path(__file__).parent / "reference" / "response_measured.json"
SPECTRAL = ("ProPixx", "VirtualSky", "CRT")
CURVES: tuple[Curve, ...] = ("measured", "gamma")

Ramp = tuple[NDArray[np.float64], NDArray[np.float64]]


def ramps(folder: Path) -> Iterator[tuple[str, Ramp]]:
    """(device and channel, (code, share of full light)) of everything that was measured."""
    for device in SPECTRAL:
        with (folder / f"{device}.csv").open(encoding="utf-8") as file:
            table = np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])
        for channel in np.unique(table[:, 0]):
            rows = table[table[:, 0] == channel]
            rows = rows[np.argsort(rows[:, 1])]
            yield f"{device} {channel:g}", (rows[:, 1] / rows[-1, 1], spectral_shares(rows[:, 2:]))
    displays = loadmat(folder / "PTB3TestCal.mat", squeeze_me=True, struct_as_record=False)["cals"]
    for i, display in enumerate(np.atleast_1d(displays)):
        inputs = np.asarray(display.rawdata.rawGammaInput, np.float64)
        spectra = np.asarray(display.rawdata.mon, np.float64).reshape(len(inputs), -1, int(display.nDevices))
        code = np.concatenate(([0.0], inputs / inputs[-1]))
        for j in range(spectra.shape[2]):
            light = np.vstack([np.zeros(spectra.shape[1]), spectra[..., j]])  # the ambient light is subtracted already
            yield f"PTB {i} channel {j}", (code, spectral_shares(light))


def figures(code: NDArray[np.float64], shares: NDArray[np.float64], curve: Curve) -> dict[str, float | bool]:
    """Errors of the levels that were left out, and how well the inverse undoes the curve."""
    keep = np.arange(len(code)) % 2 == 0
    keep[-1] = True
    names = [f"level {c:.3f}" for c in code[keep]]
    response = ProjectorResponse(*((points,) for points in fit_curve(code[keep], shares[keep], names, "its", curve)))
    error = response.P_to_x(code[~keep, None])[:, 0] - shares[~keep]
    x = response.P_to_x(np.linspace(0, 1, 5001)[:, None])
    return {
        "rms": float(np.sqrt(np.mean(error**2))),
        "max": float(np.abs(error).max()),
        "monotone": bool(np.all(np.diff(x[:, 0]) >= 0)),
        "round_trip": float(np.abs(response.P_to_x(response.x_to_P(x)) - x).max()),
    }


def main() -> None:
    result: dict[str, Any] = {}
    for name, (code, shares) in ramps(Path(os.environ["PAXEL_DATA"]) / "projector"):
        try:
            result[name] = {"levels": len(code), **{curve: figures(code, shares, curve) for curve in CURVES}}
            print(name, {curve: f"{result[name][curve]['max']:.2%}" for curve in CURVES})
        except CalibrationError as error:  # some of the displays do fall
            result[name] = {"levels": len(code), "refused": str(error)}
            print(name, error)
    RESULT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
