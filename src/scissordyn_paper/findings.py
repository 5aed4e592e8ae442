"""Evaluation of the clauses of the paper: from measured runs to yes or no, with the numbers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from scissordyn_paper.cases import CLEARANCES, CONTROLLED, FRICTION, SIZES, SPEEDS, Choice, PaperCase
from scissordyn_paper.measures import CONTINUOUS, Measures
from scissordyn_paper.verdict import Finding, Measured

VISIBLE = 0.01  # Smallest visible difference as a fraction of a curve's range: a line's width in a printed figure
QUARTER = math.radians(99.0)  # "About a quarter" of the bearing: 90 deg and a tenth of it

OSCILLATING = {
    "slider_velocity": ("slider velocity", "m/s"),
    "slider_acceleration": ("slider acceleration", "m/s²"),
    "angular_velocity": ("angular velocity of bar 2", "rad/s"),
    "angular_acceleration": ("angular acceleration of bar 2", "rad/s²"),
}


def _sizes(choice: Choice, measured: Measured, sizes: Sequence[float]) -> dict[float, Measures]:
    return {size: measured[PaperCase(size, choice=choice)] for size in sizes}


def _by_friction(choice: Choice, measured: Measured) -> dict[float, Measures]:
    return {friction: measured[PaperCase(friction=friction, choice=choice)] for friction in FRICTION}


def _grows(values: Sequence[float]) -> bool:
    return all(low < high for low, high in itertools.pairwise(values))


def _listed(label: str, items: dict[str, str]) -> str:
    return f"{label}: " + ", ".join(f"{value} at {name}" for name, value in items.items())


def millimetres(size: float) -> str:
    """A length as text, in mm."""
    return f"{1e3 * size:g} mm"


def _rpm(speed: float) -> str:
    return f"{speed * 30.0 / math.pi:.0f} rpm"


def _kilo(value: float, unit: str) -> str:
    return f"{1e-3 * value:.1f} k{unit}"


def percent(value: float) -> str:
    """A fraction as text, in percent."""
    return f"{100.0 * value:.3g} %"


def position(choice: Choice, measured: Measured) -> Finding:
    """1a: differences of displacement and angle."""
    found = measured[PaperCase(choice=choice)]
    position, angle = found.position_deviation, found.angle_deviation
    return Finding(
        max(position, angle) < VISIBLE,
        f"largest difference: displacement {percent(position)}, angle {percent(angle)} of the range that both curves cover",
        {"position_deviation_1": position, "angle_deviation_1": angle},
    )


def oscillation(choice: Choice, measured: Measured) -> Finding:
    """1b: largest differences of speeds and accelerations in the first interval."""
    found = measured[PaperCase(choice=choice)].deviations
    largest = {name: found[name].largest for name in OSCILLATING}
    words = ", ".join(f"{text} {percent(largest[name])}" for name, (text, _) in OSCILLATING.items())
    return Finding(
        min(largest.values()) > VISIBLE,
        f"largest difference in the first 5 ms as a part of the range that both curves cover: {words}",
        {f"{name}_1": value for name, value in largest.items()},
    )


def early(choice: Choice, measured: Measured) -> Finding:
    """1c: level of the differences in the first interval and after it."""
    found = measured[PaperCase(choice=choice)].deviations
    words = ", ".join(
        f"{text} {found[name].before:.3g} and {found[name].after:.3g} {unit}" for name, (text, unit) in OSCILLATING.items()
    )
    numbers = {f"{name}_before": found[name].before for name in OSCILLATING}
    numbers |= {f"{name}_after": found[name].after for name in OSCILLATING}
    return Finding(
        all(found[name].before > found[name].after for name in OSCILLATING),
        f"root mean square difference from the ideal curve before and after 5 ms: {words}",
        numbers,
    )


def within(choice: Choice, measured: Measured) -> Finding:
    """1d: part of the differences that lies in the first interval."""
    found = measured[PaperCase(choice=choice)].deviations
    words = ", ".join(f"{text} {percent(found[name].early)}" for name, (text, _) in OSCILLATING.items())
    return Finding(
        all(found[name].early > 0.5 for name in OSCILLATING),
        f"part of the integrated squared difference that lies before 5 ms: {words}",
        {f"{name}_early_1": found[name].early for name in OSCILLATING},
    )


def tenfold(choice: Choice, measured: Measured) -> Finding:
    """2a: contact force against ideal reaction."""
    found = measured[PaperCase(choice=choice)]
    ratio = found.peak_force / found.ideal_force
    return Finding(
        ratio > 10.0,
        f"{_kilo(found.peak_force, 'N')} against {_kilo(found.ideal_force, 'N')} without clearance: {ratio:.2f} times",
        {"peak_N": found.peak_force, "ideal_N": found.ideal_force, "ratio_1": ratio},
    )


def fivefold(choice: Choice, measured: Measured) -> Finding:
    """3a: ratio of the peak forces at the highest and lowest speed."""
    peaks = [measured[PaperCase(speed=speed, choice=choice)].peak_force for speed in SPEEDS]
    ratio = peaks[-1] / peaks[0]
    shown = {_rpm(speed): _kilo(peak, "N") for speed, peak in zip(SPEEDS, peaks, strict=True)}
    return Finding(
        4.5 <= ratio < 5.5,
        f"{_listed('peak force', shown)}; {ratio:.2f} times from the slowest to the fastest",
        {f"peak_{_rpm(speed).replace(' ', '_')}_N": peak for speed, peak in zip(SPEEDS, peaks, strict=True)}
        | {"ratio_1": ratio},
    )


def faster(choice: Choice, measured: Measured) -> Finding:
    """3b: peak force and torque by speed."""
    found = {speed: measured[PaperCase(speed=speed, choice=choice)] for speed in SPEEDS}
    forces, torques = [m.peak_force for m in found.values()], [m.peak_torque for m in found.values()]
    return Finding(
        _grows(forces) and _grows(torques),
        _listed(
            "peak force and torque",
            {_rpm(s): f"{_kilo(m.peak_force, 'N')} and {_kilo(m.peak_torque, 'N m')}" for s, m in found.items()},
        ),
        {f"peak_torque_{_rpm(speed).replace(' ', '_')}_Nm": torque for speed, torque in zip(SPEEDS, torques, strict=True)},
    )


def larger_motor(choice: Choice, measured: Measured) -> Finding:
    """3c: peak torque with and without clearance."""
    found = {speed: measured[PaperCase(speed=speed, choice=choice)] for speed in SPEEDS}
    shown = {_rpm(s): f"{_kilo(m.peak_torque, 'N m')} against {_kilo(m.ideal_torque, 'N m')}" for s, m in found.items()}
    return Finding(
        all(m.peak_torque > m.ideal_torque for m in found.values()),
        _listed("peak torque with and without clearance", shown),
        {f"ratio_{_rpm(s).replace(' ', '_')}_1": m.peak_torque / m.ideal_torque for s, m in found.items()},
    )


def smaller_force(choice: Choice, measured: Measured) -> Finding:
    """4a: peak force by clearance."""
    found = _sizes(choice, measured, SIZES)
    return Finding(
        _grows([found[size].peak_force for size in reversed(SIZES)]),
        _listed("peak force", {millimetres(size): _kilo(m.peak_force, "N") for size, m in found.items()}),
        {f"peak_{millimetres(size).replace(' ', '_')}_N": m.peak_force for size, m in found.items()},
    )


def smaller_torque(choice: Choice, measured: Measured) -> Finding:
    """4b: peak torque by clearance."""
    found = _sizes(choice, measured, SIZES)
    return Finding(
        _grows([found[size].peak_torque for size in reversed(SIZES)]),
        _listed("peak torque", {millimetres(size): _kilo(m.peak_torque, "N m") for size, m in found.items()}),
        {f"peak_{millimetres(size).replace(' ', '_')}_Nm": m.peak_torque for size, m in found.items()},
    )


def more_impacts(choice: Choice, measured: Measured) -> Finding:
    """4c: early impacts by clearance."""
    found = _sizes(choice, measured, SIZES)
    return Finding(
        _grows([found[size].early_impacts for size in SIZES]),
        _listed("contacts begun before 30 ms", {millimetres(size): str(m.early_impacts) for size, m in found.items()}),
        {f"impacts_{millimetres(size).replace(' ', '_')}_1": m.early_impacts for size, m in found.items()},
    )


def late_force(choice: Choice, measured: Measured) -> Finding:
    """4d: late peak force by clearance."""
    found = _sizes(choice, measured, SIZES)
    least = found[SIZES[-1]].late_peak_force
    return Finding(
        all(least > found[size].late_peak_force for size in SIZES[:-1]),
        _listed("peak force after 30 ms", {millimetres(size): _kilo(m.late_peak_force, "N") for size, m in found.items()}),
        {f"late_peak_{millimetres(size).replace(' ', '_')}_N": m.late_peak_force for size, m in found.items()},
    )


def late_impacts(choice: Choice, measured: Measured) -> Finding:
    """4e: late impacts by clearance."""
    found = _sizes(choice, measured, SIZES)
    least = found[SIZES[-1]].late_rate
    return Finding(
        all(least > found[size].late_rate for size in SIZES[:-1]),
        _listed(
            "contacts begun per second after 30 ms", {millimetres(size): f"{m.late_rate:.0f}" for size, m in found.items()}
        ),
        {f"late_rate_{millimetres(size).replace(' ', '_')}_per_s": m.late_rate for size, m in found.items()},
    )


def _continuous(size: float, choice: Choice, measured: Measured) -> Finding:
    fraction = measured[PaperCase(size, choice=choice)].settled_fraction
    return Finding(
        fraction >= CONTINUOUS,
        f"in contact {percent(fraction)} of the time after 5 ms at {millimetres(size)}",
        {"fraction_1": fraction},
    )


def continuous_04(choice: Choice, measured: Measured) -> Finding:
    """5a: fraction of contact at 0.4 mm."""
    return _continuous(0.4e-3, choice, measured)


def flying(choice: Choice, measured: Measured) -> Finding:
    """5b: fraction of contact at the clearances that the paper calls irregular."""
    others = _sizes(choice, measured, [size for size in CLEARANCES if size not in (0.4e-3, 0.2e-3)])
    return Finding(
        all(m.settled_fraction < CONTINUOUS for m in others.values()),
        _listed(
            "fraction of time in contact after 5 ms",
            {millimetres(size): percent(m.settled_fraction) for size, m in others.items()},
        ),
        {f"fraction_{millimetres(size).replace(' ', '_')}_1": m.settled_fraction for size, m in others.items()},
    )


def more_often(choice: Choice, measured: Measured) -> Finding:
    """5c: impacts at the larger clearances."""
    found = _sizes(choice, measured, CLEARANCES[:3])
    return Finding(
        _grows([m.impacts for m in found.values()]),
        _listed("contacts", {millimetres(size): str(m.impacts) for size, m in found.items()}),
        {f"impacts_{millimetres(size).replace(' ', '_')}_1": m.impacts for size, m in found.items()},
    )


def again_more(choice: Choice, measured: Measured) -> Finding:
    """5d: impacts at the smaller clearances."""
    found = _sizes(choice, measured, CLEARANCES[3:])
    fewest = found[0.4e-3].impacts
    return Finding(
        all(found[size].impacts > fewest for size in (0.3e-3, 0.2e-3)),
        _listed("contacts", {millimetres(size): str(m.impacts) for size, m in found.items()}),
        {f"impacts_{millimetres(size).replace(' ', '_')}_1": m.impacts for size, m in found.items()},
    )


def _scatter(found: dict[float, Measures]) -> tuple[str, dict[str, float]]:
    return (
        _listed(
            "scatter of the slider acceleration", {millimetres(size): f"{m.irregularity:.3g}" for size, m in found.items()}
        ),
        {f"scatter_{millimetres(size).replace(' ', '_')}_1": m.irregularity for size, m in found.items()},
    )


def regular(choice: Choice, measured: Measured) -> Finding:
    """5e: scatter of the acceleration by clearance."""
    found = _sizes(choice, measured, CLEARANCES[:5])
    least = found[0.4e-3].irregularity
    return Finding(all(least < m.irregularity for size, m in found.items() if size != 0.4e-3), *_scatter(found))


def quasi_periodic(choice: Choice, measured: Measured) -> Finding:
    """5f: scatter of the acceleration at the smaller clearances."""
    found = _sizes(choice, measured, CLEARANCES[3:])
    values = [found[size].irregularity for size in (0.4e-3, 0.2e-3, 0.3e-3)]
    return Finding(_grows(values), *_scatter(found))


def fewer_rebounds(choice: Choice, measured: Measured) -> Finding:
    """6a: impacts by friction coefficient."""
    found = _by_friction(choice, measured)
    return Finding(
        _grows([-m.impacts for m in found.values()]),
        _listed("contacts", {f"{friction:g}": str(m.impacts) for friction, m in found.items()}),
        {f"impacts_{friction:g}_1": m.impacts for friction, m in found.items()},
    )


def rebounding(choice: Choice, measured: Measured) -> Finding:
    """6b: fraction of contact at the end, least friction."""
    fraction = measured[PaperCase(friction=FRICTION[0], choice=choice)].final_fraction
    return Finding(
        fraction < CONTINUOUS,
        f"in contact {percent(fraction)} of the last fifth of the run at {FRICTION[0]:g}",
        {"final_fraction_1": fraction},
    )


def eventually(choice: Choice, measured: Measured) -> Finding:
    """6c: fraction of contact at the end, more friction."""
    found = {friction: m for friction, m in _by_friction(choice, measured).items() if friction > FRICTION[0]}
    shown = {f"{friction:g}": percent(m.final_fraction) for friction, m in found.items()}
    return Finding(
        all(m.final_fraction >= CONTINUOUS for m in found.values()),
        _listed("fraction of the last fifth of the run in contact", shown),
        {f"final_fraction_{friction:g}_1": m.final_fraction for friction, m in found.items()},
    )


def quarter(choice: Choice, measured: Measured) -> Finding:
    """6d: contact arc by friction coefficient."""
    found = _by_friction(choice, measured)
    shown = {f"{friction:g}": f"{math.degrees(m.arc):.0f} deg" for friction, m in found.items()}
    return Finding(
        all(m.arc <= QUARTER for m in found.values()),
        _listed("arc with 95 % of the contact time", shown),
        {f"arc_{friction:g}_deg": math.degrees(m.arc) for friction, m in found.items()},
    )


def calmer(choice: Choice, measured: Measured) -> Finding:
    """6e: scatter of the acceleration by friction coefficient."""
    found = _by_friction(choice, measured)
    values = [m.irregularity for m in found.values()]
    shown = {f"{friction:g}": f"{m.irregularity:.3g}" for friction, m in found.items()}
    return Finding(
        _grows([-value for value in values]),
        _listed("scatter of the slider acceleration", shown),
        {f"scatter_{friction:g}_1": m.irregularity for friction, m in found.items()},
    )


def constrained(choice: Choice, measured: Measured) -> Finding:
    """7a: smallest normal force with control."""
    found = {size: measured[PaperCase(size, constrained=True, choice=choice)] for size in CONTROLLED}
    return Finding(
        all(m.smallest_force > 0.0 for m in found.values()),
        _listed("smallest normal force", {millimetres(size): _kilo(m.smallest_force, "N") for size, m in found.items()}),
        {f"smallest_{millimetres(size).replace(' ', '_')}_N": m.smallest_force for size, m in found.items()},
    )


def dearer(choice: Choice, measured: Measured) -> Finding:
    """7b: peak torque with and without control."""
    both = {
        size: (measured[PaperCase(size, constrained=True, choice=choice)], measured[PaperCase(size, choice=choice)])
        for size in CONTROLLED
    }
    shown = {
        millimetres(size): f"{_kilo(constrained.peak_torque, 'N m')} against {_kilo(free.peak_torque, 'N m')}"
        for size, (constrained, free) in both.items()
    }
    ideal = both[CONTROLLED[0]][0].ideal_torque
    return Finding(
        all(constrained.peak_torque > free.peak_torque for constrained, free in both.values()),
        f"{_listed('peak torque with and without control', shown)}; the ideal mechanism needs {_kilo(ideal, 'N m')}",
        {
            f"ratio_{millimetres(size).replace(' ', '_')}_1": constrained.peak_torque / free.peak_torque
            for size, (constrained, free) in both.items()
        },
    )
