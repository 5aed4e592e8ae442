"""Libraries in dual numbers are compiled quickly, and apart from those of the user."""

import pytest

from scissordyn.sensitivity import library


@pytest.fixture(autouse=True, scope="session")
def quick_library(tmp_path_factory):
    """Compile without optimisation."""
    patch = pytest.MonkeyPatch()
    patch.setattr(library, "_flags", lambda: ("-O0",))
    patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
    yield
    patch.undo()
