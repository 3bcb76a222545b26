"""Pictures: every kind of file gives the colours it means, on the raster that was asked for."""

import io
import zlib
from pathlib import Path

import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageCms

from paxel_runtime.errors import InputError
from paxel_runtime.frame_files import write_frame
from paxel_runtime.model.colorimetry import (
    D65_XYZ,
    XYZ_to_Lab,
    linear_sRGB_to_XYZ,
    sRGB_to_Lab,
    sRGB_to_linear_sRGB,
)
from paxel_runtime.pictures import PLACEMENTS, Frame, load_picture, place, place_picture, read_picture, resample

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


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("alpha", [False, True])
def test_colour_of_16_bits_keeps_them(tmp_path: Path, suffix: str, alpha: bool) -> None:
    codes = RNG.integers(20000, 20300, (6, 9, 3), dtype=np.uint16)  # hardly more than a code of 8 bits
    opacity = np.full((6, 9, 1), 32768, np.uint16)
    path, planes = tmp_path / f"a{suffix}", np.concatenate([codes, opacity], axis=2) if alpha else codes
    if suffix == ".png":
        write_frame(path, planes, 16)
    else:
        tifffile.imwrite(path, planes, photometric="rgb", extrasamples=["unassalpha"] if alpha else None)
    light = sRGB_to_linear_sRGB(codes / 65535) * (32768 / 65535 if alpha else 1.0)
    np.testing.assert_allclose(load_picture(path, 9, 6), XYZ_to_Lab(linear_sRGB_to_XYZ(light), D65_XYZ), atol=FLOAT32)
    assert read_picture(path).bits == 16


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_of_16_bits_is_that_of_8(tmp_path: Path, orientation: int) -> None:
    exif = Image.Exif()
    exif[0x0112] = orientation
    eight = _saved(tmp_path / "8.tif", Image.fromarray(COLORS), exif=exif)
    tag = (0x0112, "H", 1, orientation, True)
    tifffile.imwrite(tmp_path / "16.tif", COLORS.astype(np.uint16) * 257, photometric="rgb", extratags=[tag])
    upright = read_picture(eight)
    np.testing.assert_allclose(read_picture(tmp_path / "16.tif").linear, upright.linear, atol=1e-6)  # float32
    assert upright.size == ((9, 6) if orientation < 5 else (6, 9))
    png = tmp_path / "16.png"
    write_frame(png, COLORS.astype(np.uint16) * 257, 16)
    data = png.read_bytes()  # with Pillow's own EXIF behind the header
    note = exif.tobytes().removeprefix(b"Exif\0\0")
    chunk = b"eXIf" + note
    png.write_bytes(data[:33] + len(note).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big") + data[33:])
    np.testing.assert_allclose(read_picture(png).linear, upright.linear, atol=1e-6)


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


D50 = np.array([0.9642, 1.0, 0.8249])
# Primaries of Display P3 and Adobe RGB adapted to D50, as Apple's and Adobe's profiles have them (columns X, Y, Z).
DISPLAY_P3 = np.array([[0.51512, 0.29198, 0.15710], [0.24120, 0.69225, 0.06657], [-0.00105, 0.04189, 0.78407]])
ADOBE_RGB = np.array([[0.60974, 0.20528, 0.14919], [0.31111, 0.62567, 0.06322], [0.01947, 0.06087, 0.74457]])


def matrix_profile(to_XYZ: np.ndarray = DISPLAY_P3, gamma: float = 2.2, gray: bool = False) -> bytes:
    """An ICC profile of three curves and a matrix, or of one gray curve (ICC.1:2022)."""

    def number(value: float) -> bytes:
        return round(value * 65536).to_bytes(4, "big", signed=True)

    curve = b"curv" + bytes(4) + (1).to_bytes(4, "big") + round(gamma * 256).to_bytes(2, "big") + bytes(2)
    tags = {b"kTRC": curve} if gray else dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), curve)
    if not gray:
        for k, name in enumerate((b"rXYZ", b"gXYZ", b"bXYZ")):
            tags[name] = b"XYZ " + bytes(4) + b"".join(number(v) for v in to_XYZ[:, k])
    tags[b"wtpt"] = b"XYZ " + bytes(4) + b"".join(number(v) for v in D50)
    tags[b"desc"] = b"desc" + bytes(4) + (8).to_bytes(4, "big") + b"Wide 1\0" + bytes(90)
    offset, entries, body = 132 + 12 * len(tags), b"", b""
    for name, data in tags.items():
        entries += name + (offset + len(body)).to_bytes(4, "big") + len(data).to_bytes(4, "big")
        body += data + bytes(-len(data) % 4)
    size = offset + len(body)
    header = size.to_bytes(4, "big") + b"lcms" + b"\x02\x40\0\0" + b"mntr" + (b"GRAY" if gray else b"RGB ") + b"XYZ "
    header += bytes(12) + b"acsp" + bytes(28) + b"".join(number(v) for v in D50) + bytes(48)
    return header[:128] + len(tags).to_bytes(4, "big") + entries + body


@pytest.mark.parametrize("to_XYZ", [DISPLAY_P3, ADOBE_RGB], ids=["Display P3", "Adobe RGB"])
@pytest.mark.parametrize("bits", [8, 16])
def test_a_wide_gamut_is_not_clipped(tmp_path: Path, to_XYZ: np.ndarray, bits: int) -> None:
    codes = np.zeros((6, 9, 3), np.uint8)
    codes[..., 1], codes[:3] = 255, [[[200, 30, 40]]]
    profile = matrix_profile(to_XYZ)
    if bits == 8:
        path = _saved(tmp_path / "a.png", Image.fromarray(codes), icc_profile=profile)
    else:
        path = tmp_path / "a.tif"
        tifffile.imwrite(path, codes.astype(np.uint16) * 257, photometric="rgb", iccprofile=profile)
    light = (codes / 255) ** (round(2.2 * 256) / 256)
    expected = XYZ_to_Lab(light @ to_XYZ.T, D50)
    np.testing.assert_allclose(load_picture(path, 9, 6), expected, atol=0.01)  # s15Fixed16 of the primaries
    assert np.hypot(*expected[-1, -1, 1:]) > 125, "beyond sRGB's green, whose chroma is 119.8"
    assert read_picture(path).space.name == "Wide 1"


def test_profiles_agree_with_littlecms(tmp_path: Path) -> None:
    profile = matrix_profile()
    Lab = load_picture(_saved(tmp_path / "a.png", Image.fromarray(COLORS), icc_profile=profile), 9, 6)
    source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
    made = ImageCms.profileToProfile(Image.fromarray(COLORS), source, ImageCms.createProfile("LAB"), outputMode="LAB")
    assert made is not None
    encoded = np.asarray(made).astype(float)
    expected = np.stack([encoded[..., 0] / 2.55, *((encoded[..., c] + 128) % 256 - 128 for c in (1, 2))], axis=-1)
    inside = np.all(np.abs(expected[..., 1:]) < 126, axis=-1)  # its 8 bits end at 127
    np.testing.assert_allclose(Lab[inside], expected[inside], atol=0.6)  # half a unit of its 8 bits


def test_a_gray_profile_and_one_that_only_littlecms_knows(tmp_path: Path) -> None:
    path = _saved(tmp_path / "g.png", Image.fromarray(GRAYS), icc_profile=matrix_profile(gamma=1.0, gray=True))
    expected = XYZ_to_Lab((GRAYS / 255)[..., None] * D50, D50)
    np.testing.assert_allclose(load_picture(path, 9, 6), expected, atol=FLOAT32)
    lab = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    gray_lab = Image.merge("LAB", [Image.fromarray(GRAYS), *[Image.new("L", (9, 6), 0)] * 2])
    path = _saved(tmp_path / "l.tif", gray_lab, icc_profile=lab)
    np.testing.assert_allclose(load_picture(path, 9, 6)[..., 0], GRAYS / 2.55, atol=0.5)  # a unit of its 8 bits


def test_large_pictures_are_averaged_in_light(tmp_path: Path) -> None:
    noise = RNG.integers(0, 256, (120, 200, 3), dtype=np.uint8)
    path = _saved(tmp_path / "a.png", Image.fromarray(noise))
    small = read_picture(path, (20, 12))
    assert small.linear.shape == (24, 40, 3)
    light = sRGB_to_linear_sRGB(noise / 255).reshape(24, 5, 40, 5, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(small.linear, light, atol=1e-6)  # float32
    whole = place_picture(read_picture(path), Frame(20, 12))
    np.testing.assert_allclose(load_picture(path, 20, 12), whole, atol=4.0)  # noise; the filters differ a little
    np.testing.assert_allclose(load_picture(path, 20, 12).mean(axis=(0, 1)), whole.mean(axis=(0, 1)), atol=0.2)


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
    # The profile's primaries are sRGB's, adapted to D50 by Bradford's matrix; Y of its white is 1.
    Y = (linear[0, 0] / 255) @ [0.22249, 0.71687, 0.06061]
    # JPEG rounds to whole codes after its transform: one of 255 in linear light
    atol = 0.5 if suffix == ".jpg" else 0.01
    assert load_picture(path, 9, 6)[0, 0, 0] == pytest.approx(116 * np.cbrt(Y) - 16, abs=atol)
    assert read_picture(path).space.name.startswith("sRGB")


def test_the_srgb_profile_changes_nothing(tmp_path: Path) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    image = Image.fromarray(COLORS)
    plain, tagged = _saved(tmp_path / "a.png", image), _saved(tmp_path / "b.png", image, icc_profile=profile)
    image.putalpha(255)
    alpha = _saved(tmp_path / "c.png", image, icc_profile=profile)
    np.testing.assert_array_equal(load_picture(tagged, 9, 6), load_picture(alpha, 9, 6))
    np.testing.assert_array_equal(load_picture(tagged, 9, 6), load_picture(plain, 9, 6))
    assert read_picture(plain).description == "9 x 6 of 8 bits, sRGB, assumed: the file has no profile"
    assert read_picture(tagged).description == "9 x 6 of 8 bits, sRGB"


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
    gray = _saved(tmp_path / "gray.png", Image.fromarray(COLORS), icc_profile=matrix_profile(gray=True))
    with pytest.raises(InputError, match="a gray profile in a picture of three channels"):
        load_picture(gray, 8, 8)
    broken = _saved(tmp_path / "icc.png", Image.fromarray(COLORS), icc_profile=b"no profile" * 20)
    with pytest.raises(InputError, match="ICC profile"):
        load_picture(broken, 8, 8)
    with pytest.raises(InputError, match="fill, fit, stretch"):
        load_picture(_saved(tmp_path / "a.png", Image.fromarray(COLORS)), 8, 8, "centre")
