"""Where compiled kernels go: nowhere of ours unless numba's own places cannot be written."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

import paxel_design
import paxel_runtime
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


KERNEL_FILES = [
    file
    for package in (paxel_runtime, paxel_design)
    for file in sorted(Path(package.__path__[0]).rglob("*.py"))
    if "njit(" in file.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("file", KERNEL_FILES, ids=lambda file: "-".join(file.with_suffix("").parts[-3:]))
def test_every_kernel_is_cached(file: Path) -> None:
    root = Path(paxel_runtime.__path__[0]).parent
    module = importlib.import_module(".".join(file.relative_to(root).with_suffix("").parts))
    kernels = [value for value in vars(module).values() if isinstance(value, Dispatcher)]
    assert kernels
    assert all(isinstance(kernel._cache, FunctionCache) for kernel in kernels)


INSTALLED_READ_ONLY = """
import os, sys
folder, can_access = os.environ["PACKAGE"], os.access
os.access = lambda path, mode, **how: not str(path).startswith(folder) and can_access(path, mode, **how)
from paxel_runtime.optics.grid import bspline_weights as kernel
kernel(0.5)
print(sum(kernel.stats.cache_hits.values()), kernel.stats.cache_path)
"""


@pytest.mark.parametrize("home", ["set", "none"])
def test_a_read_only_install_compiles_once(tmp_path: Path, home: str) -> None:
    """As a user without a home runs it: kernels go to the temporary folder, and the next process finds them there."""
    package = Path(paxel_runtime.__path__[0])
    (tmp_path / "temporary").mkdir()
    environment = {key: value for key, value in os.environ.items() if key not in ("NUMBA_CACHE_DIR", "HOME")}
    environment |= {"PYTHONPATH": str(package.parent), "PACKAGE": str(package), "TMPDIR": str(tmp_path / "temporary")}
    if home == "set":
        environment |= {"HOME": str(tmp_path / "home"), "XDG_CACHE_HOME": ""}
    else:
        environment |= {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null"}
    runs = [
        subprocess.run(
            [sys.executable, "-c", INSTALLED_READ_ONLY],
            env=environment,
            cwd=tmp_path,  # not beside a checkout, which would be imported instead of the installed package
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert [int(hits) for hits, _ in runs] == [0, 1]
    own = tmp_path / ("home/.cache/paxel/numba" if home == "set" else "temporary")
    assert all(Path(path).is_relative_to(own) for _, path in runs)
