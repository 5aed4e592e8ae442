"""Jobs of a queueing system: submit them, watch them, replace those that end early, and cancel the rest."""

from __future__ import annotations

import getpass
import secrets
import shlex
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from scissordyn.file.output_file import lock_file
from scissordyn.run.engine import EngineError

POLL_SECONDS = 5.0  # Time between two queries of the job queue [s], which serves many users
ANSWER_SECONDS_MAX = 20.0  # [s] longest wait for the answer of a scheduler or of a job queue

STUCK_SECONDS = 60.0
"""Longest time for which all jobs may wait for a lasting reason [s]; Slurm's scheduler runs once a minute."""

FRUITLESS_ROUNDS_MAX = 3  # Largest number of times that all jobs end without a finished block before no more are submitted

QUERIES = {"slurm": ("squeue", "--noheader", "--format=%i|%T|%r", "--user")}
"""Commands that list a user's jobs with job number, state and reason, by queueing system."""

# Slurm's states of jobs that have ended
ENDED_STATES = (
    "BOOT_FAIL",
    "CANCELLED",
    "COMPLETED",
    "DEADLINE",
    "FAILED",
    "NODE_FAIL",
    "OUT_OF_MEMORY",
    "PREEMPTED",
    "TIMEOUT",
)
WAITING_STATES = ("PENDING", "REQUEUED", "REQUEUE_HOLD", "SUSPENDED")  # Slurm's states of jobs that wait

LASTING_REASONS = (
    *("PartitionConfig", "PartitionDown", "PartitionInactive", "PartitionNodeLimit", "PartitionTimeLimit", "BadConstraints"),
    *("ReqNodeNotAvail", "InvalidAccount", "InvalidQOS", "JobHeldAdmin", "JobHeldUser", "AccountNotAllowed", "QOSNotAllowed"),
)
"""Slurm's reasons for which a job waits until somebody changes the job or the machine."""

# First characters of the names of certificate files and job scripts
CERTIFICATE_PREFIX, SCRIPT_PREFIX = ".dask-jobqueue.worker.", ".scissordyn-job."


class Jobs:
    """Jobs whose workers compute a study.

    Parameters
    ----------
    cluster : dask_jobqueue.JobQueueCluster
        Cluster with the scheduler and the description of a job.
    kind : str
        Name of the queueing system.
    count : int
        Number of jobs to keep submitted.
    folder : Path
        Folder for the scripts of jobs while they are submitted, and for the output of jobs.
    report : callable
        Called with one line whenever the state of the jobs changes.
    """

    def __init__(self, cluster: Any, kind: str, count: int, folder: Path, report: Callable[[str], None]) -> None:
        self._cluster, self._kind, self._count, self._folder, self._report = cluster, kind, count, folder, report
        self._submitted, self._alive = 0, list[str]()  # Number of submitted jobs; queue's numbers of those not ended
        self._ended, self._fruitless, self._finished = 0, 0, 0  # Ended jobs, those since the last finished block, blocks
        self._next_poll = self._last_hope = time.monotonic()  # Next query; last time that a job ran or could start
        self._last_line = ""

    def submit(self, count: int) -> None:
        """Submit jobs; raise `EngineError` if the queueing system refuses one."""
        for _ in range(count):
            self._submitted += 1
            spec = self._cluster.new_spec
            job = spec["cls"](self._cluster.scheduler_address, name=f"scissordyn-{self._submitted}", **spec["options"])
            try:
                with _script(self._folder, job.job_script()) as file:
                    number = job._job_id_from_submit_output(self._cluster.sync(job._submit_job, str(file)))
            except (OSError, RuntimeError, ValueError) as error:
                raise EngineError(f"'{job.submit_command}' does not take a job: {_reason(error)}") from None
            self._alive.append(str(number))

    def watch(self, finished: int) -> None:
        """Report changes and replace jobs that have ended; raise `EngineError` if no job can do any more work.

        `finished` is the number of finished blocks.
        """
        now = time.monotonic()
        if now < self._next_poll:
            return
        self._next_poll = now + POLL_SECONDS
        if finished > self._finished:
            self._finished, self._fruitless = finished, 0
        states = self._query()
        if states is None:
            self._say(f"jobs: {len(self._alive)} submitted; {self._workers}")
            return
        job_states = [states.get(number, ("ENDED", "")) for number in self._alive]
        ended = [
            number for number, (state, _) in zip(self._alive, job_states, strict=True) if state in ("ENDED", *ENDED_STATES)
        ]
        waiting = Counter(reason for state, reason in job_states if state in WAITING_STATES)
        running = len(job_states) - len(ended) - waiting.total()
        self._alive = [number for number in self._alive if number not in ended]
        self._ended += len(ended)
        self._fruitless += len(ended)
        reasons = ", ".join(reason for reason in waiting if reason not in ("None", ""))
        counts = f"jobs: {running} running, {waiting.total()} waiting{f' ({reasons})' if reasons else ''}, {self._ended} ended"
        self._say(f"{counts}; {self._workers}")
        self._check_waiting(now, running, waiting, reasons)
        if ended:
            self._replace(len(ended))

    def _check_waiting(self, now: float, running: int, waiting: Counter[str], reasons: str) -> None:
        """Raise `EngineError` if all jobs have waited for lasting reasons for `STUCK_SECONDS`."""
        lasting = bool(waiting) and all(reason.startswith(LASTING_REASONS) for reason in waiting)
        if running or not lasting:
            self._last_hope = now
        elif now - self._last_hope > STUCK_SECONDS:
            raise EngineError(f"no job can start: {waiting.total()} waiting ({reasons}); completed cases are kept")

    def _replace(self, count: int) -> None:
        """Submit new jobs; raise `EngineError` once too many have ended without a finished block and none is left."""
        if self._fruitless >= FRUITLESS_ROUNDS_MAX * self._count:
            if self._alive:
                return
            raise EngineError(
                f"the last {self._fruitless} jobs ended without finishing a block; completed cases are kept, and the output of "
                f"the jobs is in '{self._folder}'"
            )
        self.submit(count)
        self._say(f"jobs: {count} ended before the study is complete; {count} more submitted")

    @property
    def _workers(self) -> str:
        count = len(self._cluster.scheduler.workers)
        return f"{count} worker{'' if count == 1 else 's'} connected"

    def _say(self, line: str) -> None:
        """Report a line unless it equals the previous one."""
        if line != self._last_line:
            self._last_line = line
            self._report(line)

    def _query(self) -> dict[str, tuple[str, str]] | None:
        """Return state and reason of each of the user's jobs by number; None if the queue does not answer."""
        if self._kind not in QUERIES:
            return None
        try:
            command = [*QUERIES[self._kind], getpass.getuser()]
            answer = subprocess.run(command, capture_output=True, text=True, timeout=ANSWER_SECONDS_MAX, check=True)
        except (OSError, subprocess.SubprocessError):
            return None
        rows = (line.strip().split("|", 2) for line in answer.stdout.splitlines())
        return {row[0]: (row[1], row[2]) for row in rows if len(row) == 3}

    def close(self) -> None:
        """Cancel the remaining jobs."""
        command = shlex.split(str(self._cluster.job_cls.cancel_command))
        calls = [self._alive] if self._kind in QUERIES else [[number] for number in self._alive]
        self._alive = []
        for numbers in filter(None, calls):
            with suppress(OSError, subprocess.SubprocessError):
                subprocess.run([*command, *numbers], capture_output=True, timeout=ANSWER_SECONDS_MAX, check=False)


def _reason(error: Exception) -> str:
    """Return the error line of the queueing system, or the first line of the exception."""
    lines = [line.strip() for line in str(error).partition("stderr:")[2].splitlines() if line.strip()]
    return next((line for line in lines if "error" in line.lower()), lines[0] if lines else str(error).splitlines()[0])


@contextmanager
def _script(folder: Path, text: str) -> Iterator[Path]:
    """Write the script of a job to a file that stays locked while this process needs it."""
    path = folder / f"{SCRIPT_PREFIX}{secrets.token_hex(4)}.sh"
    with path.open("x") as file:
        try:
            lock_file(file.fileno())
            file.write(text)
            file.flush()
            yield path
        finally:
            path.unlink(missing_ok=True)


def remove_left_behind(folder: Path) -> None:
    """Remove certificates and job scripts of killed commands; those of a running command are locked."""
    for path in (*folder.glob(f"{CERTIFICATE_PREFIX}*"), *folder.glob(f"{SCRIPT_PREFIX}*")):
        with suppress(OSError), path.open("r+b") as file:
            if lock_file(file.fileno()):
                path.unlink()
