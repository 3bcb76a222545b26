"""Calibration: captures and readings -> pixels that are sorted and a colour that is predicted. Pure functions."""

from paxel_runtime.calibration.accuracy import (
    ComparedColors,
    compare_colors,
    error_by_input,
    error_figures,
    field_ratios,
    noise_floor,
    prediction_error,
)
from paxel_runtime.calibration.accuracy_plot import accuracy_picture
from paxel_runtime.calibration.camera_color import (
    CameraToXYZ,
    camera_to_XYZ,
    fit_device_matrix,
    sensitivity_matrix,
    spot_of_meter,
)
from paxel_runtime.calibration.cluster_pictures import NodalImages
from paxel_runtime.calibration.correction import correct_model
from paxel_runtime.calibration.fit import fit_model
from paxel_runtime.calibration.image_model import Fields, image_fields, kernel_sigma_px
from paxel_runtime.calibration.nodal import nodal_reflectance, nodal_to_linear_sRGB, pattern_area
from paxel_runtime.calibration.pixels import SortedPixels, register, sort_by_design, sort_pixels
from paxel_runtime.calibration.positions import moved_to_mean, position_spread

__all__ = [
    "CameraToXYZ",
    "ComparedColors",
    "Fields",
    "NodalImages",
    "SortedPixels",
    "accuracy_picture",
    "camera_to_XYZ",
    "compare_colors",
    "correct_model",
    "error_by_input",
    "error_figures",
    "field_ratios",
    "fit_device_matrix",
    "fit_model",
    "image_fields",
    "kernel_sigma_px",
    "moved_to_mean",
    "nodal_reflectance",
    "nodal_to_linear_sRGB",
    "noise_floor",
    "pattern_area",
    "position_spread",
    "prediction_error",
    "register",
    "sensitivity_matrix",
    "sort_by_design",
    "sort_pixels",
    "spot_of_meter",
]
