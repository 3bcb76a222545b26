"""The image-based model: A at every pixel, from pictures of each cluster lit alone in each channel (Eq. 4; IV-C2).

The camera sees what one reading cannot: fall-off, defocus and uneven ink over the whole field. Each nodal image is
blurred until neighbouring clusters are mixed, then taken to XYZ by a matrix. Pure functions from captures to fields,
one field in memory at a time; files are written elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.calibration.camera_color import CameraToXYZ
from paxel_runtime.calibration.cluster_pictures import NodalImages
from paxel_runtime.errors import InputError

__all__ = ["Fields", "image_fields", "kernel_sigma_px"]

_TRUNCATE = 3.0


@dataclass(frozen=True, eq=False)
class Fields:
    """One part of the image-based model.

    Attributes
    ----------
    surface : str
    input : int or None
        Its place in x; None for the black level.
    XYZ : (H, W, 3) float32 array
        Y = 1 for full white on the white surface at the middle; 0 where no pixel of a cluster is near.
    """

    surface: str
    input: int | None
    XYZ: NDArray[np.float32]


def kernel_sigma_px(dot_px: float, colorants: int) -> float:
    """Standard deviation of the Gaussian that mixes neighbouring clusters (IV-C2), projector pixels.

    A pattern of M colorants repeats within about sqrt(M) dots, which is the sigma: of a period of that length it leaves
    exp(-2 pi^2) = 3e-9, of one three times as long, as irregular layouts have them, 11 %. A wider kernel loses the
    fall-off at the frame's edges.

    Parameters
    ----------
    dot_px : float
        Edge of a dot in projector pixels.
    colorants : int
    """
    if not dot_px > 0 or colorants < 1:
        raise InputError(f"a kernel needs dots larger than 0 px and a colorant, got {dot_px} and {colorants}")
    return dot_px * float(np.sqrt(colorants))


def image_fields(
    images: NodalImages,
    conversion: CameraToXYZ,
    sigma_px: float,
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[Fields]:
    """A and black at every pixel, one input of one surface at a time (Eq. 4).

    Memory: some planes of the projector's size, and one capture.

    Parameters
    ----------
    conversion : CameraToXYZ
        From `camera_to_XYZ`.
    sigma_px : float
        From `kernel_sigma_px`.
    """
    blur = _Blur(images.inside, sigma_px)
    K, N = len(images.clusters), len(images.channels)
    for surface, of_inputs in conversion.inputs.items():
        of_black = conversion.black[surface]
        for k in range(K * N):
            i, j = divmod(k, N)
            progress(f"image-based model: {surface}, {images.channels[j]} on {images.clusters[i]}")
            yield Fields(surface, k, blur(images.light(surface, i, j), of_inputs[k]))
        black = blur(images.dark(surface, 0), of_black[0])
        for j in range(1, N):
            black += blur(images.dark(surface, j), of_black[j])
        yield Fields(surface, None, black)


class _Blur:
    """Gaussian mean over the pixels inside, then a matrix."""

    def __init__(self, inside: NDArray[np.bool_], sigma_px: float) -> None:
        self.inside, self.sigma_px = inside, sigma_px
        weights = self._gaussian(inside.astype(np.float32))
        self.reciprocal = np.divide(1.0, weights, out=np.zeros_like(weights), where=weights > 1e-3)

    def __call__(self, nodal: NDArray[np.float32], matrix: NDArray[np.float64]) -> NDArray[np.float32]:
        planes = [
            self._gaussian(np.where(self.inside, plane, np.float32(0))) * self.reciprocal
            for plane in np.moveaxis(nodal, -1, 0)
        ]
        return np.stack(planes, axis=-1) @ matrix.T.astype(np.float32)

    def _gaussian(self, plane: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.asarray(gaussian_filter(plane, self.sigma_px, mode="constant", truncate=_TRUNCATE))
