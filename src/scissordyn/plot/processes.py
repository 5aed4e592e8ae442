"""Make pictures in several processes where the system can duplicate a process that has loaded all libraries."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from scissordyn.processor import processors
from scissordyn.run.engine import Duplicates, outcomes


def make_all(makers: Mapping[str, Callable[[], bytes]]) -> dict[str, bytes]:
    """Return the results of functions by name, which duplicates of this process call, or else this process."""
    most_processes = 4  # one picture takes a third of the time of all
    workers = min(len(makers), processors(), most_processes) if Duplicates.possible() else 1
    results = dict[str, bytes]()
    for outcome in outcomes(workers, lambda name: makers[name](), makers):
        if outcome.value is None:
            assert outcome.error is not None
            raise outcome.error
        results[outcome.task] = outcome.value
    return {name: results[name] for name in makers}
