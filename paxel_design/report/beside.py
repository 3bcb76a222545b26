"""One call in a process of its own, beside what this process does meanwhile.

Imports nothing heavy: the other process loads only what the function needs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from threading import Thread
from typing import Any

from paxel_design.workers import Outcome, Task, Tell, run_tasks
from paxel_runtime.errors import PaxelError

__all__ = ["beside"]


def beside(function: Callable[..., Any], *args: Any, jobs: int, **options: Any) -> Callable[[], Any]:
    """Start ``function(*args, **options)`` in another process; what is returned waits for its result.

    Parameters
    ----------
    function : callable
        Of a module; it, its arguments and its result can be pickled.
    jobs : int
        With 1 there is no other process: the call is made when its result is asked for.

    Raises
    ------
    PaxelError
        On asking for the result, if the call fails or its process dies.
    """
    if jobs <= 1:
        return partial(function, *args, **options)
    task = Task(f"{function.__module__}.{function.__qualname__}", partial(_called, function, args, options))
    outcomes: list[Outcome] = []
    # a daemon: whoever is interrupted does not wait for it
    thread = Thread(target=lambda: outcomes.extend(run_tasks([task], jobs)), daemon=True)
    thread.start()

    def result() -> Any:
        thread.join()
        if not outcomes or outcomes[0].error:
            raise PaxelError(outcomes[0].error if outcomes else f"{task.name} ended without a result")
        return outcomes[0].result

    return result


def _called(function: Callable[..., Any], args: tuple[Any, ...], options: Mapping[str, Any], tell: Tell) -> Any:
    return function(*args, **options)
