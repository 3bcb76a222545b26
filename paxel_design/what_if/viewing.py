"""What the viewer sees of print and raster: least distance, moire, angle, order of a tile; and what helps there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from paxel_design.advice.ranking import ANGLES_DEG
from paxel_design.patterns import make_pattern
from paxel_design.visibility import pattern_visibility, worst_moire
from paxel_design.what_if.case import Case, PrintCase
from paxel_design.what_if.changes import Change, option
from paxel_design.what_if.effect import EFFECT_WORDS, effect_numbers, scaled_room
from paxel_runtime.model.pattern import Pattern

__all__ = ["least_distance_mm", "moire_of", "view_changes"]

_ZOOMS = (0.99, 1.0, 1.01)
"""Of the projector, which nobody sets to a percent: the worst counts, as in ``print/visibility.json``."""

_PIECE_PX = 160
_NEAREST_MM, _FARTHEST_MM = 100.0, 100_000.0
_FARTHER = 1.25
_OTHER_ANGLE_DEG = 1.0
_SEEN = 1.0
"""Visibility that is just seen, thresholds: less is of no use."""


def view_changes(case: Case) -> Iterator[Change]:
    """The least visible tile, viewers who stand farther away, and the angle with the least moire."""
    printed = case.printed
    if printed is None:
        return
    if printed.pattern.layout == "tiles":
        yield _tile_order(printed)
    yield _farther(printed)
    if printed.pattern.layout != "blue-noise":
        yield _angle(case, printed)


def least_distance_mm(case: Case) -> float:
    """From where the dots are not seen: of the previews where there are some, else by the print's spectrum."""
    told = [
        float(view["minimum_distance_mm"])
        for path, record in case.records.items()
        if path.startswith("preview/")
        for view in (record.get("on_pattern"), record.get("on_white"))
        if view and view.get("minimum_distance_mm")
    ]
    if told or case.printed is None:
        return max(told, default=_NEAREST_MM)
    low, high = _NEAREST_MM, _FARTHEST_MM
    while high / low > 1.005:
        middle = float(np.sqrt(low * high))
        seen = _seen(case.printed, case.printed.pattern, middle) > _SEEN
        low, high = (middle, high) if seen else (low, middle)
    return high


def moire_of(printed: PrintCase, pattern: Pattern) -> float:
    """Worst moire of a print on this installation's raster, thresholds, as ``print/visibility.json`` tells it."""
    viewing, lighting = printed.settings.viewing, printed.lighting
    return worst_moire(
        pattern,
        [lighting.pitch_mm * zoom for zoom in _ZOOMS],
        viewing.distance_mm,
        K=min(lighting.K, len(pattern.colorants) + 1),
        partition="light" if lighting.sorted_by == "design" else "lab",
        luminance_cd_m2=viewing.luminance_cd_m2,
        phases=1,
        size_px=_PIECE_PX,
    ).visibility


def _angle(case: Case, printed: PrintCase) -> Change:
    pattern = printed.pattern
    others = [angle for angle in ANGLES_DEG if angle and abs(angle - pattern.angle_deg) > _OTHER_ANGLE_DEG]
    moires = [moire_of(printed, replace(pattern, angle_deg=angle)) for angle in others]
    best = int(np.argmin(moires))
    values = {"angle": option(others[best], "degrees"), "angle_now": option(pattern.angle_deg, "degrees")}
    room = scaled_room(case, printed, replace(pattern, angle_deg=others[best]))
    return Change(
        "angle",
        "seen",
        "The print turned to {angle} degrees (now {angle_now})",
        "moire where one cluster is lit alone",
        "thresholds",
        moire_of(printed, pattern),
        moires[best],
        "viewer",
        "a new print" if room is None else f"a new print; {EFFECT_WORDS}",
        "angle_deg = {angle} under [pattern], then paxel pattern; print, capture and calibrate again",
        less_is_better=True,
        enough=_SEEN,
        values=values if room is None else values | effect_numbers(case, room),
    )


def _tile_order(printed: PrintCase) -> Change:
    p = printed.pattern
    found = make_pattern(
        p.layout, p.colorants, p.dot_size_mm, p.angle_deg, p.size_mm, p.seed,
        shares=p.shares().tolist(), library=p.library,
    )  # fmt: skip
    before, after = (_seen(printed, one) for one in (p, replace(found, print_scale=p.print_scale)))
    return Change(
        "tile-order",
        "seen",
        "The least visible order of a tile's inks",
        "visibility of the print by itself",
        "thresholds",
        before,
        after,
        "viewer",
        "a new print",
        'tile_order = "search" under [pattern], then paxel pattern; print, capture and calibrate again',
        less_is_better=True,
        enough=_SEEN,
    )


def _farther(printed: PrintCase) -> Change:
    distance_mm = printed.settings.viewing.distance_mm
    farther_mm = _FARTHER * distance_mm
    return Change(
        "farther",
        "seen",
        "Viewers at {distance} m in place of {distance_now} m",
        "visibility of the print by itself",
        "thresholds",
        _seen(printed, printed.pattern),
        _seen(printed, printed.pattern, farther_mm),
        "viewer",
        "pictures look smaller, and their finest detail is lost to the eye",
        "a rope or a mark on the floor; distance_mm = {distance_mm} under [viewing]",
        less_is_better=True,
        enough=_SEEN,
        values={
            "distance": option(farther_mm / 1000, "m"),
            "distance_mm": option(farther_mm, "mm"),
            "distance_now": option(distance_mm / 1000, "m"),
        },
    )


def _seen(printed: PrintCase, pattern: Pattern, distance_mm: float | None = None) -> float:
    """Visibility of a print in luminance and opponent colours together, thresholds; from the viewers' place."""
    viewing = printed.settings.viewing
    seen = pattern_visibility(pattern, distance_mm or viewing.distance_mm, viewing.luminance_cd_m2)
    return float(np.hypot(seen.luminance, seen.opponent))
