"""Engines: where the blocks of a study are done. An engine maps a function over tasks and knows nothing else."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, runtime_checkable

from scissordyn.cache.folder import adopt_folder, shared_folder
from scissordyn.errors import InputError, ScissordynError
from scissordyn.run.interrupt import stopped_by

if TYPE_CHECKING:
    from distributed import Client

__all__ = [
    "Cluster",
    "Engine",
    "EngineError",
    "Outcome",
    "Threads",
    "error_text",
    "in_threads",
    "processors",
    "signals_blocked",
]

Task = TypeVar("Task")
Value = TypeVar("Value")

AHEAD = 2
"""Tasks handed out per worker: one in work and one that waits, so that no worker waits for this process."""

ATTEMPTS = 3
"""A task whose worker died this often is given up."""

QUICKLY = 0.5
"""How long a worker, thread or process, may take to end by itself after Ctrl-C [s]."""

RECOUNT = 1.0
"""How often the scheduler is asked for the number of its workers [s]."""

PATIENCE = 10.0
"""How long a scheduler may take to answer [s]."""

KEYS = ("_job_ca_file", "_job_cert", "_job_key")
"""Where dask-jobqueue has the temporary files of certificates, which it would keep as long as this process."""

LOST = "the connection to the scheduler was lost; what is complete is kept"


class EngineError(ScissordynError):
    """Workers that could be reached before and cannot now."""


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@dataclass(frozen=True)
class Outcome(Generic[Task, Value]):
    """What became of a task.

    Parameters
    ----------
    task
    value
        None if it failed.
    error : Exception or None
    """

    task: Task
    value: Value | None
    error: Exception | None = None


def error_text(error: Exception) -> str:
    """An error of a task in one line: the text of an error of this package, the kind and the text of any other."""
    if type(error).__name__ == "KilledWorker":
        return "the processes that computed it died"
    text = " ".join(str(error).split())
    return text if isinstance(error, ScissordynError) and text else f"{type(error).__name__}: {text}".rstrip(": ")


@runtime_checkable
class Engine(Protocol):
    """Whatever maps a function over tasks."""

    @property
    def workers(self) -> int:
        """Tasks in work at the same time."""

    def each(self, function: Callable[[Task], Value], tasks: Iterable[Task]) -> Iterator[Outcome[Task, Value]]:
        """Results in the order in which they come."""


class Threads:
    """Threads of this process: kernels release the interpreter's lock.

    Parameters
    ----------
    workers : int, optional
        One per processor if not given; with 1, tasks are done on the thread that asks for them.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
            raise InputError(f"threads = {workers!r}", "a whole number >= 1")
        self.workers = workers or processors()

    def each(self, function: Callable[[Task], Value], tasks: Iterable[Task]) -> Iterator[Outcome[Task, Value]]:
        """Results in the order in which they come; Ctrl-C interrupts the runs in work.

        Parameters
        ----------
        function : callable
            Of a task.
        tasks : iterable

        Yields
        ------
        Outcome
        """
        if self.workers == 1:
            for task in tasks:
                yield _done(function, task)
            return
        stop = threading.Event()

        def stoppable(task: Task) -> Outcome[Task, Value]:
            with stopped_by(stop):
                return _done(function, task)

        yield from in_threads(stoppable, tasks, self.workers, stop.set)


def in_threads(
    outcome: Callable[[Task], Outcome[Task, Value]], tasks: Iterable[Task], threads: int, stop: Callable[[], None]
) -> Iterator[Outcome[Task, Value]]:
    """Outcomes of tasks in the order in which they come.

    Parameters
    ----------
    outcome : callable
        Of a task.
    tasks : iterable
    threads : int
    stop : callable
        Ends what is in work.

    Yields
    ------
    Outcome
    """
    pool = ThreadPoolExecutor(threads, thread_name_prefix="task")
    handed: set[Future[Outcome[Task, Value]]] = set()
    waiting, stopped = iter(tasks), False
    try:
        while True:
            for task in waiting:
                handed.add(pool.submit(outcome, task))
                if len(handed) >= AHEAD * threads:
                    break
            if not handed:
                break
            for future in wait(handed, return_when=FIRST_COMPLETED).done:
                handed.remove(future)
                yield future.result()
    except BaseException:
        stopped = True
        stop()
        for future in handed:
            future.cancel()
        raise
    finally:
        # after a stop runs end with their slice; what a task computes besides may take seconds
        going = wait(handed, QUICKLY if stopped else None).not_done
        pool.shutdown(wait=not going)


def _done(function: Callable[[Task], Value], task: Task) -> Outcome[Task, Value]:
    try:
        return Outcome(task, function(task))
    except Exception as error:
        return Outcome(task, None, error)


class Cluster:
    """Workers of dask.distributed.

    Parameters
    ----------
    client : Client
        Connected to a scheduler.
    """

    def __init__(self, client: Client) -> None:
        self.client = client

    @property
    def protected(self) -> bool:
        """Whether its connections are encrypted and only those with a certificate are admitted."""
        return str(self.client.scheduler.address).startswith("tls://")

    @property
    def workers(self) -> int:
        """Threads of all workers, at least 1."""
        return max(1, int(sum(self.client.nthreads().values())))

    @classmethod
    @contextmanager
    def joined(cls, scheduler: str) -> Iterator[Cluster]:
        """Workers of a scheduler that runs already.

        Parameters
        ----------
        scheduler : str
            Its address, ``tls://host:8786``; certificates are those of dask's configuration.

        Raises
        ------
        InputError
            If no scheduler answers there.
        """
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
            yield cls(client)

    @classmethod
    @contextmanager
    def queued(cls, file: Path) -> Iterator[Cluster]:
        """Workers that a queueing system starts, by dask-jobqueue.

        Parameters
        ----------
        file : Path
            YAML: ``kind: slurm`` (or pbs, lsf, sge, htcondor, oar), ``jobs: 20``, and the options of the class.

        Raises
        ------
        InputError
            If the file cannot be used, dask-jobqueue is not installed, or jobs cannot be submitted from this machine.
        """
        distributed = _distributed()
        options = _cluster_options(file)
        if given := {"security", "protocol"} & {*options, *(options.get("scheduler_options") or {})}:
            reason = "connections are always encrypted, with certificates made for this study"
            raise InputError(f"'{file}': {' and '.join(sorted(given))}: {reason}", "the file without that")
        try:
            import dask_jobqueue
        except ImportError:
            raise InputError("dask-jobqueue is not installed", "the package", "pip install dask-jobqueue") from None
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
                yield cls(client)
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

        waiting, handed, count, kernels = iter(tasks), dict[str, Task](), 0, shared_folder()
        running, limit, again = as_completed(loop=self.client.loop), 0, 0.0
        try:
            while True:
                if time.monotonic() > again:
                    limit, again = AHEAD * self.workers, time.monotonic() + RECOUNT
                while len(handed) < limit:
                    task = next(waiting, None)
                    if task is None:
                        break
                    name = f"task-{id(self):x}-{count}"
                    future = self.client.submit(_elsewhere, function, task, kernels, pure=False, retries=0, key=name)
                    handed[future.key] = task
                    running.add(future)
                    count += 1
                if not handed:
                    return
                if self.client.status not in ("running", "connecting"):
                    raise EngineError(LOST)
                future = next(running)
                yield _remote_outcome(future, handed.pop(future.key))
        except EngineError:
            raise
        except (OSError, CancelledError, asyncio.CancelledError) as error:
            # of the connection: errors of a task are in its outcome
            raise EngineError(LOST) from error
        except BaseException:
            _within(QUICKLY, lambda: self.client.cancel(list(handed), force=True))
            raise


def _elsewhere(function: Callable[[Task], Value], task: Task, kernels: Path) -> Value:
    """Do a task in another process, which takes machine code from where this one keeps it if it is on this machine."""
    import dask

    if kernels.is_dir():
        adopt_folder(kernels)
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
            _within(QUICKLY, each.close)
        raise
    for each in connected:
        _within(PATIENCE, each.close)


def _within(seconds: float, function: Callable[[], object]) -> None:
    """Call something, and wait no longer than that: the other end may be gone, and the library would wait for ever."""

    def call() -> None:
        with contextlib.suppress(Exception, CancelledError, asyncio.CancelledError):
            function()

    thread = threading.Thread(target=call, name="closing", daemon=True)
    thread.start()
    thread.join(seconds)


def _answering(connect: Callable[[], Client]) -> Client:
    """A connection; the library itself waits for ever for a server that accepts it and then is silent."""
    found: list[Client] = []
    failed: list[Exception] = []

    def attempt() -> None:
        try:
            found.append(connect())
        except Exception as error:
            failed.append(error)

    trying = threading.Thread(target=attempt, name="connect", daemon=True)
    trying.start()
    trying.join(PATIENCE + 1.0)
    if failed:
        raise failed[0]
    if not found:
        raise TimeoutError(f"no answer within {PATIENCE:g} s")
    return found[0]


def _remote_outcome(future: Any, task: Task) -> Outcome[Task, Any]:
    if future.status in ("cancelled", "lost"):
        raise EngineError(LOST)
    error = future.exception()
    return Outcome(task, None, error) if error is not None else Outcome(task, future.result())


def _distributed() -> Any:
    try:
        import dask
        import distributed
    except ImportError:
        raise InputError("dask.distributed is not installed", "the extra 'study'", "pip install 'scissordyn[study]'") from None
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
