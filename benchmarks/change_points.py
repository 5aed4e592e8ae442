"""Simulate random linkages through change points: each must continue along its smooth branch."""

from __future__ import annotations

import collections
import dataclasses
import math

import numpy as np

import scissordyn as sd
from benchmarks.kept import Kept
from benchmarks.measure import command, table

CASES = 500

KINDS = ("four-bar, stretched", "four-bar, folded", "antiparallelogram", "parallelogram", "kite", "slider-crank")
MOTIONS = ("driven", "free", "driven, a clearance joint on the coupler", "turned by a torque")

ALLOWED = 1e-5  # Allowed error of an angle [rad] and of the energy (relative)


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Errors of angle and energy of one linkage."""

    seed: int
    kind: str
    motion: str
    verdict: str
    error: float
    energy: float


def random_lengths(rng: np.random.Generator, kind: str) -> tuple[float, float, float, float]:
    """Return lengths of ground, crank, coupler and rocker [m]."""
    while True:
        ground, crank, coupler = rng.uniform(0.5, 3.0, 3).tolist()
        if kind == "four-bar, stretched":
            rocker = ground + crank - coupler
        elif kind == "four-bar, folded":
            rocker = coupler + float(rng.choice([-1.0, 1.0])) * abs(ground - crank)
        elif kind == "kite":
            crank, rocker = ground, coupler
        else:
            coupler, rocker = ground, crank
        rest = abs((coupler + rocker) - (ground + crank)), abs(abs(coupler - rocker) - abs(ground - crank))
        turns = coupler + rocker > ground + crank - 1e-12 and abs(coupler - rocker) < abs(ground - crank) + 1e-12
        apart = kind != "kite" and abs(ground - crank) < 0.2
        if rocker > 0.3 and turns and not apart and (not kind.startswith("four") or max(rest) > 0.3):
            return ground, crank, coupler, rocker


def rocker_angle(lengths: tuple[float, float, float, float], crank: np.ndarray, sign: float) -> np.ndarray:
    """Return the rocker's angle on the smooth branch by the law of cosines.

    Where a factor touches zero, its root changes sign.
    """
    g, a, b, c = lengths
    if g == a and b == c:
        far = 2.0 * g * np.sin(0.5 * crank)
        return np.asarray(0.5 * crank + 0.5 * math.pi + sign * np.arccos(far / (2.0 * c)))
    square = g * g + a * a - 2.0 * g * a * np.cos(crank)
    outer, inner = (b + c) ** 2 - square, square - (b - c) ** 2
    stretched = 2.0 * math.sqrt(g * a) * np.cos(0.5 * crank) if abs(b + c - g - a) < 1e-9 else np.sqrt(outer)
    folded = 2.0 * math.sqrt(g * a) * np.sin(0.5 * crank) if abs(abs(b - c) - abs(g - a)) < 1e-9 else np.sqrt(inner)
    direction = np.arctan2(a * np.sin(crank), a * np.cos(crank) - g)
    return np.asarray(direction + sign * np.arctan2(stretched * folded, c * c + square - b * b))


def linkage(lengths: tuple[float, float, float, float], first: float, sign: float, motion: str, speed: float) -> sd.Mechanism:
    """Return the four-bar at a crank angle on one of its branches."""
    g, a, b, c = lengths
    third = float(rocker_angle(lengths, np.array(first), sign))
    tip = a * math.cos(first), a * math.sin(first)
    end = g + c * math.cos(third), c * math.sin(third)
    second = math.atan2(end[1] - tip[1], end[0] - tip[0])
    eps = 1e-5
    slope = float(rocker_angle(lengths, np.array(first + eps), sign) - rocker_angle(lengths, np.array(first - eps), sign))
    rate = math.remainder(slope, 2.0 * math.pi) / (2.0 * eps) * speed
    tip_rate = -speed * tip[1], speed * tip[0]
    end_rate = -rate * (end[1]), rate * (end[0] - g)
    turn = ((end_rate[1] - tip_rate[1]) * math.cos(second) - (end_rate[0] - tip_rate[0]) * math.sin(second)) / b
    parts = {
        "crank": ((0.0, 0.0), (0.0, 0.0), first, speed, a),
        "coupler": (tip, tip_rate, second, turn, b),
        "rocker": ((g, 0.0), (0.0, 0.0), third, rate, c),
    }
    bodies = [
        sd.Body(
            name,
            1.0 + length,
            0.1 * length**2,
            {"start": (0.0, 0.0), "end": (length, 0.0)},
            centre=(0.4 * length, 0.0),
            position=place,
            velocity=velocity,
            angle=angle,
            angular_velocity=rotation,
        )
        for name, (place, velocity, angle, rotation, length) in parts.items()
    ]
    joints = [
        sd.Revolute("A", ("crank", "start"), ("ground", "O2")),
        sd.Revolute("B", ("coupler", "start"), ("crank", "end")),
        sd.Revolute("C", ("coupler", "end"), ("rocker", "end")),
        sd.Revolute("D", ("rocker", "start"), ("ground", "O4")),
    ]
    fixed = (("O2", (0.0, 0.0)), ("O4", (g, 0.0)))
    torque = ()
    if motion.startswith("driven, "):
        bodies.append(sd.Body("bob", 0.2, 0.001, {"pin": (0.0, 0.2)}, position=(tip[0], tip[1] - 0.2)))
        joints.append(sd.Revolute("E", ("bob", "pin"), ("coupler", "start"), sd.Clearance(1e-3)))
    if motion == "turned by a torque":
        torque = (sd.Torque("push", "crank", math.copysign(0.5, speed)),)
    mechanism = sd.Mechanism(tuple(bodies), tuple(joints), components=torque, ground=fixed, gravity=0.0, input_body="crank")
    return mechanism.driven(speed=speed) if motion.startswith("driven") else mechanism


def judge(seed: int) -> Outcome:
    """Run a random linkage over about one turn of its crank and compare it with the closed form."""
    rng = np.random.default_rng(seed)
    kind, motion = str(rng.choice(KINDS)), str(rng.choice(MOTIONS))
    speed, sign = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-1.0, 1.5)), float(rng.choice([-1.0, 1.0]))
    first = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 2.7))
    until = 2.0 * math.pi / abs(speed) * (0.2 if motion.endswith("coupler") else 1.0)
    if motion.endswith("coupler"):
        first = math.copysign(math.pi - 0.5 if "folded" not in kind and kind != "kite" else -0.5, speed)
        speed = math.copysign(min(abs(speed), 3.0), speed)
        until = 1.0 / abs(speed)
    if kind == "slider-crank":
        mechanism = sd.slider_crank(crank=0.3, rod=0.3, angle=first, gravity=0.0)
        motion = "driven"
        run = sd.simulate(mechanism.driven(speed=speed), until=until, samples=101)
        crank = run["angle"].sel(body="crank").values
        # beyond a right angle the slider starts on the crank's pivot, and stays there
        other, expected = run["angle"].sel(body="rod").values, -crank if math.cos(first) > 0.0 else crank + math.pi
    else:
        lengths = random_lengths(rng, kind)
        if kind == "parallelogram":
            sign = -math.copysign(1.0, math.sin(first) * math.cos(0.5 * first) * math.sin(0.5 * first) or 1.0)
            third = float(rocker_angle(lengths, np.array(first), sign))
            sign = sign if abs(math.remainder(third - first, 2.0 * math.pi)) < 1e-6 else -sign
        run = sd.simulate(linkage(lengths, first, sign, motion, speed), until=until, samples=101)
        crank = run["angle"].sel(body="crank").values
        other, expected = run["angle"].sel(body="rocker").values, rocker_angle(lengths, crank, sign)
    if run.attrs["status"] != "complete":
        return Outcome(seed, kind, motion, f"failed: {run.attrs['cause']}", math.nan, math.nan)
    error = float(np.max(np.abs(np.exp(1j * other) - np.exp(1j * expected))))
    energy = float(np.max(np.abs(run["energy_residual"].values)) / np.max(run["kinetic_energy"].values))
    kept = error < ALLOWED and energy < ALLOWED
    return Outcome(seed, kind, motion, "on its branch" if kept else "differs", error, energy)


def measure(quick: bool = False) -> str:
    """Return the outcomes of the first linkages; an interrupted measurement continues."""
    outcomes = Kept("change_points", Outcome, __file__).complete(range(20 if quick else CASES), judge)
    rows = []
    for names, of in ((KINDS, "kind"), (MOTIONS, "motion")):
        for name in names:
            part = [each for each in outcomes if getattr(each, of) == name]
            good = [each for each in part if each.verdict == "on its branch"]
            worst = [f"{max((getattr(each, key) for each in good), default=0.0):.1e}" for key in ("error", "energy")]
            rows.append([name, str(len(part)), str(len(good)), *worst])
    verdicts = collections.Counter(each.verdict.partition(":")[0] for each in outcomes)
    others = [
        f"* {each.seed}: {each.kind}, {each.motion}: {each.verdict}, {each.error:.1e}, {each.energy:.1e}" for each in outcomes
    ]
    others = [text for text in others if "on its branch" not in text]
    return f"""{len(outcomes)} random linkages that pass one or two change points, at 0.1 to 30 rad/s, over a turn of the crank.
The angle of the rocker is compared with the smooth branch by the law of cosines, and the energy balance is closed. Outcomes:
{", ".join(f"{name} {count}" for name, count in verdicts.items())}.

{table(["linkage or motion", "runs", "on the branch", "largest error of an angle [rad]", "of the energy"], rows)}

""" + "\n".join(others)


if __name__ == "__main__":
    command("change_points", measure)
