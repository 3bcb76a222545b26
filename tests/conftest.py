"""Fixtures that several test files share."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: threads that wait for each other cost seconds

from collections.abc import Callable

import hypothesis
import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

os.environ["PAXEL_CACHE_DIR"] = ""  # no test reads or writes the user's cache, nor does a process it starts

# Everything random takes a seed: the same examples on every machine. `pytest --hypothesis-profile=search` draws others.
hypothesis.settings.register_profile("reproducible", derandomize=True, deadline=None)
hypothesis.settings.register_profile("search", derandomize=False, deadline=None)
hypothesis.settings.load_profile("reproducible")


@pytest.fixture(scope="session")
def bw_model() -> Callable[[int], PredictionModel]:
    """A black/white checkerboard under an sRGB projector: clusters share the area, ink 4 %, 15 % of the light spilt."""

    def make(K: int) -> PredictionModel:
        share = np.full(K, 1 / K)
        ink = np.linspace(0.04, 1.0, K)
        reflectance = 0.85 * ink + 0.15 * ink.mean()
        primaries = linear_sRGB_to_XYZ(np.eye(3)).T  # (3, N), columns
        black = D65_XYZ / 1000
        scale = 1 - 1 / 1000
        code = np.linspace(0, 1, 33)
        return PredictionModel(
            channels=("red", "green", "blue"),
            clusters=("black", "white", "black+white")[:K],
            pattern=SurfaceModel(
                scale * np.concatenate([a * r * primaries for a, r in zip(share, reflectance, strict=True)], 1),
                black * reflectance.mean(),
            ),
            white=SurfaceModel(scale * np.concatenate([a * primaries for a in share], 1), black),
            white_point=D65_XYZ,
            response=ProjectorResponse((code,) * 3, (code**2.2,) * 3),
        )

    return make


@pytest.fixture(scope="session")
def model_off_the_bench() -> Callable[[Installation, NDArray[np.uint8]], PredictionModel]:
    """Of the whole wall of a bench with three channels: the mean light of single clusters and channels at full."""

    def make(installation: Installation, labels: NDArray[np.uint8]) -> PredictionModel:
        from paxel_runtime.stages import open_bench

        bench, code, RGB = open_bench(installation), np.arange(256) / 255, ("red", "green", "blue")
        surfaces = {}
        for surface in ("pattern", "white"):
            columns = []
            for cluster in (0, 1):
                for j in range(3):
                    codes = np.zeros((*labels.shape, 3), np.uint8)
                    codes[..., j] = 255 * (labels == cluster)
                    columns.append(bench.view_XYZ(codes, surface)[20:-20, 20:-20].mean(axis=(0, 1)))
            surfaces[surface] = SurfaceModel(np.array(columns, np.float64).T, np.zeros(3))
        full = surfaces["white"].predict_XYZ(np.ones(6))
        response = ProjectorResponse((code,) * 3, tuple(bench.truth.response(c, code) for c in RGB))
        return PredictionModel(RGB, ("black", "white"), surfaces["pattern"], surfaces["white"], full, response)

    return make
