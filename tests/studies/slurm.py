"""A local Slurm: munge, a controller and one node, with its configuration in a temporary folder."""

import getpass
import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

DAEMONS = ("munged", "slurmctld", "slurmd")  # Programs of Slurm that run in the background
COMMANDS = ("sbatch", "squeue", "scancel", "scontrol", "sinfo")  # Commands of Slurm that users type

CORES, MEMORY = 2, 4000  # Number of cores and memory [MB] of the only node of the cluster

START_SECONDS = 30.0  # [s] longest time that the daemons may take to start


def missing():
    """Return why no Slurm can be started here; empty if one can be started."""
    absent = [name for name in (*DAEMONS, *COMMANDS) if program(name) is None]
    if absent:
        return f"no {', '.join(absent)}: apt-get install slurmctld slurmd slurm-client munge"
    return "" if os.geteuid() == 0 else "slurmd runs as root"


def program(name):
    """Return the path of a program; daemons are in folders that a user's path may lack."""
    return shutil.which(name, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


@contextmanager
def running(folder):
    """Start the daemons; yield the environment in which the commands of Slurm reach them."""
    socket_path = _munge(folder)
    ports = _free_port(), _free_port()
    host = socket.gethostname().partition(".")[0]
    for name in ("state", "spool", "log"):
        (folder / name).mkdir()
    configuration = folder / "slurm.conf"
    configuration.write_text(
        "\n".join(
            [
                "ClusterName=tried",
                f"SlurmctldHost={host}(127.0.0.1)",
                f"SlurmUser={getpass.getuser()}",
                f"SlurmctldPort={ports[0]}",
                f"SlurmdPort={ports[1]}",
                "AuthType=auth/munge",
                f"AuthInfo=socket={socket_path}",
                f"StateSaveLocation={folder}/state",
                f"SlurmdSpoolDir={folder}/spool",
                f"SlurmctldPidFile={folder}/slurmctld.pid",
                f"SlurmdPidFile={folder}/slurmd.pid",
                f"SlurmctldLogFile={folder}/log/slurmctld.log",
                f"SlurmdLogFile={folder}/log/slurmd.log",
                "ProctrackType=proctrack/linuxproc",
                "TaskPlugin=task/none",
                "SelectType=select/cons_tres",
                "SelectTypeParameters=CR_Core_Memory",
                "SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=1,sched_min_interval=0",
                "ReturnToService=2",
                "KillWait=2",
                "OverTimeLimit=0",
                "InactiveLimit=0",
                f"NodeName={host} NodeAddr=127.0.0.1 CPUs={CORES} RealMemory={MEMORY} State=UNKNOWN",
                f"PartitionName=tried Nodes={host} Default=YES MaxTime=INFINITE State=UP",
                f"PartitionName=short Nodes={host} MaxTime=1 State=UP",
                "",
            ]
        )
    )
    version = subprocess.run([str(program("slurmd")), "-V"], capture_output=True, text=True, check=True).stdout.split()[1]
    # without control groups; before 23.11 there was no word for it, and the plugin of version 1 starts without any
    plugin = "disabled" if tuple(map(int, version.split(".")[:2])) >= (23, 11) else "cgroup/v1"
    (folder / "cgroup.conf").write_text(f"CgroupPlugin={plugin}\n")
    environment = {**os.environ, "SLURM_CONF": str(configuration)}
    daemons = []
    try:
        for name, options in (("slurmctld", ["-D", "-i"]), ("slurmd", ["-D"])):
            with (folder / "log" / f"{name}.out").open("wb") as log:
                command = [str(program(name)), *options, "-f", str(configuration)]
                daemons.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log, start_new_session=True))
        _wait_for_node(environment, folder)
        yield environment
    finally:
        subprocess.run(["scancel", "--full", "-u", getpass.getuser()], env=environment, capture_output=True, check=False)
        time.sleep(1.0)
        for daemon in reversed(daemons):
            daemon.terminate()
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        subprocess.run(["munged", f"--socket={socket_path}", "--stop"], capture_output=True, check=False, env=environment)


def _munge(folder):
    """Start munge with a new key."""
    place = folder / "munge"
    place.mkdir(mode=0o755)
    key = place / "munge.key"
    key.write_bytes(secrets.token_bytes(128))
    key.chmod(0o400)
    path = place / "munge.socket"
    options = [f"--{name}={place / file}" for name, file in (("pid-file", "pid"), ("log-file", "log"), ("seed-file", "seed"))]
    command = [str(program("munged")), "--force", f"--key-file={key}", f"--socket={path}", *options]
    subprocess.run(command, check=True, capture_output=True, timeout=START_SECONDS)
    return path


def _free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def _wait_for_node(environment, folder):
    until = time.monotonic() + START_SECONDS
    while time.monotonic() < until:
        asked = subprocess.run(["sinfo", "-h", "-o", "%T"], env=environment, capture_output=True, text=True, check=False)
        if "idle" in asked.stdout:
            return
        time.sleep(0.2)
    logs = "\n".join(f"{path.name}: {path.read_text()[-1000:]}" for path in sorted((folder / "log").iterdir()))
    raise TimeoutError(f"no idle node within {START_SECONDS:g} s\n{asked.stdout}{asked.stderr}\n{logs}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary, running(Path(temporary)) as shell:
        subprocess.run([os.environ.get("SHELL", "/bin/sh")], env=shell, check=False)
