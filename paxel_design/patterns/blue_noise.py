"""Blue noise: dots strewn without period and without low frequencies (paper, section VI-A and Fig. 12b).

The method is named, since they differ: ``"swap"`` takes any colorants and shares and has the one knob `flatness`;
``"zhou-fang"`` is error diffusion of a whole sheet, as the paper's; ``"void-and-cluster"`` is the textbook's.
Floyd-Steinberg and Ostromoukhov are left out on purpose: at exactly 50 % they give a checkerboard
(``reports/blue_noise_methods.py``).
"""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from paxel_design.patterns.request import LayoutRequest
from paxel_design.patterns.swap import swap_blue_noise
from paxel_design.patterns.void_and_cluster import void_and_cluster
from paxel_design.patterns.zhou_fang import zhou_fang
from paxel_runtime.errors import InputError

__all__ = ["BLUE_NOISE", "blue_noise"]

BLUE_NOISE: MappingProxyType[str, Callable[[LayoutRequest], NDArray[np.uint8]]] = MappingProxyType(
    {"swap": swap_blue_noise, "zhou-fang": zhou_fang, "void-and-cluster": void_and_cluster}
)
"""Every method by its name in ``paxel.toml``."""


def blue_noise(request: LayoutRequest) -> NDArray[np.uint8]:
    """Cells of blue noise by the method ``request.blue_noise``.

    Raises
    ------
    InputError
        If the method is unknown or cannot do what is asked.
    """
    if request.blue_noise not in BLUE_NOISE:
        raise InputError(f"a pattern's blue_noise must be one of {', '.join(BLUE_NOISE)}, got {request.blue_noise!r}")
    return BLUE_NOISE[request.blue_noise](request)
