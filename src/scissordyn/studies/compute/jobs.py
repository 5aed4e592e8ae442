"""Jobs of a queueing system: they are submitted, watched, replaced when they end early, and cancelled at the end."""

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

ASK_SECONDS = 5.0  # Time between two questions to the queue [s]: it serves many users
ANSWER_SECONDS = 20.0  # How long a command of the queue may take [s]

STUCK_SECONDS = 60.0
"""How long every job has to wait for a reason that does not pass [s]: the main scheduler of Slurm runs once a minute."""

ROUNDS = 3  # How often all jobs may end without a finished block before no new ones are asked for

QUESTIONS = {"slurm": ("squeue", "--noheader", "--format=%i|%T|%r", "--user")}
"""Commands that list the jobs of a user with number, state and reason, by queueing system."""

ENDED = ("BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "TIMEOUT")
WAITING = ("PENDING", "REQUEUED", "REQUEUE_HOLD", "SUSPENDED")

LASTING = (
    *("PartitionConfig", "PartitionDown", "PartitionInactive", "PartitionNodeLimit", "PartitionTimeLimit", "BadConstraints"),
    *("ReqNodeNotAvail", "InvalidAccount", "InvalidQOS", "JobHeldAdmin", "JobHeldUser", "AccountNotAllowed", "QOSNotAllowed"),
)
"""Reasons of Slurm for which a job waits until somebody changes the job or the machine."""

CERTIFICATES, SCRIPTS = ".dask-jobqueue.worker.", ".scissordyn-job."  # Beginnings of names of files


class Jobs:
    """The jobs that do a study.

    Parameters
    ----------
    cluster : dask_jobqueue.JobQueueCluster
        Has the scheduler, and says what a job is.
    kind : str
        Of the queueing system.
    count : int
        Jobs that are kept submitted.
    folder : Path
        Has the scripts of jobs while they are submitted.
    tell : callable
        Gets a line when something changes.
    """

    def __init__(self, cluster: Any, kind: str, count: int, folder: Path, tell: Callable[[str], None]) -> None:
        self._cluster, self._kind, self._count, self._folder, self._tell = cluster, kind, count, folder, tell
        self._names, self._alive = 0, list[str]()
        self._ended, self._fruitless, self._finished = 0, 0, 0  # Ended jobs, those since a block was finished, blocks
        self._next = self._moving = time.monotonic()  # When the queue is asked next, when a job could still start
        self._told = ""

    def submit(self, count: int) -> None:
        """Submit jobs; an error of the queueing system is an `EngineError`."""
        for _ in range(count):
            self._names += 1
            spec = self._cluster.new_spec
            job = spec["cls"](self._cluster.scheduler_address, name=f"scissordyn-{self._names}", **spec["options"])
            try:
                with _script(self._folder, job.job_script()) as file:
                    number = job._job_id_from_submit_output(self._cluster.sync(job._submit_job, str(file)))
            except (OSError, RuntimeError, ValueError) as error:
                raise EngineError(f"'{job.submit_command}' does not take a job: {_reason(error)}") from None
            self._alive.append(str(number))

    def watch(self, finished: int) -> None:
        """Tell what has changed, and replace jobs that have ended; `EngineError` if no job is left that could do anything.

        `finished` is the number of blocks that are finished by now.
        """
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + ASK_SECONDS
        if finished > self._finished:
            self._finished, self._fruitless = finished, 0
        states = self._ask()
        if states is None:
            self._say(f"jobs: {len(self._alive)} submitted; {self._workers}")
            return
        found = [states.get(number, ("ENDED", "")) for number in self._alive]
        ended = [number for number, (state, _) in zip(self._alive, found, strict=True) if state in ("ENDED", *ENDED)]
        waiting = Counter(reason for state, reason in found if state in WAITING)
        running = len(found) - len(ended) - waiting.total()
        self._alive = [number for number in self._alive if number not in ended]
        self._ended += len(ended)
        self._fruitless += len(ended)
        reasons = ", ".join(reason for reason in waiting if reason not in ("None", ""))
        told = f"jobs: {running} running, {waiting.total()} waiting{f' ({reasons})' if reasons else ''}, {self._ended} ended"
        self._say(f"{told}; {self._workers}")
        self._check_waiting(now, running, waiting, reasons)
        if ended:
            self._replace(len(ended))

    def _check_waiting(self, now: float, running: int, waiting: Counter[str], reasons: str) -> None:
        """Raise `EngineError` if all jobs wait, and have done so for some time, for what does not pass."""
        lasting = bool(waiting) and all(reason.startswith(LASTING) for reason in waiting)
        if running or not lasting:
            self._moving = now
        elif now - self._moving > STUCK_SECONDS:
            raise EngineError(f"no job can start: {waiting.total()} waiting ({reasons}); what is complete is kept")

    def _replace(self, count: int) -> None:
        if self._fruitless >= ROUNDS * self._count:
            if self._alive:
                return
            raise EngineError(
                f"the last {self._fruitless} jobs ended without finishing a block; what is complete is kept, and the output of "
                f"the jobs is in '{self._folder}'"
            )
        self.submit(count)
        self._say(f"jobs: {count} ended before the study is complete; {count} more submitted")

    @property
    def _workers(self) -> str:
        count = len(self._cluster.scheduler.workers)
        return f"{count} worker{'' if count == 1 else 's'} connected"

    def _say(self, line: str) -> None:
        if line != self._told:
            self._told = line
            self._tell(line)

    def _ask(self) -> dict[str, tuple[str, str]] | None:
        """State and reason of each job of the user by its number; None if the queue does not answer."""
        if self._kind not in QUESTIONS:
            return None
        try:
            command = [*QUESTIONS[self._kind], getpass.getuser()]
            asked = subprocess.run(command, capture_output=True, text=True, timeout=ANSWER_SECONDS, check=True)
        except (OSError, subprocess.SubprocessError):
            return None
        rows = (line.strip().split("|", 2) for line in asked.stdout.splitlines())
        return {row[0]: (row[1], row[2]) for row in rows if len(row) == 3}

    def close(self) -> None:
        """Cancel the jobs that are left."""
        command = shlex.split(str(self._cluster.job_cls.cancel_command))
        calls = [self._alive] if self._kind in QUESTIONS else [[number] for number in self._alive]
        self._alive = []
        for numbers in filter(None, calls):
            with suppress(OSError, subprocess.SubprocessError):
                subprocess.run([*command, *numbers], capture_output=True, timeout=ANSWER_SECONDS, check=False)


def _reason(error: Exception) -> str:
    """The line that a queueing system wrote of what is wrong, or what an error says."""
    lines = [line.strip() for line in str(error).partition("stderr:")[2].splitlines() if line.strip()]
    return next((line for line in lines if "error" in line.lower()), lines[0] if lines else str(error).splitlines()[0])


@contextmanager
def _script(folder: Path, text: str) -> Iterator[Path]:
    """A file with the script of a job, which is locked as long as this process needs it."""
    path = folder / f"{SCRIPTS}{secrets.token_hex(4)}.sh"
    with path.open("x") as file:
        try:
            lock_file(file.fileno())
            file.write(text)
            file.flush()
            yield path
        finally:
            path.unlink(missing_ok=True)


def remove_left_behind(folder: Path) -> None:
    """Remove certificates and scripts of jobs of commands that were killed; those of a command that runs are locked."""
    for path in (*folder.glob(f"{CERTIFICATES}*"), *folder.glob(f"{SCRIPTS}*")):
        with suppress(OSError), path.open("r+b") as file:
            if lock_file(file.fileno()):
                path.unlink()
