"""Warnings about a run: models outside their range, limits reached, energy errors; and their texts with explanations."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from scissordyn.components.declaration import Component
from scissordyn.components.port import Output
from scissordyn.control.tracking.pid import PID
from scissordyn.integrate.integration import RISE
from scissordyn.kinematics.closure import table_warnings
from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.elastic.persson import Persson
from scissordyn.laws.evaluate import elastic_forces
from scissordyn.laws.validity import LAW_SAMPLES, contact_failure, contact_warnings, loading_warnings
from scissordyn.mechanics.monitored import COMPONENT_FORCE, COMPONENT_OUTPUT, FRICTION_RATIO, FRICTION_RATIO_MAX, INDENTATION
from scissordyn.mechanics.system import COMPONENT_RESULTS_MAX
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan
from scissordyn.plan.rail import rail_axes
from scissordyn.plugin.element import pointers, row_of
from scissordyn.record.bars import mode_warnings
from scissordyn.record.coupling import coupling_warnings, flank_warnings
from scissordyn.record.film import MIXED_RATIO_MAX, film_peak_warnings, film_warnings
from scissordyn.record.results import Run, along
from scissordyn.record.sampling import time_mean
from scissordyn.tolerance import ASSEMBLY_TOL, EVENT_TOL, REPORTED_FRACTION
from scissordyn.warning import LISTED_MAX, RunWarning, group, line, plain, warning

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory


BALANCE_ENERGIES = (
    "kinetic_energy",
    "potential_energy",
    "elastic_energy",
    "stored_energy",
    "drive_work",
    "motor_work",
    "load_work",
)
"""Energies and works whose largest change is the reference for the energy error of a run."""


CARRIED_ERROR_MAX = 1e-6
"""[fraction of the largest energy] Energy error that is always accepted.

It matters for motions without exchange of energy, such as a freely rotating body.
"""

# [-] smallest ratio of a controller's torque to its limit at which the controller counts as limited
LIMIT_RATIO_MIN = 1.0 - EVENT_TOL


def run_warnings(plan: Plan, run: Run, immobile: Iterable[str]) -> list[RunWarning]:
    """Return the warnings that follow from the variables of a run; `Extremes` returns those that follow from largest values."""
    warnings = contact_failures(plan, run)
    for i, rod in enumerate(plan.rods):
        force, time = run["rod_force"].values[:, i], run["time"].values
        if rod.tension_only and np.min(force, initial=0.0) < 0.0:
            first, worst = int(np.argmax(force < 0.0)), int(np.argmin(force))
            warnings.append(warning("negative force", rod.name, first=time[first], force=force[worst], time=time[worst]))
    warnings += [warning("immobile", name, "clearance joint") for name in immobile] + flank_warnings(plan, run)
    warnings += _overstrained(run) + _buckled(run) + mode_warnings(plan, run) + _off_the_rail(plan, run) + _undetermined(run)
    warnings += _saturated(plan, run) + _gained(plan, run) + film_warnings(plan, run) + _impulses(run)
    return warnings + ([] if _stands_still(plan, run) else _unbalanced(run, stepped=bool(plan.hard_places)))


class Extremes:
    """Extreme values of contacts, friction and components over one or several trajectories, for warnings."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._speeds = dict[int, list[float]]()  # Approach speeds of each guard
        self._indentation = np.zeros(len(plan.contacts))
        self._contacts: list[np.ndarray] = []  # Joint, approach speed, effective mass and largest normal force of each contact
        self._friction = dict[int, tuple[float, float]]()  # Largest friction ratio, and time above its limit [s]
        self._effort = np.zeros(len(plan.components))
        self._outputs = dict[int, tuple[float, float]]()  # Largest value of each output, and its instant [s]

    def add(self, path: Trajectory) -> Self:
        """Add the extreme values of a trajectory."""
        log, count = path.log, len(self._indentation)
        for guard, speed in log[log["mode"] == RISE][["guard", "rate"]].tolist():
            self._speeds.setdefault(int(guard), []).append(speed)
        if count:
            table = path.contacts
            columns = ("joint", "approach_speed", "effective_mass", "peak_normal_force")
            self._contacts.append(np.stack([table[name].astype(float) for name in columns]))
            np.maximum(self._indentation, path.peaks(INDENTATION)["largest"], out=self._indentation)
        for joint, peak in zip(path.monitored(FRICTION_RATIO).tolist(), path.peaks(FRICTION_RATIO), strict=True):
            ratio, lasting = self._friction.get(joint, (0.0, 0.0))
            self._friction[joint] = max(ratio, float(peak["largest"])), lasting + float(peak["excess_time"])
        if self._effort.size:
            np.maximum(self._effort, path.peaks(COMPONENT_FORCE)["largest"][: self._effort.size], out=self._effort)
        for which, peak in zip(path.monitored(COMPONENT_OUTPUT).tolist(), path.peaks(COMPONENT_OUTPUT), strict=True):
            before = self._outputs.get(which, (0.0, math.nan))
            self._outputs[which] = max(before, (float(peak["largest"]), float(peak["largest_time"])), key=lambda pair: pair[0])
        return self

    def _output(self, i: int, name: str) -> tuple[float, float]:
        """Return the largest value of an output of component i, and its instant [s]."""
        first = next(output.first for output in self.plan.components[i].declaration.outputs_monitored if output.name == name)
        return self._outputs.get(i * COMPONENT_RESULTS_MAX + first, (0.0, math.nan))

    def warnings(self) -> list[RunWarning]:
        """Return warnings about contact laws, friction, films, components beyond their range, and couplings."""
        plan, warnings = self.plan, list[RunWarning]()
        table = np.concatenate([np.zeros((4, 0)), *self._contacts], axis=1)
        for j in plan.compliant_places:  # laws of hard contacts only serve an estimate
            laws, speeds, depth = plan.clearances[j], self._speeds.get(j, []), float(self._indentation[j])
            elements = laws.surfaces, laws.stiffness, laws.damping, laws.friction
            warnings += contact_warnings(plan.contacts[j].name, *elements, approach_speed=speeds, indentation=depth)
            here = dict(zip(("speed", "mass", "force"), table[1:, table[0] == j], strict=True))
            warnings += loading_warnings(plan.contacts[j].name, *elements[:3], laws.reference, **here)
        for i, part in [(i, part) for i, part in enumerate(plan.components) if part.declaration.contact]:
            speeds, (depth, time) = self._speeds.get(int(plan.model.component_guard[i]), []), self._output(i, "indentation")
            warnings += lawful_warnings(part, speeds, depth, time)
        for number, (ratio, lasting) in self._friction.items():
            if lasting > 0.0:
                name = plan.contacts[number].name
                warnings.append(warning("friction", name, ratio=ratio, limit=FRICTION_RATIO_MAX, seconds=lasting))
        for k, (joint, _, oil) in enumerate(plan.lubricated, len(plan.components) - len(plan.lubricated)):
            warnings += film_peak_warnings(joint.name, oil, *self._output(k, "pressure"))
        for i, part, output in beyond_outputs(plan):
            far, time = self._output(i, "beyond")
            if far > ASSEMBLY_TOL:
                warnings.append(warning("beyond", part.name, part.declaration.label, beyond=far, unit=output.unit, time=time))
        return warnings + coupling_warnings(plan.mechanism) + table_warnings(plan)

    def texts(self) -> list[str]:
        """Return the warnings about a run without samples as sentences, each once."""
        return list(dict.fromkeys(map(str, self.of_a_case())))

    def of_a_case(self) -> list[RunWarning]:
        """Return the warnings about a run without samples.

        Only runs with samples report singular positions, redundant joints and energy errors.
        """
        plan, warnings = self.plan, list[RunWarning]()
        for j in plan.compliant_places:
            failure = contact_failure(plan.contacts[j].name, plan.clearances[j].surfaces, float(self._indentation[j]))
            warnings += [warning("failed in a case", failure=failure)] if failure else []
        for number, part in plan.actuators:
            limit = getattr(part.controller, "limit", None)
            if limit is not None and self._effort[number] >= LIMIT_RATIO_MIN * limit:
                warnings.append(warning("at limit in a case", part.name, "actuator", limit=limit))
        for k, (joint, gap, oil) in enumerate(plan.lubricated, len(plan.components) - len(plan.lubricated)):
            least = gap.clearance - self._output(k, "eccentricity")[0]
            if least < MIXED_RATIO_MAX * oil.roughness:
                warnings.append(warning("thin film in a case", joint.name, roughness=oil.roughness, least=least))
        return warnings + self.warnings()


def lawful_warnings(part: Any, speeds: Sequence[float], depth: float, time: float) -> list[RunWarning]:
    """Return warnings about the laws of a component that is a contact, from its approach speeds and largest indentation."""
    elements, kind = (part.surfaces, part.stiffness, part.damping, part.friction), part.declaration.label
    # an edge without width is deepest at its axis, at the radius of the disc
    failure = contact_failure(part.name, part.surfaces, depth, kind, margin=REPORTED_FRACTION)
    failed = [warning("failed", time=time, failure=failure)] if failure else []
    return failed + contact_warnings(part.name, *elements, approach_speed=speeds, indentation=depth, kind=kind)


def contact_failures(plan: Plan, run: Run) -> list[RunWarning]:
    """Warn of joints whose indentation exceeds the journal's radius: their contact model has failed."""
    warnings = []
    names = [contact.name for contact in plan.contacts]
    for at, name, clearance in zip(plan.places(names), names, plan.clearances, strict=True):
        surfaces = clearance.surfaces
        failure = contact_failure(name, surfaces, float(run["peak_indentation"].values[at]))
        if failure:
            beyond = run["indentation"].values[:, at] > max(surfaces.journal_radius, surfaces.gap)
            largest = float(run["peak_indentation_time"].values[at])
            first = min(largest, run["time"].values[int(np.argmax(beyond))]) if beyond.any() else largest
            warnings.append(warning("failed", time=first, failure=failure))
    return warnings


def largest_energy_change(run: Run) -> float:
    """Return the largest change of an energy or work during a run [J]."""
    return _largest_energy(run, np.ptp)


def _largest_energy(run: Run, size: Callable[[np.ndarray], float]) -> float:
    """Return the largest magnitude of an energy or work [J]."""
    if not run.sizes["time"]:
        return 0.0
    return max((float(size(run[name].values)) for name in BALANCE_ENERGIES if name in run), default=0.0)


def _stands_still(plan: Plan, run: Run) -> bool:
    """Return True if no body moves by more than `ASSEMBLY_TOL` during the run."""
    if not run.sizes["time"]:
        return True
    motion = (run["position"].values, ASSEMBLY_TOL * plan.coordinates.size), (run["angle"].values, ASSEMBLY_TOL)
    return not any(np.any(np.ptp(part, axis=0) > least) for part, least in motion)  # point masses have the angle NaN


def _unbalanced(run: Run, *, stepped: bool) -> list[RunWarning]:
    """Warn of a run with an energy error, caused by its tolerances or by the step size of time stepping (`stepped`)."""
    residual = float(np.max(np.abs(run["energy_residual"].values), initial=0.0))
    turned_over = largest_energy_change(run)
    largest = _largest_energy(run, lambda energy: np.max(np.abs(energy)))
    if not residual > max(REPORTED_FRACTION * turned_over, CARRIED_ERROR_MAX * largest):
        return []
    share = f", {residual / turned_over:.2g} of the energy turned over" if turned_over > 0.0 else ""
    finer = "a shorter step" if stepped else "a smaller rtol and atol"
    return [warning("unbalanced", residual=residual, share=share, finer=finer)]


def _gained(plan: Plan, run: Run) -> list[RunWarning]:
    """Warn of negative dissipation, which the energy balance does not reveal because it includes the same force."""
    turned_over, warnings, time = largest_energy_change(run), list[RunWarning](), run["time"].values
    stores = any(clearance.damping.states for clearance in plan.clearances)
    for name, source in (("damping_loss", "the damping of a contact"), ("damper_loss", "a component")):
        loss = run[name].values
        # a damping law with states returns what it has stored, but not more
        gain = -loss if stores and name == "damping_loss" else np.maximum.accumulate(loss) - loss
        if float(np.max(gain, initial=0.0)) > REPORTED_FRACTION * turned_over:
            worst = int(np.argmax(gain))
            warnings.append(warning("gain", source=source, variable=name, gain=gain[worst], time=time[worst]))
    warnings += [
        warning("event gain", name=name, time=when, gain=-loss)
        for name, when, loss in _events(run, "loss")
        if -loss > CARRIED_ERROR_MAX * turned_over
    ]
    return warnings


def _impulses(run: Run) -> list[RunWarning]:
    """Warn of latches that lock while a drive prescribes the speed, so that the torque of the drive is infinite."""
    least = CARRIED_ERROR_MAX * largest_energy_change(run)
    return [
        warning("impulse", name, "latch", time=when, work=work)
        for name, when, work in _events(run, "drive_work")
        if abs(work) > least
    ]


def _events(run: Run, column: str) -> Iterable[tuple[str, float, float]]:
    """Yield name, instant and the value of `column` for each event of a component."""
    if f"event_{column}" not in run:
        return []
    return zip(*(run[f"event_{name}"].values.tolist() for name in ("name", "time", column)), strict=True)


def _saturated(plan: Plan, run: Run, reversals_max: float = 0.05) -> list[RunWarning]:
    """Warn of controllers that reach their torque limit, with the duration and the deviation from the reference.

    `reversals_max`: [-] A warning is given if a controller changes from one limit to the other in more than this fraction of
    the samples.
    """
    warnings = []
    for k, (_, part) in enumerate(plan.actuators):
        limit, size = getattr(part.controller, "limit", None), np.abs(run["control_torque"].values[:, k])
        if limit is None:
            continue
        if isinstance(part.controller, PID) and part.controller.ramp > 0.0 and part.reference is not None:
            warnings += _at_rising_limit(part, run["time"].values, size, run["control_error"].values[:, k])
        if not float(run["peak_control_torque"].values[k]) >= LIMIT_RATIO_MIN * limit:
            continue
        at = size >= LIMIT_RATIO_MIN * limit
        if not at.any():
            warnings.append(warning("at limit between samples", part.name, "actuator", limit=limit))
            continue
        time, kind, numbers = run["time"].values, "at limit, no reference", {}
        if part.reference is not None:
            kind = "at limit"
            numbers["behind"] = math.degrees(float(np.max(np.abs(run["control_error"].values[at, k]))))
        lasting = float(time_mean(at, time))
        warnings.append(warning(kind, part.name, "actuator", limit=limit, fraction=lasting, time=time[at][0], **numbers))
        reversals = int(np.sum(np.diff(np.sign(run["control_torque"].values[at, k])) != 0.0))
        if reversals > max(reversals_max * time.size, 2):
            warnings.append(warning("restless", part.name, "actuator", reversals=reversals))
    return warnings


def _at_rising_limit(part: Any, time: np.ndarray, size: np.ndarray, error: np.ndarray) -> list[RunWarning]:
    """Warn of a torque of absolute value `size` [N m] at a limit that still rises; at t = 0 the limit is zero."""
    ramp, limit = part.controller.ramp, part.controller.limit
    at = (time > 0.0) & (time < ramp) & (size >= LIMIT_RATIO_MIN * limit * time / ramp)
    if not at.any():
        return []
    behind = math.degrees(float(np.max(np.abs(error[at]))))
    return [warning("at rising limit", part.name, "actuator", limit=limit, ramp=ramp, time=time[at][-1], behind=behind)]


def _overstrained(run: Run, strain: float = 0.01) -> list[RunWarning]:
    """Warn of flexible bars with large strains or with stresses above the yield strength at the samples.

    `strain`: [-] Strain of a bar above which the linear material law is doubtful.
    """
    warnings = list[RunWarning]()
    if "beam_fibre_strain" not in run or not run.sizes["time"]:
        return warnings
    for name, limit, kind in (("beam_utilisation", 1.0, "yield"), ("beam_fibre_strain", strain, "strain")):
        values = along(run[name], "time", "beam")
        at, which = np.unravel_index(int(np.nanargmax(values)) if np.isfinite(values).any() else 0, values.shape)
        if values[at, which] > limit:
            beam, when = str(run["beam"].values[which]), run["time"].values[at]
            warnings.append(warning(kind, beam, "element", ratio=values[at, which], time=when))
    return warnings


def _buckled(run: Run) -> list[RunWarning]:
    """Warn of the bar whose compression exceeds its buckling load most."""
    if "bar_largest_buckling_ratio" not in run or not run.sizes["bar"]:
        return []
    ratio = run["bar_largest_buckling_ratio"].values
    b = int(np.argmax(ratio))
    if not ratio[b] >= 1.0:
        return []
    when = run["bar_largest_buckling_ratio_time"].values[b]
    return [warning("buckling", str(run["bar"].values[b]), "bar", ratio=ratio[b], time=when)]


def _off_the_rail(plan: Plan, run: Run) -> list[RunWarning]:
    """Warn of components that move beyond the end of their bar at the samples."""
    warnings = list[RunWarning]()
    for i, axis in rail_axes(plan.coordinates.natural.axes, plan.components).items():
        part = plan.components[i]
        section = part.declaration.section
        places = along(run[f"{section}_place"], section, "time")[run[section].values.tolist().index(part.name)]
        off = (places < 0.0) | (places > axis.bar.length)
        if off.any():
            when, bar = run["time"].values[int(np.argmax(off))], axis.bar.name.removesuffix("/beam")
            warnings.append(warning("off the rail", part.name, part.declaration.label, bar=bar, time=when))
    return warnings


def beyond_outputs(plan: Plan) -> list[tuple[int, Component, Output]]:
    """Return index, component and output "beyond" of components with a limited curve or stroke."""
    return [
        (i, part, output)
        for i, part in enumerate(plan.components)
        for output in part.declaration.outputs_monitored
        if output.name == "beyond"
    ]


def _undetermined(run: Run) -> list[RunWarning]:
    """Warn of reactions that are not determined, at all instants or only in aligned positions."""
    missing = np.isnan(run["reaction"].values).any(axis=2)
    if not missing.any():
        return []
    quoted = [f"'{name}'" for name in run["joint"].values[missing.any(axis=0)].tolist()]
    names = ", ".join(quoted[:LISTED_MAX] + ([f"{len(quoted) - LISTED_MAX} more"] if len(quoted) > LISTED_MAX else []))
    instants = missing.any(axis=1)
    if instants.all():
        return [warning("redundant joints", names=names)]
    first = run["time"].values[instants][0]
    return [warning("aligned", count=np.sum(instants), instants=instants.size, time=first, names=names)]


EXPLANATION_PREFIX = "that means: "  # First words of a line that explains the warning before it


def warnings_of(run: Run) -> list[RunWarning]:
    """Return the warnings of a run; those of a run saved by an earlier version have only a sentence."""
    data = run.attrs.get("warning_data")
    return plain(json.loads(run.attrs["warnings"])) if data is None else [RunWarning(**item) for item in json.loads(data)]


def warning_lines(warnings: list[RunWarning], mechanism: Mechanism | None = None) -> list[str]:
    """Return the lines of warnings; those on several similar parts are joined, and an explanation follows if there is one."""
    return [text for alike in group(warnings) for text in (line(alike), *_meaning(alike, mechanism))]


def _meaning(alike: list[RunWarning], mechanism: Mechanism | None) -> list[str]:
    """Return lines that explain what a warning means for the forces and how to change the mechanism."""
    if alike[0].kind == "fast":
        ratio, name = max((item.numbers["speed"] / item.numbers["limit"], item.part) for item in alike)
        # Surfaces that yield at a constant pressure p have F = 2 p a L with a = sqrt(2 R delta) and the energy (2/3) p L a^3/R:
        # F is proportional to v^(2/3), the force of an elastic line contact to v (Johnson 1985, Contact Mechanics, section
        # 11.5, for a sphere).
        over = ratio ** (1.0 / 3.0)
        factor = f"{100.0 * (over - 1.0):.0f} %" if over < 1.5 else f"a factor of {over:.2g}"
        return [
            f"{EXPLANATION_PREFIX}the computed force is an upper bound; where the surfaces yield it is too large by about "
            f"{factor} in the fastest contact, at '{name}'; a smaller clearance or a slower drive lowers the approach speeds"
        ]
    if alike[0].kind == "deep" and alike[0].numbers["size"] == "clearance" and mechanism is not None:
        part, name = max((item.numbers["fraction"], item.part) for item in alike)
        return _other_laws(mechanism, name, part)
    return []


def _other_laws(mechanism: Mechanism, name: str, part: float) -> list[str]:
    """Return a line that compares the force of the deepest impact at a joint with that of laws for large contact areas.

    `part` is the largest indentation as a fraction of the clearance. The laws are compared at equal elastic energy.
    """
    gap = next((joint.clearance for joint in mechanism.clearance_joints if joint.name == name), None)
    if gap is None:
        return []
    laws = Liu(), Persson()
    ratios = [force_at_equal_energy(gap.stiffness, law, gap.surfaces, part * gap.clearance) for law in laws]
    forces = " and ".join(f"{ratio:.2g} times the force by '{law.name}'" for ratio, law in zip(ratios, laws, strict=True))
    return [
        f"{EXPLANATION_PREFIX}for an impact of the same energy as the deepest one at '{name}', laws for large contact areas "
        f'give {forces}; the computed force is uncertain by this factor. Remedy: stiffness = "persson", or a larger clearance'
    ]


def force_at_equal_energy(law: Elastic, other: Elastic, contact: JointContact, indentation: float) -> float:
    """Return the ratio of the force by `other` to the force by `law`, at indentations with equal elastic energy.

    At the deepest point of an impact the energy is stored elastically; therefore laws are compared at equal energy.
    """
    depth = indentation * np.linspace(0.0, 1.0, LAW_SAMPLES)
    forces = _forces(law, contact, depth)
    energy = float(np.trapezoid(forces, depth))
    reach = indentation
    for _ in range(60):
        depth = reach * np.linspace(0.0, 1.0, LAW_SAMPLES)
        others = _forces(other, contact, depth)
        stored = np.concatenate([[0.0], np.cumsum(0.5 * (others[1:] + others[:-1]) * np.diff(depth))])
        if stored[-1] >= energy:
            break
        reach *= 2.0
    return float(np.interp(energy, stored, others)) / float(forces[-1])


def _forces(law: Elastic, contact: JointContact, depth: np.ndarray) -> np.ndarray:
    row, pointer = row_of(law, contact), pointers(law)["force"]
    return np.append(0.0, elastic_forces(pointer, depth[1:], row))
