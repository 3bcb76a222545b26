"""Assembly: what every pixel and cluster should get -> the projection image (paper: section V-A3)."""

from paxel_runtime.assembly.assemble import METHODS, AssemblyOptions, assemble
from paxel_runtime.assembly.codes import intensities_to_codes
from paxel_runtime.assembly.combine import combine
from paxel_runtime.assembly.coverage import spread_coverage
from paxel_runtime.assembly.dither import dither
from paxel_runtime.assembly.refine import refine

__all__ = [
    "METHODS",
    "AssemblyOptions",
    "assemble",
    "combine",
    "dither",
    "intensities_to_codes",
    "refine",
    "spread_coverage",
]
