"""What the numba kernels of `paxel demo` cost on a first call and from the cache: reference/compile_times.json.

Runs the demo in a process of its own with an empty cache folder, and loads every kernel that it called in a second
process. Seconds are CPU seconds of the thread that compiles, so a busy machine hardly changes them; a kernel's are its
own: what it calls is listed apart. Kernels compile one after the other whatever the number of cores, so on an idle
machine the total is what a first demo takes longer than the next one.

Run from a checkout, on a machine that does nothing else (3 minutes)::

    python -m reports.compile_times            (--lines 40: more of the table)
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from importlib import import_module
from pathlib import Path
from typing import Any

RESULT = Path(__file__).parent / "reference" / "compile_times.json"


def record_demo(folder: Path) -> None:
    """Run the demo and write down every compilation: kernels.pickle in `folder`."""
    from numba.core import event

    class Recorder(event.Listener):
        """Own seconds of each kernel: what is compiled inside a compilation is taken off."""

        def __init__(self) -> None:
            self.started: list[list[float]] = []  # beginning, seconds of the kernels inside
            self.kernels: list[tuple[str, str, Any, float]] = []

        def on_start(self, event: event.Event) -> None:
            self.started.append([time.thread_time(), 0.0])

        def on_end(self, event: event.Event) -> None:
            begin, inside = self.started.pop()
            seconds = time.thread_time() - begin
            if self.started:
                self.started[-1][1] += seconds
            function = event.data["dispatcher"].py_func
            args = None if self.started else event.data["args"]  # None: called by another kernel, not by Python
            self.kernels.append((function.__module__, function.__qualname__, args, seconds - inside))

    recorder = Recorder()
    event.register("numba:compile", recorder)
    from paxel_design.cli import app

    begin = time.perf_counter()
    app(["demo", str(folder / "show")], standalone_mode=False)
    with (folder / "kernels.pickle").open("wb") as file:
        pickle.dump((recorder.kernels, time.perf_counter() - begin), file)


def load_all(folder: Path) -> None:
    """Load every kernel that Python called, and print the seconds that takes."""
    with (folder / "kernels.pickle").open("rb") as file:
        kernels, _ = pickle.load(file)  # our own, from this very run
    called = [(getattr(import_module(module), name), args) for module, name, args, _ in kernels if args is not None]
    begin = time.process_time()
    for kernel, args in called:
        kernel.compile(args)
        assert kernel.stats.cache_hits, f"{kernel} was not in the cache"
    print(time.process_time() - begin)


def main() -> None:
    """Measure both, print the table, write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lines", type=int, default=30, help="kernels to print, dearest first")
    parser.add_argument("--stage", choices=("record", "load"), help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.stage:
        (record_demo if given.stage == "record" else load_all)(given.folder)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
        command = [sys.executable, "-m", "reports.compile_times", "--folder", name, "--stage"]
        subprocess.run([*command, "record"], env=environment, check=True, stdout=subprocess.DEVNULL)
        with (folder / "kernels.pickle").open("rb") as file:
            kernels, demo_seconds = pickle.load(file)
        own: defaultdict[str, float] = defaultdict(float)
        versions: defaultdict[str, int] = defaultdict(int)
        for module, kernel, _, seconds in kernels:
            own[f"{module}.{kernel}"] += seconds
            versions[f"{module}.{kernel}"] += 1
        dearest = sorted(own, key=own.__getitem__, reverse=True)
        for kernel in dearest[: given.lines]:
            print(f"{own[kernel]:7.2f} s  {versions[kernel]} x  {kernel}")
        loaded = subprocess.run([*command, "load"], env=environment, check=True, stdout=subprocess.PIPE, text=True)
        cached_bytes = sum(path.stat().st_size for path in (folder / "cache").rglob("*") if path.is_file())
    figures = {
        "what": "numba kernels of `paxel demo`: seconds to compile (own, without what a kernel calls), and to load",
        "compile_s": round(sum(own.values()), 1),
        "load_s": round(float(loaded.stdout), 2),
        "cold_demo_s": round(demo_seconds, 1),
        "compilations": len(kernels),
        "cache_MB": round(cached_bytes / 1e6, 1),
        "kernels_s": {kernel: round(own[kernel], 2) for kernel in dearest},
    }
    print({key: value for key, value in figures.items() if key != "kernels_s"})
    RESULT.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
