"""Pixels sorted anew: models of clusters whose colorants are known, and the files of a calibration."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paxel_design.what_if.pixels import Pixels, model_of_pixels, pixels_of, sorted_anew
from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.settings import make_settings
from paxel_runtime.storage import write_image, write_npz

INKS = np.array([0.03, 0.95])
NAMES = ("black", "white")


def pixels(count: int = 4000) -> Pixels:
    """Pixels with any share of white, sorted at a half."""
    white = np.random.default_rng(0).beta(0.3, 0.3, count).astype(np.float32)
    return Pixels(np.stack([1 - white, white], axis=1), (white > 0.5).astype(np.uint8))


def model_by_hand(found: Pixels, labels: np.ndarray, K: int) -> PredictionModel:
    """What clusters of these pixels return, added up pixel by pixel; no black level."""
    primaries = linear_sRGB_to_XYZ(np.eye(3)).T
    light = np.array([np.sum(labels == k) for k in range(K)]) / len(labels)
    back = np.array([np.sum(found.coverage[labels == k] @ INKS) for k in range(K)]) / len(labels)
    return PredictionModel(
        ("red", "green", "blue"),
        tuple(f"cluster {k}" for k in range(K)),
        SurfaceModel(np.concatenate([share * primaries for share in back], axis=1), np.zeros(3)),
        SurfaceModel(np.concatenate([share * primaries for share in light], axis=1), np.zeros(3)),
        D65_XYZ,
        ProjectorResponse((np.linspace(0, 1, 2),) * 3, (np.linspace(0, 1, 2),) * 3),
    )


@pytest.mark.parametrize("K", [2, 3, 5])
def test_other_clusters_have_the_columns_of_their_pixels(K: int) -> None:
    found = pixels()
    model = model_by_hand(found, found.labels, 2)
    labels = (found.coverage[:, 1] * K).clip(0, K - 1).astype(np.uint8)
    there, expected = model_of_pixels(model, found, labels, K), model_by_hand(found, labels, K)
    assert there.white is not None
    assert expected.white is not None
    # the colorants' colours follow exactly from two clusters of two colorants; coverages are float32
    np.testing.assert_allclose(there.pattern.A, expected.pattern.A, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(there.white.A, expected.white.A, rtol=1e-5)


@pytest.mark.parametrize("by", ["kmeans", "design"])
def test_pixels_are_sorted_by_what_they_light(by: str) -> None:
    found = pixels()
    labels = sorted_anew(model_by_hand(found, found.labels, 2), found, NAMES, 3, by)  # type: ignore[arg-type]
    white = found.coverage[:, 1]
    # black, then white, then what lies between: each a run of shares
    assert white[labels == 0].max() <= white[labels == 2].min()
    assert white[labels == 2].max() <= white[labels == 1].min()


def test_fewer_clusters_than_colorants_are_refused() -> None:
    found = pixels()
    with pytest.raises(InputError, match=r"clusters\.count"):
        sorted_anew(model_by_hand(found, found.labels, 2), found, NAMES, 1, "kmeans")


def test_one_surface_has_no_white_columns() -> None:
    found = pixels()
    model = replace(model_by_hand(found, found.labels, 2), white=None)
    assert model_of_pixels(model, found, found.labels, 2).white is None


def test_pixels_are_read_from_the_calibration(tmp_path: Path) -> None:
    installation = Installation.create(tmp_path / "show", make_settings("bw-checkerboard"))
    assert pixels_of(installation) is None
    folder = installation.folder("calibration")
    folder.mkdir()
    labels = np.array([[0, 1, 255], [1, 0, 255]], np.uint8)
    white = np.array([[0, 255, 0], [204, 51, 0]], np.uint8)
    coverage = np.repeat(np.stack([255 - white, white], axis=-1)[:, :, None], 3, axis=2)
    write_npz(folder / "coverages.npz", coverage=coverage)
    write_image(folder / "clusters.png", labels)
    found = pixels_of(installation)
    assert found is not None
    np.testing.assert_array_equal(found.labels, [0, 1, 1, 0])
    np.testing.assert_allclose(found.coverage[:, 1], [0, 1, 0.8, 0.2], atol=1e-6)
    write_image(folder / "clusters.png", labels[:, :2])
    assert pixels_of(installation) is None  # of another calibration
