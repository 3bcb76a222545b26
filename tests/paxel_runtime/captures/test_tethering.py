"""Capturing through a folder, with a pretended photographer who makes every mistake."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import Exposure, plan_geometry
from paxel_runtime.captures.measurements import append_measurement
from paxel_runtime.captures.meter_positions import at_positions
from paxel_runtime.captures.tethering import FolderDevices, FolderSession, frame_file, load_folder_readings
from paxel_runtime.errors import CalibrationError, DeviceError
from paxel_runtime.frame_files import read_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.settings import make_settings
from paxel_runtime.storage import read_tiff

SIZE, SHAPE = (48, 32), (72, 112)
RGB = ("red", "green", "blue")
PLAN = plan_geometry(RGB, SIZE)
LIGHT = [exposure for exposure in PLAN if exposure.light]  # 2 + 2 (5 + 4) + 16 of green, 16 of red, 16 of blue
Photograph = Callable[..., NDArray[np.uint16]]


@dataclass
class Studio:
    """One installation's captures folder, what was said in it, and a camera for it."""

    installation: Installation
    folder: Path
    photograph: Photograph
    said: list[str] = field(default_factory=list)
    shots: int = 0

    def session(self, plan: list[Exposure], timeout_s: float = 0.2) -> FolderSession:
        devices = FolderDevices(self.said.append, poll_s=0.01, timeout_s=timeout_s)
        return FolderSession(self.installation, devices, self.folder, lambda message, done, total: None, plan)

    def shoot(self, plan: list[Exposure], number: int, name: str = "", **options: float) -> Path:
        """Photograph a frame of the plan, from its file as a viewer shows it; the camera numbers its pictures."""
        exposure = plan[number - 1]
        frame = read_frame(self.folder / "frames" / f"{frame_file(number, exposure)}.png", 8) / 255.0
        planes = [self.photograph(frame[..., c], SHAPE, **options) for c in range(3)]
        self.shots += 1
        path = self.folder / "photographs" / (f"{name}.tif" if name else f"IMG_{self.shots}.tif")
        path.parent.mkdir(exist_ok=True)
        tifffile.imwrite(path.with_suffix(".part"), np.stack(planes, axis=-1), photometric="rgb")
        path.with_suffix(".part").rename(path)
        return path

    def saved(self) -> set[str]:
        return {path.stem for path in self.folder.glob("*.tif")}


@pytest.fixture
def studio(tmp_path: Path, photograph: Photograph) -> Studio:
    settings = make_settings("bw-checkerboard", {"projector.resolution": list(SIZE)})
    folder = tmp_path / "captures"
    folder.mkdir()
    return Studio(Installation(tmp_path, settings), folder, photograph)


def write_frames(studio: Studio, plan: list[Exposure]) -> None:
    """The first run: it writes the frames, says what to do, and ends because nothing comes."""
    with pytest.raises(DeviceError, match="nothing came for"):
        studio.session(plan, 0.02).take(plan, {})


def test_frames_are_numbered_pictures_of_the_plan(studio: Studio) -> None:
    plan = PLAN[:3] + PLAN[-2:]
    write_frames(studio, plan)
    names = sorted(path.name for path in (studio.folder / "frames").iterdir())
    assert names[:2] == ["0001-pattern-light-green-white.png", "0002-pattern-light-green-black.png"]
    assert names[-1] == "0005-white-dark-blue.png"
    white = read_frame(studio.folder / "frames" / names[0], 8)
    assert white.shape == (32, 48, 3)
    assert np.all(white == [0, 255, 0])
    text = studio.said[0]
    assert "3 photographs of the printed pattern to take, of frames 0001 to 0003" in text
    assert str(studio.folder / "photographs") in text


def test_a_photographer_at_work_needs_no_names(studio: Studio) -> None:
    plan = LIGHT

    def photographer() -> None:
        for number in range(1, len(plan) + 1):
            path = studio.folder / "frames" / f"{frame_file(number, plan[number - 1])}.png"
            while not path.is_file():
                time.sleep(0.01)
            studio.shoot(plan, number)

    thread = threading.Thread(target=photographer)
    thread.start()
    session = studio.session(plan, 30.0)
    session.take(plan, {})
    thread.join()
    assert session.done == len(plan) == 52 + 16
    assert studio.saved() == {exposure.name for exposure in plan}
    assert len(studio.said) == 1  # nothing but what to do
    red = read_tiff(studio.folder / "light-red-line-x-3.tif")
    with tifffile.TiffFile(studio.folder / "photographs" / "IMG_40.tif") as file:
        assert plan[39].name == "light-red-line-x-3"
        assert np.array_equal(red, file.asarray()[..., 0])  # its own plane, not changed
    assert red.shape == SHAPE


def test_a_whole_card_at_once_and_a_second_visit(studio: Studio) -> None:
    plan = LIGHT[:20]
    write_frames(studio, plan)
    for number in range(1, 13):
        studio.shoot(plan, number)
    with pytest.raises(DeviceError, match=r"waiting for a photograph of frame 0013-pattern-light-green-gray-y-3\.png"):
        studio.session(plan).take(plan, {})
    assert len(studio.saved()) == 12
    before = {path: path.read_bytes() for path in (studio.folder / "photographs").iterdir()}
    for number in range(13, 21):
        studio.shoot(plan, number)
    session = studio.session(plan)
    session.take(plan, {})
    assert session.done == 20
    assert all(path.read_bytes() == content for path, content in before.items())


def test_a_card_with_both_surfaces_and_one_bad_photograph(studio: Studio) -> None:
    plan = [LIGHT[0], LIGHT[1], *(e for e in PLAN if e.name in ("pattern-full-red", "pattern-full-blue"))]
    plan += [e for e in PLAN if e.name in ("white-white", "white-full-red")]
    write_frames(studio, plan[:4])
    studio.session(plan)._write_frames(plan, {})
    for number in range(1, 7):
        studio.shoot(plan, number, **({"gain": 0.0} if number == 4 else {}), ink=1.0 if number > 4 else 0.08)
    with pytest.raises(DeviceError, match="photograph of frame 0004-pattern-full-blue"):
        studio.session(plan).take(plan, {})
    assert len(studio.saved()) == 3  # the white surface's are not taken for what is missing on the pattern
    studio.shoot(plan, 4)
    studio.session(plan).take(plan, {})
    assert studio.saved() == {exposure.name for exposure in plan}
    red = read_tiff(studio.folder / "white-full-red.tif")
    assert np.median(red) > np.median(read_tiff(studio.folder / "pattern-full-red.tif"))


def test_a_photograph_named_after_its_frame_goes_there(studio: Studio) -> None:
    plan = LIGHT[:3]
    write_frames(studio, plan)
    for number in (3, 1, 2):
        studio.shoot(plan, number, name=f"{frame_file(number, plan[number - 1])}_retake")
    studio.session(plan).take(plan, {})
    record = json.loads((studio.folder / "photographs.json").read_text())["photographs"]
    given = {key.split("|")[0]: entry["exposure"] for key, entry in record.items()}
    assert given["0003-pattern-light-green-gray-x-4_retake.tif"] == "light-green-gray-x-4"


def test_a_repeated_photograph_is_left_out_and_the_next_one_taken(studio: Studio) -> None:
    plan = LIGHT[:8]
    write_frames(studio, plan)
    for number in (1, 2, 3, 3, 4, 5, 6, 7, 8):  # frame 3 twice: the second is no inverse of the first
        studio.shoot(plan, number)
    studio.session(plan).take(plan, {})
    assert len(studio.saved()) == 8
    assert "IMG_4.tif (for frame 0004) shows the same as IMG_3.tif, not its inverse" in studio.said[-1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gain": 3.0}, "is saturated on"),
        ({"gain": 0.0}, "is black, and should add up to white with IMG_"),
    ],
)
def test_a_bad_exposure_is_asked_for_again(studio: Studio, options: dict[str, float], words: str) -> None:
    plan = LIGHT[:8]
    write_frames(studio, plan)
    for number in range(1, 9):
        studio.shoot(plan, number, **(options if number == 6 else {}), ink=1.0)
    with pytest.raises(DeviceError, match="waiting for a photograph of frame 0006"):
        studio.session(plan).take(plan, {})
    assert any(f"IMG_6.tif (for frame 0006) {words}" in text and "again" in text for text in studio.said)
    assert len(studio.saved()) == 7  # the others are kept
    studio.shoot(plan, 6, ink=1.0)
    studio.session(plan).take(plan, {})
    assert len(studio.saved()) == 8


def test_a_photograph_cut_short_or_of_another_size_is_named(studio: Studio) -> None:
    plan = LIGHT[:4]
    write_frames(studio, plan)
    for number in (1, 2, 3, 4):
        studio.shoot(plan, number)
    whole = (studio.folder / "photographs" / "IMG_3.tif").read_bytes()
    (studio.folder / "photographs" / "IMG_3.tif").write_bytes(whole[: len(whole) // 2])
    tifffile.imwrite(studio.folder / "photographs" / "IMG_4.tif", np.full((60, 112, 3), 9999, np.uint16))
    with pytest.raises(DeviceError, match="frame 0003"):
        studio.session(plan).take(plan, {})
    said = "\n".join(studio.said)
    assert "IMG_3.tif (for frame 0003) is cut short or damaged" in said
    assert "IMG_4.tif (for frame 0004) has 112 x 60 pixels, the others 112 x 72" in said


def test_a_missing_photograph_ends_the_session_where_it_is_missing(studio: Studio) -> None:
    plan = LIGHT[:12]
    write_frames(studio, plan)
    for number in (1, 2, 3, 4, 5, 7, 8, 9, 10, 11, 12):
        studio.shoot(plan, number)
    with pytest.raises(CalibrationError, match=r"IMG_6\.tif \(for frame 0006\) does not add up") as caught:
        studio.session(plan).take(plan, {})
    assert "No photograph from IMG_5.tif on was used" in str(caught.value)
    assert "0005-pattern-light-green-gray-x-3.tif" in str(caught.value)
    assert len(studio.saved()) == 4
    # what is missing comes under its frame's name, and all the others find their places
    studio.shoot(plan, 6, name=frame_file(6, plan[5]))
    studio.session(plan).take(plan, {})
    assert len(studio.saved()) == 12


def test_a_camera_that_moved_ends_the_session(studio: Studio) -> None:
    plan = LIGHT[:8]
    write_frames(studio, plan)
    for number in range(1, 9):
        studio.shoot(plan, number, **({"turn_px": 3.0} if number > 4 else {}))
    with pytest.raises(CalibrationError, match=r"IMG_6\.tif .*is displaced by about \+3, \+0 pixels.*sheet moved"):
        studio.session(plan).take(plan, {})


def test_a_line_out_of_order_ends_the_session(studio: Studio) -> None:
    write_frames(studio, LIGHT)
    order = [*range(1, 24), 25, 24]
    for number in order:
        studio.shoot(LIGHT, number)
    assert LIGHT[23].name == "light-green-line-x-3"
    with pytest.raises(CalibrationError, match=r"IMG_24\.tif \(for frame 0024\) shows line-x-4: it is out of order"):
        studio.session(LIGHT).take(LIGHT, {})
    assert len(studio.saved()) == 23


def test_a_file_that_still_grows_is_waited_for(studio: Studio) -> None:
    plan = LIGHT[:1]
    write_frames(studio, plan)
    whole = studio.shoot(plan, 1).read_bytes()
    growing = studio.folder / "photographs" / "IMG_1.tif"
    growing.write_bytes(b"")

    def write_slowly() -> None:
        for part in range(1, 11):
            growing.write_bytes(whole[: len(whole) * part // 10])
            time.sleep(0.003)

    thread = threading.Thread(target=write_slowly)
    thread.start()
    studio.session(plan, 5.0).take(plan, {})
    thread.join()
    assert studio.saved() == {"light-green-white"}


def test_readings_come_as_lines_of_a_table(studio: Studio) -> None:
    plan = [
        Exposure("read-white-white", "white", "meter", P=((1.0, 1.0, 1.0),)),
        Exposure("read-white-black", "white", "meter", P=((0.0, 0.0, 0.0),)),
    ]
    path = studio.folder / "measurements.csv"
    with pytest.raises(DeviceError, match="still waiting for 2 readings"):
        studio.session(plan, 0.02).take(plan, {})
    assert "next" not in studio.said[0]
    assert "show 0001-white-read-white-white.png, measure, add the line read-white-white,white,..." in studio.said[0]
    assert path.read_text().startswith("exposure,surface,380,385,")
    assert (studio.folder / "to-measure.csv").read_text().splitlines()[1:] == [
        "0001-white-read-white-white.png,read-white-white,white",
        "0002-white-read-white-black.png,read-white-black,white",
    ]
    append_measurement(path, "read-white-white", "white", np.ones(WAVELENGTHS_NM.shape))

    def measure() -> None:
        time.sleep(0.05)
        with path.open("a", encoding="utf-8") as file:
            file.write("read-white-black,white," + ",".join(["0.5"] * 80) + "\n")  # a number short
        time.sleep(0.1)
        path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")
        append_measurement(path, "read-white-black", "white", np.ones(WAVELENGTHS_NM.shape))

    thread = threading.Thread(target=measure)
    thread.start()
    studio.session(plan, 5.0).take(plan, {})
    thread.join()
    assert any("line 3 (reading read-white-black) must have 83 cells" in text for text in studio.said)
    assert load_folder_readings(path, plan).keys() == {"read-white-white", "read-white-black"}


def test_the_meter_is_moved_once_a_position(studio: Studio) -> None:
    """Each position is asked for alone, with its place in words; what is missing elsewhere comes later."""
    keys = {"projector.resolution": [1600, 900], "projector.width_mm": 800.0, "meter.positions": 9}
    moved = Installation(studio.folder.parent, make_settings("bw-checkerboard", keys))
    white = Exposure("read-white-white", "white", "meter", P=((1.0, 1.0, 1.0),))
    plan = at_positions([white], 9, 2)
    path = studio.folder / "measurements.csv"
    for exposure in plan:
        devices = FolderDevices(studio.said.append, poll_s=0.01, timeout_s=0.02)
        session = FolderSession(moved, devices, studio.folder, lambda message, done, total: None, plan)
        studio.said.clear()
        with pytest.raises(DeviceError, match=f"1 readings in .*next: {exposure.name}"):
            session.take(plan, {})
        where = studio.said[-1].splitlines()[1]
        expected = {
            0: "the middle of the meter's spot lies at the centre of the projection",
            1: "position 1 of 8: its spot lies 150 mm to the left and 100 mm up from the centre of the projection",
            2: "position 2 of 8: its spot lies 100 mm up from the centre",
            4: "position 4 of 8: its spot lies 150 mm to the right from the centre",
            5: "position 5 of 8: its spot lies 150 mm to the right and 100 mm down from the centre",
        }.get(exposure.position, f"position {exposure.position} of 8")
        assert expected in where
        append_measurement(path, exposure.name, "white", np.ones(WAVELENGTHS_NM.shape))
    session.take(plan, {})
    assert load_folder_readings(path, plan).keys() == {exposure.name for exposure in plan}
