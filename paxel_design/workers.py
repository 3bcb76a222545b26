"""Tasks side by side in processes of their own: in order, with progress, and none of them stops the others.

Each process starts afresh (spawn) and uses one thread of the numerical libraries, so that as many processes as cores
share them well. A task that fails, or whose process dies, ends with an error; tasks that wait for it run all the same.
Imports nothing heavy, and knows no task.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from paxel_runtime.errors import PaxelError

__all__ = ["Outcome", "Progress", "Task", "Tell", "run_tasks"]

Tell = Callable[[str, float], None]
"""``tell(what is done, share of the task)``."""

Progress = Callable[[dict[str, tuple[str, float]]], None]
"""Given what each running task does and its share, by the task's name."""

_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_END_S = 5.0
_KILLED = 9


@dataclass(frozen=True)
class Task:
    """A piece of work.

    Attributes
    ----------
    name : str
        Unique among the tasks.
    run : callable
        ``run(tell)``; something that can be pickled, such as a partial of a module's function.
    after : str
        Name of an earlier task that has to end first, well or not; or empty.
    """

    name: str
    run: Callable[[Tell], Any]
    after: str = ""


@dataclass(frozen=True)
class Outcome:
    """How a task ended: with a result, or with an error in words.

    Attributes
    ----------
    name : str
    result : Any
    error : str
        Empty if it ended well.
    """

    name: str
    result: Any = None
    error: str = ""


def run_tasks(
    tasks: Sequence[Task], jobs: int, progress: Progress = lambda running: None
) -> Generator[Outcome, None, None]:
    """Run tasks and yield how each ended, when it ends.

    The earliest task in the list that may start is started as soon as there is a process for it. Leaving the loop, or
    an exception in it such as Ctrl-C, ends the processes at once.

    Parameters
    ----------
    tasks : sequence of Task
    jobs : int
        Processes at a time. With 1 everything runs in this process, on all its threads.
    progress : callable, optional
        Told whenever something changes.
    """
    if jobs <= 1:
        yield from _in_this_process(tasks, progress)
    else:
        yield from _in_processes(tasks, min(jobs, len(tasks)), progress)


def _in_this_process(tasks: Sequence[Task], progress: Progress) -> Iterator[Outcome]:
    left, unfinished = list(tasks), {task.name for task in tasks}
    while (place := _next(left, unfinished)) is not None:
        task = left.pop(place)
        yield _outcome(task, lambda what, share, name=task.name: progress({name: (what, share)}))  # type: ignore[misc]
        unfinished.discard(task.name)


def _in_processes(tasks: Sequence[Task], jobs: int, progress: Progress) -> Iterator[Outcome]:
    left, unfinished = list(tasks), {task.name for task in tasks}
    running: dict[str, tuple[str, float]] = {}
    workers: list[_Worker] = []
    try:
        while True:
            while len(running) < jobs and (place := _next(left, unfinished)) is not None:
                worker = next((w for w in workers if not w.task), None) or _start_worker()
                if worker not in workers:
                    workers.append(worker)
                task = left.pop(place)
                worker.give(task)
                running[task.name] = ("start", 0.0)
            if not running:
                return
            progress(running)
            busy = {worker.pipe: worker for worker in workers if worker.task}
            for worker in [busy[pipe] for pipe in wait(list(busy))]:  # type: ignore[index]
                message = worker.hear()
                if isinstance(message, Outcome):
                    del running[message.name]
                    unfinished.discard(message.name)
                    workers = [w for w in workers if w.process.is_alive() or w.task]
                    yield message
                else:
                    running[worker.task] = message
    finally:
        for worker in workers:
            worker.end()


def _next(left: Sequence[Task], unfinished: set[str]) -> int | None:
    """Place of the first task that waits for none."""
    return next((k for k, task in enumerate(left) if task.after not in unfinished), None)


def _outcome(task: Task, tell: Tell) -> Outcome:
    """Run a task; whatever it raises is its outcome."""
    try:
        return Outcome(task.name, task.run(tell))
    except PaxelError as error:
        return Outcome(task.name, error=str(error))
    except Exception as error:  # a fault of one task must not cost the others; it is told with its place
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}, line {place.lineno}"
        return Outcome(task.name, error=f"{type(error).__name__}: {error} ({where}); please report this")


@dataclass(eq=False)
class _Worker:
    """A process that waits for tasks, as its parent sees it; `task` is the name of the one it runs, or empty."""

    process: BaseProcess
    pipe: Connection
    task: str = ""

    def give(self, task: Task) -> None:
        self.task = task.name
        self.pipe.send(task)

    def hear(self) -> Outcome | tuple[str, float]:
        """What it tells of its task, or how that ended; a process that died has failed."""
        try:
            message = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join(_END_S)
            code = self.process.exitcode
            why = "killed, maybe for want of memory: try fewer --jobs" if code == -_KILLED else f"exit code {code}"
            message = Outcome(self.task, error=f"its process ended ({why})")
        if isinstance(message, Outcome):
            self.task = ""
        return message

    def end(self) -> None:
        """End the process, at once if it is at work."""
        if self.task or not self._sent_away():
            self.process.terminate()
        self.process.join(_END_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.pipe.close()

    def _sent_away(self) -> bool:
        try:
            self.pipe.send(None)
        except OSError:
            return False
        return True


def _start_worker() -> _Worker:
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=_serve, args=(theirs,), daemon=True)
    with _inherited_by_workers():
        process.start()
    theirs.close()
    return _Worker(process, ours)


def _serve(pipe: Connection) -> None:
    """What a worker does: one task after the other, until it is sent away or left alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, BrokenPipeError):  # the parent is gone
        while (task := pipe.recv()) is not None:
            pipe.send(_outcome(task, lambda what, share: pipe.send((what, share))))


@contextmanager
def _inherited_by_workers() -> Iterator[None]:
    """Surroundings that a process inherits: one thread for each library, and Ctrl-C is the parent's business."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    in_main_thread = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if in_main_thread else None  # others may not set it
    try:
        yield
    finally:
        if handler is not None:
            signal.signal(signal.SIGINT, handler)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
