"""Engines: threads, processes and a scheduler give the same bytes; lost or killed work is done again."""

import gc
import logging
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from benchmarks.study_kills import KILLS, VICTIMS, killed_at_random

import scissordyn as sd
from reference.paper_case import paper_case
from scissordyn.run.engine import outcomes
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.compute.cluster import cluster
from scissordyn.studies.compute.execute import ProgramError, execute
from scissordyn.studies.compute.store import Store
from studies.test_engine import is_running
from studies.test_study import arm, rows

pytestmark = pytest.mark.slow  # real schedulers and workers, which leave warnings of their own behind

# Options of a study with 300 cases
SWEEP = ["--vary", "A.clearance=0.1..0.5 mm, 20 values", "--vary", "drive.speed=100..200 rpm, 15 values", "--block", "6"]


def process_of(_):
    """Return the process of a task."""
    return os.getpid()


def study(cases=24):
    """Return a study of a few cases."""
    return Study(arm(), sd.Options(0.002), (Factor("A.clearance", sd.Interval(1e-4, 5e-4, cases)),), measures=("peak_force",))


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_processes_give_the_bytes_of_threads(tmp_path):
    """Contract: processes give the rows of threads, also when one dies."""
    whole = execute(study(), tmp_path / "threads.db", block=3, engine=1)
    with sd.Processes(2) as engine:
        victims = [outcome.value for outcome in outcomes(engine, process_of, [1])]
        killed = []

        def kill(progress):
            if not killed:
                killed.append(victims[0])
                os.kill(victims[0], signal.SIGKILL)

        store = execute(study(), tmp_path / "processes.db", block=3, engine=engine, progress=kill)
    assert killed
    assert rows(store.path) == rows(whole.path)
    assert store.times()["attempts"].tolist() == [1.0] * 8


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_worker_with_other_sources_is_refused(tmp_path):
    """Contract: a worker whose package differs ends the study with its path, and stores nothing."""
    package = tmp_path / "other" / "scissordyn"
    shutil.copytree(Path(sd.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    with (package / "run" / "measure.py").open("a") as file:
        file.write("# other\n")
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    dask, address = [sys.executable, "-m", "dask"], f"tcp://127.0.0.1:{port}"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    processes = [subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"], **quiet)]
    try:
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline:
            with socket.socket() as one:
                if one.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        worker = [*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]
        processes.append(subprocess.Popen(worker, env={**os.environ, "PYTHONPATH": str(package.parent)}, **quiet))
        with cluster(address) as engine:
            engine._client.wait_for_workers(1, timeout=120)
            with pytest.raises(
                ProgramError, match=re.escape(f"with '{package}' would compute other numbers (differs in program)")
            ):
                execute(study(), tmp_path / "a.db", block=3, engine=engine)
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert not Store(tmp_path / "a.db").status().any()


def test_scheduler_that_does_not_answer(monkeypatch):
    """Contract: the error comes within the waiting time, and the library prints nothing."""
    monkeypatch.setattr("scissordyn.studies.compute.cluster.ANSWER_SECONDS_MAX", 1.0)
    with socket.socket() as taken:  # listens, and never says a word
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(sd.InputError, match="does not answer"), cluster(address):
            pass
    with pytest.raises(sd.InputError, match="does not answer"), cluster("nonsense://x"):
        pass
    with socket.create_server(("127.0.0.1", 0)) as other:  # some other server, which says something else
        threading.Thread(target=_greet, args=(other,), daemon=True).start()
        address = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(sd.InputError, match="does not answer"), cluster(address):
            pass
    for name in ("client", "scheduler", "core"):  # distributed gives the first a level of its own
        assert not logging.getLogger(f"distributed.{name}").isEnabledFor(logging.WARNING)


def _greet(server):
    with suppress(OSError):
        while True:
            with server.accept()[0] as one:
                one.sendall(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n" * 8)
                one.recv(1)


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[1, 2]", "is not a table"),
        ("kind: abacus\njobs: 2", "one of .*slurm"),
        ("kind: jobqueue\njobs: 2", "one of htcondor, lsf"),
        ("kind: slurm\njobs: 0", "jobs 0"),
        ("a: [", "cannot read"),
        ("kind: pbs\ncores: 1\nmemory: 1GB", "no command 'qsub' here"),
        ("kind: slurm\ncores: 1", "must specify how much cores and memory"),
        (
            "kind: slurm\ncores: 1\nmemory: 1GB\nwalltme: 1",
            "unexpected keyword argument 'walltme'; expected options of dask_jobqueue.SLURMCluster",
        ),
    ],
)
def test_bad_cluster_files(tmp_path, text, says, monkeypatch):
    """Contract: a wrong cluster file is refused in one line."""
    queueing_system(tmp_path, monkeypatch, "sbatch")
    file = tmp_path / "cluster.yaml"
    file.write_text(text)
    with pytest.raises(sd.InputError, match=says) as error, cluster(file):
        pass
    assert "\n" not in str(error.value)
    del error
    gc.collect()  # the library leaves open files where its constructor fails


def queueing_system(folder, monkeypatch, submit):
    """Install a queueing system of this machine, which keeps the text of each job and starts it at once."""
    binaries, jobs = folder / "bin", folder / "jobs"
    binaries.mkdir()
    jobs.mkdir()
    script = f"""#!/bin/bash
file={jobs}/$$.sh
cat "${{1:-/dev/stdin}}" > "$file"
setsid bash "$file" > "$file.log" 2>&1 < /dev/null &
echo $! > "$file.pid"
echo "Submitted batch job $$"
"""
    cancel = f"""#!/bin/bash
for job in "$@"; do [ -f {jobs}/$job.sh.pid ] && kill -- -$(cat {jobs}/$job.sh.pid) 2> /dev/null; done
true
"""
    for name, text in ((submit, script), ("scancel", cancel), ("qdel", cancel)):
        (binaries / name).write_text(text)
        (binaries / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{binaries}:/usr/bin:/bin")
    return jobs


@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.parametrize(("kind", "submit", "asks"), [("slurm", "sbatch", "#SBATCH -t 00:05:00")])
def test_jobs_of_a_queueing_system(kind, submit, asks, tmp_path, monkeypatch):
    """Contract: jobs are submitted as the file says, their workers compute the study, and none is left."""
    jobs = queueing_system(tmp_path, monkeypatch, submit)
    monkeypatch.chdir(tmp_path)  # where the certificates of the jobs are
    file = tmp_path / "cluster.yaml"
    file.write_text(f"kind: {kind}\njobs: 2\ncores: 1\nmemory: 1GB\nwalltime: '00:05:00'\n")
    whole = execute(study(8), tmp_path / "threads.db", engine=1, block=2)
    with cluster(file) as engine:
        store = execute(study(8), tmp_path / "jobs.db", engine=engine, block=2)
    assert rows(store.path) == rows(whole.path)
    texts = [path.read_text() for path in jobs.glob("*.sh")]
    assert len(texts) == 2
    assert all(asks in text and "dask_worker tls://" in text for text in texts)
    numbers = [int(path.read_text()) for path in jobs.glob("*.pid")]
    wait_for(lambda: not any(map(is_running, numbers)))


def run_command(*arguments, **options):
    """Start the command line in a new process group."""
    command = [sys.executable, "-m", "scissordyn.cli.main", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, **options
    )


def wait_for(condition, seconds=120.0):
    """Wait until a condition holds."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


def said(error):
    """Return lines of stderr without those about progress."""
    return [line for line in error.splitlines() if not re.match(r"\d+ of \d+ cases, ", line)]


def written(store):
    """Return the number of blocks in a store."""
    return int(np.count_nonzero(Store(store).times()["attempts"])) if Store(store).has_content() else 0


def test_ctrl_c_keeps_what_is_complete(tmp_path):
    """Contract: Ctrl-C gives status 130 and one line; `resume` does not compute finished blocks again."""
    case, store = tmp_path / "case.toml", tmp_path / "a.db"
    case.write_text(paper_case("20 ms"))
    process = run_command("sweep", case, *SWEEP, "-o", store, "--threads", "1")
    wait_for(lambda: written(store) >= 2)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert len(said(error)) == 1
    assert f"study resume {store}" in error
    assert 2 <= written(store) < 50
    process = run_command("study", "resume", store)
    output, error = process.communicate(timeout=120)
    assert process.returncode == 0, error
    assert "300 cases complete, 0 failed, 0 pending" in output
    assert Store(store).times()["attempts"].tolist() == [1.0] * 50


def test_killed_at_random_moments(tmp_path):
    """Contract: after 20 kills the rows are those of an undisturbed run, and no finished block is computed twice."""
    found = killed_at_random(tmp_path, KILLS)
    assert [kill.victim for kill in found] == [*(VICTIMS[k % 3] for k in range(KILLS)), ""]
    assert [kill.rewritten for kill in found] == [0] * len(found)
    assert {kill.same for kill in found} <= {True, None}
    assert found[-1].same
    assert sum(kill.finished for kill in found) > 0
    for kill in found:
        match kill.victim:
            case "coordinator":
                assert kill.status == -9
            case "scheduler":
                assert kill.status == 0 or (kill.status == 3 and len(kill.lines) == 1), kill.lines
            case _:
                assert (kill.status, kill.lines, kill.same) == (0, (), True)
