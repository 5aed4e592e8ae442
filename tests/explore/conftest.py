"""A case with two clearance joints, and a slider-crank."""

from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.casefile.code import Code

from .browser import CASE


@pytest.fixture
def case_file(tmp_path):
    """Return a case file with two clearance joints."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


@pytest.fixture
def case():
    """Return the case of that file."""
    pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")
    from scissordyn.explore.case import Case

    return Case("case.toml", CASE, Code(Path()))


@pytest.fixture(scope="session")
def crank():
    """Return a slider-crank with a clearance joint, which nothing drives."""
    return sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
