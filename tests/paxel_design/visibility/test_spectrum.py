"""Spectrum of a layout and its visibility: closed forms of the checkerboard, Parseval, turns and scales."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_design.patterns import make_pattern
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_design.visibility.sensitivity import (
    FIELD_DEG,
    cycles_per_degree,
    luminance_sensitivity,
    opponent_sensitivity,
)
from paxel_design.visibility.spectrum import layout_spectrum, pattern_visibility, radial_average
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern


def checker(dot_mm: float = 0.75, angle_deg: float = 30.0) -> Pattern:
    return make_pattern("checkerboard", ("black", "white"), dot_mm, angle_deg, (60, 40))


@given(st.floats(0.2, 2), st.floats(-90, 90))
def test_a_checkerboard_has_its_fundamental_and_odd_harmonics(dot_mm: float, angle_deg: float) -> None:
    """Each line (u, v), u and v odd halves, has amplitude (Yw - Yk)/2 * sinc(u) sinc(v)."""
    spectrum = layout_spectrum(checker(dot_mm, angle_deg))
    Y = colorants_to_XYZ(checker().palette)[:, 1]
    strongest = np.argsort(spectrum.contrast)[::-1]
    lines = spectrum.frequency_per_mm[strongest[:2]]
    turned = np.deg2rad(angle_deg + np.array([45.0, 135.0]))
    expected = np.stack([np.cos(turned), np.sin(turned)], axis=1) / (np.sqrt(2) * dot_mm)
    for line in expected:
        assert min(np.abs(lines - line).max(axis=1).min(), np.abs(lines + line).max(axis=1).min()) < 1e-9
    depth = abs(Y[1] - Y[0]) / 2 / Y.mean()
    assert spectrum.contrast[strongest[0]] == pytest.approx(2 * depth * (2 / np.pi) ** 2, rel=1e-9)


def test_all_power_of_fine_cells_is_in_the_lines() -> None:
    """Parseval, to what lies beyond two cycles a cell: each cell's sinc^2 leaves under 0.11 of the power there."""
    rng = np.random.default_rng(1)
    cells = rng.integers(0, 2, (16, 16)).astype(np.uint8)
    pattern = Pattern("random", ("black", "white"), cells, 0.5, 0.0, (60.0, 40.0))
    spectrum = layout_spectrum(pattern)
    Y = colorants_to_XYZ(pattern.palette)[cells][..., 1]
    power = float(np.sum(spectrum.contrast**2) / 2)
    variance = float(Y.var() / Y.mean() ** 2)
    assert 0.80 * variance < power < variance


def test_the_printed_scale_stretches_the_spectrum() -> None:
    from dataclasses import replace

    plain, wide = layout_spectrum(checker()), layout_spectrum(replace(checker(), print_scale=(1.02, 1.0)))
    assert np.allclose(wide.frequency_per_mm * [1.02, 1.0], plain.frequency_per_mm)


def test_blue_noise_is_alike_in_all_directions_and_a_checkerboard_is_not() -> None:
    noise = layout_spectrum(make_pattern("blue-noise", ("black", "white"), 0.75, 0.0, (60, 40), seed=3))
    _, power, anisotropy = radial_average(noise, bins=20, limit_per_mm=0.6)
    strong = power > 0.5 * np.nanmax(power)
    assert np.nanmax(anisotropy[strong]) < 0.2  # rings of a hundred lines and more: sampling alone gives about 0.1
    _, power, anisotropy = radial_average(layout_spectrum(checker()), bins=20)
    assert np.nanmax(anisotropy[power > 0]) > 0.95


def test_sensitivity_has_bartens_shape() -> None:
    """Highest between 2 and 6 cycles a degree, some hundreds; limits as of every eye: 1 between 40 and 60."""
    f = np.geomspace(0.1, 100, 300)
    S = luminance_sensitivity(f, 100.0)
    assert 2 < f[np.argmax(S)] < 6
    assert 300 < S.max() < 1000
    assert 40 < f[np.flatnonzero(S > 1)[-1]] < 60
    assert luminance_sensitivity(0.0) == 0
    assert np.all(luminance_sensitivity([10, 20], 1.0) < luminance_sensitivity([10, 20], 100.0))
    opponent = opponent_sensitivity([0.5, 5, 20])
    assert np.all(np.diff(opponent, axis=0) < 0)
    assert np.all(opponent[-1] < 0.01 * opponent[0])


@pytest.mark.parametrize("luminance_cd_m2", [1.0, 100.0, 2000.0])
def test_sensitivity_is_bartens_as_colour_science_has_it(luminance_cd_m2: float) -> None:
    from colour import contrast

    f = np.geomspace(0.05, 80, 50)
    pupil_mm = contrast.pupil_diameter_Barten1999(luminance_cd_m2, FIELD_DEG)
    theirs = contrast.contrast_sensitivity_function_Barten1999(
        f,
        sigma=contrast.sigma_Barten1999(d=pupil_mm),
        E=contrast.retinal_illuminance_Barten1999(luminance_cd_m2, pupil_mm),
        X_0=FIELD_DEG,
    )
    np.testing.assert_allclose(luminance_sensitivity(f, luminance_cd_m2), theirs, rtol=1e-9)  # the same formula


def test_farther_away_is_less_visible() -> None:
    spectrum = layout_spectrum(checker())
    seen = [pattern_visibility(spectrum, d).luminance for d in (1000, 2000, 2700, 4000, 6000)]
    assert seen == sorted(seen, reverse=True)
    assert seen[0] > 50
    assert 1 < seen[2] < 5  # the design's limit: 2.7 m for 0.75 mm
    assert seen[3] < 0.1


def test_blue_noise_is_more_visible_than_a_checkerboard() -> None:
    noise = make_pattern("blue-noise", ("black", "white"), 0.75, 0.0, (60, 40))
    assert pattern_visibility(noise, 4000).luminance > 10 * pattern_visibility(checker(), 4000).luminance


def test_cycles_per_degree_of_a_known_grating() -> None:
    assert cycles_per_degree(1.0, 1000.0) == pytest.approx(17.455, abs=1e-3)
    for distance in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="distance_mm"):
            cycles_per_degree(1.0, distance)
    with pytest.raises(InputError, match="luminance_cd_m2"):
        luminance_sensitivity(1.0, 0.0)
