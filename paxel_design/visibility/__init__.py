"""Before printing: the spectrum of a layout, how visible it is, and how it beats against a projector's raster."""

from paxel_design.visibility.beats import Beat, beats
from paxel_design.visibility.moire import Moire, moire, moire_of_picture, moire_picture, worst_moire
from paxel_design.visibility.spectrum import (
    LayoutSpectrum,
    PatternVisibility,
    layout_spectrum,
    pattern_visibility,
    radial_average,
)

__all__ = [
    "Beat",
    "LayoutSpectrum",
    "Moire",
    "PatternVisibility",
    "beats",
    "layout_spectrum",
    "moire",
    "moire_of_picture",
    "moire_picture",
    "pattern_visibility",
    "radial_average",
    "worst_moire",
]
