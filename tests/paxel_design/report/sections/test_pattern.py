"""The chapter on the pattern: true scale, what is seen, and figures of today's viewer."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paxel_design.report.content import Chart, Paragraph, Pictures, Quantity, Section, filled
from paxel_design.report.sections import pattern
from paxel_design.report.sections.pattern import section
from paxel_design.report.source import ReportSource, installation_source
from paxel_design.stages.print_sheet import visibility_of
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import sRGB_to_linear_sRGB
from paxel_runtime.printed import printed_pattern
from paxel_runtime.settings import make_settings

Check = Callable[[Section], None]
Follow = Callable[[Mapping[str, Quantity], Path], int]


@pytest.fixture(scope="module")
def source(calibrated: Installation) -> ReportSource:
    return installation_source(calibrated)


@pytest.fixture(scope="module")
def made(source: ReportSource) -> Section:
    return section(source)


def test_figures_are_those_of_the_print(made: Section, calibrated: Installation, check_sources: Follow) -> None:
    assert check_sources(made.quantities, calibrated.path) > 20
    assert made.quantities["pattern.dot_px"].value == pytest.approx(0.75 / (35.1 / 240))
    assert {verdict.quantity for verdict in made.verdicts} == {"pattern.seen", "pattern.moire"}
    for block in made.blocks:
        for text in (getattr(block, "text", ""), getattr(block, "caption", "")):
            filled(text, made.quantities)


def test_the_crop_is_at_true_scale_with_a_ruler(made: Section) -> None:
    (crops,) = (block for block in made.blocks if isinstance(block, Pictures) and block.name == "pattern-crops")
    crop = crops.pictures[0]
    assert crop.width_mm is not None
    px_per_mm = crop.picture.shape[1] / crop.width_mm
    assert px_per_mm == 12
    light = sRGB_to_linear_sRGB(crop.picture[: round(30 * px_per_mm), :, 1] / 255)
    dots = light > (light.min() + light.max()) / 2
    assert dots.mean() == pytest.approx(0.5, abs=0.01)  # a checkerboard; the crop cuts some dots
    window = np.outer(*(np.hanning(n) for n in light.shape))
    spectrum = np.abs(np.fft.rfft2((light - light.mean()) * window))
    row, column = np.unravel_index(spectrum.argmax(), spectrum.shape)
    across, up = np.fft.rfftfreq(light.shape[1])[column], np.fft.fftfreq(light.shape[0])[row]
    # the diagonal of a cell, sqrt 2 x 0.75 mm; a line of the spectrum is 1/28 mm wide
    assert np.hypot(across, up) * px_per_mm == pytest.approx(1 / (np.sqrt(2) * 0.75), abs=1 / 28)


def test_another_viewer_is_told_of_anew(source: ReportSource, monkeypatch: pytest.MonkeyPatch) -> None:
    installation = source.installation
    assert installation is not None
    nearer = replace(installation, settings=make_settings(overrides={
        **{k: v for k, v in installation.settings.values().items() if k.startswith(("projector.w", "projector.r"))},
        "viewing.distance_mm": 1000.0,
    }))  # fmt: skip
    monkeypatch.setattr(pattern, "moire_pictures", lambda *_, **__: (np.zeros((320, 320, 3), np.uint8),) * 2)
    made = section(replace(source, installation=nearer))
    expected = visibility_of(printed_pattern(nearer), nearer.settings)
    quantity = made.quantities["pattern.seen_luminance"]
    assert quantity.value == expected["print"]["luminance"]
    assert quantity.source.startswith("computed")
    assert quantity.value > 10 * source.records["print/visibility.json"]["print"]["luminance"]


def test_a_model_alone_says_what_it_cannot_tell(source: ReportSource) -> None:
    made = section(ReportSource(source.model, Path("model.json")))
    (block,) = made.blocks
    assert isinstance(block, Paragraph)
    assert not made.quantities


def test_the_spectrum_shows_the_lattice_of_a_checkerboard(made: Section) -> None:
    (chart,) = (block for block in made.blocks if isinstance(block, Chart))
    points = chart.figure.axes[0].collections[0].get_offsets()
    strongest = np.hypot(*np.asarray(points).T).min()
    assert strongest == pytest.approx(1 / (np.sqrt(2) * 0.75))  # the diagonal of a cell: sqrt 2 x 0.75 mm
