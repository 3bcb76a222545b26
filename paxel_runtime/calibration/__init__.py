"""Calibration: captures and readings -> pixels that are sorted and a colour that is predicted. Pure functions."""

from paxel_runtime.calibration.accuracy import field_ratios, prediction_error
from paxel_runtime.calibration.fit import fit_model
from paxel_runtime.calibration.pixels import SortedPixels, nodal_reflectance, pattern_area, register, sort_pixels

__all__ = [
    "SortedPixels",
    "field_ratios",
    "fit_model",
    "nodal_reflectance",
    "pattern_area",
    "prediction_error",
    "register",
    "sort_pixels",
]
