"""Pictures that two processes make."""

import os
import sys
import time

import pytest

from scissordyn.plot import second_process
from scissordyn.plot.second_process import make_all

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2, reason="all pictures are made in one process"
)


@pytest.fixture(autouse=True)
def one_thread(monkeypatch):
    monkeypatch.setattr(second_process.threading, "active_count", lambda: 1)


def process_number():
    time.sleep(0.05)  # [s] so that both processes take some
    return str(os.getpid()).encode()


def dying_elsewhere(process):
    if os.getpid() != process:
        os._exit(1)
    return process_number()


def test_two_processes_share_the_pictures():
    """Identity: each result is there once, under its name and in the order of the names, and no process is left."""
    made = make_all({str(number): process_number for number in range(6)})
    assert list(made) == [str(number) for number in range(6)]
    assert len(set(made.values())) == 2
    (second,) = set(map(int, made.values())) - {os.getpid()}
    with pytest.raises(ChildProcessError):
        os.waitpid(second, os.WNOHANG)


def test_one_process_makes_what_the_other_does_not():
    """Limit: if the second process dies, the first makes all results."""
    first = os.getpid()
    made = make_all(dict.fromkeys("abcd", lambda: dying_elsewhere(first)))
    assert made == dict.fromkeys("abcd", str(first).encode())


@pytest.mark.parametrize("failing", [0, 1, 2, 3])
def test_errors_of_both_processes_are_raised(failing):
    """Contract: an error is raised whichever process meets it."""
    makers = dict.fromkeys("abcd", process_number) | {"abcd"[failing]: lambda: b"%d" % (1 // 0)}
    with pytest.raises(ZeroDivisionError):
        make_all(makers)
