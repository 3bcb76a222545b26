"""Effects: what each wants to be shown on the two surfaces; the table of all of them."""

from paxel_runtime.model.effects.effect import Effect, Partner
from paxel_runtime.model.effects.table import (
    CHROMA_FLOOR,
    EFFECTS,
    Chroma,
    Decolorize,
    DualImage,
    Full,
    FullChange,
    HueShift,
    Monochrome,
    Neutralize,
    Watermark,
    parse_effect,
)

__all__ = [
    "CHROMA_FLOOR",
    "EFFECTS",
    "Chroma",
    "Decolorize",
    "DualImage",
    "Effect",
    "Full",
    "FullChange",
    "HueShift",
    "Monochrome",
    "Neutralize",
    "Partner",
    "Watermark",
    "parse_effect",
]
