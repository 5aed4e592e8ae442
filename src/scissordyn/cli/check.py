"""``scissordyn check``: read and assemble a case without running it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scissordyn.cli.option import AsJson, CaseFile, Changes, Quiet
from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.cli.servo import ServoDemand
    from scissordyn.component.declaration import Component
    from scissordyn.component.time_function import TimeFunction
    from scissordyn.kinematics.inertia import DriveInertia
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.plan.plan import Plan
    from scissordyn.run.results import Results

MOST_NAMES = 20
"""All joints of a mechanism that has more than these are not named one by one."""

PATIENCE = 2.0
"""Time for the motion with ideal joints [s]; where that takes longer, what follows from it is not shown."""


def check(
    case: CaseFile,
    change: Changes = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    converge: Annotated[
        str | None,
        typer.Option(metavar="MEASURE", help="Also run with several tolerances: which one 'tip.error within 1 %' needs."),
    ] = None,
    modes: Annotated[
        bool, typer.Option("--modes", help="With --converge: several numbers of bending modes in place of tolerances.")
    ] = False,
) -> int:
    """Read a case, assemble its mechanism and describe the run."""
    from scissordyn.cli.cost import cost_line
    from scissordyn.cli.record import print_json
    from scissordyn.cli.servo import servo_lines
    from scissordyn.cli.show import console
    from scissordyn.config.file import read_case
    from scissordyn.kinematics.branching import drive_warnings
    from scissordyn.kinematics.time_functions import check_tables
    from scissordyn.plan.plan import plan
    from scissordyn.run.advance.trajectory import make_driver
    from scissordyn.run.answer.summary import summary_of
    from scissordyn.run.start.demand import check_samples
    from scissordyn.units import short

    read = read_case(case, change or [])
    mechanism = read.mechanism
    rods: tuple[Any, ...] = mechanism.rods  # type checkers do not see what makes them components
    made = plan(mechanism)
    check_tables(made, read.run.until)
    check_samples(made, read.run.count)
    driver, prepared, choice = make_driver(made, read.run)

    components: tuple[Component, ...] = (*made.acting, *rods)
    lines = [f"{case} is complete and can be assembled.", *_parts(made, components)]
    method = choice.method if read.run.method != "auto" else f"{choice.method} ({choice.reason})"
    ideal = _ideal(mechanism, read.run.until, 2)
    span, impossible = (None, ideal) if isinstance(ideal, str) else (summary_of(ideal).span, "")
    inertia = None if impossible else _inertia(mechanism, read.run.until)
    lines += [] if span is None else [f"{span} (ideal joints)".replace(". (", " (") + "."]
    lines += [] if inertia is None else [f"Inertia about {inertia.drive}: {inertia} (ideal joints)."]
    servos = _servos(mechanism, read.run.until)
    lines += servo_lines(servos)
    lines.append(f"Run: {short(read.run.until, 's')}, {read.run.start} start, {read.run.samples} samples, {method}.")
    cost = cost_line(driver, read.run.until)
    lines += [f"{cost}."] if cost else []
    warnings = [*prepared.warnings, *drive_warnings(made, read.run.until)]
    warnings += [f"without clearance: {impossible}"] if impossible else []
    lines += [f"Warning: {text}." for text in warnings]
    converged = None
    if converge is not None:
        from scissordyn.cli.converge import converged_lines, plain
        from scissordyn.study.compute.convergence import convergence, read_wanted

        response, within = read_wanted(converge)
        converged = convergence(mechanism, read.run, response, within=within, over="modes" if modes else "accuracy")
        lines += converged_lines(converged, str(case), change or [])
    if as_json:
        print_json(
            {
                "bodies": len(mechanism.bodies),
                "ideal_joints": [joint.name for joint in mechanism.ideal_joints],
                "clearance_joints": [joint.name for joint in mechanism.clearance_joints],
                "free_coordinates": made.coordinates.free,
                "constraints": len(made.coordinates.constraints),
                "drives": [drive.body for drive in mechanism.drives],
                "components": [part.name for part in components],
                "until": read.run.until,
                "span": None if span is None else span.plain(),
                "drive_inertia": None if inertia is None else inertia.plain(),
                "method": choice.method,
                "servos": [servo._asdict() for servo in servos],
                "cost": cost,
                **({} if converged is None else {"convergence": plain(converged)}),
                "warnings": warnings,
            }
        )
    elif not quiet:
        to = console()
        for line in lines:
            to.print(line, markup=False)
    return 0


def _parts(made: Plan, components: Sequence[Component]) -> list[str]:
    """Lines for the size of a mechanism, its drives, its components and its clearances."""
    mechanism = made.mechanism
    return [
        f"Mechanism: {len(mechanism.bodies)} bodies, {len(mechanism.ideal_joints)} ideal and "
        f"{len(mechanism.clearance_joints)} clearance joints, "
        f"{made.coordinates.free} free coordinates with {len(made.coordinates.constraints)} quadratic constraints.",
        *(f"Drive of {drive.body}: {_in_words(drive.motion)}." for drive in mechanism.drives),
        *(f"{part.declaration.label.capitalize()} {part.name}." for part in components),
        *_clearances("Joint", mechanism.joints),
        *_clearances("Guide", mechanism.guides),
    ]


def _clearances(kind: str, parts: Sequence[Any]) -> list[str]:
    """A line for each clearance and its laws, with the names of the parts that have it, or the number of many."""
    from scissordyn.model.hard_contact import hard_numbers

    found: dict[str, list[str]] = {}
    for part in parts:
        if part.clearance is not None:
            gap = part.clearance
            laws = f"{gap.stiffness.name} stiffness, {gap.damping.name} damping, friction {gap.friction.name}"
            if gap.contact == "hard":
                e, kinetic, static = hard_numbers(gap)
                laws = f"hard contact, restitution {e:g}, friction {kinetic:g} ({static:g} at rest)"
            text = f"clearance {1e3 * gap.clearance:g} mm, {gap.surfaces.journal.name}, {laws}."
            found.setdefault(text, []).append(part.name)
    return [f"{_named(kind, names, len(parts))}: {said}" for said, names in found.items()]


def _named(kind: str, names: Sequence[str], parts: int) -> str:
    """The parts by their names, or by their number where these are all and many."""
    if len(names) == parts > MOST_NAMES:
        return f"All {parts} {kind.lower()}s"
    return f"{kind}{'s' * (len(names) > 1)} {', '.join(names)}"


def _ideal(mechanism: Mechanism, until: float, samples: int) -> Results | str:
    """The whole motion with ideal joints; why there is none, or "" where it ends early or takes long."""
    from scissordyn.cli.cost import TimeIsOverError, limited
    from scissordyn.run.options import Options
    from scissordyn.run.simulate import results_of

    try:
        ideal = results_of(mechanism.ideal(), Options(until, samples=samples), limited(PATIENCE))
    except TimeIsOverError:
        return ""
    except InputError as error:  # the case itself may run: its joints may bridge what ideal ones cannot
        return error.what
    return ideal if ideal.attrs["status"] == "complete" else ""


def _servos(mechanism: Mechanism, until: float) -> list[ServoDemand]:
    """The torque of each servo that follows its reference exactly, with ideal joints and rigid bars."""
    from scissordyn.cli.servo import SAMPLES, servo_demands
    from scissordyn.model.commanded import commanded, rigid

    followed = commanded(mechanism)
    ideal = "" if followed is mechanism else _ideal(rigid(followed), until, SAMPLES)
    return [] if isinstance(ideal, str) else servo_demands(mechanism, followed, ideal)


def _inertia(mechanism: Mechanism, until: float) -> DriveInertia | None:
    """What the only drive, or the only servo in its place, has to accelerate; None where they do not determine the motion."""
    import numpy as np

    from scissordyn.component.actuator import Actuator
    from scissordyn.kinematics.inertia import DriveInertia, drive_inertia
    from scissordyn.kinematics.path import path_of
    from scissordyn.plan.plan import plan

    servos = [part for part in mechanism.components if isinstance(part, Actuator) and part.reference is not None]
    ideal = mechanism.ideal()
    if len(servos) == 1 and not mechanism.drives:
        kept = tuple(part for part in ideal.components if not isinstance(part, Actuator))
        ideal = replace(ideal, components=kept).driven(servos[0].reference, body=servos[0].body)
    path = path_of(plan(ideal), until) if len(ideal.drives) == 1 else None
    if path is None or path.parameter != "angle":
        return None
    values = drive_inertia(path)
    first, last = (int(np.argmin(np.abs(path.place - path.closure.inputs.at(time)[0]))) for time in (0.0, until))
    return DriveInertia(ideal.drives[0].body, float(values[first]), float(values[last]), float(np.nanmax(values)))


def _in_words(motion: TimeFunction) -> str:
    from scissordyn.component.time_function import ConstantSpeed, Polynomial, Tabulated
    from scissordyn.config.quantity import written
    from scissordyn.units import quantities

    kind: type = type(motion)
    if isinstance(motion, Tabulated):
        return f"a table of {len(motion.times)} instants from {1e3 * motion.times[0]:g} to {1e3 * motion.times[-1]:g} ms"
    if isinstance(motion, Polynomial):
        return f"a polynomial of degree {len(motion.coefficients) - 1}"
    declared = quantities(kind)
    said = ", ".join(f"{name} {written(getattr(motion, name), quantity.unit)}" for name, quantity in declared.items())
    return said if kind is ConstantSpeed else f"{kind.__name__.lower()}, {said}"
