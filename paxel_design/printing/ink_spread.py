"""Ink spread from readings of the test sheet: how far the edge of a printed dot grows, apart from what the paper does.

Dots look larger than they are drawn for two reasons. Ink grows outward by some micrometres (mechanical dot gain): the
PDF can shrink the dots by that. And light that enters the paper beside a dot leaves under it (optical dot gain, J. A.
C. Yule and W. J. Nielsen, TAGA Proc. 1951, 65-76): nothing is to be done about that, bench and prediction model take
it as it is. Both darken a pattern by its length of edges, but scattering saturates where it reaches over a dot, so
readings of several dot sizes tell them apart. Knows readings and dot sizes; knows no sheet.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import erf

from paxel_runtime.errors import InputError

__all__ = ["InkSpread", "Reading", "checkerboard_reflectance", "fit_ink_spread", "parse_readings"]

PAPER, SOLID = "paper", "solid"
"""What stands in place of a dot size for a patch without dots."""

_LEAST_NOISE = 0.003  # of the paper's reflectance: the repeatability of a hand-held spectrophotometer
_LARGEST_SPREAD_UM, _LARGEST_SCATTERING_UM = 200.0, 400.0
_LEAST_CONTRAST = 0.1


@dataclass(frozen=True, eq=False)
class Reading:
    """One patch as it was measured.

    Attributes
    ----------
    patch : str
        Its number on the sheet.
    colorant : str
        Its ink; ``"white"`` for paper.
    dot_mm : float
        Dot size of a checkerboard of ink and paper; 0 for a solid patch and for paper.
    values : (bands,) float64 array
        Reflectance, or anything proportional to it.
    """

    patch: str
    colorant: str
    dot_mm: float
    values: NDArray[np.float64]


@dataclass(frozen=True)
class InkSpread:
    """What the readings say.

    Attributes
    ----------
    ink_spread_um : float
        Growth of every edge of ink; negative where dots come out smaller than they are drawn.
    ink_spread_uncertainty_um : float
        Its standard uncertainty, from the misfit of the readings, at least 0.3 % of the paper's reflectance each.
    scattering_um : float
        Standard deviation of the light's way through the paper, along one axis.
    scattering_uncertainty_um : float
    misfit : float
        Root mean square difference of readings and fit, as a share of the paper's reflectance.
    patches : tuple of (str, str, float, float, float)
        Number, colorant, dot size in mm, and the share of ink that reading and fit look like (Murray-Davies).
    """

    ink_spread_um: float
    ink_spread_uncertainty_um: float
    scattering_um: float
    scattering_uncertainty_um: float
    misfit: float
    patches: tuple[tuple[str, str, float, float, float], ...]


def parse_readings(text: str, source: str = "measurements.csv") -> list[Reading]:
    """Read the table that goes with the test sheet.

    Lines are ``patch,colorant,dots_mm`` and one or more columns of readings: Y alone, X, Y and Z, or reflectances by
    wavelength. ``dots_mm`` is a dot size, ``solid`` or ``paper``. A patch may have several lines, and one
    without readings is passed over; ``#`` begins a comment.

    Raises
    ------
    InputError
        If a column is missing or a line holds no readings: the line, and what belongs there.
    """
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise InputError(f"{source} must hold the table of the test sheet, got an empty file")
    rows = list(csv.reader(io.StringIO("\n".join(line for _, line in lines)), skipinitialspace=True))
    header = [name.strip() for name in rows[0]]
    if header[:3] != ["patch", "colorant", "dots_mm"] or len(header) < 4:
        raise InputError(
            f"{source}, line {lines[0][0]}: columns must be patch,colorant,dots_mm and readings (Y; or X,Y,Z; or "
            f"wavelengths), got {','.join(header)}"
        )
    readings = []
    for (number, _), row in zip(lines[1:], rows[1:], strict=True):
        fields = [field.strip() for field in row]
        if len(fields) == len(header) and not any(fields[3:]):
            continue
        try:
            dots = 0.0 if fields[2] in (PAPER, SOLID) else float(fields[2])
            values = np.array(fields[3:], np.float64)
        except (IndexError, ValueError):
            raise InputError(
                f"{source}, line {number}: must hold numbers under {','.join(header[3:])}, got {row}"
            ) from None
        if values.size != len(header) - 3 or not np.isfinite(values).all() or values.min() < 0 or dots < 0:
            raise InputError(f"{source}, line {number}: must hold {len(header) - 3} readings >= 0, got {fields[3:]}")
        colorant = "white" if fields[2] == PAPER else fields[1]
        readings.append(Reading(fields[0], colorant, dots, values))
    if not readings:
        raise InputError(f"{source} must hold readings under {','.join(header[3:])}, got none: fill it in")
    return readings


def checkerboard_reflectance(
    transmittance: NDArray[np.float64], dot_mm: float, spread_mm: float, scattering_mm: float
) -> NDArray[np.float64]:
    """Mean reflectance of a checkerboard of ink and paper, the bare paper's being 1.

    Light passes the ink, scatters in the paper by a Gaussian s, and passes the ink again: the mean of T (s * T) with T
    = 1 on paper and t under ink. White squares of edge w = dot - 2 spread are left, so this is t^2 + 2 t (1 - t) a +
    (1 - t)^2 M with a their share of the area and M the chance that light which enters one leaves through one; in
    closed form, since the plane of squares is a sum of two products of a function of x and one of y.

    Parameters
    ----------
    transmittance : (...) array
        t of one passage, the square root of the solid's reflectance over the paper's.
    dot_mm : float
        Edge of a cell as drawn.
    spread_mm : float
        Growth of the ink's edge; negative: ink squares of dot + 2 spread are left.
    scattering_mm : float
        Standard deviation of s along one axis, >= 0.
    """
    t = np.asarray(transmittance, np.float64)
    edge = max(dot_mm - 2 * abs(spread_mm), 0.0)
    share = edge**2 / (2 * dot_mm**2)
    alike, across = (_both_passages(edge, dot_mm, offset, scattering_mm) for offset in (0.0, dot_mm))
    both = 2 * (alike**2 + across**2)
    if spread_mm < 0:  # what is counted is ink: its share, and the chance of ink at both passages
        share, both = 1 - share, 1 - 2 * share + both
    return t**2 + 2 * t * (1 - t) * share + (1 - t) ** 2 * both


def _both_passages(edge: float, dot: float, offset: float, sigma: float) -> float:
    """Mean over x of P(x) (s * P)(x + offset), P a box of width `edge` every two dots."""
    reach = int(np.ceil((edge + 8 * sigma) / (2 * dot))) + 1
    shift = offset + 2 * dot * np.arange(-reach, reach + 1)
    ramps = _mean_abs(shift - edge, sigma) + _mean_abs(shift + edge, sigma) - 2 * _mean_abs(shift, sigma)
    return float(ramps.sum()) / (4 * dot)


def _mean_abs(u: NDArray[np.floating], sigma: float) -> NDArray[np.floating]:
    """Mean of |u + sigma Z| for a normal Z."""
    if sigma < 1e-9:
        return np.abs(u)
    z = u / (np.sqrt(2) * sigma)
    return np.asarray(u * erf(z) + sigma * np.sqrt(2 / np.pi) * np.exp(-(z**2)), np.float64)


def fit_ink_spread(readings: Sequence[Reading]) -> InkSpread:
    """Growth of the ink's edges and scattering of the paper, one for all inks, by least squares.

    Parameters
    ----------
    readings : sequence of Reading
        Bare paper, and for each ink the solid and checkerboards of at least two dot sizes.

    Raises
    ------
    InputError
        If paper, a solid or a second dot size is missing, an ink is as light as the paper, or the readings cannot be
        what was printed.
    """
    paper = _mean([r for r in readings if r.colorant == "white"], "paper", "bare paper")
    dots = [r for r in readings if r.dot_mm > 0]
    if len({r.dot_mm for r in dots}) < 2:
        raise InputError(
            f"ink spread needs patches of at least two dot sizes, got {sorted({r.dot_mm for r in dots}) or 'none'}: "
            "one alone does not tell ink spread from scattering in the paper"
        )
    solids = {
        name: _solid([r for r in readings if r.colorant == name and r.dot_mm == 0], name, paper)
        for name in dict.fromkeys(r.colorant for r in dots)
    }
    seen = [r.values / paper for r in dots]

    def residuals(p: NDArray[np.float64]) -> NDArray[np.float64]:
        fitted = [
            checkerboard_reflectance(np.sqrt(solids[r.colorant]), r.dot_mm, p[0] / 1000, p[1] / 1000) for r in dots
        ]
        # bands of one reading err together: they count as one
        return np.concatenate([(a - b) / np.sqrt(a.size) for a, b in zip(fitted, seen, strict=True)])

    bounds = ((-_LARGEST_SPREAD_UM, 0.0), (_LARGEST_SPREAD_UM, _LARGEST_SCATTERING_UM))
    fits = [
        least_squares(residuals, start, bounds=bounds, x_scale=(10.0, 50.0), xtol=1e-12, ftol=1e-12)
        for start in ((0.0, 10.0), (10.0, 60.0), (40.0, 150.0))
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    square = float((best.fun**2).sum())
    noise = max(np.sqrt(square / max(len(dots) - 2, 1)), _LEAST_NOISE)
    uncertainty = noise * np.sqrt(np.diag(np.linalg.pinv(best.jac.T @ best.jac)))
    spread_um, scattering_um = (float(v) for v in best.x)
    misfit = float(np.sqrt(square / len(dots)))
    if misfit > 0.1 or abs(spread_um) > 0.99 * _LARGEST_SPREAD_UM:
        raise InputError(
            f"readings must fit dots that grow evenly, got a misfit of {misfit:.0%} of the paper's reflectance: were "
            "the patches read in the order of their numbers, and was the sheet printed at 100 %?"
        )
    patches = []
    for r, values in zip(dots, seen, strict=True):
        solid = solids[r.colorant]
        fitted = checkerboard_reflectance(np.sqrt(solid), r.dot_mm, spread_um / 1000, scattering_um / 1000)
        read, fit = (float(np.dot(1 - v, 1 - solid) / np.dot(1 - solid, 1 - solid)) for v in (values, fitted))
        patches.append((r.patch, r.colorant, r.dot_mm, read, fit))
    return InkSpread(spread_um, float(uncertainty[0]), scattering_um, float(uncertainty[1]), misfit, tuple(patches))


def _mean(readings: list[Reading], what: str, named: str) -> NDArray[np.float64]:
    if not readings:
        raise InputError(f"ink spread needs a reading of {named}: a line with {what} in the column dots_mm")
    values = np.mean([r.values for r in readings], axis=0)
    if values.min() <= 0:
        raise InputError(f"the reading of {named} must be > 0, got {values.min():g}")
    return np.asarray(values, np.float64)


def _solid(readings: list[Reading], name: str, paper: NDArray[np.float64]) -> NDArray[np.float64]:
    """Reflectance of a solid over the paper's."""
    solid = _mean(readings, SOLID, f"solid {name}") / paper
    if not solid.min() < 1 - _LEAST_CONTRAST:
        raise InputError(
            f"solid {name} must be at least {_LEAST_CONTRAST:.0%} darker than the paper in some column, got "
            f"{solid.min():.0%} of it: read X, Y and Z, or measure a darker ink"
        )
    return np.minimum(solid, 1.0)
