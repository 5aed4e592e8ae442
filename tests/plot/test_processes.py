"""Pictures that several processes make."""

import os
import sys
import time

import pytest

from scissordyn.plot import processes
from scissordyn.plot.processes import make_all
from scissordyn.run.engine import Duplicates

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="all pictures are made in one process")


@pytest.fixture(autouse=True)
def one_thread(monkeypatch):
    monkeypatch.setattr(processes, "processors", lambda: 3)
    monkeypatch.setattr(Duplicates, "possible", staticmethod(lambda: True))


def process_number():
    time.sleep(0.05)  # [s] so that all processes take some
    return str(os.getpid()).encode()


def test_processes_share_the_pictures():
    """Identity: each result is there once, under its name and in the order of the names, and no process is left."""
    made = make_all({str(number): process_number for number in range(9)})
    assert list(made) == [str(number) for number in range(9)]
    assert len(set(made.values())) == 3
    for duplicate in map(int, set(made.values())):
        assert duplicate != os.getpid()
        with pytest.raises(ChildProcessError):
            os.waitpid(duplicate, os.WNOHANG)


@pytest.mark.parametrize("failing", [0, 1, 2, 3])
def test_errors_of_all_processes_are_raised(failing):
    """Contract: an error is raised whichever process meets it."""
    makers = dict.fromkeys("abcd", process_number) | {"abcd"[failing]: lambda: b"%d" % (1 // 0)}
    with pytest.raises(ZeroDivisionError):
        make_all(makers)
