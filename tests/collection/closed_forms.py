"""The numbers of the zoo by closed forms and by points where circles meet; no equation of the package is used.

One function for each mechanism, named as it is, with a value for each of its numbers in the order of its declaration; None for
a number that has another origin.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence

from scipy.optimize import brentq

from reference.dyads import carried, meet, polar

__all__ = ["CLOSED_FORMS"]

Values = Sequence[float | None]

G = 9.81  # [m/s^2] gravitational acceleration


def rad(degrees: float) -> float:
    """Return an angle [rad] given in degrees."""
    return math.radians(degrees)


def cycloidal(part: float, start: float, end: float) -> float:
    """Return the fraction of a cycloidal move that is done after a given fraction of its duration."""
    return start + (end - start) * (part - math.sin(2.0 * math.pi * part) / (2.0 * math.pi))


def slider(crank: float, rod: float, angle: float) -> float:
    """Return the position of the slider of a slider-crank without offset."""
    return crank * math.cos(angle) + math.sqrt(rod**2 - (crank * math.sin(angle)) ** 2)


def flores_slider_crank() -> Values:
    """Crank at 90 and 180 degrees; acceleration at 0, where x'' = -r w^2 (1 + r/l)."""
    speed = 5000.0 * math.pi / 30.0
    return [slider(0.05, 0.12, rad(90)), slider(0.05, 0.12, rad(180)), -0.05 * speed**2 * (1.0 + 0.05 / 0.12), None, None]


def clearance_guide() -> Values:
    """Crank at 90 and 180 degrees, of a crank at 600 rpm."""
    speed = 600.0 * math.pi / 30.0
    return [slider(0.05, 0.12, rad(90)), slider(0.05, 0.12, rad(180)), -0.05 * speed**2 * (1.0 + 0.05 / 0.12)]


def four_bar() -> Values:
    """Direction of the rocker with the crank at 150 and 240 degrees, and its speed at the latter."""
    found = []
    for angle in (rad(150), rad(240)):
        pin = polar(0.06, angle)
        end = meet(pin, 0.18, 0.2 + 0j, 0.12, left=True)
        found.append(cmath.phase(end - 0.2))
    pin = polar(0.06, rad(240))
    end = meet(pin, 0.18, 0.2 + 0j, 0.12, left=True)
    coupler, rocker = cmath.phase(end - pin), cmath.phase(end - 0.2)
    speed = 300.0 * math.pi / 30.0
    # the velocity of the rocker pin along the coupler is that of the crank pin
    return [*found, speed * 0.06 * math.sin(rad(240) - coupler) / (0.12 * math.sin(rocker - coupler))]


def li_array() -> Values:
    """Slider and driving torque after 10 ms, at 39 degrees, by (S5)."""
    length, mass, end, speed, angle = 2.0, 5.68, 5.0, 150.0 * math.pi / 30.0, rad(39.0)
    inertial = speed**2 * length**2 * (mass * 2.0 - 0.5 * end) * math.sin(2.0 * angle)
    return [length * math.sin(angle), inertial + (2.0 * mass + end) * G * length * math.cos(angle), None, None]


def escrig_array() -> Values:
    """Slider, middle of the last unit, and torque after 0.4 s, at 46 degrees, by (S5) with C = (N-1)N(N+1)/3 = 8."""
    length, mass, end, speed, angle = 1.0, 2.0, 1.0, -10.0 * math.pi / 30.0, rad(46.0)
    inertial = speed**2 * length**2 * (mass * 8.0 - 0.5 * end) * math.sin(2.0 * angle)
    torque = inertial + (3.0 * mass + end) * G * length * math.cos(angle)
    return [length * math.sin(angle), 2.5 * length * math.cos(angle), torque]


def polar_arch() -> Values:
    """Slider and direction of the last unit's bar, half-way and at the end."""
    a, b = 0.8, 1.0
    half = (b - a) / (b + a)

    def at(inclination: float) -> tuple[float, float]:
        span = 2.0 * math.atan(half / math.tan(inclination))
        height = math.hypot((b - a) * math.cos(inclination), (b + a) * math.sin(inclination))
        return height, inclination - 3.5 * span

    def driven(inclination: float) -> float:
        return inclination - math.atan(half / math.tan(inclination))

    middle = 0.5 * (driven(rad(65)) + driven(rad(40)))
    return [*at(brentq(lambda one: driven(one) - middle, rad(30), rad(70), xtol=1e-15)), *at(rad(40))]


def hoberman_arch() -> Values:
    """Slider at 2 p sin th, and the last unit 96 degrees behind the first one at every instant."""
    return [2.0 * 0.6 * math.sin(rad(45)), rad(45 - 96), 2.0 * 0.6 * math.sin(rad(30)), rad(30 - 96)]


def hoberman_ring() -> Values:
    """Mass centre of the first bar at 25 degrees after 0.125 s and at 15 degrees at the end, and of the opposite bar there."""
    leg, kink = 0.4, rad(30)

    def centre(angle: float, first: float) -> complex:
        radii = [leg * math.cos(angle + shift) / math.sin(0.5 * kink) for shift in (0.5 * kink, 0.0, -0.5 * kink)]
        inner, pivot, outer = (polar(radius, first - 0.5 * k * kink) for k, radius in enumerate(radii))
        return pivot + 0.25 * (inner - pivot) + 0.25 * (outer - pivot)

    return [centre(rad(25), rad(90)).imag, centre(rad(15), rad(90)).imag, centre(rad(15), rad(-90)).imag]


def mast() -> Values:
    """Height of the platform half-way and at the end."""
    return [5 * 0.8 * math.sin(rad(37.5)), 5 * 0.8 * math.sin(rad(60))]


def pantograph_mast() -> Values:
    """Height of the platform and the slider on the base."""
    return [8 * 0.4 * math.sin(rad(42.5)), 8 * 0.4 * math.sin(rad(65)), 0.4 * math.cos(rad(65))]


def lift() -> Values:
    """Height of the last unit's middle over the length of the jack: 2.5 sqrt(L^2 - d^2)."""
    return [2.5 * math.sqrt(1.0 - cycloidal(0.36 / 0.8, 0.9397, 0.71) ** 2), 2.5 * math.sqrt(1.0 - 0.71**2)]


def planetary_gear() -> Values:
    """Willis' speeds of arm and planet; torques of the load over 3.7 and of the inertia about the sun, by a cycloidal move."""
    ratio, planet = 1.0 + 54.0 / 20.0, 1.0 - 54.0 / 17.0
    inertia = 1e-4 + (2e-4 + 0.25 * 0.037**2 + 7e-5 * planet**2) / ratio**2
    acceleration = 3.7 * 2.0 * math.pi * 2.0 * math.pi  # of a cycloidal move, at a quarter of its second
    return [2.0 * math.pi, planet * 2.0 * math.pi, 0.1 / ratio, 0.1 / ratio + inertia * acceleration]


def counter_rotating_wheels() -> Values:
    """Lowest place of the frame, and torque at 135 degrees, with T = (J + 2 m e^2 - (2 m e cos th)^2/(M + 2 m)) w^2 / 2."""
    mass, eccentricity, speed = 0.5, 0.04, 10.0 * math.pi
    moment = 2.0 * mass * eccentricity
    lever = moment**2 / (4.0 + 2.0 * mass)
    return [2.0 * moment / 5.0, 0.5 * lever * math.sin(rad(270)) * speed**2, 0.0]


def rack_and_pinion() -> Values:
    """Height of the rack, torque with the largest acceleration of a cycloidal move, and force without acceleration."""
    radius, mass, acceleration = 0.05, 4.0, 4.0 * 2.0 * math.pi / 0.8**2
    torque = mass * G * radius * 0.5 + (1e-3 + mass * radius**2) * acceleration
    return [radius * (4.0 * 0.5 - math.cos(rad(30))), torque, mass * G * 0.5]


def rack_with_backlash() -> Values:
    """Touch, end of the contact, touch of the other flank; J v^2/2 = (2/5) K d^(5/2), duration 2 d/v times B(2/5, 1/2) 2/5."""
    speed, backlash, stiffness, inertia = 20.0 * math.pi / 30.0, rad(1.0), 1e5, 1e-5 + 4.0 * 0.05**2
    depth = (1.25 * inertia * speed**2 / stiffness) ** 0.4
    lasting = 2.0 * depth / speed * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
    first = 0.5 * backlash / speed
    return [first, first + lasting, first + lasting + backlash / speed, stiffness * depth**1.5]


def screw_driven_array() -> Values:
    """Slider, and torque at constant speed of the slider: (I th'' + I' th'^2 / 2 + V') / (L cos th) times the lead, by (S5)."""
    length, mass, end, lead = 1.0, 2.0, 1.0, 0.02 / (2.0 * math.pi)
    place = length * math.sin(rad(60)) - 0.1
    angle, speed = math.asin(place / length), -20.0 * math.pi * lead
    turning = speed / (length * math.cos(angle))
    middles = 0.5**2 + 1.5**2
    inertia = 4.0 * mass * length**2 / 12.0 + 2.0 * mass * length**2 * math.sin(angle) ** 2 * middles
    inertia += (4.0 * mass / 4.0 + end) * (length * math.cos(angle)) ** 2
    slope = length**2 * (2.0 * mass * middles - mass - end) * math.sin(2.0 * angle)
    weight = (2.0 * mass + end) * G * length * math.cos(angle)
    torque = inertia * turning**2 * math.tan(angle) + 0.5 * slope * turning**2 + weight
    return [place, lead * torque / (length * math.cos(angle))]


def press() -> Values:
    """Dead centres of the ram: sqrt((l +- r)^2 - e^2) below the shaft."""
    return [-math.sqrt((0.2 + 0.04) ** 2 - 0.06**2), -math.sqrt((0.2 - 0.04) ** 2 - 0.06**2)]


def self_deploying() -> Values:
    """Angular acceleration at the release: moment of the two springs over the reduced inertia at 75 degrees, at rest."""
    length, mass, end, angle = 0.6, 0.15, 0.4, rad(75)
    inertia = end * (length * math.cos(angle)) ** 2
    for unit in range(1, 5):
        moved = ((unit - 0.5) * length * math.sin(angle)) ** 2 + (0.5 * length * math.cos(angle)) ** 2
        inertia += 2.0 * (mass * moved + mass * length**2 / 12.0)
    # the angle between the bars of a unit is twice the half opening angle
    return [-2 * 2.0 * 0.8 * (2.0 * angle - rad(20)) / inertia]


def solar_array() -> Values:
    """Middle of the last unit on the reference, after 1.1 of 2 s and at the end: 3.5 L cos th."""
    return [3.5 * 0.6 * math.cos(cycloidal(1.1 / 2.0, rad(75), rad(15))), 3.5 * 0.6 * math.cos(rad(15))]


def a01_pendulum() -> Values:
    """Jacobi's elliptic functions, as of validation/pendulum."""
    from validation.pendulum.reference import place

    return [*place(5.0), *place(10.0)]


def a02_n_four_bar() -> Values:
    """Jacobi's elliptic functions, as of validation/n_four_bar; the middle of the first crank."""
    from validation.n_four_bar.reference import place

    return [0.5 * float(value) for value in (*place(2, 5.0), *place(2, 10.0))]


def a03_squeezer() -> Values:
    """Published angles at 0.03 s."""
    return [None] * 3


def peaucellier() -> Values:
    """The pen is on the line x = (L^2 - s^2)/(2 r); inversion of the crank pin, 50 degrees up after a quarter of the period."""
    power, radius = 0.2**2 - 0.1**2, 0.06
    pin = radius + polar(radius, rad(50))
    return [power / (2.0 * radius), power / (2.0 * radius), (power / pin.conjugate()).imag]


def klann() -> Values:
    """Foot after a quarter, a half and three quarters of a revolution from the crank at 90 degrees."""
    found = []
    for angle in (rad(180), rad(270), rad(360)):
        c = polar(17.5, angle)
        b, d = complex(-38.8, -12.5), complex(-14.6, 41.9)
        h = meet(c, 38.8, b, 23.7, left=False)
        f = meet(c, 73.4, h, 35.2, left=True)
        e = meet(d, 34.1, f, 57.7, left=False)
        foot = meet(e, 111.7, f, 59.0, left=True)
        found += [1e-3 * foot.real, 1e-3 * foot.imag]
    return found


def jansen() -> Values:
    """Toe after a quarter, a half and three quarters of a revolution."""
    found = []
    for angle in (rad(90), rad(180), rad(270)):
        z, x = 0j, complex(38.0, 7.8) + polar(15.0, angle)
        w = meet(z, 41.5, x, 50.0, left=True)
        v = meet(z, 40.1, w, 55.8, left=True)
        u = meet(z, 39.3, x, 61.9, left=False)
        t = meet(v, 39.4, u, 36.7, left=False)
        toe = meet(t, 65.7, u, 49.0, left=False)
        found += [1e-3 * toe.real, 1e-3 * toe.imag]
    return found


def ring(radius: float, pairs: Sequence[tuple[float, float]], turned: Sequence[float]) -> list[float]:
    """Mean of the pivots u(a) + u(b - 2 th) of a plate B, for each angle 2 th: the plate moves without rotation."""
    found = []
    for angle in turned:
        mean = sum(radius * (polar(1.0, a) + polar(1.0, b - angle)) for a, b in pairs) / len(pairs)
        found += [mean.real, mean.imag]
    return found


def retractable_roof() -> Values:
    """Mass centre of the first plate B half-way and at the end, at 2 th = 4 and 24 degrees."""
    pairs = [(rad(45.0 * i), rad(22.5)) for i in (0, -1, -2, -3)]
    return ring(1.0, pairs, (rad(4), rad(24)))


def you_pellegrino_ring() -> Values:
    """Mass centre of the first element B half-way and at the end, at 2 th = 4 and 32 degrees."""
    pairs = [(rad(angle), rad(25)) for angle in (0, 300, 230)]
    return ring(0.6, pairs, (rad(4), rad(32)))


def woodpecker() -> Values:
    """Return no values; test_zoo.py compares these numbers with Lagrange's equations."""
    return [None] * 2


def tape_spring_hinge() -> Values:
    """Constant moment M* until the fold snaps back at M*/k: th = th_0 - M* t^2/(2 J)."""
    inertia, moment, stiffness = 1.0 * 0.5**2 / 3.0, 0.3, 40.0
    rate = moment / inertia
    snap = math.sqrt(2.0 * (rad(90) - moment / stiffness) / rate)
    return [rad(90) - 0.5 * rate * 0.5**2, snap, -rate * 0.9]


def train_pantograph() -> Values:
    """Head at the start, half-way and at the end."""
    found = []
    for angle in (rad(163), rad(142), rad(121)):
        knee, base = polar(1.55, angle), complex(0.101, -0.6)
        tail = meet(knee, 0.22, base, 1.918, left=False)
        head = carried(knee, tail, 1.75 * polar(1.0, -math.pi - rad(42.2)), 0.22)
        found += [head.real, head.imag]
    return found[1:]


def umbrella() -> Values:
    """Law of cosines of crown, rib pin and runner: direction of the right rib and the speed of the runner half-way."""
    rib, stretcher = 0.26, 0.28

    def direction(runner: float) -> float:
        return -0.5 * math.pi + math.acos((rib**2 + runner**2 - stretcher**2) / (2.0 * rib * runner))

    # a cycloidal move has twice its mean speed half-way
    return [direction(0.32), direction(0.12), 2.0 * 0.4 / 0.6]


def rolling_bridge() -> Values:
    """Law of cosines of hinge, post and joint of the handrail: equal folds; the middle of the last."""
    deck, height, link = 2.0, 1.0, 1.15
    post, lean = math.hypot(0.5 * deck, height), math.atan2(height, 0.5 * deck)
    shortest = height + math.sqrt(link**2 - (0.5 * deck) ** 2)

    def middle(strut: float) -> tuple[float, complex]:
        fold = math.pi - 2.0 * (lean + math.acos((post**2 + strut**2 - link**2) / (2.0 * post * strut)))
        place = sum(polar(deck, k * fold) for k in (1, 2)) + polar(0.5 * deck, 3 * fold)
        return fold, place

    half, end = middle(0.5 * (shortest + 2.35)), middle(2.35)
    return [3.0 * half[0], half[1].real, half[1].imag, 3.0 * end[0], end[1].real, end[1].imag]


CLOSED_FORMS: dict[str, Callable[[], Values]] = {
    name.replace("_", "-"): made
    for name, made in list(globals().items())
    if getattr(made, "__annotations__", {}).get("return") == "Values"
}
"""Functions that compute the reference values of a mechanism of the zoo by closed forms, by its name."""
