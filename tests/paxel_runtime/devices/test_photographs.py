"""Photographs of any common kind, and files that are none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from paxel_runtime.devices.folder import Arrivals, file_key, wait_for
from paxel_runtime.devices.photographs import list_photographs, read_photograph, to_one_plane
from paxel_runtime.errors import DeviceError

GRAY = np.random.default_rng(0).integers(0, 65536, (12, 16)).astype(np.uint16)
COLOUR = np.random.default_rng(1).integers(0, 65536, (12, 16, 3)).astype(np.uint16)


def test_sixteen_bits_come_as_they_are(tmp_path: Path) -> None:
    for name, picture in (("gray.tif", GRAY), ("colour.TIFF", COLOUR)):
        tifffile.imwrite(tmp_path / name, picture)
        assert np.array_equal(read_photograph(tmp_path / name), picture)
    Image.fromarray(GRAY).save(tmp_path / "gray.png")
    assert np.array_equal(read_photograph(tmp_path / "gray.png"), GRAY)


def test_planes_may_come_first_and_opacity_is_dropped(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "planes.tif", np.moveaxis(COLOUR, -1, 0), photometric="rgb", planarconfig="separate")
    assert np.array_equal(read_photograph(tmp_path / "planes.tif"), COLOUR)
    rgba = np.dstack([(COLOUR >> 8).astype(np.uint8), np.full((12, 16), 7, np.uint8)])
    Image.fromarray(rgba).save(tmp_path / "rgba.png")
    assert np.array_equal(read_photograph(tmp_path / "rgba.png"), (COLOUR >> 8) * np.uint16(257))


def test_eight_bits_fill_the_scale_and_jpeg_is_made_linear(tmp_path: Path) -> None:
    flat = np.full((16, 16, 3), 188, np.uint8)
    for ending in ("png", "bmp", "tif"):
        Image.fromarray(flat).save(tmp_path / f"flat.{ending}")
        assert np.all(read_photograph(tmp_path / f"flat.{ending}") == 188 * 257)
    Image.fromarray(flat).save(tmp_path / "flat.jpg", quality=95)
    # sRGB 188 of 255 is half of the light (IEC 61966-2-1: 0.5029)
    assert np.abs(read_photograph(tmp_path / "flat.jpg") / 65535 - 0.503).max() < 0.006  # one code of the JPEG
    Image.fromarray(np.full((4, 4), 255, np.uint8)).save(tmp_path / "white.jpg")
    assert np.all(read_photograph(tmp_path / "white.jpg") == 65535)


def test_a_note_of_orientation_turns_nothing(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray((COLOUR >> 8).astype(np.uint8)).save(tmp_path / "turned.jpg", exif=exif)
    assert read_photograph(tmp_path / "turned.jpg").shape == (12, 16, 3)


def test_files_that_are_no_photographs_are_named(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "whole.tif", np.zeros((60, 80), np.uint16))
    (tmp_path / "short.tif").write_bytes((tmp_path / "whole.tif").read_bytes()[:3000])
    Image.fromarray(np.random.default_rng(2).integers(0, 255, (90, 90), np.uint8)).save(tmp_path / "whole.png")
    (tmp_path / "short.png").write_bytes((tmp_path / "whole.png").read_bytes()[:4000])
    (tmp_path / "text.jpg").write_text("no picture")
    (tmp_path / "empty.tif").write_bytes(b"")
    tifffile.imwrite(tmp_path / "float.tif", np.zeros((4, 4), np.float32))
    for name, words in (
        ("short.tif", "cut short or damaged"),
        ("short.png", "cut short or damaged"),
        ("empty.tif", "cut short or damaged"),
        ("text.jpg", "no picture that can be read"),
        ("float.tif", "must have 8 or 16 bits a value, got float32"),
        ("none.png", "is missing"),
    ):
        with pytest.raises(DeviceError, match=words) as caught:
            read_photograph(tmp_path / name)
        assert name in str(caught.value)


def test_names_are_ordered_as_people_count(tmp_path: Path) -> None:
    for name in ("IMG_10.tif", "IMG_9.tif", "img_9b.PNG", ".hidden.tif", "notes.txt", "a.jpg"):
        (tmp_path / name).write_bytes(b"x")
    assert [path.name for path in list_photographs(tmp_path)] == ["a.jpg", "IMG_9.tif", "img_9b.PNG", "IMG_10.tif"]


def test_one_plane_is_the_mean_of_three() -> None:
    assert to_one_plane(GRAY) is GRAY
    mean = to_one_plane(COLOUR)
    assert mean.dtype == np.uint16
    assert np.abs(mean - COLOUR.mean(axis=-1)).max() < 1.0


def test_a_photograph_arrives_when_it_has_stopped_growing(tmp_path: Path) -> None:
    arrivals = Arrivals(tmp_path)
    path = tmp_path / "one.tif"
    path.write_bytes(b"12")
    assert arrivals.look(()) == []
    path.write_bytes(b"1234")
    assert arrivals.look(()) == []
    assert arrivals.look(()) == [path]
    known = {file_key(path)}
    assert arrivals.look(known) == []
    path.write_bytes(b"123456")  # another photograph of the same name
    arrivals.look(known)
    assert arrivals.look(known) == [path]


def test_waiting_ends_with_what_came_or_says_what_is_missing() -> None:
    answers = iter([None, None, "here"])
    assert wait_for(lambda: next(answers), 0.0, None, "it") == "here"
    with pytest.raises(DeviceError, match=r"nothing came for 0\.01 s; still waiting for a photograph"):
        wait_for(lambda: None, 0.002, 0.01, "a photograph")
