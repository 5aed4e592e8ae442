"""What the page says of a run: cards from its summary, the table of its contacts, how compared runs differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.numeral import decimals
from scissordyn.plot.scale import Scale, engineering
from scissordyn.run.answer.joint_force import LESS, ForceAnswer, kinds_left_out, parts_of_oiled
from scissordyn.units import counted, short

if TYPE_CHECKING:
    from scissordyn.explore.case import Case
    from scissordyn.run.answer.summary import ActuatorAnswer, PointAnswer, Summary
    from scissordyn.run.results import Run

MOST_CARDS = 3  # Cards of tracked points, and of torques; those that are furthest beyond what is allowed come first
MOST_NUMBERS = 4  # Of one run in a legend; of more the number is said

COLUMNS = (
    ("contact_start", "start", "s"),
    ("approach_speed", "approach", "m/s"),
    ("impulse", "impulse", "N s"),
    ("peak_force", "peak force", "N"),
    ("contact_duration", "duration", "s"),
    ("rebound_speed", "rebound", "m/s"),
)

SMALL = {"s": (10.0, "ms"), "m/s": (0.2, "mm/s")}
"""Columns of smaller numbers are in a thousandth of the unit: contacts last for less than a digit of seconds."""

Card = dict[str, str]


def cards(summary: Summary) -> list[Card]:
    """What the designer asked for, in short."""
    return list(_cards(summary))


def _cards(summary: Summary) -> Iterator[Card]:
    force, bars = summary.force, summary.bars
    if force is not None:
        detail = f"{force.joint}, at {short(force.when, 's')}{_estimated(force)}{parts_of_oiled(force.metal, force.film)}"
        yield _card("largest force", short(force.force, "N"), detail)
    yield from map(_of_point, sorted(summary.points, key=lambda point: -point.share)[:MOST_CARDS])
    torques = [actuator for actuator in summary.actuators if math.isfinite(actuator.torque)]
    torques.sort(key=lambda actuator: -actuator.torque / (actuator.limit or math.inf))
    yield from map(_of_torque, torques[:MOST_CARDS])
    if bars is not None and math.isfinite(bars.stress):
        detail = f"{bars.bar}, at {short(bars.when, 's')}"
        limited = math.isfinite(bars.utilisation)
        utilised = f"{bars.utilisation:.3g} of yield strength" if limited else ""
        met = bars.utilisation <= 1.0 if limited else None
        yield _card("largest stress", short(bars.stress, "Pa"), detail, utilised, met=met)
    if summary.span is not None:
        start, end = (max(sides) for sides in (summary.span.start, summary.span.end))
        yield _card("span", short(end, "m"), summary.span.change, f"{short(start, 'm')} at the start")
    if summary.horizon is not None:
        yield _card("trusted until", short(summary.horizon, "s"), f"through {counted(summary.horizon_contacts or 0)}")


def _card(title: str, value: str, *details: str, met: bool | None = None) -> Card:
    judged = "" if met is None else "met" if met else "missed"
    return {"title": title, "value": value, "detail": "; ".join(filter(None, details)), "judged": judged}


def _estimated(force: ForceAnswer) -> str:
    least = f" from {short(force.least, 'N')} on" if force.least < LESS * force.force else ""
    return f", an estimate{least}" if force.estimated else ""


def _of_point(point: PointAnswer) -> Card:
    title = f"{point.name} off by"
    if not math.isfinite(point.deviation):
        return _card(title, "unknown", "the ideal mechanism ends earlier")
    allowed = "" if point.tolerance is None else f"allowed {short(point.tolerance, 'm')}"
    met = None if point.tolerance is None else point.met
    return _card(title, short(point.deviation, "m"), f"at {short(point.when, 's')}", allowed, met=met)


def _of_torque(actuator: ActuatorAnswer) -> Card:
    quantity = "force" if actuator.unit == "N" else "torque"
    title = f"{f'driving {quantity} on' if actuator.kind == 'drive' else f'{quantity} of'} {actuator.name}"
    value = short(actuator.torque, actuator.unit)
    if actuator.saturated:
        return _card(title, value, f"at its limit for {short(actuator.time_at_limit, 's')}", met=False)
    when = f"at {short(actuator.when, 's')}" if math.isfinite(actuator.when) else ""
    limit = "" if actuator.limit is None else f"limit {short(actuator.limit, 'N m')}"
    return _card(title, value, when, limit, met=True if limit else None)


def contact_table(run: Run) -> dict[str, Any]:
    """The contacts of a run as columns, in units that suit its numbers."""
    columns = []
    left_out = kinds_left_out(run)
    for name, title, unit in COLUMNS:
        if name in left_out:
            continue
        values = run[name].values
        finite = np.abs(values[np.isfinite(values)])
        scale = engineering(unit, finite) if unit in ("s", "N") else Scale(1.0, unit)
        bound, smaller = SMALL.get(scale.unit, (0.0, ""))
        if finite.max(initial=0.0) < bound:
            scale = Scale(1e3, smaller)
        shown = scale.factor * values
        columns.append({"title": f"{title} [{scale.unit}]", "values": shown, "places": decimals(shown.tolist())})
    joints, starts = run["contact_joint"].values.astype(str).tolist(), run["contact_start"].values.copy()
    return {"joints": joints, "seconds": starts, "columns": columns}


def differences(cases: Sequence[Case]) -> list[str]:
    """Of each of some cases the numbers that are not the same in all of them, as text."""
    numbers = [{field.key: field for field in case.fields} for case in cases]
    differing = [
        key
        for key in dict.fromkeys(key for fields in numbers for key in fields)
        if len({(field.value or field.text) if (field := fields.get(key)) else None for fields in numbers}) > 1
    ]
    texts = []
    for fields in numbers:
        parts = [f"{fields[key].label} {fields[key].shown}" for key in differing if key in fields]
        more = len(parts) - MOST_NUMBERS
        texts.append(", ".join(parts[:MOST_NUMBERS]) + (f" and {more} more" if more > 0 else "") or "the same numbers")
    return texts
