"""Where compiled kernels go: nowhere of ours unless numba's own places cannot be written."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from paxel_runtime import numba_cache
from paxel_runtime.numba_cache import use_writable_cache


@pytest.fixture
def read_only(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A package folder that cannot be written, even by root; the cache folders lie in `tmp_path`."""
    package = tmp_path / "package"
    package.mkdir()
    can_access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != package and can_access(path, mode))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delitem(sys.modules, "numba", raising=False)  # this process keeps its own cache
    return package


def test_a_writable_package_needs_no_help(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    assert use_writable_cache(tmp_path) is None
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_a_users_own_setting_stands(monkeypatch: pytest.MonkeyPatch, read_only: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere")
    assert use_writable_cache(read_only) is None
    assert os.environ["NUMBA_CACHE_DIR"] == "/somewhere"


def test_a_read_only_package_gets_a_private_folder(read_only: Path, tmp_path: Path) -> None:
    folder = use_writable_cache(read_only)
    assert folder == tmp_path / "cache" / "paxel" / "numba"
    assert folder.stat().st_mode & 0o022 == 0
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)


def test_a_folder_that_others_can_write_is_passed_over(
    monkeypatch: pytest.MonkeyPatch, read_only: Path, tmp_path: Path
) -> None:
    shared = tmp_path / "cache" / "paxel" / "numba"
    shared.mkdir(parents=True)
    shared.chmod(0o777)
    own = tmp_path / "temporary"
    monkeypatch.setattr(numba_cache, "_candidates", lambda: [shared, own])
    assert use_writable_cache(read_only) == own
