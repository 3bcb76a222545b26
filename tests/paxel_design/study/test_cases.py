"""What a study asks for, as cases and settings."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_design.study import Study, cases_of
from paxel_runtime.errors import SettingsError, UsageError


def test_the_standard_study_is_that_of_the_paper() -> None:
    cases = cases_of(Study())
    assert [(c.dot_size_mm, c.clusters) for c in cases] == [(mm, K) for mm in (0.5, 0.75, 1.0) for K in (2, 3, 5)]
    assert {(c.layout, c.angle_deg) for c in cases} == {("checkerboard", 30.0)}
    assert len({c.name for c in cases}) == 9
    assert len({c.print_name for c in cases}) == 3
    for case, settings in cases.items():
        assert settings.pattern.dot_size_mm == case.dot_size_mm
        assert settings.clusters.count == case.clusters
        assert settings.bench.quality == "realistic"
        assert settings.projector.width_mm / settings.projector.resolution[0] == pytest.approx(281 / 1920)


def test_every_combination_once() -> None:
    asked = Study(
        dot_sizes_mm=(0.6, 0.6, 0.8), layouts=("checkerboard", "blue-noise"), angles_deg=(0.0, 30.0), clusters=(3, 2, 3)
    )
    cases = list(cases_of(asked))
    assert len(cases) == len(set(cases)) == 2 * 2 * 2 * 2
    assert [c.clusters for c in cases[:2]] == [2, 3]  # one print after the other


@given(columns=st.integers(64, 1000), rows=st.integers(64, 1000), pitch_mm=st.floats(0.05, 2, allow_nan=False))
def test_the_print_covers_the_projection_and_the_camera_sees_its_pixels(columns, rows, pitch_mm) -> None:
    asked = Study(
        dot_sizes_mm=(1.0,), clusters=(2,), pitch_mm=pitch_mm, overrides={"projector.resolution": [columns, rows]}
    )
    (settings,) = cases_of(asked).values()
    size_mm = (columns * pitch_mm, rows * pitch_mm)
    assert all(have > needed for have, needed in zip(settings.pattern.size_mm, size_mm, strict=True))
    assert settings.camera.resolution[0] > 2 * columns


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (Study(overrides={"pattern.dot_size_mm": 0.5}), "use --dot-size"),
        (Study(overrides={"clusters.count": 3}), "use --clusters"),
        (Study(overrides={"projector.width_mm": 600.0}), "--pitch"),
        (Study(pitch_mm=0.0), "--pitch must be > 0 mm, got 0"),
        (Study(clusters=(1,)), "^checkerboard-0.5mm-30deg-K1: clusters.count must be >= 2, got 1$"),
        (Study(dot_sizes_mm=(-1.0,)), "pattern.dot_size_mm must be > 0, got -1"),
        (Study(preset="cmyrgb", layouts=("checkerboard",)), "colorants of a checkerboard must be two"),
        (Study(layouts=("hexagons",)), "pattern.layout must be"),
        (Study(preset="cmyk"), "--preset must be one of"),
        (Study(overrides={"bench.quality": "good"}), "bench.quality must be"),
        (Study(overrides={"projector.resolution": "large"}), "projector.resolution"),
        (Study(overrides={"projector.resolution": [1]}), "projector.resolution"),
    ],
)
def test_what_cannot_be_is_told_before_anything_runs(asked: Study, message: str) -> None:
    with pytest.raises((UsageError, SettingsError), match=message):
        cases_of(asked)


def test_as_many_clusters_as_colorants_where_there_are_more_than_two() -> None:
    assert {c.clusters for c in cases_of(Study(preset="cmyrgb"))} == {6}
    own = Study(preset="cmyrgb", overrides={"pattern.colorants": ["red", "green", "blue", "white"]})
    assert {c.clusters for c in cases_of(own)} == {4}
