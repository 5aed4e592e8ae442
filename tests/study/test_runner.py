"""Maps over cases."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from scissordyn.errors import InputError
from scissordyn.study.runner import DIED, CaseResult, each_case, run_cases, worker_count


def divided(case):
    """Three of the ways in which a case may end."""
    if case == "die":
        os._exit(3)
    if case == "refuse":
        raise InputError("what came", "what is allowed")
    return 1.0 / case


def test_results_do_not_depend_on_the_workers():
    """Identity: the same values and errors, in the order of the cases, here and on two processes."""
    cases = [4.0, 0.0, 3.0, "refuse", "text", 7.0]
    seen = []
    here = run_cases(divided, cases, workers=1, progress=lambda done, total: seen.append((done, total)))
    there = run_cases(divided, cases, workers=2)
    assert [(one.index, one.value, one.error) for one in here] == [(one.index, one.value, one.error) for one in there]
    assert [one.value for one in here] == [0.25, None, 1.0 / 3.0, None, None, 1.0 / 7.0]
    assert here[1].error == "ZeroDivisionError: float division by zero"
    assert here[3].error == "what came; allowed: what is allowed"
    assert here[4].error.startswith("TypeError: ")
    assert seen == [(k, 6) for k in range(1, 7)]


def test_a_process_that_dies_costs_its_case_only():
    """Identity: every other case has its result."""
    found = run_cases(divided, [2.0, "die", 4.0, 5.0], workers=2)
    assert [one.value for one in found] == [0.5, None, 0.25, 0.2]
    assert found[1] == CaseResult(1, None, DIED, 0.0)


def test_a_function_that_cannot_be_sent():
    """Identity: each case says so."""
    found = run_cases(lambda case: case, [1, 2], workers=2)
    assert [one.value for one in found] == [None, None]
    assert all("pickle" in one.error.lower() for one in found)


def test_worker_count():
    """Identity: bounds."""
    assert worker_count(3) == 3
    assert worker_count(None) >= 1
    with pytest.raises(InputError, match="workers = 0"):
        worker_count(0)
    assert run_cases(divided, []) == []


def gone(pid):
    """Whether a process has ended, or ends within two seconds."""
    for _ in range(200):
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX":
                return True
        except FileNotFoundError:
            return True
        time.sleep(0.01)
    return False


def pid_then_sleep(case):
    """The process that works, at once for the first case and never for others."""
    if case:
        time.sleep(60.0)
    return os.getpid()


def test_giving_up_ends_our_processes_only():
    """Identity: a reader who leaves ends the workers at once, and no process that somebody else started meanwhile."""
    before = signal.getsignal(signal.SIGINT), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    results = each_case(pid_then_sleep, [0, 1, 1, 1], workers=2)
    worker = next(results).value
    other = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(60.0,))
    other.start()
    try:
        began = time.monotonic()
        results.close()
        assert time.monotonic() - began < 2.0
        assert gone(worker)
        assert other.is_alive()
    finally:
        other.kill()
        other.join()
    assert before == (signal.getsignal(signal.SIGINT), signal.pthread_sigmask(signal.SIG_BLOCK, ()))


ORPHANS = """
import os, sys, time
from scissordyn.study.runner import run_cases

def work(case):
    os.write(1, f"{os.getpid()}\\n".encode())
    {work}

if __name__ == "__main__":
    run_cases(work, range(8), workers=2)
"""


@pytest.mark.parametrize("work", ["time.sleep(60)", "(10**6000000) % 7", "pass"])
def test_workers_end_with_their_parent(tmp_path, work):
    """Identity: a parent that is killed leaves no process, whether it sleeps, holds the interpreter or waits for work."""
    script = tmp_path / "script.py"
    script.write_text(ORPHANS.replace("{work}", work) + ("    time.sleep(60)\n" if work == "pass" else ""))
    if work == "pass":
        script.write_text(script.read_text().replace("run_cases(work, range(8), workers=2)", KEEP))
    with subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as parent:
        pids = {int(parent.stdout.readline()) for _ in range(2)}
        parent.kill()
        assert all(gone(pid) for pid in pids)


KEEP = """from scissordyn.study.runner import each_case
    results = each_case(work, range(8), workers=2)
    for _ in range(7):
        next(results)"""
"""Takes all results but one, so that the pool stays and its processes are idle."""
