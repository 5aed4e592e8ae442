"""Cross-check of `valid_until` by runs with a slightly changed parameter."""

import dataclasses
import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.model.parameter_path import changed, number

CLEARANCE, SPEED, ARM = 1e-3, 0.5, 0.1  # [m], [m/s], distance of the journal from the body's mass centre [m]

DISTANCE = 0.999 * CLEARANCE  # Flight of a journal that starts near its bearing's bottom [m]


def flying(place=0.0, speed=SPEED, contact="compliant"):
    """Return a body whose journal flies in its bearing, `place` [m] beside the centre."""
    gap = sd.Clearance(CLEARANCE, friction=sd.NoFriction(), contact=contact)
    body = sd.Body("ball", 1.0, 1.0, {"centre": (ARM, 0.0)}, position=(place, 0.0), velocity=(speed, 0.0))
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "O"), clearance=gap)
    return sd.Mechanism(bodies=(body,), joints=(hole,), ground=(("O", (ARM, 0.0)),), gravity=0.0)


def thrown():
    """Return the body of `flying`, whose journal is thrown up and turns back just below its bearing."""
    body = dataclasses.replace(flying().bodies[0], velocity=(0.0, 0.999 * math.sqrt(2.0 * 9.81 * CLEARANCE)))
    return dataclasses.replace(flying(), bodies=(body,), gravity=9.81)


# Mechanism, parameter, relative change, end of the run [s], reason of the limit
CASES = {
    "begins a contact at the start": (flying(), "body.ball.points.centre.x", 0.02, 4e-3, "near"),
    "closes a contact that opens": (flying(DISTANCE, -SPEED), "body.ball.points.centre.x", 5e-5, 1e-3, "near"),
    "closes a contact beside the turning point": (thrown(), "body.ball.velocity.y", 2e-3, 0.02, "near"),
    "closes a contact before the end": (flying(), "body.ball.velocity.x", 1e-2, 0.995 * CLEARANCE / SPEED, "near"),
    "moves a hard contact before the end": (flying(contact="hard"), "hole.clearance", 1e-2, 0.995 * CLEARANCE / SPEED, "near"),
    "moves an onset far": (flying(), "hole.clearance", 0.2, 4e-3, "far"),
    "moves a hard impact far": (flying(contact="hard"), "hole.clearance", 0.2, 4e-3, "far"),
    "changes little": (flying(), "hole.clearance", 1e-3, 3e-3, ""),
}


def events(mechanism, until):
    """Return the instants of onsets and releases of a run, in turn, and the speeds there; the end for no release."""
    found = sd.simulate(mechanism, until=until, start="as-placed", samples=2, rtol=1e-9, events="located")
    start, speed = found["contact_start"].values, found["approach_speed"].values
    instants = np.stack([start, start + np.nan_to_num(found["contact_duration"].values, nan=until)], axis=1).ravel()
    return np.minimum(instants, until), np.stack([speed, found["rebound_speed"].values], axis=1).ravel()


def departure(mechanism, path, change, until):
    """Return the first instant from which runs with a smaller and a larger parameter have other or distant events [s]."""
    value, first = float(number(mechanism, path).value), until
    instants, speeds = events(mechanism, until)
    for factor in (1.0 - change, 1.0 + change):
        others, _ = events(changed(mechanism, path, value * factor), until)
        for k in range(max(instants.size, others.size)):
            pair = [float(each[k]) for each in (instants, others) if k < each.size]
            same = len(pair) == 2 and (pair[0] == 0.0) == (pair[1] == 0.0) and (pair[0] == until) == (pair[1] == until)
            if not same or speeds[k] * abs(pair[1] - pair[0]) > 0.1 * CLEARANCE:
                first = min(first, *pair)
                break
    return first


@pytest.mark.parametrize("case", CASES)
def test_changed_runs_depart_at_the_limit(case):
    """Cross-check: a small change has other contacts, or moves a journal far, at `valid_until` and not before."""
    mechanism, path, change, until, reason = CASES[case]
    found = sd.gradient(mechanism, by=[path], until=until, start="as-placed", trajectory=True, samples=2, change=change)
    assert found["limit"].item() == reason
    assert found["valid_until"].item() == pytest.approx(departure(mechanism, path, change, until), rel=0.02)


def test_a_closed_contact_at_the_start():
    """Cross-check: a small change of a length multiplies the energy of a contact that is closed at the start."""
    mechanism, path = flying(1.02 * CLEARANCE), "body.ball.points.centre.x"
    wanted = {"until": 2e-4, "start": "as-placed", "samples": 2}
    speed = sd.simulate(mechanism, **wanted)["velocity"].values[-1, 0, 0]
    for change, limit in ((1.1e-3, "far"), (1e-5, "")):
        found = sd.gradient(mechanism, by=[path], trajectory=True, change=change, **wanted)
        assert (found["limit"].item(), found["valid_until"].item()) == (limit, 0.0 if limit else wanted["until"])
        expected = found["velocity_derivative"].values[-1, 0, 0, 0] * change * ARM
        other = sd.simulate(changed(mechanism, path, (1.0 + change) * ARM), **wanted)["velocity"].values[-1, 0, 0]
        assert (abs((other - speed) / expected - 1.0) > 0.5) == bool(limit)


def test_a_start_that_moves_far():
    """Closed form: a rod stands across its slider's line, whose place is a square root of the rod's length."""
    long, change = 1.00012, 1e-3
    crank = sd.slider_crank(crank=1.0, rod=long, angle=sd.degrees(90.0)).driven(speed=0.1)
    place, moved = (math.sqrt(rod**2 - 1.0) for rod in (long, long * (1.0 + change)))
    assert moved - place < 0.5 * long / place * long * change
    for size, limit in ((change, "start"), (1e-7, "")):
        found = sd.gradient(crank, by=["body.rod.points.end.x"], until=1e-3, trajectory=True, samples=2, change=size)
        assert (found["limit"].item(), found["valid_until"].item()) == (limit, 0.0 if limit else 1e-3)


def test_an_event_that_moves_through_another_contact():
    """Cross-check: two journals of a bar strike together, and a small change lets one strike when the other has rebounded."""
    gaps = sd.Clearance(CLEARANCE, friction=sd.NoFriction())
    bar = sd.Body("bar", 1.0, 1e-3, {"left": (-ARM, 0.0), "right": (ARM, 0.0)}, position=(0.0, 0.0), velocity=(0.0, SPEED))
    joints = [sd.Revolute(end, ("bar", end), ("ground", end), clearance=gaps) for end in ("left", "right")]
    ground = (("left", (-ARM, 0.0)), ("right", (ARM, 0.0)))
    pair = sd.Mechanism(bodies=(bar,), joints=tuple(joints), ground=ground, gravity=0.0)
    wanted = {"until": 2.5e-3, "start": "as-placed", "samples": 2}
    turned = sd.simulate(pair, **wanted)["angular_velocity"].values[-1, 0]
    for change, limit in ((0.09, "order"), (0.01, "")):
        found = sd.gradient(pair, by=["left.clearance"], trajectory=True, change=change, **wanted)
        assert found["limit"].item() == limit
        slope = found["angular_velocity_derivative"].values[-1, 0, 0]
        other = sd.simulate(changed(pair, "left.clearance", (1.0 + change) * CLEARANCE), **wanted)
        spin = other["angular_velocity"].values[-1, 0] - turned
        error = abs(spin / (slope * change * CLEARANCE) - 1.0)
        assert (error > 0.2) == bool(limit)
