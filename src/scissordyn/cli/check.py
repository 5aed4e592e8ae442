"""``scissordyn check``: read and assemble a case without running it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scissordyn.cli.option import AsJson, CaseFile, Changes, Quiet

if TYPE_CHECKING:
    from scissordyn.component.declaration import Component
    from scissordyn.component.time_function import TimeFunction
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.run.summary import SpanAnswer

__all__ = ["check"]

MOST_STEPS = 100_000
"""Of the motion with ideal joints, whose end is shown."""


def check(
    case: CaseFile,
    change: Changes = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> int:
    """Read a case, assemble its mechanism and describe the run."""
    from scissordyn.cli.record import print_json
    from scissordyn.cli.show import console
    from scissordyn.config.file import read_case
    from scissordyn.kinematics.branching import drive_warnings
    from scissordyn.kinematics.time_functions import check_tables
    from scissordyn.plan.plan import plan
    from scissordyn.run.demand import check_samples
    from scissordyn.run.trajectory import make_driver

    read = read_case(case, change or [])
    mechanism = read.mechanism
    rods: tuple[Any, ...] = mechanism.rods  # type checkers do not see what makes them components
    made = plan(mechanism)
    check_tables(made, read.run.until)
    check_samples(made, read.run.count)
    _, prepared, choice = make_driver(made, read.run)

    lines = [
        f"{case} is complete and can be assembled.",
        f"Mechanism: {len(mechanism.bodies)} bodies, {len(mechanism.ideal_joints)} ideal and "
        f"{len(mechanism.clearance_joints)} clearance joints, "
        f"{made.coordinates.free} free coordinates with {len(made.coordinates.constraints)} quadratic constraints.",
    ]
    lines += [f"Drive of {drive.body}: {_in_words(drive.motion)}." for drive in mechanism.drives]
    components: tuple[Component, ...] = (*made.acting, *rods)
    lines += [f"{part.declaration.label.capitalize()} {part.name}." for part in components]
    parts = [("Joint", joint.name, joint.clearance) for joint in mechanism.clearance_joints]
    for kind, name, gap in (*parts, *(("Guide", guide.name, guide.clearance) for guide in mechanism.guides)):
        if gap is None:
            continue
        laws = f"{gap.stiffness.name} stiffness, {gap.damping.name} damping, friction {gap.friction.name}"
        lines.append(f"{kind} {name}: clearance {1e3 * gap.clearance:g} mm, {gap.contact.journal.name}, {laws}.")
    method = choice.method if read.run.method != "auto" else f"{choice.method} ({choice.reason})"
    span = _span(mechanism, read.run.until)
    lines += [] if span is None else [f"{span} (ideal joints)".replace(". (", " (") + "."]
    lines.append(f"Run: {1e3 * read.run.until:g} ms, {read.run.start} start, {read.run.samples} samples, {method}.")
    warnings = [*prepared.warnings, *drive_warnings(made, read.run.until)]
    lines += [f"Warning: {text}." for text in warnings]
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
                "method": choice.method,
                "warnings": warnings,
            }
        )
    elif not quiet:
        to = console()
        for line in lines:
            to.print(line, markup=False)
    return 0


def _span(mechanism: Mechanism, until: float) -> SpanAnswer | None:
    """Width and height at the start and at the end of the run, with ideal joints; None where that ends early."""
    from scissordyn.run.simulate import simulate
    from scissordyn.run.summary import summary_of

    ideal = simulate(mechanism.ideal(), until=until, samples=2, most_steps=MOST_STEPS)
    return summary_of(ideal).span if ideal.attrs["status"] == "complete" else None


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
