"""Cases that many tests share."""

import sys
from collections import Counter

import pytest

from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.friction.lugre import LuGre
from scissordyn.model.clearance import Clearance
from scissordyn.model.scissor import scissor
from scissordyn.run.simulate import simulate
from scissordyn.units import rpm

# these need pseudo terminals, pipes, signals, /proc or /dev/full
collect_ignore = (
    []
    if sys.platform == "linux"
    else [
        "cli/test_command_line.py",
        "cli/test_files.py",
        "cli/test_signals.py",
        "run/test_output_file.py",
    ]
)


@pytest.fixture(scope="session")
def array():
    """The paper's array with ideal joints, driven at 150 rpm."""
    return scissor(units=2).driven(speed=rpm(150))


@pytest.fixture(scope="session")
def clearance_array(array):
    """The same with the paper's clearance at joint A, frictionless."""
    return array.with_clearance("A", Clearance(0.5e-3))


@pytest.fixture(scope="session")
def hertz_array(array):
    """The same with the laws that the clearance-joint literature compares with."""
    return array.with_clearance("A", Clearance(0.5e-3, stiffness=Hertz(), damping=LankaraniNikravesh()))


@pytest.fixture(scope="session")
def frictional_array(array):
    """The same with LuGre friction."""
    return array.with_clearance("A", Clearance(0.5e-3, friction=LuGre(0.1)))


@pytest.fixture(scope="session")
def clearance_run(clearance_array):
    """50 ms of the frictionless array at default tolerance."""
    return simulate(clearance_array, until=0.05)


@pytest.fixture(scope="session")
def frictional_run(frictional_array):
    """50 ms of the array with friction at default tolerance."""
    return simulate(frictional_array, until=0.05)


def pytest_terminal_summary(terminalreporter):
    """One line of how many tests were left out, and for want of what."""
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in terminalreporter.stats.get("skipped", []))
    if reasons:
        parts = ", ".join(f"{count} ({reason})" for reason, count in reasons.most_common())
        terminalreporter.write_line(f"left out: {sum(reasons.values())} tests: {parts}")
