"""The answers of a run on the page: one card for each, from its summary."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from scissordyn.run.answer.force_answer import LESS, ForceAnswer, parts_of_oiled
from scissordyn.units import counted, short

if TYPE_CHECKING:
    from scissordyn.run.answer.bar_answer import BarAnswer
    from scissordyn.run.answer.summary import ActuatorAnswer, PointAnswer, Summary

MOST_CARDS = 3
"""Cards of tracked points, and of torques; those that are furthest beyond what is allowed come first."""

Card = dict[str, str]


def cards(summary: Summary) -> list[Card]:
    """What the designer asked for, in short."""
    return list(_cards(summary))


def _cards(summary: Summary) -> Iterator[Card]:
    if summary.force is not None:
        detail = (
            f"{summary.force.joint}, at {short(summary.force.when, 's')}{_estimated(summary.force)}"
            f"{parts_of_oiled(summary.force.metal, summary.force.film)}"
        )
        yield _card("largest force", short(summary.force.force, "N"), detail)
    yield from map(_of_point, sorted(summary.points, key=lambda point: -point.share)[:MOST_CARDS])
    torques = [each for each in summary.actuators if math.isfinite(each.torque)]
    yield from map(_of_torque, sorted(torques, key=lambda each: -each.torque / (each.limit or math.inf))[:MOST_CARDS])
    if summary.bars is not None and math.isfinite(summary.bars.stress):
        yield _of_bars(summary.bars)
    if summary.span is not None:
        start, end = (max(sides) for sides in (summary.span.start, summary.span.end))
        yield _card("span", short(end, "m"), f"{summary.span.change}; {short(start, 'm')} at the start")
    if summary.horizon is not None:
        yield _card("trusted until", short(summary.horizon, "s"), f"through {counted(summary.horizon_contacts or 0)}")


def _estimated(force: ForceAnswer) -> str:
    least = f" from {short(force.least, 'N')} on" if force.least < LESS * force.force else ""
    return f", an estimate{least}" if force.estimated else ""


def _card(title: str, value: str, detail: str, judged: str = "") -> Card:
    return {"title": title, "value": value, "detail": detail, "judged": judged}


def _of_bars(bars: BarAnswer) -> Card:
    detail = f"{bars.bar}, at {short(bars.when, 's')}"
    if not math.isfinite(bars.utilisation):
        return _card("largest stress", short(bars.stress, "Pa"), detail)
    judged = "met" if bars.utilisation <= 1.0 else "missed"
    return _card("largest stress", short(bars.stress, "Pa"), f"{detail}; {bars.utilisation:.3g} of yield strength", judged)


def _of_point(point: PointAnswer) -> Card:
    title = f"{point.name} off by"
    if not math.isfinite(point.deviation):
        return _card(title, "unknown", "the ideal mechanism ends earlier")
    value, when = short(point.deviation, "m"), f"at {short(point.when, 's')}"
    if point.tolerance is None:
        return _card(title, value, when)
    return _card(title, value, f"{when}; allowed {short(point.tolerance, 'm')}", "met" if point.met else "missed")


def _of_torque(actuator: ActuatorAnswer) -> Card:
    title = f"{'driving torque on' if actuator.kind == 'drive' else 'torque of'} {actuator.name}"
    value = short(actuator.torque, "N m")
    when = f"at {short(actuator.when, 's')}" if math.isfinite(actuator.when) else ""
    if actuator.limit is None:
        return _card(title, value, when)
    if actuator.saturated:
        return _card(title, value, f"at its limit for {short(actuator.time_at_limit, 's')}", "missed")
    return _card(title, value, f"{'; '.join(filter(None, (when, 'limit')))} {short(actuator.limit, 'N m')}", "met")
