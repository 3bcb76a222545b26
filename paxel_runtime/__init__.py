"""Paxel's runtime: calibrate a projector to a printed pattern, predict colour, and make projection images.

Light enough for a show computer: importing this package loads no meshing, plotting or PDF library, and the names below
are loaded when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from paxel_runtime.numba_cache import use_writable_cache
from paxel_runtime.version import __version__

use_writable_cache()  # before any kernel is imported

if TYPE_CHECKING:
    from paxel_runtime.inversion import Inversion, invert
    from paxel_runtime.model.effects import parse_effect
    from paxel_runtime.model.pattern import Pattern
    from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
    from paxel_runtime.model.subgamut import PairGamut, SubGamut
    from paxel_runtime.storage import load_model

__all__ = [
    "Inversion",
    "PairGamut",
    "Pattern",
    "PredictionModel",
    "SubGamut",
    "SurfaceModel",
    "__version__",
    "invert",
    "load_model",
    "parse_effect",
]

_HOMES = {
    "Inversion": "inversion",
    "PairGamut": "model.subgamut",
    "Pattern": "model.pattern",
    "PredictionModel": "model.prediction",
    "SubGamut": "model.subgamut",
    "SurfaceModel": "model.prediction",
    "invert": "inversion",
    "load_model": "storage",
    "parse_effect": "model.effects",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
