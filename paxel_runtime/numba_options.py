"""Compiler options that several kernel files share."""

from __future__ import annotations

from typing import Any

__all__ = ["INLINED"]

INLINED: dict[str, Any] = {
    "cache": True,
    "error_model": "numpy",  # a division that may raise keeps a loop from being vectorised
    "fastmath": {"contract"},
    "forceinline": True,
    "no_cpython_wrapper": True,  # only kernels call these: half of the time to compile them
    "no_cfunc_wrapper": True,
}
"""For small functions on numbers and tuples that are inlined into the loop over SIMD lanes."""
