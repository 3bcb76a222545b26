"""Paxel's runtime: calibrate a projector to a printed pattern, predict colour, and make projection images.

Light enough for a show computer: importing this package loads no meshing, plotting or PDF library.
"""

from paxel_runtime.model.effects import parse_effect
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.storage import load_model
from paxel_runtime.version import __version__

__all__ = ["Pattern", "PredictionModel", "SurfaceModel", "__version__", "load_model", "parse_effect"]
