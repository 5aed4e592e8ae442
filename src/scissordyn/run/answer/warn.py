"""Warnings of a run: models outside their range, limits reached, balances that do not close."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.laws.evaluate import elastic_force
from scissordyn.laws.validity import contact_failure, contact_warnings
from scissordyn.mechanics.monitored import COMPONENT_FORCE, COMPONENT_OUTPUT, EXCEEDED, FRICTION_RATIO, INDENTATION
from scissordyn.mechanics.system import APPROACH_FLOOR, RESULTS
from scissordyn.plan.elastic_law import elastic_law
from scissordyn.plan.plan import Plan
from scissordyn.plan.rail import rail_axes
from scissordyn.run.advance.spacing import time_mean
from scissordyn.run.answer.bars import mode_warnings
from scissordyn.run.answer.film_range import film_peak_warnings, film_warnings
from scissordyn.run.results import Run, along

if TYPE_CHECKING:
    from scissordyn.run.advance.driver import Driver

TURNED_OVER = (
    "kinetic_energy",
    "potential_energy",
    "elastic_energy",
    "stored_energy",
    "drive_work",
    "motor_work",
    "load_work",
)
"""Energies whose change during a run is what its energy balance is compared with."""

UNBALANCED = 1e-3
"""Residual of the energy balance over the energy turned over above which a run has a warning. At the default tolerances it is
below 1e-6."""

CARRIED = 1e-6
"""Residual over the largest energy below which the balance closes however little energy is turned over: a body that rotates
freely carries energy and turns none over."""

DAMPED = 2.0
"""Largest force of a contact, over 1 + xi times that of its joint's deepest indentation, above which a run has a warning: up to
the speed at which a contact began F = F_el (1 + xi delta'/v) is at most 1."""

MOVED = 1e-9
"""Of the mechanism's size, and in rad: a mechanism that moves by less stands still, and its energies change by the errors that
default tolerances allow."""

LARGE_STRAIN = 0.01
"""Strain of a bar above which the model's linear law is no longer meant."""

AT_LIMIT = 1.0 - 1e-9
"""Torque over its limit above which a controller is at the limit."""

RESTLESS = 0.05
"""Changes of a controller from one limit to the other, as a part of the samples, above which they are said."""


def run_warnings(plan: Plan, run: Run, immobile: tuple[str, ...]) -> list[str]:
    """The warnings of a run, each once."""
    found = contact_failures(plan, run)
    touched, speed = _values(run, "contact_joint"), _values(run, "approach_speed")
    for number, joint in enumerate(plan.contacts):
        depth = float(_values(run, "peak_indentation")[plan.joint_names.index(joint.name)])
        found += _of_contact(plan, number, speed[touched == joint.name].tolist(), depth)
    found += _beyond_damping(plan, run)
    for i, rod in enumerate(plan.rods):
        force = _values(run, "rod_force")[:, i]
        if rod.tension_only and np.min(force, initial=0.0) < 0.0:
            first, worst = int(np.argmax(force < 0.0)), int(np.argmin(force))
            found.append(
                f"joint '{rod.name}': negative normal force from t = {run['time'].values[first]:.6g} s on (N falls to "
                f"{force[worst]:.6g} N at t = {run['time'].values[worst]:.6g} s); constrained contact is not possible there"
            )
    found += [
        f"clearance joint '{name}' cannot move: the rest of the mechanism is rigid there, so the clearance has no effect"
        for name in immobile
    ]
    found += _exceeded(run)
    found += _overstrained(run)
    found += _buckled(run)
    found += mode_warnings(plan, run)
    found += _off_the_rail(plan, run)
    found += _undetermined(run)
    found += _saturated(plan, run)
    found += _gained(run)
    found += film_warnings(plan, run)
    found += _impulses(run)
    if not _stands_still(plan, run):
        found += _unbalanced(run, stepped=bool(plan.hard_places))
    return list(dict.fromkeys(found))


class Extremes:
    """What contacts, friction and controllers have come to at most in one or more stretches of a run."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._speeds: list[list[float]] = [[] for _ in plan.contacts]
        self._indentation = np.zeros(len(plan.contacts))
        self._friction = dict[int, tuple[float, float]]()
        self._effort = np.zeros(len(plan.components))
        self._outputs = dict[int, float]()

    def add(self, driver: Driver) -> None:
        """Add what a driver has accumulated since it last began to count."""
        log, peak, count = driver.log, driver.peak, len(self._speeds)
        for guard, speed in log[(log["mode"] == RISE) & (log["guard"] < count)][["guard", "rate"]].tolist():
            self._speeds[int(guard)].append(speed)
        if count:
            np.maximum(self._indentation, peak["largest"][driver.rows(INDENTATION)], out=self._indentation)
        for row in driver.rows(FRICTION_RATIO).tolist():
            joint = int(driver.system.content.model.monitor[row - driver.state.mode.size, 1])
            ratio, lasting = self._friction.get(joint, (0.0, 0.0))
            self._friction[joint] = max(ratio, float(peak["largest"][row])), lasting + float(peak["excess_time"][row])
        if self._effort.size:
            np.maximum(self._effort, peak["largest"][driver.rows(COMPONENT_FORCE)[: self._effort.size]], out=self._effort)
        for row in driver.rows(COMPONENT_OUTPUT).tolist():
            which = int(driver.system.content.model.monitor[row - driver.state.mode.size, 1])
            self._outputs[which] = max(self._outputs.get(which, 0.0), float(peak["largest"][row]))

    def warnings(self) -> list[str]:
        """The warnings that follow, without samples: of contact laws, friction and controllers.

        Singular positions, redundant joints, and an energy balance that does not close are reported by single runs only.
        """
        plan, depth, found = self.plan, self._indentation.tolist(), list[str]()
        for number, joint in enumerate(plan.contacts):
            assert joint.clearance is not None
            hard = joint.clearance.contact == "hard"
            failed = "" if hard else contact_failure(joint.name, joint.clearance.surfaces, depth[number])
            found += [f"the contact model has failed: {failed}"] if failed else []
            found += _of_contact(plan, number, self._speeds[number], depth[number])
        for number, (ratio, lasting) in self._friction.items():
            if lasting > 0.0:
                found.append(_exceeding(plan.contacts[number].name, ratio, lasting))
        for number, part in plan.actuators:
            limit = getattr(part.controller, "limit", None)
            if limit is not None and self._effort[number] >= AT_LIMIT * limit:
                found.append(f"actuator '{part.name}': the controller reaches its limit of {limit:g} N m")
        if self._outputs:
            found += self._of_films()
        return list(dict.fromkeys(found))

    def _of_films(self) -> list[str]:
        plan, found = self.plan, list[str]()
        first = len(plan.components) - len(plan.lubricated)
        for k, (joint, gap, oil) in enumerate(plan.lubricated, first):
            outputs = plan.components[k].declaration.outputs_monitored
            largest = {each.name: self._outputs.get(k * RESULTS + each.first, 0.0) for each in outputs}
            found += film_peak_warnings(joint.name, oil, gap, largest)
        return found


def _of_contact(plan: Plan, number: int, speeds: list[float], depth: float) -> list[str]:
    joint = plan.contacts[number]
    assert joint.clearance is not None
    laws = joint.clearance
    if laws.contact == "hard":  # the laws serve an estimate only
        return []
    return contact_warnings(
        joint.name, laws.surfaces, laws.stiffness, laws.damping, laws.friction, approach_speed=speeds, indentation=depth
    )


def contact_failures(plan: Plan, run: Run) -> list[str]:
    """For each joint whose journal was pressed in by more than its radius: that its contact model has failed, and when."""
    found = []
    for joint in plan.contacts:
        assert joint.clearance is not None
        at = plan.joint_names.index(joint.name)
        text = contact_failure(joint.name, joint.clearance.surfaces, float(_values(run, "peak_indentation")[at]))
        if text:
            beyond = _values(run, "indentation")[:, at] > joint.clearance.surfaces.journal_radius
            largest = float(_values(run, "peak_indentation_time")[at])
            first = min(largest, _values(run, "time")[int(np.argmax(beyond))]) if beyond.any() else largest
            found.append(f"the contact model has failed, and the results from t = {first:.6g} s on are not valid: {text}")
    return found


def _beyond_damping(plan: Plan, run: Run) -> list[str]:
    """Contacts whose damping exerts more than their law gives up to the speed at which they began."""
    touched, speed, peak = (_values(run, name) for name in ("contact_joint", "approach_speed", "peak_normal_force"))
    found = []
    for joint in (plan.contacts[j] for j in plan.compliant_places):
        assert joint.clearance is not None
        own = np.flatnonzero(touched == joint.name)
        if not hasattr(joint.clearance.damping, "restitution") or not own.size:
            continue
        law, worst = elastic_law(joint.clearance), own[np.argmax(peak[own])]
        deepest = float(_values(run, "peak_indentation")[plan.joint_names.index(joint.name)])
        elastic = float(elastic_force(law.force, deepest, law.row))
        if peak[worst] > DAMPED * (1.0 + getattr(joint.clearance.damping, "factor", 0.0)) * elastic:
            slow = "from rest" if speed[worst] <= APPROACH_FLOOR else f"slowly, at {speed[worst]:.3g} m/s,"
            found.append(
                f"joint '{joint.name}': a contact that began {slow} reaches {peak[worst]:.4g} N, its joint's deepest "
                f"indentation gives {elastic:.4g} N: the rest is damping, whose law holds for speeds up to that at which a "
                "contact began; the force can be far too large: compare damping = 'none', or contact = 'hard'"
            )
    return found


def energy_turned_over(run: Run) -> float:
    """The largest change of an energy or work during a run [J]."""
    return (
        max((float(np.ptp(_values(run, name))) for name in TURNED_OVER if name in run.variables), default=0.0)
        if run.sizes["time"]
        else 0.0
    )


def _values(run: Run, name: str) -> np.ndarray:
    """The values of a variable; of a Dataset run[name] would make a DataArray with its coordinates."""
    return np.asarray(run.variables[name].values)


def _stands_still(plan: Plan, run: Run) -> bool:
    """Whether no body moves by more than `MOVED`."""
    if not run.sizes["time"]:
        return True
    motion = (_values(run, "position"), MOVED * plan.size), (_values(run, "angle"), MOVED)
    middle = run.sizes["time"] // 2
    if any(np.any(np.abs(part[middle] - part[0]) > least) for part, least in motion):  # most runs move, which is soon seen
        return False
    return not any(np.any(np.ptp(part, axis=0) > least) for part, least in motion)  # angles of point masses are no numbers


def _unbalanced(run: Run, *, stepped: bool) -> list[str]:
    """A run that gains or loses energy, by tolerances or, with hard contact, by steps of one length."""
    residual = float(np.max(np.abs(_values(run, "energy_residual")), initial=0.0))
    turned_over = energy_turned_over(run)
    largest = max(
        (float(np.max(np.abs(_values(run, name)), initial=0.0)) for name in TURNED_OVER if name in run.variables),
        default=0.0,
    )
    if not residual > max(UNBALANCED * turned_over, CARRIED * largest):
        return []
    share = f", {residual / turned_over:.2g} of the energy turned over" if turned_over > 0.0 else ""
    finer = "a shorter step" if stepped else "a smaller rtol and atol"
    return [f"the energy balance misses {residual:.3g} J{share}: the results are not accurate; try {finer}"]


def _gained(run: Run) -> list[str]:
    """Losses that are gains: the balance closes with them, as they are computed from the force that does the work."""
    turned_over, found, unseen = energy_turned_over(run), list[str](), "; the energy balance does not see it"
    for name, what in (("damping_loss", "the damping of a contact"), ("damper_loss", "a component")):
        loss = _values(run, name)
        gain = np.maximum.accumulate(loss) - loss
        if float(np.max(gain, initial=0.0)) > UNBALANCED * turned_over:
            worst = int(np.argmax(gain))
            when = run["time"].values[worst]
            found.append(f"{what} gives energy: {name} falls by {gain[worst]:.3g} J until t = {when:.6g} s{unseen}")
    if "event_loss" in run.variables:
        rows = zip(*(_values(run, f"event_{key}") for key in ("name", "time", "loss")), strict=True)
        found += [
            f"the event of '{name}' at t = {when:.6g} s gives {-loss:.3g} J{unseen}"
            for name, when, loss in rows
            if -loss > CARRIED * turned_over
        ]
    return found


def _impulses(run: Run) -> list[str]:
    """Latches that lock while a drive keeps its speed: its torque is no number there."""
    if "event_drive_work" not in run.variables:
        return []
    rows = zip(*(_values(run, f"event_{key}") for key in ("name", "time", "drive_work")), strict=True)
    least = CARRIED * energy_turned_over(run)
    return [
        f"latch '{name}' locks at t = {when:.6g} s by an impulse that the drives take up with {work:.3g} J; the largest "
        "driving torques do not contain it"
        for name, when, work in rows
        if abs(work) > least
    ]


def _saturated(plan: Plan, run: Run) -> list[str]:
    """Controllers at their limit, how long, and how far from their reference."""
    found = []
    for k, (_, part) in enumerate(plan.actuators):
        limit = getattr(part.controller, "limit", None)
        if limit is None or not float(_values(run, "peak_control_torque")[k]) >= AT_LIMIT * limit:
            continue
        at = np.abs(_values(run, "control_torque")[:, k]) >= AT_LIMIT * limit
        time = _values(run, "time")
        text = f"actuator '{part.name}': the controller is at its limit of {limit:g} N m "
        if at.any():
            text += f"for {float(time_mean(at, time)):.2g} of the run, first at t = {time[at][0]:.6g} s"
        else:
            text += "for less than the time between two samples"
        if part.reference is not None and at.any():
            behind = float(np.max(np.abs(_values(run, "control_error")[at, k])))
            text += f", and there up to {math.degrees(behind):.3g} deg from its reference"
        reversals = int(np.sum(np.diff(np.sign(_values(run, "control_torque")[at, k])) != 0.0))
        if reversals > max(RESTLESS * time.size, 2):
            text += (
                f"; between samples it changes from one limit to the other {reversals} times: its gains are too high for what "
                "it moves, or beside hard contact the step is too long (smaller gains, or compliant contact)"
            )
        found.append(text)
    return found


def _overstrained(run: Run) -> list[str]:
    """Where bars that bend leave small strains or their elastic range, at the samples."""
    found = list[str]()
    if "beam_fibre_strain" not in run or not run.sizes["time"]:
        return found
    for name, limit, text in (
        ("beam_utilisation", 1.0, "is stressed to {:.3g} times its yield strength: the bar stays elastic in the model"),
        ("beam_fibre_strain", LARGE_STRAIN, "has a strain of {:.3g}: the model is one of small strains"),
    ):
        values = along(run[name], "time", "beam")
        at, which = np.unravel_index(int(np.nanargmax(values)) if np.isfinite(values).any() else 0, values.shape)
        if values[at, which] > limit:
            where, when = run["beam"].values[which], float(run["time"].values[at])
            found.append(f"element '{where}' {text.format(values[at, which])} (t = {when:.6g} s)")
    return found


def _buckled(run: Run) -> list[str]:
    """The bar that is compressed most beyond what the mechanism bears."""
    if "bar_largest_buckling_ratio" not in run or not run.sizes["bar"]:
        return []
    ratio = run["bar_largest_buckling_ratio"].values
    b = int(np.argmax(ratio))
    if not ratio[b] >= 1.0:
        return []
    when = float(run["bar_largest_buckling_ratio_time"].values[b])
    return [
        f"bar '{run['bar'].values[b]}' is compressed to {ratio[b]:.3g} times the force at which the mechanism buckles with its "
        f"drives locked (t = {when:.6g} s)"
    ]


def _off_the_rail(plan: Plan, run: Run) -> list[str]:
    """What runs beyond the end of a bar, at the samples."""
    found = list[str]()
    for i, axis in rail_axes(plan.coordinates.natural.axes, plan.components).items():
        part = plan.components[i]
        section = part.declaration.section
        places = along(run[f"{section}_place"], section, "time")[run[section].values.tolist().index(part.name)]
        off = (places < 0.0) | (places > axis.bar.length)
        if off.any():
            when = float(run["time"].values[int(np.argmax(off))])
            bar = axis.bar.name.removesuffix("/beam")
            found.append(
                f"{part.declaration.label} '{part.name}' runs off the end of bar '{bar}' at t = {when:.6g} s, which goes on "
                "straight in the model"
            )
    return found


def _exceeded(run: Run) -> list[str]:
    """Bristles that give more friction than their law's static limit, how much and how long."""
    if "peak_friction_ratio" not in run:
        return []
    rows = zip(
        _values(run, "joint"),
        _values(run, "peak_friction_ratio"),
        _values(run, "friction_excess_time"),
        strict=True,
    )
    return [_exceeding(name, ratio, lasting) for name, ratio, lasting in rows if lasting > 0.0]


def _exceeding(name: str, ratio: float, lasting: float) -> str:
    return (
        f"joint '{name}': friction reaches {ratio:.3g} times the static limit of its law, and exceeds {EXCEEDED:g} times it "
        f"for {lasting:.3g} s; see bristle_damping and damping_speed"
    )


def _undetermined(run: Run) -> list[str]:
    """Reactions that are not determined, at all times or where bodies are aligned."""
    missing = np.isnan(_values(run, "reaction")).any(axis=2)
    if not missing.any():
        return []
    names = _some(_values(run, "joint")[missing.any(axis=0)].tolist())
    instants = missing.any(axis=1)
    if instants.all():
        return [f"there are redundant ideal joints; the reactions of {names} are not determined and are left out (NaN)"]
    return [
        f"at {np.sum(instants)} of {instants.size} instants, first at t = {run['time'].values[instants][0]:.6g} s, bodies are "
        f"aligned (a singular position): the reactions of {names} are not determined there and are left out (NaN)"
    ]


def _some(names: list[str], most: int = 6) -> str:
    quoted = [f"'{name}'" for name in names[:most]] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return ", ".join(quoted)
