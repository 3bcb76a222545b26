import numpy as np
import pytest
from PIL import Image

from paxel_design.patterns import colorants_of, make_pattern
from paxel_design.printing import write_preview
from paxel_design.printing.preview import Raster, pattern_detail, reflectance_to_linear_sRGB, render_pattern
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, linear_sRGB_to_sRGB, sRGB_to_linear_sRGB
from paxel_runtime.model.pattern import colorant_library


def codes_of(pattern):
    """sRGB codes of the colorants of a pattern."""
    linear = [reflectance_to_linear_sRGB(colorant.reflectance) for colorant in colorants_of(pattern.colorants)]
    return np.rint(255 * linear_sRGB_to_sRGB(np.clip(linear, 0, 1)))


def test_the_perfect_diffuser_is_white_and_a_gray_is_its_reflectance():
    assert reflectance_to_linear_sRGB(np.ones(81)) == pytest.approx(np.ones(3), abs=1e-12)
    assert reflectance_to_linear_sRGB(np.full(81, 0.2)) == pytest.approx(np.full(3, 0.2), abs=1e-12)


@pytest.mark.filterwarnings("ignore")  # colour-science warns of optional packages that are not there
def test_colours_are_those_of_colour_science():
    colour = pytest.importorskip("colour")
    for colorant in colorant_library().values():
        spectrum = colour.SpectralDistribution(colorant.reflectance, WAVELENGTHS_NM)
        XYZ = colour.sd_to_XYZ(spectrum, illuminant=colour.SDS_ILLUMINANTS["D65"], method="Integration") / 100
        linear = colour.XYZ_to_RGB(XYZ, "sRGB")
        # 0.002: half a code; ours scales to the 5 nm sum for D65, theirs to the rounded published white
        assert reflectance_to_linear_sRGB(colorant.reflectance) == pytest.approx(linear, abs=0.002), colorant.name


def test_a_magnified_crop_shows_the_colour_of_each_dot_at_its_centre():
    pattern = make_pattern("checkerboard", ("red", "cyan"), 0.75, 30, (60, 40))
    raster = Raster((400, 300), -5.0, 3.75, 0.025)  # 30 px a dot
    picture = render_pattern(pattern, raster)
    x_mm = -5.0 + 0.025 * (np.arange(400) + 0.5)
    y_mm = 3.75 - 0.025 * (np.arange(300) + 0.5)
    labels = pattern.label(x_mm[None, :], y_mm[:, None])
    inside = np.ones(labels.shape, bool)
    for dx_mm, dy_mm in ((0.1, 0), (-0.1, 0), (0, 0.1), (0, -0.1)):
        inside &= pattern.label(x_mm[None, :] + dx_mm, y_mm[:, None] + dy_mm) == labels
    assert inside.mean() > 0.4
    assert np.array_equal(picture[inside], codes_of(pattern)[labels[inside]])


def test_the_detail_is_fourteen_dots_of_the_centre_whatever_their_size():
    details = [pattern_detail(make_pattern("checkerboard", ("red", "cyan"), dot, 0, (60, 40))) for dot in (0.5, 1.0)]
    assert np.array_equal(*details)
    red, cyan = codes_of(make_pattern("checkerboard", ("red", "cyan"), 1.0, 0, (60, 40)))
    px = 512 / 14
    assert np.array_equal(details[0][int(6.5 * px), int(7.5 * px)], red)  # cell (0, 0): right of and above the centre
    assert np.array_equal(details[0][int(6.5 * px), int(6.5 * px)], cyan)


@pytest.mark.parametrize("pixel_mm", [0.3, 0.71, 2.0])
def test_small_dots_become_their_mean_in_linear_light_without_moire(pixel_mm):
    pattern = make_pattern("checkerboard", ("black", "white"), 0.5, 30, (400, 400))
    picture = render_pattern(pattern, Raster((100, 80), -50 * pixel_mm, 40 * pixel_mm, pixel_mm))
    mean = np.mean([reflectance_to_linear_sRGB(c.reflectance) for c in colorants_of(pattern.colorants)], axis=0)
    # one code is 0.006 of linear light here
    assert sRGB_to_linear_sRGB(picture / 255.0).mean(axis=(0, 1)) == pytest.approx(mean, abs=0.006)
    # a Gaussian of 1 px leaves exp(-2 pi^2 f^2) of a checkerboard's fundamental, whose rms is 8/pi^2 of half its
    # contrast (0.44; 180 codes a unit of light here): 1.8 codes at 0.42 cycles a pixel; the rest is rounding
    frequency = np.sqrt(0.5) * pixel_mm / 0.5
    left = 180 * 0.44 * (8 / np.pi**2) * np.exp(-2 * (np.pi * frequency) ** 2)
    assert picture.std(axis=(0, 1)).max() < np.hypot(left, 0.5)


def test_the_preview_is_a_picture_of_the_sheet(tmp_path):
    pattern = make_pattern("checkerboard", ("magenta", "yellow"), 2.0, 30, (600, 400))
    width, height = write_preview(pattern, tmp_path / "preview.png", caption="ours")
    assert width <= 1600
    with Image.open(tmp_path / "preview.png") as image:
        assert image.format == "PNG"
        assert image.size == (width, height)
        colours = {colour for _, colour in image.convert("RGB").getcolors(1 << 24)}
    for code in codes_of(pattern):  # in the crop, the patches and the legend
        assert tuple(int(v) for v in code) in colours


def test_the_preview_of_a_tall_sheet_fits_and_is_reproducible(tmp_path):
    pattern = make_pattern("checkerboard", ("black", "white"), 0.75, 30, (60, 400))
    sizes = [write_preview(pattern, tmp_path / name) for name in ("a.png", "b.png")]
    assert sizes[0] == sizes[1]
    assert sizes[0][0] <= 1600
    assert sizes[0][1] <= 1100
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
