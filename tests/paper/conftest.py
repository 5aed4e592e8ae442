"""The paper's runs, computed once."""

import pytest

from scissordyn_paper.cases import DEFAULT, every_case
from scissordyn_paper.runs import fetch_runs


@pytest.fixture(scope="session")
def runs_folder(tmp_path_factory):
    """Folder of the runs of the default choice."""
    return tmp_path_factory.mktemp("paper") / "runs"


@pytest.fixture(scope="session")
def runs(runs_folder):
    return fetch_runs(every_case(DEFAULT), runs_folder, engine=1)
