"""Layouts of a printed pattern: the table of layouts, and a `Pattern` made from its description.

A layout only fills `cells`; size, angle and edge of the dots belong to `Pattern`. Nothing here knows how a
pattern is printed or projected on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.blue_noise import BLUE_NOISE, blue_noise
from paxel_design.patterns.checkerboard import checkerboard
from paxel_design.patterns.request import LayoutRequest, check_shares
from paxel_design.patterns.tiles import stripes, tiles
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant, Pattern, colorant_library

__all__ = [
    "BLUE_NOISE",
    "LAYOUTS",
    "Layout",
    "LayoutRequest",
    "cells_that_cover",
    "colorants_of",
    "layout_recipe",
    "make_pattern",
]

Layout = Callable[[LayoutRequest], NDArray[np.uint8]]
"""``layout(request) -> cells``: one torus of indices into the request's colorants, row 0 lowest."""

LAYOUTS: MappingProxyType[str, Layout] = MappingProxyType(
    {"checkerboard": checkerboard, "tiles": tiles, "stripes": stripes, "blue-noise": blue_noise}
)
"""Every layout by its name in ``paxel.toml``."""


def colorants_of(names: Sequence[str], library: Mapping[str, Colorant] | None = None) -> tuple[Colorant, ...]:
    """Look colorants up by name; in the built-in library, if no other is given.

    Raises
    ------
    InputError
        If a name is not in the library.
    """
    library = colorant_library() if library is None else library
    for name in names:
        if name not in library:
            raise InputError(f"a colorant must be one of {', '.join(library)}, got {name!r}")
    return tuple(library[name] for name in names)


def cells_that_cover(size_mm: tuple[float, float], dot_size_mm: float, angle_deg: float) -> tuple[int, int]:
    """Rows and columns of cells, even, that cover an area about its centre at an angle.

    Raises
    ------
    InputError
        If a length is not positive and finite, or the angle not finite.
    """
    for name, value in (("dot_size_mm", dot_size_mm), ("size_mm", min(size_mm))):
        if not value > 0:
            raise InputError(f"a pattern's {name} must be > 0, got {value}")
    if not np.isfinite(angle_deg):
        raise InputError(f"a pattern's angle_deg must be a finite number of degrees, got {angle_deg}")
    if not np.isfinite([*size_mm, dot_size_mm]).all():
        raise InputError(f"a pattern's lengths must be finite, got size_mm {size_mm}, dot_size_mm {dot_size_mm}")
    width_mm, height_mm = size_mm
    c, s = abs(np.cos(np.deg2rad(angle_deg))), abs(np.sin(np.deg2rad(angle_deg)))
    half_rows = (s * width_mm + c * height_mm) / (2 * dot_size_mm)
    half_columns = (c * width_mm + s * height_mm) / (2 * dot_size_mm)
    return 2 * (int(half_rows) + 1), 2 * (int(half_columns) + 1)


def make_pattern(
    layout: str,
    colorants: Sequence[str],
    dot_size_mm: float,
    angle_deg: float,
    size_mm: tuple[float, float],
    seed: int = 0,
    *,
    shares: Sequence[float] | None = None,
    blue_noise: str = "swap",
    flatness: float = 2.0,
    tile_order: str | Sequence[str] = "search",
    library: Mapping[str, Colorant] | None = None,
) -> Pattern:
    """Make the pattern that a description asks for.

    Parameters
    ----------
    layout : str
        A key of `LAYOUTS`.
    colorants : sequence of str
        Different names from `library`; ``"white"`` is the bare paper.
    dot_size_mm : float
        Edge of a cell in millimetres, > 0.
    angle_deg : float
        Rotation of the cells, counter-clockwise, about the centre of the pattern.
    size_mm : (float, float)
        Width and height of the pattern area.
    seed : int
        Seed of the layout, where it has one.
    shares : sequence of float, optional
        Share of the area for each colorant, summing to 1; equal by default, or those of a given `tile_order`. What
        was realised tells `Pattern.shares`: blue noise meets them to one cell, tiles to
        `paxel_design.patterns.tiles.SHARE_TOLERANCE` where a short row can.
    blue_noise : str
        Method of the layout ``"blue-noise"``, a key of `BLUE_NOISE`.
    flatness : float
        Of the method ``"swap"``, in cells: small for low visibility, large for a flat spectrum.
    tile_order : ``"search"`` or sequence of str
        Names of the colorants along a row of a tile or across the stripes, if not the least visible order.
    library : mapping of str to Colorant, optional
        What the names mean, with inks of your own; the built-in library by default.

    Raises
    ------
    InputError
        If a name is unknown, a colorant stands twice, or the numbers make no pattern.
    """
    if layout not in LAYOUTS:
        raise InputError(f"a pattern's layout must be one of {', '.join(LAYOUTS)}, got {layout!r}")
    names = tuple(colorants)
    if len(set(names)) != len(names):
        raise InputError(f"a pattern's colorants must be different, got {', '.join(names)}: name each once")
    order = tile_order if isinstance(tile_order, str) else tuple(tile_order)
    if shares is None and not isinstance(order, str) and set(order) == set(names):
        shares = [order.count(name) / len(order) for name in names]
    size_mm = (float(size_mm[0]), float(size_mm[1]))
    request = LayoutRequest(
        colorants_of(names, library),
        check_shares(shares, names),
        cells_that_cover(size_mm, dot_size_mm, angle_deg),
        seed,
        blue_noise,
        flatness,
        order,
    )
    pattern = Pattern(layout, names, LAYOUTS[layout](request), float(dot_size_mm), float(angle_deg), size_mm, seed)
    return pattern if library is None else replace(pattern, library=library)


def layout_recipe(pattern: Pattern, shares: Sequence[float] | None, blue_noise: str, flatness: float) -> dict[str, Any]:
    """The keywords of `make_pattern` that make a pattern's cells again, besides its own fields.

    Only what its layout looks at: tiles and stripes by the order that was found, so without searching again.

    Parameters
    ----------
    pattern : Pattern
        What `make_pattern` made.
    shares, blue_noise, flatness
        What it was asked for.
    """
    if pattern.layout in ("tiles", "stripes"):
        return {"tile_order": [pattern.colorants[k] for k in pattern.cells[0]]}
    if pattern.layout != "blue-noise":
        return {}
    recipe: dict[str, Any] = {"shares": list(shares)} if shares else {}
    recipe["blue_noise"] = blue_noise
    return recipe | ({"flatness": flatness} if blue_noise == "swap" else {})
