"""Moire: how a layout beats against a projector's raster, before anything is printed.

Pixels are sorted by what they light of the print, one cluster is lit (the paper's Fig. 12), and what the print returns
is averaged over each pixel. Whatever of that is slower than the print itself is the moire, in threshold units of the
eye. Simulated within the pixels of a piece of the projection; shares no code with the virtual bench, which is there to
check it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.special import erf

from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_design.visibility.sensitivity import cycles_per_degree, luminance_sensitivity
from paxel_design.visibility.spectrum import layout_spectrum
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

__all__ = ["SLOW_SHARE", "Beat", "Moire", "beats", "moire", "moire_picture", "worst_moire"]

SLOW_SHARE = 0.35
"""Moire is what is slower than this many cycles a dot: half the fundamental of a checkerboard."""

_BLUR_PX = 0.36
"""Sigma of a projector pixel's own blur besides its square: a common lens in focus."""

_LINES = 60
"""Strongest lines of a layout that beats are looked for among."""

_FIBONACCI = (8, 13, 21, 34, 55, 89, 144, 233, 377, 610, 987)


@dataclass(frozen=True)
class Beat:
    """One beat of a layout's line with the raster.

    Attributes
    ----------
    period_mm, direction_deg : float
        Distance from stripe to stripe, and the direction across them, counter-clockwise from +x.
    orders : (int, int)
        Of the raster, along x and y, that the line was folded by.
    line_per_mm : (float, float)
        The sum of two of the layout's lines.
    strength : float
        Product of the contrasts of the two.
    """

    period_mm: float
    direction_deg: float
    orders: tuple[int, int]
    line_per_mm: tuple[float, float]
    strength: float


@dataclass(frozen=True)
class Moire:
    """The slow part of what a lit cluster shows.

    Attributes
    ----------
    contrast : float
        Root mean square over the mean, of frequencies below `SLOW_SHARE` cycles a dot.
    visibility : float
        In threshold units at the distance: 1 is just seen.
    period_mm : float
        Of the component that is seen best.
    """

    contrast: float
    visibility: float
    period_mm: float


def moire(
    pattern: Pattern,
    pitch_mm: float,
    distance_mm: float,
    *,
    K: int = 2,
    luminance_cd_m2: float = 100.0,
    offset_px: tuple[float, float] = (0.0, 0.0),
    size_px: int = 384,
    samples: int = 89,
    blur_px: float = _BLUR_PX,
) -> Moire:
    """How much a layout beats against a raster of some pitch.

    Parameters
    ----------
    pattern : Pattern
    pitch_mm : float
        Width of a projector pixel on the wall.
    distance_mm, luminance_cd_m2 : float
        Of the viewer, and of the lit print.
    K : int
        Clusters: as many as colorants, or one more, of pixels on edges (2 or 3 for two colorants).
    offset_px : (float, float)
        Phase of the raster against the print.
    size_px : int
        Edge of the simulated piece; beats slower than a quarter of it are not resolved.
    samples : int
        Samples of the print in a pixel, 13 to 987; the next Fibonacci number is taken.
    blur_px : float
        Sigma of the projector's blur, pixels.

    Raises
    ------
    InputError
        If a length is not positive, or K is neither the number of colorants nor one more.
    """
    view = moire_picture(pattern, pitch_mm, K=K, offset_px=offset_px, size_px=size_px, samples=samples,
                         blur_px=blur_px)  # fmt: skip
    window = np.hanning(size_px + 2)[1:-1]
    window2 = window[:, None] * window[None]
    mean = float((view * window2).sum() / window2.sum())
    if not mean > 0:
        return Moire(0.0, 0.0, np.inf)
    spectrum = np.fft.rfft2((view / mean - 1.0) * window2)
    fx = np.fft.rfftfreq(size_px, pitch_mm)
    fy = np.fft.fftfreq(size_px, pitch_mm)
    radius = np.hypot(fy[:, None], fx[None])
    twice = np.where((fx == 0) | (2 * np.arange(len(fx)) == size_px), 1.0, 2.0)[None]
    variance = twice * np.abs(spectrum) ** 2 / (window2**2).sum() / size_px**2
    slow = (radius < SLOW_SHARE / pattern.dot_size_mm) & (radius > 1.5 / (size_px * pitch_mm))
    sensitivity = luminance_sensitivity(cycles_per_degree(radius, distance_mm), luminance_cd_m2)
    seen = np.where(slow, variance * sensitivity**2, 0.0)
    peak = np.unravel_index(int(np.argmax(seen)), seen.shape)
    return Moire(
        float(np.sqrt(variance[slow].sum())),
        float(np.sqrt(2 * seen.sum())),
        float(1 / radius[peak]) if seen[peak] > 0 else np.inf,
    )


def moire_picture(
    pattern: Pattern,
    pitch_mm: float,
    *,
    K: int = 2,
    offset_px: tuple[float, float] = (0.0, 0.0),
    size_px: int = 384,
    samples: int = 89,
    blur_px: float = _BLUR_PX,
) -> NDArray[np.float64]:
    """Luminance of the print with its brightest cluster lit, averaged over each pixel, (size_px, size_px).

    1 is bare paper under full light. Parameters and errors as `moire`.
    """
    colorants = len(pattern.colorants)
    if not (pitch_mm > 0 and blur_px >= 0 and size_px >= 16 and samples >= 8):
        raise InputError(
            "moire needs pitch_mm > 0, blur_px >= 0, size_px >= 16 and samples >= 8, got "
            f"{pitch_mm}, {blur_px}, {size_px}, {samples}"
        )
    if K not in (colorants, colorants + 1):
        raise InputError(f"moire takes K = {colorants} or {colorants + 1} for {colorants} colorants, got {K}")
    Y = colorants_to_XYZ(pattern.palette)[:, 1]
    bright = int(np.argmax(Y))
    places, weights = _samples(samples, blur_px)
    angle = np.deg2rad(pattern.angle_deg)
    scale = np.array([np.cos(angle), np.sin(angle)]) * pitch_mm / pattern.dot_size_mm
    share, light = _shares(
        pattern.cells, Y, bright, scale[0], scale[1], np.array(offset_px), size_px + 4, places, weights
    )
    # what each pixel lights: its own light's share on the brightest colorant, 3 x 3 pixels around it
    lit_share = _gather(share)
    lit = lit_share > (0.5 if colorants == K else 0.75)
    return np.ascontiguousarray(_spread(lit.astype(np.float64), light)[2:-2, 2:-2])


def worst_moire(
    pattern: Pattern,
    pitches_mm: Iterable[float],
    distance_mm: float,
    *,
    K: int = 2,
    luminance_cd_m2: float = 100.0,
    phases: int = 2,
    size_px: int = 384,
    samples: int = 89,
) -> Moire:
    """The most visible moire over pitches and phases: nobody sets a projector's zoom to a tenth of a percent.

    Parameters
    ----------
    pitches_mm : iterable of float
    phases : int
        Offsets of the raster along the diagonal of a pixel, evenly spaced.
    pattern, distance_mm, K, luminance_cd_m2, size_px, samples : see `moire`
    """
    found = [
        moire(
            pattern,
            pitch,
            distance_mm,
            K=K,
            luminance_cd_m2=luminance_cd_m2,
            offset_px=(k / phases, 0.6 * k / phases),
            size_px=size_px,
            samples=samples,
        )
        for pitch in pitches_mm
        for k in range(phases)
    ]
    return max(found, key=lambda m: m.visibility)


def beats(pattern: Pattern, pitch_mm: float, count: int = 6, orders: int = 3) -> list[Beat]:
    """The slow beats of a layout with the raster, strongest first: why a picture shows stripes where it does.

    Which pixels are lit is one of the layout's lines folded by the raster, and the print multiplies it by another: so
    sums of two lines beat with multiples of the raster's frequency. An estimate of places; `moire` has the contrast.

    Parameters
    ----------
    pitch_mm : float
    count : int
        How many at most.
    orders : int
        Largest order of the raster, along x and y.
    """
    spectrum = layout_spectrum(pattern)
    strongest = np.argsort(spectrum.contrast)[::-1][:_LINES]
    lines = np.concatenate([spectrum.frequency_per_mm[strongest], -spectrum.frequency_per_mm[strongest]])
    contrast = np.tile(spectrum.contrast[strongest], 2)
    found: dict[tuple[int, int], Beat] = {}
    for a, b in combinations_with_replacement(range(len(lines)), 2):
        f = lines[a] + lines[b]
        m = np.rint(f * pitch_mm).astype(int)
        slow = f - m / pitch_mm
        length = float(np.hypot(*slow))
        if not m.any() or np.abs(m).max() > orders or not 1e-6 < length < SLOW_SHARE / pattern.dot_size_mm:
            continue
        if slow[0] < 0 or (slow[0] == 0 and slow[1] < 0):
            f, m, slow = -f, -m, -slow
        place = (round(float(slow[0]) * 1e4), round(float(slow[1]) * 1e4))
        strength = float(contrast[a] * contrast[b])
        if place not in found or strength > found[place].strength:
            direction = float(np.rad2deg(np.arctan2(slow[1], slow[0])))
            found[place] = Beat(1 / length, direction, (int(m[0]), int(m[1])), (float(f[0]), float(f[1])), strength)
    return sorted(found.values(), key=lambda beat: -beat.strength)[:count]


def _samples(samples: int, blur_px: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places in a pixel, (n, 2) row and column in 0..1, and there the light of each of the 3 x 3 pixels around, (n, 9).

    A Fibonacci lattice: along a row or a column no two places coincide, so that edges that follow the raster are met as
    finely as others. Each pixel's light sums to 1.
    """
    n = next(f for f in _FIBONACCI if f >= samples or f == _FIBONACCI[-1])
    step = _FIBONACCI[_FIBONACCI.index(n) - 1]
    i = np.arange(n)
    places = np.stack([(i + 0.5) / n, (i * step % n + 0.5) / n], axis=1)
    # the pixel above sees this place one pixel below its own
    along = np.stack([_pixel_light(places + 0.5 + shift, blur_px) for shift in (0, -1, -2)], axis=1)
    weights = (along[:, :, None, 0] * along[:, None, :, 1]).reshape(n, 9)
    return places, weights / weights.sum()


def _pixel_light(t: NDArray[np.float64], blur_px: float) -> NDArray[np.float64]:
    """Light along one axis of a pixel that lies from -0.5 to 0.5, at distance t from its middle, in pixels."""
    if blur_px == 0:
        return (np.abs(t) < 0.5).astype(np.float64)
    width = np.sqrt(2) * blur_px
    return np.asarray(0.5 * (erf((t + 0.5) / width) - erf((t - 0.5) / width)))


@njit(cache=True, parallel=True, error_model="numpy")
def _shares(
    cells: NDArray[np.uint8],
    Y: NDArray[np.float64],
    bright: int,
    c: float,
    s: float,
    offset: NDArray[np.float64],
    size: int,
    places: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of every pixel's area: light of each of the 3 x 3 pixels around it that meets the bright colorant, or returns.

    Both (size, size, 9); entry 3 a + b is the light of the pixel at row a - 1, column b - 1 from it.
    """
    rows, columns = cells.shape
    share = np.zeros((size, size, 9))
    light = np.zeros((size, size, 9))
    for r in prange(size):
        for q in range(size):
            for k in range(len(places)):
                y = 0.5 * size - r - places[k, 0] - offset[1]  # +y up
                x = q + places[k, 1] + offset[0] - 0.5 * size
                column = int(np.floor(c * x + s * y)) % columns
                row = int(np.floor(c * y - s * x)) % rows
                label = cells[row, column]
                for m in range(9):
                    light[r, q, m] += weights[k, m] * Y[label]
                if label == bright:
                    for m in range(9):
                        share[r, q, m] += weights[k, m]
    return share, light


def _gather(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each pixel's own light, summed over the 3 x 3 areas it falls on, (size, size)."""
    own = np.zeros(share.shape[:2])
    for a in range(3):
        for b in range(3):
            # of the area at (r + da, q + db), the light of the pixel at (-da, -db) from it
            own += np.roll(share[..., 3 * (2 - a) + (2 - b)], (1 - a, 1 - b), axis=(0, 1))
    return own


def _spread(lit: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.float64]:
    """What every pixel's area returns when some pixels are lit, (size, size)."""
    seen = np.zeros(lit.shape)
    for a in range(3):
        for b in range(3):
            seen += np.roll(lit, (1 - a, 1 - b), axis=(0, 1)) * light[..., 3 * a + b]
    return seen
