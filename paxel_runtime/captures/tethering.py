"""Capturing with any camera: frames go out as numbered pictures, photographs come in through a folder.

A person (or any program) shows ``captures/frames/0001-....png`` full screen, one after the other, and photographs each;
any tethering program drops the photographs into ``captures/photographs``. Each is checked when it comes, given to its
frame, and copied as a capture; the photographs themselves are never changed. Readings of the meter come as lines of
``captures/measurements.csv``. Nothing is kept in memory that the folder does not hold, so a session goes on where it
stopped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import Exposure, frame_codes, guide_channel
from paxel_runtime.captures.meter_positions import meter_positions_mm
from paxel_runtime.captures.readings import load_readings, match_to_plan
from paxel_runtime.devices.folder import Arrivals, file_key, wait_for
from paxel_runtime.devices.photographs import read_photograph, to_one_plane
from paxel_runtime.errors import CalibrationError, DeviceError, InputError
from paxel_runtime.frame_files import write_frame
from paxel_runtime.installation import Installation
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.storage import read_json, read_tiff, write_json, write_text, write_tiff
from paxel_runtime.structured_light.inspection import Problem, capture_problem
from paxel_runtime.structured_light.samples import Sample, take_sample

__all__ = ["FolderDevices", "FolderSession", "frame_file", "load_folder_readings"]

Progress = Callable[[str, int, int], None]

_DARK = 0.01
"""Of full scale: brightest parts of a lit frame's photograph, below which nothing was photographed."""


@dataclass(frozen=True)
class FolderDevices:
    """A camera and a meter that are reached through a folder only.

    Attributes
    ----------
    tell : callable
        Given every message for the person who shows and photographs.
    poll_s : float
        Seconds from one look into the folder to the next.
    timeout_s : float, optional
        Seconds without anything new after which the session ends; None waits for ever.
    """

    tell: Callable[[str], None]
    poll_s: float = 1.0
    timeout_s: float | None = None


def frame_file(number: int, exposure: Exposure) -> str:
    """Name of an exposure's frame without its ending, ``0012-pattern-light-green-gray-x-3``; numbers start at 1."""
    surface = "" if exposure.name.startswith(exposure.surface) else f"{exposure.surface}-"
    return f"{number:04d}-{surface}{exposure.name}"


def load_folder_readings(path: Path, plan: Sequence[Exposure]) -> dict[str, NDArray[np.float64]]:
    """Readings that a person wrote, by exposure name; none while there is no line below the header.

    Raises
    ------
    InputError
        If a line is no reading, or of no exposure of the plan.
    """
    if not path.is_file() or not path.read_bytes().strip().partition(b"\n")[2]:
        return {}
    return match_to_plan(load_readings(path), plan)


class FolderSession:
    """One run through the plan: writes frames, checks what comes, saves it, tells what is next."""

    def __init__(
        self,
        installation: Installation,
        devices: FolderDevices,
        folder: Path,
        progress: Progress,
        plan: Sequence[Exposure],
    ) -> None:
        self.projector = installation.settings.projector
        self.guide = guide_channel(self.projector.channels)
        self.positions_mm = meter_positions_mm(installation.settings)
        self.devices = devices
        self.folder = folder
        self.progress = progress
        self.plan = plan
        self.total = len(plan)
        self.done = 0
        self.frames = folder / "frames"
        self.photographs = folder / "photographs"
        self.names = {exposure.name: frame_file(n, exposure) for n, exposure in enumerate(plan, 1)}
        self.record = folder / "photographs.json"
        self.taken: dict[str, dict[str, Any]] = read_json(self.record)["photographs"] if self.record.is_file() else {}
        self.samples: dict[str, Sample] = {}
        for path in (self.frames, self.photographs):
            path.mkdir(exist_ok=True)

    def take(self, exposures: Iterable[Exposure], labels: dict[int, NDArray[np.uint8]]) -> None:
        """Have every exposure photographed or measured that is not there yet."""
        exposures = list(exposures)
        self._write_frames(exposures, labels)
        for surface, group in groupby(exposures, key=lambda exposure: exposure.surface):
            there = list(group)
            pictures = [exposure for exposure in there if exposure.device == "camera"]
            self.done += sum(self._is_saved(exposure) for exposure in pictures)
            self._take_pictures(surface, pictures)
            readings = [exposure for exposure in there if exposure.device == "meter"]
            for position, here in groupby(readings, key=lambda exposure: exposure.position):
                self._await_readings(surface, position, list(here))

    def _is_saved(self, exposure: Exposure) -> bool:
        return (self.folder / f"{exposure.name}.tif").is_file()

    def _write_frames(self, exposures: Sequence[Exposure], labels: dict[int, NDArray[np.uint8]]) -> None:
        p = self.projector
        for i, exposure in enumerate(exposures):
            path = self.frames / f"{self.names[exposure.name]}.png"
            if not path.is_file():
                self.progress(f"write frame {path.name}", i, len(exposures))
                write_frame(path, frame_codes(exposure, p.channels, p.resolution, p.bits, labels), p.bits)

    # --- photographs ----------------------------------------------------------------------------------------------

    def _take_pictures(self, surface: str, pictures: Sequence[Exposure]) -> None:
        """Give every photograph that comes to its frame, until none of these frames is without."""
        arrivals = Arrivals(self.photographs)
        told = False
        while outstanding := [exposure for exposure in pictures if not self._is_saved(exposure)]:
            if not told:
                self._tell_what_to_photograph(surface, outstanding)
                told = True
            first = self.names[outstanding[0].name]
            self.progress(f"waiting for a photograph of frame {first[:4]}", self.done, self.total)
            came = wait_for(
                lambda: arrivals.look(self._known(pictures[0].name)) or None,
                self.devices.poll_s,
                self.devices.timeout_s,
                f"a photograph of frame {first}.png in {self.photographs}",
            )
            self._give(came, outstanding, pictures[0].name)

    def _known(self, group: str) -> set[str]:
        """Keys of photographs that need no look: rejected, saved as captures, or left for what follows this group."""
        return {
            key
            for key, entry in self.taken.items()
            if entry["problem"] or entry["after"] == group or (self.folder / f"{entry['exposure']}.tif").is_file()
        }

    def _give(self, came: Sequence[Path], outstanding: Sequence[Exposure], group: str) -> None:
        """Check photographs and save them: each for the frame that it is named after, else for the next in order.

        What is left over is kept for the next group: a card may hold the photographs of both surfaces.
        """
        by_frame = {self.names[exposure.name]: exposure for exposure in outstanding}
        named = {path: e for path in came for name, e in by_frame.items() if path.stem.startswith(name)}
        waiting = [exposure for exposure in outstanding if exposure not in named.values()]
        for path in came:
            exposure = named.get(path) or (waiting[0] if waiting else None)
            if exposure is None:
                self._note(path, after=group)
                continue
            problem = self._check_and_save(path, exposure)
            # a repeated photograph is one too many: the next one is for the same frame
            if path not in named and (problem is None or problem.kind != "repeated"):
                waiting.pop(0)

    def _check_and_save(self, path: Path, exposure: Exposure) -> Problem | None:
        """What is wrong with a photograph of an exposure; None when it was saved."""
        try:
            picture = _plane_of(read_photograph(path), exposure.channel)
        except DeviceError as error:
            problem: Problem | None = Problem(exposure.light, str(error).removeprefix(f"{path} "))
        else:
            sample = take_sample(to_one_plane(picture))
            problem = self._problem(exposure, sample)
            if problem is None:
                write_tiff(self.folder / f"{exposure.name}.tif", picture)
                self.samples[exposure.name] = sample
                self.done += 1
                self.progress(f"{path.name} is frame {self.names[exposure.name][:4]}", self.done, self.total)
        if problem is not None and problem.kind == "order":
            self._stop(path, exposure, problem)
        self._note(path, exposure=exposure.name, problem=problem.text if problem else "")
        if problem is not None:
            frame = self.names[exposure.name]
            again = "" if problem.kind == "repeated" else f" Photograph {frame}.png again."
            self.devices.tell(f"{path.name} (for frame {frame[:4]}) {problem.text}. It is left out.{again}")
        return problem

    def _note(self, path: Path, *, exposure: str = "", problem: str = "", after: str = "") -> None:
        """Remember what became of a photograph."""
        self.taken[file_key(path)] = {"exposure": exposure, "problem": problem, "after": after}
        write_json(self.record, {"photographs": self.taken})

    def _stop(self, path: Path, exposure: Exposure, problem: Problem) -> None:
        """End the session where photographs do not go together: those that follow would not, either."""
        first, before = exposure.name, path.name
        if exposure.light.endswith("-inverse"):
            first = exposure.name.removesuffix("-inverse")
            before = self._label(exposure.channel, exposure.light.removesuffix("-inverse"))
            (self.folder / f"{first}.tif").unlink(missing_ok=True)
        raise CalibrationError(
            f"{path.name} (for frame {self.names[exposure.name][:4]}) {problem.text}. No photograph from {before} on "
            f"was used. Mend that in {self.photographs}: remove what is too many, add what is missing under a name "
            f"that sorts into place or begins as its frame's does ({self.names[first]}.tif). Then run the same command "
            "again"
        )

    def _problem(self, exposure: Exposure, sample: Sample) -> Problem | None:
        """Hold a photograph against its exposure and the captures before it."""
        if exposure.light:
            samples = {**self._light_samples(exposure), exposure.light: sample}
            return capture_problem(exposure.light, samples, lambda frame: self._label(exposure.channel, frame))
        level = float(np.percentile(sample.values, 99.0)) / 65535
        if level < _DARK and any(value > 0 for row in exposure.P for value in row):
            return Problem("", f"is black (its brightest parts are at {level:.1%} of full scale): is the frame shown?")
        earlier = next((found for name in self.names if (found := self._sample(name)) is not None), sample)
        return capture_problem(exposure.name, {"earlier": earlier, exposure.name: sample})

    def _light_samples(self, exposure: Exposure) -> dict[str, Sample]:
        """Structured light of an exposure's channel, by frame; its Gray code is the guide channel's."""
        samples = {}
        for channel in (self.guide, exposure.channel):
            prefix = f"light-{channel}-"
            for name in self.names:
                frame = name.removeprefix(prefix)
                coarse = not frame.startswith(("line", "phase"))
                if name.startswith(prefix) and name != exposure.name and (coarse or channel == exposure.channel):
                    found = self._sample(name)
                    if found is not None:
                        samples[frame] = found
        return samples

    def _sample(self, name: str) -> Sample | None:
        """Sample of a saved capture."""
        path = self.folder / f"{name}.tif"
        if name not in self.samples and path.is_file():
            self.samples[name] = take_sample(to_one_plane(read_tiff(path)))
        return self.samples.get(name)

    def _label(self, channel: str, frame: str) -> str:
        """What a person knows an earlier capture by: its photograph, or its frame."""
        for name in (f"light-{channel}-{frame}", f"light-{self.guide}-{frame}"):
            for key, entry in self.taken.items():
                if entry["exposure"] == name and not entry["problem"]:
                    return key.split("|")[0]
        return frame

    def _tell_what_to_photograph(self, surface: str, outstanding: Sequence[Exposure]) -> None:
        numbers = [self.names[exposure.name][:4] for exposure in outstanding]
        first = self.names[outstanding[0].name]
        together = int(numbers[-1]) - int(numbers[0]) == len(numbers) - 1 and len(numbers) > 2
        which = f"{numbers[0]} to {numbers[-1]}" if together else ", ".join(numbers)
        self.devices.tell(
            f"{len(outstanding)} photographs of the {_SURFACES[surface]} to take, of frames {which}:\n"
            f"  1. bring the {_SURFACES[surface]} under the projector; then move nothing\n"
            f"  2. show these pictures of {self.frames} full screen, pixel for pixel, in order, from\n"
            f"     {first}.png on\n"
            "  3. photograph each once: camera on a stand, focus and white balance by hand, one exposure by hand for "
            "all frames of a channel,\n"
            "     so that the brightest parts of its first frame are at about two thirds\n"
            f"  4. let the photographs come into {self.photographs}: 16-bit TIFF if you can, else PNG or JPEG;\n"
            "     the order of their names is the order of the frames, unless a name begins as its frame's does"
        )

    # --- readings -------------------------------------------------------------------------------------------------

    def _await_readings(self, surface: str, position: int, readings: Sequence[Exposure]) -> None:
        """Wait until measurements.csv holds every reading of one position on a surface."""
        path = self.folder / "measurements.csv"
        told = 0
        while True:
            stamp = _stamp(path)
            known = self._readings(path)
            missing = [exposure for exposure in readings if exposure.name not in known]
            if not missing:
                break
            if len(missing) != told:
                self._tell_what_to_measure(surface, position, missing, path, first=not told)
                told = len(missing)
            wait_for(
                lambda stamp=stamp: True if _stamp(path) != stamp else None,  # type: ignore[misc]
                self.devices.poll_s,
                self.devices.timeout_s,
                f"{len(missing)} readings in {path}, next: {missing[0].name}",
            )
        self.done += len(readings)
        self.progress(f"{surface}: readings", self.done, self.total)

    def _readings(self, path: Path) -> dict[str, NDArray[np.float64]]:
        try:
            return load_folder_readings(path, self.plan)
        except InputError as error:  # a file that somebody is at: it is told, and read again when it changes
            self.devices.tell(f"{error}. Waiting for it to be mended")
            return {}

    def _tell_what_to_measure(
        self, surface: str, position: int, missing: Sequence[Exposure], path: Path, *, first: bool
    ) -> None:
        """Say what to measure next, at first with how; the list of all that is missing is kept up to date."""
        if not path.exists():
            write_text(path, ",".join(["exposure", "surface", *(f"{w:g}" for w in WAVELENGTHS_NM)]) + "\n")
        rows = [f"{self.names[e.name]}.png,{e.name},{e.surface}" for e in missing]
        write_text(self.folder / "to-measure.csv", "\n".join(["frame,exposure,surface", *rows]) + "\n")
        following = missing[0]
        what = f"show {self.names[following.name]}.png, measure, add the line {following.name},{following.surface},..."
        if not first:
            self.devices.tell(f"{len(missing)} readings left: {what}")
            return
        self.devices.tell(
            f"{len(missing)} readings of the {_SURFACES[surface]} to take: {what}\n{self._where(position)}"
            f"  with its spectrum ({WAVELENGTHS_NM[0]:g} to {WAVELENGTHS_NM[-1]:g} nm, {len(WAVELENGTHS_NM)} numbers) "
            f"to {path}\n  all that are missing stand in {self.folder / 'to-measure.csv'}"
        )

    def _where(self, position: int) -> str:
        """Where the meter looks, as a line of a message; empty while it never moves."""
        others = len(self.positions_mm) - 1
        if not others:
            return ""
        if position == 0:
            return "  the middle of the meter's spot lies at the centre of the projection\n"
        x, y = self.positions_mm[position]
        way = [f"{abs(x):.0f} mm to the {'left' if x < 0 else 'right'}"] if x else []
        way += [f"{abs(y):.0f} mm {'down' if y < 0 else 'up'}"] if y else []
        return (
            f"  move the meter, position {position} of {others}: its spot lies {' and '.join(way)} from the "
            "centre of the projection\n"
        )


_PLANES = ("red", "green", "blue")
_SURFACES = {"pattern": "printed pattern", "white": "second surface (the white or gray sheet)", "paper": "white paper"}


def _plane_of(picture: NDArray[np.uint16], channel: str) -> NDArray[np.uint16]:
    """What is saved of a photograph: all planes, or the one that sees the only channel that is lit."""
    if picture.ndim == 2 or not channel:
        return picture
    if channel in _PLANES:
        return np.ascontiguousarray(picture[..., _PLANES.index(channel)])
    return to_one_plane(picture)


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_size, stat.st_mtime_ns
