"""Made-up runs for all tests of pictures."""

import pytest

from .made_up import CLEARANCE_JOINTS, made_up, mechanism_with


@pytest.fixture(scope="session")
def run():
    return made_up()


@pytest.fixture(scope="session")
def ideal():
    return made_up(())


@pytest.fixture(scope="session")
def two_joints():
    return made_up(tuple(CLEARANCE_JOINTS))


@pytest.fixture(scope="session")
def arm():
    return mechanism_with(("A",))
