"""The commands of docs/howto/cluster.md on a real Slurm that the test starts; each test takes a minute or two."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from scissordyn.studies.compute.store import COMPLETE, Store
from studies import slurm
from studies.test_study import rows

MISSING = slurm.missing()  # Reason why Slurm cannot be used; empty if it can

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=MISSING)]

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "cluster.md"  # Page about clusters

# Command of a study with 200 cases
SWEEP = (
    *("sweep", "case.toml", "--set", "run.until=20 ms", "--vary", "A.clearance=0.1..0.4 mm, 200 values"),
    *("--block", "5", "-o", "study.db"),
)


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    """Start Slurm and return the environment in which commands reach the queue."""
    with slurm.running(tmp_path_factory.mktemp("slurm")) as environment:
        yield environment


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a case and the file of the page."""
    text = PAGE.read_text()
    (tmp_path / "cluster.yaml").write_text(text.partition("```yaml\n")[2].partition("```")[0])
    case = [sys.executable, "-m", "scissordyn.cli.main", "new", "scissor"]
    (tmp_path / "case.toml").write_text(subprocess.run(case, capture_output=True, text=True, check=True).stdout)
    return tmp_path


def change(folder, **options):
    """Change or add lines of the file of the page."""
    lines = (folder / "cluster.yaml").read_text().splitlines()
    kept = [line for line in lines if line.partition(":")[0] not in options]
    (folder / "cluster.yaml").write_text("\n".join([*kept, *(f"{name}: {value}" for name, value in options.items())]))


def started(folder, system, *words):
    """Start a command of the page, with the queue."""
    command = [sys.executable, "-m", "scissordyn.cli.main", *words, "--cluster", "cluster.yaml"]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, env=system, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


def ended(process, seconds=300.0):
    """Return status and stderr."""
    _, error = process.communicate(timeout=seconds)
    return process.returncode, error


def jobs(system, state="all"):
    """Return numbers of jobs."""
    asked = ["squeue", "--noheader", "--format=%i", f"--states={state}"]
    return subprocess.run(asked, env=system, capture_output=True, text=True, check=True).stdout.split()


def wait_for(condition, process, seconds=120.0):
    """Wait until a condition holds while a command runs."""
    until = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.2)


def blocks(folder):
    """Return the number of stored blocks."""
    store = Store(folder / "study.db")
    return int((store.times()["attempts"] > 0).sum()) if store.has_content() else 0


def check_left(folder, system, submitted):
    """Check that no job and no certificate is left, and that outputs of jobs are next to the study."""
    until = time.monotonic() + 30.0
    while jobs(system, "PENDING,RUNNING,COMPLETING"):
        assert time.monotonic() < until
        time.sleep(0.2)
    names = {path.name for path in folder.iterdir()}
    outputs = {name for name in names if name.startswith("slurm-")}
    assert len(outputs) <= submitted
    assert names - outputs == {"case.toml", "cluster.yaml", "study.db"}


def check_rows(folder):
    """Check that the study is complete, with the rows of threads."""
    assert (Store(folder / "study.db").status() == COMPLETE).all()
    words = [("threads.db" if word == "study.db" else word) for word in SWEEP]
    command = [sys.executable, "-m", "scissordyn.cli.main", *words, "--threads", "1"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    assert rows(folder / "threads.db") == rows(folder / "study.db")


def test_example_of_the_page_with_a_lost_job(folder, system):
    """Contract: the page's example runs on a node of two cores; a lost job is replaced; rows are those of threads."""
    process = started(folder, system, *SWEEP)
    wait_for(lambda: blocks(folder) >= 2, process)
    subprocess.run(["scancel", jobs(system, "RUNNING")[0]], env=system, check=True)
    status, said = ended(process)
    assert status == 0, said
    assert "1 ended before the study is complete; 1 more submitted" in said
    check_left(folder, system, 3)
    check_rows(folder)


def test_ctrl_c(folder, system):
    """Contract: status 130, one line, no job left, and completed cases are kept."""
    process = started(folder, system, *SWEEP)
    wait_for(lambda: blocks(folder) >= 2, process)
    process.send_signal(signal.SIGINT)
    status, said = ended(process, 30.0)
    lines = [line for line in said.splitlines() if "jobs: " not in line and " cases, " not in line]
    assert status == 130
    assert lines == ["scissordyn: interrupted; what is complete is in study.db; to go on: scissordyn study resume study.db"]
    assert blocks(folder) >= 2
    check_left(folder, system, 2)


def test_end_of_the_walltime(folder, system):
    """Contract: a job whose time is over is replaced; the study has work for ten times the walltime."""
    change(folder, jobs="1", walltime='"00:01:00"')
    words = [word.replace("200 values", "30000 values").replace("20 ms", "60 ms") for word in SWEEP]
    process = started(folder, system, *words)
    wait_for(lambda: blocks(folder) >= 2, process)
    first = jobs(system, "RUNNING")
    wait_for(lambda: bool(jobs(system, "RUNNING")) and not set(first) & set(jobs(system, "RUNNING")), process, 200.0)
    before = blocks(folder)
    wait_for(lambda: blocks(folder) > before, process)
    process.send_signal(signal.SIGINT)
    status, said = ended(process, 30.0)
    assert status == 130
    assert "1 ended before the study is complete; 1 more submitted" in said
    check_left(folder, system, 3)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"cores": "8", "processes": "8"}, "PartitionConfig"),
        ({"queue": "short", "walltime": '"00:10:00"'}, "PartitionTimeLimit"),
    ],
)
def test_jobs_that_never_start(options, reason, folder, system):
    """Contract: status 3 with the queue's reason."""
    change(folder, **options)
    status, said = ended(started(folder, system, *SWEEP))
    assert status == 3
    assert f"scissordyn: no job can start: 2 waiting ({reason}); completed cases are kept" in said
    check_left(folder, system, 2)
