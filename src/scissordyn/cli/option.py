"""Arguments and options that several commands share, and functions that read them."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, overload

from scissordyn.casefile.quantity import example, read_quantity
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError, command
from scissordyn.units import Quantity

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.model.mechanism import Mechanism
    from scissordyn.run.engine import Engine

THREADS_MAX = 4096  # Largest number of threads or processes that an option accepts, above the processors of any machine

CaseFile = Annotated[Path, Argument(help="A case file.")]
SavedRun = Annotated[Path, Argument(help="A saved run.")]
Changes = Annotated[
    list[str] | None,
    Option("--set", metavar="KEY=VALUE", help="Change a value of the case, such as drive.speed='250 rpm'. Repeatable."),
]
OwnCode = Annotated[
    list[Path] | None,
    Option(metavar="FILE", help="Your Python file that the saved run used, and that may be executed again. Repeatable."),
]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Print nothing but errors.")]
AsJson = Annotated[bool, Option("--json", help="Print one line of JSON, in SI units, instead of text.")]
PictureFormat = Annotated[str, Option("--format", metavar="FORMAT", help="Format of the pictures: png, svg or pdf.")]
BlockSize = Annotated[int | None, Option(help="Number of cases in a block of a new store.", min=1)]
Magnified = Annotated[
    float, Option(metavar="FACTOR", help="Factor by which deflections of bars are magnified.", min=1e-3, max=1e6)
]
BarQuantity = Annotated[
    str | None,
    Option(
        "--bars",
        metavar="QUANTITY",
        help="Quantity shown on flexible bars: stress, utilisation, 'bending moment' or 'axial force'.",
    ),
]
ThreadCount = Annotated[int | None, Option(help="Number of threads; by default one per processor.", min=1, max=THREADS_MAX)]
WorkerCount = Annotated[
    int | None, Option(help="Number of processes on this machine, instead of threads.", min=1, max=THREADS_MAX)
]
Scheduler = Annotated[str | None, Option(metavar="ADDRESS", help="Use the workers of this dask scheduler, instead of threads.")]
QueueFile = Annotated[
    Path | None, Option(metavar="FILE", help="File that describes workers of a queueing system, used instead of threads.")
]

# Warning if a cluster's connections are not encrypted
NO_TLS_WARNING = (
    "scissordyn: Warning: without TLS, anyone who reaches the ports of the scheduler and its workers can execute code there; "
    "docs/howto/cluster.md shows how to turn it on"
)

DISTRIBUTION_TEXT = re.compile(r"(.*?)=(\s*[a-z_0-9]+\s*\(.*\)[^()=]*)", re.DOTALL)
"""Pattern of an option PARAMETER=DISTRIBUTION(...); a file name in the brackets may contain an equals sign."""

DIMENSIONED_OPTIONS = {"s": ("a time", "10 ms", Quantity("s")), "m": ("a length", "5 mm", Quantity("m", above=0.0))}
"""Kind of value, example, and bounds of options that are a time or a length, by SI unit."""


@dataclass(frozen=True)
class EngineOptions:
    """Options that choose the engine of a study: threads, processes, a dask scheduler or a cluster; at most one is given."""

    threads: int | None = None
    workers: int | None = None
    scheduler: str | None = None
    cluster: Path | None = None

    @contextmanager
    def engine(self, folder: Path | None = None) -> Iterator[Engine]:
        """Yield the engine that the options describe; `folder` receives the files of cluster jobs."""
        from scissordyn.run.engine import Processes

        chosen = [name for name in ("threads", "workers", "scheduler", "cluster") if getattr(self, name) is not None]
        if len(chosen) > 1:
            raise InputError(f"--{' and --'.join(chosen)} together", "one of these options")
        if self.workers is not None:
            with Processes(self.workers) as processes:
                yield processes
        elif self.scheduler is not None or self.cluster is not None:
            from scissordyn.studies.compute.cluster import cluster

            def tell(line: str) -> None:
                print(f"scissordyn: {line}", file=sys.stderr)

            with cluster(self.scheduler or self.cluster or "", folder, tell) as workers:
                if self.scheduler is not None and not self.scheduler.startswith("tls://"):
                    print(NO_TLS_WARNING, file=sys.stderr)
                yield workers
        else:
            yield self.threads


def read_run(path: Path, *, samples: int = 2) -> xr.Dataset:
    """Load a saved run; raise `InputError` for another file or a run with fewer than `samples` samples."""
    from scissordyn.casefile.configuration import is_run
    from scissordyn.casefile.table import add_prefix
    from scissordyn.file.run_check import check_run
    from scissordyn.record.store import load

    expected = "a run that was saved"
    if not path.exists():
        raise InputError(f"cannot read '{path}': no such file", expected, "scissordyn run case.toml -o run.nc")
    if path.suffix.lower() == ".toml":
        from scissordyn.casefile.text import read_text
        from scissordyn.config.file import is_study, parse_toml

        kind, ending = ("study", "db") if is_study(parse_toml(read_text(path, expected), path)) else ("run", "nc")
        sample = command("scissordyn", kind, path, "-o", f"{path.stem}.{ending}")
        raise InputError(f"'{path}' is a {kind.replace('run', 'case')} file", expected, sample)
    run = load(path)
    if not is_run(run):
        raise InputError(
            f"'{path}' is a '{run.attrs.get('title')}', not a run",
            "a run saved by 'scissordyn run'; --plot of the command that saved it draws it",
        )
    with add_prefix(f"'{path}'"):
        check_run(run)
    if run.sizes.get("time", 0) < samples:
        raise InputError(f"'{path}' is a run with {run.sizes.get('time', 0)} samples", f"a run with {samples} or more samples")
    return run


def mechanism_of(run: xr.Dataset, allow_code: list[Path] | None) -> Mechanism:
    """Return the mechanism of a run; user-defined code in files other than `allow_code` raises `InputError`."""
    from scissordyn.casefile.configuration import read_configuration
    from scissordyn.file.run_check import check_names

    mechanism = read_configuration(run).build_mechanism(allow_code or [])
    check_names(run, mechanism)
    return mechanism


@overload
def read_option(text: str, option: str, unit: str = ...) -> float: ...
@overload
def read_option(text: str | None, option: str, unit: str = ...) -> float | None: ...
def read_option(text: str | None, option: str, unit: str = "s") -> float | None:
    """Convert the text of an option, such as "10 ms", to a time or a length in SI units."""
    if text is None:
        return None
    kind, sample, quantity = DIMENSIONED_OPTIONS[unit]
    try:
        return read_quantity(text, quantity)
    except InputError as error:
        raise InputError(f"{option} {text!r}: {error.what}", f"{kind} with its unit", f"{option} '{sample}'") from None


def value_of(text: str, quantity: Quantity, option: str) -> float:
    """Convert the text of an option to the value of a quantity in SI units."""
    value: str | float = text
    if quantity.unit == "1":
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"{option} '{text}': not a number", quantity.expected, f"{option} {example(quantity)}") from None
    try:
        return read_quantity(value, quantity, f"{option} '{example(quantity)}'")
    except InputError as error:
        raise InputError(f"{option} '{text}': {error.what}", error.expected, error.example) from None


def split_values(text: str) -> tuple[str, str, str]:
    """Split ``PARAMETER=VALUES`` into parameter path, equals sign and values; without a sign the path is empty.

    The last equals sign separates them, as names of parts may contain one, or the one before a distribution,
    whose arguments have equals signs too.
    """
    called = DISTRIBUTION_TEXT.fullmatch(text)
    path, equals, values = (called[1], "=", called[2]) if called else text.rpartition("=")
    return path.strip(), equals, values
