"""Criteria of the checks: from measured runs to yes or no, with the numbers."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scissordyn_paper.cases import CONTROLLED, SPEEDS, Choice, PaperCase
from scissordyn_paper.verdict import Finding

VISIBLE_FRACTION = 0.01  # Smallest visible difference as a fraction of a curve's range: a line's width in a printed figure
QUARTER_ARC_MAX = 99.0  # "About a quarter" of the bearing: 90 deg and a tenth of it

OSCILLATING = {
    "slider_velocity": ("slider velocity", "m/s"),
    "slider_acceleration": ("slider acceleration", "m/s²"),
    "angular_velocity": ("angular velocity of bar 2", "rad/s"),
    "angular_acceleration": ("angular acceleration of bar 2", "rad/s²"),
}

Measured = Mapping[PaperCase, Any]  # Measures of strokes, or the regularity of motions under the periodic drive
Find = Callable[[Choice, Measured], Finding]
Holds = Callable[[Sequence[float]], bool]
Group = Mapping[str, PaperCase]  # Runs by what differs between them, in words


def millimetres(size: float) -> str:
    """A length as text, in mm."""
    return f"{1e3 * size:g} mm"


def percent(value: float) -> str:
    """A fraction as text, in percent."""
    return f"{100.0 * value:.3g} %"


def _kilo(value: float, unit: str) -> str:
    return f"{1e-3 * value:.1f} k{unit}"


def clearances(*sizes: float) -> Group:
    """The strokes with some clearances."""
    return {millimetres(size): PaperCase(size) for size in sizes}


def frictions(*coefficients: float) -> Group:
    """The strokes with some friction coefficients."""
    return {f"{friction:g}": PaperCase(friction=friction) for friction in coefficients}


BY_SPEED = {f"{case.rpm} rpm": case for case in (PaperCase(speed=speed) for speed in SPEEDS)}
CONSTRAINED = {millimetres(size): PaperCase(size, constrained=True) for size in CONTROLLED}


@dataclass(frozen=True)
class Quantity:
    """A number of each run of a group, and how it is written."""

    attribute: str  # Attribute of the measurements
    title: str  # Title of the list of values; "" if each value has it
    form: str
    number: str  # Its name, in which {} is the run
    factor: float = 1.0  # Factor from SI to the written number


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


def compared(group: Group, quantity: Quantity, holds: Holds) -> Find:
    """The criterion that the values of a quantity satisfy a condition, in the order of the group."""

    def find(choice: Choice, measured: Measured) -> Finding:
        values = {label: getattr(run, quantity.attribute) for label, run in _of(group, choice, measured).items()}
        words = _listed(quantity.title, {k: quantity.form.format(quantity.factor * value) for k, value in values.items()})
        return Finding(holds(list(values.values())), words, _named(quantity.number, values))

    return find


def every(compare: Callable[[float, float], bool], bound: float) -> Holds:
    """Make a test that all values are on one side of a bound."""
    return lambda values: all(compare(value, bound) for value in values)


def only(compare: Callable[[float, float], bool], at: int) -> Holds:
    """Make a test that the value at an index is smaller, or larger, than each of the others."""

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
    """1a: differences of displacement and angle."""
    run = measured[PaperCase(choice=choice)]
    position, angle = run.position_deviation, run.angle_deviation
    return Finding(
        max(position, angle) < VISIBLE_FRACTION,
        f"largest difference: displacement {percent(position)}, angle {percent(angle)} of the range that both curves cover",
        {"position_deviation_1": position, "angle_deviation_1": angle},
    )


def oscillation(choice: Choice, measured: Measured) -> Finding:
    """1b: largest differences of speeds and accelerations in the first interval."""
    deviations = measured[PaperCase(choice=choice)].deviations
    largest = {name: deviations[name].largest for name in OSCILLATING}
    words = ", ".join(f"{text} {percent(largest[name])}" for name, (text, _) in OSCILLATING.items())
    return Finding(
        min(largest.values()) > VISIBLE_FRACTION,
        f"largest difference in the first 5 ms as a part of the range that both curves cover: {words}",
        {f"{name}_1": value for name, value in largest.items()},
    )


def early(choice: Choice, measured: Measured) -> Finding:
    """1c: level of the differences in the first interval and after it."""
    deviations = measured[PaperCase(choice=choice)].deviations
    words = ", ".join(
        f"{text} {deviations[name].before:.3g} and {deviations[name].after:.3g} {unit}"
        for name, (text, unit) in OSCILLATING.items()
    )
    return Finding(
        all(deviations[name].before > deviations[name].after for name in OSCILLATING),
        f"root mean square difference from the ideal curve before and after 5 ms: {words}",
        {f"{name}_{when}": getattr(deviations[name], when) for when in ("before", "after") for name in OSCILLATING},
    )


def within(choice: Choice, measured: Measured) -> Finding:
    """1d: part of the differences that lies in the first interval."""
    deviations = measured[PaperCase(choice=choice)].deviations
    words = ", ".join(f"{text} {percent(deviations[name].early)}" for name, (text, _) in OSCILLATING.items())
    return Finding(
        all(deviations[name].early > 0.5 for name in OSCILLATING),
        f"part of the integrated squared difference that lies before 5 ms: {words}",
        {f"{name}_early_1": deviations[name].early for name in OSCILLATING},
    )


def tenfold(choice: Choice, measured: Measured) -> Finding:
    """2a: contact force against ideal reaction."""
    run = measured[PaperCase(choice=choice)]
    ratio = run.peak_force / run.ideal_force
    return Finding(
        ratio > 10.0,
        f"{_kilo(run.peak_force, 'N')} against {_kilo(run.ideal_force, 'N')} without clearance: {ratio:.2f} times",
        {"peak_N": run.peak_force, "ideal_N": run.ideal_force, "ratio_1": ratio},
    )


def fivefold(choice: Choice, measured: Measured) -> Finding:
    """3a: ratio of the peak forces at the highest and lowest speed."""
    peaks = compared(BY_SPEED, PEAK_FORCE, grows)(choice, measured)
    slowest, *_, fastest = peaks.numbers.values()
    ratio = fastest / slowest
    return Finding(
        4.5 <= ratio < 5.5,
        f"{peaks.words}; {ratio:.2f} times from the slowest to the fastest",
        peaks.numbers | {"ratio_1": ratio},
    )


def faster(choice: Choice, measured: Measured) -> Finding:
    """3b: peak force and torque by speed."""
    runs = _of(BY_SPEED, choice, measured)
    both = {label: f"{_kilo(run.peak_force, 'N')} and {_kilo(run.peak_torque, 'N m')}" for label, run in runs.items()}
    torques = {label: run.peak_torque for label, run in runs.items()}
    return Finding(
        grows([run.peak_force for run in runs.values()]) and grows(list(torques.values())),
        _listed("peak force and torque", both),
        _named("peak_torque_{}_Nm", torques),
    )


def larger_motor(choice: Choice, measured: Measured) -> Finding:
    """3c: peak torque with and without clearance."""
    runs = _of(BY_SPEED, choice, measured)
    return _torques("clearance", {label: (run.peak_torque, run.ideal_torque) for label, run in runs.items()})


def dearer(choice: Choice, measured: Measured) -> Finding:
    """7b: peak torque with and without control."""
    controlled = _of(CONSTRAINED, choice, measured)
    free = _of(clearances(*CONTROLLED), choice, measured)
    ideal = next(iter(controlled.values())).ideal_torque
    finding = _torques("control", {label: (run.peak_torque, free[label].peak_torque) for label, run in controlled.items()})
    return replace(finding, words=f"{finding.words}; the ideal mechanism needs {_kilo(ideal, 'N m')}")


def _torques(cause: str, pairs: Mapping[str, tuple[float, float]]) -> Finding:
    """Find whether the peak torque is larger with a cause than without it."""
    both = {label: f"{_kilo(more, 'N m')} against {_kilo(less, 'N m')}" for label, (more, less) in pairs.items()}
    return Finding(
        all(more > less for more, less in pairs.values()),
        _listed(f"peak torque with and without {cause}", both),
        _named("ratio_{}_1", {label: more / less for label, (more, less) in pairs.items()}),
    )


def classified(group: Group, holds: Callable[[Sequence[Any]], bool]) -> Find:
    """Return the criterion that `holds` is true of the kinds of motion, such as chaotic, of a group under the periodic drive.

    The finding lists the kinds with their largest Lyapunov exponents.
    """

    def find(choice: Choice, settled: Measured) -> Finding:
        motions = _of(group, choice, settled)
        words = _listed("", {label: motion.words for label, motion in motions.items()})
        numbers = _named("exponent_{}_per_s", {label: motion.exponent for label, motion in motions.items()})
        numbers |= _named("exponent_error_{}_per_s", {label: motion.exponent_error for label, motion in motions.items()})
        return Finding(holds(list(motions.values())), words, numbers)

    return find


def regular_at_04(motions: Sequence[Any]) -> bool:
    """5e: whether of 0.7, 0.6, 0.5, 0.4 and 0.3 mm the motion is regular at 0.4 mm alone."""
    return [motion.regular for motion in motions] == [False, False, False, True, False]


def quasi_periodic(motions: Sequence[Any]) -> bool:
    """5f: whether all are quasi-periodic."""
    return all(motion.kind == "quasi-periodic" for motion in motions)


def calmer(motions: Sequence[Any]) -> bool:
    """6e: whether each exponent is below the one before by more than both standard errors."""
    return all(
        more.exponent + more.exponent_error < less.exponent - less.exponent_error for less, more in itertools.pairwise(motions)
    )
