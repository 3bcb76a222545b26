"""Frames as PNG: every code comes back, others can read them, and a wrong file is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.frame_files import read_frame, write_frame


@pytest.mark.parametrize("bits", [1, 8, 10, 12, 16])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_every_code_comes_back(bits: int, channels: int, tmp_path: Path) -> None:
    codes = np.random.default_rng(bits).integers(0, 2**bits, (37, 53, channels)).astype(np.uint16)
    codes[0, 0], codes[0, 1] = 0, 2**bits - 1
    write_frame(tmp_path / "frame.png", codes, bits)
    np.testing.assert_array_equal(read_frame(tmp_path / "frame.png", bits), codes)


def test_all_codes_of_ten_bits_are_different_levels_of_sixteen(tmp_path: Path) -> None:
    codes = np.arange(1024, dtype=np.uint16).reshape(32, 32, 1)
    write_frame(tmp_path / "frame.png", codes, 10)
    with Image.open(tmp_path / "frame.png") as image:  # Pillow reads gray pictures of 16 bits
        levels = np.asarray(image).astype(int)
    assert image.format == "PNG"
    np.testing.assert_array_equal(levels.ravel(), np.rint(np.arange(1024) * 65535 / 1023))
    np.testing.assert_array_equal(read_frame(tmp_path / "frame.png", 10), codes)


def test_other_programs_see_the_colours(tmp_path: Path) -> None:
    codes = np.broadcast_to(np.array([1023, 512, 0], np.uint16), (20, 30, 3))
    write_frame(tmp_path / "frame.png", codes, 10)
    with Image.open(tmp_path / "frame.png") as image:  # reads colour of 16 bits as 8
        np.testing.assert_allclose(np.asarray(image.convert("RGB"))[0, 0], (255, 128, 0), atol=1)


def test_what_is_no_frame_is_refused(tmp_path: Path) -> None:
    for shape in ((4, 4), (4, 4, 5)):
        with pytest.raises(InputError, match="1 to 4 channels"):
            write_frame(tmp_path / "frame.png", np.zeros(shape, np.uint8), 8)
    with pytest.raises(InputError, match="at most 255, got 256"):
        write_frame(tmp_path / "frame.png", np.full((4, 4, 3), 256, np.uint16), 8)
    assert not (tmp_path / "frame.png").exists()
    with pytest.raises(InstallationError, match="is missing"):
        read_frame(tmp_path / "frame.png", 10)
    write_frame(tmp_path / "frame.png", np.zeros((4, 4, 3), np.uint8), 8)
    with pytest.raises(InstallationError, match=r"projector\.bits is 10"):
        read_frame(tmp_path / "frame.png", 10)
    write_frame(tmp_path / "cut.png", np.ones((40, 40, 3), np.uint16), 10)
    data = (tmp_path / "cut.png").read_bytes()
    for wrong in (data[:60], data[: len(data) // 2], b"", b"GIF89a"):
        (tmp_path / "cut.png").write_bytes(wrong)
        with pytest.raises(InstallationError, match="16 bits"):
            read_frame(tmp_path / "cut.png", 10)
