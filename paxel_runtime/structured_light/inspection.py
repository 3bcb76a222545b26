"""Is a capture what it should be? Told from a few rows and columns of it, before anything is decoded.

Frames carry no tag, so each capture is held against those before it: white against black, a Gray-code capture against
its inverse (together they are white and black) and against the code so far (a sheet's code runs smoothly along a row),
a shifted line against the Gray code. One capture is checked in milliseconds, so the same checks serve a finished folder
and a camera that is still at it.

Knows samples of captures and names of frames; must not know files, devices or who is told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.structured_light.checks import LINE_PERIOD, PHASE_PERIOD, SHIFTS, gray_name
from paxel_runtime.structured_light.samples import Sample, displacement, line_ends, odd_share, same_picture

__all__ = ["Problem", "capture_problem", "sequence_problem", "sequence_problems"]

_MOST_CLIPPED = 0.2
"""Share of saturated pixels in one capture: reflections are fewer, an overexposed sheet is more."""
_LEAST_LEVEL = 0.02
"""Of white's bright pixels, full scale 1: black ink would drown in the camera's steps below."""
_MOST_ODD = 0.05
"""Share of lit pixels that may not add up in a complementary pair."""
_NO_LIGHT = "is the lens cap off, the projector on and its frame in view, and the exposure long enough? Take it again"

Label = Callable[[str], str]
"""What a person knows a capture by, from the name of its frame."""


class Problem(NamedTuple):
    """What is wrong with a capture, and what to do.

    Attributes
    ----------
    name : str
        Frame of the capture that is at fault.
    text : str
        To be read after the capture's own name.
    kind : "itself" | "repeated" | "order"
        Whether it is bad whatever it shows, shows again what an earlier one shows, or does not go with earlier ones.
    """

    name: str
    text: str
    kind: Literal["itself", "repeated", "order"] = "itself"


def capture_problem(name: str, samples: Mapping[str, Sample], label: Label = str) -> Problem | None:
    """What is wrong with one capture; None if it may be what it should.

    Parameters
    ----------
    name : str
        Name of its frame; white and black come first, then the order of the plan.
    samples : dict of name -> Sample
        This capture and those before it.
    label : callable, optional
        Names other captures in the text.
    """
    sample = samples[name]
    size = next(iter(samples.values())).size
    if sample.size != size:
        return Problem(
            name,
            f"has {sample.size[0]} x {sample.size[1]} pixels, the others {size[0]} x {size[1]}: take all with the same "
            "camera, picture size and orientation",
        )
    if sample.clipped > _MOST_CLIPPED:
        share = f"{sample.clipped:.0%}"
        return Problem(name, f"is saturated on {share} of its pixels: expose less, and take all with the same exposure")
    if name == "white":
        level = float(np.percentile(sample.values, 99.0)) / 65535
        dark = Problem(name, f"is black (its brightest parts are at {level:.1%} of full scale): {_NO_LIGHT}")
        return dark if level < _LEAST_LEVEL else None
    if name == "black":
        return _black_problem(samples)
    if (gray := re.fullmatch(r"gray-([xy])-(\d+)-inverse", name)) is not None:
        known = gray_name(gray[1], int(gray[2])) in samples
        return _pair_problem(gray[1], int(gray[2]), samples, label) if known else None
    if (line := re.fullmatch(r"(line|phase)-([xy])-(\d)", name)) is not None:
        return _line_problem(name, line[1], line[2], int(line[3]), samples)
    return None


def sequence_problems(samples: Mapping[str, Sample], label: Label = str) -> list[Problem]:
    """What is wrong with the captures of a whole sequence, each held against those before it."""
    problems: list[Problem] = []
    seen: dict[str, Sample] = {}
    if samples["white"].size == samples["black"].size:
        exchanged = _black_problem(samples)
        if exchanged is not None and exchanged.kind == "order":
            return [exchanged]  # white alone would only look black
    for name in ("white", "black", *(name for name in samples if name not in ("white", "black"))):
        seen[name] = samples[name]
        problem = capture_problem(name, seen, label)
        if problem is None:
            continue
        problems.append(problem)
        if name in ("white", "black"):
            return problems  # there is nothing to hold the others against
        seen.pop(name)
        seen.pop(name.removesuffix("-inverse"), None)
    return _exchanged(problems, samples, label)


def _exchanged(problems: list[Problem], samples: Mapping[str, Sample], label: Label) -> list[Problem]:
    """Problems of two pairs that lost a partner to each other, told as what they are."""
    pairs = [p.name.removesuffix("-inverse") for p in problems if p.text.startswith(_ODD_PAIR)]
    full, light = _full_and_light(samples)
    for i, one in enumerate(pairs):
        for two in pairs[i + 1 :]:
            for a, b, keep_a, keep_b in (
                (one, two, f"{one}-inverse", f"{two}-inverse"),
                (one, f"{two}-inverse", f"{one}-inverse", two),
            ):
                fits = [(b, keep_a), (a, keep_b)]
                if all(odd_share(samples[p], samples[q], full, light) <= _MOST_ODD for p, q in fits):
                    text = f"is exchanged with {label(b)} (or {label(keep_a)} with {label(keep_b)}): put them in order"
                    others = [p for p in problems if p.name.removesuffix("-inverse") not in (one, two)]
                    return [Problem(a, text, "order"), *others]
    return problems


def _full_and_light(samples: Mapping[str, Sample]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """White + black, and white - black where the projector clearly lights (0 elsewhere)."""
    white, black = samples["white"].values, samples["black"].values
    light = white - black
    return white + black, np.where(light >= max(0.1 * float(np.percentile(light, 99.0)), 100.0), light, 0.0)


def _black_problem(samples: Mapping[str, Sample]) -> Problem | None:
    low, high = np.percentile(samples["white"].values - samples["black"].values, (1.0, 99.0))
    if high > 3.0 * max(-low, 1.0) and high > 200.0:
        return None
    if -low > 3.0 * max(high, 1.0):
        return Problem(
            "black", "is brighter than white: the two are exchanged; put them in the order of the plan", "order"
        )
    return Problem(
        "black",
        "is as bright as white: it was taken while white was still shown, or white while black was, or the room is too "
        "bright; take both again",
    )


_ODD_PAIR = "does not add up to white"


def _pair_problem(axis: str, bit: int, samples: Mapping[str, Sample], label: Label) -> Problem | None:
    """A capture and its inverse: do they add up, and does the code that they continue run smoothly?"""
    name = gray_name(axis, bit)
    inverse = f"{name}-inverse"
    full, light = _full_and_light(samples)
    odd = odd_share(samples[name], samples[inverse], full, light)
    shift = displacement((samples["white"], samples["black"]), (samples[name], samples[inverse]))
    if shift is not None:
        return Problem(
            inverse,
            f"is displaced by about {round(shift[0]):+d}, {round(shift[1]):+d} pixels (right, down) against white: the "
            "camera or the sheet moved between the two; fix both and take all captures again",
            "order",
        )
    if odd > _MOST_ODD:
        return _odd_pair_problem(name, samples, light, label)
    contrast = _contrast(samples, axis, bit)[light > 0] > 0
    if 0.03 < float(np.mean(contrast)) < 0.97:
        for other, earlier in _pairs(samples):
            agree = float(np.mean((_contrast(samples, other, earlier)[light > 0] > 0) == contrast))
            if (other, earlier) != (axis, bit) and max(agree, 1.0 - agree) > 0.97:
                first, second = label(gray_name(other, earlier)), label(f"{gray_name(other, earlier)}-inverse")
                return Problem(
                    inverse,
                    f"and the capture before it show the same as {first} and {second}: repeated; take them again",
                    "order",
                )
    return _order_problem(axis, bit, samples, light, label)


def _odd_pair_problem(name: str, samples: Mapping[str, Sample], light: NDArray[np.float64], label: Label) -> Problem:
    """Which capture of a pair that does not add up is the wrong one, if that can be told."""
    inverse = f"{name}-inverse"
    if same_picture(samples[name], samples[inverse], light):
        return Problem(
            inverse,
            f"shows the same as {label(name)}, not its inverse: it is repeated, or was taken too early; take it again",
            "repeated",
        )
    lit = light > 0
    levels = {
        one: float(np.mean((samples[one].values - samples["black"].values)[lit])) / float(np.mean(light[lit]))
        for one in (name, inverse)
    }
    darker, brighter = sorted(levels, key=lambda one: levels[one])
    if levels[darker] < 0.05 and levels[brighter] < 0.9:
        return Problem(darker, f"is black, and should add up to white with {label(brighter)}: {_NO_LIGHT}")
    for one in (name, inverse):
        for other, sample in samples.items():
            if (
                other not in (name, inverse, "black")
                and levels[one] > 0.03
                and same_picture(samples[one], sample, light)
            ):
                return Problem(
                    one,
                    f"shows the same as {label(other)}: it is repeated, or was taken too early; take it again",
                    "repeated",
                )
    return Problem(
        inverse,
        f"{_ODD_PAIR} with {label(name)}, whose inverse it should be: one of the two is out of order, repeated or old, "
        "or something moved; take both again",
        "order",
    )


def _pairs(samples: Mapping[str, Sample]) -> list[tuple[str, int]]:
    """Axis and bit of every complementary pair that is there."""
    found = (re.fullmatch(r"gray-([xy])-(\d+)-inverse", name) for name in samples)
    return [(m[1], int(m[2])) for m in found if m is not None and m[0].removesuffix("-inverse") in samples]


def _contrast(samples: Mapping[str, Sample], axis: str, bit: int) -> NDArray[np.float64]:
    name = gray_name(axis, bit)
    return samples[name].values - samples[f"{name}-inverse"].values


def _order_problem(
    axis: str, bit: int, samples: Mapping[str, Sample], light: NDArray[np.float64], label: Label
) -> Problem | None:
    """Does the code so far run smoothly along rows and columns, or would it if a bit changed sides?"""
    bits = sorted((k for a, k in _pairs(samples) if a == axis), reverse=True)
    if bits != list(range(bits[0], bit - 1, -1)):
        return None  # not in the order of the plan: nothing to hold it against
    contrasts = {k: _contrast(samples, axis, k) for k in bits}
    sure = (light > 0) & np.all([np.abs(c) > 0.3 * light for c in contrasts.values()], axis=0)
    code = sum(((contrasts[k] > 0).astype(np.int64) << (k - bit) for k in bits), np.zeros(light.shape, np.int64))
    known = np.flatnonzero(sure)
    line = np.searchsorted(line_ends(samples["white"]), known, "right")
    joined = line[1:] == line[:-1]

    def way(gray: NDArray[np.int64]) -> float:
        return float(np.sum(np.abs(np.diff(_gray_to_binary(gray[known])))[joined]))

    found = way(code)
    if found < 8:
        return None
    name = gray_name(axis, bit)
    if way(code ^ 1) < 0.8 * found:
        return Problem(
            f"{name}-inverse",
            f"is exchanged with {label(name)}, its inverse: put the two in order or take both again",
            "order",
        )
    for k in bits[:-1]:
        differ = ((code >> (k - bit)) ^ code) & 1
        if way(code ^ differ ^ (differ << (k - bit))) < 0.8 * found:
            other = label(gray_name(axis, k))
            return Problem(
                name,
                f"and its inverse are exchanged with {other} and its inverse: put them in order or take them again",
                "order",
            )
    return None


def _gray_to_binary(gray: NDArray[np.int64]) -> NDArray[np.int64]:
    binary = gray.copy()
    for shift in (1, 2, 4, 8, 16):
        binary ^= binary >> shift
    return binary


def _line_problem(name: str, kind: str, axis: str, shift: int, samples: Mapping[str, Sample]) -> Problem | None:
    """A shifted line (or sinusoid) against the Gray code: which shift does it show?"""
    _, light = _full_and_light(samples)
    bits = sorted(k for a, k in _pairs(samples) if a == axis)
    if not bits or bits != list(range(bits[-1] + 1)):
        return None
    contrasts = [_contrast(samples, axis, k) for k in bits]
    sure = (light > 0) & np.all([np.abs(c) > 0.3 * light for c in contrasts], axis=0)
    if np.sum(sure) < 20 * SHIFTS:
        return None
    gray = np.zeros(int(sure.sum()), np.int64)
    for k, contrast in enumerate(contrasts):
        gray |= (contrast[sure] > 0).astype(np.int64) << k
    place = 2.0 * _gray_to_binary(gray) + 0.5
    period = LINE_PERIOD if kind == "line" else PHASE_PERIOD
    level = (samples[name].values - samples["black"].values)[sure] / light[sure]
    brightest = float(np.percentile(level, 99.0))
    if brightest < 0.02:
        return Problem(name, f"is black: {_NO_LIGHT}")
    level /= brightest  # of another channel, it may be darker than this white
    turns = np.exp(2j * np.pi * place / period)
    # the Gray code's edges are left out, so places are not evenly spread: the mean has to go
    seen = np.vdot(np.conj(turns - turns.mean()), level - level.mean()) / turns.size
    if abs(seen) < 0.03:
        return Problem(name, f"shows no shifted lines along {axis}: it is of another frame; take it again", "order")
    shown = round(float(np.angle(seen)) * SHIFTS / (2.0 * np.pi)) % SHIFTS
    if shown == shift:
        return None
    return Problem(
        name,
        f"shows {name[:-1]}{shown}: it is out of order, repeated or taken too early, or something moved since the Gray "
        "code; put it in the order of the plan or take it again",
        "order",
    )


def sequence_problem(files: Sequence[str], samples: Sequence[Sample], names: Sequence[str]) -> str:
    """Why a sequence of complementary pairs has more or fewer captures than frames: which is extra, or missing.

    Parameters
    ----------
    files : sequence of str
        Names of the captures' files, in order.
    samples : sequence of Sample
        Of the captures.
    names : sequence of str
        Of the frames: pairs, and last white and black, which are a pair too.
    """
    values = [sample.values for sample in samples]
    least, most = np.percentile(values, (10.0, 90.0), axis=0)  # black and white, whatever is missing or extra
    full, light = most + least, most - least
    light = np.where(light >= max(0.1 * float(np.percentile(light, 99.0)), 100.0), light, 0.0)

    def fits(i: int, j: int) -> bool:
        return j < len(samples) and odd_share(samples[i], samples[j], full, light) <= _MOST_ODD

    i = 0
    while fits(i, i + 1):
        i += 2
    extra = len(samples) > len(names)
    if i >= len(samples):
        if extra:
            return f"remove the {len(samples) - len(names)} that are not of it"
        return f"{len(names) - len(samples)} are missing, in whole pairs, or the projector has another size"
    frame = names[min(i, len(names) - 1)]
    if not extra:
        if i == len(names) - 2:
            bright = float(np.mean(values[i])) > 0.5 * float(np.mean(most))
            return f"{'black' if bright else 'white'} is missing beside {files[i]}: take it again"
        return f"{files[i]} has no inverse beside it: {frame} or {frame}-inverse is missing; take it again"
    if i + 1 < len(samples) and same_picture(samples[i], samples[i + 1], light):
        return f"{files[i + 1]} shows the same as {files[i]}: remove one of them"
    if fits(i, i + 2):
        return f"{files[i + 1]} stands between {files[i]} and its inverse: remove it"
    return f"{files[i]} has no inverse beside it, and {frame} should be there: remove it"
