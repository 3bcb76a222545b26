"""What a printed pattern is: cells of colorants, a dot size, an angle, and the one label function.

Everything that needs to know which colorant lies where (the print, its preview, the virtual bench, the
design registration) asks `Pattern.label`. Nothing here knows how a layout is made or how it is printed.

Geometry: millimetres, origin at the centre of the pattern area, +x right, +y up, angles counter-clockwise.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.fluorescence import Fluorescence, fluorescent_triad

__all__ = ["Colorant", "Pattern", "colorant_library"]

OUTSIDE = 255

# A proof shows the fluorescent inks in the colours of their light, so that a sheet printed without their plates is seen
# to be wrong at once; their own plates print colourless ink.
_PROOF_OF_TRIAD = {"uv-red": (0.0, 0.6, 0.5, 0.0), "uv-green": (0.5, 0.0, 0.6, 0.0), "uv-blue": (0.6, 0.4, 0.0, 0.0)}


@dataclass(frozen=True, eq=False)
class Colorant:
    """One colour of the print (a solid patch of it, or the bare paper).

    Attributes
    ----------
    name : str
        As it stands in ``paxel.toml``, in cluster names and on the print sheet.
    reflectance : (81,) float64 array
        Spectral reflectance on the paper, 0..1, on `WAVELENGTHS_NM`.
    cmyk : tuple of 4 floats
        Recipe for the printer, 0..1; of a spot colour, how a proof without its plate shows it.
    spot : str
        Name of the plate that prints it, for inks that are no mixture of the printer's four; "" = from the recipe.
    fluorescence : Fluorescence, optional
        What it emits besides, or (of the paper) what a brightener in it does.
    """

    name: str
    reflectance: NDArray[np.float64]
    cmyk: tuple[float, float, float, float]
    spot: str = ""
    fluorescence: Fluorescence | None = None


@cache
def colorant_library() -> dict[str, Colorant]:
    """The built-in colorants by name.

    Smooth reflectances whose colours are the measured Neugebauer primaries of FOGRA39L (offset on coated
    paper; ``reports/make_colorants.py`` rebuilds the table), and three fluorescent inks, which look like the paper and
    shine under UV (`model.fluorescence.fluorescent_triad`); these are printed with plates of their own.
    """
    text = (files("paxel_runtime") / "data" / "colorants.csv").read_text(encoding="utf-8")
    library = {}
    for row in csv.reader(line for line in text.splitlines() if not line.startswith("#")):
        name, *numbers = row
        if name == "name":
            continue
        values = np.array(numbers, dtype=np.float64)
        c, m, y, k = values[:4]
        library[name] = Colorant(name, values[4:], (float(c), float(m), float(y), float(k)))
        assert library[name].reflectance.shape == WAVELENGTHS_NM.shape
    paper = library["white"].reflectance
    for name, fluorescence in fluorescent_triad().items():
        library[name] = Colorant(name, paper, _PROOF_OF_TRIAD[name], f"UV {name[3:].capitalize()}", fluorescence)
    return library


@dataclass(frozen=True, eq=False)
class Pattern:
    """A printed high-frequency pattern.

    Attributes
    ----------
    layout : str
        Name of the layout that filled `cells`, such as ``"checkerboard"``.
    colorants : tuple of str
        Names of the colorants; `cells` holds indices into it.
    cells : (rows, columns) uint8 array
        One torus of the pattern, repeated over the plane; row 0 is the lowest (+y up).
    dot_size_mm : float
        Edge of a cell in millimetres, > 0.
    angle_deg : float
        Rotation of the cells, counter-clockwise.
    size_mm : (float, float)
        Width and height of the pattern area; beyond it lies bare paper.
    seed : int
        Seed of the layout, where it has one.
    print_scale : (float, float)
        Size of the print in x and y, 1 = as designed; all other lengths are the design's.
    library : mapping of str to Colorant
        What the names of colorants mean, ``"white"`` (the paper) among them: `colorant_library`, and inks of your own.

    Raises
    ------
    InputError
        If `cells` is not a 2-D uint8 array of known colorants, or a length is not positive.
    """

    layout: str
    colorants: tuple[str, ...]
    cells: NDArray[np.uint8]
    dot_size_mm: float
    angle_deg: float
    size_mm: tuple[float, float]
    seed: int = 0
    print_scale: tuple[float, float] = (1.0, 1.0)
    library: Mapping[str, Colorant] = field(default_factory=colorant_library, repr=False)

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or self.cells.size == 0 or self.cells.dtype != np.uint8:
            raise InputError(
                f"a pattern's cells must be a 2-D uint8 array, got shape {self.cells.shape} of {self.cells.dtype}"
            )
        if int(self.cells.max()) >= len(self.colorants):
            raise InputError(
                f"a pattern's cells must be indices below its number of colorants ({len(self.colorants)}), "
                f"got {int(self.cells.max())}"
            )
        if not np.isfinite(self.angle_deg):
            raise InputError(f"a pattern's angle_deg must be a finite number of degrees, got {self.angle_deg}")
        for name, value in (
            ("dot_size_mm", self.dot_size_mm),
            ("size_mm", min(self.size_mm)),
            ("print_scale", min(self.print_scale)),
        ):
            if not value > 0:
                raise InputError(f"a pattern's {name} must be > 0, got {value}")

    def label(self, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Index of the colorant at points of the wall; 255 outside the pattern area (bare paper).

        Parameters
        ----------
        x_mm, y_mm : arrays that broadcast together
            Millimetres from the centre of the pattern, +x right, +y up.

        Returns
        -------
        uint8 array
            ``label(floor(R(-angle) (p / print_scale) / dot))`` on the torus of cells.
        """
        x, y = np.broadcast_arrays(
            np.asarray(x_mm, np.float64) / self.print_scale[0], np.asarray(y_mm, np.float64) / self.print_scale[1]
        )
        angle = np.deg2rad(self.angle_deg)
        c, s = np.cos(angle) / self.dot_size_mm, np.sin(angle) / self.dot_size_mm
        column = np.floor(c * x + s * y).astype(np.int64) % self.cells.shape[1]
        row = np.floor(c * y - s * x).astype(np.int64) % self.cells.shape[0]
        inside = (np.abs(x) <= self.size_mm[0] / 2) & (np.abs(y) <= self.size_mm[1] / 2)
        return np.where(inside, self.cells[row, column], np.uint8(OUTSIDE))

    @property
    def palette(self) -> tuple[Colorant, ...]:
        """The colorants that `cells` are indices of.

        Raises
        ------
        InputError
            If the library lacks one.
        """
        for name in self.colorants:
            if name not in self.library:
                raise InputError(f"a colorant must be one of {', '.join(self.library)}, got {name!r}")
        return tuple(self.library[name] for name in self.colorants)

    def shares(self) -> NDArray[np.float64]:
        """Share of the area each colorant covers, (number of colorants,), summing to 1."""
        counts = [np.count_nonzero(self.cells == k) for k in range(len(self.colorants))]
        return np.array(counts) / self.cells.size
