"""Runs of mechanisms that share a reduced model."""

import dataclasses
import pickle
import sys
from types import FrameType
from typing import Any

import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.kinematics import branching
from scissordyn.kinematics.path import path_of

FREE = sd.Clearance(0.5e-3)
RUBBING = sd.Clearance(0.5e-3, friction=sd.LuGre(kinetic=0.05))


def array() -> sd.Mechanism:
    """An array with clearance at joint A, of parts that no other mechanism has."""
    return sd.scissor(units=2).with_clearance("A", FREE).driven(speed=sd.rpm(150))


def reductions(mechanism: sd.Mechanism) -> tuple[xr.Dataset, int]:
    """A run, and how many mechanisms were reduced for it."""
    counted = [0]

    def note(frame: FrameType, event: str, _: object) -> None:
        counted[0] += event == "call" and frame.f_code.co_name == "reduce_mechanism"

    sys.setprofile(note)
    try:
        run = sd.simulate(mechanism, until=0.02, samples=101)
    finally:
        sys.setprofile(None)
    return run, counted[0]


VARIATIONS = {
    "clearance": lambda known: known.replace("A.clearance", 0.2e-3),
    "laws": lambda known: known.with_clearance("A", sd.Clearance(0.3e-3, damping=sd.Flores(restitution=0.5))),
    "motion": lambda known: known.driven(sd.Harmonic(0.5236, 0.1, 60.0)),
    "gravity": lambda known: known.replace("gravity", 1.62),
}

OTHERS = {
    "friction": lambda known: known.with_clearance("A", RUBBING),
    "ideal": lambda known: known.ideal(),
    "joint": lambda known: known.with_clearance("unit 1/pivot", FREE),
    "mass": lambda known: known.replace("slider.mass", 7.0),
    "rod": lambda known: sd.constrain_contact(known),
    "component": lambda known: dataclasses.replace(known, components=(sd.Force("load", ("slider", "centre"), (10.0, 0.0)),)),
    "drive": lambda known: dataclasses.replace(known, drives=()),
}


@pytest.mark.parametrize("variation", VARIATIONS)
def test_a_variation_has_the_model_of_a_known_mechanism(variation: str) -> None:
    """Identity: bit for bit the run of the same mechanism that was read from elsewhere, without a reduction of its own."""
    known = array()
    sd.simulate(known, until=0.02, samples=101)
    varied = VARIATIONS[variation](known)
    elsewhere = pickle.loads(pickle.dumps(varied))
    (shared, none), (alone, one) = reductions(varied), reductions(elsewhere)
    assert (none, one) == (0, 1)
    shared.attrs["statistics"] = alone.attrs["statistics"]  # it has the time that was taken
    assert shared.identical(alone)


@pytest.mark.parametrize("other", OTHERS)
def test_what_enters_the_model_is_not_shared(other: str) -> None:
    """Identity: bit for bit the run of the same mechanism that was read from elsewhere."""
    known = array()
    sd.simulate(known, until=0.02, samples=101)
    changed = OTHERS[other](known)
    near, far = (reductions(each) for each in (changed, pickle.loads(pickle.dumps(changed))))
    assert near[1] >= 1
    near[0].attrs["statistics"] = far[0].attrs["statistics"]
    assert near[0].identical(far[0])


def test_singular_positions_are_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: the warnings of variations are those of mechanisms by themselves, another motion or end has its own."""
    followed = []

    def counted(*given: Any) -> Any:
        followed.append(given)
        return path_of(*given)

    monkeypatch.setattr(branching, "path_of", counted)
    known = sd.scissor(units=2, angle=sd.degrees(60)).with_clearance("A", FREE).driven(speed=sd.rpm(150))
    tight, rubbing = known.replace("A.clearance", 0.2e-3), known.with_clearance("A", RUBBING)
    fast = known.driven(speed=sd.rpm(250))
    asked = ((known, 0.04, 1), (tight, 0.04, 0), (rubbing, 0.04, 0), (fast, 0.04, 1), (known, 0.035, 1), (known, 0.04, 0))
    for mechanism, until, count in asked:
        before = len(followed)
        run = sd.simulate(mechanism, until=until, samples=201)
        assert len(followed) - before == count
        assert "change point at t = " in run.attrs["warnings"]
        alone = sd.simulate(pickle.loads(pickle.dumps(mechanism)), until=until, samples=201)
        assert run.attrs["warnings"] == alone.attrs["warnings"]


def test_equal_numbers_are_not_the_same_parts() -> None:
    """Identity: zeros of both signs are equal, and may show in a result."""
    known = array()
    sd.simulate(known, until=0.02, samples=101)
    assert reductions(array())[1] == 1
