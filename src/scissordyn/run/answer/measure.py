"""Measures of a run: numbers that the loop has accumulated, with located maxima, so that no histories are needed.

They are read from what the integrator holds at the end: the event log, the peaks and the integrals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.mechanics.monitored import (
    COMPONENT_FORCE,
    COUPLING_FORCE,
    DRIVE_TORQUE,
    INDENTATION,
    JOINT_FORCE,
    POWERS,
    PRESSURE_VELOCITY,
    TRACK_DEVIATION,
    companions,
    oiled_contacts,
)
from scissordyn.mechanics.outputs import record
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.trajectory import reached
from scissordyn.run.answer.contacts import Contact, contacts
from scissordyn.run.answer.dataset import largest_along_bars
from scissordyn.run.answer.events import ACCOUNTS, accounts
from scissordyn.run.answer.internal_forces import bars_of
from scissordyn.run.answer.peak_estimate import peak_forces
from scissordyn.run.answer.track import SETTLING, settling_times
from scissordyn.run.options import Options
from scissordyn.run.start.ideal_path import PARTS, IdealPath, deviation_parts


class Ended:
    """What a driver has accumulated up to now."""

    def __init__(self, driver: Driver, path: IdealPath | None = None, options: Options | None = None) -> None:
        self.driver, self.path, self.options = driver, path, options
        self.plan = driver.plan
        self.mechanism = driver.plan.mechanism
        self.time = driver.time

    @cached_property
    def contacts(self) -> list[Contact]:
        """All contacts in order of their starts."""
        model = self.driver.system.content.model
        return contacts(self.driver.log, self.driver.peak, companions(model)[: len(self.plan.contacts)])

    @cached_property
    def by_joint(self) -> list[list[Contact]]:
        """The contacts of each clearance joint and contact point."""
        contacts: list[list[Contact]] = [[] for _ in self.plan.contacts]
        for contact in self.contacts:
            contacts[contact.joint].append(contact)
        return contacts

    def per_joint(self, value: Callable[[list[Contact]], float]) -> np.ndarray:
        """A number from the contacts of each clearance joint and contact point."""
        return np.array([value(contacts) for contacts in self.by_joint], float)

    def largest_forces(self) -> np.ndarray:
        """Largest force of each joint: normal force, friction and film together [N]; NaN for a hard contact."""
        forces = self.per_joint(lambda contacts: max((c.peak_force for c in contacts), default=0.0))
        forces[self.plan.hard_places] = math.nan
        forces[oiled_contacts(self.driver.system.content.model)] = self.peaks(JOINT_FORCE)
        return forces

    def estimated_forces(self) -> np.ndarray:
        """Estimated largest force of each hard contact [N]; NaN for compliant ones."""
        forces = np.full(len(self.plan.contacts), math.nan)
        for j in self.plan.hard_places:
            contacts, clearance = self.by_joint[j], self.plan.contacts[j].clearance
            assert clearance is not None
            numbers = np.array([(c.struck, c.peak_normal_force) for c in contacts]).reshape(-1, 2)
            forces[j] = np.max(np.fmax(peak_forces(clearance, numbers[:, 0]), numbers[:, 1]), initial=0.0)
        return forces

    def lasting(self, contact: Contact) -> float:
        """Duration of a contact, up to now if it goes on [s]."""
        return self.time - contact.start if math.isnan(contact.duration) else contact.duration

    def peaks(self, kind: int) -> np.ndarray:
        """Largest values of one kind of monitored quantity."""
        return np.asarray(self.driver.peak["largest"][self.rows(kind)])

    def root_mean_squares(self, kind: int) -> np.ndarray:
        """Over the time up to now."""
        return np.asarray(np.sqrt(self.driver.peak["square"][self.rows(kind)] / self.time))

    def at_end(self, kind: int) -> np.ndarray:
        """One kind of monitored quantity now."""
        return np.asarray(self.driver.state.monitored[self.rows(kind), 0])

    def settled(self) -> np.ndarray:
        """From when on the tracked points stay within their tolerances [s]."""
        guards = self.driver.state.mode.size
        return settling_times(self.plan, self.driver.band[self.rows(TRACK_DEVIATION) - guards], self.time)

    def deployed(self) -> float:
        """When the last latch has locked [s]; infinite while one is open, NaN without latches."""
        log = self.driver.log
        locked = [
            float(log["time"][log["guard"] == guard][-1]) if self.driver.state.mode[guard] == 1 else math.inf
            for guard in self._latches
        ]
        return max(locked, default=math.nan)

    @cached_property
    def accounts(self) -> np.ndarray:
        """Along `events.ACCOUNTS` [J]."""
        driver = self.driver
        energies: np.ndarray = accounts(self.plan, driver.state.total[None], driver.log, np.array([math.inf]))[0]
        return energies

    @cached_property
    def bars(self) -> dict[str, np.ndarray]:
        """Sizes of `bar_largest_...`, by name, of a run with samples."""
        return along_bars(self.driver)

    @cached_property
    def deviation_parts(self) -> np.ndarray:
        """Sizes of what servos, bending and clearance add to deviations at the samples, shape (parts, time, tracks) [m]."""
        if self.path is None or self.options is None:
            return np.full((len(PARTS), 1, len(self.plan.tracks)), math.nan)
        state = self.driver.system.content.state
        before = [part.copy() for part in state]
        run = reached(self.driver)
        rows = record(run.plan.maps, run.system, run.samples).X
        for part, kept in zip(state, before, strict=True):
            part[...] = kept
        at = np.stack([run.plan.coordinates.tracked(track).at(rows) for track in self.plan.tracks], axis=1)
        parts = deviation_parts(self.path, self.mechanism, self.options, run.samples.time, at)
        return np.asarray(np.hypot(parts[..., 0], parts[..., 1]))

    @cached_property
    def _latches(self) -> list[int]:
        """Guards of the latches."""
        model = self.driver.system.content.model
        return [int(model.component_guard[component]) for component in model.latch[:, 2]]

    def rows(self, kind: int) -> np.ndarray:
        """Rows of the peaks of one kind of monitored quantity."""
        return self.driver.rows(kind)


@dataclass(frozen=True)
class Measure:
    """A number, or one for each joint, drive or component."""

    units: str
    long_name: str
    dims: tuple[str, ...]  # (), ("joint",), ("drive",), ("component",), ("track",) or ("bar",)
    value: Callable[[Ended], float | np.ndarray]  # From an `Ended` to a float or an array along the dimension
    compares: bool = False  # Whether it is a deviation from the commanded path, which is then computed too
    sampled: bool = False  # Whether it needs equally spaced samples


def _of_bars(units: str, quantity: str, text: str) -> Measure:
    about = f"largest {text} of each bar that bends, among the samples"
    return Measure(units, about, ("bar",), lambda ended: ended.bars[f"bar_largest_{quantity}"], sampled=True)


def _energy(name: str) -> Measure:
    place = ACCOUNTS.index(name)
    words = {"drive_work": "work of the drives", "load_work": "work of the loads", "motor_work": "work of the motors"}
    text = words.get(name, f"energy dissipated by {'dampers' if name == 'damper_loss' else 'contact ' + name.split('_')[0]}")
    return Measure("J", text, (), lambda ended: float(ended.accounts[place]))


_JOINT, _TRACK = ("joint",), ("track",)

_APART = "distance of a tracked point from where it is on the commanded path of the rigid ideal mechanism"


def _of_deviation(number: int, at_end: bool) -> Measure:
    words = f"what {('servos', 'bars that bend', 'clearance')[number]} add to the deviation of a tracked point"

    def value(ended: Ended) -> np.ndarray:
        sizes = ended.deviation_parts[number]
        return np.asarray(sizes[-1] if at_end else sizes.max(axis=0))

    place = ", at the end" if at_end else ", the largest among the samples"
    return Measure("m", words + place, _TRACK, value, compares=True, sampled=True)


def _of_couplings(dim: str) -> tuple[str, Measure]:
    def value(ended: Ended) -> np.ndarray:
        constraints = ended.plan.coordinates.constraints
        numbers = [k for k, constraint in enumerate(constraints) if constraint.linear]
        largest = {
            constraints[k].name: peak / constraints[k].scale
            for k, peak in zip(numbers, ended.peaks(COUPLING_FORCE), strict=True)
        }
        return np.array([largest.get(name, math.nan) for name in parts_of(ended.mechanism)[dim]])

    words = "of couplings on their outputs" if dim == "coupling" else "of drives of coordinates"
    return f"peak_{dim}_force", Measure("N or N m", f"largest force [N] or torque [N m] {words}", (dim,), value)


MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "peak_force": Measure(
            "N",
            "largest force that a joint transmits: normal force, friction and film together",
            _JOINT,
            lambda e: e.largest_forces(),
        ),
        "peak_force_estimate": Measure(
            "N",
            "estimated largest normal force in a hard contact; NaN for compliant ones",
            _JOINT,
            lambda e: e.estimated_forces(),
        ),
        "peak_approach_speed": Measure(
            "m/s",
            "largest approach speed",
            _JOINT,
            lambda e: e.per_joint(lambda contacts: max((c.approach_speed for c in contacts), default=0.0)),
        ),
        "contact_count": Measure("1", "contacts", _JOINT, lambda e: e.per_joint(len)),
        "contact_fraction": Measure(
            "1",
            "fraction of the time in contact",
            _JOINT,
            lambda e: e.per_joint(lambda contacts: sum(map(e.lasting, contacts))) / e.time,
        ),
        "first_contact": Measure(
            "s",
            "start of the first contact",
            _JOINT,
            lambda e: e.per_joint(lambda contacts: contacts[0].start if contacts else math.inf),
        ),
        "impulse": Measure(
            "N s",
            "impulse of the normal forces",
            _JOINT,
            lambda e: e.per_joint(lambda contacts: sum(c.impulse for c in contacts)),
        ),
        "peak_pressure_velocity": Measure(
            "Pa m/s",
            "largest product of mean pressure F_n/(2 R_J L_b) and slip speed, NaN for contact points",
            _JOINT,
            lambda e: _padded(e.peaks(PRESSURE_VELOCITY), len(e.plan.contacts)),
        ),
        "peak_drive_torque": Measure("N m", "largest driving torque", ("drive",), lambda e: e.peaks(DRIVE_TORQUE)),
        "rms_drive_torque": Measure(
            "N m", "root mean square of the driving torque", ("drive",), lambda e: e.root_mean_squares(DRIVE_TORQUE)
        ),
        "peak_indentation": Measure("m", "largest indentation", _JOINT, lambda e: e.peaks(INDENTATION)),
        "peak_track_deviation": Measure("m", f"largest {_APART}", _TRACK, lambda e: e.peaks(TRACK_DEVIATION), True),
        "rms_track_deviation": Measure(
            "m", f"root mean square {_APART}", _TRACK, lambda e: e.root_mean_squares(TRACK_DEVIATION), True
        ),
        "end_track_deviation": Measure("m", f"{_APART} at the end", _TRACK, lambda e: e.at_end(TRACK_DEVIATION), True),
        **{f"{part}_deviation": _of_deviation(number, False) for number, part in enumerate(PARTS)},
        **{f"end_{part}_deviation": _of_deviation(number, True) for number, part in enumerate(PARTS)},
        "settling_time": Measure("s", SETTLING, _TRACK, lambda e: e.settled(), True),
        "deployment_time": Measure("s", "when the last latch has locked", (), lambda e: e.deployed()),
        "peak_component_force": Measure(
            "N or N m", "largest force [N] or torque [N m]", ("component",), lambda e: e.peaks(COMPONENT_FORCE)
        ),
        **dict(_of_couplings(dim) for dim in ("coupling", "coordinate_drive")),
        "peak_bar_stress": _of_bars("Pa", "stress", "stress in the extreme fibre"),
        "peak_utilisation": _of_bars("1", "utilisation", "stress over the yield strength"),
        "peak_deflection": _of_bars("m", "deflection", "distance from the line through the ends"),
        "peak_buckling_ratio": _of_bars(
            "1", "buckling_ratio", "compression over that at which the mechanism buckles, drives locked"
        ),
        **{name: _energy(name) for name in POWERS},
        "mass": Measure("kg", "mass of all bodies", (), lambda e: float(sum(body.mass for body in e.mechanism.bodies))),
        "steps": Measure("1", "integration steps", (), lambda e: float(e.driver.state.counts["steps"][0])),
        "end": Measure("s", "time reached", (), lambda e: e.time),
    }
)
"""Measures by name."""


COMPONENT_UNIT = "component_unit"
"""Coordinate of results: the unit of what each component exerts."""


def component_units(mechanism: Mechanism) -> dict[str, str]:
    """The unit of what each component exerts, as its port declares it."""
    ports = {component.name: component.declaration.port for component in mechanism.components}
    return {name: port.outputs[0].unit if port.outputs else "1" for name, port in ports.items()}


def parts_of(mechanism: Mechanism) -> dict[str, list[str]]:
    """Names along the dimensions of measures."""
    return {
        "joint": [contact.name for contact in mechanism.contacts],
        "drive": [drive.body for drive in mechanism.drives],
        "component": [component.name for component in mechanism.components],
        "coupling": [coupling.name for coupling in mechanism.couplings],
        "coordinate_drive": [drive.name for drive in mechanism.coordinate_drives],
        "track": [track.name for track in mechanism.tracks],
        "bar": [bar.name for bar in bars_of(mechanism)],
    }


def _padded(values: np.ndarray, count: int) -> np.ndarray:
    full = np.full(count, math.nan)
    full[: values.size] = values
    return full


NEEDED = {"peak_bar_stress": "youngs_modulus", "peak_utilisation": "yield_strength"}
"""What bars have to know for a measure."""


def check_bars(mechanism: Mechanism, measures: Mapping[str, Measure]) -> None:
    """Raise `InputError` for a measure of bars that bend where none does, or where one lacks a number."""
    bars = bars_of(mechanism)
    for name in (name for name, measure in measures.items() if measure.dims == ("bar",)):
        if not bars:
            raise InputError(f"measure '{name}' of a mechanism without bars that bend", "bars that bend", "with_bending(...)")
        needed = NEEDED.get(name, "")
        lacking = [bar.name for bar in bars if needed and not all(getattr(part, needed) for part in bar.parts)]
        if lacking:
            raise InputError(
                f"measure '{name}': bar '{lacking[0]}' has no {needed}", f"a {needed} of every bar", f"{needed} = ..."
            )


def along_bars(driver: Driver) -> dict[str, np.ndarray]:
    """Sizes of the largest values along bars that bend, among the samples of a driver, each of shape (bars,)."""
    state = driver.system.content.state
    before = [part.copy() for part in state]
    path = reached(driver)
    outputs = record(path.plan.maps, path.system, path.samples)
    for part, kept in zip(state, before, strict=True):
        part[...] = kept
    undefined = np.flatnonzero(~np.all(np.isfinite(outputs.A), axis=1))
    if undefined.size:
        raise ScissordynError(f"stopped at t = {path.samples.time[undefined[0]]:.9g} s: accelerations are not defined")
    return {name: np.abs(variable.values) for name, variable in largest_along_bars(path, outputs).items() if name != "bar"}
