"""Layouts that suit a projector, a printer and a viewer: candidates, their figures, the best of them and why.

Each candidate is a layout at an angle and a dot size on the printer's grid. Four figures: how plainly the print itself
is seen, its worst moire, how large the effect is, and one score of them all. Pure functions; nothing is written here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from paxel_design.advice.effect import EffectSize, effect_size, simulated_model
from paxel_design.patterns import colorants_of, make_pattern
from paxel_design.patterns.snapping import FEWEST_PIXELS, snap_to_printer
from paxel_design.visibility import Moire, PatternVisibility, beats, layout_spectrum, pattern_visibility, worst_moire
from paxel_design.visibility.moire import Partition
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

__all__ = ["ANGLES_DEG", "DOTS_PX", "Advice", "Candidate", "Setup", "advise", "layouts_for", "pareto"]

Progress = Callable[[str, int, int], None]

ANGLES_DEG = (0.0, 10.0, float(np.rad2deg(np.arctan(1 / 3))), float(np.rad2deg(np.arctan(1 / 2))), 30.0, 37.0, 45.0)
"""Of regular layouts: a checkerboard repeats every 90 degrees, and looks alike mirrored at 45; stripes and tiles are
also offered turned a quarter by their own order."""

DOTS_PX = (2.5, 3.2, 4.1, 5.1, 6.4, 8.0)
"""Edges of dots in projector pixels: in even steps of their logarithm, off whole numbers; below, no pixel lights one
colorant alone, and above, the projection loses its resolution."""

SEEN_PRINT, SEEN_MOIRE = 2.0, 5.0
"""Threshold units at which the score begins to fall: the print is always there, a cluster alone is the worst case."""

_SIZE_CHANGES = (1.0, 0.985, 1.015, 0.97, 1.03, 0.955, 1.045)
"""Of a dot, until it falls on the printer's grid: which size of a series it has matters little."""

_ZOOMS = (0.97, 0.983, 0.996, 1.009, 1.022)
_FINE_ZOOMS = tuple(np.linspace(0.97, 1.03, 9).tolist())
_PIECE_PX, _SAMPLES = 160, 89
_FINE_PIECE_PX, _FINE_SAMPLES = 256, 144
_BLUE_NOISE_CELLS = 64

_ALIKE = 1e-3
"""Largest difference of the reflectances of two colorants that no projector tells apart."""


@dataclass(frozen=True)
class Setup:
    """What advice is asked for.

    Attributes
    ----------
    resolution : (int, int)
        Of the projector, width and height.
    width_mm : float
        Of the projection on the wall.
    distance_mm, luminance_cd_m2 : float
        Of the viewer.
    dpi : float
        Of the printer.
    colorants : tuple of str
    K : int
        Clusters; 0 = 3 for two colorants, else their number.
    partition : "light" or "lab"
        How pixels are sorted, see `paxel_design.visibility.moire`.
    seed : int
        Of blue noise.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    resolution: tuple[int, int]
    width_mm: float
    distance_mm: float
    dpi: float = 1440.0
    colorants: tuple[str, ...] = ("black", "white")
    K: int = 0
    luminance_cd_m2: float = 100.0
    partition: Partition = "lab"
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value in (
            ("width", self.width_mm),
            ("distance", self.distance_mm),
            ("dpi", self.dpi),
            ("luminance", self.luminance_cd_m2),
            ("projector", min(self.resolution)),
        ):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"--{name} must be > 0, got {value}")
        if len(self.colorants) < 2:
            raise InputError(f"--colorants must be two or more, such as black,white; got {','.join(self.colorants)}")
        least = len(self.colorants)
        if self.K not in (0, least, least + 1):
            raise InputError(f"--clusters must be {least} or {least + 1} for {least} colorants, got {self.K}")
        smallest_px = FEWEST_PIXELS * 25.4 / self.dpi / self.pitch_mm
        if smallest_px > DOTS_PX[-1]:
            raise InputError(
                f"a dot of {DOTS_PX[-1]:g} projector pixels ({DOTS_PX[-1] * self.pitch_mm:.3f} mm) is less than "
                f"{FEWEST_PIXELS:g} dots of the printer at {self.dpi:g} dpi: use a finer printer or a larger --width"
            )

    @property
    def pitch_mm(self) -> float:
        """Width of a projector pixel on the wall."""
        return self.width_mm / self.resolution[0]

    @property
    def clusters(self) -> int:
        """K, with its default."""
        return self.K or (3 if len(self.colorants) == 2 else len(self.colorants))


@dataclass(frozen=True)
class Candidate:
    """A layout at an angle and a dot size, and its figures.

    Attributes
    ----------
    layout : str
    angle_deg, dot_size_mm : float
        On the printer's grid, where `step_px` is given.
    asked_angle_deg, asked_dot_px : float
        Place in the table: the angle before it was moved, and the edge in projector pixels.
    step_px : (int, int) or None
        A dot's edge in the printer's dots, across and up; None where no place on the grid was near enough.
    visibility : PatternVisibility
    moire : Moire
        The worst over 3 % of zoom to either side.
    effect : EffectSize
    score : float
        Effect in L*, less what is seen of print and moire.
    reasons : tuple of str
        In words; of the best only.
    """

    layout: str
    angle_deg: float
    dot_size_mm: float
    asked_angle_deg: float
    asked_dot_px: float
    step_px: tuple[int, int] | None
    visibility: PatternVisibility
    moire: Moire
    effect: EffectSize
    reasons: tuple[str, ...] = ()

    @property
    def seen(self) -> float:
        """Luminance and opponent colours of the print together, threshold units."""
        return float(np.hypot(self.visibility.luminance, self.visibility.opponent))

    @property
    def score(self) -> float:
        """Effect / sqrt((1 + (print / `SEEN_PRINT`)^2) (1 + (moire / `SEEN_MOIRE`)^2))."""
        fallen = (1 + (self.seen / SEEN_PRINT) ** 2) * (1 + (self.moire.visibility / SEEN_MOIRE) ** 2)
        return float(self.effect.lightness / np.sqrt(fallen))

    @property
    def name(self) -> str:
        """Such as ``checkerboard, 30.0 degrees, 0.751 mm``."""
        return f"{self.layout}, {self.angle_deg:.1f} degrees, {self.dot_size_mm:.3f} mm"


@dataclass(frozen=True)
class Advice:
    """All candidates, the three best and those that no other beats in everything.

    Attributes
    ----------
    setup : Setup
    candidates : tuple of Candidate
        The best first.
    best : tuple of Candidate
        Three at most, simulated more finely, with volumes and reasons.
    """

    setup: Setup
    candidates: tuple[Candidate, ...]
    best: tuple[Candidate, ...] = field(default=())


def layouts_for(colorants: Sequence[str]) -> tuple[str, ...]:
    """Regular layouts and blue noise for so many colorants."""
    return ("checkerboard", "blue-noise") if len(colorants) == 2 else ("tiles", "blue-noise")


def advise(setup: Setup, progress: Progress = lambda *_: None) -> Advice:
    """Judge every layout, angle and dot size for a setup, and the three best more finely.

    Raises
    ------
    InputError
        If a colorant is unknown, or the colorants look alike under this projector.
    """
    _require_apart(setup)
    places = [
        (layout, angle, dot)
        for layout in layouts_for(setup.colorants)
        for angle in (ANGLES_DEG if layout != "blue-noise" else (0.0,))
        for dot in DOTS_PX
        if dot * setup.pitch_mm * setup.dpi / 25.4 >= FEWEST_PIXELS
    ]
    found = []
    for k, (layout, angle, dot) in enumerate(places):
        progress(f"{layout}, {angle:.0f} degrees, {dot:g} px a dot", k, len(places) + 3)
        found.append(_judged(setup, layout, angle, dot))
    ranked = sorted(found, key=lambda candidate: -candidate.score)
    best = []
    for k, candidate in enumerate(ranked[:3]):
        progress(f"closer look at {candidate.name}", len(places) + k, len(places) + 3)
        best.append(_closer(setup, candidate))
    best.sort(key=lambda candidate: -candidate.score)
    told = tuple(replace(candidate, reasons=_reasons(setup, candidate, found)) for candidate in best)
    return Advice(setup, tuple(ranked), told)


def _require_apart(setup: Setup) -> None:
    """Colorants that reflect alike are one to a projector of red, green and blue: fluorescent inks shine under none."""
    for a, b in combinations(colorants_of(setup.colorants), 2):
        if np.allclose(a.reflectance, b.reflectance, rtol=0.0, atol=_ALIKE):
            raise InputError(
                f"--colorants {a.name} and {b.name} look alike under the red, green and blue "
                "light that layouts are advised for; for fluorescent inks and a projector of one channel, use "
                "--monochrome, which proposes their shares"
            )


def pareto(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that no other beats in print, moire and effect at once; what is below a threshold counts as alike."""
    figures = np.array([[max(c.seen, 1.0), max(c.moire.visibility, 1.0), -c.effect.lightness] for c in candidates])
    beaten = [bool(np.any(np.all(figures <= own, axis=1) & np.any(figures < own, axis=1))) for own in figures]
    return [candidate for candidate, lost in zip(candidates, beaten, strict=True) if not lost]


def _judged(setup: Setup, layout: str, angle_deg: float, dot_px: float) -> Candidate:
    dot_mm, printed_deg, step = _on_the_grid(dot_px * setup.pitch_mm, angle_deg, setup.dpi)
    pattern = _pattern(setup, layout, dot_mm, printed_deg)
    visibility = pattern_visibility(layout_spectrum(pattern), setup.distance_mm, setup.luminance_cd_m2)
    moire = _worst_moire(setup, pattern, _ZOOMS, _PIECE_PX, _SAMPLES)
    model = simulated_model(pattern, setup.pitch_mm, setup.clusters, partition=setup.partition)
    effect = effect_size(model, volumes=False)
    return Candidate(layout, printed_deg, dot_mm, angle_deg, dot_px, step, visibility, moire, effect)


def _worst_moire(setup: Setup, pattern: Pattern, zooms: Sequence[float], size_px: int, samples: int) -> Moire:
    return worst_moire(
        pattern,
        [setup.pitch_mm * zoom for zoom in zooms],
        setup.distance_mm,
        K=setup.clusters,
        partition=setup.partition,
        luminance_cd_m2=setup.luminance_cd_m2,
        phases=1,
        size_px=size_px,
        samples=samples,
    )


def _on_the_grid(dot_mm: float, angle_deg: float, dpi: float) -> tuple[float, float, tuple[int, int] | None]:
    """Dot size and angle on the printer's grid, and a dot's edge in its dots; as asked and None, where none is near."""
    for change in _SIZE_CHANGES:
        try:
            snapped = snap_to_printer(dot_mm * change, angle_deg, dpi)
        except InputError:  # no lattice within its tolerances
            continue
        return snapped.dot_size_mm, snapped.angle_deg, snapped.step_px
    return dot_mm, angle_deg, None


def _closer(setup: Setup, candidate: Candidate) -> Candidate:
    """The same with a finer moire and the volumes of its product pair."""
    pattern = _pattern(setup, candidate.layout, candidate.dot_size_mm, candidate.angle_deg)
    moire = _worst_moire(setup, pattern, _FINE_ZOOMS, _FINE_PIECE_PX, _FINE_SAMPLES)
    model = simulated_model(pattern, setup.pitch_mm, setup.clusters, partition=setup.partition)
    return replace(candidate, moire=moire, effect=effect_size(model))


def _pattern(setup: Setup, layout: str, dot_mm: float, angle_deg: float) -> Pattern:
    # a torus of blue noise large enough for its spectrum, small enough to be made at once
    side_mm = (_BLUE_NOISE_CELLS - 2) * dot_mm
    return make_pattern(layout, setup.colorants, dot_mm, angle_deg, (side_mm, side_mm), setup.seed)


def _reasons(setup: Setup, chosen: Candidate, others: Sequence[Candidate]) -> tuple[str, ...]:
    """Why it is among the best, in whole sentences for a person."""
    most = max(other.effect.lightness for other in others)
    reasons = [
        f"effect: L* can move freely by {chosen.effect.L_pattern:.0f} on the pattern and {chosen.effect.L_white:.0f} "
        f"on white, {chosen.effect.lightness / most:.0%} of the largest of all candidates",
        f"print: {_seen(chosen.seen)} at {setup.distance_mm / 1000:g} m ({chosen.seen:.2g} thresholds)",
    ]
    grid = [
        other
        for other in others
        if other.layout == chosen.layout and other.asked_dot_px == chosen.asked_dot_px and other.asked_angle_deg == 0
    ]
    compared = ""
    if grid and chosen.asked_angle_deg != 0 and chosen.moire.visibility > 0:
        ratio = grid[0].moire.visibility / chosen.moire.visibility
        compared = f"; at 0 degrees it would be {ratio:.1f} times as strong" if ratio > 1 else ""
    period = f", stripes of {chosen.moire.period_mm:.0f} mm" if np.isfinite(chosen.moire.period_mm) else ""
    reasons.append(
        f"moire: {_seen(chosen.moire.visibility)} where one cluster is lit alone, at the worst zoom "
        f"({chosen.moire.visibility:.2g} thresholds{period}){compared}"
    )
    if found := beats(_pattern(setup, chosen.layout, chosen.dot_size_mm, chosen.angle_deg), setup.pitch_mm, 1):
        strongest = found[0]
        reasons.append(
            f"strongest beat at the zoom asked for: every {strongest.period_mm:.1f} mm, {strongest.direction_deg:.0f} "
            f"degrees, order {strongest.orders[0]}, {strongest.orders[1]} of the raster"
        )
    if chosen.step_px is not None:
        across, up = chosen.step_px
        reasons.append(f"printer: a dot's edge is exactly {across} dots across and {up} up at {setup.dpi:g} dpi")
    else:
        reasons.append(f"printer: no place on the grid of {setup.dpi:g} dpi is near; dots differ by one printer dot")
    if chosen.layout == "blue-noise":
        reasons.append("random: what is slow in it is the print's own noise, not stripes; it is seen more than a grid")
    return tuple(reasons)


def _seen(thresholds: float) -> str:
    if thresholds < 1:
        return "not seen"
    return "just seen" if thresholds < 3 else "seen" if thresholds < 10 else "plain"
