"""Is a registration good enough to go on? The verdict on a channel, and the figures and the picture of all channels.

Knows registrations; must not know files. The picture is drawn with Pillow alone, so that a show computer needs no
plotting library.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from paxel_runtime.registration.residuals import BIN_PX
from paxel_runtime.registration.table import ChannelRegistration
from paxel_runtime.structured_light import REASONS, Decoded

__all__ = ["channel_shifts", "registration_report", "verdict"]

_MOVED_PX = 0.3
"""Mean shift of a channel against the guide, camera pixels, that no lens makes: its aberration is 0 in the mean."""
_WORDS = ("good", "usable", "repeat")
_WIDTH, _MARGIN, _TOP, _ROW = 1180, 24, 92, 316
_PANEL_WIDTH, _PANEL_HEIGHT = 356, 212
_INK, _SOFT, _GRID, _BAR, _ARROW = "#222222", "#666666", "#dddddd", "#3a6ea5", "#222222"
_VERDICT_COLORS = {"good": "#2d7d46", "usable": "#b07a10", "repeat": "#b4552d"}
_SCALE = np.array([[13, 42, 89], [33, 113, 160], [92, 178, 150], [214, 214, 96], [248, 138, 60], [178, 24, 43]])
_UNKNOWN, _COVERED = (225, 225, 225), (120, 180, 140)
_ARROWS = 9
_ARROW_LENGTH = 0.8
"""Of the longest arrow, in distances from one arrow to the next."""


def verdict(decoded: Decoded, registration: ChannelRegistration) -> tuple[str, str]:
    """Is this registration good enough to go on?

    Returns
    -------
    (word, reason)
        "good", "usable" (go on, but a better one is within reach) or "repeat", and why.
    """
    figures, counts = registration.figures, decoded.counts
    seen = max(sum(counts.values()) - counts["too dark"] - counts["outside the frame"], 1)
    lost = {name: counts[name] / seen for name in REASONS[2:] if name != "outside the frame"}
    worst = max(lost, key=lambda name: lost[name])
    residual = figures["residual_rms_px"]
    scatter = math.inf if residual is None else residual
    hidden, outliers = 1.0 - (figures["coverage"] or 0.0), figures["outliers"] or 0.0
    measures = (  # value, above this "usable", above this "repeat", in words
        (hidden, 0.02, 0.30, f"{hidden:.0%} of the projection has no table entry: hidden or out of view"),
        (lost["saturated"], 0.01, 0.20, f"{lost['saturated']:.0%} of the lit pixels are saturated: expose less"),
        (sum(lost.values()), 0.05, 0.40, f"{sum(lost.values()):.0%} of the lit pixels were not decoded: {worst}"),
        (outliers, 0.05, 0.35, f"{outliers:.0%} of the points are outliers: did something move?"),
        (scatter, 0.6, 2.0, f"points scatter by {scatter:.2f} camera pixels: check focus and exposure"),
    )
    for word, limit in (("repeat", 2), ("usable", 1)):
        for measure in measures:
            if measure[0] > (measure[1], measure[2])[limit - 1]:
                return word, measure[3]
    return "good", f"points scatter by {scatter:.2f} camera pixels, {1.0 - hidden:.0%} of the projection is covered"


def channel_shifts(registration: Mapping[str, ChannelRegistration], guide: str) -> dict[str, dict[str, float]]:
    """How far each other channel's light falls from the guide's (chromatic aberration), camera pixels.

    Returns
    -------
    dict of channel -> {"rms_px", "max_px", "mean_px"}
        Over the pixels valid in both; ``mean_px`` is the length of the mean shift.
    """
    shifts = {}
    for name, table in registration.items():
        both = table.valid & registration[guide].valid
        if name == guide or not both.any():
            continue
        off = (table.camera_xy - registration[guide].camera_xy)[both].astype(np.float64)
        size = np.hypot(*off.T)
        shifts[name] = {
            "rms_px": float(np.sqrt(np.mean(size**2))),
            "max_px": float(size.max()),
            "mean_px": float(np.hypot(*off.mean(axis=0))),
        }
    return shifts


def registration_report(
    registration: Mapping[str, ChannelRegistration], verdicts: Mapping[str, tuple[str, str]], guide: str
) -> tuple[dict[str, Any], dict[str, NDArray[np.uint8]]]:
    """Figures and pictures of a registration.

    Parameters
    ----------
    registration : dict of channel name -> ChannelRegistration
    verdicts : dict of channel name -> (word, reason)
        Of `verdict`.
    guide : str
        The channel that the others are compared with.

    Returns
    -------
    figures : dict
        ``verdict`` ("good", "usable" or "repeat") and ``why`` of all channels together; ``chromatic_aberration``, see
        `channel_shifts`.
    pictures : dict of name -> (h, w, 3) uint8 array
        ``registration``: for each channel the histogram and the map of the residuals, and what part of the projection
        is covered (guide) or how far the channel falls from the guide (the others).
    """
    shifts = channel_shifts(registration, guide)
    told = {name: (word, f"{name}: {reason}") for name, (word, reason) in verdicts.items()}
    for name, shift in shifts.items():
        if shift["mean_px"] > _MOVED_PX and told[name][0] == "good":
            moved = f"{name}: all of it lies {shift['mean_px']:.2f} camera pixels from {guide}: did something move?"
            told[name] = ("usable", moved)
    word, why = max(told.values(), key=lambda pair: _WORDS.index(pair[0]))
    figures = {"verdict": word, "why": why, "chromatic_aberration": shifts}
    return figures, {"registration": _draw(registration, guide, shifts, word, why)}


def _draw(
    registration: Mapping[str, ChannelRegistration],
    guide: str,
    shifts: Mapping[str, Mapping[str, float]],
    word: str,
    why: str,
) -> NDArray[np.uint8]:
    picture = Image.new("RGB", (_WIDTH, _TOP + _ROW * len(registration)), "white")
    draw = ImageDraw.Draw(picture)
    draw.text((_MARGIN, 16), "Registration: where the camera sees each projector pixel", _INK, _font(20))
    draw.text((_MARGIN, 48), f"{word}: ", _VERDICT_COLORS[word], _font(16))
    draw.text((_MARGIN + 8 + draw.textlength(f"{word}: ", _font(16)), 48), why, _INK, _font(16))
    top_px = max(_top_residual(table) for table in registration.values())
    for place, (name, table) in enumerate(registration.items()):
        top = _TOP + place * _ROW
        left = [_MARGIN + k * (_PANEL_WIDTH + _MARGIN) for k in range(3)]
        _histogram(draw, left[0], top, name, table)
        _map(picture, draw, left[1], top, f"{name}: rms residual, 0 to {top_px:.2f} camera px", table, top_px)
        if name in shifts:
            _shift(draw, left[2], top, name, table, registration[guide], shifts[name])
        else:
            _coverage(picture, draw, left[2], top, name, table)
    return np.asarray(picture)


def _font(size: int) -> Any:
    return ImageFont.load_default(size)


def _top_residual(table: ChannelRegistration) -> float:
    known = table.residuals.rms_px[np.isfinite(table.residuals.rms_px)]
    return max(float(np.percentile(known, 99)), 0.01) if known.size else 0.01


def _histogram(draw: ImageDraw.ImageDraw, left: int, top: int, name: str, table: ChannelRegistration) -> None:
    counts = table.residuals.histogram
    figures = table.figures
    rms = figures["residual_rms_px"]
    scatter = "no points" if rms is None else f"rms {rms:.3f}, outliers {figures['outliers'] or 0.0:.1%}"
    draw.text((left, top), f"{name}: residuals of {int(figures['points'] or 0):,} points", _INK, _font(14))
    draw.text((left, top + 19), f"camera px: {scatter}", _SOFT, _font(12))
    y0, y1 = top + 40, top + 40 + _PANEL_HEIGHT
    draw.rectangle((left, y0, left + _PANEL_WIDTH, y1), None, _GRID)
    width = _PANEL_WIDTH / len(counts)
    for k, count in enumerate(counts):
        height = (_PANEL_HEIGHT - 4) * float(count) / max(float(counts.max()), 1.0)
        if height >= 0.5:
            draw.rectangle((left + k * width, y1 - height, left + (k + 1) * width - 1, y1), _BAR)
    for value in np.arange(0.0, BIN_PX * (len(counts) - 1), 0.25):
        x = left + value / BIN_PX * width
        draw.line((x, y1, x, y1 + 4), _SOFT)
        draw.text((x, y1 + 6), f"{value:g}", _SOFT, _font(11), anchor="ma")
    draw.text((left + _PANEL_WIDTH, y1 + 6), "more", _SOFT, _font(11), anchor="ra")


def _colored(share: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Colours of values 0..1, blue to red; gray where NaN."""
    place = np.clip(np.nan_to_num(share), 0.0, 1.0) * (len(_SCALE) - 1)
    colors = np.stack([np.interp(place, np.arange(len(_SCALE)), _SCALE[:, c]) for c in range(3)], axis=-1)
    colors[~np.isfinite(share)] = _UNKNOWN
    return np.rint(colors).astype(np.uint8)


def _fit_panel(shape: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a raster (rows, columns) in a panel."""
    scale = min(_PANEL_WIDTH / shape[1], _PANEL_HEIGHT / shape[0])
    return max(1, round(shape[1] * scale)), max(1, round(shape[0] * scale))


def _map(
    picture: Image.Image,
    draw: ImageDraw.ImageDraw,
    left: int,
    top: int,
    title: str,
    table: ChannelRegistration,
    top_px: float,
) -> None:
    draw.text((left, top), title, _INK, _font(14))
    draw.text((left, top + 19), "over the projection; gray: nothing measured", _SOFT, _font(12))
    values = table.residuals.rms_px
    tile = Image.fromarray(_colored(values / top_px)).resize(_fit_panel(table.valid.shape), Image.Resampling.NEAREST)
    picture.paste(tile, (left, top + 40))
    y = top + 46 + _PANEL_HEIGHT
    scale = Image.fromarray(_colored(np.linspace(0.0, 1.0, 200)[None])).resize((200, 8))
    picture.paste(scale, (left, y))
    draw.text((left + 208, y - 3), f"0 to {top_px:.2f} px", _SOFT, _font(11))


def _coverage(
    picture: Image.Image, draw: ImageDraw.ImageDraw, left: int, top: int, name: str, table: ChannelRegistration
) -> None:
    draw.text(
        (left, top), f"{name}: {table.figures['coverage'] or 0.0:.1%} of the projection is covered", _INK, _font(14)
    )
    draw.text((left, top + 19), "green: has a table entry; gray: hidden or out of view", _SOFT, _font(12))
    colors = np.where(table.valid[..., None], _COVERED, _UNKNOWN).astype(np.uint8)
    picture.paste(Image.fromarray(colors).resize(_fit_panel(table.valid.shape)), (left, top + 40))


def _shift(
    draw: ImageDraw.ImageDraw,
    left: int,
    top: int,
    name: str,
    table: ChannelRegistration,
    guide: ChannelRegistration,
    figures: Mapping[str, float],
) -> None:
    """Arrows of the shift against the guide channel, in the camera's axes, the longest as long as fits."""
    draw.text((left, top), f"{name}: shift against the guide channel", _INK, _font(14))
    draw.text(
        (left, top + 19), f"camera px: rms {figures['rms_px']:.3f}, max {figures['max_px']:.3f}", _SOFT, _font(12)
    )
    H, W = table.valid.shape
    width, height = _fit_panel((H, W))
    draw.rectangle((left, top + 40, left + width, top + 40 + height), None, _GRID)
    step = W / _ARROWS
    rows, columns = np.meshgrid(np.arange(step / 2, H, step).astype(int), np.arange(step / 2, W, step).astype(int))
    shift = (table.camera_xy - guide.camera_xy)[rows, columns].reshape(-1, 2)
    known = (table.valid & guide.valid)[rows, columns].ravel()
    unit = _ARROW_LENGTH * width / _ARROWS / max(figures["max_px"], 1e-6)
    for row, column, (dx, dy), ok in zip(rows.ravel(), columns.ravel(), shift, known, strict=True):
        x, y = left + (column + 0.5) / W * width, top + 40 + (row + 0.5) / H * height
        if not ok:
            draw.text((x, y), "x", _SOFT, _font(11), anchor="mm")
            continue
        end = (x + unit * float(dx), y + unit * float(dy))
        draw.line((x, y, *end), _ARROW, 2)
        draw.ellipse((x - 2, y - 2, x + 2, y + 2), _ARROW)
