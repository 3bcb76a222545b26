"""The figures in words, for whoever stands at the wall: good, usable or weak, why, and what helps.

The limits stand in one table, from which the words and the verdict are made.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

__all__ = ["LIMITS", "VERDICTS", "Limit", "judge_view", "preview_words", "view_words"]

VERDICTS = ("good", "usable", "weak")
"""Best first."""


class Limit(NamedTuple):
    """How a figure is judged: `good` and `usable` are the last values that are; above or below by their order."""

    good: float
    usable: float
    words: str
    cure: str

    def verdict(self, value: float) -> str:
        """One of `VERDICTS`."""
        sign = 1.0 if self.usable >= self.good else -1.0
        return VERDICTS[int(sign * value > sign * self.good) + int(sign * value > sign * self.usable)]


LIMITS: dict[str, Limit] = {
    "dE00_mean": Limit(
        1.0,
        2.5,
        "colours are off by {:.1f} dE00 on average",
        'colours: [assembly] method = "refine" evens out the dots; calibration/accuracy.json tells the model\'s part',
    ),
    "ghosting_percent": Limit(
        1.0,
        3.0,
        "{:.1f} % of the other picture shines through",
        "ghost: the projector may have moved (paxel register --quick), or the two pictures are too much alike",
    ),
    "ghost_L": Limit(
        0.3,
        1.0,
        "details of the other picture change this one by up to {:.1f} L*",
        'ghost: [mapping] method = "static" keeps the two pictures apart',
    ),
    "coherent_gain": Limit(
        0.95,
        0.85,
        "edges have {percent:.0f} % of their height",
        "edges: details as small as the dots are lost; choose smaller dots, or a picture with larger details",
    ),
    "local_contrast_kept": Limit(
        0.4,
        0.2,
        "keeps {percent:.0f} % of the source's local contrast",
        "contrast: two pictures share the room; choose calmer ones, or larger dots seen from farther away",
    ),
}
"""How each figure of a view is judged. 3 % of another picture, and a difference of 1 L*, are what an attentive viewer
sees (design: section 10); the gain and the contrast are those of the prototype's static and adaptive pictures."""


_PLACES = {"pattern": "on the pattern", "white": "on the white sheet"}
_LITTLE_NEARER = 0.9
_FEW_PIXELS = 0.01
_LEAKS = {"blurred": "blurred", "texture": "by its dots"}


def judge_view(figures: Mapping[str, Any], distance_mm: float) -> str:
    """The worst verdict of a view's figures; nearer than the least distance is usable for its last tenth, then weak."""
    verdicts = [limit.verdict(figures[key]) for key, limit in LIMITS.items() if _counts(key, figures)]
    if _too_close(figures, distance_mm):
        verdicts.append("weak" if _too_close(figures, distance_mm / _LITTLE_NEARER) else "usable")
    return max(verdicts, key=VERDICTS.index, default=VERDICTS[0])


def view_words(where: str, figures: Mapping[str, Any], distance_mm: float) -> list[str]:
    """A view's verdict with its figures as one sentence, and what helps where something is not good.

    Parameters
    ----------
    where : str
        Such as ``"on the pattern"``.
    figures : mapping
        Of `view_figures`, with ``minimum_distance_mm`` and ``ghost_L`` where known.
    distance_mm : float

    Returns
    -------
    list of str
        The first line starts with the verdict.
    """
    parts, cures = [], []
    for key, limit in LIMITS.items():
        if not _counts(key, figures):
            continue
        value = figures[key]
        verdict = limit.verdict(value)
        parts.append(limit.words.format(value, percent=100 * value) + ("" if verdict == "good" else f" ({verdict})"))
        if verdict != "good":
            cures.append(limit.cure)
    lines = [f"{where} from {distance_mm / 1000:g} m: {judge_view(figures, distance_mm)}: {'; '.join(parts)}"]
    if _too_close(figures, distance_mm):
        lines.append(
            f"  too close: the dots are seen from {distance_mm / 1000:g} m; stand at least "
            f"{figures['minimum_distance_mm'] / 1000:.1f} m away, or print smaller dots"
        )
        return lines  # nothing else is worth a cure from there
    return lines + [f"  {cure}" for cure in cures]


def preview_words(record: Mapping[str, Any]) -> list[str]:
    """The words for every view of a preview's record, and for what the projection image gives away."""
    lines = [f"{record['name']} ({record['seen_on']})"]
    for tag, look in {"": record, **record.get("views", {})}.items():
        for surface, where in _PLACES.items():
            if f"on_{surface}" in look:
                words = view_words(where, look[f"on_{surface}"], look["distance_mm"])
                lines += [_moved_words(tag) + words[0], *words[1:]]
    if change := record.get("change"):
        lines.append(f"from surface to surface: {_change_words(change)}")
    for surface, where in _PLACES.items():
        leak = record.get("projection_image", {}).get(f"on_{surface}", {})
        seen = [f"{words} {leak[key]:.2f}" for key, words in _LEAKS.items() if leak.get(key) is not None]
        if seen:
            lines.append(f"whoever has only the projection image finds the picture {where} (1 = plainly): "
                         f"{', '.join(seen)}")  # fmt: skip
    return lines


def _change_words(change: Mapping[str, Any]) -> str:
    """What an effect did to colours, with the spread where hues can be seen."""
    chroma = "" if change["chroma_ratio"] is None else f"chroma times {change['chroma_ratio']:.2f}"
    if change["hue_turn_deg"] is None or change["hue_pixels"] < _FEW_PIXELS:
        return chroma or "all gray"
    turn = f"hues turn by {change['hue_turn_deg']:.1f} degrees (standard deviation {change['hue_turn_sd_deg']:.1f})"
    return f"{turn}, {chroma}"


def _moved_words(tag: str) -> str:
    """What has moved, from the tag of a look; empty where only the distance differs."""
    moved = [part for part in tag.split(".") if part and not part.startswith("at-")]
    return f"({', '.join(moved)}) " if moved else ""


def _counts(key: str, figures: Mapping[str, Any]) -> bool:
    """Whether a figure is there; a planted mark says more than the regression on the other picture."""
    if figures.get(key) is None:
        return False
    return key != "ghosting_percent" or figures.get("ghost_L") is None


def _too_close(figures: Mapping[str, Any], distance_mm: float) -> bool:
    return distance_mm < (figures.get("minimum_distance_mm") or 0.0)
