"""Every part that kernels are compiled for, in short runs: a script, for processes that load machine code from disk.

``python kept_parts.py package|user`` prints each part as it comes, and at the end what was computed as JSON.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
from numba.core.runtime.nrt import rtsys

import scissordyn as sd
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.time_function import TimeFunction
from scissordyn.config.file import read_case
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.integrate.tableau import METHODS
from scissordyn.laws.catalogue import BY_KIND, law
from scissordyn.model.mechanism import Mechanism

PAGE = Path(__file__).parents[1] / "docs" / "components.md"
GUIDE = Path(__file__).parents[1] / "examples" / "clearance_guide.toml"

TIME_FUNCTIONS: dict[type, Any] = {
    sd.ConstantSpeed: sd.ConstantSpeed(2.0),
    sd.Harmonic: sd.Harmonic(0.5, 0.1, 3.0),
    sd.Tabulated: sd.tabulated(lambda t: 0.5 + t * t, until=1.0, points=11),
    sd.Polynomial: sd.Polynomial((0.5, 1.0, 0.3)),
    sd.Cycloidal: sd.Cycloidal(0.5, 0.8, 1.0),
    sd.Trapezoidal: sd.Trapezoidal(0.5, 0.8, 1.0),
}

CONTROLLED: dict[str, dict[str, Any]] = {
    "none": {"controller": sd.NoControl()},
    "pid": {"controller": sd.PID(40.0, 3.0, 7.0, limit=2.0), "speed": 1.0},
    "feed-forward": {"controller": sd.FeedForward(40.0, 3.0), "feed_forward": sd.Harmonic(0.0, 1.0, 3.0), "speed": 1.0},
    "filtered-pd": {"controller": sd.controller("filtered-pd")(40.0, 3.0), "speed": 1.0},
    "pyragas": {"controller": sd.Pyragas(0.1, 1e-3), "speed": 1.0},
    "extended": {"controller": sd.ExtendedDelayedFeedback(0.1, 1e-3, 0.5), "speed": 1.0},
}

Part = tuple[str, Mechanism, dict[str, Any]]


def array() -> Mechanism:
    """A scissor on a drive."""
    return sd.scissor(units=2).driven(speed=sd.rpm(150))


def turning() -> Mechanism:
    """A bar that rotates about a ground pin at its start."""
    rod = sd.Body("rod", 1.0, 0.2, {"start": (0.0, 0.0)}, centre=(0.5, 0.0), angle=0.3)
    pin = sd.Revolute("pin", ("rod", "start"), ("ground", "origin"))
    return Mechanism((rod,), joints=(pin,), ground=(("origin", (0.0, 0.0)),), input_body="rod")


def in_contact(**laws: Any) -> Mechanism:
    """The scissor with a loose joint, whose journal rests in its bearing."""
    return array().with_clearance("A", sd.Clearance(0.5e-3, **laws))


RESTING = {"start": "in-contact", "until": 1e-3}


def cases() -> dict[str, Mechanism]:
    """The example of each component's section of the page."""
    blocks = [piece.split("\n```", 1)[0] for piece in PAGE.read_text(encoding="utf-8").split("```toml\n")[1:]]
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for section in COMPONENTS:
            own = [block for block in blocks if block.startswith(f"[[{section}]]")]
            if section == "flexible_bar":  # its sections are made by a table of bars that bend
                found[section] = array().with_bending(bending_stiffness=4e4, axial_stiffness=7e7, modes=2)
            elif section != "actuator":  # the torque of a controller
                path = Path(folder) / f"{section}.toml"
                path.write_text(f"{blocks[0]}\n{own[0]}", encoding="utf-8")
                found[section] = read_case(path).mechanism
    return found


def package_parts() -> Iterator[Part]:
    """Every component, law, controller and time function of the package, every method, and both ways of events."""
    for section, mechanism in cases().items():
        yield f"[[{section}]]", mechanism, {"until": 0.02}
    for kind, names in BY_KIND.items():
        for name in names:
            yield f"{kind} {name}", in_contact(**{kind: law(kind, name)()}), RESTING
    yield "clearance guide", read_case(GUIDE).mechanism, {"until": 1e-3}
    for name in CONTROLLERS:
        yield f"controller {name}", turning().controlled(**CONTROLLED[name]), {"until": 0.02}
    for each in get_args(TimeFunction):
        yield f"drive {each.__name__}", array().driven(TIME_FUNCTIONS[each]), {"until": 0.01}
        torque = sd.Torque("load", "rod", 1.0, time_function=TIME_FUNCTIONS[each])
        loaded = Mechanism(turning().bodies, joints=turning().joints, ground=turning().ground, components=(torque,))
        yield f"torque {each.__name__}", loaded, {"until": 0.01}
    for method in METHODS:
        for events in ("located", "crossed"):
            yield f"{method} {events}", in_contact(), {"until": 2e-3, "method": method, "events": events}
    yield "trust", in_contact(), {"until": 2e-3, "trust": True}
    yield "static", in_contact(), {"until": 1e-3, "start": "static"}


def stiff(indentation, stiffness):
    """A linear contact."""
    return stiffness * indentation


def damped(elastic, indentation, rate, approach, factor):
    """Damping in proportion to force and rate."""
    return elastic * (1.0 + factor * rate)


def sliding(slip_speed, normal_force, kinetic):
    """Coulomb's friction, regularised, from a table that the function makes."""
    points, values = np.array([-1e-3, 0.0, 1e-3]), np.array([-kinetic, 0.0, kinetic])
    return normal_force * np.interp(slip_speed, points, values)


def steer(t, angle, speed, acceleration, error, measured, x, y, rate_x, rate_y, delayed, torque, gain):
    """In proportion to the error."""
    return gain * error


def belt_force(angle, speed, slip, mode, stiffness, drag):
    """A spring in series with a dashpot, and a second dashpot while the angle is beyond zero."""
    moment = stiffness * (angle - slip)
    loss = moment * moment / drag + (drag * speed * speed if mode == 1.0 else 0.0)
    resistance = drag * speed if mode == 1.0 else 0.0
    return -moment - resistance, 0.5 * moment * moment / stiffness, loss, moment / drag


def belt_gap(angle, speed, slip, mode, stiffness, drag):
    """Zero at the angle zero."""
    return angle, speed


def belt_switch(angle, speed, slip, mode, stiffness, drag):
    """Nothing is lost."""
    return 0.0


def user_parts() -> Iterator[Part]:
    """A law of each kind, a controller and a component of a user's own, from Python and from a file."""
    here = Path(__file__).resolve()
    for reference in ("", f"{here}:"):

        def own(function: Any, reference: str = reference) -> Any:
            return f"{reference}{function.__name__}" if reference else function

        yield f"stiffness {reference}", in_contact(stiffness=sd.UserElastic(own(stiff), (1e9,))), RESTING
        yield f"damping {reference}", in_contact(damping=sd.UserDamping(own(damped), (0.1,))), RESTING
        yield f"friction {reference}", in_contact(friction=sd.UserFriction(own(sliding), (0.05,))), RESTING
        yield (
            f"controller {reference}",
            turning().controlled(sd.UserController(own(steer), (40.0,)), speed=1.0),
            {"until": 0.02},
        )
    belted = Mechanism(
        turning().bodies,
        joints=turning().joints,
        ground=turning().ground,
        components=(Belt("belt", "rod"),),  # type: ignore[call-arg]
    )
    yield "component", belted, {"until": 0.02}
    yield "function of time", array().driven(sd.tabulated(lambda t: 0.5 + 2.0 * t, until=1.0)), {"until": 0.01}
    # the package's own machine code once more, now that a compiler has run in this process
    yield from package_parts()


@sd.component(
    port="hinge",
    force=belt_force,
    gap=belt_gap,
    switch=belt_switch,
    states=(sd.State("slip", "rad", scale=1e-3),),
    context=("mode",),
)
class Belt:
    """A component with a state and a guard."""

    name: str
    body: str
    base: str = "ground"
    stiffness: Annotated[float, sd.Quantity("N m/rad", above=0.0)] = 20.0
    drag: Annotated[float, sd.Quantity("N m s/rad", above=0.0)] = 5.0


def main(group: str) -> None:
    """Run the parts of a group."""
    found = {}
    for name, mechanism, options in {"package": package_parts, "user": user_parts}[group]():
        print(name, file=sys.stderr, flush=True)  # the last line names what a process ended at
        run = sd.simulate(mechanism, samples=5, **options)
        if run.attrs["status"] != "complete":
            raise SystemExit(f"{name}: {run.attrs['cause']}")
        found[name] = float(run["kinetic_energy"][-1]).hex()
    print(json.dumps({"found": found, "compiled": rtsys._init}))


if __name__ == "__main__":
    main(sys.argv[1])
