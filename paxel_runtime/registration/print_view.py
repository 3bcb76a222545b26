"""What a camera sees of a known print: ink shares, light that scatters in the paper between two passages, blur.

A forward model with a handful of numbers (`PrintOptics`), rendered on square windows of the camera's picture: light
passes ink, spreads in the paper, passes ink again (Clapper and Yule's optical dot gain), and is blurred by the
camera. Without the two passages every edge would be found a third of the scattering too far in the paper. Knows arrays;
must not know how the numbers are found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.registration.print_kernels import ink_shares
from paxel_runtime.registration.start import chebyshev_terms, degree_of

__all__ = [
    "Ink",
    "PrintOptics",
    "Windows",
    "camera_to_mm",
    "camera_to_mm_jacobian",
    "cut_windows",
    "lay_ink",
    "view",
    "view_slope",
]

_MARGIN_PX = 5
"""Camera pixels around a window that the blur reaches for."""
_LEAST_SIGMA = 0.1
"""Of a blur, fine samples: below it a sample is left as it is."""
_STEPS_A_DOT = 24
"""Fine samples along a dot, at least."""


@dataclass(frozen=True, eq=False)
class PrintOptics:
    """How a print looks, beside where its ink was meant to be.

    Attributes
    ----------
    spread_mm : float
        Growth of every edge of ink.
    scattering_mm : float
        Standard deviation of the light's spread in the paper.
    blur_px : float
        Standard deviation of the camera's blur, its pixels included, camera pixels.
    paper : (C,) float64 array
        Signal of bare paper in each channel.
    transmittance : (L, C) float64 array
        Of one passage through each ink; its square is the reflectance of a solid relative to the paper.
    offsets_mm : (L, 2) float64 array
        Displacement of each ink, the first being 0.
    """

    spread_mm: float
    scattering_mm: float
    blur_px: float
    paper: NDArray[np.float64]
    transmittance: NDArray[np.float64]
    offsets_mm: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Windows:
    """Square windows of a camera's picture.

    Attributes
    ----------
    middle : (n, 2) int64 array
        Camera column and row of each window's middle.
    half : int
        Camera pixels from the middle to the rim: a window has ``2 half + 1`` along each side.
    steps : int
        Fine samples a camera pixel, odd.
    """

    middle: NDArray[np.int64]
    half: int
    steps: int

    @staticmethod
    def fitting(middle: NDArray[np.int64], half: int, px_mm: float, dot_mm: float) -> Windows:
        """Windows with samples that are fine enough for dots of this size."""
        return Windows(middle, half, 2 * math.ceil(0.5 * (_STEPS_A_DOT * px_mm / dot_mm - 1.0)) + 1)

    @property
    def reach(self) -> int:
        """Fine samples from the middle to the rim, margin included."""
        return self.steps * (self.half + _MARGIN_PX)


def cut_windows(picture: NDArray[np.float32], windows: Windows) -> NDArray[np.float32]:
    """Pixels of the windows, (n, C, k, k), from a picture (h, w, C)."""
    offset = np.arange(-windows.half, windows.half + 1)
    rows = windows.middle[:, 1, None, None] + offset[:, None]
    columns = windows.middle[:, 0, None, None] + offset
    return np.ascontiguousarray(np.moveaxis(picture[rows, columns], -1, 1))


def camera_to_mm(
    coefficients: NDArray[np.float64], xy: NDArray[np.floating] | NDArray[np.integer], shape: tuple[int, int]
) -> NDArray[np.float64]:
    """Millimetres of the nominal pattern, (..., 2), at camera places (..., 2) in a picture of `shape` (h, w)."""
    x, y = np.moveaxis(np.asarray(xy, np.float64), -1, 0)
    terms = chebyshev_terms(x.ravel(), y.ravel(), shape[1], shape[0], degree_of(coefficients))
    return np.asarray(terms @ coefficients, np.float64).reshape(*x.shape, 2)


def camera_to_mm_jacobian(
    coefficients: NDArray[np.float64], xy: NDArray[np.floating] | NDArray[np.integer], shape: tuple[int, int]
) -> NDArray[np.float64]:
    """Derivative of `camera_to_mm` by camera column and row, (..., 2 mm, 2 px)."""
    step = np.array([[0.5, 0.0], [0.0, 0.5]])
    places = np.asarray(xy, np.float64)[..., None, :]
    ahead = camera_to_mm(coefficients, places + step, shape) - camera_to_mm(coefficients, places - step, shape)
    return np.swapaxes(ahead, -1, -2)


@dataclass(frozen=True, eq=False)
class Ink:
    """Ink in windows.

    Attributes
    ----------
    shares : (n, L, fine, fine) float32 array
        Share of each ink in the fine samples, margin included.
    px_mm : float
        Size of a camera pixel, mean of the windows.
    """

    shares: NDArray[np.float32]
    px_mm: float


def lay_ink(
    windows: Windows,
    coefficients: NDArray[np.float64],
    shape: tuple[int, int],
    optics: PrintOptics,
    tables: tuple[NDArray[np.uint16], NDArray[np.float64]],
) -> Ink:
    """Ink in windows of a camera's picture of `shape` (h, w), by the map and by spread and offsets of `optics`."""
    reach = windows.reach
    span = reach / windows.steps * np.array([-1.0, 0.0, 1.0])
    nodes = windows.middle[:, None, None, :] + np.stack(np.meshgrid(span, span), axis=-1)
    nodes_mm = camera_to_mm(coefficients, nodes, shape)
    px_mm = math.sqrt(abs(float(np.mean(np.linalg.det(_linear(nodes_mm, 2 * span[2]))))))
    sample_mm = px_mm / windows.steps
    return Ink(ink_shares(nodes_mm, 2 * reach + 1, *tables, optics.spread_mm, optics.offsets_mm, sample_mm), px_mm)


def view(windows: Windows, ink: Ink, optics: PrintOptics) -> NDArray[np.float32]:
    """The windows as the camera would see them, (n, C, k, k)."""
    sample, _ = _camera(windows, optics)
    return np.stack([sample @ light @ sample.T for light in _leaving(windows, ink, optics)], axis=1)


def view_slope(windows: Windows, ink: Ink, optics: PrintOptics) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """`view`, and its derivative by camera column and row, (2, n, C, k, k), 1/px."""
    sample, change = _camera(windows, optics)
    seen, across, down = [], [], []
    for light in _leaving(windows, ink, optics):
        rows = sample @ light
        seen.append(rows @ sample.T)
        across.append(rows @ change.T)
        down.append((change @ light) @ sample.T)
    slope = np.stack([np.stack(across, axis=1), np.stack(down, axis=1)])
    return np.stack(seen, axis=1), np.asarray(slope * windows.steps, np.float32)


def _leaving(windows: Windows, ink: Ink, optics: PrintOptics) -> Iterator[NDArray[np.float32]]:
    """Light that leaves the print in each channel, (n, fine, fine): ink, scattering, ink."""
    sigma = optics.scattering_mm / ink.px_mm * windows.steps
    scatter = _weights(windows.reach, windows.reach, 1, sigma)[0].astype(np.float32)
    for paper, transmittance in zip(optics.paper, optics.transmittance.T, strict=True):
        passage = 1.0 + np.tensordot(ink.shares, (transmittance - 1.0).astype(np.float32), axes=(1, 0))
        yield np.asarray(passage * (scatter @ passage @ scatter.T) * np.float32(paper), np.float32)


def _camera(windows: Windows, optics: PrintOptics) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Matrices from fine samples to camera pixels along one side: blur, and its derivative by place."""
    sigma = max(optics.blur_px * windows.steps, _LEAST_SIGMA)
    weights, distance = _weights(windows.steps * windows.half, windows.reach, windows.steps, sigma)
    return np.asarray(weights, np.float32), np.asarray(-weights * distance / sigma**2, np.float32)


def _linear(nodes_mm: NDArray[np.float64], span: float) -> NDArray[np.float64]:
    """Millimetres a camera pixel, (n, 2, 2), from nodes three by three."""
    across = (nodes_mm[:, 1, 2] - nodes_mm[:, 1, 0]) / span
    down = (nodes_mm[:, 2, 1] - nodes_mm[:, 0, 1]) / span
    return np.stack([across, down], axis=-1)


def _weights(out_reach: int, reach: int, step: int, sigma: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows of Gaussian weights that sum to 1, samples -reach..reach to every `step`-th of -out_reach..out_reach.

    Also the distances they are for.
    """
    distance = np.arange(-out_reach, out_reach + 1, step)[:, None] - np.arange(-reach, reach + 1.0)
    weights = np.exp(-0.5 * (distance / max(sigma, _LEAST_SIGMA)) ** 2)
    weights[weights < 1e-7] = 0.0  # numbers too small for float32's normal range slow the products down tenfold
    return weights / weights.sum(axis=1, keepdims=True), distance
