"""Simulated prints: limits that have a closed form, and the simulation of the advice."""

from dataclasses import replace

import numpy as np
import pytest

from paxel_design.advice import simulated_model
from paxel_design.patterns import make_pattern
from paxel_design.what_if.figures import room_of
from paxel_design.what_if.simulated_print import Lighting, simulated_print
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern

PITCH_MM = 0.1465
BW = ("black", "white")


def checkerboard(dot_mm: float = 0.75, angle_deg: float = 30.0) -> Pattern:
    return make_pattern("checkerboard", BW, dot_mm, angle_deg, (80.0, 50.0))


def full_light(pattern: Pattern, lighting: Lighting) -> np.ndarray:
    """XYZ of the whole pattern under full light, Y = 1 for the paper."""
    return simulated_print(pattern, lighting).pattern.A.sum(axis=1) / (1 - lighting.black)


def mean_XYZ(reflectance: np.ndarray, pattern: Pattern) -> np.ndarray:
    """XYZ of a reflectance under equal amounts of the projector's primaries, Y = 1 for the paper."""
    from paxel_design.what_if.simulated_print import _primaries

    light = sum(_primaries().values())
    paper = spectra_to_XYZ(light * pattern.library["white"].reflectance)
    return np.asarray(spectra_to_XYZ(light * reflectance) / paper[1])


def test_without_scattering_the_print_is_the_mean_of_its_colorants() -> None:
    """Murray and Davies: every path leaves where it entered."""
    pattern = checkerboard()
    inks = np.array([colorant.reflectance for colorant in pattern.palette])
    seen = full_light(pattern, Lighting(PITCH_MM, 2, scattering_mm=0.0))
    # 96 pixels a side hold a few hundred cells, of which half are black to a percent
    np.testing.assert_allclose(seen, mean_XYZ(pattern.shares() @ inks, pattern), rtol=0.015)


def test_with_endless_scattering_the_print_follows_yule_and_nielsen() -> None:
    """Light leaves anywhere: each passage takes the mean transmittance, the factor n = 2 of Yule and Nielsen (1951)."""
    pattern = checkerboard()
    inks = np.array([colorant.reflectance for colorant in pattern.palette])
    seen = full_light(pattern, Lighting(PITCH_MM, 2, scattering_mm=20.0))
    expected = mean_XYZ((pattern.shares() @ np.sqrt(inks)) ** 2, pattern)
    # 96 paths a pixel all share one set of ways: their mean is that of few places
    np.testing.assert_allclose(seen, expected, rtol=0.03)


def test_dots_of_many_pixels_show_their_own_inks() -> None:
    pattern = checkerboard(dot_mm=30 * PITCH_MM)
    model = simulated_print(pattern, Lighting(PITCH_MM, 2, scattering_mm=0.0))
    assert model.white is not None
    Y = model.pattern.A[1].reshape(2, 3).sum(axis=1) / model.white.A[1].reshape(2, 3).sum(axis=1)
    ink = mean_XYZ(pattern.palette[0].reflectance, pattern)[1]
    # at an edge half a pixel's light falls beyond: 4 edges of a dot of 30 pixels, a pixel wide
    assert ink < Y[0] < ink + 4 / 30 * 0.25
    assert 1 - 4 / 30 * 0.25 < Y[1] < 1


def test_all_light_reaches_the_white_sheet() -> None:
    for K in (2, 3, 5):
        model = simulated_print(checkerboard(), Lighting(PITCH_MM, K, black=0.01))
        assert model.white is not None
        np.testing.assert_allclose(model.white.A.sum(axis=1) + model.white.black, model.white_point, rtol=1e-12)
        assert model.n == 3 * K


def test_agrees_with_the_simulation_of_the_advice() -> None:
    """Two programmes for one thing: sums over a raster's neighbours there, paths of light here."""
    pattern = checkerboard()
    ours = room_of(simulated_print(pattern, Lighting(PITCH_MM, 2, sorted_by="design")))
    theirs = room_of(simulated_model(pattern, PITCH_MM, 2, partition="light"))
    # pixels are sorted by what their light meets here and by their area there: some 4 % of contrast, 10 % of volume
    assert ours.contrast == pytest.approx(theirs.contrast, rel=0.06)
    assert ours.volume == pytest.approx(theirs.volume, rel=0.15)


def test_more_scattering_mixes_the_dots() -> None:
    rooms = [room_of(simulated_print(checkerboard(), Lighting(PITCH_MM, 2, scattering_mm=s), 48)) for s in (0.1, 0.2)]
    assert rooms[0].contrast > rooms[1].contrast


def test_pixels_may_be_sorted_as_those_of_another_ink() -> None:
    pattern, lighting = checkerboard(), Lighting(PITCH_MM, 3)
    black = pattern.library["black"]
    darker = replace(pattern, library={**pattern.library, "black": replace(black, reflectance=black.reflectance / 9)})
    as_before = simulated_print(darker, lighting, 48, sorted_as=pattern)
    model = simulated_print(pattern, lighting, 48)
    assert as_before.white is not None
    assert model.white is not None
    # the same pixels light the same share of the white sheet
    np.testing.assert_array_equal(as_before.white.A, model.white.A)
    # light that passes the ink twice falls to a ninth, light that passes it once to a third, other light stays
    ratio = as_before.pattern.A / model.pattern.A
    assert np.all((ratio > 1 / 9) & (ratio < 1))


def test_fluorescent_inks_shine_under_one_channel() -> None:
    inks = ("uv-red", "uv-green", "uv-blue")
    pattern = make_pattern("tiles", inks, 0.75, 30.0, (80.0, 50.0))
    model = simulated_print(pattern, Lighting(PITCH_MM, 3, ("uv",), second_surface=False))
    assert model.white is None
    assert model.pattern.A.shape == (3, 3)
    np.testing.assert_allclose(model.pattern.A.sum(axis=1) + model.pattern.black, model.white_point, rtol=1e-9)
    x = model.pattern.A[0] / model.pattern.A.sum(axis=0)
    assert x[0] == max(x)  # red is the reddest


def test_what_cannot_be_printed_is_refused() -> None:
    with pytest.raises(InputError, match="pitch_mm > 0"):
        Lighting(0.0, 2)
    with pytest.raises(InputError, match=r"clusters\.count"):
        simulated_print(checkerboard(), Lighting(PITCH_MM, 1))
    pattern = checkerboard()
    pale = replace(pattern.library["black"], reflectance=0.95 * pattern.library["white"].reflectance)
    with pytest.raises(CalibrationError, match="must differ by at least"):
        simulated_print(replace(pattern, library={**pattern.library, "black": pale}), Lighting(PITCH_MM, 2), 32)
