"""The QR code of a sheet: the pattern's parameters and the hash of its cells, as JSON that can be read back.

The text is one JSON object without spaces::

    {"schema": "paxel-sheet", "version": 1, "layout": "checkerboard", "colorants": ["black", "white"],
     "dot_size_mm": 0.75, "angle_deg": 30.0, "size_mm": [600.0, 400.0], "seed": 0,
     "cells_sha256": "<64 hexadecimal digits>"}

and, where they were not the defaults, ``shares``, ``blue_noise``, ``flatness`` and ``tile_order``, as in the
``[pattern]`` table of ``paxel.toml``. The hash is the SHA-256 of the cells alone, one byte each, the lowest row
first; the cells are made again from the parameters, so a sheet found in a drawer tells which pattern it is.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns import make_pattern
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant, Pattern

__all__ = ["RECIPE_KEYS", "cells_sha256", "code_modules", "code_text", "pattern_of_code"]

SCHEMA = "paxel-sheet"
VERSION = 1

RECIPE_KEYS = ("shares", "blue_noise", "flatness", "tile_order")
"""What a layout may have been asked for beyond the fields of `Pattern`: keywords of `make_pattern`."""

_MOST_BYTES = 858
"""Version 20 at error correction L, 97 modules. Every reader tried took codes up to version 13 (425 bytes)."""


def cells_sha256(cells: NDArray[np.uint8]) -> str:
    """SHA-256 of the cells, one byte each, row 0 (the lowest) first, in hexadecimal."""
    return hashlib.sha256(np.ascontiguousarray(cells, np.uint8).tobytes()).hexdigest()


def code_text(pattern: Pattern, recipe: Mapping[str, Any] | None = None) -> str:
    """The JSON text that stands in the code.

    Parameters
    ----------
    pattern : Pattern
    recipe : mapping, optional
        The further keywords of `make_pattern` that the cells were made with, keys of `RECIPE_KEYS`; None values are
        left out.

    Raises
    ------
    InputError
        If `recipe` has another key, or the text is longer than 858 bytes.
    """
    wanted = {key: value for key, value in (recipe or {}).items() if value is not None}
    if unknown := [key for key in wanted if key not in RECIPE_KEYS]:
        raise InputError(f"a pattern's recipe may hold {', '.join(RECIPE_KEYS)}, got {', '.join(unknown)}")
    text = json.dumps(
        {
            "schema": SCHEMA,
            "version": VERSION,
            "layout": pattern.layout,
            "colorants": list(pattern.colorants),
            "dot_size_mm": pattern.dot_size_mm,
            "angle_deg": pattern.angle_deg,
            "size_mm": list(pattern.size_mm),
            "seed": pattern.seed,
            "cells_sha256": cells_sha256(pattern.cells),
            **{key: wanted[key] for key in RECIPE_KEYS if key in wanted},
        },
        separators=(",", ":"),
    )
    if len(text) > _MOST_BYTES:
        raise InputError(
            f"a sheet's code must hold at most {_MOST_BYTES} bytes, got {len(text)}: give the colorants shorter names"
        )
    return text


def code_modules(text: str) -> tuple[str, ...]:
    """The modules of the QR code of a text, rows from the top, ``#`` is black; without its quiet zone.

    The smallest version, at least error correction L: some readers fail on large versions sooner than on dirt.
    """
    import segno  # 60 ms of tables: only a sheet needs it

    rows = segno.make(text, error="l", micro=False, boost_error=True).matrix
    return tuple("".join("#" if dark else "." for dark in row) for row in rows)


def pattern_of_code(text: str, library: Mapping[str, Colorant] | None = None) -> Pattern:
    """The pattern that a decoded code describes, its cells made anew.

    Parameters
    ----------
    text : str
        What `code_text` made.
    library : mapping of str to Colorant, optional
        What the names mean, with inks of your own, whose spectra the code does not hold; the built-in by default.

    Raises
    ------
    InputError
        If the text is no code of a sheet, describes no pattern, or the cells that come out have another hash.
    """
    try:
        found = json.loads(text)
    except ValueError as error:
        raise InputError(f"a sheet's code must be a JSON object, got {text[:40]!r}...: scan it again") from error
    if not isinstance(found, dict) or (found.get("schema"), found.get("version")) != (SCHEMA, VERSION):
        raise InputError(f"a sheet's code must have schema {SCHEMA!r}, version {VERSION}, got {text[:60]!r}...")
    try:
        recipe = {key: found[key] for key in RECIPE_KEYS if key in found}
        pattern = make_pattern(
            found["layout"],
            found["colorants"],
            found["dot_size_mm"],
            found["angle_deg"],
            found["size_mm"],
            found["seed"],
            library=library,
            **recipe,
        )
        wanted = found["cells_sha256"]
    except KeyError as error:
        raise InputError(f"a sheet's code lacks the key {error}: scan it again") from error
    except TypeError as error:
        raise InputError(f"a sheet's code holds a value of the wrong form ({error}): scan it again") from error
    found_sha256 = cells_sha256(pattern.cells)
    if found_sha256 != wanted:
        raise InputError(
            f"a sheet's code must give the cells it names ({wanted[:16]}...), got {found_sha256[:16]}...: "
            "the sheet was made by another version of Paxel, or from a recipe that is not in the code"
        )
    return pattern
