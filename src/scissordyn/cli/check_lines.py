"""Lines of text that ``scissordyn check`` and ``preview`` print about a case."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scissordyn.casefile.case import Case
from scissordyn.casefile.part import coordinate_words, coupling_lines
from scissordyn.casefile.quantity import rounded_text
from scissordyn.casefile.time_function import units_of
from scissordyn.cli.output import ROWS_MAX
from scissordyn.components.actuator import Actuator
from scissordyn.components.place import GROUND
from scissordyn.components.time_function import ConstantSpeed, Polynomial, Tabulated, TimeFunction
from scissordyn.config.file import read_case
from scissordyn.equilibrium.statics import rotations, static_peaks
from scissordyn.errors import InputError, ScissordynError, command
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.kinematics.closure import check_tables, table_warnings
from scissordyn.kinematics.path import DriveInertia, drive_inertia, instants, path_of, smooth_peak
from scissordyn.kinematics.singular import LOCKING_KIND
from scissordyn.model.check import loose_bodies
from scissordyn.model.clearance import hard_numbers
from scissordyn.model.commanded import commanded, rigid, with_rotors
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.wear import Wear
from scissordyn.plan.plan import Plan, plan
from scissordyn.record.coupling import coupling_warnings
from scissordyn.record.results import Results, Run
from scissordyn.record.sampling import time_mean
from scissordyn.record.summary import summary_of
from scissordyn.record.warn import warning_lines, warnings_of
from scissordyn.run.bristle_recoil import recoil_warnings
from scissordyn.run.ideal import IDEAL_SAMPLES
from scissordyn.run.sample_memory import check_samples
from scissordyn.run.simulate import compute_results
from scissordyn.run.trajectory import make_driver
from scissordyn.tolerance import ASSEMBLY_TOL, DATA_TOL
from scissordyn.units import counted, short

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.components.declaration import Component
    from scissordyn.studies.compute.convergence import Convergence


def check_lines(case: Path, changes: Sequence[str], converge: str | None, modes: bool) -> tuple[list[str], dict[str, Any]]:
    """Return mechanism, drives, clearances, method and warnings of a case, as lines and as plain data."""
    read = read_case(case, changes)
    mechanism, until = read.mechanism, read.run.until
    planned = plan(mechanism)
    check_tables(planned, until)
    check_samples(planned, read.run.count)
    driver, start, choice = make_driver(planned, read.run)

    rods: tuple[Any, ...] = mechanism.rods  # for type checkers, which do not see that rods are components
    components: tuple[Component, ...] = (*planned.acting, *rods)
    lines = [f"{case} is complete and can be assembled.", *_parts(planned, components)]
    ideal = _ideal(mechanism, until, 2)
    span, impossible = (None, ideal) if isinstance(ideal, str) else (summary_of(ideal).span, "")
    inertia = None if impossible else _inertia(mechanism, until)
    lines += [] if span is None else [f"{span} (ideal joints)".replace(". (", " (") + "."]
    lines += [] if inertia is None else [f"Inertia about {inertia.drive}: {inertia} (ideal joints)."]
    followed = commanded(mechanism)
    exact = "" if followed is mechanism else _ideal(rigid(followed), until, IDEAL_SAMPLES)
    servos = [] if isinstance(exact, str) else servo_demands(mechanism, followed, exact)
    lines += map(str, servos)
    method = choice.method if read.run.method != "auto" else f"{choice.method} ({choice.reason})"
    lines.append(f"Run: {short(until, 's')}, {read.run.start} start, {read.run.samples} samples, {method}.")
    warnings = [
        *start.warnings,
        *loose_bodies(mechanism),
        *map(str, coupling_warnings(mechanism) + table_warnings(planned)),
        *map(str, recoil_warnings(planned, driver.system, [(0.0, start.y)])),
        *drive_warnings(planned, until),
        *[f"without clearance: {impossible}"] * bool(impossible),
    ]
    lines += [f"Warning: {text}." for text in warnings]
    converged = None
    if converge is not None:
        from scissordyn.studies.compute.convergence import convergence, read_wanted  # with scipy and xarray

        response, within = read_wanted(converge)
        converged = convergence(mechanism, read.run, response, within=within, over="modes" if modes else "accuracy")
        lines += converged_lines(converged, str(case), changes)
    record = {
        "bodies": len(mechanism.bodies),
        "ideal_joints": [joint.name for joint in mechanism.ideal_joints],
        "clearance_joints": [joint.name for joint in mechanism.clearance_joints],
        "free_coordinates": planned.coordinates.free,
        "constraints": len(planned.coordinates.constraints),
        "drives": [*(drive.body for drive in mechanism.drives), *(drive.name for drive in mechanism.coordinate_drives)],
        "degrees_of_freedom": planned.coordinates.mobility,
        "couplings": [coupling.name for coupling in mechanism.couplings],
        "components": [part.name for part in components],
        "until": until,
        "span": None if span is None else span.plain(),
        "drive_inertia": None if inertia is None else inertia.plain(),
        "method": choice.method,
        "servos": [servo._asdict() for servo in servos],
        **({} if converged is None else {"convergence": asdict(converged)}),
        "warnings": warnings,
    }
    return lines, record


def _parts(planned: Plan, components: Sequence[Component]) -> list[str]:
    """Return lines on the size of a mechanism, its drives, components and clearances."""
    mechanism, coordinates = planned.mechanism, planned.coordinates
    return [
        f"Mechanism: {counted(len(mechanism.bodies), 'body')}, {counted(len(mechanism.ideal_joints), 'ideal joint')} and "
        f"{counted(len(mechanism.clearance_joints), 'clearance joint')}, "
        f"{counted(coordinates.free, 'free coordinate')} with {counted(len(coordinates.constraints), 'constraint')}: "
        f"{counted(planned.coordinates.mobility, 'degree')} of freedom besides the drives.",
        *(f"Drive of {drive.body}: {_in_words(drive.motion)}." for drive in mechanism.drives),
        *(
            f"Drive {drive.name} of the {coordinate_words(drive.coordinate)}: {_in_words(drive.motion, drive.coordinate.unit)}."
            for drive in mechanism.coordinate_drives
        ),
        *coupling_lines(mechanism),
        *(f"{part.declaration.label.capitalize()} {part.name}." for part in components),
        *_clearances("Joint", mechanism.joints),
        *_clearances("Guide", mechanism.guides),
    ]


def _clearances(kind: str, parts: Sequence[Any]) -> list[str]:
    """Return a line for each different clearance with its laws: the names of its joints, or their number if there are many."""
    names: dict[str, list[str]] = {}
    for part in parts:
        if (gap := part.clearance) is not None:
            laws = f"{gap.stiffness.name} stiffness, {gap.damping.name} damping, friction {gap.friction.name}"
            if gap.contact == "hard":
                e, kinetic, static = hard_numbers(gap)
                laws = f"hard contact, restitution {e:g}, friction {kinetic:g} ({static:g} at rest)"
            text = f"clearance {1e3 * gap.clearance:g} mm, {gap.surfaces.journal.name}, {laws}."
            names.setdefault(text, []).append(part.name)

    def subject(those: list[str]) -> str:
        is_all = len(those) == len(parts) > ROWS_MAX
        return f"All {len(parts)} {kind.lower()}s" if is_all else f"{kind}{'s' * (len(those) > 1)} {', '.join(those)}"

    return [f"{subject(those)}: {text}" for text, those in names.items()]


def _ideal(mechanism: Mechanism, until: float, samples: int, seconds: float = 2.0) -> Results | str:
    """Return the motion with ideal joints; a text with the reason if it is impossible, or "" if it is not complete in time.

    `seconds`: [s] computing time after which the motion counts as not complete in time.
    """
    try:
        ideal = compute_results(mechanism.ideal(), Options(until, samples=samples), time_limit(seconds))
    except TimeIsOverError:
        return ""
    except InputError as error:  # the case itself may run, because clearances may permit a motion that ideal joints do not
        return error.what
    return ideal if ideal.attrs["status"] == "complete" else ""


def _inertia(mechanism: Mechanism, until: float) -> DriveInertia | None:
    """Return the inertia reduced to the only drive, or servo against the ground; None if it does not determine the motion."""
    servos = [part for part in mechanism.components if isinstance(part, Actuator) and part.reference is not None]
    ideal = mechanism.ideal()
    if len(servos) == 1 and servos[0].base == GROUND and not mechanism.drives:
        rotors = [(part.body, part.inertia) for part in ideal.components if isinstance(part, Actuator)]
        others = tuple(part for part in ideal.components if not isinstance(part, Actuator))
        ideal = with_rotors(replace(ideal, components=others), rotors).driven(servos[0].reference, body=servos[0].body)
    path = path_of(plan(ideal), until) if len(ideal.drives) == 1 else None
    if path is None or path.parameter != "angle":
        return None
    values, drive = drive_inertia(path), ideal.drives[0].body
    first, last = (int(np.argmin(np.abs(path.place - path.closure.inputs.at(time)[0]))) for time in (0.0, until))
    locks = [position.place for position in path.singular if position.kind == LOCKING_KIND]
    met = [(time, place) for place in locks for time in instants(path, until, place)]
    if met:
        return DriveInertia(drive, float(values[first]), math.inf, math.inf, min(met)[1])
    return DriveInertia(drive, float(values[first]), float(values[last]), float(np.nanmax(values)))


def _in_words(motion: TimeFunction, unit: str = "rad") -> str:
    """Return the kind of a motion with its parameters; frequencies are in Hz."""
    if isinstance(motion, Tabulated):
        return f"a table of {len(motion.times)} instants from {1e3 * motion.times[0]:g} to {1e3 * motion.times[-1]:g} ms"
    if isinstance(motion, Polynomial):
        return f"a polynomial of degree {len(motion.coefficients) - 1}"
    kind: type = type(motion)
    values = {name: (getattr(motion, name), of) for name, of in units_of(kind, unit).items()}
    numbers = ", ".join(
        f"frequency {value / math.tau:.6g} Hz" if name == "angular_frequency" else f"{name} {rounded_text(value, of)}"
        for name, (value, of) in values.items()
        if value or name != "begin"
    )
    return numbers if kind is ConstantSpeed else f"{kind.__name__.lower()}, {numbers}"


class TimeIsOverError(Exception):
    """Exception that ends a run when its computing time exceeds a limit."""


def time_limit(seconds: float) -> Callable[[float], None]:
    """Return a progress function that raises `TimeIsOverError` when it is called later than `seconds` from now."""
    ends = time.perf_counter() + seconds

    def progress(_: float) -> None:
        if time.perf_counter() > ends:
            raise TimeIsOverError

    return progress


class ServoDemand(NamedTuple):
    """Torque and speed that a servo needs to follow its reference exactly, with ideal joints and rigid bars."""

    name: str
    torque: float  # Largest torque [N m]
    time: float  # Instant of the largest torque [s]
    limit: float | None  # Torque limit of the servo [N m]
    above: float  # Fraction of the time with a torque above the limit
    speed: float  # Largest speed [rad/s]
    ramp: float  # Time over which the limit rises from zero [s]

    def __str__(self) -> str:
        peak = f"up to {short(self.torque, 'N m')}, at {short(self.time, 's')}, and {self.speed * 30.0 / math.pi:.4g} rpm"
        text = f"Servo '{self.name}' follows its reference with {peak}"
        if self.limit is None:
            return f"{text}."
        ratio, limit = self.torque / self.limit, f"its limit of {short(self.limit, 'N m')}"
        if ratio <= 1.0 and self.above < 0.005:  # 0 % when rounded
            return f"{text}, {ratio:.2g} of {limit}."
        rises = f", which rises over {short(self.ramp, 's')}" if self.ramp else ""
        return (
            f"Warning: {text}, {ratio:.3g} times {limit}{rises}: it cannot hold for {self.above:.0%} of the time, and forces "
            "with ideal joints are those of a servo that can."
        )


def servo_demands(mechanism: Mechanism, followed: Mechanism, ideal: Run) -> list[ServoDemand]:
    """Return the demands on servos from the ideal motion of `followed`, in which drives replace the servos."""
    demands, driven = [], [drive.body for drive in followed.drives]
    torques = np.abs(ideal["drive_torque"].values.reshape(ideal.sizes["time"], -1)) if driven else np.zeros((0, 0))
    for part in mechanism.components:
        if isinstance(part, Actuator) and part not in followed.components:
            torque = torques[:, driven.index(part.body)]
            largest, when = smooth_peak(ideal["time"].values, torque)
            limit = getattr(part.controller, "limit", None)
            limit = limit if limit is not None and math.isfinite(limit) else None
            ramp = getattr(part.controller, "ramp", 0.0)
            present = 1.0 if ramp == 0.0 else np.minimum(1.0, ideal["time"].values / ramp)
            above = 0.0 if limit is None else float(time_mean(torque > limit * present, ideal["time"].values))
            speeds = ideal["angular_velocity"].values[:, ideal["body"].values.tolist().index(part.body)]
            speed = float(np.abs(speeds).max(initial=0.0))
            demands.append(ServoDemand(part.name, float(largest), float(when), limit, above, speed, ramp))
    return demands


def converged_lines(converged: Convergence, case: str, changes: Sequence[str] = ()) -> list[str]:
    """Return lines about the tolerance, step size or number of modes that a measure of the run needs."""

    def setting(value: float) -> str:
        """Return a tolerance, step size or number of modes as the user types it."""
        return short(value, "s") if converged.varied == "step" else f"{value:g}"

    import xarray as xr

    from scissordyn.plot.scale import scale_of

    scale = scale_of(xr.DataArray(converged.value, attrs={"units": converged.units}))
    what = {"step": "steps", "modes": "numbers of bending modes"}.get(converged.varied, "rtol = atol")
    lines = [f"{converged.response} to within {100.0 * converged.within:g} %, with {what} from coarse to fine:"]
    for level in converged.levels:
        numbers = f"{scale.with_unit(level.value, 5)}, repeated runs differ by {level.spread:.2%}, {level.seconds:.3g} s a run"
        lines.append(f"  {setting(level.setting)}  " + (f"failed: {level.cause}" if level.cause else numbers))
    if math.isnan(converged.setting):
        finest = f"{'up' if converged.varied == 'modes' else 'down'} to {setting(converged.levels[-1].setting)}"
        return [*lines, f"None {finest} agrees with the two that follow it."]
    lines.append(f"{setting(converged.setting)} is enough: the next two agree with it.")
    if converged.chaotic:
        lines.append(
            f"The motion is chaotic: runs whose starts differ only by round-off differ by more than {converged.within:.3g} of "
            "the measure. Their means are compared instead. A study with --members gives the distribution."
        )
    if converged.varied == "modes":
        return [*lines, f"To run it so: modes = {converged.setting:.0f} in [[bending]] of {case}."]
    settings = [f"run.{name}={setting(converged.setting)}" for name in converged.options]
    words = [part for change in (*changes, *settings) for part in ("--set", change)]
    return [*lines, f"To run it so: {command('scissordyn', 'run', case, *words)}"]


def preview_lines(mechanism: Mechanism, followed: Mechanism, ideal: xr.Dataset, until: float) -> list[str]:
    """Return lines about the assembly and the motion with ideal joints; in `followed`, drives replace the servos."""
    lines = [_assembled(mechanism, ideal), *_range(followed, ideal), *_forces(ideal), *_static_lines(followed, ideal, until)]
    lines += map(str, servo_demands(mechanism, followed, ideal))
    warnings = [*map(str, table_warnings(plan(mechanism))), *json.loads(ideal.attrs["singular_warnings"])]
    lines += [f"Warning: {text}." for text in warnings]
    if ideal.attrs["status"] != "complete":
        lines.append(f"The run with ideal joints {ideal.attrs['cause']}.")
    return lines


def worn_lines(case: Case) -> list[str]:
    """Return lines about the wear over many cycles, estimated from forces of ideal joints; none if no joint wears."""
    from scissordyn.lifetime.life import life_lines
    from scissordyn.lifetime.wear import wear_out

    settings = replace(case.wear or Wear(), loads="ideal")
    if not settings.coefficients and not any(getattr(joint.clearance, "wears", False) for joint in case.mechanism.joints):
        return []
    try:
        run = wear_out(case.mechanism, case.run, settings)
    except ScissordynError as error:
        return [f"Wear is not estimated: {error}."]
    return [f"Wear: {line}." for line in (*life_lines(run), *warning_lines(warnings_of(run)))]


def _static_lines(mechanism: Mechanism, ideal: xr.Dataset, until: float, revolutions: int = 2) -> list[str]:
    """Return a line with the largest forces of a quasi-static motion with rigid bars; no line if there are no loads.

    `revolutions`: largest rotation of a drive over which these forces are computed.
    """
    if not (mechanism.drives or mechanism.coordinate_drives or any(rod.motion for rod in mechanism.rods)):
        return []
    turned = rotations(mechanism, until)
    turns, shown = "", np.searchsorted(turned, revolutions * 2.0 * math.pi, side="right")
    if shown < turned.size:
        turns, until = f" in {revolutions} turns", until * float(shown - 1) / (turned.size - 1)
    try:
        peaks = static_peaks(rigid(mechanism), until)
    except InputError as error:
        return [f"Without inertia: {error.what}."]
    parts, round_off = [], ASSEMBLY_TOL * float(np.nanmax(ideal["peak_reaction"].values, initial=0.0))
    kinds = ("drive torque", "rod force", "coordinate drive torque", "coordinate drive force", "reaction", "reaction moment")
    for kind in (*kinds, "weld force", "weld moment"):
        longer = [other for other in kinds if other.startswith(f"{kind} ")]
        of_kind = [name for name in peaks if name.startswith(kind) and not name.startswith(tuple(longer))]
        sizes = {name: peaks[name] for name in of_kind if peaks[name] > round_off}
        if sizes:
            name = max(sizes, key=lambda name: sizes[name])
            at = f" at '{name.removeprefix(kind).strip()}'" if name != kind else ""
            parts.append(f"{kind} {short(sizes[name], 'N m' if kind.endswith(('torque', 'moment')) else 'N')}{at}")
    return [f"At most without inertia{turns}: {', '.join(parts)}."] if parts else []


def _assembled(mechanism: Mechanism, ideal: xr.Dataset) -> str:
    """Return a line about the distance by which the assembly moved the bodies from their given positions."""
    moves, turns = [], []
    start = ideal.isel(time=0)
    for body in mechanism.bodies:
        (px, py), (x, y) = body.placed_position, body.centre
        cos, sin = math.cos(body.placed_angle), math.sin(body.placed_angle)
        placed, assembled = (px + cos * x - sin * y, py + sin * x + cos * y), start.sel(body=body.name)
        moves.append((math.dist(placed, assembled["position"].values.tolist()), body.name))
        turns.append((abs(math.remainder(float(assembled["angle"]) - body.placed_angle, 2.0 * math.pi)), body.name))
    (far, farthest), (turn, turned) = (max(pairs, key=lambda pair: pair[0], default=(0.0, "")) for pairs in (moves, turns))
    parts = [f"moves the mass centre of body '{farthest}' by {1e3 * far:.4g} mm"] * (far > DATA_TOL * mechanism.size)
    parts += [f"rotates body '{turned}' by {math.degrees(turn):.4g} deg"] * (turn > DATA_TOL)
    return f"Assembly {' and '.join(parts)}, more than any other body." if parts else "The mechanism closes as it is placed."


def _range(mechanism: Mechanism, ideal: xr.Dataset) -> list[str]:
    """Return lines about the stroke of the only drive and the position in which it locks."""
    low, high, unit = (ideal.attrs[f"range_{name}"] for name in ("low", "high", "unit"))
    if not unit:
        return [] if mechanism.drives or mechanism.coordinate_drives else ["No drive prescribes the motion."]
    factor, sign = (180.0 / math.pi, "deg") if unit == "rad" else (1e3, "mm")
    name = f"Drive of '{mechanism.drives[0].body}'" if mechanism.drives else "Driven rod"
    name = f"Drive '{mechanism.coordinate_drives[0].name}'" if mechanism.coordinate_drives else name
    locks = [f"{factor * place:.6g} {sign}" for place in (low, high) if math.isfinite(place)]
    stroke = ""
    if mechanism.drives:
        angle = np.degrees(ideal["angle"].sel(body=mechanism.drives[0].body).values)
        stroke = f" goes from {angle[0]:.6g} to {angle[-1]:.6g} deg and" if angle.size else ""
    nowhere = "locks nowhere within a revolution" if unit == "rad" else "locks at no length"
    return [f"{name}{stroke} {'locks at ' + ' and '.join(locks) if locks else nowhere}."]


def _forces(ideal: xr.Dataset) -> list[str]:
    """Return lines about the worst transmission angle and the largest torques and reactions."""
    lines, time = [], ideal["time"].values
    angle = np.degrees(ideal["transmission_angle"].values)
    if angle.size:
        i, k = np.unravel_index(int(np.argmin(angle)), angle.shape)
        smallest = round(float(angle[i, k]), 6)  # a change point has the angle zero up to round-off
        joint = ideal["dyad"].values[k]
        lines.append(f"Smallest transmission angle: {smallest:.4g} deg at joint '{joint}', at {short(time[i], 's')}.")
    for dim in ("coordinate_drive", "coupling"):
        for place, name in enumerate(ideal[dim].values if dim in ideal else ()):
            quantity, unit = ("torque", "N m") if ideal[f"{dim}_unit"].values[place] == "rad" else ("force", "N")
            peak, when = (float(ideal[part].values[place]) for part in (f"peak_{dim}_force", f"peak_{dim}_force_time"))
            size = f"{short(peak, unit)} at {short(when, 's')}"
            lines.append(f"Largest {quantity} of '{name}' with ideal joints: {size}.")
    for name, unit, subject in (("drive_torque", "N m", "driving torque"), ("rod_force", "N", "force in a rod")):
        if name in ideal and ideal[name].size:
            values = np.abs(ideal[name].values.reshape(time.size, -1)).max(axis=1)
            largest, when = smooth_peak(time, values)
            if np.isfinite(largest):
                lines.append(f"Largest {subject} with ideal joints: {short(largest, unit)} at {short(when, 's')}.")
    force = ideal["peak_reaction"].values
    if np.isfinite(force).any():
        most = int(np.nanargmax(force))
        worst, joint = short(float(force[most]), "N"), ideal["joint"].values[most]
        instant = short(float(ideal["peak_reaction_time"].values[most]), "s")
        lines.append(f"Largest reaction with ideal joints: {worst} at '{joint}', at {instant}.")
    return lines + _further_forces(ideal, ASSEMBLY_TOL * float(np.nanmax(force, initial=0.0)))


OTHER_LOADS = (
    ("reaction_moment", "joint", "N m", "moment of a guide"),
    ("weld_force", "weld", "N", "force of a weld"),
    ("weld_moment", "weld", "N m", "moment of a weld"),
)
"""Joint loads that `check` prints in addition to forces of pins and guides: variable, dimension, unit and text."""


def _further_forces(ideal: xr.Dataset, round_off: float) -> list[str]:
    """Return lines about the largest moments of guides, and the largest forces and moments of welds."""
    lines, time = [], ideal["time"].values
    for name, dim, unit, subject in OTHER_LOADS:
        if name not in ideal:
            continue
        values = np.abs(ideal[name].transpose("time", dim, ...).values.reshape(time.size, ideal.sizes[dim], -1))
        peaks = [smooth_peak(time, np.hypot.reduce(values[:, k], axis=1)) for k in range(values.shape[1])]
        loaded = {place: peak for place, peak in enumerate(peaks) if math.isfinite(peak[0]) and peak[0] > round_off}
        if loaded:
            index_max = max(loaded, key=lambda place: loaded[place][0])
            (largest, when), part = loaded[index_max], ideal[dim].values[index_max]
            lines.append(f"Largest {subject} with ideal joints: {short(largest, unit)} at '{part}', at {short(when, 's')}.")
    return lines
