"""Measures: numbers that describe a run, accumulated by the time loop with located maxima, without histories.

They are read at the end from the integrator's event log, peaks and integrals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.equilibrium.bar_extremes import largest_along_bars
from scissordyn.equilibrium.statics import check_stroke, static_peaks
from scissordyn.errors import InputError, ScissordynError
from scissordyn.mechanics.monitored import (
    COMPONENT_FORCE,
    COUPLING_FORCE,
    DRIVE_TORQUE,
    INDENTATION,
    POWERS,
    PRESSURE_VELOCITY,
    TRACK_DEVIATION,
)
from scissordyn.mechanics.sample import Record
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.system import state_kept
from scissordyn.record.events import ENERGY_TERMS, accounts, peak_forces
from scissordyn.record.ideal_path import IdealPath
from scissordyn.record.internal_forces import bars_of
from scissordyn.record.track import PARTS, SETTLING, settling_times, tracked
from scissordyn.record.transmitted import force_peaks_together
from scissordyn.run.advance.driver import Driver
from scissordyn.run.deviation import deviation_parts
from scissordyn.run.trajectory import current_trajectory


class Ended:
    """Values that a driver has accumulated up to its current time."""

    def __init__(self, driver: Driver, path: IdealPath | None = None, options: Options | None = None) -> None:
        self.driver, self.ideal, self.options = driver, path, options
        self.plan, self.mechanism, self.time = driver.plan, driver.plan.mechanism, driver.time
        self.path = current_trajectory(driver)
        self.warnings: list[str] = []  # warnings that measures add to those of the run
        self.together: Sequence[Ended] = (self,)  # cases that ended together and are evaluated in one pass

    @cached_property
    def contacts(self) -> np.ndarray:
        """Return all contacts, in order of their starts."""
        return self.path.contacts

    def per_joint(self, value: Callable[[np.ndarray], float]) -> np.ndarray:
        """Return one value for each clearance joint and contact point, computed from its contacts."""
        return np.array([value(self.contacts[self.contacts["joint"] == j]) for j in range(len(self.plan.contacts))], float)

    def per_contact(self, values: np.ndarray) -> np.ndarray:
        """Append NaN for the contact points to the values of the clearance joints."""
        return np.append(values, np.full(len(self.plan.contacts) - values.size, math.nan))

    @cached_property
    def force_peaks(self) -> np.ndarray:
        """Return the largest forces of all joints and guides, then of welds [N]; NaN for a hard contact."""
        peaks = force_peaks_together([ended.path for ended in self.together])
        for ended, peak in zip(self.together, peaks, strict=True):
            ended.__dict__["force_peaks"] = peak.size
        return np.asarray(self.__dict__["force_peaks"])

    def largest_forces(self) -> np.ndarray:
        """Return the largest force of each contact, then of all ideal joints, guides and welds together [N].

        The force of a hard contact is NaN.
        """
        at = self.plan.places(contact.name for contact in self.plan.contacts)
        others = np.delete(self.force_peaks, at)
        finite = others[np.isfinite(others)]
        largest = [float(np.max(finite)) if finite.size else math.nan] * bool(others.size)
        return np.array([*self.force_peaks[at].tolist(), *largest], float)

    def reactions(self) -> np.ndarray:
        """Return the largest force of each joint and guide, then of each weld [N]; NaN for a hard contact."""
        points = len(self.mechanism.contact_points)
        joints = len(self.mechanism.joint_names) - points
        return np.delete(self.force_peaks, np.arange(joints, joints + points))

    def estimated_forces(self) -> np.ndarray:
        """Return the estimated largest force of each hard contact [N]; NaN for compliant contacts."""
        forces = np.full(len(self.plan.contacts), math.nan)
        for j in self.plan.hard_places:
            contacts = self.contacts[self.contacts["joint"] == j]
            struck = peak_forces(self.plan.clearances[j], contacts["struck"])
            forces[j] = np.max(np.fmax(struck, contacts["peak_normal_force"]), initial=0.0)
        return forces

    def durations(self, contacts: np.ndarray) -> np.ndarray:
        """Return the durations of contacts [s]; a contact that has not ended counts up to the present time."""
        return np.where(np.isnan(contacts["duration"]), self.time - contacts["start"], contacts["duration"])

    def peaks(self, kind: int) -> np.ndarray:
        """Return the largest values of one kind of monitored quantity."""
        return np.asarray(self.path.peaks(kind)["largest"])

    def root_mean_squares(self, kind: int) -> np.ndarray:
        """Return the root mean squares of one kind of monitored quantity up to now."""
        return self.path.root_mean_squares(kind)

    def current_values(self, kind: int) -> np.ndarray:
        """Return the current values of one kind of monitored quantity."""
        return np.asarray(self.driver.state.monitored[self.driver.rows(kind), 0])

    def deployment_time(self) -> float:
        """Return the time when the last latch locked [s]; infinite while a latch is open, NaN without latches."""
        model, log, mode = self.driver.system.content.model, self.path.log, self.driver.state.mode
        latches = model.component_guard[model.latch[:, 2]].tolist()
        locked = [float(log["time"][log["guard"] == guard][-1]) if mode[guard] == 1 else math.inf for guard in latches]
        return max(locked, default=math.nan)

    @cached_property
    def accounts(self) -> np.ndarray:
        """Return the energies in the order of `events.ENERGY_TERMS` [J]."""
        energies: np.ndarray = accounts(self.plan, self.driver.state.total[None], self.path.log, np.array([math.inf]))[0]
        return energies

    @cached_property
    def record(self) -> Record:
        """Return all recorded variables at the samples."""
        with state_kept(self.driver.system):
            return self.path.record()

    @cached_property
    def static_peaks(self) -> dict[str, float]:
        """Return the largest static forces and torques, by name."""
        assert self.options is not None
        return static_peaks(self.mechanism, self.options.until)

    @cached_property
    def bars(self) -> dict[str, np.ndarray]:
        """Return the largest absolute values along bars that bend, over all samples, by variable name."""
        undefined = np.flatnonzero(~np.all(np.isfinite(self.record.A), axis=1))
        if undefined.size:
            time = self.path.samples.time[undefined[0]]
            raise ScissordynError(f"stopped at t = {time:.9g} s: accelerations are not defined")
        largest = largest_along_bars(self.path, self.record)
        return {name: np.abs(variable.values) for name, variable in largest.items() if name != "bar"}

    @cached_property
    def deviation_parts(self) -> np.ndarray:
        """Return the parts of the deviation due to servos, bending and clearance, shape (parts, time, tracks) [m]."""
        if self.ideal is None or self.options is None:
            return np.full((len(PARTS), 1, len(self.plan.mechanism.tracks)), math.nan)
        at, time = tracked(self.plan, self.record.X), self.path.samples.time
        parts = deviation_parts(self.ideal, self.mechanism, self.options, time, at)
        return np.asarray(np.hypot(parts[..., 0], parts[..., 1]))


@dataclass(frozen=True)
class Measure:
    """Definition of a measure: one value of a run, or one value for each joint, drive or component."""

    units: str
    long_name: str
    dims: tuple[str, ...]  # () or the name of a dimension from `parts_of`
    value: Callable[[Ended], float | np.ndarray]  # returns a float, or an array along the dimension
    compares: bool = False  # True for a deviation from the commanded path, which is then computed too
    sampled: bool = False  # True if equally spaced samples are needed
    static: bool = False  # True if no run is needed
    recorded: bool = False  # True if the recorded ends of steps are needed
    attributes: Mapping[str, Any] = field(default_factory=dict)  # attributes of its variable, in addition or instead


def _bar_measure(quantity: str, units: str, text: str) -> Measure:
    about = f"largest {text} of each bar that bends, among the samples"
    return Measure(units, about, ("bar",), lambda ended: ended.bars[f"bar_largest_{quantity}"], sampled=True)


def _static_measure(dim: str, text: str, units: str, *kinds: str) -> Measure:
    """Return the measure of the largest static value of each part, named "KIND PART" or "KIND" in the results of statics."""

    def value(ended: Ended) -> np.ndarray:
        peaks = ended.static_peaks
        names = [[f"{kind} {part}" for kind in kinds] for part in parts_of(ended.mechanism)[dim]]
        if dim == "component":
            names = [_component_names(part) for part in ended.mechanism.components]
        sizes = [[peaks[name] for name in (*of_part, *kinds) if name in peaks] for of_part in names]
        return np.array([size[0] if size else math.nan for size in sizes], float)

    return Measure(units, f"largest {text} without inertia", (dim,), value, static=True)


def _component_names(part: Any) -> list[str]:
    """Return the names under which statics lists the output of a component; an actuator counts as a drive."""
    if isinstance(part, Actuator):
        return [f"drive torque {part.body}", "drive torque"]
    section = part.declaration.section.replace("_", " ")
    return [f"{section} {kind} {part.name}" for kind in ("force", "torque")]


def _energy_measure(name: str) -> Measure:
    place = ENERGY_TERMS.index(name)
    words = {"drive_work": "work of the drives", "load_work": "work of the loads", "motor_work": "work of the motors"}
    text = words.get(name, f"energy dissipated by {'dampers' if name == 'damper_loss' else 'contact ' + name.split('_')[0]}")
    return Measure("J", text, (), lambda ended: float(ended.accounts[place]))


def _contact_measure(units: str, text: str, value: Callable[[np.ndarray], float]) -> Measure:
    return Measure(units, text, ("joint",), lambda ended: ended.per_joint(value))


# Meaning of the measures of track deviation
_DEVIATION = "distance of a tracked point from its position on the commanded path of the rigid ideal mechanism"


def _track_measure(text: str, value: Callable[[Ended], np.ndarray], units: str = "m", *, sampled: bool = False) -> Measure:
    return Measure(units, text, ("track",), value, compares=True, sampled=sampled)


def _deviation_measure(number: int, at_end: bool) -> Measure:
    words = f"deviation of a tracked point due to {('servos', 'bars that bend', 'clearance')[number]}"

    def value(ended: Ended) -> np.ndarray:
        sizes = ended.deviation_parts[number]
        return np.asarray(sizes[-1] if at_end else sizes.max(axis=0))

    return _track_measure(words + (", at the end" if at_end else ", the largest among the samples"), value, sampled=True)


def _coupling_measure(dim: str) -> Measure:
    def value(ended: Ended) -> np.ndarray:
        constraints = ended.plan.coordinates.constraints
        linear = [constraint for constraint in constraints if constraint.linear]
        peaks = ended.peaks(COUPLING_FORCE)
        largest = {constraint.name: peak / constraint.scale for constraint, peak in zip(linear, peaks, strict=True)}
        return np.array([largest.get(name, math.nan) for name in parts_of(ended.mechanism)[dim]])

    words = "of couplings on their outputs" if dim == "coupling" else "of drives of coordinates"
    return Measure("N or N m", f"largest force [N] or torque [N m] {words}", (dim,), value)


# meaning of the measure `peak_force`
_FORCE = "largest force that a joint transmits: of each joint with clearance, and of all others together"
_REACTION = "largest force that a joint, a guide or a weld transmits"  # Meaning of the measure of joint reactions

# Meaning of the measure of normal forces in hard contacts
_HARD_FORCE = "estimated largest normal force in a hard contact; NaN for compliant ones"

# Meaning of the measures of the pressure-velocity product
_WEAR = "product of mean pressure F_n/(2 R_J L_b) and slip speed, NaN for contact points"
_JOINT, _DRIVE = ("joint",), ("drive",)

MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "peak_force": Measure("N", _FORCE, _JOINT, Ended.largest_forces, recorded=True),
        "peak_force_estimate": Measure("N", _HARD_FORCE, _JOINT, Ended.estimated_forces),
        "peak_reaction": Measure("N", _REACTION, ("transmitting",), Ended.reactions, recorded=True),
        "peak_approach_speed": _contact_measure(
            "m/s", "largest approach speed", lambda contacts: np.max(contacts["approach_speed"], initial=0.0)
        ),
        "contact_count": _contact_measure("1", "contacts", len),
        "contact_fraction": Measure(
            "1",
            "fraction of the time in contact",
            _JOINT,
            lambda e: e.per_joint(lambda contacts: sum(e.durations(contacts).tolist())) / e.time,
        ),
        "first_contact": _contact_measure(
            "s", "start of the first contact", lambda contacts: np.min(contacts["start"], initial=math.inf)
        ),
        "impulse": _contact_measure("N s", "impulse of the normal forces", lambda contacts: sum(contacts["impulse"].tolist())),
        "peak_pressure_velocity": Measure(
            "Pa m/s", f"largest {_WEAR}", _JOINT, lambda e: e.per_contact(e.peaks(PRESSURE_VELOCITY))
        ),
        "pressure_distance": Measure(
            "Pa m", f"integral of the {_WEAR}", _JOINT, lambda e: e.per_contact(e.path.peaks(PRESSURE_VELOCITY)["integral"])
        ),
        "peak_drive_torque": Measure("N m", "largest driving torque", _DRIVE, lambda e: e.peaks(DRIVE_TORQUE)),
        "rms_drive_torque": Measure(
            "N m", "root mean square of the driving torque", _DRIVE, lambda e: e.root_mean_squares(DRIVE_TORQUE)
        ),
        "peak_indentation": Measure("m", "largest indentation", _JOINT, lambda e: e.peaks(INDENTATION)),
        "peak_track_deviation": _track_measure(f"largest {_DEVIATION}", lambda e: e.peaks(TRACK_DEVIATION)),
        "rms_track_deviation": _track_measure(f"root mean square {_DEVIATION}", lambda e: e.root_mean_squares(TRACK_DEVIATION)),
        "end_track_deviation": _track_measure(f"{_DEVIATION} at the end", lambda e: e.current_values(TRACK_DEVIATION)),
        **{f"{part}_deviation": _deviation_measure(number, False) for number, part in enumerate(PARTS)},
        **{f"end_{part}_deviation": _deviation_measure(number, True) for number, part in enumerate(PARTS)},
        "settling_time": _track_measure(SETTLING, lambda e: settling_times(e.plan, e.path.bands(TRACK_DEVIATION), e.time), "s"),
        "deployment_time": Measure("s", "when the last latch has locked", (), Ended.deployment_time),
        "peak_component_force": Measure(
            "N or N m", "largest force [N] or torque [N m]", ("component",), lambda e: e.peaks(COMPONENT_FORCE)
        ),
        **{f"peak_{dim}_force": _coupling_measure(dim) for dim in ("coupling", "coordinate_drive")},
        "peak_bar_stress": _bar_measure("stress", "Pa", "stress in the extreme fibre"),
        "peak_utilisation": _bar_measure("utilisation", "1", "stress divided by the yield strength"),
        "peak_deflection": _bar_measure("deflection", "m", "distance from the line through the ends"),
        "peak_buckling_ratio": _bar_measure(
            "buckling_ratio", "1", "compression divided by the buckling compression of the mechanism with locked drives"
        ),
        "static_drive_torque": _static_measure("drive", "driving torque", "N m", "drive torque"),
        "static_rod_force": _static_measure("rod", "force of a rod", "N", "rod force"),
        "static_coordinate_drive_force": _static_measure(
            "coordinate_drive",
            "force or torque of the drive of a coordinate",
            "N or N m",
            *("coordinate drive force", "coordinate drive torque"),
        ),
        "static_coupling_force": _static_measure(
            "coupling", "force or torque of a coupling on its output", "N or N m", "coupling force", "coupling torque"
        ),
        "static_component_force": _static_measure("component", "force or torque of a component", "N or N m"),
        "static_reaction": _static_measure("ideal_joint", "reaction of a joint or guide, taken as ideal,", "N", "reaction"),
        "static_bar_stress": _static_measure("bar", "stress in the extreme fibre of a bar that bends", "Pa", "bar stress"),
        **{name: _energy_measure(name) for name in POWERS},
        "mass": Measure(
            "kg", "mass of all bodies", (), lambda e: float(sum(body.mass for body in e.mechanism.bodies)), static=True
        ),
        "steps": Measure("1", "integration steps", (), lambda e: float(e.driver.state.counts["steps"][0])),
        "end": Measure("s", "time reached", (), lambda e: e.time),
    }
)
"""Predefined measures of a run, by name."""


LOAD_UNIT = "N or N m"  # unit of measures that are forces at some parts and torques at others


def load_units(mechanism: Mechanism) -> dict[str, dict[str, str]]:
    """Return the unit of the load of each component, coupling and drive of a coordinate, by dimension and name.

    Results have it as coordinate ``component_unit``, ``coupling_unit`` or ``coordinate_drive_unit``.
    """
    loads = {"rad": "N m", "m": "N"}
    ports = {component.name: component.declaration.port for component in mechanism.components}
    return {
        "component": {name: port.outputs[0].unit if port.outputs else "1" for name, port in ports.items()},
        "coupling": {coupling.name: loads[coupling.output.unit] for coupling in mechanism.couplings},
        "coordinate_drive": {drive.name: loads[drive.coordinate.unit] for drive in mechanism.coordinate_drives},
    }


def unit_of(mechanism: Mechanism, measure: str, part: str) -> str:
    """Return the unit of a measure; of a load that of the part, "N or N m" without a part."""
    definition = MEASURES[measure]
    return load_units(mechanism)[definition.dims[0]].get(part, LOAD_UNIT) if definition.units == LOAD_UNIT else definition.units


IDEAL_JOINTS = "ideal joints"
"""Last label along the dimension "joint" of measures: all ideal joints, guides and welds together."""


def parts_of(mechanism: Mechanism) -> dict[str, list[str]]:
    """Return the names of a mechanism's parts along each dimension that a measure can have (`Measure.dims`)."""
    ideal = len(mechanism.ideal_joints) + len(mechanism.ideal_guides) + len(mechanism.welds)
    guides = len(mechanism.guides) - len(mechanism.ideal_guides)
    return {
        "joint": [*(contact.name for contact in mechanism.contacts), *[IDEAL_JOINTS] * bool(ideal + guides)],
        "transmitting": [part.name for parts in (mechanism.joints, mechanism.guides, mechanism.welds) for part in parts],
        "drive": [drive.body for drive in mechanism.drives],
        "component": [component.name for component in mechanism.components],
        "rod": [rod.name for rod in mechanism.rods],
        "ideal_joint": [*mechanism.ideal().joint_names],
        "coupling": [coupling.name for coupling in mechanism.couplings],
        "coordinate_drive": [drive.name for drive in mechanism.coordinate_drives],
        "track": [track.name for track in mechanism.tracks],
        "bar": [bar.name for bar in bars_of(mechanism)],
    }


BAR_PROPERTY = {
    "peak_bar_stress": "youngs_modulus",
    "static_bar_stress": "youngs_modulus",
    "peak_utilisation": "yield_strength",
}
"""Property that all bars need for a measure of stress or utilisation, by name of the measure."""


def check_measures(mechanism: Mechanism, measures: Mapping[str, Measure]) -> None:
    """Raise `InputError` if the mechanism lacks what a measure needs: a stroke, bars that bend, or a bar property."""
    if any(name.startswith("static_") for name in measures):
        check_stroke(mechanism)
    bars = bars_of(mechanism)
    for name in (name for name, measure in measures.items() if measure.dims == ("bar",)):
        if not bars:
            raise InputError(f"measure '{name}': the mechanism has no bars that bend", "bars that bend", "with_bending(...)")
        needed = BAR_PROPERTY.get(name, "")
        lacking = [bar.name for bar in bars if needed and not all(getattr(part, needed) for part in bar.parts)]
        if lacking:
            raise InputError(
                f"measure '{name}': bar '{lacking[0]}' has no {needed}", f"{needed} of every bar", f"{needed} = ..."
            )
