"""Results that are computed when they are first read."""

import copy
import gc
import json
import pickle
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.casefile.configuration import write_configuration
from scissordyn.record.deferred import Attributes, Deferred
from scissordyn.record.warn import warnings_of
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.simulate import compute_results

UNTIL = 2e-3  # [s] end of the run


@pytest.fixture(scope="module")
def array():
    return sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", sd.Clearance(5e-4))


@pytest.fixture(scope="module")
def bent():
    arm = sd.scissor(units=2).driven(speed=sd.rpm(150))
    bending = sd.with_bending(arm, section="tube 60x60x1.56 mm", material="steel", modes=2)
    return bending.with_clearance("A", sd.Clearance(5e-4))


def attributes():
    return Attributes({"first": 1, "late": Deferred(lambda: "text", threading.RLock()), "last": 3})


COMPUTED = {"first": 1, "late": "text", "last": 3}  # Content of a mapping whose entries are computed when they are read


@pytest.mark.parametrize(
    "read",
    [
        dict,
        lambda found: {**found},
        lambda found: {} | found,
        lambda found: found | {},
        lambda found: dict(found.items()),
        lambda found: dict(zip(found, found.values(), strict=True)),
        lambda found: {name: found.get(name) for name in found},
        lambda found: {name: found.setdefault(name) for name in list(found)},
        lambda found: {name: found.pop(name) for name in list(found)},
        lambda found: dict(reversed([found.popitem() for _ in range(3)])),
        lambda found: found.copy(),
        copy.copy,
        copy.deepcopy,
        lambda found: pickle.loads(pickle.dumps(found)),
        lambda found: json.loads(json.dumps(found)),
        lambda found: found.with_values(),
        lambda found: eval(repr(found)),
    ],
)
def test_every_way_to_read_attributes_gives_the_computed_value(read):
    """Contract: deferred attributes are those of a dictionary, however they are read, in the same order."""
    found = read(attributes())
    assert found == COMPUTED
    assert list(found) == list(COMPUTED)


def test_attributes_that_are_absent_are_those_of_a_dictionary():
    """Contract: a missing name raises KeyError or gives the default."""
    found = attributes()
    assert found.get("none") is None
    assert found.get("none", 2) == 2
    assert found.pop("none", 2) == 2
    with pytest.raises(KeyError):
        found.pop("none")


def test_configuration_and_warnings_are_computed_when_they_are_read(array):
    """Contract: a run makes neither its text nor its warnings until they are read; then they are the usual ones."""
    run = sd.simulate(array, until=UNTIL)
    stored = dict.__getitem__
    assert all(isinstance(stored(run.attrs, name), Deferred) for name in ("configuration", "warnings", "warning_data"))
    assert run.attrs["configuration"] == write_configuration(array, sd.Options(UNTIL))
    assert json.loads(run.attrs["warnings"]) == [str(item) for item in warnings_of(run)]


def test_a_text_that_a_case_file_cannot_hold_is_refused_before_the_run():
    """Contract: a mechanism that cannot be written raises when it is simulated, not when its results are read."""
    rod = sd.Rod("rod", ("ground", "P"), ("bar", "end"), motion=sd.ConstantSpeed(0.1))
    bar = sd.bar("bar", length=0.4, mass=1.0, angle=0.3)
    pin = sd.Revolute("pin", ("bar", "start"), ("ground", "O"))
    lever = sd.Mechanism(bodies=(bar,), joints=(pin,), components=(rod,), ground=(("O", (0.0, 0.0)), ("P", (0.1, 0.6))))
    with pytest.raises(sd.InputError):
        sd.simulate(lever, until=UNTIL)


def test_changes_of_a_result_do_not_reach_others(array):
    """Contract: what a user writes into an array does not change results that are computed later."""
    run, changed = (sd.simulate(array, until=UNTIL) for _ in range(2))
    for name in ("position", "acceleration", "angle", "normal_force", "energy_residual", "peak_force"):
        changed[name].values[...] = 1e9
    for name in ("reaction", "joint_peak_force", "origin", "eccentricity"):
        np.testing.assert_array_equal(run[name], changed[name])
    assert run.attrs["warnings"] == changed.attrs["warnings"]


def test_the_order_of_reading_does_not_matter(array, bent):
    """Identity: results are the same bit for bit whatever is read first, and by several threads at once."""
    for mechanism in (array, bent):
        runs = [sd.simulate(mechanism, until=UNTIL, samples=101) for _ in range(3)]
        names = list(runs[0].variables)
        for name in names:
            runs[0][name].load()
        text = runs[1].attrs["warnings"]
        for name in reversed(names):
            runs[1][name].load()
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda variable: variable.values, runs[2].variables.values()))
        for run in runs[1:]:
            xr.testing.assert_identical(run.drop_attrs(), runs[0].drop_attrs())
            assert run.attrs["warnings"] == text


def test_deferred_variables_are_variables_of_xarray(array):
    """Contract: shape and type are known before the array; copies, pickles, selections and files hold the values."""
    run, read = (sd.simulate(array, until=UNTIL) for _ in range(2))
    for name in read.variables:
        values = read[name].values
        assert run[name].shape == values.shape
        assert run[name].dtype == values.dtype
    plain = xr.Dataset({str(name): (part.dims, part.values, part.attrs) for name, part in read.data_vars.items()}, read.coords)
    for made in (
        copy.copy,
        copy.deepcopy,
        lambda found: pickle.loads(pickle.dumps(found)),
        lambda found: found.isel(time=slice(9)),
    ):
        xr.testing.assert_identical(
            made(sd.simulate(array, until=UNTIL)).drop_attrs(deep=False), made(plain).drop_attrs(deep=False)
        )
    assert "array(" in str(sd.simulate(array, until=UNTIL)["reaction"])


def test_a_run_is_freed_with_its_last_reference(array, bent):
    """Contract: no part of a run refers to the run, so that its arrays are freed at once and not by the garbage collector."""
    gc.disable()
    try:
        for mechanism in (array, bent):
            results = compute_results(mechanism, sd.Options(UNTIL, samples=11))
            arrays = weakref.ref(results.variables["position"].values)
            run = as_dataset(results)
            del results
            assert arrays() is not None
            del run
            assert arrays() is None
    finally:
        gc.enable()
