"""The bench's cache on disk: it may never change a result, whatever happens to its folder."""

from __future__ import annotations

import importlib.util
import os
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from paxel_runtime.devices.bench_qualities import QUALITIES
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.optics import cache
from paxel_runtime.optics.cache import cached, fingerprint

RESULT = np.arange(3000, dtype=np.uint8).reshape(3, -1)


class Counter:
    """A computation that counts its calls."""

    def __init__(self, result: NDArray[np.uint8] = RESULT) -> None:
        self.calls = 0
        self.result = result

    def __call__(self) -> NDArray[np.uint8]:
        self.calls += 1
        return self.result.copy()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    chosen = tmp_path / "of" / "our own"
    monkeypatch.setenv("PAXEL_CACHE_DIR", str(chosen))
    return chosen


def test_it_computes_once(folder: Path) -> None:
    compute = Counter()
    first, second = (cached("coverage", (1, "a"), compute) for _ in range(2))
    assert compute.calls == 1
    np.testing.assert_array_equal(first, RESULT)
    np.testing.assert_array_equal(second, RESULT)
    assert second.flags.writeable  # kernels compile once for both
    assert second.flags.c_contiguous
    assert [path.suffix for path in folder.iterdir()] == [".bench"]
    cached("coverage", (2, "a"), compute)
    assert compute.calls == 2


@pytest.mark.parametrize("harm", ["cut", "empty", "bit", "header"])
def test_a_damaged_entry_is_computed_again_and_mended(folder: Path, harm: str) -> None:
    compute = Counter()
    cached("coverage", 1, compute)
    (path,) = folder.iterdir()
    data = bytearray(path.read_bytes())
    if harm in ("bit", "header"):
        data[-1 if harm == "bit" else 60] ^= 1
    path.write_bytes(data[: {"cut": 1000, "empty": 0}.get(harm, len(data))])
    np.testing.assert_array_equal(cached("coverage", 1, compute), RESULT)
    np.testing.assert_array_equal(cached("coverage", 1, compute), RESULT)
    assert compute.calls == 2


def test_a_folder_that_cannot_be_made_does_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("PAXEL_CACHE_DIR", str(tmp_path / "file" / "below"))
    compute = Counter()
    np.testing.assert_array_equal(cached("coverage", 1, compute), RESULT)
    assert compute.calls == 1


def test_a_full_disk_leaves_nothing_behind(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "save", full)
    np.testing.assert_array_equal(cached("coverage", 1, Counter()), RESULT)
    assert list(folder.iterdir()) == []


def test_the_longest_unused_goes_first(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "_MOST_BYTES", 10_000)  # three entries of 3132 bytes
    for number in range(3):
        cached("coverage", number, Counter())
        for path in folder.iterdir():
            os.utime(path, ns=(0, path.stat().st_mtime_ns - 10**9))
    cached("coverage", 0, Counter())  # used again
    foreign = folder / "notes.txt"
    foreign.write_text("kept")
    cached("coverage", 3, Counter())
    found = {number for number in range(4) if not _is_computed(number)}
    assert found == {0, 2, 3}
    assert foreign.read_text() == "kept"


def _is_computed(number: int) -> bool:
    compute = Counter()
    limit, cache._MOST_BYTES = cache._MOST_BYTES, 0  # look, but keep nothing
    try:
        cached("coverage", number, compute)
    finally:
        cache._MOST_BYTES = limit
    return compute.calls == 1


def test_too_large_an_entry_is_not_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "_MOST_BYTES", 4000)
    cached("coverage", 1, Counter())
    assert not folder.exists()


def test_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PAXEL_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    cached("coverage", 1, Counter())
    assert len(list((tmp_path / "xdg" / "paxel" / "bench").iterdir())) == 1
    monkeypatch.setenv("PAXEL_CACHE_DIR", "")
    compute = Counter()
    cached("coverage", 1, compute)
    assert compute.calls == 1


# --- the digest ------------------------------------------------------------------------------------------------------

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4).map(tuple),
    max_leaves=12,
)


@given(a=values, b=values)
def test_different_inputs_have_different_digests(a: object, b: object) -> None:
    assert (fingerprint(a) == fingerprint(b)) == (repr(a) == repr(b))


def test_arrays_count_with_shape_type_and_every_value() -> None:
    class Layers(NamedTuple):
        cells: NDArray[np.float64]
        size: float

    a = np.arange(6.0)
    variants = [a, a.reshape(2, 3), a.reshape(3, 2), a.astype(np.float32), a[::-1], a + np.eye(6)[3] * 1e-15, list(a)]
    assert len({fingerprint(variant) for variant in variants}) == len(variants)
    assert fingerprint(a[::2]) == fingerprint(a[::2].copy())
    assert fingerprint(Layers(a, 1.0)) != fingerprint(Layers(a, 2.0))
    assert fingerprint(np.float64(0.1)) == fingerprint(0.1)
    with pytest.raises(TypeError, match="object"):
        fingerprint((1, object()))


# --- the bench -------------------------------------------------------------------------------------------------------


def test_a_bench_from_the_cache_answers_the_same(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cells = np.array([[0, 1], [1, 0]], np.uint8)
    setup = BenchSetup(
        pattern=Pattern("checkerboard", ("black", "white"), cells, 0.75, 30.0, (600.0, 400.0)),
        resolution=(64, 48),
        width_mm=9.4,
        channels=("red", "green", "blue"),
        bits=8,
        camera_resolution=(160, 120),
        camera_bits=14,
        aperture_mm=4.0,
        quality="realistic",
        seed=1,
    )
    codes = np.random.default_rng(0).integers(0, 256, (48, 64, 3), dtype=np.uint8)

    def answer(changed: BenchSetup) -> NDArray[np.uint16]:
        bench = VirtualBench(changed)
        bench.show(codes)
        return bench.capture()

    fresh = answer(setup)
    other = answer(replace(setup, seed=2))
    quality = replace(QUALITIES["realistic"], ink_spread_um=11.0)
    assert len(list(folder.iterdir())) == 2
    _ = VirtualBench(setup, quality).truth
    assert len(list(folder.iterdir())) == 3
    monkeypatch.setattr(cache, "_save", None)  # what is there is not computed again
    np.testing.assert_array_equal(answer(setup), fresh)
    np.testing.assert_array_equal(answer(replace(setup, seed=2)), other)


def test_an_edit_of_the_bench_leaves_no_entry_in_use(tmp_path: Path) -> None:
    digests = []
    for text in ("A = 1\n", "A = 2\n"):
        package = tmp_path / "bench"
        package.mkdir(exist_ok=True)
        (package / "cache.py").write_text(Path(cache.__file__).read_text(encoding="utf-8"), encoding="utf-8")
        (package / "light.py").write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location("cache_of_a_copy", package / "cache.py")
        assert spec is not None
        assert spec.loader is not None
        copy = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(copy)
        digests.append(copy._sources_digest())
    assert digests[0] != digests[1]
