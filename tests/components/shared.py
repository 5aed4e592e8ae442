"""Models, bounds and case files that the tests of components share."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from tests.build import ORIGIN, assert_balance, case_of

import scissordyn as sd
from scissordyn.cli.main import status_of

__all__ = ["assert_balance"]

METHODS = ("dop853", "rodas5p")  # An explicit method and a stiff one

TIGHT = {"rtol": 1e-11, "atol": 1e-11}  # Options of `simulate` for accurate runs

ENDS = ("ground", "O"), ("ball", "centre")  # End points of a component between ground and ball


def ball_on(*components, mass=2.0, place=(0.5, 0.0), velocity=(0.0, 0.0), gravity=0.0):
    """Return a point mass and a point of the ground, with components between them."""
    ball = replace(sd.point_mass("ball", mass=mass, position=place), velocity=velocity)
    return sd.Mechanism((ball,), components=components, ground=ORIGIN, gravity=gravity)


def shaft_in_bearing(load, oil, **gap):
    """Return a shaft of 20 mm radius in a bearing with 40 um of clearance and oil, with a load as its weight."""
    shaft = sd.Body("shaft", load / 9.81, 1.0, {"centre": (0.0, 0.0)})
    clearance = sd.Clearance(4e-5, journal_radius=0.02, bearing_length=0.04, lubrication=oil, **gap)
    joint = sd.Revolute("bearing", ("shaft", "centre"), ("ground", "O"), clearance=clearance)
    return sd.Mechanism((shaft,), joints=(joint,), ground=ORIGIN, gravity=9.81)


def events_of(run, kind):
    """Return the instants of the events of one kind [s]."""
    return np.asarray(run["event_time"].values[run["event_kind"].values == kind])


Event = Callable[[float, np.ndarray], float]


def phases(rate, events, start, until, *, mode=0, limit=50):
    """Integrate by scipy; at the event of the present mode the mode changes and the integration continues.

    Returns instants of the changes, modes after them, and the solution at any instants.
    """
    begin, state = 0.0, np.array(start, float)
    parts, instants, modes = [], [], []
    for _ in range(limit):
        event = _terminal(events[mode])
        found = solve_ivp(
            lambda t, y, mode=mode: rate(mode, t, y),
            (begin, until),
            state,
            method="DOP853",
            rtol=1e-13,
            atol=1e-13,
            events=event,
            dense_output=True,
        )
        parts.append((begin, found.sol))
        if found.status != 1:
            break
        begin, state = float(found.t[-1]), found.y[:, -1]
        mode = 1 - mode
        instants.append(begin)
        modes.append(mode)

    def at(time):
        chosen = np.searchsorted([start for start, _ in parts], time, side="right") - 1
        return np.array([parts[k][1](t) for k, t in zip(chosen, time, strict=True)])

    return instants, modes, at


def _terminal(event):
    def falling(t, y):
        return event(t, y)

    falling.terminal, falling.direction = True, -1.0
    return falling


def read(folder, text):
    """Return the mechanism of a case file."""
    return case_of(folder, text).mechanism


def checked(folder, text, capsys):
    """Return the output of ``scissordyn check`` for a case file."""
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    assert status_of(["check", str(path)]) == 0
    return capsys.readouterr().out


def assert_documented(run, units):
    """Check that the variables of a component have these units, a long name and finite values."""
    for name, unit in units.items():
        assert run[name].attrs["units"] == unit, name
        assert run[name].attrs["long_name"], name
        assert np.all(np.isfinite(run[name].values)), name
