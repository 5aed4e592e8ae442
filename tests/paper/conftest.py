"""The paper's runs, computed once."""

from contextlib import contextmanager

import pytest

import scissordyn as sd
from scissordyn_paper import cache
from scissordyn_paper.cases import DEFAULT, every_case
from scissordyn_paper.runs import fetch_runs


@pytest.fixture(scope="session")
def few_periods():
    """Return counts of periods that suffice to draw something, but not to judge a motion."""
    diagram = {"DIAGRAM_VALUES": 2, "DIAGRAM_CYCLES": 4, "DIAGRAM_KEPT": 2}
    return {"CYCLES": 10, "SKIP": 4, "ENSEMBLE_MEMBERS": 2, "GROWTH_CYCLES": 2, "GROWTH_SKIP": 1, **diagram}


@pytest.fixture(scope="session")
def runs_folder(tmp_path_factory):
    """Return the folder of the runs of the default choice."""
    return tmp_path_factory.mktemp("paper") / "runs"


@pytest.fixture(scope="session")
def remembered():
    """Return a context that keeps results, and reads none again; of results with the same variables one is written."""
    known, kinds = {}, set()

    def read(path):
        if path not in known:
            known[path] = sd.load(path)
        return known[path]

    def write(result, path, **options):
        known[path] = result
        kind = path.parent, *sorted(result.variables)
        if kind in kinds:
            path.touch()
            return path
        kinds.add(kind)
        return sd.save(result, path, **options)

    @contextmanager
    def remember():
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(cache, "load", read)
            patch.setattr(cache, "save", write)
            yield patch

    return remember


@pytest.fixture(scope="session")
def runs(runs_folder, remembered):
    """Return the paper's runs of the default choice."""
    with remembered():
        return fetch_runs(every_case(DEFAULT), runs_folder, engine=1)
