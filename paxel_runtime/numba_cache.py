"""Where numba keeps the compiled kernels.

By itself numba writes beside the sources, or to the user's cache folder, and refuses to import a cached kernel where
neither can be written (a read-only install run by a user without a home). `use_writable_cache` is called when
`paxel_runtime` is imported, before any kernel compiles, and steps in only then. A user's own ``NUMBA_CACHE_DIR`` is
left alone. This file imports nothing heavy and knows no kernel.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

__all__ = ["use_writable_cache"]


def use_writable_cache(package: Path = Path(__file__).parent) -> Path | None:
    """Point numba at a folder of our own where its usual places cannot be written.

    Parameters
    ----------
    package : Path
        The folder of the sources; kernels cache in its ``__pycache__`` where that can be written.

    Returns
    -------
    Path or None
        The folder chosen; None where numba needs no help, or no place at all can be written.
    """
    if os.environ.get("NUMBA_CACHE_DIR") or _can_write(package / "__pycache__"):
        return None
    for folder in _candidates():
        if _own_folder(folder):
            os.environ["NUMBA_CACHE_DIR"] = str(folder)  # also for child processes
            if "numba" in sys.modules:  # it has read its settings already
                sys.modules["numba"].config.CACHE_DIR = str(folder)
            return folder
    return None


def _candidates() -> list[Path]:
    home = os.path.expanduser("~")  # noqa: PTH111 - Path.home() raises where there is no home
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path(home) / ".cache")
    user = os.getuid() if hasattr(os, "getuid") else "user"
    return [base / "paxel" / "numba", Path(tempfile.gettempdir()) / f"paxel-numba-{user}"]


def _can_write(folder: Path) -> bool:
    """Whether files can be made in `folder`, or the folder itself in the nearest parent that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK | os.X_OK)


def _own_folder(folder: Path) -> bool:
    """Make `folder`, private to the user: numba executes what it finds there."""
    if not _can_write(folder):
        return False
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        owner, mode = folder.stat().st_uid, folder.stat().st_mode
    except OSError:
        return False  # the next candidate is tried; numba says what is wrong if there is none
    mine = not hasattr(os, "getuid") or (owner == os.getuid() and not mode & 0o022)
    return mine and _can_write(folder)
