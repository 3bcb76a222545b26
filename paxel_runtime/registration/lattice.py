"""Where a picture of a print lies on its own pattern, from nothing but the print: the start of the design registration.

Scale and angle from the peaks of the spectrum, where the pattern repeats (checkerboard, tiles, stripes), else by
trial; the phase by correlation with the cells over their torus. Knows one patch of picture, sampled in nominal
millimetres; must not know cameras or captures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.ndimage import map_coordinates

from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.pattern import Pattern

__all__ = ["Patch", "find_lattice", "sharpen_lattice"]

_SAMPLES, _FEWER_SAMPLES, _MANY_CELLS = 4, 2, 60_000
"""Samples a cell in the correlation; fewer for a pattern of many cells."""
_SCALE = 0.15
_ANGLE_DEG = 15.0
"""How far scale and angle are searched around their nominal values."""
_PEAKS = 16
_PEAKY = 0.5
"""Share of a pattern's power in its strongest peaks from which on they are looked for."""
_LEAST_SCORE = 0.5
"""Correlation with the pattern below which it is not found: an accident stays below 0.4 with 100 cells and more."""
_FEW_CELLS = 12.0
_NEARER = 0.05
"""Correlation that a place may be worse, a cell that it is nearer to where it is expected."""


@dataclass(frozen=True, eq=False)
class Patch:
    """A square of picture.

    Attributes
    ----------
    picture : (n, n, C) float64 array
        Row 0 is the highest (+y), as in a picture.
    step_mm : float
        Nominal millimetres from one sample to the next.
    """

    picture: NDArray[np.float64]
    step_mm: float


def find_lattice(patch: Patch, pattern: Pattern, colors: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Similarity that takes nominal millimetres about the patch's middle to millimetres of the pattern.

    Parameters
    ----------
    patch : Patch
        At least 16 cells wide.
    pattern : Pattern
    colors : (M, C) array
        Expected signal of each colorant, on any scale.

    Returns
    -------
    similarity : (2, 3) float64 array
    score : float
        Correlation of the patch with the pattern there, up to 1.

    Raises
    ------
    CalibrationError
        If the pattern is not found.
    """
    weights = pattern.shares() / pattern.shares().sum()
    colors = colors - weights @ colors
    strengths, frequencies = _harmonics(pattern, colors)
    if np.sum(strengths[:_PEAKS]) > _PEAKY * np.sum(strengths):
        scale, angle = _match_spectrum(patch, pattern, strengths[:_PEAKS], frequencies[:_PEAKS])
        score, similarity = _correlate(patch, pattern, _nominal(pattern, colors), scale, angle, math.inf)
    else:
        score, similarity = _match_by_trial(patch, pattern, colors)
    _require(score)
    return similarity, score


def sharpen_lattice(
    patch: Patch, pattern: Pattern, colors: NDArray[np.float64], rough: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """`find_lattice` from a rough affine map (2, 3): its scale and angle are kept, its shift sharpened.

    Of all places where a pattern that repeats fits alike, the one nearest to the rough map is taken.
    """
    weights = pattern.shares() / pattern.shares().sum()
    scale = math.sqrt(abs(float(np.linalg.det(rough[:, :2]))))
    angle = math.atan2(rough[0, 1] - rough[1, 0], rough[0, 0] + rough[1, 1])
    score, similarity = _correlate(
        patch, pattern, _nominal(pattern, colors - weights @ colors), scale, angle, _FEW_CELLS, rough[:, 2]
    )
    _require(score)
    return similarity, score


def _require(score: float) -> None:
    if score < _LEAST_SCORE:
        raise CalibrationError(
            f"the printed pattern must be found in the picture with a correlation of {_LEAST_SCORE} or more, got "
            f"{score:.2f}: is it the pattern of pattern.json, in focus, and is projector.width_mm right to 15 %? "
            "Otherwise give its corners in the picture: [clusters] corners_px"
        )


def _harmonics(pattern: Pattern, colors: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power (n,) and frequency (n, 2) (columns, rows; cycles a cell) of the pattern, strongest first, half a plane."""
    rows, columns = pattern.cells.shape
    spectrum = np.zeros((rows, columns))
    for channel in colors.T:
        spectrum += np.abs(np.fft.fft2(channel[pattern.cells])) ** 2
    fy, fx = np.meshgrid(np.fft.fftfreq(rows), np.fft.fftfreq(columns), indexing="ij")
    power, frequency = [], []
    for down in (-1, 0, 1):  # square cells repeat the spectrum beyond half a cycle, under a sinc
        for right in (-1, 0, 1):
            gx, gy = fx + right, fy + down
            power.append((spectrum * np.sinc(gx) ** 2 * np.sinc(gy) ** 2).ravel())
            frequency.append(np.stack([gx.ravel(), gy.ravel()], axis=-1))
    all_power, all_frequency = np.concatenate(power), np.concatenate(frequency)
    half = (all_frequency[:, 1] > 1e-9) | ((np.abs(all_frequency[:, 1]) <= 1e-9) & (all_frequency[:, 0] > 1e-9))
    order = np.argsort(-all_power[half], kind="stable")
    return all_power[half][order], all_frequency[half][order]


def _match_spectrum(
    patch: Patch, pattern: Pattern, strengths: NDArray[np.float64], frequencies: NDArray[np.float64]
) -> tuple[float, float]:
    """Scale and angle (radians) of the patch's lattice against the nominal one."""
    n = patch.picture.shape[0]
    window = np.hanning(n + 2)[1:-1]
    size = 2 ** math.ceil(math.log2(4 * n))
    amplitude = np.zeros((size, size))
    for channel in np.moveaxis(patch.picture, -1, 0):
        light = (channel - channel.mean()) * window * window[:, None]
        amplitude += np.abs(np.fft.fft2(light[::-1], (size, size))) ** 2  # +y up
    amplitude = np.sqrt(amplitude)
    base = math.radians(pattern.angle_deg)

    def score(scale: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
        c, s = np.cos(base + angle)[..., None], np.sin(base + angle)[..., None]
        unit = patch.step_mm / pattern.dot_size_mm * scale[..., None] * size
        column = (c * frequencies[:, 0] - s * frequencies[:, 1]) * unit
        row = (s * frequencies[:, 0] + c * frequencies[:, 1]) * unit
        seen = map_coordinates(amplitude, [row, column], order=1, mode="grid-wrap")
        return np.asarray(seen @ np.sqrt(strengths))

    scale, angle = 1.0, 0.0
    scale_range, angle_range = _SCALE, math.radians(_ANGLE_DEG)
    for _ in range(3):
        scales, angles = np.meshgrid(
            scale + np.linspace(-scale_range, scale_range, 121), angle + np.linspace(-angle_range, angle_range, 121)
        )
        best = int(np.argmax(score(scales, angles)))
        scale, angle = float(scales.flat[best]), float(angles.flat[best])
        scale_range, angle_range = scale_range / 20, angle_range / 20
    return scale, angle


@dataclass(frozen=True, eq=False)
class _Nominal:
    """The pattern on its torus: samples a cell, spectra (C, rows, columns // 2 + 1), mean square of all channels."""

    samples: int
    spectra: NDArray[np.complex64]
    power: float


def _nominal(pattern: Pattern, colors: NDArray[np.float64]) -> _Nominal:
    samples = _SAMPLES if pattern.cells.size <= _MANY_CELLS else _FEWER_SAMPLES
    cell = np.ones((samples, samples), np.float32)
    pictures = [np.kron(color[pattern.cells].astype(np.float32), cell) for color in colors.T]
    return _Nominal(samples, np.stack([rfft2(p) for p in pictures]), float(np.sum([np.mean(p**2) for p in pictures])))


def _correlate(
    patch: Patch,
    pattern: Pattern,
    nominal: _Nominal,
    scale: float,
    angle: float,
    cells: float,
    expected_mm: NDArray[np.float64] | None = None,
) -> tuple[float, NDArray[np.float64]]:
    """Best correlation over the torus for a scale and an angle, and its similarity; of the middle `cells` cells.

    `scale` is pattern millimetres a nominal millimetre, `angle` turns the lattice of the pattern to that of the patch.
    Of places that fit alike the one nearest to `expected_mm`, where the patch's middle should be, is taken.
    """
    rows, columns = pattern.cells.shape
    samples = nominal.samples
    n = patch.picture.shape[0]
    half_mm = min(0.5 * (n - 1) * patch.step_mm / math.sqrt(2.0), 0.5 * cells * pattern.dot_size_mm / scale)
    reach = int(half_mm * scale / pattern.dot_size_mm * samples)
    along = (np.arange(-reach, reach) + 0.5) / samples  # cells
    turned = math.radians(pattern.angle_deg) + angle
    mm = np.stack(np.meshgrid(along, along), axis=-1) * pattern.dot_size_mm / scale
    x = math.cos(turned) * mm[..., 0] - math.sin(turned) * mm[..., 1]
    y = math.sin(turned) * mm[..., 0] + math.cos(turned) * mm[..., 1]
    places = [0.5 * (n - 1) - y / patch.step_mm, 0.5 * (n - 1) + x / patch.step_mm]
    torus = (rows * samples, columns * samples)
    index = np.arange(-reach, reach)
    into = (index % torus[0])[:, None] * torus[1] + index % torus[1]
    cross, energy = np.zeros(nominal.spectra.shape[1:], np.complex64), 0.0
    for channel, spectrum in zip(np.moveaxis(patch.picture, -1, 0), nominal.spectra, strict=True):
        seen = map_coordinates(channel, places, order=1, mode="nearest")
        seen -= seen.mean()
        folded = np.bincount(into.ravel(), seen.ravel(), torus[0] * torus[1]).reshape(torus)
        cross += np.conj(rfft2(folded.astype(np.float32))) * spectrum
        energy += float(np.sum(seen**2))
    alike = irfft2(cross, s=torus)
    power = nominal.power * len(along) ** 2
    base = math.radians(pattern.angle_deg)
    turn = np.array([[math.cos(base), -math.sin(base)], [math.sin(base), math.cos(base)]])
    expected = np.zeros(2) if expected_mm is None else turn.T @ expected_mm / pattern.dot_size_mm * samples
    # the torus runs on: every place stands for the one of its repetitions that is nearest to the expected
    way = [
        (np.arange(size) - at + 0.5 * size) % size - 0.5 * size for at, size in zip(expected, torus[::-1], strict=True)
    ]
    far = way[0][None, :] ** 2 + way[1][:, None] ** 2
    scale_of = math.sqrt(max(energy * power, 1e-300))
    likely = alike / scale_of - (_NEARER if expected_mm is not None else 0.0) * np.sqrt(far) / samples
    row, column = np.unravel_index(int(np.argmax(likely)), torus)
    shift_mm = (expected + np.array([way[0][column], way[1][row]])) / samples * pattern.dot_size_mm
    back = scale * np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    score = float(alike[row, column]) / scale_of
    return score, np.column_stack([back, turn @ shift_mm])


def _match_by_trial(patch: Patch, pattern: Pattern, colors: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Scale and angle by trial, on few cells first, then on more of them in finer steps."""
    best, scale, angle, steps = (-1.0, np.zeros((2, 3))), 1.0, 0.0, 5
    nominal = _nominal(pattern, colors)
    scale_range, angle_range, cells = 0.5 * _SCALE, math.radians(0.5 * _ANGLE_DEG), _FEW_CELLS
    while True:
        trials = []
        for s in np.linspace(scale - scale_range, scale + scale_range, steps):
            for a in np.linspace(angle - angle_range, angle + angle_range, steps):
                trials.append((_correlate(patch, pattern, nominal, float(s), float(a), cells), float(s), float(a)))
        best, scale, angle = max(trials, key=lambda trial: trial[0][0])
        if angle_range < math.radians(0.2):
            return best
        scale_range, angle_range, cells, steps = scale_range / 2.5, angle_range / 2.5, cells * 1.5, 3
