"""Answers to all checks for one choice of parameters, from runs in a batch that store neither histories nor a Dataset."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np

from scissordyn.mechanics.monitored import DRIVE_TORQUE
from scissordyn.mechanics.outputs import record
from scissordyn.model.clearance import Clearance
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.measure import Ended, Measure
from scissordyn.run.rows import Case, Worker
from scissordyn_paper.cases import SPEEDS, Choice, PaperCase, every_case
from scissordyn_paper.measures import FREE_BAR, JOINT, Curves, IdealMotion, Measures, ideal_motion, measure
from scissordyn_paper.runs import build_cached, compute
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import Check, Finding

NEIGHBOUR_FRACTION = 1e-9  # Neighbours differ by this fraction of the clearance

MOST_STEPS = 50_000
"""Largest number of steps of a run. A stroke needs hundreds, or thousands if it starts in contact; more steps are chatter
of a coarse integrator."""

_LOCAL = threading.local()  # Workers of each thread, which are reused


def findings(choice: Choice, member: int = 0) -> tuple[Finding, ...]:
    """Return the finding of each check for a choice, in the order of `CHECKS`; `member` is the number of the neighbour."""
    cases = [case for case in every_case(choice) if case.clearance is not None]
    drives = {speed: PaperCase(None, speed, choice=choice).without_contact_laws for speed in SPEEDS}
    measured = {case: _constrained(case.without_contact_laws) for case in cases if case.constrained}
    free = [(case, case.options) for case in cases if not case.constrained]
    for frictional in (False, True):
        for options in dict.fromkeys(options for _, options in free):
            group = [case for case, its in free if its == options and (case.friction is not None) is frictional]
            if group:
                measured |= _measured(group, options, drives, member)
    return tuple(_answer(check, choice, measured) for check in CHECKS)


def _answer(check: Check, choice: Choice, measured: Mapping[PaperCase, Measures]) -> Finding:
    """Return the answer to a check; if one of its runs has failed, the statement does not hold and has no numbers."""
    try:
        return check.find(choice, measured)
    except KeyError as missing:
        return Finding(False, f"{missing.args[0].name} has failed", {})


def _measured(
    cases: Sequence[PaperCase], options: Options, drives: Mapping[float, PaperCase], member: int
) -> dict[PaperCase, Measures]:
    """Return the measures of runs with the same options, either all with friction or all without."""

    def case(at: int) -> Case:
        run = cases[at]
        assert run.clearance is not None
        joint = _joint(run.choice, run.friction)
        joint = dataclasses.replace(joint, clearance=run.clearance * (1.0 + member * NEIGHBOUR_FRACTION))
        return Case(build_cached(drives[run.speed]).mechanism.with_clearance(JOINT, joint))

    choice, frictional = cases[0].choice, cases[0].friction is not None
    workers: dict[tuple[Any, ...], Worker] = _LOCAL.__dict__.setdefault("workers", {})
    key = choice.driven_bar, choice.angle, frictional, choice.samples > 0
    if key not in workers:
        curves = Measure("", "curves", (), partial(_curves, printed=choice.samples > 0), sampled=True)
        workers[key] = Worker(plan(case(0).mechanism), options, {"curves": curves})
    worker, measured = workers[key], dict[PaperCase, Measures]()
    worker.options = dataclasses.replace(options, most_steps=MOST_STEPS)
    for row in worker.rows(range(len(cases)), case):
        if "curves" in row.values:
            run = cases[row.case]
            measured[run] = measure(row.values["curves"], _ideal_motion(drives[run.speed]))
    return measured


@lru_cache(64)
def _joint(choice: Choice, friction: float | None) -> Clearance:
    joint = build_cached(PaperCase(friction=friction, choice=choice)).mechanism.joint(JOINT).clearance
    assert joint is not None
    return joint


@lru_cache(None)
def _ideal_motion(case: PaperCase) -> IdealMotion:
    return ideal_motion(compute(case, trust=False))


@lru_cache(None)
def _constrained(case: PaperCase) -> Measures:
    return measure(compute(case, trust=False), _ideal_motion(case.ideal.without_contact_laws))


def _curves(ended: Ended, *, printed: bool) -> Any:
    """Return the `Curves` of a run; with `printed`, contacts and largest values are those at the samples."""
    samples, at = ended.driver.samples, ended.plan
    rows = record(at.maps, ended.driver.system, samples)
    guide = at.mechanism.output_guide
    assert guide is not None
    follower, along = at.coordinates.place(guide.follower), np.array([math.cos(guide.direction), math.sin(guide.direction)])
    bar = [body.name for body in at.bodies].index(FREE_BAR)
    time, contact, touching = samples.time, rows.contact[:, 0], samples.mode[:, 0] == 1
    table = ended.contacts
    spans = np.stack([table["start"], table["start"] + ended.durations(table)], axis=1)
    peak, when = table["peak_normal_force"], table["start"] + table["peak_normal_time"]
    torque = float(ended.peaks(DRIVE_TORQUE)[0])
    if printed:
        change = np.diff(touching.astype(int), prepend=0, append=0)
        first, last = np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1
        spans = np.stack([time[first], time[last]], axis=1)
        places = [a + int(np.argmax(contact["normal"][a : b + 1])) for a, b in zip(first, last, strict=True)]
        peak, when, torque = contact["normal"][places], time[places], float(np.max(np.abs(rows.torque[:, 0])))
    return Curves(
        time=time,
        series={
            "slider_position": (follower.at(rows.X) - np.array(guide.through)) @ along,
            "slider_velocity": follower.at(rows.V) @ along,
            "slider_acceleration": follower.at(rows.A) @ along,
            "angle": rows.angle[:, bar],
            "angular_velocity": rows.angular_velocity[:, bar],
            "angular_acceleration": rows.angular_acceleration[:, bar],
        },
        normal=contact["normal"],
        place=np.stack([contact["distance"] * contact["nx"], contact["distance"] * contact["ny"]], axis=1),
        touching=touching,
        spans=spans,
        peak=peak,
        when=when,
        torque=torque,
    )


def agreeing(choice: Choice, members: Sequence[int]) -> np.ndarray:
    """Return the fraction of neighbours `members` for which each check holds, in the order of `CHECKS`."""
    return np.asarray(np.mean([[finding.holds for finding in findings(choice, member)] for member in members], axis=0))
