"""What Paxel asks of a device: one method each. Adapters for real hardware and the virtual bench stand beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Camera", "Devices", "Operator", "Projector", "Spectroradiometer"]


class Projector(Protocol):
    """Shows frames."""

    def show(self, codes: NDArray[np.unsignedinteger]) -> None:
        """Show one frame until the next.

        Parameters
        ----------
        codes : (H, W, N) uint8 or uint16 array
            Device codes, 0 to 2**bits - 1, at native resolution, row 0 at the top.
        """
        ...


class Camera(Protocol):
    """Takes pictures of the wall."""

    def capture(self, channel: str | None = None) -> NDArray[np.uint16]:
        """Take one picture of what is shown.

        Parameters
        ----------
        channel : str, optional
            Name of the only projector channel that is lit: the picture then has one plane, and the exposure time
            that suits this channel. Without it, three planes and the exposure time that suits full white.

        Returns
        -------
        (h, w) or (h, w, 3) uint16 array
            Raw linear values, black level subtracted, 65535 = saturated.
        """
        ...


class Spectroradiometer(Protocol):
    """Reads the spectrum of one spot of the wall that covers many dots."""

    def measure(self) -> NDArray[np.float64]:
        """Spectral radiance of what is shown, (81,) on ``WAVELENGTHS_NM``, in the meter's own unit."""
        ...


class Operator(Protocol):
    """Whoever changes the surface and moves the meter: a person with a sheet of paper, or the virtual bench."""

    def place(self, surface: str) -> None:
        """Bring a surface under the projector; returns when it lies flat.

        Parameters
        ----------
        surface : str
            ``"pattern"``, ``"white"`` (the second surface), or ``"paper"`` (white paper, where that is another).
        """
        ...

    def aim(self, position_mm: tuple[float, float]) -> None:
        """Point the meter at a place of the wall; returns when it stands still.

        Parameters
        ----------
        position_mm : (x, y)
            Middle of its spot, from the centre of the projection, +x right, +y up.
        """
        ...


@dataclass(frozen=True)
class Devices:
    """The set of devices that one installation uses."""

    projector: Projector
    camera: Camera
    meter: Spectroradiometer
    operator: Operator
