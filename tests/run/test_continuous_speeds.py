"""Speeds of a mechanism with ideal joints change by its accelerations alone, unless an impulse is listed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd

EXAMPLES = {path.stem: path for path in sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))}

NAMES = [*(f"example {name}" for name in EXAMPLES), *(f"zoo {name}" for name in sd.zoo)]

ALLOWED = 1e-3  # Part of the largest speed by which the change over a sample may miss the accelerations at both of its ends


def largest_jump(run, instants: np.ndarray) -> float:
    """By how much velocities change beyond what accelerations explain, as a part of the largest, but around `instants`.

    Of an acceleration that is monotone between two samples, the change of speed is between those of both ends.
    """
    time = run["time"].values
    quiet = np.histogram(instants, time)[0] == 0
    step, worst = np.diff(time)[quiet], 0.0
    for speed, rate in (("velocity", "acceleration"), ("angular_velocity", "angular_acceleration")):
        v, a = (run[name].transpose("time", ...).values.reshape(time.size, -1) for name in (speed, rate))
        change, mean, spread = np.diff(v, axis=0)[quiet], 0.5 * (a[1:] + a[:-1])[quiet], 0.5 * np.abs(np.diff(a, axis=0))[quiet]
        beyond = np.abs(change - step[:, None] * mean) - step[:, None] * spread
        worst = max(worst, float(np.nanmax(beyond, initial=0.0) / max(np.nanmax(np.abs(v), initial=0.0), 1e-12)))
    return worst


@pytest.mark.parametrize("name", NAMES)
def test_speeds_are_continuous(name: str) -> None:
    """Identity: over each sample of an ideal run speeds change as their accelerations say, but where an event is listed.

    Where bars vibrate between two samples, there are more of them: a jump of speed stays.
    """
    kind, _, which = name.partition(" ")
    case = sd.read_case(EXAMPLES[which]) if kind == "example" else sd.zoo[which].case
    jump = np.inf
    for samples in (2001, 6001):
        run = sd.simulate(case.mechanism.ideal(), until=case.run.until, samples=samples)
        jump = largest_jump(run, run["event_time"].values if "event_time" in run else np.empty(0))
        if jump < ALLOWED:
            break
    assert jump < ALLOWED
