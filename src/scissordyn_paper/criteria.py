"""Criteria of the checks: functions that answer by yes or no from the measures of runs, with the numbers."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scissordyn_paper.cases import CONTROLLED, SPEEDS, Choice, PaperCase, three_digits
from scissordyn_paper.verdict import Finding

VISIBLE_FRACTION = 0.01  # Smallest visible difference as a fraction of a curve's range: a line's width in a printed figure
QUARTER_ARC_MAX = 99.0  # [deg] largest contact arc that counts as "about a quarter" of the bearing: 90 deg plus 10 %

OSCILLATING = {
    "slider_velocity": ("slider velocity", "m/s"),
    "slider_acceleration": ("slider acceleration", "m/s²"),
    "angular_velocity": ("angular velocity of bar 2", "rad/s"),
    "angular_acceleration": ("angular acceleration of bar 2", "rad/s²"),
}

Measured = Mapping[PaperCase, Any]  # Measures of strokes, or the regularity of motions under the periodic drive, by case
Find = Callable[[Choice, Measured], Finding]  # Criterion: function from measures to the finding of a check
Holds = Callable[[Sequence[float]], bool]  # Function that returns True if the values of a group satisfy a condition
Group = Mapping[str, PaperCase]  # Cases that are compared, by a text of the parameter in which they differ


def millimetres(size: float) -> str:
    """Return a length [m] as text in mm."""
    return f"{1e3 * size:g} mm"


def percent(value: float) -> str:
    """Return a fraction as text in percent."""
    return f"{100.0 * value:.3g} %"


def _kilo(value: float, unit: str) -> str:
    return f"{1e-3 * value:.1f} k{unit}"


def clearances(*sizes: float) -> Group:
    """Return the cases of strokes with some clearances [m], by the text of the clearance."""
    return {millimetres(size): PaperCase(size) for size in sizes}


def frictions(*coefficients: float) -> Group:
    """Return the cases of strokes with some friction coefficients, by the text of the coefficient."""
    return {f"{friction:g}": PaperCase(friction=friction) for friction in coefficients}


BY_SPEED = {f"{case.rpm} rpm": case for case in (PaperCase(speed=speed) for speed in SPEEDS)}
CONSTRAINED = {millimetres(size): PaperCase(size, constrained=True) for size in CONTROLLED}


@dataclass(frozen=True)
class Quantity:
    """A measure that is compared between runs, and its format in a finding."""

    attribute: str  # Attribute of the measures of a run
    title: str  # Title of the list of values in the text; "" if `form` names the measure
    form: str  # Format of a value in the text
    number: str  # Format of the name of a value in `Finding.numbers`; {} is the text of the run
    factor: float = 1.0  # Factor from SI units to the value in the text


PEAK_FORCE = Quantity("peak_force", "peak force", "{:.1f} kN", "peak_{}_N", 1e-3)
PEAK_TORQUE = Quantity("peak_torque", "peak torque", "{:.1f} kN m", "peak_{}_Nm", 1e-3)
LATE_FORCE = Quantity("late_peak_force", "peak force after 30 ms", "{:.1f} kN", "late_peak_{}_N", 1e-3)
SMALLEST_FORCE = Quantity("smallest_force", "smallest normal force", "{:.1f} kN", "smallest_{}_N", 1e-3)
IMPACTS = Quantity("impacts", "contacts", "{:.0f}", "impacts_{}_1")
EARLY_IMPACTS = Quantity("early_impacts", "contacts begun before 30 ms", "{:.0f}", "impacts_{}_1")
LATE_RATE = Quantity("late_rate", "contacts begun per second after 30 ms", "{:.0f}", "late_rate_{}_per_s")
SETTLED = Quantity("settled_fraction", "fraction of time in contact after 5 ms", "{:.3g} %", "fraction_{}_1", 100.0)
SETTLED_ALONE = replace(SETTLED, title="", form="in contact {:.3g} % of the time after 5 ms", number="fraction_1")
FINAL = Quantity("final_fraction", "fraction of the last fifth of the run in contact", "{:.3g} %", "final_fraction_{}_1", 100.0)
FINAL_ALONE = replace(FINAL, title="", form="in contact {:.3g} % of the last fifth of the run", number="final_fraction_1")
SCATTER = Quantity("irregularity", "scatter of the slider acceleration", "{:.3g}", "scatter_{}_1")
ARC = Quantity("arc_degrees", "arc with 95 % of the contact time", "{:.0f} deg", "arc_{}_deg")
PERIODIC_FRACTION = Quantity("contact_fraction", "fraction of time in contact", "{:.4g} %", "contact_fraction_{}_1", 100.0)
PERIODIC_IMPACTS = Quantity("impacts", "contacts per period", "{:.3g}", "impacts_{}_1")


def criterion_for_values(group: Group, quantity: Quantity, holds: Holds) -> Find:
    """Return the criterion that the values of a quantity, in the order of the group, satisfy the condition `holds`."""

    def find(choice: Choice, measured: Measured) -> Finding:
        values = {label: getattr(run, quantity.attribute) for label, run in _of(group, choice, measured).items()}
        words = _listed(quantity.title, {k: quantity.form.format(quantity.factor * value) for k, value in values.items()})
        return Finding(holds(list(values.values())), words, _named(quantity.number, values))

    return find


def every(compare: Callable[[float, float], bool], bound: float) -> Holds:
    """Return the condition that `compare(value, bound)` is true of all values."""
    return lambda values: all(compare(value, bound) for value in values)


def only(compare: Callable[[float, float], bool], at: int) -> Holds:
    """Return the condition that `compare(value, other)` is true of the value at an index and each of the others."""

    def holds(values: Sequence[float]) -> bool:
        others = list(values)
        value = others.pop(at)
        return all(compare(value, other) for other in others)

    return holds


def grows(values: Sequence[float]) -> bool:
    """Return True if each value is larger than the one before."""
    return all(itertools.starmap(operator.lt, itertools.pairwise(values)))


def falls(values: Sequence[float]) -> bool:
    """Return True if each value is smaller than the one before."""
    return all(itertools.starmap(operator.gt, itertools.pairwise(values)))


def last_between(values: Sequence[float]) -> bool:
    """Return True if the third value lies between the first and the second, and the first is the smallest."""
    return values[0] < values[2] < values[1]


def _of(group: Group, choice: Choice, measured: Measured) -> dict[str, Any]:
    return {label: measured[replace(case, choice=choice)] for label, case in group.items()}


def _listed(title: str, values: Mapping[str, str]) -> str:
    listed = ", ".join(f"{value} at {label}" for label, value in values.items())
    return f"{title}: {listed}" if title else listed


def _named(name: str, values: Mapping[str, float]) -> dict[str, float]:
    return {name.format(label.replace(" ", "_")): value for label, value in values.items()}


def position(choice: Choice, measured: Measured) -> Finding:
    """Answer check 1a: displacement and angle do not visibly differ from those of the ideal mechanism."""
    run = measured[PaperCase(choice=choice)]
    position, angle = run.position_deviation, run.angle_deviation
    return Finding(
        max(position, angle) < VISIBLE_FRACTION,
        f"largest difference: displacement {percent(position)}, angle {percent(angle)} of the range that both curves cover",
        {"position_deviation_1": position, "angle_deviation_1": angle},
    )


def oscillation(choice: Choice, measured: Measured) -> Finding:
    """Answer check 1b: speeds and accelerations visibly differ from the ideal ones in the first 5 ms."""
    deviations = measured[PaperCase(choice=choice)].deviations
    largest = {name: deviations[name].largest for name in OSCILLATING}
    words = ", ".join(f"{text} {percent(largest[name])}" for name, (text, _) in OSCILLATING.items())
    return Finding(
        min(largest.values()) > VISIBLE_FRACTION,
        f"largest difference in the first 5 ms as a part of the range that both curves cover: {words}",
        {f"{name}_1": value for name, value in largest.items()},
    )


def early(choice: Choice, measured: Measured) -> Finding:
    """Answer check 1c: speeds and accelerations differ more in the first 5 ms than afterwards (root mean square)."""
    deviations = measured[PaperCase(choice=choice)].deviations
    words = ", ".join(
        f"{text} {three_digits(deviations[name].before)} and {three_digits(deviations[name].after)} {unit}"
        for name, (text, unit) in OSCILLATING.items()
    )
    return Finding(
        all(deviations[name].before > deviations[name].after for name in OSCILLATING),
        f"root mean square difference from the ideal curve before and after 5 ms: {words}",
        {f"{name}_{when}": getattr(deviations[name], when) for when in ("before", "after") for name in OSCILLATING},
    )


def within(choice: Choice, measured: Measured) -> Finding:
    """Answer check 1d: more than half of the integrated squared differences lies in the first 5 ms."""
    deviations = measured[PaperCase(choice=choice)].deviations
    words = ", ".join(f"{text} {percent(deviations[name].early)}" for name, (text, _) in OSCILLATING.items())
    return Finding(
        all(deviations[name].early > 0.5 for name in OSCILLATING),
        f"part of the integrated squared difference that lies before 5 ms: {words}",
        {f"{name}_early_1": deviations[name].early for name in OSCILLATING},
    )


def tenfold(choice: Choice, measured: Measured) -> Finding:
    """Answer check 2a: the largest contact force exceeds ten times the largest ideal reaction."""
    run = measured[PaperCase(choice=choice)]
    ratio = run.peak_force / run.ideal_force
    return Finding(
        ratio > 10.0,
        f"{_kilo(run.peak_force, 'N')} against {_kilo(run.ideal_force, 'N')} without clearance: {ratio:.2f} times",
        {"peak_N": run.peak_force, "ideal_N": run.ideal_force, "ratio_1": ratio},
    )


def fivefold(choice: Choice, measured: Measured) -> Finding:
    """Answer check 3a: the peak force at the highest speed is about five times that at the lowest speed."""
    peaks = criterion_for_values(BY_SPEED, PEAK_FORCE, grows)(choice, measured)
    slowest, *_, fastest = peaks.numbers.values()
    ratio = fastest / slowest
    return Finding(
        4.5 <= ratio < 5.5,
        f"{peaks.words}; {ratio:.2f} times from the slowest to the fastest",
        peaks.numbers | {"ratio_1": ratio},
    )


def faster(choice: Choice, measured: Measured) -> Finding:
    """Answer check 3b: peak force and peak torque grow with the speed."""
    runs = _of(BY_SPEED, choice, measured)
    both = {label: f"{_kilo(run.peak_force, 'N')} and {_kilo(run.peak_torque, 'N m')}" for label, run in runs.items()}
    torques = {label: run.peak_torque for label, run in runs.items()}
    return Finding(
        grows([run.peak_force for run in runs.values()]) and grows(list(torques.values())),
        _listed("peak force and torque", both),
        _named("peak_torque_{}_Nm", torques),
    )


def larger_motor(choice: Choice, measured: Measured) -> Finding:
    """Answer check 3c: clearance raises the peak torque at each speed."""
    runs = _of(BY_SPEED, choice, measured)
    return _torques("clearance", {label: (run.peak_torque, run.ideal_torque) for label, run in runs.items()})


def control_raises_torque(choice: Choice, measured: Measured) -> Finding:
    """Answer check 7b: control raises the peak torque at each clearance."""
    controlled = _of(CONSTRAINED, choice, measured)
    free = _of(clearances(*CONTROLLED), choice, measured)
    ideal = next(iter(controlled.values())).ideal_torque
    finding = _torques("control", {label: (run.peak_torque, free[label].peak_torque) for label, run in controlled.items()})
    return replace(finding, words=f"{finding.words}; the ideal mechanism needs {_kilo(ideal, 'N m')}")


def _torques(cause: str, pairs: Mapping[str, tuple[float, float]]) -> Finding:
    """Answer whether the peak torque is larger with a cause than without; `pairs` are the torques with and without [N m]."""
    both = {label: f"{_kilo(more, 'N m')} against {_kilo(less, 'N m')}" for label, (more, less) in pairs.items()}
    return Finding(
        all(more > less for more, less in pairs.values()),
        _listed(f"peak torque with and without {cause}", both),
        _named("ratio_{}_1", {label: more / less for label, (more, less) in pairs.items()}),
    )


def criterion_for_motions(group: Group, holds: Callable[[Sequence[Any]], bool]) -> Find:
    """Return the criterion that the motions of a group under the periodic drive satisfy the condition `holds`.

    The finding lists the kind of each motion, such as "periodic", with its largest Lyapunov exponent.
    """

    def find(choice: Choice, settled: Measured) -> Finding:
        motions = _of(group, choice, settled)
        words = _listed("", {label: motion.words for label, motion in motions.items()})
        numbers = _named("exponent_{}_per_s", {label: motion.exponent for label, motion in motions.items()})
        numbers |= _named("exponent_error_{}_per_s", {label: motion.exponent_error for label, motion in motions.items()})
        return Finding(holds(list(motions.values())), words, numbers)

    return find


def regular_at_04(motions: Sequence[Any]) -> bool:
    """Return True for check 5e: of the motions at 0.7, 0.6, 0.5, 0.4 and 0.3 mm only that at 0.4 mm is regular."""
    return [motion.regular for motion in motions] == [False, False, False, True, False]


def quasi_periodic(motions: Sequence[Any]) -> bool:
    """Return True for check 5f: all motions are quasi-periodic."""
    return all(motion.kind == "quasi-periodic" for motion in motions)


def exponents_fall(motions: Sequence[Any]) -> bool:
    """Return True for check 6e: each Lyapunov exponent is below the previous one by more than both standard errors."""
    return all(
        more.exponent + more.exponent_error < less.exponent - less.exponent_error for less, more in itertools.pairwise(motions)
    )
