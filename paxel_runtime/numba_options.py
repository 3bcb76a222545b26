"""Compiler options that several kernel files share, chosen so that a first call does not wait long for the compiler.

A function compiles once for each combination of argument types, and integers written in a call are types of their own;
wrappers for callers outside of numba take a tenth to a half of the time. So: arrays of one type, constants by name, and
no wrapper that nobody calls. ``reports/compile_times.py`` tells what each kernel takes.
"""

from __future__ import annotations

from typing import Any

__all__ = ["CALLED", "INLINED", "KERNEL"]

KERNEL: dict[str, Any] = {
    "cache": True,
    "nogil": True,  # threads share pictures
    "error_model": "numpy",  # a division that may raise keeps a loop from being vectorised
    "no_cfunc_wrapper": True,
}
"""For functions that Python calls."""

CALLED: dict[str, Any] = {"cache": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""For functions that only kernels call."""

INLINED: dict[str, Any] = {**CALLED, "fastmath": {"contract"}, "forceinline": True}
"""For small functions on numbers and tuples that are inlined into the loop over SIMD lanes."""
