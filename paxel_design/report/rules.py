"""When a figure is good, usable or weak: the one table of the report's thresholds, each with its reason.

What a viewer sees of a picture is judged by the same limits as in `paxel preview`. Knows numbers and words; not where
a figure comes from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from paxel_design.advice.ranking import SEEN_MOIRE, SEEN_PRINT
from paxel_design.report.content import Judgement, Quantity, Table, Verdict, unit_words
from paxel_runtime.errors import InputError
from paxel_runtime.observer.judgement import LIMITS

__all__ = ["HONESTY", "RULES", "Rule", "judged", "judged_honesty", "rules_table"]


@dataclass(frozen=True)
class Rule:
    """How a figure is judged; `good` and `usable` are the last values that are, above or below by their order.

    Attributes
    ----------
    name : str
        What is judged, in a few words.
    unit : str
    good, usable : float
    reason : str
        Why there.
    advice : str
        What helps where it is not good.
    """

    name: str
    unit: str
    good: float
    usable: float
    reason: str
    advice: str

    @property
    def less_is_better(self) -> bool:
        """Whether small figures are good."""
        return self.usable >= self.good

    @property
    def words(self) -> str:
        """The thresholds: ``"good up to 1, usable up to 2.5 dE00"``."""
        upto = "up to" if self.less_is_better else "from"
        return f"good {upto} {self.good:g}, usable {upto} {self.usable:g} {unit_words(self.unit)}".rstrip()

    def judge(self, value: float) -> Judgement:
        """ "good", "usable" or "weak"."""
        sign = 1.0 if self.less_is_better else -1.0
        if sign * value <= sign * self.good:
            return "good"
        return "usable" if sign * value <= sign * self.usable else "weak"


def _of_view(key: str, name: str, unit: str, reason: str, advice: str, factor: float = 1.0) -> Rule:
    """A rule with the limits of `paxel preview`."""
    limit = LIMITS[key]
    return Rule(name, unit, factor * limit.good, factor * limit.usable, reason, advice)


RULES: dict[str, Rule] = {
    "prediction": Rule(
        "colour prediction",
        "dE00",
        1.0,
        2.5,
        "1 is just told side by side; the paper's own 1.9 and 2.4 still made good pictures",
        "take the extra readings (model.correction), repeat the readings in the dark, and look at the projector's "
        "honesty below",
    ),
    "registration": Rule(
        "registration",
        "camera pixels",
        0.6,
        2.0,
        "scatter of the measured points, as paxel capture judges it; the fit through them is finer by far",
        "focus camera and projector, fix both, and capture again",
    ),
    "coverage": Rule(
        "registered part of the projection",
        "%",
        98.0,
        70.0,
        "as paxel capture judges it; what has no place in the camera's picture stays dark",
        "see that the camera sees the whole projection, and that nothing stands before it",
    ),
    "purity": Rule(
        "purity of the clusters",
        "%",
        90.0,
        75.0,
        "the light on a cluster that meets its own ink; of the contrast between two inks 80 % is left at 90 and half "
        "at 75",
        "larger dots, a sharper projector, or one cluster more for the edges (clusters.count)",
    ),
    "print": Rule(
        "print seen by itself",
        "thresholds",
        SEEN_PRINT,
        10.0,
        "1 is just seen, 10 is plain; paxel advise lets its score fall from 2 on",
        "smaller dots, or viewers farther away",
    ),
    "moire": Rule(
        "moire of a lit cluster",
        "thresholds",
        SEEN_MOIRE,
        10.0,
        "the worst case, one cluster lit alone; pictures light all of them and the assembly evens out the rest",
        "another angle or dot size: paxel advise",
    ),
    "lightness": Rule(
        "range of two independent pictures",
        "L*",
        30.0,
        15.0,
        "the smaller of both surfaces; adaptive mapping keeps 40 % of a photograph's local contrast at 30, 20 % at 15",
        "a finer projector, larger dots or a darker ink: the chapter What would make it better has the gain of each",
    ),
    "hue-area": Rule(
        "colours whose hue can turn",
        "CIELAB^2",
        700.0,
        80.0,
        "a circle of chroma 15, plainly coloured, and of chroma 5, just coloured",
        "coloured inks instead of black and white, or a smaller angle",
    ),
    "product-pair": Rule(
        "colours of two independent pictures",
        "CIELAB^3",
        14_000.0,
        4_000.0,
        "the smaller of both surfaces; balls of radius 15, plain colours about a gray, and of radius 10, pale ones",
        "pictures that need little colour; larger dots, or one cluster more",
    ),
    "hidden-range": Rule(
        "range of a picture that vanishes",
        "L*",
        30.0,
        15.0,
        "grays that can all become one colour on the other surface; as of two independent pictures",
        "another uniform colour: near the middle of what both surfaces can show",
    ),
    "srgb": Rule(
        "colours of a screen that the print shows",
        "%",
        80.0,
        50.0,
        "of the volume of sRGB; a photograph rarely needs the last fifth, and below half vivid colours turn pale",
        "purer inks, or area shares that let white be brighter",
    ),
    "hidden-seen": Rule(
        "hidden picture on",
        "thresholds",
        1.0,
        3.0,
        "1 is just seen on a plain surface by half of the observers (Barten); a picture is made out from some 3 on",
        "register again (paxel register --quick), look from farther away, or take the extra readings "
        "(model.correction)",
    ),
    "in-gamut": Rule(
        "pixels in reach",
        "%",
        99.0,
        95.0,
        "what cannot be shown is moved to the nearest that can; in few pixels nobody sees it",
        "let the gamut mapping work (mapping.lightness), or take an effect with a larger sub-gamut",
    ),
    "colours-seen": _of_view(
        "dE00_mean", "colours as seen", "dE00", "as paxel preview judges them", LIMITS["dE00_mean"].cure
    ),
    "ghosting": _of_view(
        "ghosting_percent",
        "the other picture shining through",
        "%",
        "3 % of another picture is what an attentive viewer sees",
        LIMITS["ghosting_percent"].cure,
    ),
    "contrast-kept": _of_view(
        "local_contrast_kept",
        "local contrast kept of the picture",
        "%",
        "as paxel preview judges it: from 40 % a photograph looks calm, below 20 % flat",
        LIMITS["local_contrast_kept"].cure,
        100.0,
    ),
}
"""By key. Fixed: a report never moves a threshold to suit an installation."""

HONESTY: dict[str, Judgement] = {"honest": "good", "noticeable": "usable", "dishonest": "weak"}
"""What the words for the projector's honesty count for."""

_HONESTY_ADVICE = {
    "honest": "",
    "noticeable": "the correction from extra readings takes care of it; the calibration's chapter tells what it is",
    "dishonest": "switch off what the calibration's chapter names, and capture again",
}


def judged(key: str, name: str, quantities: Mapping[str, Quantity], scale: float = 1.0, of: str = "") -> Verdict:
    """The verdict of a rule on a quantity.

    Parameters
    ----------
    key : str
        Of `RULES`.
    name : str
        The quantity's full name.
    quantities : mapping of str to Quantity
    scale : float
        From the quantity's unit to the rule's: 100 for a share that the rule has in percent.
    of : str
        What is judged more closely: "on the pattern".

    Raises
    ------
    InputError
        If there is no such rule or quantity, or it is no number.
    """
    if key not in RULES:
        raise InputError(f"a rule of the report must be one of {', '.join(RULES)}; got {key!r}")
    quantity = quantities.get(name)
    if quantity is None or isinstance(quantity.value, str | bool | tuple):
        raise InputError(f"rule {key!r} needs a quantity that is a number, and {name!r} is {quantity}")
    rule = RULES[key]
    judgement = rule.judge(scale * quantity.value)
    advice = "" if judgement == "good" else rule.advice
    return Verdict(f"{rule.name} {of}".rstrip(), name, judgement, rule.words, advice)


def judged_honesty(name: str, quantities: Mapping[str, Quantity]) -> Verdict:
    """The verdict on the word for the projector's honesty, a quantity of this name."""
    word = str(quantities[name].value)
    rule = "good: honest, usable: noticeable, weak: dishonest"
    return Verdict("honesty of the projector", name, HONESTY[word], rule, _HONESTY_ADVICE[word])


def rules_table() -> Table:
    """All rules with their thresholds and reasons."""
    rows = tuple((rule.name, rule.words, rule.reason) for rule in RULES.values())
    return Table(
        "thresholds-table", "When a figure is good, usable or weak.", ("figure", "thresholds", "why"), rows, True
    )
