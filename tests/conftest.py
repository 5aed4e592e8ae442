"""Fixtures of many tests: the paper's array and its runs, each computed once, a browser, and commands with what they print."""

import gc
import os
import sys
from collections import Counter

import pytest
from tests import build

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.run.engine import Duplicates
from scissordyn.sensitivity import library

# these need pseudo terminals, pipes, signals, /proc or /dev/full
collect_ignore = (
    []
    if sys.platform == "linux"
    else ["cli/test_command_line.py", "cli/test_files.py", "cli/test_signals.py", "run/test_output_file.py"]
)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Keep the garbage collector away from what collection makes, which lives to the end: it would search it 30 times."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items):
    """Put the tests that watch the interpreter last: a process keeps its audit hook, which every call of a kernel pays for."""
    items.sort(key=lambda item: item.name.startswith(("test_tampered_documents", "test_watch_notices")))


@pytest.fixture
def duplicated(monkeypatch):
    """Duplicate this process, although threads of the tests' runner wait in it."""
    if sys.platform != "linux":
        pytest.skip("processes are duplicated on Linux only")
    monkeypatch.setattr(Duplicates, "possible", staticmethod(lambda: True))


@pytest.fixture(scope="session")
def array():
    """Return the paper's array with ideal joints, driven at 150 rpm."""
    return build.array()


@pytest.fixture(scope="session")
def clearance_array():
    """Return the array with the paper's clearance at joint A, without friction."""
    return build.array(sd.Clearance(0.5e-3))


@pytest.fixture(scope="session")
def hertz_array():
    """Return the array with the contact laws with which the literature on clearance joints compares others."""
    return build.array(sd.Clearance(0.5e-3, stiffness=sd.Hertz(), damping=sd.LankaraniNikravesh()))


@pytest.fixture(scope="session")
def frictional_array():
    """Return the array with LuGre friction at joint A."""
    return build.array(sd.Clearance(0.5e-3, friction=sd.LuGre(0.1)))


@pytest.fixture(scope="session")
def clearance_run(clearance_array):
    """Return a run of 50 ms of the array without friction, at the default tolerance."""
    return sd.simulate(clearance_array, until=0.05)


@pytest.fixture(scope="session")
def frictional_run(frictional_array):
    """Return a run of 50 ms of the array with friction, at the default tolerance."""
    return sd.simulate(frictional_array, until=0.05)


@pytest.fixture(scope="session")
def browser():
    """Yield Chromium; a process can start it only once."""
    from tests.explore.browser import chromium, missing

    if missing():
        pytest.skip(missing())
    with chromium() as started:
        yield started


@pytest.fixture(autouse=True, scope="session")
def quick_library(tmp_path_factory):
    """Compile libraries in dual numbers with little optimisation, once for all workers, and apart from those of the user."""
    folder = tmp_path_factory.getbasetemp()
    patch = pytest.MonkeyPatch()
    patch.setattr(library, "_flags", lambda width: ("-O1", *library.VECTOR_FLAGS.get(width, ())))
    patch.setenv("XDG_CACHE_HOME", str((folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "cache"))
    yield
    patch.undo()


@pytest.fixture
def answer(capsys):
    """Run a command and return what it prints, its words separated by single spaces; an error (status 2) is one line."""

    def run_command(*words, status=0):
        capsys.readouterr()
        found = status_of([str(word) for word in words])
        shown = capsys.readouterr()
        assert found == status, shown.err
        assert status != 2 or shown.err.count("\n") == 1
        return " ".join((shown.err if status == 2 else shown.out).split())

    return run_command


def pytest_terminal_summary(terminalreporter):
    """Print how many tests were skipped, by reason."""
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in terminalreporter.stats.get("skipped", []))
    if reasons:
        parts = ", ".join(f"{count} ({reason})" for reason, count in reasons.most_common())
        terminalreporter.write_line(f"left out: {sum(reasons.values())} tests: {parts}")
