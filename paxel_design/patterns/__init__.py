"""Layouts of a printed pattern: the table of layouts, and a `Pattern` made from its description.

A layout only fills `cells`; size, angle and edge of the dots belong to `Pattern`. Nothing here knows how a
pattern is printed or projected on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.checkerboard import checkerboard
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant, Pattern, colorant_library

__all__ = ["LAYOUTS", "Layout", "colorants_of", "make_pattern"]

Layout = Callable[[tuple[str, ...], int], NDArray[np.uint8]]
"""``layout(colorants, seed) -> cells``: one torus of indices into `colorants`, row 0 lowest."""

LAYOUTS: MappingProxyType[str, Layout] = MappingProxyType({"checkerboard": checkerboard})
"""Every layout by its name in ``paxel.toml``."""


def colorants_of(names: Sequence[str]) -> tuple[Colorant, ...]:
    """Look colorants up by name.

    Raises
    ------
    InputError
        If a name is not in the library.
    """
    library = colorant_library()
    for name in names:
        if name not in library:
            raise InputError(f"a colorant must be one of {', '.join(library)}, got {name!r}")
    return tuple(library[name] for name in names)


def make_pattern(
    layout: str,
    colorants: Sequence[str],
    dot_size_mm: float,
    angle_deg: float,
    size_mm: tuple[float, float],
    seed: int = 0,
) -> Pattern:
    """Make the pattern that a description asks for.

    Parameters
    ----------
    layout : str
        A key of `LAYOUTS`.
    colorants : sequence of str
        Different names from the library of colorants; ``"white"`` is the bare paper.
    dot_size_mm : float
        Edge of a cell in millimetres, > 0.
    angle_deg : float
        Rotation of the cells, counter-clockwise, about the centre of the pattern.
    size_mm : (float, float)
        Width and height of the pattern area.
    seed : int
        Seed of the layout, where it has one.

    Raises
    ------
    InputError
        If the layout or a colorant is unknown, a colorant stands twice, or the numbers make no pattern.
    """
    if layout not in LAYOUTS:
        raise InputError(f"a pattern's layout must be one of {', '.join(LAYOUTS)}, got {layout!r}")
    names = tuple(colorants)
    colorants_of(names)
    if len(set(names)) != len(names):
        raise InputError(f"a pattern's colorants must be different, got {', '.join(names)}: name each once")
    if not np.isfinite(angle_deg):
        raise InputError(f"a pattern's angle_deg must be a finite number of degrees, got {angle_deg}")
    cells = LAYOUTS[layout](names, seed)
    width_mm, height_mm = size_mm
    return Pattern(
        layout, names, cells, float(dot_size_mm), float(angle_deg), (float(width_mm), float(height_mm)), seed
    )
