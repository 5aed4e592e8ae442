"""Mechanisms of eleven kinds for the predictability horizon, whose runs diverge from more accurate ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import scissordyn as sd
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.friction.coulomb import Coulomb

__all__ = ["KINDS", "Case", "horizon_case"]


@dataclass(frozen=True)
class Case:
    """Run whose horizon is judged.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the run [s].
    rtol : float
        Relative and absolute tolerance.
    """

    mechanism: sd.Mechanism
    until: float
    rtol: float


def _clearance(random: np.random.Generator, **options: object) -> sd.Clearance:
    size = float(np.exp(random.uniform(math.log(5e-5), math.log(1e-3))))
    law = {"damping": sd.Flores(restitution=float(random.uniform(0.7, 0.98))), **options}
    return sd.Clearance(size, **law)  # type: ignore[arg-type]


def _oscillating(random: np.random.Generator) -> sd.Harmonic:
    mean, amplitude = random.uniform(0.6, 0.9), random.uniform(0.1, 0.3)
    return sd.Harmonic(
        mean=float(mean),
        amplitude=float(amplitude),
        angular_frequency=float(random.uniform(10.0, 60.0)),
        phase=float(random.uniform(-3.0, 3.0)),
    )


def _array(random: np.random.Generator, units: int) -> sd.Mechanism:
    motion = _oscillating(random)
    angle = motion.mean + motion.amplitude * math.sin(motion.phase)
    return sd.scissor(units=units, bar_length=float(random.uniform(0.3, 2.0)), angle=angle).driven(motion)


def _scissor(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    array = _array(random, int(random.integers(1, 4)))
    joint = str(random.choice([joint.name for joint in array.joints]))
    return array.with_clearance(joint, _clearance(random)), 1.0


def _scissor_lugre(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    array = _array(random, int(random.integers(1, 4)))
    joint = str(random.choice([joint.name for joint in array.joints]))
    friction = sd.LuGre(float(random.uniform(0.01, 0.1)))
    return array.with_clearance(joint, _clearance(random, friction=friction)), 0.6


def _crank(random: np.random.Generator) -> sd.Mechanism:
    return sd.slider_crank(
        gravity=9.81, gravity_direction=float(random.uniform(-3.0, 3.0)), angle=float(random.uniform(-3.0, 3.0))
    )


def _slider_crank(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    pin = str(random.choice(["ground pin", "crank pin", "slider pin"]))
    crank = _crank(random).with_clearance(pin, _clearance(random))
    if random.random() < 0.7:
        crank = crank.driven(speed=float(random.uniform(20.0, 300.0)))
    return crank, 0.5


def _linkage(random: np.random.Generator) -> sd.Mechanism:
    return sd.four_bar(angle=float(random.uniform(-2.5, 2.5)), gravity_direction=float(random.uniform(-3.0, 3.0)))


def _four_bar(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    linkage = _linkage(random)
    joint = str(random.choice([joint.name for joint in linkage.joints]))
    friction = {"friction": Coulomb(float(random.uniform(0.01, 0.2)))} if random.random() < 0.5 else {}
    return linkage.with_clearance(joint, _clearance(random, **friction)).driven(speed=float(random.uniform(20.0, 100.0))), 0.5


def _several(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    crank = _crank(random).driven(speed=float(random.uniform(20.0, 200.0)))
    mechanism = crank if random.random() < 0.5 else _array(random, 2)
    names = [joint.name for joint in mechanism.joints]
    for name in random.permutation(names)[: int(random.integers(2, min(len(names), 8) + 1))]:
        mechanism = mechanism.with_clearance(str(name), _clearance(random))
    return mechanism, 0.2


def _guide(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    crank = sd.slider_crank(
        gravity=9.81,
        gravity_direction=float(random.uniform(-3.0, 3.0)),
        angle=float(random.uniform(-3.0, 3.0)),
        slider_inertia=1e-4,
    )
    play = sd.GuideClearance(
        float(np.exp(random.uniform(math.log(5e-5), math.log(5e-4)))),
        length=float(random.uniform(0.03, 0.08)),
        width=float(random.uniform(0.02, 0.05)),
        damping=sd.Flores(restitution=float(random.uniform(0.7, 0.98))),
    )
    return crank.with_clearance("guide", play).driven(speed=float(random.uniform(20.0, 200.0))), 0.6


def _guide_and_pin(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    """Return a slider-crank with clearance and friction in the guide and the pin of its slider."""
    play, clearance = (float(np.exp(random.uniform(math.log(5e-5), math.log(3e-4)))) for _ in range(2))
    laws = [
        {
            "damping": sd.Flores(restitution=float(random.uniform(0.7, 0.95))),
            "friction": sd.LuGre(float(random.uniform(0.01, 0.1))),
            "reference": "onset",  # the figures of the horizon were measured with the published damping
        }
        for _ in range(2)
    ]
    block = sd.GuideClearance(
        play, length=float(random.uniform(0.03, 0.08)), width=float(random.uniform(0.02, 0.05)), **laws[0]
    )
    crank = sd.slider_crank(
        gravity=9.81,
        gravity_direction=float(random.uniform(-3.0, 3.0)),
        angle=float(random.uniform(-3.0, 3.0)),
        slider_inertia=1e-4,
    ).with_clearance("guide", block)
    crank = crank.with_clearance("slider pin", sd.Clearance(clearance, **laws[1]))
    return crank.driven(speed=float(random.uniform(20.0, 100.0))), 0.15


def _chain(random: np.random.Generator, count: int) -> sd.Mechanism:
    """Return a pendulum of several bars with initial velocities."""
    bodies, joints, end = [], [], np.zeros(2)
    for k in range(count):
        length, angle = float(random.uniform(0.1, 0.6)), float(random.uniform(-3.0, 3.0))
        rod = sd.bar(
            f"bar {k}",
            length=length,
            mass=float(random.uniform(0.2, 2.0)),
            position=(float(end[0]), float(end[1])),
            angle=angle,
        )
        bodies.append(replace(rod, angular_velocity=float(random.uniform(-8.0, 8.0))))
        base = (f"bar {k - 1}", "end") if k else ("ground", "O")
        joints.append(sd.Revolute(f"pin {k}", (f"bar {k}", "start"), base))
        end = end + length * np.array([math.cos(angle), math.sin(angle)])
    return sd.Mechanism(
        bodies=tuple(bodies), joints=tuple(joints), ground=(("O", (0.0, 0.0)),), gravity=9.81, input_body="bar 0"
    )


def _stops(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    """Return pendulums that hit stops, tighten a cable, fold a tape spring, or lock."""
    chain = _chain(random, int(random.integers(2, 4)))
    between = chain.bodies[1].angle - chain.bodies[0].angle
    parts: list[object] = [
        sd.AngleStop(
            "high", "bar 1", float(between + random.uniform(0.3, 2.0)), "bar 0", restitution=float(random.uniform(0.7, 1.0))
        ),
        sd.AngleStop(
            "low", "bar 1", float(between - random.uniform(0.3, 2.0)), "bar 0", restitution=float(random.uniform(0.7, 1.0))
        ),
    ]
    match int(random.integers(0, 4)):
        case 0:
            parts.append(sd.Cable("rope", ("ground", "O"), ("bar 1", "end"), 1e5, float(random.uniform(0.6, 0.9)), 1.0))
        case 1:
            parts.append(
                sd.TapeSpring("tape", "bar 1", "bar 0", 5.0, 0.5, 0.1, 0.3, 0.05, float(between + random.uniform(-0.5, 0.5)))
            )
        case 2:
            parts.append(sd.Latch("latch", "bar 0", float(chain.bodies[0].angle + random.uniform(-9.0, -4.0))))
    return replace(chain, components=tuple(parts)), 20.0  # type: ignore[arg-type]


def _ideal(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    return _chain(random, int(random.integers(2, 5))), 8.0


def _controlled(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    if random.random() < 0.3:
        chain = _chain(random, 3)
        return chain.controlled(
            sd.PID(float(random.uniform(20.0, 100.0)), float(random.uniform(0.1, 2.0)), 5.0), speed=6.0
        ), 8.0
    pin = str(random.choice(["ground pin", "crank pin", "slider pin"]))
    crank = _crank(random).with_clearance(pin, _clearance(random))
    gains = sd.PID(float(random.uniform(5.0, 50.0)), float(random.uniform(0.05, 1.0)), float(random.uniform(1.0, 50.0)))
    return crank.controlled(gains, speed=float(random.uniform(20.0, 150.0))), 0.8


def _undamped(random: np.random.Generator) -> tuple[sd.Mechanism, float]:
    """Return a mechanism with contacts without dissipation."""
    law = NoDamping() if random.random() < 0.7 else sd.Flores(restitution=0.999)
    if random.random() < 0.6:
        pin = str(random.choice(["ground pin", "crank pin", "slider pin"]))
        return _crank(random).with_clearance(pin, _clearance(random, damping=law)), 1.0
    array = _array(random, 2)
    return array.with_clearance(str(random.choice(["A", "O", "unit 1/pivot"])), _clearance(random, damping=law)), 0.3


KINDS: dict[str, Callable[[np.random.Generator], tuple[sd.Mechanism, float]]] = {
    "scissor, no friction": _scissor,
    "scissor, LuGre": _scissor_lugre,
    "slider-crank": _slider_crank,
    "four-bar": _four_bar,
    "several clearance joints": _several,
    "clearance guide": _guide,
    "stops, cables, latches": _stops,
    "ideal joints": _ideal,
    "controllers": _controlled,
    "no damping": _undamped,
    "guide and pin, LuGre": _guide_and_pin,
}
"""Functions of the eleven kinds by name: each returns a mechanism and the end of its run [s] from a random generator."""


def horizon_case(kind: str, number: int) -> Case:
    """Return a case of a kind; even numbers have the default tolerance, odd ones 1e-6."""
    random = np.random.default_rng([list(KINDS).index(kind), number])
    mechanism, until = KINDS[kind](random)
    return Case(mechanism, until, 1e-8 if number % 2 == 0 else 1e-6)
