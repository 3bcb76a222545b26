"""Inversion: wanted colours on both surfaces -> linear inputs x (Eqs. 5 and 7 of the paper)."""

from paxel_runtime.inversion.frame_plan import AffineMapping, FramePlan, frame_to_codes, plan_frame
from paxel_runtime.inversion.solver import CAPPED, EXACT, OPTIMUM, Inversion, invert
from paxel_runtime.inversion.table import ColourTable, MappingTable, build_mapping_table, build_table, look_up

__all__ = [
    "CAPPED",
    "EXACT",
    "OPTIMUM",
    "AffineMapping",
    "ColourTable",
    "FramePlan",
    "Inversion",
    "MappingTable",
    "build_mapping_table",
    "build_table",
    "frame_to_codes",
    "invert",
    "look_up",
    "plan_frame",
]
