"""Assembly: what every pixel and cluster should get -> the projection image (paper: section V-A3)."""

from paxel_runtime.assembly.dither import assemble

__all__ = ["assemble"]
