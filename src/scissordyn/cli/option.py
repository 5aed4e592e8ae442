"""Arguments and options that several commands have, and the engine that some of them ask for."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.run.engine import Engine

MOST_THREADS = 4096  # More than any machine has processors
WORKER_BYTES = 100_000_000  # Memory of a process with the libraries alone

CaseFile = Annotated[Path, Argument(help="A case file.")]
SavedRun = Annotated[Path, Argument(help="A saved run.")]
Changes = Annotated[
    list[str] | None,
    Option("--set", metavar="KEY=VALUE", help="Change a value of the case, as in drive.speed='250 rpm'. Repeatable."),
]
OwnCode = Annotated[
    list[Path] | None,
    Option(metavar="FILE", help="A Python file of yours that the saved run used and may execute again. Repeatable."),
]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Print nothing but errors.")]
AsJson = Annotated[bool, Option("--json", help="Print one line of JSON, in SI units, in place of text.")]
PictureFormat = Annotated[str, Option("--format", metavar="FORMAT", help="png, svg or pdf.")]
BlockSize = Annotated[int | None, Option(help="Cases of a block of a new store.", min=1)]
Magnified = Annotated[float, Option(metavar="FACTOR", help="Magnify the deflections of bars that bend.", min=1e-3, max=1e6)]
BarQuantity = Annotated[
    str | None,
    Option("--bars", metavar="QUANTITY", help="On bars that bend: stress, utilisation, 'bending moment' or 'axial force'."),
]
ThreadCount = Annotated[
    int | None, Option(help="Threads of this process; one per processor if not given.", min=1, max=MOST_THREADS)
]
WorkerCount = Annotated[int | None, Option(help="Processes on this machine instead.", min=1)]
Scheduler = Annotated[str | None, Option(metavar="ADDRESS", help="Workers of a dask scheduler instead.")]
QueueFile = Annotated[Path | None, Option(metavar="FILE", help="Workers that a queueing system starts instead.")]

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
            from scissordyn.run.start.demand import check_memory, count_in_words, machine_memory

            most, size = machine_memory() // WORKER_BYTES, self.workers * WORKER_BYTES
            what = f"{count_in_words(self.workers)} workers"
            check_memory(what, size, Decimal(self.workers), f"at most {most} here", "--workers 2")

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
