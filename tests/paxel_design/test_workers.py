"""Tasks in processes of their own: order, errors, a process that dies, progress, and leaving early."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from paxel_design.workers import Outcome, Task, run_tasks

FUNCTIONS = """
import os
import time

from paxel_runtime.errors import CalibrationError


def threads(tell):
    tell("counting", 0.5)
    return os.environ["NUMBA_NUM_THREADS"], os.environ["OPENBLAS_NUM_THREADS"], os.getpid()


def misses_captures(tell):
    raise CalibrationError("no captures")


def divides_by_zero(tell):
    return 1 // 0


def dies(tell):
    os._exit(7)


def is_there(path, tell):
    return os.path.exists(path)


def touches(path, tell):
    time.sleep(0.2)
    open(path, "w").close()


def sleeps(tell):
    time.sleep(60)
"""


@pytest.fixture
def tasks(tmp_path, monkeypatch):
    """Functions that a process can import: its path is that of this one."""
    (tmp_path / "task_functions.py").write_text(FUNCTIONS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    import task_functions

    yield task_functions
    del sys.modules["task_functions"]


def _outcomes(tasks: list[Task], jobs: int, progress=lambda running: None) -> dict[str, Outcome]:
    return {outcome.name: outcome for outcome in run_tasks(tasks, jobs, progress)}


@pytest.mark.parametrize("jobs", [1, 2])
def test_errors_are_outcomes_and_stop_no_other(tasks, jobs, tmp_path: Path) -> None:
    file = str(tmp_path / "made")
    asked = [
        Task("waits", partial(tasks.is_there, file), after="makes"),  # stands first, and has to wait all the same
        Task("makes", partial(tasks.touches, file)),
        Task("fails", tasks.misses_captures),
        Task("faulty", tasks.divides_by_zero),
        Task("waits for one that fails", partial(tasks.is_there, file), after="fails"),
    ]
    ended = _outcomes(asked, jobs)
    assert set(ended) == {task.name for task in asked}
    assert ended["waits"].result is True
    assert ended["fails"].error == "no captures"
    assert ended["faulty"].error.startswith("ZeroDivisionError")
    assert not ended["waits for one that fails"].error


def test_a_process_that_dies_costs_its_task_alone(tasks, monkeypatch) -> None:
    monkeypatch.setenv("NUMBA_NUM_THREADS", "5")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    told = []
    asked = [Task("dies", tasks.dies), *(Task(f"lives {k}", tasks.threads) for k in range(3))]
    ended = _outcomes(asked, 2, lambda running: told.append(dict(running)))
    assert "exit code 7" in ended["dies"].error
    results = [ended[f"lives {k}"].result for k in range(3)]
    assert all(result[:2] == ("1", "1") and result[2] != os.getpid() for result in results)
    assert (os.environ["NUMBA_NUM_THREADS"], os.environ.get("OPENBLAS_NUM_THREADS")) == ("5", None)
    assert any(("counting", 0.5) in running.values() for running in told)
    assert max(map(len, told)) == 2
    assert not multiprocessing.active_children()


def test_leaving_the_loop_ends_the_processes_at_once(tasks) -> None:
    began = time.perf_counter()
    for outcome in run_tasks([Task("short", tasks.threads), Task("long", tasks.sleeps)], 2):
        assert outcome.name == "short"
        break
    assert not multiprocessing.active_children()
    assert time.perf_counter() - began < 30  # it would sleep for a minute
