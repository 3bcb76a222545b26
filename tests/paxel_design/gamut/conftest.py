"""Models of every kind, and linear programming as the oracle of what a model can show."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.model.pattern import colorant_library
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.optics.spectra import primaries

Oracle = Callable[[PredictionModel, NDArray[np.float64]], bool]


def make_model(
    A_pattern: NDArray[np.float64], A_white: NDArray[np.float64] | None, clusters: int, black: float = 1e-3
) -> PredictionModel:
    """A model whose black level is `black` times full, normalised so that full white has Y = 1."""
    brightest = A_pattern if A_white is None else A_white
    scale = 1 / ((1 + black) * brightest[1].sum())
    surfaces = [
        None if A is None else SurfaceModel(scale * A, scale * black * A.sum(axis=1)) for A in (A_pattern, A_white)
    ]
    channels = A_pattern.shape[1] // clusters
    code = np.linspace(0, 1, 3)
    assert surfaces[0] is not None
    return PredictionModel(
        tuple(f"channel {j}" for j in range(channels)),
        tuple(f"cluster {i}" for i in range(clusters)),
        surfaces[0],
        surfaces[1],
        D65_XYZ,
        ProjectorResponse((code,) * channels, (code**2.2,) * channels),
    )


@pytest.fixture(scope="session")
def measured_model() -> Callable[..., PredictionModel]:
    """Prints in grays, or in red to yellow, measured with errors: no two generators are exactly parallel."""

    def make(
        seed: int, clusters: int = 2, channels: int = 3, colored: bool = False, noise: float = 3e-3
    ) -> PredictionModel:
        rng = np.random.default_rng(seed)
        primaries = np.column_stack((linear_sRGB_to_XYZ(np.eye(3)).T, [0.4, 0.5, 0.1]))[:, :channels]
        solids = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1], [1, 1, 0]])[:clusters]
        ink = 0.05 + 0.85 * solids if colored else np.linspace(0.04, 1, clusters)[:, None]
        reflectance = 0.85 * ink + 0.15 * ink.mean(axis=0)
        A_white = np.tile(primaries / clusters, clusters)
        A_pattern = np.concatenate([r[:, None] * primaries / clusters for r in reflectance], axis=1)
        errors = 1 + noise * rng.standard_normal((2, 3, A_white.shape[1]))
        return make_model(A_pattern * errors[0], A_white * errors[1], clusters)

    return make


@pytest.fixture(scope="session")
def four_channel_model() -> Callable[..., PredictionModel]:
    """Two measured inks under the measured red, green, blue and white of one projector, 15 % of the light spilt."""

    def make(*inks: str) -> PredictionModel:
        light = primaries(("red", "green", "blue", "white"), "rgbw")
        library = colorant_library()
        solids = np.array([library[ink].reflectance for ink in inks])
        reflectances = 0.85 * solids + 0.15 * solids.mean(axis=0)
        paper = np.tile(library["white"].reflectance, (len(inks), 1))
        A = [np.concatenate([spectra_to_XYZ(light * r) for r in side]).T / len(inks) for side in (reflectances, paper)]
        return make_model(A[0], A[1], len(inks))

    return make


@pytest.fixture(scope="session")
def uv_model(model_of: Callable[..., PredictionModel]) -> PredictionModel:
    """Red, green and blue fluorescent inks under one UV channel: one surface."""
    inks = [colorant_library()[name].fluorescence for name in ("uv-red", "uv-green", "uv-blue")]
    return model_of(np.column_stack([spectra_to_XYZ(ink.emission) for ink in inks if ink is not None]), None, 3)


@pytest.fixture(scope="session")
def model_of() -> Callable[..., PredictionModel]:
    """A model of given matrices."""
    return make_model


@pytest.fixture(scope="session")
def is_reachable() -> Oracle:
    """Whether some x in [0, 1]^n gives the colours, 3 or 6 numbers, by HiGHS: an input, not a half-space."""

    def oracle(model: PredictionModel, colors: NDArray[np.float64]) -> bool:
        surfaces = list(model.surfaces.values())
        A = np.concatenate([s.A for s in surfaces])
        wanted = colors - np.concatenate([s.black for s in surfaces])
        # Smallest e with -e <= A x - wanted <= e.
        one = np.ones((len(A), 1))
        result = linprog(
            np.append(np.zeros(A.shape[1]), 1.0),
            A_ub=np.block([[A, -one], [-A, -one]]),
            b_ub=np.append(wanted, -wanted),
            bounds=[(0, 1)] * A.shape[1] + [(0, None)],
            method="highs",
        )
        assert result.status == 0
        return bool(result.fun < 1e-7)  # HiGHS keeps its constraints to 1e-7

    return oracle
