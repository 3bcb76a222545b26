"""The joint gamut: all pairs of colours (on the pattern, on the white surface) that one input can show at once.

XYZ is linear in the inputs, so the pairs are a zonotope in six dimensions, kept here as half-spaces (design:
section 8); with one surface it is a zonotope in three. Sections and erosions of it are colours of one surface, as
polytopes in XYZ. What each effect asks for stands in `subgamuts`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_design.gamut.gauge import support
from paxel_design.gamut.polytopes import Polytope, polytope, zonotope_half_spaces
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model.subgamut import SURFACES, TOLERANCE, PairGamut, min_slack

__all__ = ["JointGamut"]


@dataclass(frozen=True, eq=False)
class JointGamut:
    """What a model can show on its surfaces at once.

    Attributes
    ----------
    model : PredictionModel
        A spectral model, A (3, n), of one surface or two.

    Raises
    ------
    InputError
        If A is not one matrix for the whole surface, holds a number that is not finite, has an input that lights
        nothing, or the white surface is much darker than the pattern.
    """

    model: PredictionModel

    def __post_init__(self) -> None:
        for name, surface in self.model.surfaces.items():
            if surface.A.ndim != 2 or surface.black.shape != (3,):
                raise InputError(
                    f"model: surfaces.{name}.A must be one matrix (3, n) to have a joint gamut, got {surface.A.shape}; "
                    "for an image-based model take the median over the pattern"
                )
            if not (np.all(np.isfinite(surface.A)) and np.all(np.isfinite(surface.black))):
                raise InputError(f"model: surfaces.{name} must hold finite numbers")
        self._check_light()

    def _check_light(self) -> None:
        model = self.model
        dark = np.flatnonzero(np.all([np.all(s.A == 0, axis=0) for s in model.surfaces.values()], axis=0))
        if len(dark):
            cluster, channel = divmod(int(dark[0]), len(model.channels))
            raise InputError(
                f"model: A must have no column of zeros, got one at input {dark[0]} (channel "
                f"{model.channels[channel]} on cluster {model.clusters[cluster]}): it lights nothing; leave the "
                "cluster or the channel out, or measure it again"
            )
        if model.white is None:
            return
        on_pattern, on_white = (float(s.black[1] + s.A[1].sum()) for s in (model.pattern, model.white))
        # A gray sheet may be darker than a light pattern, but not half as dark, and no pattern is as light as paper.
        if on_white < on_pattern * (1 - 1e-6) and (on_pattern > 0.9 or on_white < 0.5 * on_pattern):
            raise InputError(
                f"model: the white surface must not be darker than the pattern, got Y = {on_white:.3g} and "
                f"{on_pattern:.3g} with every input at full; are the two surfaces swapped?"
            )

    @cached_property
    def _rows(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        surfaces = self.model.surfaces.values()
        return zonotope_half_spaces(
            np.concatenate([s.A for s in surfaces]).astype(np.float64),
            np.concatenate([s.black for s in surfaces]).astype(np.float64),
        )

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit rows over (XYZ on the pattern, XYZ on the white surface), (m, 6); (m, 3) with one surface."""
        return self._rows[0]

    @property
    def offsets(self) -> NDArray[np.float64]:
        """Inside is where ``normals @ pair <= offsets``, (m,)."""
        return self._rows[1]

    @property
    def pairs(self) -> PairGamut:
        """The joint gamut as data for the runtime.

        Raises
        ------
        InputError
            If the model has one surface.
        """
        self._require_two_surfaces()
        return PairGamut(self.normals, self.offsets, self.model.white_point)

    def slack(self, XYZ_pattern: ArrayLike, XYZ_white: ArrayLike | None = None) -> NDArray[np.float64]:
        """Distance of pairs to the nearest bounding plane, negative outside.

        Parameters
        ----------
        XYZ_pattern, XYZ_white : (..., 3) arrays
            The second is left out where the model has one surface.

        Returns
        -------
        (...) float64 array
        """
        if XYZ_white is not None:
            return self.pairs.slack(XYZ_pattern, XYZ_white)
        if self.model.white is not None:
            raise InputError("the model has two surfaces: slack and contains need XYZ_pattern and XYZ_white")
        return min_slack(self.normals, self.offsets, XYZ_pattern)

    def contains(
        self, XYZ_pattern: ArrayLike, XYZ_white: ArrayLike | None = None, tolerance: float = TOLERANCE
    ) -> NDArray[np.bool_]:
        """Whether pairs (..., 3), (..., 3) can be shown at once, (...) bool, up to `tolerance` in XYZ."""
        return self.slack(XYZ_pattern, XYZ_white) >= -tolerance

    def surface(self, shown_on: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Half-spaces (m, 3), (m,) of all colours of one surface, whatever the other then shows."""
        self._require_surface(shown_on)
        surface = self.model.surfaces[shown_on]
        return zonotope_half_spaces(surface.A.astype(np.float64), surface.black.astype(np.float64))

    def rows_of(self, shown_on: str) -> NDArray[np.float64]:
        """`normals` (m, 6) over (XYZ on `shown_on`, XYZ on the other surface)."""
        self._require_surface(shown_on)
        self._require_two_surfaces()
        return self.normals if shown_on == "pattern" else np.roll(self.normals, 3, axis=1)

    def erode(self, XYZ: ArrayLike, shown_on: str) -> Polytope:
        """E(S) = {p : (p, w) in J for all w in S}: colours that go with each colour of a set on the other surface.

        Parameters
        ----------
        XYZ : (v, 3) array
            Colours on the other surface; with them their whole convex hull is in S.
        shown_on : {"pattern", "white"}
            The surface of the result.

        Raises
        ------
        GamutError
            If no colour goes with all of S, or too few to have a volume.
        """
        rows = self.rows_of(shown_on)
        return polytope(rows[:, :3], self.offsets - support(rows[:, 3:], np.asarray(XYZ, np.float64)))

    def section(self, XYZ: ArrayLike, shown_on: str) -> Polytope:
        """{p : (p, c) in J}: colours of `shown_on` that go with the one colour `XYZ` (3,) on the other surface."""
        return self.erode(np.reshape(XYZ, (1, 3)), shown_on)

    def _require_surface(self, shown_on: str) -> None:
        if shown_on not in self.model.surfaces:
            raise InputError(f"shown_on must be one of {', '.join(self.model.surfaces)}; got {shown_on!r}")

    def _require_two_surfaces(self) -> None:
        if self.model.white is None:
            raise InputError(f"a joint gamut of pairs needs a model of two surfaces ({', '.join(SURFACES)}), got one")
