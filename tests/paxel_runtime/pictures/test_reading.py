"""Pictures: every kind of file gives the colours it means, on the raster that was asked for."""

import io
from pathlib import Path

import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageCms

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import sRGB_to_Lab, sRGB_to_linear_sRGB
from paxel_runtime.pictures import PLACEMENTS, load_picture, place, resample

RNG = np.random.default_rng(0)
COLORS = RNG.integers(0, 256, (6, 9, 3), dtype=np.uint8)
GRAYS = RNG.integers(0, 256, (6, 9), dtype=np.uint8)
FLOAT32 = 2e-3  # CIELAB of float32 linear light, largest in the steep blacks


def _saved(path: Path, image: Image.Image, **options: object) -> Path:
    image.save(path, **options)
    return path


@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp", ".webp"])
def test_lossless_files_give_the_colours_of_srgb(tmp_path: Path, suffix: str) -> None:
    path = _saved(tmp_path / f"a{suffix}", Image.fromarray(COLORS), **({"lossless": True} if suffix == ".webp" else {}))
    Lab = load_picture(path, 9, 6)
    assert Lab.dtype == np.float32
    np.testing.assert_allclose(Lab, sRGB_to_Lab(COLORS / 255), atol=FLOAT32)


def test_gray_palette_and_one_bit_pictures(tmp_path: Path) -> None:
    expected = sRGB_to_Lab(GRAYS[..., None].repeat(3, axis=2) / 255)
    np.testing.assert_allclose(
        load_picture(_saved(tmp_path / "l.png", Image.fromarray(GRAYS)), 9, 6), expected, atol=FLOAT32
    )
    palette = Image.fromarray(COLORS).quantize(16)
    np.testing.assert_allclose(
        load_picture(_saved(tmp_path / "p.png", palette), 9, 6),
        sRGB_to_Lab(np.asarray(palette.convert("RGB")) / 255),
        atol=FLOAT32,
    )
    bits = Image.fromarray(GRAYS > 127)
    L = load_picture(_saved(tmp_path / "1.png", bits), 9, 6)[..., 0]
    np.testing.assert_allclose(L, 100.0 * (GRAYS > 127), atol=FLOAT32)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_gray_of_16_bits_keeps_them(tmp_path: Path, suffix: str) -> None:
    ramp = np.linspace(30000, 30500, 54).astype(np.uint16).reshape(6, 9)  # two codes of 8 bits
    path = _saved(tmp_path / f"a{suffix}", Image.fromarray(ramp))
    L = load_picture(path, 9, 6)[..., 0]
    np.testing.assert_allclose(L, sRGB_to_Lab(ramp[..., None].repeat(3, axis=2) / 65535)[..., 0], atol=FLOAT32)
    assert len(np.unique(L)) == 54


def test_colour_of_16_bits_is_read_as_8(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", COLORS.astype(np.uint16) * 257, photometric="rgb")
    np.testing.assert_allclose(load_picture(tmp_path / "a.tif", 9, 6), sRGB_to_Lab(COLORS / 255), atol=FLOAT32)


@pytest.mark.parametrize("mode", ["RGBA", "LA"])
def test_alpha_lies_over_black_in_linear_light(tmp_path: Path, mode: str) -> None:
    alpha = Image.fromarray(np.full((6, 9), 128, np.uint8))
    image = Image.fromarray(COLORS).convert(mode.removesuffix("A"))
    colors = np.asarray(image.convert("RGB"))
    image.putalpha(alpha)
    Lab = load_picture(_saved(tmp_path / "a.png", image), 9, 6)
    linear = sRGB_to_linear_sRGB(colors / 255) * 128 / 255
    Y = linear @ [0.2126390058715104, 0.7151686787677559, 0.0721923153607337]
    expected = np.where(Y > (6 / 29) ** 3, 116 * np.cbrt(Y) - 16, (29 / 3) ** 3 * Y)
    np.testing.assert_allclose(Lab[..., 0], expected, atol=FLOAT32)


def test_exif_orientation_is_applied(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was turned: the picture's top is at the right of the file
    path = _saved(tmp_path / "a.png", Image.fromarray(np.rot90(COLORS)), exif=exif)
    np.testing.assert_allclose(load_picture(path, 9, 6), sRGB_to_Lab(COLORS / 255), atol=FLOAT32)


def _linear_profile() -> bytes:
    """The sRGB profile with its three tone curves made linear: one `curv` of gamma 1 in the place of each."""
    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    for k in range(int.from_bytes(data[128:132], "big")):
        entry = data[132 + 12 * k : 144 + 12 * k]
        if entry[:4] in (b"rTRC", b"gTRC", b"bTRC"):
            offset = int.from_bytes(entry[4:8], "big")
            data[offset : offset + 14] = b"curv" + bytes(4) + (1).to_bytes(4, "big") + bytes([1, 0])
    return bytes(data)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".jpg"])
def test_an_embedded_profile_is_respected(tmp_path: Path, suffix: str) -> None:
    linear = np.full((6, 9, 3), (128, 64, 200), np.uint8)
    options = {"quality": 100, "subsampling": 0} if suffix == ".jpg" else {}
    path = _saved(tmp_path / f"a{suffix}", Image.fromarray(linear), icc_profile=_linear_profile(), **options)
    encoded = 255 * (1.055 * (linear[0, 0] / 255) ** (1 / 2.4) - 0.055)
    # Converted in 8 bits: half a code, and another for LittleCMS's own or for JPEG's rounding.
    low, high = (sRGB_to_Lab((encoded + d) / 255)[0] for d in (-1.5, 1.5))
    assert low < load_picture(path, 9, 6)[0, 0, 0] < high


def test_the_srgb_profile_changes_nothing(tmp_path: Path) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    image = Image.fromarray(COLORS)
    plain, tagged = _saved(tmp_path / "a.png", image), _saved(tmp_path / "b.png", image, icc_profile=profile)
    image.putalpha(255)
    alpha = _saved(tmp_path / "c.png", image, icc_profile=profile)
    np.testing.assert_array_equal(load_picture(tagged, 9, 6), load_picture(alpha, 9, 6))
    # LittleCMS may round a code of 8 bits the other way: 0.4 in L*, up to 1 in a* and b* of dark colours.
    np.testing.assert_allclose(load_picture(tagged, 9, 6), load_picture(plain, 9, 6), atol=1.5)


@given(
    st.tuples(st.integers(1, 300), st.integers(1, 300)),
    st.tuples(st.integers(1, 300), st.integers(1, 300)),
    st.sampled_from(PLACEMENTS),
)
def test_placement(picture: tuple[int, int], frame: tuple[int, int], placement: str) -> None:
    (left, top, right, bottom), (x0, y0, x1, y1) = place(picture, frame, placement)
    assert 0 <= left < right <= picture[0] + 1e-9
    assert 0 <= top < bottom <= picture[1] + 1e-9
    assert 0 <= x0 < x1 <= frame[0]
    assert 0 <= y0 < y1 <= frame[1]
    if placement != "fit":
        assert (x0, y0, x1, y1) == (0, 0, *frame)
    if placement != "fill":
        assert (left, top, right, bottom) == (0, 0, *picture)
    if placement == "fill":
        assert (right - left) / (bottom - top) == pytest.approx(frame[0] / frame[1])
        assert left + right == pytest.approx(picture[0])
        assert top + bottom == pytest.approx(picture[1])
    if placement == "fit":
        assert x1 - x0 == frame[0] or y1 - y0 == frame[1]
        scale = min(frame[0] / picture[0], frame[1] / picture[1])
        assert abs(x1 - x0 - max(1, scale * picture[0])) <= 0.5 + 1e-9  # whole pixels
        assert abs(y1 - y0 - max(1, scale * picture[1])) <= 0.5 + 1e-9


def test_fit_leaves_black_bars_and_fill_crops_about_the_centre(tmp_path: Path) -> None:
    stripes = np.repeat(np.array([[0, 60, 120, 180, 240, 255]], np.uint8), 2, axis=0)  # 6 x 2
    path = _saved(tmp_path / "a.png", Image.fromarray(stripes))
    fit = load_picture(path, 6, 6, "fit")
    assert not fit[:2].any()
    assert not fit[4:].any()
    L = sRGB_to_Lab(stripes[..., None].repeat(3, axis=2) / 255)[..., 0]
    np.testing.assert_allclose(fit[2:4, :, 0], L, atol=FLOAT32)
    np.testing.assert_allclose(load_picture(path, 2, 2, "fill")[..., 0], L[:, 2:4], atol=FLOAT32)


def test_shrinking_averages_light_not_codes(tmp_path: Path) -> None:
    checker = (np.indices((64, 64)).sum(axis=0) % 2 * 255).astype(np.uint8)
    Lab = load_picture(_saved(tmp_path / "a.png", Image.fromarray(checker)), 8, 8)
    # Half the light is L* 76.07 (closed form), half the code would be 53.6; 0.2 for the filter at the borders.
    np.testing.assert_allclose(Lab[..., 0], 116 * np.cbrt(0.5) - 16, atol=0.2)


def test_resampling_keeps_uniform_light_and_never_leaves_0_to_1() -> None:
    assert np.allclose(resample(np.full((7, 5, 3), 0.3, np.float32), 11, 4), 0.3, atol=1e-6)  # float32
    edge = np.repeat([[0.0, 1.0]], 8, axis=1)[..., None].repeat(8, axis=0).astype(np.float32)
    ringing = resample(edge, 50, 50)
    assert ringing.min() == 0
    assert ringing.max() == 1


def test_what_is_no_picture_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no picture"):
        load_picture(tmp_path / "none.png", 8, 8)
    with pytest.raises(InputError, match="is a folder"):
        load_picture(tmp_path, 8, 8)
    (tmp_path / "text.png").write_text("no picture")
    with pytest.raises(InputError, match="no picture that can be read"):
        load_picture(tmp_path / "text.png", 8, 8)
    buffer = io.BytesIO()
    Image.fromarray(RNG.integers(0, 256, (64, 64, 3), dtype=np.uint8)).save(buffer, "PNG")
    (tmp_path / "cut.png").write_bytes(buffer.getvalue()[:3000])
    with pytest.raises(InputError, match="damaged"):
        load_picture(tmp_path / "cut.png", 8, 8)
    with pytest.raises(InputError, match="without a defined white"):
        load_picture(_saved(tmp_path / "f.tif", Image.fromarray(np.ones((4, 4), np.float32))), 8, 8)
    broken = _saved(tmp_path / "icc.png", Image.fromarray(COLORS), icc_profile=b"no profile" * 20)
    with pytest.raises(InputError, match="ICC profile"):
        load_picture(broken, 8, 8)
    with pytest.raises(InputError, match="fill, fit, stretch"):
        load_picture(_saved(tmp_path / "a.png", Image.fromarray(COLORS)), 8, 8, "centre")
