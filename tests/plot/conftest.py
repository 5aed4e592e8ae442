"""Made-up runs for all tests of pictures."""

import pytest
import xarray as xr

import scissordyn as sd

from .made_up import CLEARANCE_JOINTS, made_up, mechanism_with


@pytest.fixture(scope="session")
def run() -> xr.Dataset:
    return made_up()


@pytest.fixture(scope="session")
def ideal() -> xr.Dataset:
    return made_up(())


@pytest.fixture(scope="session")
def two_joints() -> xr.Dataset:
    return made_up(tuple(CLEARANCE_JOINTS))


@pytest.fixture(scope="session")
def arm() -> sd.Mechanism:
    return mechanism_with(("A",))
