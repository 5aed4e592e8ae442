"""Executors of dask: of a scheduler that runs already, or of jobs of a queueing system."""

from __future__ import annotations

import logging
import shlex
import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from scissordyn.errors import InputError
from scissordyn.file.output_file import lock_file
from scissordyn.lookup import library
from scissordyn.run.engine import STOP_SECONDS, EngineError, block_signals
from scissordyn.studies.compute.jobs import ANSWER_SECONDS_MAX, Jobs, remove_left_behind

CERTIFICATE_ATTRIBUTES = ("_job_ca_file", "_job_cert", "_job_key")
"""Attributes of dask-jobqueue with temporary certificate files, which would otherwise remain until this process ends."""

LOGGERS = ("distributed", "distributed.client", "tornado.application", "asyncio")
"""Names of loggers that print lost results and a traceback of each cancelled task; each has a level of its own."""


@contextmanager
def cluster(where: str | Path, folder: Path | None = None, tell: Callable[[str], None] = lambda _: None) -> Iterator[Executor]:
    """Connect to the workers of a scheduler (``"tls://host:8786"``), or start those of a queueing system.

    A file names the jobs that are submitted, in YAML: ``kind: slurm``, ``jobs: 20``, and the options of the class of
    dask-jobqueue. The folder, by default the current one, gets the files of the jobs. `tell` gets a line when jobs start,
    wait or end. Raises `InputError` if no scheduler answers, or the file cannot be used.
    """
    distributed = library("distributed", "study", "a cluster")
    for name in LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # the command itself reports lost workers in one line
    with _queue(where, distributed, folder or Path.cwd(), tell) if isinstance(where, Path) else nullcontext() as queue:
        connected, wait = list[Any](), STOP_SECONDS
        try:
            with block_signals():
                connected.append(_connected(distributed, where if queue is None else queue[0]))
            executor = connected[0].get_executor(pure=False)
            if queue is not None:
                executor.watch = queue[1].watch
            yield executor
            wait = ANSWER_SECONDS_MAX
        finally:
            for connection in connected:
                with suppress(Exception, CancelledError):
                    _within(wait, connection.close)


@contextmanager
def _queue(file: Path, distributed: Any, folder: Path, tell: Callable[[str], None]) -> Iterator[tuple[Any, Jobs]]:
    """Start a scheduler in this process and its jobs, which are cancelled at the end."""
    described, options, kind, count = _described(file)
    remove_left_behind(folder)
    started = _started(file, described, options, distributed, folder)
    certificates = [vars(started)[name] for name in CERTIFICATE_ATTRIBUTES if name in vars(started)]  # none if the file says so
    for certificate in certificates:
        lock_file(certificate.fileno())
    jobs = Jobs(started, kind, count, folder, tell)
    try:
        try:
            jobs.submit(count)
        except EngineError as error:
            raise InputError(
                f"'{file}': {error}", "a job that the queue takes", "cores: 2, processes: 2, memory: 2GB"
            ) from None
        tell(f"jobs: {count} submitted")
        yield started, jobs
    finally:
        jobs.close()
        with suppress(Exception, CancelledError):
            _within(STOP_SECONDS, started.close)
        for certificate in certificates:
            certificate.close()


def _connected(distributed: Any, where: Any) -> Any:
    try:
        return _within(
            ANSWER_SECONDS_MAX + 1.0, lambda: distributed.Client(where, timeout=ANSWER_SECONDS_MAX, set_as_default=False)
        )
    except Exception as error:  # the answer can be of any program, and the library raises any error
        reason = " ".join(str(error).split())[:200] or f"no answer within {ANSWER_SECONDS_MAX:g} s"
        what = f"scheduler '{where}' does not answer: {reason}"
        raise InputError(what, "the address that dask scheduler prints", "tls://host:8786") from None


def _within(seconds: float, function: Callable[[], Any]) -> Any:
    """Call a function and wait at most `seconds` for its result: the other end may be gone or silent."""
    result: Future[Any] = Future()

    def call() -> None:
        try:
            result.set_result(function())
        except BaseException as error:
            result.set_exception(error)

    threading.Thread(target=call, name="cluster", daemon=True).start()
    return result.result(seconds)


def _described(file: Path) -> tuple[Any, dict[str, Any], str, int]:
    """Read the class of dask-jobqueue that a file names, its options, the kind of queueing system and the number of jobs."""
    with handlers_kept():  # a module of the library takes Ctrl-C when it is imported, and exits
        dask_jobqueue = library("dask_jobqueue", "study", "a queueing system")
    options = _options(file)
    named = (name for name in dir(dask_jobqueue) if name.endswith("Cluster") and name != "JobQueueCluster")  # their base
    kinds = {name.removesuffix("Cluster").lower(): name for name in named}
    kind, jobs = str(options.pop("kind", "")).lower(), options.pop("jobs", 1)
    if kind not in kinds or not isinstance(jobs, int) or jobs < 1:
        allowed = f"kind: one of {', '.join(sorted(kinds))}; jobs: 1 or more"
        raise InputError(f"'{file}': kind '{kind}', jobs {jobs!r}", allowed, "kind: slurm")
    described = getattr(dask_jobqueue, kinds[kind])
    submit = str(described.job_cls.submit_command).split()[0]
    if shutil.which(submit) is None:  # the library would wait for jobs that are never submitted
        raise InputError(f"'{file}': no command '{submit}' here", f"a machine from which {kind} takes jobs", "--workers 2")
    return described, options, kind, jobs


def _started(file: Path, described: Any, options: dict[str, Any], distributed: Any, folder: Path) -> Any:
    """Start a cluster of dask-jobqueue without jobs, whose scheduler and workers authenticate by generated certificates."""
    defaults: dict[str, Any] = {"shared_temp_directory": str(folder), "scheduler_options": {"dashboard": False}}
    if described.job_cls.config_name == "slurm" and "log_directory" not in options:
        output = shlex.quote(f"--output={folder}/slurm-%j.out")
        defaults["job_extra_directives"] = [output, *options.pop("job_extra_directives", ())]
    try:
        # anyone who can connect to a scheduler can execute code there
        return described(**{"security": distributed.Security.temporary(), **defaults, **options})
    except (ImportError, OSError, TypeError, ValueError) as error:
        reason = str(error).splitlines()[0].partition(". ")[0]  # what follows is an example with all options
        sample = "cores: 2, processes: 2, memory: 2GB, each on a line of its own"
        raise InputError(f"'{file}': {reason}", f"options of dask_jobqueue.{described.__name__}", sample) from None


@contextmanager
def handlers_kept() -> Iterator[None]:
    """Keep the handlers of signals that this process has."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is not None and signal.getsignal(number) is not handler:
                signal.signal(number, handler)


def _options(file: Path) -> dict[str, Any]:
    import yaml

    try:
        options = yaml.safe_load(file.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "problem", None) or type(error).__name__
        raise InputError(f"cannot read '{file}': {reason}", "YAML with kind, jobs and options", "kind: slurm") from None
    if not isinstance(options, dict):
        raise InputError(f"'{file}' is not a table", "YAML with kind, jobs and options", "kind: slurm")
    return options
