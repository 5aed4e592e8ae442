"""Other users of the machine: what they can reach of the processes that compute a study."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.cli.where import UNPROTECTED, Where
from scissordyn.study.engine import Outcome, error_text

NOBODY = 65534

root = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can become another user")
proc = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs /proc")


def family() -> list[int]:
    """Own process and all that it has started, also indirectly."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found = [os.getpid()]
    for one in found:
        found += [process for process, parent in parents.items() if parent == one]
    return found


def sockets(processes: list[int]) -> set[str]:
    """Inodes of all sockets that processes hold."""
    found = set()
    for process in processes:
        for path in Path(f"/proc/{process}/fd").iterdir():
            try:
                found |= set(re.findall(r"socket:\[(\d+)\]", os.readlink(path)))
            except OSError:
                continue
    return found


def listening() -> dict[str, str]:
    """Sockets of this process and those that it started on which anybody can be connected: inode and kind, or TCP port."""
    own, found = sockets(family()), {}
    for kind in ("tcp", "tcp6"):
        rows = [line.split() for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]]
        found |= {row[9]: str(int(row[1].rpartition(":")[2], 16)) for row in rows if row[3] == "0A" and row[9] in own}
    for kind in ("udp", "udp6"):
        rows = [line.split() for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]]
        found |= {row[9]: kind for row in rows if row[9] in own}
    rows = [line.split() for line in Path("/proc/net/unix").read_text().splitlines()[1:]]
    return found | {row[6]: "unix" for row in rows if int(row[3], 16) & 0x10000 and row[6] in own}


@proc
def test_processes_listen_nowhere() -> None:
    """Contract: the processes of `--workers` are reached by pipes alone; no socket of theirs or of this process listens."""
    before = listening()
    with Where(workers=2).engine() as engine:
        outcomes = list(engine.each(getpid, [1, 2, 3, 4]))
        after = listening()
        members = family()
    assert {outcome.value for outcome in outcomes} <= set(members) - {os.getpid()}
    assert {inode: kind for inode, kind in after.items() if inode not in before} == {}


def getpid(_: int) -> int:
    """The process that does a task, some time after it was given it."""
    time.sleep(0.2)
    return os.getpid()


def fatal(task: int) -> int:
    """A task that ends its process, if it is the second."""
    if task == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return task


class UnsentError(Exception):
    """An error that cannot be made anew from its arguments."""

    def __init__(self, first: int, second: int) -> None:
        super().__init__(f"{first} {second}")


def failing(task: int) -> int:
    """Each task fails in its own way."""
    if task == 1:
        raise sd.InputError("a bar of 0 m", "more", "1 m")
    raise UnsentError(task, 3)


def test_what_becomes_of_tasks() -> None:
    """Contract: values, errors, and a task whose process dies each time, which costs no other task its value."""
    with Where(workers=2).engine() as engine:
        died: list[Outcome[int, int]] = sorted(engine.each(fatal, [1, 2, 3, 4]), key=lambda one: one.task)
        failed: list[Outcome[int, int]] = sorted(engine.each(failing, [1, 2]), key=lambda one: one.task)
        for first in engine.each(getpid, range(50)):  # left early
            assert isinstance(first.value, int)
            break
        again = [outcome.value for outcome in engine.each(abs, [-1, -2])]
    assert [outcome.value for outcome in died] == [1, None, 3, 4]
    assert died[1].error is not None
    assert error_text(died[1].error) == "the processes that computed it died"
    assert isinstance(failed[0].error, sd.InputError)
    assert str(failed[0].error) == "a bar of 0 m; allowed: more; type: 1 m"
    assert isinstance(failed[1].error, RuntimeError)
    assert str(failed[1].error) == "UnsentError: 2 3"
    assert sorted(map(int, again)) == [1, 2]


UNGUARDED = """
from scissordyn.study.processes import Processes
with Processes(1) as engine:
    list(engine.each(abs, [1]))
"""


def test_a_script_without_a_guard(tmp_path: Path) -> None:
    """Contract: a script that its own processes would execute again ends with an error that says so, and starts no others."""
    script = tmp_path / "unguarded.py"
    script.write_text(UNGUARDED)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("a script that starts some needs 'if __name__ == \"__main__\":'")


ATTACK = """
import asyncio, logging, os, sys
from distributed import Security
from distributed.core import rpc
from distributed.protocol.pickle import dumps

logging.disable(logging.CRITICAL)

async def attack(places):
    ways = [(f"tcp://{place}", None) for place in places]
    ways += [(f"tls://{place}", security.get_connection_args("client")) for place in places for security in (Security(), own)]
    return [got for got in await asyncio.gather(*(attempt(*way) for way in ways)) if got is not None]

async def attempt(address, connection):
    for operation in ("run_function", "run"):
        try:
            server = rpc(address, connection_args=connection, timeout=5)
            asked = getattr(server, operation)(function=dumps(os.getuid), args=dumps(()), kwargs=dumps({}))
            return (await asyncio.wait_for(asked, 10))["result"]
        except BaseException:
            pass

if __name__ == "__main__":
    own, (open_to_all, *places) = Security.temporary(), sys.argv[1:]
    asyncio.run(attack([open_to_all]))  # loads all modules, which another user may not be able to read
    os.setgroups([])
    os.setgid(65534)
    os.setuid(65534)
    print(os.getuid(), asyncio.run(attack([open_to_all])), asyncio.run(attack(places)))
"""
"""Have a function executed as another user: by a scheduler without certificates, and at other places."""


@root
@proc
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_jobs_admit_no_stranger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: another user who tries every port of scheduler and jobs, also with certificates of his own, executes nothing.

    The same attack on a scheduler without certificates has a function executed as root.
    """
    from distributed import LocalCluster

    from scissordyn.study.engine import Cluster
    from study.test_cluster import queueing_system

    queueing_system(tmp_path, monkeypatch, "sbatch")
    file = tmp_path / "cluster.yaml"
    file.write_text("kind: slurm\njobs: 1\ncores: 1\nmemory: 1GB\nwalltime: '00:05:00'\n")
    monkeypatch.chdir(tmp_path)
    unprotected = LocalCluster(n_workers=0, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address="127.0.0.1:0")
    before = every_port()
    with unprotected, Cluster(file) as engine:
        assert [outcome.value for outcome in engine.each(abs, [-1])] == [1]
        assert engine.protected
        ports = every_port() - before
        keys = list(tmp_path.glob(".dask-jobqueue*"))
        assert len(ports) >= 3  # of the scheduler, of a worker and of its guardian
        assert keys
        assert {path.stat().st_mode & 0o077 for path in keys} == {0}
        host = engine.client.scheduler.address.split("://")[1].rpartition(":")[0]
        places = [unprotected.scheduler_address.split("://")[1], *(f"{host}:{port}" for port in sorted(ports))]
        done = subprocess.run([sys.executable, "-c", ATTACK, *places], capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout == f"{NOBODY} [0] []\n", done.stderr
    assert list(tmp_path.glob(".dask-jobqueue*")) == []


def documented(home: Path) -> dict[str, str]:
    """The environment that the page on clusters sets up, by its own commands."""
    page = Path(__file__).parents[2] / "docs" / "howto" / "cluster.md"
    (block,) = re.findall(r"^ *```bash\n(.*?)^ *```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    own = {"HOME": str(home), "PATH": os.environ["PATH"]}
    show = textwrap.dedent(block) + "\n. tls.sh && env -0\n"
    shown = subprocess.run(["bash", "-ec", show], env=own, capture_output=True, text=True, check=True, timeout=60).stdout
    return {name: value for name, _, value in (line.partition("=") for line in shown.split("\0")) if name.startswith("DASK_")}


@pytest.mark.slow
@pytest.mark.parametrize("protocol", ["tls", "tcp"])
def test_a_scheduler_of_ones_own(protocol: str, tmp_path: Path) -> None:
    """Contract: with the certificates of the documentation there is no warning, and without them one, and no admittance."""
    own = documented(tmp_path) if protocol == "tls" else {}
    assert {path.stat().st_mode & 0o077 for path in tmp_path.glob("dask-tls/*.pem")} <= {0}
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    dask, address = [sys.executable, "-m", "dask"], f"{protocol}://127.0.0.1:{port}"
    join = [sys.executable, "-c", JOIN, address]
    commands = [
        [*dask, "scheduler", "--host", "127.0.0.1", "--port", port, "--protocol", protocol, "--no-dashboard"],
        [*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny"],
    ]
    started = [
        subprocess.Popen(one, env={**os.environ, **own}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=tmp_path)
        for one in commands
    ]
    try:
        until = time.monotonic() + 120.0
        while port not in every_port():
            assert time.monotonic() < until
            time.sleep(0.1)
        joined = subprocess.run(join, env={**os.environ, **own}, capture_output=True, text=True, check=False, timeout=200)
        without = subprocess.run(join, capture_output=True, text=True, check=False, timeout=200)
    finally:
        for process in started:
            process.kill()
            process.wait()
    assert joined.stdout == "[1, 2]\n", joined.stderr
    if protocol == "tls":
        assert joined.stderr == ""
        assert without.stdout == ""
        assert "does not answer" in without.stderr
    else:
        assert joined.stderr == f"{UNPROTECTED}\n"


JOIN = """
import sys
from scissordyn.cli.where import Where
with Where(scheduler=sys.argv[1]).engine() as engine:
    print(sorted(outcome.value for outcome in engine.each(abs, [-1, -2])))
"""


def every_port() -> set[str]:
    """TCP ports on which anything listens, of whatever process: jobs are not started by this one."""
    rows = [line.split() for kind in ("tcp", "tcp6") for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]]
    return {str(int(row[1].rpartition(":")[2], 16)) for row in rows if row[3] == "0A"}
