"""Hue-change areas against dense searches with the joint gamut's half-spaces."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut, hue_change_area, lightness_area
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]


@pytest.mark.parametrize(("K", "colored", "angle"), [(2, False, 180.0), (3, True, 70.0)])
def test_the_areas_are_those_of_a_dense_search(measured_model: Models, K: int, colored: bool, angle: float) -> None:
    model = measured_model(2, K, colored=colored)
    joint = JointGamut(model)
    area, lightness = hue_change_area(joint, angle), lightness_area(joint)
    rectangle = np.array([lightness.L_pattern, lightness.L_white])
    turn = np.deg2rad(angle)
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])

    def reached(ab: NDArray[np.float64], share: float, count: int) -> NDArray[np.bool_]:
        """Whether a pair is in reach at each place of the rectangle made smaller about its centre."""
        middle, half = rectangle.mean(axis=1), share * np.ptp(rectangle, axis=1) / 2
        L = [m + h * np.linspace(-1, 1, count) for m, h in zip(middle, half, strict=True)]
        places = np.stack(np.meshgrid(*L), axis=-1).reshape(-1, 2)
        sides = [
            Lab_to_XYZ(np.column_stack((places[:, k], np.broadcast_to(c, (len(places), 2)))), model.white_point)
            for k, c in enumerate((ab, ab @ rotation))
        ]
        return joint.contains(*sides, tolerance=1e-9)

    for k in range(0, 180, 15):
        # Some place of 81 x 81 is within an 80th of the rectangle of the best, where the chroma is 2 % less at most.
        assert np.any(reached(0.98 * area.polygon_any[k], 1.0, 81))
        assert not np.any(reached(1.001 * area.polygon_any[k], 1.0, 81))
        assert np.all(reached((1 - 1e-4) * area.polygon_all[k], 0.5, 5))
        assert not np.all(reached((1 + 1e-4) * area.polygon_all[k], 0.5, 5))
    assert 0 < area.area_all < area.area_any
