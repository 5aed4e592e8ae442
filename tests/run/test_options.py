"""What `simulate` and `simulate_many` repeat of `Options`, because editors complete and check only what a signature holds."""

import dataclasses
import inspect

import pytest

from scissordyn.run.batch import simulate_many
from scissordyn.run.options import Options
from scissordyn.run.simulate import simulate

FIELDS = {field.name: field.default for field in dataclasses.fields(Options)}


@pytest.mark.parametrize("function", [simulate, simulate_many])
def test_keywords_have_names_order_and_defaults_of_the_options(function):
    """Contract: a keyword by an option's name has its default; the options stand in their order."""
    keywords = inspect.signature(function).parameters
    shared = [name for name in keywords if name in FIELDS]
    assert shared == [name for name in FIELDS if name in keywords]
    assert all(keywords[name].default == FIELDS[name] for name in shared if FIELDS[name] is not dataclasses.MISSING)


def test_simulate_has_every_option():
    """Contract: `simulate` takes every option."""
    assert set(FIELDS) <= set(inspect.signature(simulate).parameters)
