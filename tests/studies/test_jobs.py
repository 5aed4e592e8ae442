"""Jobs of a queueing system, without one: jobs that wait, end or cannot be submitted."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.process import Duplicate

from scissordyn.cli import main
from scissordyn.file.output_file import lock_file
from scissordyn.run.engine import EngineError
from scissordyn.studies.compute import jobs as module
from scissordyn.studies.compute.jobs import CERTIFICATE_PREFIX, SCRIPT_PREFIX, Jobs, remove_left_behind


def keep_locked(path):
    """Keep a file locked."""
    with open(path, "r+b") as file:
        lock_file(file.fileno())
        print("held", flush=True)
        time.sleep(60)


class Job:
    """Job of a queue that returns numbers, or refuses."""

    submit_command, cancel_command, refusal = "sbatch", "true", ""

    def __init__(self, address, name):
        self.name = name

    def job_script(self):
        """Return its text."""
        return "#!/bin/sh\n"

    def _submit_job(self, file):
        assert Path(file).read_text() == self.job_script()
        if self.refusal:
            raise RuntimeError(self.refusal)
        return f"Submitted batch job {self.name.rpartition('-')[2]}"

    def _job_id_from_submit_output(self, output):
        return output.split()[-1]


class Queue:
    """Jobs watched with given states at given times."""

    def __init__(self, folder, monkeypatch, count=2):
        self.now, self.told = 0.0, list[str]()
        monkeypatch.setattr(module.time, "monotonic", lambda: self.now)
        cluster = SimpleNamespace(
            new_spec={"cls": Job, "options": {}},
            scheduler_address="tls://here:1",
            scheduler=SimpleNamespace(workers={}),
            job_cls=Job,
            sync=lambda function, *given: function(*given),
        )
        self.jobs = Jobs(cluster, "slurm", count, folder, self.told.append)
        self.jobs.submit(count)
        self.states: dict[str, tuple[str, str]] = {}
        monkeypatch.setattr(self.jobs, "_query", lambda: self.states)

    def watch(self, finished, **states):
        """Query the queue once more; states are by number, as in j1="RUNNING"."""
        self.now += 10.0
        self.states = {name[1:]: state if isinstance(state, tuple) else (state, "None") for name, state in states.items()}
        self.jobs.watch(finished)


def test_jobs_that_end_early_are_replaced(tmp_path, monkeypatch):
    """Contract: ended jobs are replaced while blocks are finished; else at most three times as many are submitted."""
    queue = Queue(tmp_path, monkeypatch)
    queue.watch(0, j1="RUNNING", j2=("PENDING", "Resources"))
    assert queue.told == ["jobs: 1 running, 1 waiting (Resources), 0 ended; 0 workers connected"]
    number = 2
    for block in range(20):  # each job finishes a block before its time is over
        queue.watch(block, **{f"j{number - 1}": "TIMEOUT", f"j{number}": "RUNNING"})
        queue.watch(block + 1, **{f"j{number}": "RUNNING", f"j{number + 1}": "RUNNING"})
        number += 1
    assert queue.told[-1] == "jobs: 2 running, 0 waiting, 20 ended; 0 workers connected"
    assert queue.told.count("jobs: 1 ended before the study is complete; 1 more submitted") == 20
    for _ in range(2):
        queue.watch(20)  # all are gone
    with pytest.raises(EngineError, match="the last 6 jobs ended without finishing a block; completed cases are kept"):
        queue.watch(20)
    assert list(tmp_path.iterdir()) == []


def test_jobs_that_can_never_start(tmp_path, monkeypatch):
    """Contract: a permanent reason ends the command after a minute; a temporary one does not."""
    queue = Queue(tmp_path, monkeypatch)
    for _ in range(100):
        queue.watch(0, j1=("PENDING", "Priority"), j2=("PENDING", "PartitionConfig"))
    assert len(queue.told) == 1
    lasting = {"j1": ("PENDING", "ReqNodeNotAvail, UnavailableNodes:n1"), "j2": ("PENDING", "PartitionConfig")}
    for _ in range(6):  # 60 s
        queue.watch(0, **lasting)
    says = r"no job can start: 2 waiting \(ReqNodeNotAvail, UnavailableNodes:n1, PartitionConfig\)"
    with pytest.raises(EngineError, match=says):
        queue.watch(0, **lasting)


def test_refused_job(tmp_path, monkeypatch):
    """Contract: the error has the line of the queueing system, not that of the library."""
    line = "sbatch: error: invalid partition specified: gpu"
    said = f"Command exited with non-zero exit code.\nstdout:\n\nstderr:\n{line}\nmore\n"
    monkeypatch.setattr(Job, "refusal", said)
    with pytest.raises(EngineError, match=rf"'sbatch' does not take a job: {line}$"):
        Queue(tmp_path, monkeypatch)


def test_files_of_killed_commands_are_removed(tmp_path):
    """Contract: certificates and scripts of a killed command are removed, those of a running one stay."""
    names = [f"{CERTIFICATE_PREFIX}{key}.x" for key in ("ca_file", "cert", "key")] + [
        f"{SCRIPT_PREFIX}0.sh",
        "study.db",
        "slurm-1.out",
    ]
    for name in names:
        (tmp_path / name).touch()
    with Duplicate(keep_locked, tmp_path / names[2]) as other:
        assert other.stdout.readline() == "held\n"
        remove_left_behind(tmp_path)
        other.kill()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([names[2], "study.db", "slurm-1.out"])
    remove_left_behind(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["slurm-1.out", "study.db"]


def test_signal_handlers_are_kept():
    """Contract: importing dask_jobqueue does not change the user's signal handlers."""
    pytest.importorskip("dask_jobqueue")
    text = (
        "import signal, sys\n"
        "from scissordyn.studies.compute.cluster import handlers_kept\n"
        "mine = lambda *_: None\n"
        "signal.signal(signal.SIGINT, mine)\n"
        "with handlers_kept():\n"
        "    import dask_jobqueue\n"
        "    assert signal.getsignal(signal.SIGINT) is not mine\n"
        "sys.exit(signal.getsignal(signal.SIGINT) is not mine)\n"
    )
    assert subprocess.run([sys.executable, "-c", text], check=False).returncode == 0


@pytest.mark.parametrize(("received", "status", "says"), [([signal.SIGINT], 130, "interrupted"), ([], 1, "SystemExit(0)")])
def test_early_exit_is_not_success(received, status, says, monkeypatch, capfd):
    """Contract: a function that exits, as a library's signal handler does, gives one line and a nonzero status."""
    monkeypatch.setattr(main.app, "invoke", lambda _: sys.exit(0))
    monkeypatch.setattr(main, "_received", received)
    assert main.status_of(["laws"]) == status
    said = capfd.readouterr().err
    assert says in said
    assert said.count("\n") == 1
