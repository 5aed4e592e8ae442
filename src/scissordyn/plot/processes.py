"""Make pictures in several processes where the system can duplicate a process that has loaded all libraries."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import BinaryIO

from scissordyn.processor import processors


def make_all(makers: Mapping[str, Callable[[], bytes]]) -> dict[str, bytes]:
    """Return the results of functions by name; this process and duplicates of it take the functions in turn.

    All functions are called here if there are several threads, because a duplicate has only one of them, or one processor.
    """
    most_processes = 4  # one picture takes a third of the time of all
    duplicates = min(len(makers), processors(), most_processes) - 1
    if duplicates < 1 or sys.platform != "linux" or threading.active_count() > 1:
        return {name: make() for name, make in makers.items()}
    tasks, tasks_end = os.pipe()
    os.write(tasks_end, bytes(range(len(makers))))
    os.close(tasks_end)
    with ExitStack() as stack:
        stack.callback(os.close, tasks)
        answers = [_duplicate(makers, tasks, stack) for _ in range(duplicates)]
        results = _make_next(makers, tasks)
        for content in [answer.read() for answer in answers]:
            results |= pickle.loads(content) if content else {}
    # errors of duplicates are raised again here
    return {name: results[name] if name in results else make() for name, make in makers.items()}


def _duplicate(makers: Mapping[str, Callable[[], bytes]], tasks: int, stack: ExitStack) -> BinaryIO:
    """Start a duplicate of this process, which ends with the stack at the latest; return the file with its results."""
    answer, answer_end = os.pipe()
    with warnings.catch_warnings():  # Python 3.12 warns of threads of libraries too; they wait for work
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _answer(makers, tasks, answer_end)
    os.close(answer_end)
    stack.callback(os.waitpid, child, 0)
    stack.callback(os.kill, child, signal.SIGKILL)  # it has ended already, or this process was interrupted
    return stack.enter_context(os.fdopen(answer, "rb"))


def _make_next(makers: Mapping[str, Callable[[], bytes]], tasks: int) -> dict[str, bytes]:
    """Call the functions whose indices this process reads from the pipe `tasks`, of which each index is read once."""
    names, results = list(makers), dict[str, bytes]()
    while index := os.read(tasks, 1):
        results[names[index[0]]] = makers[names[index[0]]]()
    return results


def _answer(makers: Mapping[str, Callable[[], bytes]], tasks: int, answer_end: int) -> None:
    """Make results in the duplicate of a process, write them to the pipe `answer_end`, and end without clean-up."""
    try:
        with os.fdopen(answer_end, "wb") as file:
            file.write(pickle.dumps(_make_next(makers, tasks)))
    except BaseException:  # the process that was duplicated makes what is missing
        pass
    finally:
        os._exit(0)
