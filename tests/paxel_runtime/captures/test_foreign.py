"""A folder of foreign captures: what is wrong with it is told by file name, before anything is computed."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.captures.foreign import decode_folder, plane_figures
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.structured_light import plan_gray_sequence

WIDTH, HEIGHT, SHAPE = 100, 60, (128, 208)
NAMES = [frame.name for frame in plan_gray_sequence(WIDTH, HEIGHT)]  # 7 bits along x, 6 along y: 28 captures


def picture(folder: Path, number: int) -> Path:
    return folder / f"shot{number}.png"  # shot9 comes before shot10


def save(path: Path, capture: NDArray[np.uint16]) -> None:
    Image.fromarray((capture >> 8).astype(np.uint8)).save(path)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory, photograph: Callable[..., NDArray[np.uint16]]) -> Path:
    folder = tmp_path_factory.mktemp("good")
    for i, frame in enumerate(plan_gray_sequence(WIDTH, HEIGHT)):
        save(picture(folder, i), photograph(frame.pixels(WIDTH, HEIGHT), SHAPE))
    return folder


@pytest.fixture
def folder(good: Path, tmp_path: Path) -> Path:
    """A copy to spoil."""
    return Path(shutil.copytree(good, tmp_path / "captures"))


def refusal(folder: Path) -> str:
    """What is told of a folder that is refused; its files are as they were."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(CalibrationError) as caught:
        decode_folder(folder, WIDTH, HEIGHT)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return str(caught.value)


def test_a_good_folder_is_decoded_in_natural_order(
    good: Path, camera_places: Callable[..., NDArray[np.float64]]
) -> None:
    decoded, figures = decode_folder(good, WIDTH, HEIGHT)
    truth = camera_places(SHAPE)
    inside = np.all((truth > 1.0) & (truth < [WIDTH - 2.0, HEIGHT - 2.0]), axis=-1)
    assert np.mean(decoded.reason[inside] == 0) > 0.95  # 8-bit captures of 8 % ink
    error = np.linalg.norm(decoded.projector_xy - truth, axis=-1)[inside & (decoded.reason == 0)]
    assert np.median(error) < 0.15  # whole pixels: 0.38
    assert figures["captures"] == 28
    assert figures["camera"] == [208, 128]
    assert figures["decoded"] == np.mean(decoded.reason == 0)
    assert sum(figures["rejected"].values()) + figures["decoded"] == pytest.approx(1.0)
    assert figures["plane"]["within_2_px"] > 0.97
    assert figures["plane"]["residual_rms_px"] < 0.3
    assert not figures["mirrored"]


def test_a_missing_capture_is_named(folder: Path) -> None:
    picture(folder, 7).unlink()
    text = refusal(folder)
    assert "a projector of 100 x 60 pixels needs 28 captures, got 27" in text
    assert "shot6.png has no inverse beside it: gray-x-3 or gray-x-3-inverse is missing" in text


def test_missing_black_and_missing_pairs_are_told(folder: Path) -> None:
    picture(folder, 27).unlink()
    assert "black is missing beside shot26.png" in refusal(folder)
    picture(folder, 26).unlink()
    assert "got 26: 2 are missing, in whole pairs, or the projector has another size" in refusal(folder)


@pytest.mark.parametrize(
    ("name", "copied", "words"),
    [
        ("shot7a.png", 20, "shot7a.png has no inverse beside it"),
        ("shot6a.png", 20, "shot6a.png stands between shot6.png and its inverse: remove it"),
        ("shot6a.png", 6, "shot6a.png shows the same as shot6.png: remove one"),
        ("zzz.png", 27, "zzz.png has no inverse beside it"),
    ],
)
def test_an_extra_capture_is_named(folder: Path, name: str, copied: int, words: str) -> None:
    shutil.copy(picture(folder, copied), folder / name)
    text = refusal(folder)
    assert "needs 28 captures, got 29" in text
    assert words in text


@pytest.mark.parametrize(
    ("one", "two", "words"),
    [
        (6, 7, "shot7.png is exchanged with shot6.png, its inverse"),
        (12, 13, "shot13.png is exchanged with shot12.png, its inverse"),
        (4, 16, "shot4.png is exchanged with shot16.png (or shot5.png with shot17.png)"),
        (26, 27, "shot27.png is brighter than white: the two are exchanged"),
    ],
)
def test_swapped_captures_are_named(folder: Path, one: int, two: int, words: str) -> None:
    picture(folder, one).rename(folder / "aside")
    picture(folder, two).rename(picture(folder, one))
    (folder / "aside").rename(picture(folder, two))
    assert words in refusal(folder)


def test_swapped_pairs_are_named(folder: Path, good: Path) -> None:
    for here, there in ((8, 10), (9, 11), (10, 8), (11, 9)):
        shutil.copy(picture(good, there), picture(folder, here))
    assert "shot10.png and its inverse are exchanged with shot8.png and its inverse" in refusal(folder)


def test_the_highest_bit_mirrors_the_picture_and_that_is_told(folder: Path, good: Path) -> None:
    for here, there in ((0, 1), (1, 0)):
        shutil.copy(picture(good, there), picture(folder, here))
    assert decode_folder(folder, WIDTH, HEIGHT).figures["mirrored"]


@pytest.mark.parametrize(
    ("number", "copied", "words"),
    [
        (7, 6, "shot7.png shows the same as shot6.png, not its inverse"),
        (8, 7, "shot8.png shows the same as shot7.png: it is repeated"),
    ],
)
def test_a_repeated_capture_is_named(folder: Path, number: int, copied: int, words: str) -> None:
    shutil.copy(picture(folder, copied), picture(folder, number))
    assert words in refusal(folder)


def test_a_repeated_pair_is_named(folder: Path) -> None:
    shutil.copy(picture(folder, 6), picture(folder, 8))
    shutil.copy(picture(folder, 7), picture(folder, 9))
    assert "shot9.png and the capture before it show the same as shot6.png and shot7.png" in refusal(folder)


@pytest.mark.parametrize("kept", [0.0, 0.6])
def test_a_truncated_capture_is_named(folder: Path, kept: float) -> None:
    whole = picture(folder, 12).read_bytes()
    picture(folder, 12).write_bytes(whole[: int(kept * len(whole))])
    text = refusal(folder)
    assert "shot12.png is" in text
    assert ("cut short" if kept else "no picture") in text


def test_captures_of_another_size_are_named(folder: Path) -> None:
    with Image.open(picture(folder, 13)) as image:
        image.crop((0, 0, 200, 128)).save(picture(folder, 13))
    text = refusal(folder)
    assert "shot13.png has 200 x 128 pixels, the others 208 x 128" in text
    assert text.count("shot") == 1


def test_a_saturated_capture_is_named(folder: Path) -> None:
    with Image.open(picture(folder, 14)) as image:
        Image.fromarray(np.minimum(np.asarray(image).astype(int) * 40, 255).astype(np.uint8)).save(picture(folder, 14))
    text = refusal(folder)
    assert "shot14.png is saturated on" in text
    assert "expose less" in text


@pytest.mark.parametrize(("number", "partner"), [(15, 14), (20, 21)])
def test_a_black_capture_is_named(folder: Path, number: int, partner: int) -> None:
    save(picture(folder, number), np.full(SHAPE, 256, np.uint16))
    assert f"shot{number}.png is black, and should add up to white with shot{partner}.png" in refusal(folder)


def test_a_camera_that_moved_is_told_from_where_on(folder: Path, photograph: Callable[..., NDArray[np.uint16]]) -> None:
    for i, frame in enumerate(plan_gray_sequence(WIDTH, HEIGHT)[14:26], 14):
        save(picture(folder, i), photograph(frame.pixels(WIDTH, HEIGHT), SHAPE, turn_px=3.0))
    text = refusal(folder)
    assert "6 captures from shot15.png to shot25.png, each is displaced by about +3, +0 pixels (right, down)" in text
    assert "take all captures again" in text


def test_what_is_no_folder_of_captures_is_refused(tmp_path: Path, good: Path) -> None:
    with pytest.raises(InputError, match="there is no folder"):
        decode_folder(tmp_path / "none", WIDTH, HEIGHT)
    with pytest.raises(InputError, match=r"holds no pictures \(.tif"):
        decode_folder(tmp_path, WIDTH, HEIGHT)
    with pytest.raises(InputError, match="must be one of opencv-gray, got 'stripes'"):
        decode_folder(good, WIDTH, HEIGHT, "stripes")
    with pytest.raises(InputError, match="16 to 65536 pixels a side"):
        decode_folder(good, 8, 60)


def test_plane_figures_of_a_plane_with_outliers() -> None:
    rng = np.random.default_rng(0)
    y, x = np.indices((80, 120)).astype(np.float64)
    z = 1.0 + 1e-3 * x
    places = np.stack([(3.0 * x + 0.1 * y) / z, (2.5 * y + 20.0) / z], axis=-1) + rng.normal(0.0, 0.2, (80, 120, 2))
    odd = rng.random((80, 120)) < 0.3
    places[odd] += rng.uniform(20.0, 90.0, (int(odd.sum()), 2))
    share, rms_px = plane_figures(places.astype(np.float32), np.ones((80, 120), bool))
    assert share == pytest.approx(0.7, abs=0.02)
    assert rms_px == pytest.approx(0.2 * 2**0.5, rel=0.05)
    assert plane_figures(places.astype(np.float32), np.zeros((80, 120), bool)) == (None, None)
