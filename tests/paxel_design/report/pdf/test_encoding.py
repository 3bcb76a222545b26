"""Pictures as packed: pixels where they have to stay, and a JPEG only where it is smaller and looks the same."""

import io
import zlib

import numpy as np
import pikepdf
import pytest
from numpy.typing import NDArray
from PIL import Image

from paxel_design.report.content import Picture
from paxel_design.report.pdf.encoding import Raster, raster_of
from paxel_design.report.pdf.objects import Objects
from paxel_runtime.model.colorimetry import sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00

Pixels = NDArray[np.uint8]


def _photograph(height: int, width: int) -> Pixels:
    y, x = np.mgrid[0 : 1 : complex(height), 0 : 1 : complex(width)]
    smooth = np.stack((0.5 + 0.4 * np.sin(9 * x), 0.5 + 0.4 * np.cos(7 * y), 0.3 + 0.5 * x * y), axis=-1)
    noise = np.random.default_rng(0).normal(0, 0.01, smooth.shape)
    return np.rint(255 * np.clip(smooth + noise, 0, 1)).astype(np.uint8)


def _decoded(picture: Pixels, width_mm: float, *, pixelated: bool = False) -> Pixels:
    """As a reader of the file decodes it."""
    objects = Objects()
    name = objects.picture(Picture(picture, "", pixelated=pixelated), width_mm)
    with pikepdf.new() as pdf:
        pdf.add_blank_page()
        objects.embed(pdf, {1: {name}})
        image = pikepdf.PdfImage(pdf.pages[0].resources.XObject[f"/{name}"])
        return np.asarray(image.as_pil_image().convert("RGB"))


def test_a_photograph_is_a_jpeg_that_looks_the_same() -> None:
    picture = _photograph(200, 300)
    raster = raster_of(picture, 27.0, pixelated=False)
    assert raster.jpeg
    assert len(raster.data) < 0.5 * len(zlib.compress(picture.tobytes(), 9))
    difference = dE00(sRGB_to_Lab(picture / 255.0), sRGB_to_Lab(_decoded(picture, 27.0) / 255.0))
    # 1.0 is promised of averages over 3 x 3 pixels; single pixels have up to thrice the error
    assert difference.mean() < 3.0


def test_flat_colours_with_edges_are_packed_without_loss() -> None:
    colors = np.random.default_rng(2).integers(0, 256, (18, 20, 3), dtype=np.uint8)  # more than a palette holds
    picture = np.repeat(np.repeat(colors, 11, axis=0), 11, axis=1)
    assert not raster_of(picture, 80.0, pixelated=False).jpeg
    np.testing.assert_array_equal(_decoded(picture, 80.0), picture)


@pytest.mark.parametrize("colors", [2, 200])
def test_few_colours_are_a_palette(colors: int) -> None:
    rng = np.random.default_rng(3)
    table = rng.integers(0, 256, (colors, 3), dtype=np.uint8)
    picture = table[rng.integers(0, colors, (50, 70))]
    raster = raster_of(picture, 40.0, pixelated=False)
    assert len(raster.palette) <= 3 * colors
    np.testing.assert_array_equal(_decoded(picture, 40.0), picture)


def test_pixels_stay_squares_however_fine_the_reader_smooths() -> None:
    picture = _photograph(9, 13)
    shown = _decoded(picture, 50.0, pixelated=True)
    times = shown.shape[1] // picture.shape[1]
    assert shown.shape == (9 * times, 13 * times, 3)
    assert times * picture.shape[1] / (50.0 / 25.4) >= 450, "pixels per inch"
    for row in range(times):
        np.testing.assert_array_equal(shown[row::times, row::times], picture)


def test_a_large_photograph_is_averaged_in_linear_light() -> None:
    stripes = np.zeros((400, 2000, 3), dtype=np.uint8)
    stripes[:, ::2] = 255
    shown = raster_of(stripes, 40.0, pixelated=False)
    assert shown.width == round(40.0 / 25.4 * 260)
    pixels = _decoded(stripes, 40.0)
    # half the light is code 188; the edges of the picture and the ripple of resampling aside
    assert np.median(pixels) == pytest.approx(188, abs=1)


def test_equal_pictures_are_one_object() -> None:
    objects = Objects()
    names = [objects.picture(Picture(_photograph(20, 30), "", ""), 40.0) for _ in range(2)]
    assert names[0] == names[1]
    assert objects.picture(Picture(_photograph(20, 31), ""), 40.0) != names[0]


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (3, 2)])
def test_the_smallest_pictures_are_packed_too(shape: tuple[int, int]) -> None:
    picture = _photograph(60, 60)[: shape[0], : shape[1]]
    np.testing.assert_allclose(_decoded(picture, 10.0).astype(int), picture.astype(int), atol=8)  # a JPEG at most
    assert isinstance(raster_of(picture, 10.0, pixelated=True), Raster)


def test_a_packed_jpeg_is_a_jpeg_file() -> None:
    raster = raster_of(_photograph(100, 100), 9.0, pixelated=False)
    with Image.open(io.BytesIO(raster.data)) as image:
        assert (image.format, image.size) == ("JPEG", (100, 100))
