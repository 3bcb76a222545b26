"""Changes of light and sheets, exactly from the measured matrices: black level, room light, second sheet, shares."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from paxel_design.gamut.lightness import GRAY_SHEETS
from paxel_design.gamut.primaries import has_primaries, primaries_figures
from paxel_design.patterns.request import apportion
from paxel_design.what_if.case import Case
from paxel_design.what_if.changes import Change, Number, option
from paxel_design.what_if.effect import change_of_room
from paxel_design.what_if.figures import common_range, room_of
from paxel_design.what_if.light import black_level, with_black, with_columns, with_second_sheet

__all__ = ["sheet_changes"]

_AMBIENT = 0.01
_LESS_LIGHT = 0.5
_NEUTRAL = "D65"
_PER_MILLE = 1000
"""Area shares are told in whole parts of it, which sum to 1 as paxel.toml asks."""


def sheet_changes(case: Case) -> Iterator[Change]:
    """Half the black level, light in the room, a blacker cluster, other area shares, gray second sheets."""
    yield from _black_levels(case)
    if case.printed is None:
        yield _darkest_cluster(case)
    yield from _shares(case)
    yield from _second_sheets(case)


def _black_levels(case: Case) -> Iterator[Change]:
    yield change_of_room(
        case,
        "black-half",
        "Half the black level ({black} % of full white now)",
        room_of(with_black(case.model, _LESS_LIGHT)),
        "matrices",
        "a projector of twice the contrast, or half of the room's light kept out",
        "darken the room and cover what reflects into it; then paxel capture, paxel calibrate",
        {"black": Number(100 * black_level(case.model), "%", 2)},
    )
    yield change_of_room(
        case,
        "ambient",
        "Room light of {ambient} % of full white on the wall",
        room_of(with_black(case.model, ambient=_AMBIENT)),
        "matrices",
        "it is what an open door takes",
        "keep lamps and daylight off the wall",
        {"ambient": option(100 * _AMBIENT, "%")},
    )


def _second_sheets(case: Case) -> Iterator[Change]:
    """Neutral gray sheets over the pattern: the range of L* that both surfaces can have at once."""
    if case.model.white is None:
        return
    now = common_range(case.model)
    for luminance in GRAY_SHEETS:
        model = with_second_sheet(case.model, luminance)
        shared = common_range(model)
        yield Change(
            f"gray-sheet-{luminance:g}",
            "shared",
            "A gray second sheet that reflects {sheet} of what the white paper does",
            "range of lightness that both surfaces share",
            "L*",
            now[1] - now[0] if now else 0.0,
            shared[1] - shared[0] if shared else 0.0,
            "matrices",
            "the pictures on the sheet get darker: contrast of two free pictures {contrast} in place of "
            "{contrast_now} L*",
            'second_surface = "gray" under [model]; then paxel capture, paxel calibrate',
            values={
                "sheet": option(luminance),
                "shared": Number(shared or (0.0, 0.0), "L*"),
                "contrast": Number(room_of(model).contrast, "L*"),
                "contrast_now": Number(case.room.contrast, "L*"),
            },
        )


def _darkest_cluster(case: Case) -> Change:
    """Of a model whose print is not known: its darkest cluster returning half as much light."""
    model = case.model
    shape = (len(model.clusters), len(model.channels))
    Y = np.asarray(model.pattern.A[1]).reshape(shape).sum(axis=1)
    if model.white is not None:
        Y = Y / np.asarray(model.white.A[1]).reshape(shape).sum(axis=1)
    factors = np.ones(shape)
    factors[np.argmin(Y)] = _LESS_LIGHT
    return change_of_room(
        case,
        "darkest-cluster",
        "The cluster {cluster} returning half as much light",
        room_of(with_columns(model, factors.ravel())),
        "matrices",
        "a new print",
        "a blacker ink, or dots with sharper edges; print, capture and calibrate again",
        {"cluster": Number(model.clusters[int(np.argmin(Y))])},
    )


def _shares(case: Case) -> Iterator[Change]:
    """Of one channel and three primaries: the area shares with which white is neutral and no light is wasted."""
    model, printed = case.model, case.printed
    if not has_primaries(model) or printed is None:
        return
    shares = printed.pattern.shares()
    white = primaries_figures(model, shares)["whites"][_NEUTRAL]
    if white is None or "shares" not in white:  # these primaries cannot mix it
        return
    best = np.array(list(white["shares"].values()))
    room = room_of(with_columns(model, best / shares))
    yield Change(
        "shares",
        "effect",
        "Area shares {shares} of {names}",
        f"luminance of neutral white ({_NEUTRAL})",
        "of all inks at full",
        white["luminance"],
        white["luminance_with_shares"],
        "matrices",
        "a new print; the volume of all colours changes by {volume} %",
        "shares = [{shares}] under [pattern], then paxel pattern; print, capture and calibrate again",
        values={
            "shares": Number(tuple((apportion(best.tolist(), _PER_MILLE) / _PER_MILLE).tolist())),
            "names": Number(", ".join(white["shares"])),
            "volume": Number(100 * (room.volume / case.room.volume - 1), "%", 2),
        },
    )
