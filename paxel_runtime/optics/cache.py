"""A folder on disk where the virtual bench keeps what takes seconds to set up and follows from its parameters alone.

An entry is an array under a name that is a digest of all inputs it was computed from and of the bench's own sources:
it is never stale, so that no caller has to think of it. The folder is ``$PAXEL_CACHE_DIR``, or ``paxel/bench`` in
``$XDG_CACHE_HOME`` or ``~/.cache``; an empty ``PAXEL_CACHE_DIR`` turns it off. It holds at most 512 MiB: what was not
used for the longest goes first. A cache may fail without harm: what cannot be read or is damaged is computed again,
what cannot be written is not kept. This file knows no physics.
"""

from __future__ import annotations

import os
import tempfile
import zlib
from collections.abc import Callable
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

__all__ = ["cached", "fingerprint"]

_MOST_BYTES = 512 * 2**20
_CHUNK_BYTES = 2**20
_CHECK_BYTES = 4
_SUFFIX, _UNFINISHED = ".bench", ".part"


def cached(name: str, inputs: Any, compute: Callable[[], NDArray[Any]]) -> NDArray[Any]:
    """``compute()``, or what it gave before for equal inputs.

    Parameters
    ----------
    name : str
        What it is; the beginning of the file's name.
    inputs : nested tuples and lists of arrays, numbers, strings and None
        Everything that the result depends on, apart from the sources of the bench.
    compute : callable
        Gives a contiguous array of numbers.
    """
    folder = _folder()
    if folder is None:
        return compute()
    path = folder / f"{name}-{fingerprint((_sources_digest(), inputs))}{_SUFFIX}"
    result = _load(path)
    if result is None:
        result = compute()
        _save(path, result)
    return result


def fingerprint(inputs: Any) -> str:
    """Digest (32 hexadecimal digits) of nested tuples and lists of arrays, numbers, strings and None.

    Raises
    ------
    TypeError
        For anything else.
    """
    digest = blake2b(digest_size=16)
    _feed(digest, inputs)
    return digest.hexdigest()


def _feed(digest: blake2b, value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"array {value.dtype.str} {value.shape} ".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif isinstance(value, tuple | list):
        digest.update(f"{len(value)} of ".encode())
        for item in value:
            _feed(digest, item)
    elif value is None or isinstance(value, str | bool | int | float | np.generic):
        text = repr(value.item() if isinstance(value, np.generic) else value).encode()
        digest.update(b"%d %b " % (len(text), text))
    else:
        raise TypeError(f"a digest is made of arrays, numbers, strings and None; got {type(value).__name__}")


@cache
def _sources_digest() -> str:
    """Of every module of the bench's physics: an edit makes all entries unreachable, and age removes them."""
    return fingerprint([path.read_text(encoding="utf-8") for path in sorted(Path(__file__).parent.glob("*.py"))])


def _folder() -> Path | None:
    chosen = os.environ.get("PAXEL_CACHE_DIR")
    if chosen is not None:
        return Path(chosen) if chosen else None
    home = os.path.expanduser("~")  # noqa: PTH111 - Path.home() raises where there is no home
    return Path(os.environ.get("XDG_CACHE_HOME") or Path(home) / ".cache") / "paxel" / "bench"


def _load(path: Path) -> NDArray[Any] | None:
    """The array in a file, None where there is none or it is damaged."""
    try:
        with path.open("rb") as file:
            check = file.read(_CHECK_BYTES)
            if _checksum(file) != check:
                return None
            file.seek(_CHECK_BYTES)
            result: NDArray[Any] = np.load(file, allow_pickle=False)
        os.utime(path)  # used now: it goes last
    except (OSError, ValueError, EOFError):
        return None
    return result


def _save(path: Path, result: NDArray[Any]) -> None:
    """Write the array under a passing name, then give it its own: a reader sees all of it or nothing."""
    if result.nbytes > _MOST_BYTES // 2:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=_UNFINISHED, delete=False) as file:
            unfinished = Path(file.name)
        try:
            with unfinished.open("w+b") as file:
                file.write(bytes(_CHECK_BYTES))
                np.save(file, result, allow_pickle=False)
                file.seek(_CHECK_BYTES)
                check = _checksum(file)
                file.seek(0)
                file.write(check)
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)
        _evict(path.parent)
    except OSError:
        return


def _checksum(file: BinaryIO) -> bytes:
    """Of the rest of a file."""
    check = 0
    while chunk := file.read(_CHUNK_BYTES):
        check = zlib.crc32(chunk, check)
    return check.to_bytes(_CHECK_BYTES, "little")


def _evict(folder: Path) -> None:
    """Remove what was not used for the longest until the rest is small enough; nothing but the cache's own files."""
    entries = [
        (status.st_mtime_ns, status.st_size, path)
        for path in folder.iterdir()
        if path.suffix in (_SUFFIX, _UNFINISHED)
        for status in [path.stat()]
    ]
    held = sum(size for _, size, _ in entries)
    for _, size, path in sorted(entries):
        if held <= _MOST_BYTES:
            return
        path.unlink(missing_ok=True)
        held -= size
