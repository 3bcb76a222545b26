"""A `Pattern` as the JSON object of ``pattern.json``, and back; the cells travel apart, as ``cells.png``.

Only the form is known here: who reads and writes the two files compares the hash and names the writer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

__all__ = ["pattern_from_json_dict", "pattern_to_json_dict"]

SCHEMA = "paxel-pattern"
VERSION = 1


def pattern_to_json_dict(
    pattern: Pattern, cells_sha256: str, recipe: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Describe a pattern with plain JSON values.

    Parameters
    ----------
    pattern : Pattern
        The pattern; `Pattern.cells` is not part of the result.
    cells_sha256 : str
        SHA-256 of the file with the cells, in hexadecimal: one 8-bit plane, its first row = row 0 = the lowest.
    recipe : mapping, optional
        What the layout was asked for beyond the pattern's own fields, to make the same cells again.
    """
    rows, columns = pattern.cells.shape
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "layout": pattern.layout,
        "colorants": list(pattern.colorants),
        "dot_size_mm": pattern.dot_size_mm,
        "angle_deg": pattern.angle_deg,
        "size_mm": list(pattern.size_mm),
        "seed": pattern.seed,
        "recipe": dict(recipe or {}),
        "shares": {name: float(share) for name, share in zip(pattern.colorants, pattern.shares(), strict=True)},
        "cells": {"rows": rows, "columns": columns, "first_row": "lowest", "sha256": cells_sha256},
    }


def pattern_from_json_dict(description: Mapping[str, Any], cells: NDArray[np.uint8]) -> Pattern:
    """Inverse of `pattern_to_json_dict`, given the cells; keys that it does not know are left alone.

    Raises
    ------
    InputError
        If the object is not a pattern of a version known here, lacks a key, holds a value that is no number or
        name where one belongs, or does not belong to `cells`.
    """
    found = (description.get("schema"), description.get("version"))
    if found != (SCHEMA, VERSION):
        raise InputError(
            f"pattern.json: schema and version must be {SCHEMA!r}, {VERSION}, got {found[0]!r}, {found[1]!r}: "
            "make the pattern anew with this version"
        )
    try:
        shape = (description["cells"]["rows"], description["cells"]["columns"])
        width_mm, height_mm = description["size_mm"]
        pattern = Pattern(
            layout=str(description["layout"]),
            colorants=tuple(str(name) for name in description["colorants"]),
            cells=cells,
            dot_size_mm=float(description["dot_size_mm"]),
            angle_deg=float(description["angle_deg"]),
            size_mm=(float(width_mm), float(height_mm)),
            seed=int(description["seed"]),
        )
    except InputError:
        raise
    except KeyError as error:
        raise InputError(f"pattern.json: the key {error} is missing: make the pattern anew") from error
    except (TypeError, ValueError) as error:
        raise InputError(f"pattern.json: a value has the wrong form ({error}): make the pattern anew") from error
    if shape != cells.shape:
        raise InputError(
            f"pattern.json: cells must be {shape[0]} x {shape[1]}, got {cells.shape}: "
            "the file of cells belongs to another pattern"
        )
    return pattern
