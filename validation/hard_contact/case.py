"""Hard contact: closed forms, and rigid impacts event by event."""

from __future__ import annotations

import math

import scissordyn as sd
from reference.moreau import SliderCrank
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.friction.coulomb import Coulomb
from validation.case import Case, Check, run
from validation.guide.reference import cluster
from validation.records.models import slider_crank

__all__ = ["CASE"]

NAME = "hard_contact"
GRAVITY = 9.81
FIRST = math.sqrt(2.0 / GRAVITY)  # Time of fall [s]
HALF, SIDE, GAP = 0.05, 0.1, 0.02  # Half length and side of the block, and its gap on either side in the channel [m]

SLIDING, FRICTION = 0.5, 0.2


def block(*, velocity: float = 0.0, angle: float = 0.0, friction: float) -> sd.Mechanism:
    """Return a block of 1 kg on the lower surface of a wide channel."""
    low = -SIDE * math.cos(angle) - HALF * math.sin(abs(angle))
    place = (0.0, -(SIDE + GAP) - low)
    inertia = (HALF**2 + SIDE**2) / 3.0
    body = sd.Body("block", 1.0, inertia, {"middle": (0.0, 0.0)}, position=place, velocity=(velocity, 0.0), angle=angle)
    corners = ((-HALF, -SIDE), (HALF, -SIDE), (HALF, SIDE), (-HALF, SIDE))
    laws = {"damping": LankaraniNikravesh(0.0), "friction": Coulomb(friction), "contact": "hard"}
    wide = sd.GuideClearance(GAP, corners=corners, corner_radius=1e-7, **laws)
    one = sd.Mechanism((body,), guides=(sd.Guide("channel", ("block", "middle")),), output_body="block")
    return one.with_clearance("channel", wide)


def checks() -> list[Check]:
    """Check ball, blocks and slider-crank."""
    fallen = run(NAME, step=1e-4)
    starts, speeds = fallen["contact_start"].values, fallen["approach_speed"].values
    made = [
        Check("ball: first impact [s]", FIRST, float(starts[0]), 1e-12, "closed form"),
        Check("tenth impact [s]", FIRST * (3.0 - 4.0 * 0.5**10), float(starts[9]), 1e-9, "closed form"),
        Check("its approach speed [m/s]", GRAVITY * FIRST * 0.5**9, float(speeds[9]), 1e-7, "closed form"),
        Check("rest, at a step of 0.1 ms [s]", 3.0 * FIRST, float(starts[-1]), 3e-7, "closed form"),
        Check(
            "energy that restitution takes in the first impact [J]",
            0.75 * GRAVITY,
            float(fallen["contact_damping_loss"][0]),
            1e-9,
            "closed form",
        ),
    ]
    for step in (1e-3, 1e-4):
        stepped = run(NAME, step=step, events="crossed")
        label = f"rest by time stepping at {1e3 * step:g} ms [s]"
        made.append(Check(label, 3.0 * FIRST, float(stepped["contact_start"][-1]), 10.0 * step, "closed form"))
    made += check_blocks()
    rigid, _ = cluster(SliderCrank(), 2.69e-3, 2.6926e-3)
    hard = sd.simulate(slider_crank(rotation=-0.01), until=2.6926e-3, start="as-placed", samples=3, step=1e-6)
    for k in range(3):
        for name, want, got in (
            ("starts [s]", rigid[k].time, float(hard["contact_start"][k])),
            ("approach speed [m/s]", rigid[k].approach, float(hard["approach_speed"][k])),
            ("rebound speed [m/s]", -rigid[k].rebound, float(hard["rebound_speed"][k])),
        ):
            made.append(Check(f"slider-crank: impact {k + 1} {name}", want, got, 1e-4, "second formulation"))
    return made


def check_blocks() -> list[Check]:
    """Check a sliding and a rocking block."""
    slid = sd.simulate(block(velocity=SLIDING, friction=FRICTION), until=0.4, start="as-placed", step=1e-4)
    rocked = sd.simulate(block(angle=0.05, friction=5.0), until=0.3, start="as-placed", step=5e-5)
    speeds = rocked["approach_speed"].values
    way, kept = 0.5 * SLIDING**2 / (FRICTION * GRAVITY), 1.0 - 1.5 * math.sin(math.atan(HALF / SIDE)) ** 2
    far = float(slid["position"].sel(body="block", axis="x")[-1])
    lost = float(slid["friction_loss"][-1])
    return [
        Check("block: way until it stops [m]", way, far, 1e-3, "closed form"),
        Check("energy that friction takes [J]", 0.5 * SLIDING**2, lost, 1e-6, "closed form"),
        *(
            Check(
                f"rocking block: angular velocity kept at impact {k + 1}",
                kept,
                speeds[k + 2] / speeds[k + 1],
                2e-3,
                "closed form",
            )
            for k in range(4)
        ),
    ]


CASE = Case(NAME, "Hard contact", checks)
