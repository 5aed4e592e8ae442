"""Loads that wear bearings: friction energy and force by angle, from simulated cycles."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError, did_you_mean
from scissordyn.kinematics.closure import check_tables
from scissordyn.mechanics.monitored import BALANCED, TRACK_DEVIATION
from scissordyn.mechanics.worn_contact import LOAD_DIRECTIONS
from scissordyn.model.clearance import Clearance
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.wear import Wear
from scissordyn.plan.plan import plan
from scissordyn.record.ideal_path import IdealPath
from scissordyn.record.transmitted import force_peaks
from scissordyn.record.warn import Extremes
from scissordyn.run.advance.driver import Driver
from scissordyn.run.batch import Perturbed
from scissordyn.run.engine import outcomes
from scissordyn.run.ideal_path import can_deviate, ideal_path
from scissordyn.run.stops import stops
from scissordyn.run.trajectory import current_trajectory, make_driver, model_failure
from scissordyn.run.trajectory_warnings import stepping_warnings
from scissordyn.tolerance import CONVERGENCE_TOL
from scissordyn.warning import RunWarning, plain, warning


def with_coefficients(mechanism: Mechanism, coefficients: Mapping[str, float]) -> tuple[Mechanism, list[RunWarning]]:
    """Return a mechanism whose joints have the wear coefficient of their pair of materials, and warnings.

    The pair is 'journal/bearing'. Joints with a coefficient keep it. Joints that cannot wear are named in a warning.
    """
    used, warnings = set(), list[RunWarning]()
    for joint in mechanism.clearance_joints if coefficients else ():
        clearance = joint.clearance
        if clearance is None or clearance.wear is not None:
            continue
        pair = f"{clearance.surfaces.journal.name}/{clearance.surfaces.bearing.name}"
        try:
            clearance.check_worn(f"joint '{joint.name}'")
        except InputError:
            warnings.append(warning("unworn", joint.name))
            continue
        if pair not in coefficients:
            raise InputError(
                f"joint '{joint.name}': no wear coefficient for '{pair}'{did_you_mean(pair, coefficients)}",
                "one for each pair of materials 'journal/bearing'",
                f'coefficients = {{ "{pair}" = "1e-7 mm^3/(N m)" }}',
            )
        used.add(pair)
        mechanism = mechanism.with_clearance(joint.name, dataclasses.replace(clearance, wear=coefficients[pair]))
    warnings += [warning("unused coefficient", pair=pair) for pair in sorted(coefficients.keys() - used)]
    return mechanism, warnings


class WornSurface(NamedTuple):
    """Bearing or journal of a joint, with a contour."""

    joint: str
    side: str  # "bearing" or "journal"

    @property
    def label(self) -> str:
        """Name in results: that of the joint for its bearing."""
        return self.joint if self.side == "bearing" else f"{self.joint}/journal"

    @property
    def field(self) -> str:
        """Name of the field of `Clearance` with the contour."""
        return "contour" if self.side == "bearing" else "journal_contour"

    def contour(self, clearance: Clearance) -> tuple[float, ...]:
        """Return the depths in a clearance joint [m]; none if the surface is round."""
        depths: tuple[float, ...] = getattr(clearance, self.field)
        return depths


def worn_surfaces(mechanism: Mechanism) -> list[WornSurface]:
    """Return the surfaces of the clearance joints with a wear coefficient; a joint whose journal wears has two."""
    surfaces = []
    for joint in mechanism.clearance_joints:
        clearance = joint.clearance
        if isinstance(clearance, Clearance) and clearance.wears:
            clearance.check_worn(f"joint '{joint.name}'")
            surfaces.append(WornSurface(joint.name, "bearing"))
            if clearance.journal_wear is not None or clearance.journal_contour:
                surfaces.append(WornSurface(joint.name, "journal"))
    if not surfaces:
        raise InputError(
            "wear: no clearance joint has a coefficient of wear",
            "Archard's coefficient of at least one joint",
            'wear = "1e-7 mm^3/(N m)" in its [[clearance]]',
        )
    return surfaces


class Loads(NamedTuple):
    """Loads on worn surfaces in simulated cycles, one member per cycle, and the other results of these cycles."""

    energy: np.ndarray  # (members, surfaces, directions) integral of F_n |v_t| dt [J]
    moment: np.ndarray  # (members, surfaces, directions) integral of F_n^2 |v_t| dt [N J]
    cosine: np.ndarray  # (members, surfaces, directions) integral of F_n |v_t| cos(psi) dt [J]; 0 if only the bearing is worn
    sine: np.ndarray  # (members, surfaces, directions) the same with sin(psi) [J]
    peak: np.ndarray  # (members, surfaces) largest force [N]
    deviation: np.ndarray  # (members, tracks) largest deviation [m]
    warnings: tuple[RunWarning, ...] = ()

    def member(self, index: int) -> Self:
        """Return the loads of one simulated cycle."""
        return type(self)._make([*(part[index : index + 1] for part in self[: len(LOADS)]), ()])

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """Join loads of several cycles into one object with a member per cycle."""
        listed = list(parts)
        arrays = (np.concatenate([part[k] for part in listed]) for k in range(len(LOADS)))
        return cls._make([*arrays, tuple(item for part in listed for item in part.warnings)])

    def by_direction(self, surface: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return friction energy [J], mean force [N], and mean and half range of psi by direction, means over the members.

        Integration errors of short steps may give a direction a negative energy and its neighbour too much. The deficit is
        subtracted from the neighbours, so that the sum stays exact. The rotations psi are described by an even distribution
        with the same mean direction: of sin(range) / range for the length of the mean vector.
        """
        energy, moment, cosine, sine = (part[:, surface].mean(axis=0) for part in self[:4])
        for _ in range(LOAD_DIRECTIONS):
            deficit = np.minimum(energy, 0.0)
            if not deficit.any():
                break
            energy = np.maximum(energy, 0.0) + 0.5 * (np.roll(deficit, 1) + np.roll(deficit, -1))
        force = np.divide(moment, energy, out=np.zeros_like(energy), where=energy > 0.0)
        mean = float(moment.sum() / energy.sum()) if energy.sum() > 0.0 else 0.0
        length = np.divide(np.hypot(cosine, sine), energy, out=np.ones_like(energy), where=energy > 0.0)
        ranges = np.linspace(np.pi, 0.0, LOAD_DIRECTIONS)
        spread = np.interp(length, np.sinc(ranges / np.pi), ranges)
        return energy, np.where((force > 1e-3 * mean) & (force < 1e3 * mean), force, mean), np.arctan2(sine, cosine), spread

    @classmethod
    def columns(cls, states: Sequence[Self]) -> dict[str, Any]:
        """Return the loads of several states as variables of a Dataset; `from_row` is the inverse."""
        return {
            f"member_{name}": (
                ("state", "member", *dims),
                np.array([getattr(state, name) for state in states]),
                {"units": unit, "long_name": text},
            )
            for name, (dims, unit, text) in LOADS.items()
        }

    @classmethod
    def from_row(cls, row: xr.Dataset, warnings: Sequence[RunWarning]) -> Self:
        """Return the loads of one state from a Dataset that `columns` made."""
        return cls._make([*(row[f"member_{name}"].values for name in LOADS), tuple(warnings)])


_DIRECTIONS = ("joint", "direction")
LOADS = {
    "energy": (_DIRECTIONS, "J", "integral of normal force times slip speed in a cycle, by direction of the force"),
    "moment": (
        _DIRECTIONS,
        "N J",
        "integral of the squared normal force times slip speed in a cycle, by direction of the force",
    ),
    "cosine": (
        _DIRECTIONS,
        "J",
        "integral of energy times the cosine of the journal's rotation; 0 if only the bearing is worn",
    ),
    "sine": (_DIRECTIONS, "J", "integral of energy times the sine of the journal's rotation; 0 if only the bearing is worn"),
    "peak": (("joint",), "N", "largest force in a cycle"),
    "deviation": (("track",), "m", "largest deviation of the tracked point in a cycle"),
}
"""Dimensions, unit and meaning of the arrays of `Loads`."""


class CycleRunner:
    """Simulation of cycles of a mechanism with worn bearings."""

    def __init__(
        self, mechanism: Mechanism, options: Options, settings: Wear, surfaces: Sequence[WornSurface], period: float | None
    ) -> None:
        self.mechanism, self.settings, self.surfaces, self.period = mechanism, settings, surfaces, period
        periods = settings.settle + settings.members
        until = options.until if period is None else periods * period
        self.options = dataclasses.replace(options, until=until, samples=2)
        self.cycle_time = options.until if period is None else period
        self.cycles_each = settings.members if period is None else periods
        base = plan(mechanism)
        check_tables(base, until)
        self.ideal: IdealPath | None = None
        if mechanism.tracks and can_deviate(mechanism):
            self.ideal = ideal_path(base, self.options)

    def loads(self, depths: np.ndarray) -> Loads:
        """Simulate cycles with worn surfaces and return their loads; `depths` is the wear, shape (surfaces, angles) [m]."""
        mechanism = self.mechanism
        for surface, contour in zip(self.surfaces, depths, strict=True):
            clearance: Any = mechanism.joint(surface.joint).clearance
            worn = dataclasses.replace(clearance, **{surface.field: tuple(contour.tolist())})
            mechanism = mechanism.with_clearance(surface.joint, worn)
        if self.period is not None:
            return Loads.joined(self._cycles(mechanism, 0))
        members = range(self.settings.members)
        results = list(outcomes(None, partial(self._run, mechanism), members))
        for result in results:
            if result.error is not None:
                raise result.error
        ordered = sorted(results, key=lambda result: result.task)
        return Loads.joined(part for result in ordered if result.value is not None for part in result.value)

    def _run(self, mechanism: Mechanism, member: int) -> list[Loads]:
        return list(self._cycles(mechanism, member))

    def _cycles(self, mechanism: Mechanism, member: int) -> Iterator[Loads]:
        """Simulate from the start; yield the loads of each cycle after the settling cycles."""
        perturbed = Perturbed(member, CONVERGENCE_TOL)
        driver, prepared, _ = make_driver(plan(mechanism), self.options, perturb=partial(perturbed.start, member), loads=True)
        if self.ideal is not None:
            driver.compare_with(self.ideal.table, self.ideal.step)
        settle = 0 if self.period is None else self.settings.settle
        times = (
            [self.options.until]
            if self.period is None
            else [self.period * (k + 1) for k in range(settle + self.settings.members)]
        )
        for stop in stops(driver, times, self.options.most_steps):
            cause = stop.cause or model_failure(driver)
            if cause:
                raise ScissordynError(f"the simulated cycle stopped at t = {driver.time:.9g} s: {cause}")
            if stop.number >= settle:
                warnings = [*plain(prepared.warnings), *Extremes(driver.plan).add(current_trajectory(driver)).of_a_case()]
                if driver.stepping is not None:
                    warnings += stepping_warnings(driver.plan, driver.system, driver.stepping.statistics(driver.time))
                yield self._loads_of_cycle(driver, tuple(warnings))

    def _loads_of_cycle(self, driver: Driver, warnings: tuple[RunWarning, ...]) -> Loads:
        """Return the loads of the cycle that the driver has just finished."""
        totals, numbers = driver.state.total[BALANCED:].reshape(-1, LOAD_DIRECTIONS), driver.system.content.parameters.contact
        contacts = [contact.name for contact in driver.plan.contacts]
        parts = np.zeros((4, 1, len(self.surfaces), LOAD_DIRECTIONS))
        for row, surface in enumerate(self.surfaces):
            at = contacts.index(surface.joint)
            count = min(4, int(numbers["loads"][at]))
            first = int(numbers["loads"][:at].sum()) + (count if surface.side == "journal" else 0)
            parts[:count, 0, row] = totals[first : first + count]
        forces = force_peaks(current_trajectory(driver)).size
        peak = forces[driver.plan.places([surface.joint for surface in self.surfaces])]
        deviation = driver.peak["largest"][driver.rows(TRACK_DEVIATION)]
        if self.ideal is None:
            deviation = np.full(deviation.shape, np.nan)
        return Loads(parts[0], parts[1], parts[2], parts[3], peak[None], deviation[None].copy(), warnings)
