"""The viewer: what the eye sees of a view from its distance, and the figures of it (design: sections 4 and 10).

A *view* is the light of the wall as XYZ on the projector's raster, Y = 1 for the white point; where it comes from
(the virtual bench, a calibrated photograph) is not known here.
"""

from paxel_runtime.observer.change import change_figures
from paxel_runtime.observer.contrast import coherent_gain, lightness_range, local_contrast
from paxel_runtime.observer.exposure import EXPOSURES, view_to_sRGB
from paxel_runtime.observer.eye import (
    EYE_SIGMA_ARCMIN,
    Viewer,
    eye_blur,
    eye_sigma_mm,
    fall_off,
    inner_mask,
    leveled,
    picture_to_Lab,
    view_to_Lab,
)
from paxel_runtime.observer.figures import view_figures
from paxel_runtime.observer.ghosting import ghost_L, ghosting_percent, picture_correlation, plant_mark, planted_mark
from paxel_runtime.observer.judgement import judge_view, preview_words, view_words
from paxel_runtime.observer.leak import codes_to_Y, leak_figures
from paxel_runtime.observer.texture import minimum_distance_mm, texture_ghost_percent, texture_window_px

__all__ = [
    "EXPOSURES",
    "EYE_SIGMA_ARCMIN",
    "Viewer",
    "change_figures",
    "codes_to_Y",
    "coherent_gain",
    "eye_blur",
    "eye_sigma_mm",
    "fall_off",
    "ghost_L",
    "ghosting_percent",
    "inner_mask",
    "judge_view",
    "leak_figures",
    "leveled",
    "lightness_range",
    "local_contrast",
    "minimum_distance_mm",
    "picture_correlation",
    "picture_to_Lab",
    "plant_mark",
    "planted_mark",
    "preview_words",
    "texture_ghost_percent",
    "texture_window_px",
    "view_figures",
    "view_to_Lab",
    "view_to_sRGB",
    "view_words",
]
