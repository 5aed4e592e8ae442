"""Every method of integration, for tests that hold for all of them."""

import pytest

from scissordyn.integrate.method import METHODS


@pytest.fixture(params=METHODS)
def name(request):
    """Name of a method."""
    return request.param
