"""Inversion: wanted colours on both surfaces -> linear inputs x (Eqs. 5 and 7 of the paper)."""

from paxel_runtime.inversion.solver import CAPPED, EXACT, OPTIMUM, Inversion, invert

__all__ = ["CAPPED", "EXACT", "OPTIMUM", "Inversion", "invert"]
