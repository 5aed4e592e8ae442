"""Workers of dask.distributed: those of a scheduler that runs, or jobs of a queueing system."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from scissordyn.errors import InputError
from scissordyn.extra import library
from scissordyn.run.engine import (
    AHEAD,
    QUICKLY,
    Begun,
)
from scissordyn.run.engine import (
    Engine as Engine,
)
from scissordyn.run.engine import (
    EngineError as EngineError,
)
from scissordyn.run.engine import (
    Outcome as Outcome,
)
from scissordyn.run.engine import (
    Threads as Threads,
)
from scissordyn.run.engine import (
    error_text as error_text,
)
from scissordyn.run.engine import (
    processors as processors,
)

if TYPE_CHECKING:
    from distributed import Client

Task = TypeVar("Task")
Value = TypeVar("Value")

ATTEMPTS = 3
"""A task whose worker died this often is given up."""

RECOUNT = 1.0
"""How often the scheduler is asked for the number of its workers [s]."""

PATIENCE = 10.0
"""How long a scheduler may take to answer [s]."""

KEYS = ("_job_ca_file", "_job_cert", "_job_key")
"""Where dask-jobqueue has the temporary files of certificates, which it would keep as long as this process."""

LOST = "the connection to the scheduler was lost; what is complete is kept"


class Cluster(Begun):
    """Workers of dask.distributed.

    Parameters
    ----------
    where : str, Path or Client
        The address of a scheduler that runs already, ``"tls://host:8786"``, with the certificates of dask's configuration; a
        file that says which jobs a queueing system is to start, in YAML: ``kind: slurm`` (or pbs, lsf, sge, htcondor, oar),
        ``jobs: 20``, and the options of the class of dask-jobqueue; or a client that is connected.

    Raises
    ------
    InputError
        When it is begun: if no scheduler answers, the file cannot be used, dask-jobqueue is not installed, or jobs cannot be
        submitted from this machine.
    """

    client: Client | None = None

    def __init__(self, where: str | Path | Client) -> None:
        self._where = Path(where) if isinstance(where, str) and where.endswith((".yaml", ".yml")) else where
        if not isinstance(self._where, (str, Path)):
            self.client = self._where

    def _running(self) -> AbstractContextManager[object]:
        if isinstance(self._where, str):
            return self._joined(self._where)
        return self._queued(self._where) if isinstance(self._where, Path) else contextlib.nullcontext()

    @property
    def protected(self) -> bool:
        """Whether its connections are encrypted and only those with a certificate are admitted."""
        return self.client is not None and str(self.client.scheduler.address).startswith("tls://")

    @property
    def workers(self) -> int:
        """Threads of all workers, at least 1."""
        return 1 if self.client is None else max(1, int(sum(self.client.nthreads().values())))

    @contextmanager
    def _joined(self, scheduler: str) -> Iterator[None]:
        """Workers of a scheduler that runs already."""
        distributed = _distributed()
        try:
            with signals_blocked():
                client = _answering(lambda: distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False))
        except Exception as error:  # what answers may be anything, and the library raises whatever it makes of it
            reason = " ".join(str(error).split())[:200] or type(error).__name__
            raise InputError(
                f"scheduler '{scheduler}' does not answer: {reason}",
                "the address that dask scheduler prints",
                "tls://host:8786",
            ) from None
        with _closed(client):
            self.client = client
            yield

    @contextmanager
    def _queued(self, file: Path) -> Iterator[None]:
        """Workers that a queueing system starts, by dask-jobqueue."""
        distributed = _distributed()
        options = _cluster_options(file)
        if given := {"security", "protocol"} & {*options, *(options.get("scheduler_options") or {})}:
            reason = "connections are always encrypted, with certificates made for this study"
            raise InputError(f"'{file}': {' and '.join(sorted(given))}: {reason}", "the file without that")
        dask_jobqueue = library("dask_jobqueue", "study", "a queueing system")
        named = (name for name in dir(dask_jobqueue) if name.endswith("Cluster") and name != "JobQueueCluster")  # their base
        kinds = {name.removesuffix("Cluster").lower(): name for name in named}
        kind, jobs = str(options.pop("kind", "")).lower(), options.pop("jobs", 1)
        if kind not in kinds or not isinstance(jobs, int) or jobs < 1:
            raise InputError(
                f"'{file}': kind '{kind}', jobs {jobs!r}",
                f"kind: one of {', '.join(sorted(kinds))}; jobs: 1 or more",
                "kind: slurm",
            )
        described = getattr(dask_jobqueue, kinds[kind])
        submit = str(described.job_cls.submit_command).split()[0]
        if shutil.which(submit) is None:  # the library would wait for jobs that nobody submits
            raise InputError(f"'{file}': no command '{submit}' here", f"a machine from which {kind} takes jobs", "--workers 2")
        try:
            cluster = described(**_protected(distributed, options))
        except OSError as error:
            reason = f"the certificates of the jobs cannot be written: {error.strerror or error}"
            folder = "shared_temp_directory: a folder that all machines see"
            raise InputError(f"'{file}': {reason}", folder, "shared_temp_directory: /shared/me") from None
        except (TypeError, ValueError) as error:
            reason = str(error).splitlines()[0].partition(". ")[0]  # what follows is an example with all options
            sample = "cores: 8, processes: 8, memory: 16GB, each on a line of its own"
            raise InputError(f"'{file}': {reason}", f"options of dask_jobqueue.{kinds[kind]}", sample) from None
        try:
            cluster.scale(jobs=jobs)
            client = distributed.Client(cluster, timeout=PATIENCE, set_as_default=False)
            with _closed(client, cluster):
                self.client = client
                yield
        finally:
            for name in KEYS:
                vars(cluster)[name].close()

    def each(self, function: Callable[[Task], Value], tasks: Iterable[Task]) -> Iterator[Outcome[Task, Value]]:
        """Results in the order in which they come; tasks of lost workers are handed out again.

        Parameters
        ----------
        function : callable
            Of a task; importable by the workers.
        tasks : iterable

        Yields
        ------
        Outcome

        Raises
        ------
        EngineError
            If the workers are lost.
        """
        from distributed import as_completed

        client = self.client
        assert client is not None
        waiting, handed, count = iter(tasks), dict[str, Task](), 0
        running, limit, again = as_completed(loop=client.loop), 0, 0.0
        try:
            while True:
                if time.monotonic() > again:
                    limit, again = AHEAD * self.workers, time.monotonic() + RECOUNT
                while len(handed) < limit:
                    task = next(waiting, None)
                    if task is None:
                        break
                    name = f"task-{id(self):x}-{count}"
                    future = client.submit(_elsewhere, function, task, pure=False, retries=0, key=name)
                    handed[future.key] = task
                    running.add(future)
                    count += 1
                if not handed:
                    return
                if client.status not in ("running", "connecting"):
                    raise EngineError(LOST)
                future = next(running)
                yield _remote_outcome(future, handed.pop(future.key))
        except EngineError:
            raise
        except (OSError, CancelledError, asyncio.CancelledError) as error:
            # of the connection: errors of a task are in its outcome
            raise EngineError(LOST) from error
        except BaseException:
            _ended(QUICKLY, lambda: client.cancel(list(handed), force=True))
            raise


def _elsewhere(function: Callable[[Task], Value], task: Task) -> Value:
    """Do a task in another process."""
    import dask

    # xarray would lock its files across all workers, which this library knows by their names only
    with dask.config.set(scheduler="synchronous"):
        return function(task)


@contextmanager
def signals_blocked() -> Iterator[None]:
    """Hold back Ctrl-C in this thread; processes and threads started meanwhile never get it.

    A process that is still starting would otherwise die of a Ctrl-C with a traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the library unblocks the signal where it starts this
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _closed(*connected: Any) -> Iterator[None]:
    """Close a client and its cluster at the end; after Ctrl-C or an error without waiting for them."""
    try:
        yield
    except BaseException:
        for each in connected:
            _ended(QUICKLY, each.close)
        raise
    for each in connected:
        _ended(PATIENCE, each.close)


def _within(seconds: float, function: Callable[[], Value]) -> Value | None:
    """Call something, and wait no longer than that: the other end may be gone or silent."""
    found: Future[Value] = Future()

    def call() -> None:
        try:
            found.set_result(function())
        except (Exception, CancelledError, asyncio.CancelledError) as error:
            found.set_exception(error)

    threading.Thread(target=call, name="cluster", daemon=True).start()
    with contextlib.suppress(TimeoutError):
        return found.result(seconds)
    return None


def _ended(seconds: float, function: Callable[[], object]) -> None:
    """Call something that may fail, and wait no longer than that."""
    with contextlib.suppress(Exception, CancelledError, asyncio.CancelledError):
        _within(seconds, function)


def _answering(connect: Callable[[], Client]) -> Client:
    """A connection."""
    client = _within(PATIENCE + 1.0, connect)
    if client is None:
        raise TimeoutError(f"no answer within {PATIENCE:g} s")
    return client


def _remote_outcome(future: Any, task: Task) -> Outcome[Task, Any]:
    if future.status in ("cancelled", "lost"):
        raise EngineError(LOST)
    error = future.exception()
    return Outcome(task, None, error) if error is not None else Outcome(task, future.result())


def _distributed() -> Any:
    dask, distributed = (library(name, "study", "a cluster") for name in ("dask", "distributed"))
    dask.config.set({"distributed.scheduler.allowed-failures": ATTEMPTS - 1})
    for name in [known for known in logging.root.manager.loggerDict if known.startswith("distributed")]:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # what is lost is said here, in one line
    return distributed


def _protected(distributed: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Options of a cluster whose jobs and scheduler know each other by certificates, made for this cluster alone.

    Whoever can speak to a scheduler or a worker of the library has code executed there.
    """
    try:
        security = distributed.Security.temporary()
    except ImportError:
        raise InputError("cryptography is not installed", "the extra 'study'", "pip install 'scissordyn[study]'") from None
    silent = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}  # its pages may be read by anybody
    return {
        "shared_temp_directory": str(Path.cwd()),
        **options,
        "security": security,
        "scheduler_options": {**silent, **(options.get("scheduler_options") or {})},
        "worker_extra_args": ["--no-dashboard", *(options.get("worker_extra_args") or ())],
    }


def _cluster_options(file: Path) -> dict[str, Any]:
    import yaml

    try:
        found = yaml.safe_load(file.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "problem", None) or type(error).__name__
        raise InputError(f"cannot read '{file}': {reason}", "YAML with kind, jobs and options", "kind: slurm") from None
    if not isinstance(found, dict):
        raise InputError(f"'{file}' is no table", "YAML with kind, jobs and options", "kind: slurm")
    return found
