"""Executors of dask: of a scheduler that runs already, or of jobs of a queueing system."""

from __future__ import annotations

import logging
import shutil
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from scissordyn.errors import InputError
from scissordyn.lookup import library
from scissordyn.run.engine import QUICKLY, signals_blocked

KEYS = ("_job_ca_file", "_job_cert", "_job_key")
"""Where dask-jobqueue has the temporary files of certificates, which it would keep as long as this process."""

PATIENCE = 10.0  # How long a scheduler may take to answer [s]


@contextmanager
def cluster(where: str | Path) -> Iterator[Executor]:
    """The workers of a scheduler, ``"tls://host:8786"`` with the certificates of dask's configuration, or of a queueing system.

    A file says which jobs dask-jobqueue is to start, in YAML: ``kind: slurm``, ``jobs: 20``, and the options of its class.
    Raises `InputError` if no scheduler answers, or the file cannot be used.
    """
    distributed = library("distributed", "study", "a cluster")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what is lost is said by the command, in one line
    jobs = _jobs(where, distributed) if isinstance(where, Path) else None
    connected = [] if jobs is None else [jobs]
    wait = QUICKLY
    try:
        with signals_blocked():
            client = _connected(distributed, jobs or where)
        connected.insert(0, client)
        yield client.get_executor(pure=False)
        wait = PATIENCE
    finally:
        for connection in connected:
            with suppress(Exception, CancelledError):
                _within(wait, connection.close)
        for name in KEYS if jobs is not None else ():
            vars(jobs)[name].close()


def _connected(distributed: Any, where: Any) -> Any:
    try:
        return _within(PATIENCE + 1.0, lambda: distributed.Client(where, timeout=PATIENCE, set_as_default=False))
    except Exception as error:  # what answers may be anything, and the library raises whatever it makes of it
        reason = " ".join(str(error).split())[:200] or f"no answer within {PATIENCE:g} s"
        what = f"scheduler '{where}' does not answer: {reason}"
        raise InputError(what, "the address that dask scheduler prints", "tls://host:8786") from None


def _within(seconds: float, function: Callable[[], Any]) -> Any:
    """Call something, and wait no longer than that: the other end may be gone or silent."""
    result: Future[Any] = Future()

    def call() -> None:
        try:
            result.set_result(function())
        except BaseException as error:
            result.set_exception(error)

    threading.Thread(target=call, name="cluster", daemon=True).start()
    return result.result(seconds)


def _jobs(file: Path, distributed: Any) -> Any:
    """A cluster of dask-jobqueue, whose jobs and scheduler know each other by certificates that it makes."""
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
    if shutil.which(submit) is None:  # the library would wait for jobs that nobody submits
        raise InputError(f"'{file}': no command '{submit}' here", f"a machine from which {kind} takes jobs", "--workers 2")
    try:
        # whoever can speak to a scheduler of the library has code executed there
        security = {"security": distributed.Security.temporary(), "shared_temp_directory": str(Path.cwd())}
        started = described(**{**security, "scheduler_options": {"dashboard": False}, **options})
        started.scale(jobs=jobs)
    except (ImportError, OSError, TypeError, ValueError) as error:
        reason = str(error).splitlines()[0].partition(". ")[0]  # what follows is an example with all options
        sample = "cores: 8, processes: 8, memory: 16GB, each on a line of its own"
        raise InputError(f"'{file}': {reason}", f"options of dask_jobqueue.{kinds[kind]}", sample) from None
    return started


def _options(file: Path) -> dict[str, Any]:
    import yaml

    try:
        options = yaml.safe_load(file.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "problem", None) or type(error).__name__
        raise InputError(f"cannot read '{file}': {reason}", "YAML with kind, jobs and options", "kind: slurm") from None
    if not isinstance(options, dict):
        raise InputError(f"'{file}' is no table", "YAML with kind, jobs and options", "kind: slurm")
    return options
