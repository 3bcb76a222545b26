"""Pictures of single clusters, as they are seen from the projector: what the image-based model is made of (IV-C2).

Captures are asked for by name, one at a time; where they come from is not known here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import Exposure, exposure_name
from paxel_runtime.errors import CalibrationError
from paxel_runtime.registration import warp_to_nodal

__all__ = ["Captures", "NodalImages", "Window"]

Captures = Callable[[str], NDArray[np.uint16]]
Window = tuple[slice, slice]

_WHOLE = (slice(None), slice(None))


@dataclass(frozen=True, eq=False)
class NodalImages:
    """Where the light of each input is found in the captures.

    Attributes
    ----------
    captures : callable
        Gives the picture of an exposure by its name, (h, w) or (h, w, planes); asked for one at a time.
    plan : tuple of Exposure
        Its camera exposures of single clusters are used.
    channels, clusters : tuple of str
    camera_xy : dict of channel -> (H, W, 2) float32 array
    inside : (H, W) bool array
        Pixels that belong to a cluster.
    """

    captures: Captures
    plan: tuple[Exposure, ...]
    channels: tuple[str, ...]
    clusters: tuple[str, ...]
    camera_xy: Mapping[str, NDArray[np.float32]]
    inside: NDArray[np.bool_]

    def light(self, surface: str, i: int, j: int, window: Window = _WHOLE) -> NDArray[np.float32]:
        """(h, w, planes) float32: what the camera sees at each pixel with channel j on cluster i, without black."""
        channel, K = self.channels[j], len(self.clusters)
        name = next((e.name for e in self.plan if _lights(e, surface, K, i, channel)), None)
        if name is None:
            raise CalibrationError(
                f"an image-based model needs a picture of {channel} on cluster {self.clusters[i]} on the {surface}, "
                "and the plan has none; run: paxel capture"
            )
        return self._nodal(name, channel, window) - self.dark(surface, j, window)

    def dark(self, surface: str, j: int, window: Window = _WHOLE) -> NDArray[np.float32]:
        """(h, w, planes): the same with nothing lit, at the exposure time of channel j."""
        return self._nodal(exposure_name(surface, "dark", self.channels[j], self.channels), self.channels[j], window)

    def full(self, surface: str, j: int, window: Window = _WHOLE) -> NDArray[np.float32]:
        """(h, w, planes): channel j everywhere, without black."""
        name = exposure_name(surface, "full", self.channels[j], self.channels)
        return self._nodal(name, self.channels[j], window) - self.dark(surface, j, window)

    def _nodal(self, name: str, channel: str, window: Window) -> NDArray[np.float32]:
        picture = self.captures(name)
        picture = picture if picture.ndim == 3 else picture[..., None]
        table = self.camera_xy[channel][window]
        return np.stack([warp_to_nodal(plane.astype(np.float32), table) for plane in np.moveaxis(picture, -1, 0)], -1)


def _lights(exposure: Exposure, surface: str, K: int, i: int, channel: str) -> bool:
    if (exposure.device, exposure.surface, exposure.clusters) != ("camera", surface, K):
        return False
    return exposure.channel == channel and [max(row) > 0 for row in exposure.P] == [m == i for m in range(K)]
