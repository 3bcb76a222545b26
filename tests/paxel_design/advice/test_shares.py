"""Area shares for one channel: a neutral white is D65, and no shares near the largest gamut have a larger one."""

from __future__ import annotations

import numpy as np
import pytest

from paxel_design.advice.shares import _volume, proposed_shares
from paxel_design.patterns import colorants_of
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.calibration.white_point import WHITES
from paxel_runtime.errors import InputError

TRIAD = ("uv-red", "uv-green", "uv-blue")


@pytest.mark.parametrize("names", [TRIAD, ("red", "green", "blue")])
def test_neutral_is_D65_and_the_largest_gamut_is_larger(names: tuple[str, ...]) -> None:
    found = proposed_shares(names)
    np.testing.assert_allclose(found["neutral"]["white_xy"], WHITES["D65"], atol=1e-6)
    for key in ("equal", "neutral", "largest_gamut"):
        assert sum(found[key]["shares"].values()) == pytest.approx(1, abs=2e-4)  # rounded to four digits
    largest = found["largest_gamut"]
    assert largest["volume"] >= max(found["equal"]["volume"], found["neutral"]["volume"])
    XYZ, shares = colorants_to_XYZ(colorants_of(names)).T, np.array(list(largest["shares"].values()))
    for direction in ([1, -1, 0], [0, 1, -1], [1, 0, -1]):
        for sign in (-0.03, 0.03):  # a percent: what the search and its triangles leave
            assert _volume(XYZ, shares + sign * np.array(direction)) < 1.01 * largest["volume"]


def test_two_colorants_or_equal_ones_are_told() -> None:
    with pytest.raises(InputError, match="three to 6"):
        proposed_shares(("red", "green"))
