"""Where a command computes: its options, and the engine that they ask for."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.run.engine import Engine

MOST_THREADS = 4096
"""More than any machine has processors."""

WORKER_BYTES = 100_000_000
"""Memory of a process with the libraries alone."""

ThreadCount = Annotated[
    int | None, typer.Option(help="Threads of this process; one per processor if not given.", min=1, max=MOST_THREADS)
]
WorkerCount = Annotated[int | None, typer.Option(help="Processes on this machine instead.", min=1)]
Scheduler = Annotated[str | None, typer.Option(metavar="ADDRESS", help="Workers of a dask scheduler instead.")]
QueueFile = Annotated[Path | None, typer.Option(metavar="FILE", help="Workers that a queueing system starts instead.")]


UNPROTECTED = (
    "scissordyn: Warning: without TLS whoever reaches the ports of the scheduler and its workers has code executed there; "
    "docs/howto/cluster.md shows how it is turned on"
)


@dataclass(frozen=True)
class Where:
    """Where cases are computed."""

    threads: int | None = None
    workers: int | None = None
    scheduler: str | None = None
    cluster: Path | None = None

    def __post_init__(self) -> None:
        if self.workers is not None:
            _check_workers(self.workers)

    @contextmanager
    def engine(self) -> Iterator[Engine]:
        """The engine; one choice at most."""
        from scissordyn.run.engine import Processes

        chosen = [name for name in ("threads", "workers", "scheduler", "cluster") if getattr(self, name) is not None]
        if len(chosen) > 1:
            raise InputError(f"--{' and --'.join(chosen)}", "one of them")
        if self.workers is not None:
            with Processes(self.workers) as processes:
                yield processes
        elif self.scheduler is not None or self.cluster is not None:
            from scissordyn.study.compute.cluster import cluster

            with cluster(self.scheduler or self.cluster or "") as workers:
                if self.scheduler is not None and not self.scheduler.startswith("tls://"):
                    print(UNPROTECTED, file=sys.stderr)
                yield workers
        else:
            yield self.threads


def _check_workers(workers: int) -> None:
    from scissordyn.run.start.demand import check_memory, count_in_words, machine_memory

    most = machine_memory() // WORKER_BYTES
    check_memory(
        f"{count_in_words(workers)} workers", workers * WORKER_BYTES, Decimal(workers), f"at most {most} here", "--workers 2"
    )
