"""A clearance guide whose follower surrounds it: a ring on a pole."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import scissordyn as sd

# Half width and half height of the ring, radius of its edges, clearance [m], and speed [rad/s]
HALF_WIDTH, HALF_HEIGHT, RADIUS, CLEARANCE, SPEED = 3.2e-3, 5.8e-3, 0.1e-3, 0.6e-3, -5.0
CORNERS = tuple((x, y) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))  # Signs of x and y of the four corners of the ring


def ring(around=True):
    """Return a ring that turns about its middle without gravity and friction."""
    body = sd.Body("ring", 0.01, 1e-6, {"middle": (0.0, 0.0)}, angular_velocity=SPEED)
    gap = sd.GuideClearance(
        CLEARANCE,
        corners=tuple((HALF_WIDTH * x, HALF_HEIGHT * y) for x, y in CORNERS),
        corner_radius=RADIUS,
        around=around,
        stiffness=sd.law("stiffness", "linear")(1e7),
        damping=sd.law("damping", "exact")(restitution=0.5),
    )
    guide = sd.Guide("pole", ("ring", "middle"), direction=0.5 * math.pi)
    return sd.Mechanism(bodies=(body,), guides=(guide,), gravity=0.0, output_body="ring").with_clearance("pole", gap)


@pytest.mark.parametrize("around", [True, False])
def test_angle_of_first_contact(around):
    """Closed form: two edges touch at w cos a - h sin a = w - c of a ring, or w cos a + h sin a = w + c of a block."""
    sense = -1.0 if around else 1.0
    angle = brentq(
        lambda a: HALF_WIDTH * math.cos(a) + sense * HALF_HEIGHT * math.sin(a) - HALF_WIDTH - sense * CLEARANCE, 0.0, 0.3
    )
    run = sd.simulate(ring(around), until=0.03, start="as-placed", samples=31)
    assert run["contact_start"].values[:2] == pytest.approx(angle / abs(SPEED), rel=1e-9)
    # clockwise the left edges of a ring touch above and the right ones below, and those of a block the other way round
    touched = set(run["contact_joint"].values[:2].astype(str))
    assert touched == ({"pole/corner 2", "pole/corner 4"} if around else {"pole/corner 1", "pole/corner 3"})


def test_ring_rebounds_with_its_restitution():
    """Closed form: both corners push with the same moment, so that the ring turns back in place with e times its speed."""
    run = sd.simulate(ring(), until=0.03, start="as-placed", samples=301)
    after = run.sel(time=slice(float(run["contact_start"][0]) + 1e-3, None))
    assert after.sizes["time"] > 5
    assert after["angular_velocity"].values == pytest.approx(-0.5 * SPEED, rel=1e-3)
    assert np.max(np.abs(after["velocity"].values)) < 1e-9


def test_pole_without_room_is_refused():
    """Contract: a clearance that leaves no room for the pole is refused."""
    described = ring()
    gap = described.guides[0].clearance
    assert gap is not None
    with pytest.raises(sd.InputError, match=r"the corners of the ring leave -0\.2 mm for the pole"):
        _ = described.with_clearance("pole", dataclasses.replace(gap, clearance=3.2e-3)).contact_points
