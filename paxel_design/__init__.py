"""Paxel's design side: patterns and their print, what a pattern can show, and the command `paxel`.

The names below are loaded when they are first used: the command line answers at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from paxel_design.gamut import JointGamut, lightness_area, product_pair, sub_gamut
    from paxel_design.patterns import make_pattern
    from paxel_design.printing import write_pattern_pdf
    from paxel_runtime.model.effects import DualImage, Full, Neutralize
    from paxel_runtime.model.pattern import Pattern

__all__ = [
    "DualImage",
    "Full",
    "JointGamut",
    "Neutralize",
    "Pattern",
    "lightness_area",
    "make_pattern",
    "product_pair",
    "sub_gamut",
    "write_pattern_pdf",
]

_HOMES = {
    "DualImage": "paxel_runtime.model.effects",
    "Full": "paxel_runtime.model.effects",
    "JointGamut": "paxel_design.gamut",
    "Neutralize": "paxel_runtime.model.effects",
    "Pattern": "paxel_runtime.model.pattern",
    "lightness_area": "paxel_design.gamut",
    "make_pattern": "paxel_design.patterns",
    "product_pair": "paxel_design.gamut",
    "sub_gamut": "paxel_design.gamut",
    "write_pattern_pdf": "paxel_design.printing",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
