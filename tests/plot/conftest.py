"""Made-up runs for all tests of pictures."""

import pytest
import xarray as xr

from scissordyn.model.mechanism import Mechanism

from .made_up import CLEARANCE_JOINTS, made_up, mechanism_with


@pytest.fixture(scope="session")
def run() -> xr.Dataset:
    """A made-up run with clearance at joint A."""
    return made_up()


@pytest.fixture(scope="session")
def ideal() -> xr.Dataset:
    """The made-up run of the ideal mechanism."""
    return made_up(())


@pytest.fixture(scope="session")
def two_joints() -> xr.Dataset:
    """A made-up run with two clearance joints."""
    return made_up(tuple(CLEARANCE_JOINTS))


@pytest.fixture(scope="session")
def arm() -> Mechanism:
    """The mechanism of `run`."""
    return mechanism_with(("A",))
