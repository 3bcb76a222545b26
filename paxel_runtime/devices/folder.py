"""Devices that are people and other programs: what they leave in a folder is noticed here.

Any tethering program, card reader or web page may drop photographs into the folder; nothing is asked of it but that a
file grows until it is whole. Knows files and time; must not know what the photographs show.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TypeVar

from paxel_runtime.devices.photographs import list_photographs
from paxel_runtime.errors import DeviceError

__all__ = ["Arrivals", "file_key", "wait_for"]

T = TypeVar("T")


class Arrivals:
    """Photographs that appear in a folder.

    Parameters
    ----------
    folder : Path
    settle_s : float
        A file that is older, or has kept its size from one look to the next, is taken to be whole.
    """

    def __init__(self, folder: Path, settle_s: float = 2.0) -> None:
        self.folder = folder
        self._settle_s = settle_s
        self._seen: dict[str, str] = {}

    def look(self, known: Collection[str]) -> list[Path]:
        """Whole photographs, in the order of their names, whose `file_key` is not known yet."""
        before, self._seen, ready = self._seen, {}, []
        now = time.time()
        for path in list_photographs(self.folder):
            try:
                key, age_s = file_key(path), now - path.stat().st_mtime
            except OSError:
                continue  # renamed by the program that wrote it
            self._seen[path.name] = key
            if key not in known and (before.get(path.name) == key or age_s > self._settle_s):
                ready.append(path)
        return ready


def file_key(path: Path) -> str:
    """Name, size and time of a file: another key is another photograph, or more of it."""
    stat = path.stat()
    return f"{path.name}|{stat.st_size}|{stat.st_mtime_ns}"


def wait_for(look: Callable[[], T | None], poll_s: float, timeout_s: float | None, what: str) -> T:
    """Look again and again, asleep in between, until there is something.

    Raises
    ------
    DeviceError
        If there is nothing after `timeout_s` seconds.
    """
    end = None if timeout_s is None else time.monotonic() + timeout_s
    while (found := look()) is None:
        if end is not None and time.monotonic() >= end:
            raise DeviceError(
                f"nothing came for {timeout_s:g} s; still waiting for {what}. Everything that came is kept: run the "
                "same command to go on"
            )
        time.sleep(poll_s)
    return found
