"""Changes of the print, of the clusters and of the projector's raster: two simulated prints, and their ratio."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from paxel_design.patterns import make_pattern
from paxel_design.patterns.snapping import FEWEST_PIXELS
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_design.what_if.case import Case, PrintCase
from paxel_design.what_if.changes import Change, Number, option
from paxel_design.what_if.effect import EFFECT_WORDS, change_of_room, effect_numbers, room_of_sorting, scaled_room
from paxel_design.what_if.figures import Room, room_of
from paxel_design.what_if.light import with_columns
from paxel_design.what_if.simulated_print import simulated_print
from paxel_design.what_if.viewing import least_distance_mm, moire_of
from paxel_runtime.model.pattern import Colorant

__all__ = [
    "cluster_counts",
    "dot_sizes",
    "finer_raster",
    "inks",
    "print_changes",
    "regular_layout",
    "sorting",
    "three_channels",
]

_DOTS_MM = (0.1, 0.15, 0.2, 0.25, 0.31, 0.38, 0.5, 0.62, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
_STEP = 1.05
"""Least ratio of another dot size to the present one."""

_FEWEST_PX = 2.5
"""Edge of the smallest dots, projector pixels: below, no pixel lights one colorant alone."""

_MOST_INPUTS = 18
"""Beyond, a joint gamut takes longer than a report may."""

_DARK_Y, _NEUTRAL = 0.12, 0.35
"""What counts as a black ink: its luminance over the paper's, and how far its XYZ spread about their mean."""

_INK, _PAPER = 0.5, 1.1
_TORUS_CELLS = 62
_AGAIN = "print, capture and calibrate again"


def print_changes(case: Case) -> Iterator[Change]:
    """Dot sizes a step up and down, K, how pixels are sorted, ink and paper, a finer raster, a regular layout."""
    if case.printed is None:
        return
    for changes in (dot_sizes, cluster_counts, sorting, inks, finer_raster, regular_layout, three_channels):
        yield from changes(case, case.printed)


def dot_sizes(case: Case, printed: PrintCase) -> Iterator[Change]:
    """A step down of the series, and two up."""
    dot, viewing = printed.pattern.dot_size_mm, printed.settings.viewing
    smallest = max(_FEWEST_PX * printed.lighting.pitch_mm, FEWEST_PIXELS * 25.4 / printed.settings.printer.dpi)
    smaller = [size for size in _DOTS_MM if smallest <= size < dot / _STEP][-1:]
    larger = [size for size in _DOTS_MM if size > dot * _STEP][:2]
    now_mm, moire_now = least_distance_mm(case), moire_of(printed, printed.pattern)
    for size in (*smaller, *larger):
        pattern = replace(printed.pattern, dot_size_mm=size)
        room = scaled_room(case, printed, pattern)
        if room is None:
            continue
        then_mm = now_mm * size / dot
        values = {
            "size": option(size, "mm"),
            "distance": Number(then_mm / 1000, "m", 2),
            "distance_now": Number(now_mm / 1000, "m", 2),
            "viewer": option(viewing.distance_mm / 1000, "m"),
            "moire": Number(moire_of(printed, pattern), "thresholds", 2),
            "moire_now": Number(moire_now, "thresholds", 2),
        } | effect_numbers(case, room)
        key, title = f"dot-size-{size:g}", "Dots of {size} mm"
        how = f"dot_size_mm = {{size}} under [pattern], then paxel pattern; {_AGAIN}"
        moire = "moire of {moire} thresholds (now {moire_now})"
        if size > dot:
            cost = f"a new print; its dots are seen from nearer than {{distance}} m (now {{distance_now}} m); {moire}"
            objection = "viewers at {viewer} m would see the dots, which melt from {distance} m on"
            yield change_of_room(
                case, key, title, room, "print", cost, how, values, objection if then_mm > viewing.distance_mm else ""
            )
        else:
            yield Change(
                key,
                "seen",
                title,
                "distance from which the dots are not seen",
                "m",
                now_mm / 1000,
                then_mm / 1000,
                "print",
                f"a new print; {EFFECT_WORDS}; {moire}",
                how,
                less_is_better=True,
                values=values,
            )


def cluster_counts(case: Case, printed: PrintCase) -> Iterator[Change]:
    """One cluster less, one and two more, as far as colorants and inputs allow."""
    K, N, least = printed.lighting.K, len(printed.lighting.channels), len(printed.pattern.colorants)
    readings = N * len(case.model.surfaces)
    for count in (K - 1, K + 1, K + 2):
        if count < least or count * N > _MOST_INPUTS:
            continue
        room, basis = room_of_sorting(case, printed, count, printed.lighting.sorted_by)
        if room is None:
            continue
        yield change_of_room(
            case,
            f"clusters-{count}",
            "{count} clusters in place of {count_now}",
            room,
            basis,
            "no new print; {readings} readings of single clusters in place of {readings_now}, and "
            + ("longer" if count > K else "shorter")
            + " computing times",
            "count = {count} under [clusters], then paxel capture, paxel calibrate",
            {
                "count": Number(count),
                "count_now": Number(K),
                "readings": Number(count * readings),
                "readings_now": Number(K * readings),
            },
        )


def sorting(case: Case, printed: PrintCase) -> Iterator[Change]:
    """Pixels sorted by the registered design in place of their colours."""
    if printed.lighting.sorted_by == "design":
        return
    room, basis = room_of_sorting(case, printed, printed.lighting.K, "design")
    if room is not None:
        yield change_of_room(
            case,
            "sorted-by-design",
            "Pixels sorted by the known pattern",
            room,
            basis,
            "no new print; the pattern has to be found in the camera's picture",
            'method = "design" under [clusters], then paxel capture, paxel calibrate',
        )


def inks(case: Case, printed: PrintCase) -> Iterator[Change]:
    """A black ink of half its reflectance; a whiter paper under the same inks."""
    pattern, library = printed.pattern, printed.pattern.library
    XYZ = colorants_to_XYZ(pattern.palette)
    darkest = int(np.argmin(XYZ[:, 1]))
    name, paper = pattern.colorants[darkest], library["white"]
    if XYZ[darkest, 1] < _DARK_Y and np.ptp(XYZ[darkest]) < _NEUTRAL * XYZ[darkest].mean():
        room = _with_colorant(case, printed, replace(library[name], reflectance=_INK * library[name].reflectance))
        yield change_of_room(
            case,
            "darker-ink",
            "A {name} that reflects {share} of what it does",
            room,
            "print",
            "a new print with another ink, such as a carbon black, or on glossy paper",
            f"print with it, and tell its reflectance under [colorants.{{name}}]; {_AGAIN}",
            {"name": Number(name), "share": option(_INK)},
        )
    if "white" in pattern.colorants and case.model.white is not None:
        whiter = replace(paper, reflectance=np.minimum(_PAPER * paper.reflectance, 1.0))
        yield change_of_room(
            case,
            "whiter-paper",
            "Paper that reflects {share} times as much, under the same inks",
            _with_colorant(case, printed, whiter),
            "print",
            "a new print and a new white sheet",
            f"print on it, and tell its reflectance under [colorants.white]; {_AGAIN}",
            {"share": option(_PAPER)},
        )


def _with_colorant(case: Case, printed: PrintCase, colorant: Colorant) -> Room:
    """Room of the measured model whose columns change as the simulated ones do; the raster and the clusters stay."""
    pattern = replace(printed.pattern, library={**printed.pattern.library, colorant.name: colorant})
    there = simulated_print(pattern, printed.lighting, sorted_as=printed.pattern).pattern.A
    return room_of(with_columns(case.model, there / np.maximum(printed.simulated.pattern.A, 1e-12)))


def finer_raster(case: Case, printed: PrintCase) -> Iterator[Change]:
    """Projector pixels half as wide."""
    columns = printed.settings.projector.resolution[0]
    room = scaled_room(case, printed, printed.pattern, pitch_mm=printed.lighting.pitch_mm / 2)
    if room is not None:
        yield change_of_room(
            case,
            "finer-raster",
            "A projector of {columns} pixels across in place of {columns_now}",
            room,
            "print",
            "another projector; or the same one nearer, on half the width",
            "resolution (or width_mm) under [projector]; then set up, capture and calibrate again",
            {"columns": Number(2 * columns), "columns_now": Number(columns)},
        )


def regular_layout(case: Case, printed: PrintCase) -> Iterator[Change]:
    """A regular layout in place of blue noise."""
    p = printed.pattern
    if p.layout != "blue-noise":
        return
    layout = "checkerboard" if len(p.colorants) == 2 else "tiles"
    angle_deg = float(np.rad2deg(np.arctan(1 / 3)))
    side_mm = _TORUS_CELLS * p.dot_size_mm
    made = make_pattern(layout, p.colorants, p.dot_size_mm, angle_deg, (side_mm, side_mm), library=p.library)
    there = replace(made, print_scale=p.print_scale)
    room = scaled_room(case, printed, there)
    if room is not None:
        yield change_of_room(
            case,
            "regular-layout",
            "A regular layout ({layout}) in place of blue noise",
            room,
            "print",
            "a new print; moire of {moire} thresholds (now {moire_now})",
            f'layout = "{{layout}}" and angle_deg = {{angle}} under [pattern], then paxel pattern; {_AGAIN}',
            {
                "layout": Number(layout),
                "angle": option(angle_deg, "degrees"),
                "moire": Number(moire_of(printed, there), "thresholds", 2),
                "moire_now": Number(moire_of(printed, p), "thresholds", 2),
            },
        )


def three_channels(case: Case, printed: PrintCase) -> Iterator[Change]:
    """Of one channel on inks that reflect: the same print under a projector of three."""
    reflectances = [colorant.reflectance for colorant in printed.pattern.palette]
    if len(case.model.channels) > 1 or np.ptp(reflectances, axis=0).max() < _DARK_Y:
        return
    room = scaled_room(case, printed, printed.pattern, channels=("red", "green", "blue"))
    if room is not None:
        yield change_of_room(
            case,
            "three-channels",
            "A projector of three channels, red, green and blue, in place of one",
            room,
            "print",
            "a colour projector, which shows colours on plain paper too",
            'channels = ["red", "green", "blue"] under [projector]; then set up, capture and calibrate again',
        )
