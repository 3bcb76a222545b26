"""A picture of the print sheet for the screen: the whole sheet, and a magnified crop, in the colorants' own colours.

Colours are sRGB of the reflectances under D65, averaged in linear light. Dots too small for a pixel are averaged
before they are sampled, so that the preview shows no moire that the print has not.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.special import ndtr

from paxel_design.printing.blocks import plan_cell_raster
from paxel_design.printing.font import font_path
from paxel_design.printing.furniture import Modules
from paxel_design.printing.plates import recipe_of
from paxel_design.printing.sheet import Sheet, pattern_summary, sheet_of
from paxel_runtime.model.colorimetry import XYZ_to_linear_sRGB, illuminant_D65, linear_sRGB_to_sRGB, spectra_to_XYZ
from paxel_runtime.model.pattern import OUTSIDE, Colorant, Pattern, colorant_library

__all__ = ["Raster", "pattern_detail", "reflectance_to_linear_sRGB", "render_pattern", "write_preview"]

RGB = tuple[int, int, int]

_SHEET_LIMIT_PX = (1000, 900)
_CROP_PX = 512
_CROP_DOTS = 14
_GAP_PX = 24
_TITLE_PX = 22
_TEXT_PX = 15
_FURNITURE_OVERSAMPLING = 3
_SAMPLES_PER_PIXEL = 4
_RESOLVED_DOT_PX = 2.0
_REACH_PX = 3  # of the filter beyond the edge of the pattern
_BACKGROUND: RGB = (58, 58, 58)
_FOREGROUND: RGB = (235, 235, 235)
_CROP_FRAME: RGB = (255, 140, 0)


@dataclass(frozen=True)
class Raster:
    """Pixels on the wall: (width, height) in pixels, the upper left corner and the pixel's edge in millimetres."""

    size_px: tuple[int, int]
    left_mm: float
    top_mm: float
    pixel_mm: float

    def to_px(self, at_mm: tuple[float, float]) -> tuple[float, float]:
        """x right and y down from the upper left corner."""
        return (at_mm[0] - self.left_mm) / self.pixel_mm, (self.top_mm - at_mm[1]) / self.pixel_mm

    def centres_mm(self, fine: int = 1) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """x (1, fine * width) and y (fine * height, 1) of the centres of `fine` x `fine` samples in every pixel."""
        width, height = self.size_px
        x_mm = self.left_mm + (np.arange(width * fine) + 0.5) * (self.pixel_mm / fine)
        y_mm = self.top_mm - (np.arange(height * fine) + 0.5) * (self.pixel_mm / fine)
        return x_mm[None, :], y_mm[:, None]


def write_preview(
    pattern: Pattern,
    path: str | os.PathLike[str],
    *,
    dpi: float = 1440,
    ink_spread_um: float = 0.0,
    caption: str = "",
    recipe: Mapping[str, Any] | None = None,
) -> tuple[int, int]:
    """Write a PNG of the sheet that `write_pattern_pdf` makes of the same arguments.

    Parameters
    ----------
    pattern, dpi, ink_spread_um, caption, recipe
        As for `write_pattern_pdf`. The dots are shown as designed, without compensation.
    path : path-like
        The PNG to write.

    Returns
    -------
    (int, int)
        Width and height in pixels, at most 1600 wide.

    Raises
    ------
    InputError
        As `write_pattern_pdf`.
    """
    realised_um = plan_cell_raster(pattern.dot_size_mm, ink_spread_um).ink_spread_um
    sheet = sheet_of(pattern, dpi=dpi, ink_spread_um=realised_um, caption=caption, recipe=recipe)
    width_mm, height_mm = sheet.page_mm
    pixel_mm = max(width_mm / _SHEET_LIMIT_PX[0], height_mm / _SHEET_LIMIT_PX[1])
    sheet_px = (round(width_mm / pixel_mm), round(height_mm / pixel_mm))
    sheet_raster = Raster(sheet_px, -width_mm / 2, height_mm / 2, pixel_mm)
    board = _compose(pattern, sheet, sheet_raster, _detail_raster(pattern))
    board.save(path, format="PNG")
    return board.size


def pattern_detail(pattern: Pattern) -> NDArray[np.uint8]:
    """The centre of the pattern, 14 dots wide, as a (512, 512, 3) uint8 sRGB picture for pages and posters."""
    return render_pattern(pattern, _detail_raster(pattern))


def _detail_raster(pattern: Pattern) -> Raster:
    side_mm = pattern.dot_size_mm * _CROP_DOTS
    return Raster((_CROP_PX, _CROP_PX), -side_mm / 2, side_mm / 2, side_mm / _CROP_PX)


def reflectance_to_linear_sRGB(reflectance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 3) linear sRGB of (..., 81) reflectances under D65; the perfect diffuser is white, (1, 1, 1)."""
    D65 = illuminant_D65()
    XYZ = spectra_to_XYZ(reflectance * D65)
    diffuser = XYZ_to_linear_sRGB(spectra_to_XYZ(D65))  # 0.03 % off (1, 1, 1): the table's 5 nm steps
    return np.asarray(XYZ_to_linear_sRGB(XYZ) / diffuser, np.float64)


def _solid_linear_sRGB(colorant: Colorant) -> NDArray[np.float64]:
    """Colour of a solid patch, (3,): under D65, or of a fluorescent ink the hue of its light; by day it is not seen."""
    if colorant.fluorescence is None or not colorant.spot:
        return reflectance_to_linear_sRGB(colorant.reflectance)
    light = np.clip(XYZ_to_linear_sRGB(spectra_to_XYZ(colorant.fluorescence.emission)), 0.0, None)
    return np.asarray(light / light.max(), np.float64)


def _palette_linear_sRGB(pattern: Pattern) -> NDArray[np.float32]:
    """Colours of the labels, (256, 3): the colorants, and paper outside the pattern."""
    palette = np.tile(reflectance_to_linear_sRGB(pattern.library["white"].reflectance), (256, 1))
    for i, colorant in enumerate(pattern.palette):
        palette[i] = _solid_linear_sRGB(colorant)
    return np.clip(palette, 0.0, 1.0).astype(np.float32)


def _to_code(linear_sRGB: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.rint(255.0 * linear_sRGB_to_sRGB(np.clip(linear_sRGB, 0.0, 1.0))).astype(np.uint8)


def _to_RGB(linear_sRGB: NDArray[np.floating]) -> RGB:
    red, green, blue = (int(code) for code in _to_code(linear_sRGB))
    return red, green, blue


def render_pattern(pattern: Pattern, raster: Raster) -> NDArray[np.uint8]:
    """The pattern and the paper around it on a raster, (height, width, 3) uint8 sRGB, filtered in linear light."""
    palette = _palette_linear_sRGB(pattern)
    resolved = pattern.dot_size_mm / raster.pixel_mm >= _RESOLVED_DOT_PX
    return _to_code((_render_resolved if resolved else _render_averaged)(pattern, raster, palette))


def _render_resolved(pattern: Pattern, raster: Raster, palette: NDArray[np.float32]) -> NDArray[np.float32]:
    """Dots that can be seen: the mean of a few samples a pixel."""
    width, height = raster.size_px
    fine = _SAMPLES_PER_PIXEL
    samples = pattern.label(*raster.centres_mm(fine)).reshape(height, fine, width, fine)
    linear = np.zeros((height, width, 3), np.float32)
    for label in (*range(len(pattern.colorants)), OUTSIDE):
        share: NDArray[np.float32] = (samples == label).mean(axis=(1, 3), dtype=np.float32)
        linear += share[..., None] * palette[label]
    return linear


def _render_averaged(pattern: Pattern, raster: Raster, palette: NDArray[np.float32]) -> NDArray[np.float32]:
    """Dots too small to be seen: a Gaussian of one pixel, applied to the torus itself, so that nothing can alias."""
    dot_mm, fine = pattern.dot_size_mm, _SAMPLES_PER_PIXEL
    rows, columns = pattern.cells.shape
    upright = replace(pattern, angle_deg=0.0, size_mm=(2 * columns * dot_mm, 2 * rows * dot_mm))
    torus_raster = Raster((columns, rows), 0.0, rows * dot_mm, dot_mm)
    torus = palette[upright.label(*torus_raster.centres_mm(fine))[::-1]]
    sigma = fine * raster.pixel_mm / dot_mm
    torus = gaussian_filter(torus, (sigma, sigma, 0.0), mode="wrap", truncate=3.0)
    x_mm, y_mm = raster.centres_mm()
    angle = np.deg2rad(pattern.angle_deg)
    c, s = np.cos(angle) * fine / dot_mm, np.sin(angle) * fine / dot_mm
    at = np.stack((c * y_mm - s * x_mm, c * x_mm + s * y_mm)) - 0.5
    paper = palette[OUTSIDE]
    share_x, share_y = (
        ndtr((v + side_mm / 2) / raster.pixel_mm) - ndtr((v - side_mm / 2) / raster.pixel_mm)
        for v, side_mm in zip((x_mm, y_mm), pattern.size_mm, strict=True)
    )
    linear = np.empty((*at.shape[1:], 3), np.float32)
    for channel in range(3):
        colour = map_coordinates(torus[..., channel], at, order=1, mode="grid-wrap")
        linear[..., channel] = paper[channel] + share_x * share_y * (colour - paper[channel])
    return linear


def _render_sheet(pattern: Pattern, sheet: Sheet, raster: Raster) -> Image.Image:
    """The whole sheet: paper, the pattern on its area, the furniture over both."""
    image = Image.new("RGB", raster.size_px, _to_RGB(_palette_linear_sRGB(pattern)[OUTSIDE]))
    half_width, half_height = pattern.size_mm[0] / 2, pattern.size_mm[1] / 2
    left, top = (int(np.floor(v)) - _REACH_PX for v in raster.to_px((-half_width, half_height)))
    right, bottom = (int(np.ceil(v)) + _REACH_PX for v in raster.to_px((half_width, -half_height)))
    area = Raster(
        (right - left, bottom - top),
        raster.left_mm + left * raster.pixel_mm,
        raster.top_mm - top * raster.pixel_mm,
        raster.pixel_mm,
    )
    image.paste(Image.fromarray(render_pattern(pattern, area)), (left, top))
    furniture = _render_furniture(sheet, raster)
    image.paste(furniture, (0, 0), furniture)
    return image


def _render_furniture(sheet: Sheet, raster: Raster) -> Image.Image:
    """Lines, patches and texts on a transparent ground, drawn larger and reduced, so that thin lines stay thin."""
    over = _FURNITURE_OVERSAMPLING
    width, height = raster.size_px
    fine = Raster((over * width, over * height), raster.left_mm, raster.top_mm, raster.pixel_mm / over)
    black = _to_RGB(reflectance_to_linear_sRGB(colorant_library()["black"].reflectance))
    image = Image.new("RGBA", fine.size_px, (*black, 0))
    _draw_furniture(ImageDraw.Draw(image), sheet, fine, black)
    return image.reduce(over)


def _draw_furniture(draw: ImageDraw.ImageDraw, sheet: Sheet, raster: Raster, black: RGB) -> None:
    for line in sheet.lines:
        width_px = max(1, round(line.width_mm / raster.pixel_mm))
        draw.line([raster.to_px(line.start_mm), raster.to_px(line.end_mm)], fill=black, width=width_px)
    for patch in sheet.patches:
        (x, y), (width, height) = patch.lower_left_mm, patch.size_mm
        box = [raster.to_px((x, y + height)), raster.to_px((x + width, y))]
        if patch.colorant is None:
            draw.rectangle(box, outline=black)
        else:
            draw.rectangle(box, fill=_to_RGB(_solid_linear_sRGB(patch.colorant)))
    for modules in sheet.modules:
        _draw_modules(draw, modules, raster, black)
    for text in sheet.texts:
        font = _font(text.height_mm / raster.pixel_mm)
        anchor = {"left": "ls", "middle": "ms", "right": "rs"}[text.anchor]
        draw.text(raster.to_px(text.at_mm), text.text, font=font, anchor=anchor, fill=black)


def _draw_modules(draw: ImageDraw.ImageDraw, modules: Modules, raster: Raster, black: RGB) -> None:
    """Black modules, each run as a rectangle from edge to edge of whole pixels."""
    left, top = modules.upper_left_mm
    step = modules.module_mm
    for row, first, length in modules.runs():
        x0, y0 = raster.to_px((left + step * first, top - step * row))
        x1, y1 = raster.to_px((left + step * (first + length), top - step * (row + 1)))
        draw.rectangle([round(x0), round(y0), max(round(x0), round(x1) - 1), max(round(y0), round(y1) - 1)], fill=black)


@cache
def _font(size_px: float) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(font_path()), max(1.0, size_px))


def _compose(pattern: Pattern, sheet: Sheet, sheet_raster: Raster, crop_raster: Raster) -> Image.Image:
    """Sheet on the left; crop, scale bar and legend on the right; a line of text over each."""
    top = _GAP_PX + _TITLE_PX + _GAP_PX + _TEXT_PX + 8
    legend_px = 28 * (len(pattern.colorants) + 1)
    crop_left = _GAP_PX + sheet_raster.size_px[0] + _GAP_PX
    height = top + max(sheet_raster.size_px[1], _CROP_PX + 44 + legend_px) + _GAP_PX
    board = Image.new("RGB", (crop_left + _CROP_PX + _GAP_PX, height), _BACKGROUND)
    draw = ImageDraw.Draw(board)
    draw.text((_GAP_PX, _GAP_PX), pattern_summary(pattern), font=_font(_TITLE_PX), fill=_FOREGROUND)
    sheet_label = f"the whole sheet, {sheet.trim_mm[0]:.0f} × {sheet.trim_mm[1]:.0f} mm after cutting"
    crop_label = f"the centre of the pattern, {crop_raster.pixel_mm * _CROP_PX:g} mm wide"
    for left, label in ((_GAP_PX, sheet_label), (crop_left, crop_label)):
        draw.text((left, top - 8), label, font=_font(_TEXT_PX), anchor="ls", fill=_FOREGROUND)
    board.paste(_render_sheet(pattern, sheet, sheet_raster), (_GAP_PX, top))
    board.paste(Image.fromarray(render_pattern(pattern, crop_raster)), (crop_left, top))
    half = crop_raster.pixel_mm * _CROP_PX / 2
    corners = (sheet_raster.to_px((-half, half)), sheet_raster.to_px((half, -half)))
    draw.rectangle([(_GAP_PX + x, top + y) for x, y in corners], outline=_CROP_FRAME, width=2)
    draw.rectangle([crop_left - 2, top - 2, crop_left + _CROP_PX + 1, top + _CROP_PX + 1], outline=_CROP_FRAME, width=2)
    _draw_scale_bar(draw, crop_left, top + _CROP_PX + 14, crop_raster.pixel_mm)
    _draw_legend(draw, pattern, crop_left, top + _CROP_PX + 44)
    return board


def _draw_scale_bar(draw: ImageDraw.ImageDraw, left: int, top: int, pixel_mm: float) -> None:
    """The longest round length below half the crop."""
    limit_mm = pixel_mm * _CROP_PX / 2
    decade = 10.0 ** np.floor(np.log10(limit_mm))
    length_mm = max(step * decade for step in (1, 2, 5) if step * decade <= limit_mm)
    draw.rectangle([left, top, left + length_mm / pixel_mm, top + 5], fill=_FOREGROUND)
    at = (left + length_mm / pixel_mm + 10, top + 3)
    draw.text(at, f"{length_mm:g} mm", font=_font(_TEXT_PX), anchor="lm", fill=_FOREGROUND)


def _draw_legend(draw: ImageDraw.ImageDraw, pattern: Pattern, left: int, top: int) -> None:
    """A swatch, the name, the recipe and the share of the area of every colorant."""
    palette = _palette_linear_sRGB(pattern)
    for i, (colorant, share) in enumerate(zip(pattern.palette, pattern.shares(), strict=True)):
        y = top + 28 * i
        draw.rectangle([left, y, left + 36, y + 20], fill=_to_RGB(palette[i]))
        line = f"{colorant.name}: {recipe_of(colorant)}, {100 * share:.1f} % of the area"
        draw.text((left + 48, y + 10), line, font=_font(_TEXT_PX), anchor="lm", fill=_FOREGROUND)
    y = top + 28 * len(pattern.colorants) + 10
    glows = any(colorant.fluorescence is not None and colorant.spot for colorant in pattern.palette)
    note = "colours of the solids under D65" + ("; of fluorescent inks, of their own light" if glows else "")
    draw.text((left, y), note, font=_font(_TEXT_PX), anchor="lm", fill=_FOREGROUND)
