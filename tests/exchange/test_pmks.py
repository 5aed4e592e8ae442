"""Links of PMKS+: ten linkages against closed forms, and links that are damaged or of a later version."""

import dataclasses
import math

import numpy as np
import pytest
from tests.build import one_line_error
from tests.exchange import links
from tests.exchange.links import PRISMATIC, WELDED, linkage

import scissordyn as sd

RPM = 2.0 * math.pi / 60.0  # [rad/s] one revolution per minute


def crossing(p, q, a, b, side):
    """Return the point where circles of radius a about p and b about q meet, left of the line from p to q for side = 1."""
    d = abs(q - p)
    along = (a * a - b * b + d * d) / (2.0 * d)
    return p + (along + 1j * side * np.sqrt(a * a - along * along)) * (q - p) / d


class _Closed:
    """Positions of joints by crank angle as complex numbers, in closed form, without equations of the package."""

    def __init__(self, places, slides, angles):
        self.start = {name: complex(*place) for name, place in places.items()}
        self.now = {name: np.full(angles.shape, place) for name, place in self.start.items()}
        self.turn, self.slides = np.exp(1j * (angles - angles[0])), slides

    def crank(self, pin, centre):
        self.now[pin] = self.start[centre] + (self.start[pin] - self.start[centre]) * self.turn

    def dyad(self, pin, first, second):
        p, q, x = (self.start[name] for name in (first, second, pin))
        side = np.sign(((x - p) / (q - p)).imag)
        self.now[pin] = crossing(self.now[first], self.now[second], abs(x - p), abs(x - q), side)

    def plate(self, pin, first, second):
        p, q, x = (self.start[name] for name in (first, second, pin))
        self.now[pin] = self.now[first] + (x - p) / (q - p) * (self.now[second] - self.now[first])

    def slide(self, pin, other):
        way = np.exp(1j * self.slides[pin])
        p = (self.now[other] - self.start[pin]) / way
        length, side = abs(self.start[pin] - self.start[other]), np.sign(((self.start[pin] - self.start[other]) / way).real)
        self.now[pin] = self.start[pin] + (p.real + side * np.sqrt(length**2 - p.imag**2)) * way

    def angle(self, first, second):
        return np.unwrap(np.angle(self.now[second] - self.now[first]))


CRANK_ROCKER = {"A": (0.0, 0.0), "B": (0.3, 0.4), "C": (1.75, 1.1), "D": (1.6, 0.0)}  # Positions of the pins of a crank-rocker
WATT_ONE = {"E": (0.9, 1.6), "F": (2.5, 0.7), "G": (2.3, 2.1)}  # Positions of further pins of Watt's six-bar linkage I
WATT_TWO = {"E": (2.2, 0.8), "F": (3.5, 1.2), "G": (3.2, 0.0)}  # Positions of further pins of Watt's six-bar linkage II
# Positions of further pins of Stephenson's six-bar linkage III
STEPHENSON = {"E": (0.8, 1.5), "F": (2.6, 1.9), "G": (2.9, 0.2)}
FOUR, SLIDER = "crank BA, dyad CBD", "crank BA, slide CB"  # Dyads of a crank-rocker and of a slider-crank, as text
FOUR_BARS, TWO_BARS = ("AB", "BC", "CD"), ("AB", "BC")  # Pins of each link of a four-bar linkage, and of a chain of two links
CASES = {
    "crank and rocker": (CRANK_ROCKER, FOUR_BARS, "AD", FOUR, {}),
    "double crank": ({"A": (0.0, 0.0), "B": (0.2, 1.1), "C": (1.3, 1.5), "D": (0.5, 0.1)}, FOUR_BARS, "AD", FOUR, {}),
    "crossed": ({"A": (0.0, 0.0), "B": (0.0, 0.35), "C": (1.55, -0.75), "D": (1.3, 0.1)}, FOUR_BARS, "AD", FOUR, {}),
    "turned and moved": ({"A": (-2.5, 1.25), "B": (-2.9, 1.0), "C": (-2.1, -0.4), "D": (-1.1, 0.1)}, FOUR_BARS, "AD", FOUR, {}),
    "slider in line": ({"A": (0.0, 0.0), "B": (0.3, 0.4), "C": (1.5, 0.0)}, TWO_BARS, "A", SLIDER, {"C": 0.0}),
    "slider beside": ({"A": (0.0, 0.0), "B": (0.3, 0.4), "C": (1.6, -0.2)}, TWO_BARS, "A", SLIDER, {"C": 0.0}),
    "slider at an angle": ({"A": (0.1, 0.0), "B": (0.35, 0.3), "C": (1.2, 0.9)}, TWO_BARS, "A", SLIDER, {"C": 0.611}),
    "Watt I": (CRANK_ROCKER | WATT_ONE, ("AB", "BCE", "CDF", "EG", "FG"), "AD", f"{FOUR}, plate EBC, plate FCD, dyad GEF", {}),
    "Watt II": (CRANK_ROCKER | WATT_TWO, ("AB", "BC", "CDE", "EF", "FG"), "ADG", f"{FOUR}, plate EDC, dyad FEG", {}),
    "Stephenson III": (CRANK_ROCKER | STEPHENSON, ("AB", "BCE", "CD", "EF", "FG"), "ADG", f"{FOUR}, plate EBC, dyad FEG", {}),
}
"""Positions of pins, pins of each bar, ground pins, dyads that determine the pins, and angles of slides, by linkage."""


@pytest.mark.parametrize("name", CASES)
def test_angles_of_a_revolution_are_those_of_the_closed_form(name):
    """Closed form: the angle of every bar over a revolution, by intersections of circles in complex numbers."""
    places, bars, ground, steps, slides = CASES[name]
    address = linkage(places, bars, ground, "A", slides=slides, speed=30, clockwise=name == "double crank")
    mechanism, notes = sd.read_pmks(address)
    assert mechanism.drives[0].body == "AB"
    run = sd.simulate(mechanism, until=2.0, samples=181)
    sign = -1.0 if name == "double crank" else 1.0
    assert run.attrs["status"] == "complete"
    angles = mechanism.body("AB").angle + sign * 30 * RPM * run["time"].values
    if name == "crossed":  # its input locks, and swings between
        angles = run["angle"].sel(body="AB").values
    form = _Closed(places, slides, angles)
    for kind, pins in map(str.split, steps.split(", ")):
        getattr(form, kind)(*pins)
    for bar in bars:
        found = run["angle"].sel(body=bar).values
        exact = form.angle(*bar[:2])
        assert np.max(abs(found - exact - 2 * math.pi * np.round((found - exact)[0] / (2 * math.pi)))) < 1e-9, bar
    for pin in slides:
        there = run["position"].sel(body=f"block {pin}").values
        assert np.max(abs(there[:, 0] + 1j * there[:, 1] - form.now[pin])) < 1e-9
    assert not [note for note in notes if "left out" in note]


def test_masses_lengths_and_forces_have_the_units_of_the_link():
    """Closed form: a bar of 2 lb and 0.3 lb in^2 on a pin, with a force of 3 lbf that follows it, in inches."""
    joints = [links.joint("A", (1.0, 2.0), links.GROUNDED), links.joint("B", (5.0, 2.0))]
    bars = [links.bar("AB", "AB", 2.0, 0.3, (3.0, 2.0))]
    force = "3F1,AB,F1," + ",".join(links.decimal(x) for x in (5.0, 2.0, 5.0, 4.0, 3.0))
    mechanism, notes = sd.read_pmks(links.link(joints, bars, [force], units="0000"))
    body = mechanism.body("AB")
    assert body.mass == pytest.approx(2 * 0.45359237, rel=1e-15)
    assert body.inertia == pytest.approx(0.3 * 0.45359237 * 0.0254**2, rel=1e-15)
    assert body.position == pytest.approx((0.0254, 0.0508), rel=1e-15)
    assert body.points["B"] == pytest.approx((4 * 0.0254, 0.0), rel=1e-15)
    pull = mechanism.components[0]
    assert pull.point == ("AB", "B")
    assert pull.follows
    assert pull.force == pytest.approx((0.0, 3 * 4.4482216152605), abs=1e-15, rel=1e-12)
    assert any("no input turns a link" in note for note in notes)


def test_a_slot_in_a_moving_link_and_a_welded_pin():
    """Closed form: a crank whose block slides in a turning link (angle from the pivot to the crank pin); a Scotch yoke."""
    places = {"A": (0.0, 0.0), "B": (0.0, 3.0), "C": (1.0, 0.0), "D": (-0.6, 4.8)}
    joints = [
        links.joint("A", places["A"], links.GROUNDED | links.INPUT),
        links.joint("B", places["B"]),
        links.joint("C", (1.0, 0.0), links.GROUNDED),
        links.joint("D", (-0.6, 4.8)),
        links.joint("P", places["B"], PRISMATIC, 0.0, "CD", "C", "D"),
    ]
    bars = [links.bar("AB", "AB", 1.0, 1.0, (0.0, 1.5)), links.bar("CD", "CD", 1.0, 1.0, (0.2, 2.4))]
    mechanism, _ = sd.read_pmks(links.link(joints, [*bars, links.bar("BP", "BP", 1.0, 0.0, (0, 0), "YP")], speed=30))
    run = sd.simulate(mechanism, until=2.0, samples=91)
    crank = math.pi / 2 + 30 * RPM * run["time"].values
    exact = np.unwrap(np.angle(3 * np.exp(1j * crank) - 1.0))
    assert run["angle"].sel(body="CD").values == pytest.approx(exact, abs=1e-9)
    joints = [
        links.joint("A", (0.0, 0.0), links.GROUNDED | links.INPUT),
        links.joint("B", (1.0, 0.0)),
        links.joint("C", (1.0, -2.0), WELDED),
        links.joint("D", (1.0, 1.8)),
        links.joint("E", (1.0, 0.0), PRISMATIC, 0.0, "CD", "C", "D"),
        links.joint("F", (1.0, -2.0), PRISMATIC | links.GROUNDED),
    ]
    bars = [links.bar("AB", "AB", 1.0, 1.0, (0.5, 0.0)), links.bar("CD", "CD", 1.0, 1.0, (1.0, 0.0))]
    blocks = [links.bar("BE", "BE", 1.0, 0.0, (0, 0), "YP"), links.bar("CF", "CF", 2.0, 0.0, (0, 0), "YP")]
    yoke, _ = sd.read_pmks(links.link(joints, [*bars, *blocks], speed=30))
    assert yoke.body("CD").mass == 3.0
    run = sd.simulate(yoke, until=2.0, samples=91)
    moved = run["position"].sel(body="CD").values[:, 0]
    assert moved == pytest.approx(np.cos(30 * RPM * run["time"].values), abs=1e-9)
    assert run["angle"].sel(body="CD").values == pytest.approx(math.pi / 2, abs=1e-12)


GOOD = linkage(CRANK_ROCKER, FOUR_BARS, "AD", "A")  # Link of PMKS+ without a mistake


def test_a_link_without_masses_says_what_is_assumed():
    """Closed form: a uniform bar of 3 kg/m and 2 m has m L^2/12."""
    joints = [links.joint("A", (0, 0), links.GROUNDED), links.joint("B", (2, 0))]
    mechanism, notes = sd.read_pmks(links.link(joints, [links.bar("AB", "AB", 0.0, 0.0, (0, 0))]), linear_density=3.0)
    assert (mechanism.body("AB").mass, mechanism.body("AB").inertia) == (6.0, 2.0)
    assert any("no mass in the drawing" in note for note in notes)


# Pins of a six-bar linkage in the earlier format of links
EARLIER_PINS = (
    "A 1.4 0.485 t t|B 1.67 0.99 f f|C 0.255 1.035 f f|D 0.285 0.055 t f|E 0.195 2.54 f f|F -0.98 2.57 f f|G 0.05 0.2 t f"
)


def earlier(speed="10,false,false,m", force="F1,GF,-1.712,4.26,-1.712,0.508,t,true,0,100"):
    """Return a link of a six-bar linkage in the earlier format: pins, bars of 1 kg and 1 kg m^2, a force on one bar."""
    pins = [pin.split() for pin in EARLIER_PINS.split("|")]
    joints = "".join(f"{pin},{x},{y},,R,{fixed},0,0.1,{driven},%0A" for pin, x, y, fixed, driven in pins)
    bars = "".join(f"{bar},1,1,0,0,{'%7C'.join(bar)},,l,0,0,0,0,0,0,0,0%0A" for bar in ("AB", "CB", "EF", "DCE", "GF"))
    return f"https://pmksplus.mech.website/?j={joints}&l={bars}&f={force}%0A&pp=&tp=&s={speed}"


def test_a_link_of_the_earlier_form_has_the_forces_that_pmks_shows():
    """Published numbers: static reactions at A to G and the torque of the input, as PMKS+ shows them for this linkage."""
    mechanism, notes = sd.read_pmks(earlier())
    assert mechanism.drives[0].body == "AB"
    assert mechanism.drives[0].motion.speed == pytest.approx(10.0 * RPM)
    held = dataclasses.replace(mechanism, drives=()).driven(speed=0.0, body="AB")
    run = sd.simulate(held, until=1e-3, samples=2).isel(time=0)
    shown = [(190.6448, 6.0629)] * 3 + [(115.4646, 4.1434)] + [(75.1802, 1.9195)] * 2 + [(75.1802, 101.9195)]
    assert abs(run["reaction"].sel(joint=list("ABCDEFG")).values) == pytest.approx(np.array(shown), abs=6e-5)
    assert abs(float(run["drive_torque"])) == pytest.approx(97.9126, abs=6e-5)
    assert {"friction of 7 joints: left out", "outlines of links: left out"} <= set(notes)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("https://app.pmksplus.com/", "is not a link of PMKS+"),
        ("https://example.org/?q=1", "is not a link of PMKS+"),
        (GOOD[:-4] + GOOD[-3:], "is damaged"),
        (linkage(CRANK_ROCKER, FOUR_BARS, "AD", "A", decimals="TY,Fe,Fe"), "later version of PMKS"),
        (links.link(["-A,A,0,0,0", links.joint("B", (1, 0))], [links.bar("AB", "AB", 1, 1, (0, 0))]), "later version of PMKS"),
        (
            links.link([links.joint("A", (0, 0)), links.joint("B", (1, 0))], ["zRAB,AB,Fe,Fe,0,0,,A,B,,"]),
            "later version of PMKS",
        ),
        (links.link([links.joint("A", (0, 0)), links.joint("B", (1, 0))], [], units="9011"), "units"),
        (
            links.link([links.joint("A", (0, 0), PRISMATIC), links.joint("B", (1, 0))], [links.bar("AB", "AB", 1, 1, (0, 0))]),
            "block",
        ),
        (
            links.link([links.joint("A", (0, 0)), links.joint("B", (1, 0))], [links.bar("AB", "AC", 1, 1, (0, 0))]),
            "unknown joint 'C'",
        ),
        (earlier().replace("B,1.67,0.99,,R", "B,1.67,0.99,,P"), "joint 'B', which slides"),
        (earlier(speed="10,false,false,furlong"), "unit 'furlong'"),
        (earlier().replace("1.67", "x"), "'x' in the link"),
        (earlier(force="F1,GF,1,1,1,1,t,true,0,100"), "has no direction"),
        (earlier().partition("&l=")[0], "has no links"),
    ],
)
def test_what_cannot_be_understood_is_one_line(address, said):
    """Contract: the error names what came and what is allowed."""
    with one_line_error(match=said.replace("+", r"\+")):
        sd.read_pmks(address)


@pytest.mark.parametrize("clockwise", ["false", "true"])
def test_an_input_that_locks_reverses_before(clockwise):
    """Closed form: a rocker of 3 m over 4 m locks with coupler and follower, 1.5 and 2 m, in line; it swings short of that."""
    joints = "A,0,0,,R,t,0,0,t,%0AB,{},{},,R,f,0,0,f,%0AC,{},{},,R,f,0,0,f,%0AD,4,0,,R,t,0,0,f,%0A"
    b = 3.0 * complex(math.cos(0.5), math.sin(0.5))
    c = crossing(b, 4.0 + 0.0j, 1.5, 2.0, 1)
    bars = "".join(f"{bar},1,1,0,0,{'%7C'.join(bar)},,l%0A" for bar in ("AB", "BC", "CD"))
    link = f"https://x/?j={joints.format(b.real, b.imag, c.real, c.imag)}&l={bars}&s=10,{clockwise},false,m"
    mechanism, notes = sd.read_pmks(link)
    lock = math.acos((3.0**2 + 4.0**2 - 3.5**2) / 24.0)
    assert any(f"locks at {-math.degrees(lock):.5g}" in note for note in notes)
    run = sd.simulate(mechanism, until=12.0, samples=400)
    assert run.attrs["status"] == "complete"
    turned, speed = run["angle"].sel(body="AB").values, run["angular_velocity"].sel(body="AB").values
    limit, rate = 0.98 * lock, 10.0 * RPM
    assert np.max(np.abs(turned)) == pytest.approx(limit, rel=1e-3)
    sense = -1.0 if clockwise == "true" else 1.0
    assert turned[0] == pytest.approx(0.5, abs=1e-12)
    assert speed[0] == pytest.approx(sense * rate, rel=1e-12)
    # a triangle wave of the speed of the link, each reversal rounded by a parabola over a tenth of a stroke
    stroke = 2.0 * limit / rate / 0.95
    into = (run["time"].values + 0.025 * stroke + (limit + sense * 0.5) / rate) % (2.0 * stroke)
    near = np.minimum(into % stroke, stroke - into % stroke)
    depth = np.where(near < 0.05 * stroke, 0.5 * rate / (0.05 * stroke) * near**2, rate * (near - 0.025 * stroke))
    upper = (into - 0.5 * stroke) % (2.0 * stroke) < stroke
    np.testing.assert_allclose(turned, sense * np.where(upper, limit - depth, depth - limit), atol=1e-9)
