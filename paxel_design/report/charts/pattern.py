"""Charts of a printed layout: its spectrum against the eye and the projector, and a crop with a ruler at true scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import gaussian_filter

from paxel_design.printing.font import font_path
from paxel_design.printing.preview import Raster, render_pattern
from paxel_design.report.charts.style import GRAYS, PALETTE, new_figure, style
from paxel_design.visibility import LayoutSpectrum, moire_picture, radial_average
from paxel_design.visibility.moire import Partition
from paxel_design.visibility.sensitivity import cycles_per_degree, luminance_sensitivity
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.observer import eye_sigma_mm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["MOIRE_GAIN", "crop_with_ruler", "moire_pictures", "spectrum_chart"]

MOIRE_GAIN = 10.0
"""How much the moire's contrast is raised in its picture."""

_LATTICE_LINES = 400
"""Lines up to which a spectrum is drawn as single lines; beyond, as of blue noise, as its radial average."""
_FAINT = 1e-4
"""Contrast below which nothing is drawn: an eye at its best sees 1 in 500."""
_PX_PER_MM = 12
_MOIRE_PX = 320
_RULER_MM = 7.0


def spectrum_chart(
    spectrum: LayoutSpectrum, dot_size_mm: float, pitch_mm: float, distance_mm: float, luminance_cd_m2: float
) -> Figure:
    """The spectrum of a layout: as a plane, and its contrast by frequency against what the eye just sees.

    Parameters
    ----------
    spectrum : LayoutSpectrum
    dot_size_mm : float
    pitch_mm : float
        Of the projector's pixels on the wall.
    distance_mm, luminance_cd_m2 : float
        Of the viewer.
    """
    import matplotlib

    limit = 2.0 / dot_size_mm
    with matplotlib.rc_context(style()):
        figure = new_figure(57)
        plane, radial = figure.subplots(1, 2, width_ratios=(1, 1.5))
        _draw_plane(plane, spectrum, pitch_mm, limit)
        _draw_radial(radial, spectrum, pitch_mm, limit, distance_mm, luminance_cd_m2)
        return figure


def _draw_plane(axes: Any, spectrum: LayoutSpectrum, pitch_mm: float, limit: float) -> None:
    """Lines as dots, larger for more contrast; the projector's finest stripes as a square."""
    frequency = np.concatenate([spectrum.frequency_per_mm, -spectrum.frequency_per_mm])
    contrast = np.tile(spectrum.contrast, 2)
    shown = (np.abs(frequency).max(axis=1) < limit) & (contrast > 10 * _FAINT)
    if shown.sum() > 4 * _LATTICE_LINES:
        strongest = np.argsort(np.where(shown, contrast, 0.0))[::-1][: 4 * _LATTICE_LINES]
        shown = np.isin(np.arange(len(shown)), strongest) & shown
    top = float(contrast[shown].max()) if shown.any() else 1.0
    axes.scatter(*frequency[shown].T, s=90 * contrast[shown] / top + 0.5, color=PALETTE[0], linewidths=0)
    axes.scatter([0], [0], marker="+", s=30, color=GRAYS[0], linewidths=0.8)
    half = 0.5 / pitch_mm
    if half < limit:
        axes.plot([-half, half, half, -half, -half], [-half, -half, half, half, -half], "--", color=GRAYS[1], lw=0.8)
        axes.text(half, half, " projector's limit", fontsize=6.5, color=GRAYS[1], ha="right", va="bottom")
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
    axes.set(title="spectrum: larger dots, stronger lines", xlabel="cycles per mm, across", ylabel="cycles per mm, up")


def _draw_radial(
    axes: Any, spectrum: LayoutSpectrum, pitch_mm: float, limit: float, distance_mm: float, luminance_cd_m2: float
) -> None:
    """Contrast by frequency, and the least contrast that is seen at the distance."""
    radius, contrast = spectrum.radius_per_mm, spectrum.contrast
    near = (radius < limit) & (contrast > _FAINT)
    if near.sum() <= _LATTICE_LINES:
        axes.vlines(radius[near], _FAINT, contrast[near], color=PALETTE[0], lw=1.0)
        axes.plot(radius[near], contrast[near], "o", ms=3, color=PALETTE[0], label="lines of the print")
    else:
        frequency, power, _ = radial_average(spectrum, 60, limit)
        amplitude = np.sqrt(2 * power * (frequency[1] - frequency[0]))
        axes.step(frequency, np.maximum(amplitude, _FAINT), where="mid", color=PALETTE[0], label="print, by rings")
    f = np.geomspace(limit / 500, limit, 400)
    sensitivity = luminance_sensitivity(cycles_per_degree(f, distance_mm), luminance_cd_m2)
    with np.errstate(divide="ignore"):
        threshold = np.where(sensitivity > 0, 1 / sensitivity, np.inf)
    axes.plot(f, threshold, "--", color=PALETTE[1], label=f"just seen from {distance_mm / 1000:g} m")
    axes.fill_between(f, threshold, 30, where=threshold < 30, color=PALETTE[1], alpha=0.12, lw=0)
    half = 0.5 / pitch_mm
    if half < limit:
        axes.axvline(half, ls=":", color=GRAYS[1], lw=1.0, label="projector's finest stripes")
    axes.set(yscale="log", xlim=(0, limit), ylim=(_FAINT, 30), xlabel="cycles per mm", ylabel="contrast")
    axes.set_title("contrast by frequency: seen is what reaches the shade")
    axes.legend(loc="upper right", frameon=True, framealpha=1.0, edgecolor="none")


def crop_with_ruler(pattern: Pattern, width_mm: float, height_mm: float) -> NDArray[np.uint8]:
    """The middle of a pattern at `_PX_PER_MM` pixels a millimetre, with a ruler in millimetres under it.

    Returns
    -------
    (h, w, 3) uint8 array
        sRGB, `width_mm` wide when it is set at true scale.
    """
    size = (round(width_mm * _PX_PER_MM), round(height_mm * _PX_PER_MM))
    crop = render_pattern(pattern, Raster(size, -width_mm / 2, height_mm / 2, 1 / _PX_PER_MM))
    image = Image.new("RGB", (size[0], size[1] + round(_RULER_MM * _PX_PER_MM)), "white")
    image.paste(Image.fromarray(crop), (0, 0))
    draw = ImageDraw.Draw(image)
    font = ImageFont.truetype(str(font_path()), 2.6 * _PX_PER_MM)
    top = size[1] + _PX_PER_MM // 3
    draw.line([(0, top), (size[0], top)], fill="black", width=2)
    for mm in range(int(width_mm) + 1):
        x = min(mm * _PX_PER_MM, size[0] - 1)
        length = 2.4 if mm % 10 == 0 else 1.8 if mm % 5 == 0 else 1.1
        draw.line([(x, top), (x, top + round(length * _PX_PER_MM))], fill="black", width=2)
        if mm % 10 == 0:
            anchor = "lt" if mm == 0 else "rt" if mm + 4 > width_mm else "mt"
            draw.text((x, top + round(2.9 * _PX_PER_MM)), str(mm), font=font, anchor=anchor, fill="black")
    return np.asarray(image)


def moire_pictures(
    pattern: Pattern, pitch_mm: float, distance_mm: float, *, K: int, partition: Partition
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """A lit cluster a pixel a pixel, and as it reaches the eye at a distance: what is left there is moire.

    Returns
    -------
    lit, seen : (320, 320, 3) uint8 arrays
        sRGB. The contrast of `seen` is raised `MOIRE_GAIN` times about middle gray.
    """
    sigma_px = eye_sigma_mm(distance_mm) / pitch_mm
    rim = min(int(np.ceil(3 * sigma_px)), _MOIRE_PX)
    lit = moire_picture(pattern, pitch_mm, K=K, partition=partition, size_px=_MOIRE_PX + 2 * rim)
    blurred = gaussian_filter(lit, sigma_px, mode="reflect", truncate=3.0)[rim:-rim, rim:-rim]
    seen = blurred / max(float(blurred.mean()), 1e-9)
    gray = np.clip(0.5 + 0.5 * MOIRE_GAIN * (seen - 1.0), 0.0, 1.0)
    own = linear_sRGB_to_sRGB(np.clip(lit[rim:-rim, rim:-rim], 0.0, 1.0))
    first, second = (np.repeat(np.rint(255 * one).astype(np.uint8)[..., None], 3, axis=2) for one in (own, gray))
    return first, second
