"""Sections of the report beyond the paper's figures: regularity of the motion, control schemes, contact statistics."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.analysis.contact import contact_statistics
from scissordyn_paper.cases import ARRAY_CLEARANCE, CLEARANCES, CONTROLLED, FRICTION, OSCILLATION, SPEEDS, PaperCase
from scissordyn_paper.controlled import MANOEUVRES, ControlledRun, merits, mismatch
from scissordyn_paper.measures import JOINT
from scissordyn_paper.page import Cell, folded, paragraph, table
from scissordyn_paper.periodic import (
    BY_CLEARANCE,
    BY_FRICTION,
    CYCLES,
    ENSEMBLE_MEMBERS,
    GROWTH_CYCLES,
    GROWTH_SKIP,
    PERIODIC,
    SKIP,
    Regularity,
    regularity_of,
)
from scissordyn_paper.results import Results

VERDICT_TEXTS = {True: "regular", False: "irregular", None: "undecided"}  # Text of `Regularity.regular` in the table

PERIODIC_WITHIN = 1e-3
"""Change from one period to the next, divided by the clearance, below which motion is periodic, as in `analysis.verdict`."""

MERITS: tuple[tuple[str, str, float, str], ...] = (
    ("contact_fraction", "in contact [%]", 100.0, ".3g"),
    ("separations", "separations", 1.0, ".0f"),
    ("in_contact_from", "in contact from [s]", 1.0, ".3g"),
    ("peak_force", "peak force [kN]", 1e-3, ".3g"),
    ("peak_torque", "peak torque [kN m]", 1e-3, ".3g"),
    ("energy_used", "energy used [J]", 1.0, ".0f"),
    ("tracking_error", "angle error [mrad]", 1e3, ".3g"),
    ("position_error", "position error [mm]", 1e3, ".3g"),
    ("synchronisation_error", "synchronisation error [mm]", 1e3, ".3g"),
)
"""Figures of merit in the table: variable, title of the column, factor from SI units, and format of the number."""


def regularity_section(settled: Mapping[PaperCase, xr.Dataset]) -> list[str]:
    """Return the section on regular or irregular motion, by clearance and friction, with the evidence."""
    found = {case: regularity_of(run) for case, run in settled.items()}
    rows: list[Sequence[str | Cell] | str] = ["clearance, without friction"]
    rows += [_regular_row(case, found[case]) for case in BY_CLEARANCE]
    rows.append(f"friction coefficient, {1e3 * ARRAY_CLEARANCE:g} mm")
    rows += [_regular_row(case, found[case]) for case in BY_FRICTION]
    head = (
        "",
        "motion",
        "verdict",
        "trajectories",
        "K",
        "Lyapunov exponent [1/s]",
        "in contact [%]",
        "contacts per period",
        "starts diverge after [periods]",
    )
    evidence = [folded(f"{case.words}: {one.name}", "\n".join(one.evidence)) for case, one in found.items()]
    return [
        paragraph(
            "Regular, quasi-periodic and irregular are properties of the motion under a periodic drive; the paper's single "
            "stroke is not periodic. The paper does not state such a drive. Here the driven bar oscillates by "
            f"{math.degrees(OSCILLATION):.3g} deg about {math.degrees(PERIODIC.angle):.3g} deg, with the parameters of this "
            "report and a largest speed equal to that of the stroke. Each motion was simulated for "
            f"{CYCLES} periods, without the first "
            f"{SKIP}. Where the samples do not repeat, or starts that differ by round-off diverge, "
            f"{ENSEMBLE_MEMBERS} such starts were evaluated: "
            "a single trajectory beyond the predictability horizon is only one sample."
        ),
        paragraph(
            "K is that of the 0-1 test: near 0 regular, near 1 irregular; a dash where the samples repeat and the test does "
            "not apply. The exponent is the rate at which two neighbours diverge (positive) or converge (negative), over "
            f"{GROWTH_CYCLES - GROWTH_SKIP} periods, with its standard error. The verdict is based on the samples and K; the "
            "exponent is independent evidence."
        ),
        table(head, rows),
        *evidence,
    ]


def _regular_row(case: PaperCase, one: Regularity) -> list[str | Cell]:
    together = f"{one.agreeing} of {one.members}" if one.members > 1 else "1"
    numbers = (
        "–" if math.isnan(one.growth) else f"{one.growth:.2f}",
        f"{one.exponent:z.1f} ± {one.exponent_error:.1f}".replace("-", "−"),
        f"{100.0 * one.contact_fraction:.4g}",
        f"{one.impacts:.2f}",
        f"{one.trusted_cycles}" if one.trusted_cycles < one.followed_cycles else f"not in {one.followed_cycles}",
    )
    return [
        Cell(case.words, "nowrap"),
        one.name,
        Cell(VERDICT_TEXTS[one.regular], "nowrap"),
        Cell(together, "number"),
        *(Cell(text, "number") for text in numbers),
    ]


def control_section(results: Results) -> list[str]:
    """Return the section with figures of merit of the drives, with and without control."""
    rows: list[Sequence[str | Cell] | str] = []
    free = {size: merits(results.runs[PaperCase(size)], results.runs[PaperCase(None)]) for size in CONTROLLED}
    touching, kept = dict(free), dict(free)
    for size in CONTROLLED:
        ideal = results.runs[PaperCase(None)]
        touching[size] = merits(results.runs[PaperCase(size, start="in-contact")], ideal)
        kept[size] = merits(results.runs[PaperCase(size, constrained=True)], ideal)
        rows.append(f"{MANOEUVRES['stroke'].title}, {1e3 * size:g} mm")
        rows.append(_merit_row("prescribed, concentric start", free[size]))
        rows.append(_merit_row("prescribed, start in contact", touching[size]))
        rows.append(_merit_row("the paper's scheme: constrained contact", kept[size]))
        if size == ARRAY_CLEARANCE:
            rows += [_merit_row(f"{job.scheme}, concentric start", found) for job, found in _found(results, "stroke")]
    for manoeuvre in ("deployment", "periodic"):
        rows.append(f"{MANOEUVRES[manoeuvre].title}, {1e3 * ARRAY_CLEARANCE:g} mm")
        rows += [
            _merit_row(job.scheme, found, _change(results.controlled[job]) if manoeuvre == "periodic" else "")
            for job, found in _found(results, manoeuvre)
        ]
    return [
        *(paragraph(text) for text in _control_words(results, touching, kept)),
        table(("", *(title for _, title, _, _ in MERITS), "change per period"), rows),
        paragraph(
            "Errors against the ideal mechanism on the same reference; prescribed drives have no angle error by definition. "
            "Fractions of time and forces come from the table of contacts; torques and energies from samples, 25 µs apart in "
            "the stroke, "
            "50 µs on the deployment and 1 ms under the periodic drive, where short peaks are missed. Change per period: root "
            "mean square of the change of the eccentricity from one period to the next, in clearances; zero if it repeats.",
            "soft",
        ),
    ]


def _found(results: Results, manoeuvre: str) -> list[tuple[ControlledRun, dict[str, float]]]:
    ideal = next(run for job, run in results.controlled.items() if (job.manoeuvre, job.scheme) == (manoeuvre, "ideal"))
    return [
        (job, merits(run, ideal, MANOEUVRES[manoeuvre].after))
        for job, run in results.controlled.items()
        if job.manoeuvre == manoeuvre and job.scheme != "ideal"
    ]


def _change(run: xr.Dataset) -> str:
    return f"{mismatch(run, MANOEUVRES['periodic'].after):.2g}"


def _merit_row(name: str, found: Mapping[str, float], change: str = "") -> list[str | Cell]:
    cells = [
        "never" if name == "in_contact_from" and math.isnan(found[name]) else format(factor * found[name], form)
        for name, _, factor, form in MERITS
    ]
    return [Cell(name, "name"), *(Cell(text, "number") for text in (*cells, change))]


def _control_words(
    results: Results, touching: Mapping[float, Mapping[str, float]], kept: Mapping[float, Mapping[str, float]]
) -> list[str]:
    """Return sentences on the effects of the control schemes, from the figures of merit."""
    alike = [size for size in CONTROLLED if touching[size]["separations"] == 0.0 and kept[size]["separations"] == 0.0]
    more = max(abs(kept[size]["peak_torque"] / touching[size]["peak_torque"] - 1.0) for size in CONTROLLED)
    stroke = (
        "The paper's scheme prescribes the eccentricity as a constraint and starts in contact. "
        + (
            "At every clearance the same start without any control keeps contact as well: here the scheme has no effect "
            "beyond that of the start"
            if len(alike) == len(CONTROLLED)
            else f"Without control the same start keeps contact at {len(alike)} of {len(CONTROLLED)} clearances"
        )
        + f"; the largest torques differ by at most {100.0 * more:.1f} %."
    )
    on_stroke, slow = (
        {job.scheme: found for job, found in _found(results, manoeuvre)} for manoeuvre in ("stroke", "deployment")
    )
    driven, steered = slow["prescribed"], slow["feed-forward, feedback"]
    free = merits(results.runs[PaperCase(ARRAY_CLEARANCE)], results.runs[PaperCase(None)])
    best = max(on_stroke.values(), key=lambda found: found["contact_fraction"])
    practical = (
        f"A practical controller on a slow deployment keeps contact from {steered['in_contact_from']:.3g} s on instead of "
        f"{driven['in_contact_from']:.3g} s, with {steered['separations']:.0f} instead of {driven['separations']:.0f} "
        f"separations and {steered['peak_torque']:.0f} instead of {driven['peak_torque']:.0f} N m; the peak force decreases "
        f"little, from {1e-3 * driven['peak_force']:.2f} to {1e-3 * steered['peak_force']:.2f} kN, because the first impact "
        "ends a free fall that no torque prevents. At 150 rpm from a concentric start it has little effect: "
        f"{100.0 * best['contact_fraction']:.0f} % of the time in contact at best, against "
        f"{100.0 * free['contact_fraction']:.0f} %."
    )
    changes = {
        job.scheme: mismatch(run, MANOEUVRES["periodic"].after)
        for job, run in results.controlled.items()
        if job.manoeuvre == "periodic" and job.scheme != "ideal"
    }
    delayed = (
        f"Delayed feedback on the periodic drive: the motion changes from period to period by {changes['servo']:.2g} "
        "clearances with "
        f"the servo alone, {changes['pyragas']:.2g} with Pyragas's feedback, {changes['extended']:.2g} with the extended one. "
        + (
            "Neither makes the motion periodic."
            if min(changes["pyragas"], changes["extended"]) > PERIODIC_WITHIN
            else "Where that is nearly zero the joint is in periodic contact during the evaluated periods; its stability "
            "would need a longer run."
        )
        + " These are single trajectories of an irregular motion, and differences of a factor of two are not significant."
    )
    return [stroke, practical, delayed]


def contacts_section(results: Results) -> list[str]:
    """Return the section with contact statistics of all runs that the figures use."""
    groups = {
        "clearance, 150 rpm": [PaperCase(size) for size in CLEARANCES],
        "speed, 0.5 mm": [PaperCase(speed=speed) for speed in SPEEDS],
        "friction, 0.5 mm, 150 rpm": [PaperCase(friction=friction) for friction in FRICTION],
    }
    rows: list[Sequence[str | Cell] | str] = []
    for title, cases in groups.items():
        rows.append(title)
        for case in cases:
            name = f"{case.rpm} rpm" if title.startswith("speed") else case.words
            rows.append(_contact_row(name, results.runs[case], results.runs[case.ideal]))
    head = (
        "",
        "impacts",
        "in flight [%]",
        "longest flight [ms]",
        "arc with 95 % [deg]",
        "peak force: median, 95 %, largest [kN]",
        "force in contact: median, 95 % [kN]",
        "impulse: mean, largest [N s]",
        f"dissipation in joint {JOINT}: damping, friction [J]",
        "output error: largest, rms [mm]",
    )
    return [
        paragraph(
            "Counts, fractions of time, impulses and losses come from the table of contacts; arcs and the force in contact "
            f"come from the samples, 25 µs apart. Only joint {JOINT} has clearance, so all energy is dissipated there. The "
            "output error is that of the slider against the ideal mechanism at the same instants."
        ),
        table(head, rows),
    ]


def _contact_row(name: str, run: xr.Dataset, ideal: xr.Dataset) -> list[str | Cell]:
    found = contact_statistics(run, ideal=ideal)
    one = found.sel(joint=JOINT)

    def number(variable: str, quantile: float | None = None) -> float:
        return float(one[variable] if quantile is None else one[variable].sel(quantile=quantile))

    cells = (
        f"{number('impacts'):.0f}",
        f"{100.0 * number('flight_fraction'):.3g}",
        f"{1e3 * number('longest_flight'):.3g}",
        f"{math.degrees(number('contact_arc_95')):.0f}",
        ", ".join(
            f"{1e-3 * value:.1f}"
            for value in (number("peak_force_quantile", 0.5), number("peak_force_quantile", 0.95), number("peak_force"))
        ),
        ", ".join(f"{1e-3 * number('contact_force_quantile', fraction):.1f}" for fraction in (0.5, 0.95)),
        f"{number('impulse_mean'):.2f}, {number('impulse_largest'):.2f}",
        f"{number('damping_loss'):.2f}, {number('friction_loss'):.2f}",
        f"{1e3 * float(found['output_error_max']):.3f}, {1e3 * float(found['output_error_rms']):.3f}",
    )
    return [Cell(name, "nowrap"), *(Cell(text, "number") for text in cells)]


DEGREES_PER_RADIAN = 180.0 / math.pi  # Factor from radians to degrees


@dataclass(frozen=True)
class Column:
    """A quantity of the first contacts, with its values from the second program."""

    variable: str  # Variable of the run
    title: str
    unit: str
    factor: float  # Factor from SI units to `unit`
    reference: tuple[str, ...]  # Value of each contact, with the digits that are equal for tolerances of 2e-13 and 3e-14


REFERENCE = (
    Column("contact_start", "starts", "s", 1.0, ("0.0013651259130", "0.0031639798805", "0.0053665921273")),
    Column("approach_speed", "approach speed", "m/s", 1.0, ("0.73514298384", "0.34484394745", "0.62238044736")),
    Column(
        "contact_angle",
        "direction of the normal",
        "deg",
        DEGREES_PER_RADIAN,
        ("-107.816990465", "179.866471441", "-123.959802923"),
    ),
    Column("peak_normal_force", "peak force", "N", 1.0, ("42701.9244", "82944.8947", "40856.8058")),
    Column("peak_normal_time", "time to peak", "s", 1.0, ("0.00011997917", "0.00040370370", "0.00013061164")),
    Column("contact_duration", "duration", "s", 1.0, ("0.00027482661706", "0.00099355989906", "0.00029513987981")),
    Column("rebound_speed", "rebound", "m/s", 1.0, ("-0.6236406636", "-0.2974059743", "-0.5760923414")),
)
"""Quantities of the first contacts with the values of the second program, which integrates Lagrange's equations in minimal
coordinates: default choice, Liu stiffness, Flores damping, 0.5 mm, 150 rpm, no friction."""


def first_contacts_section(run: xr.Dataset) -> list[str]:
    """Return the section that compares the first contacts at 0.5 mm without friction with a second program."""
    rows: list[Sequence[str | Cell]] = []
    for name, *numbers in event_table(run):
        values, difference = (text.replace("-", "−") for text in numbers[:2]), numbers[2]
        rows.append([name, *(Cell(text, "number") for text in (*values, difference))])
    return [
        paragraph(
            "The run at 0.5 mm and 150 rpm without friction, compared with a second program that integrates Lagrange's "
            "equations in minimal coordinates. The first contact start is independent of the contact law; afterwards "
            "differences grow from one contact to the next."
        ),
        table(("", "reference", "here", "relative difference"), rows),
    ]


def event_table(run: xr.Dataset) -> list[tuple[str, str, str, str]]:
    """Return a row for each quantity of each first contact: name, reference value, value of the run, relative difference."""
    rows = []
    for contact in range(len(REFERENCE[0].reference)):
        for column in REFERENCE:
            expected = column.reference[contact]
            found = float(run[column.variable].values[contact]) * column.factor
            difference = abs(found / float(expected) - 1.0)
            shown = np.format_float_positional(found, precision=11, unique=False, fractional=False, trim="-")
            rows.append((f"contact {contact + 1}: {column.title} [{column.unit}]", expected, shown, f"{difference:.0e}"))
    return rows
