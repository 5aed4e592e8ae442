"""Simulate random scissor arrays drawn with few decimals: none is refused, and each moves like the exact one."""

from __future__ import annotations

import collections
import dataclasses
import math
import warnings

import numpy as np

import scissordyn as sd
from benchmarks.kept import Kept
from benchmarks.measure import command, table
from scissordyn.exchange.dxf import read_dxf

CASES = 2000

ALLOWED = 100.0  # Allowed error of an angle times a bar's length, in units of the rounding
STROKE = 0.35  # Change of the first unit's angle [rad]


@dataclasses.dataclass(frozen=True)
class Array:
    """Straight array: unit k has bars of length p[k] + q[k]; `first` is the angle of the first unit's bars to the axis."""

    p: tuple[float, ...]
    q: tuple[float, ...]
    first: float
    lean: float
    """Angle of the axis to x [rad]."""
    shift: tuple[float, float]
    """Position of the array in the drawing [m]."""

    def angles(self, first: np.ndarray) -> np.ndarray:
        """Return the angles of the units to the axis, shape (units, ...).

        Kites between units have sides q and p of neighbours.
        """
        found = [first]
        for before, after in zip(self.q[:-1], self.p[1:], strict=True):
            found.append(np.arcsin(np.sin(found[-1]) * before / after))
        return np.array(found)

    def bars(self) -> list[list[tuple[float, float]]]:
        """Return corners and pivot of each bar as drawn, two bars a unit [m]."""
        bars, x, half = [], 0.0, self.p[0] * math.sin(self.first)
        for p, q, angle in zip(self.p, self.q, self.angles(np.array(self.first)).tolist(), strict=True):
            x += p * math.cos(angle)
            for side in (1.0, -1.0):
                along, across = math.cos(angle), side * math.sin(angle)
                bars.append([(x + s * along, half + s * across) for s in (-p, 0.0, q)])
            x += q * math.cos(angle)
        cos, sin = math.cos(self.lean), math.sin(self.lean)
        return [[(self.shift[0] + cos * a - sin * b, self.shift[1] + sin * a + cos * b) for a, b in bar] for bar in bars]


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Outcome of a rounded array with its largest error of an angle times a length, in units of the rounding."""

    seed: int
    source: str
    decimals: int
    units: int
    verdict: str
    error: float


def random_array(rng: np.random.Generator) -> Array:
    """Return 1 to 6 units, rhombi in half of the cases, else kites; no unit comes near flat or upright."""
    units = int(rng.integers(1, 7))
    side = rng.uniform(0.1, 0.6)
    p, q = ([side] * units, [side] * units) if rng.random() < 0.5 else (rng.uniform(0.5, 0.6, (2, units)) * side).tolist()
    while True:
        array = Array(
            tuple(p), tuple(q), float(rng.uniform(0.3, 0.6)), float(rng.uniform(-3.0, 3.0)), tuple(rng.normal(size=2))
        )
        with np.errstate(invalid="ignore"):
            angles = array.angles(np.array([array.first, array.first + STROKE]))
        if np.all(np.isfinite(angles)) and np.min(angles) > 0.1 and np.max(angles) < 1.2:
            return array
        p, q = (rng.uniform(0.5, 0.6, (2, units)) * side).tolist()


def drawing(array: Array, decimals: int) -> str:
    """Return the array as DXF in mm."""

    def pair(place: tuple[float, float], codes: tuple[int, int]) -> list[str]:
        return [text for code, x in zip(codes, place, strict=True) for text in (str(code), f"{1e3 * x:.{decimals}f}")]

    lines = ["0", "SECTION", "2", "HEADER", "9", "$INSUNITS", "70", "4", "0", "ENDSEC", "0", "SECTION", "2", "ENTITIES"]
    bars = array.bars()
    for start, _, end in bars:
        lines += ["0", "LINE", "8", "0", *pair(start, (10, 20)), *pair(end, (11, 21))]
    for _, pivot, _ in bars[::2]:
        lines += ["0", "POINT", "8", "0", *pair(pivot, (10, 20))]
    first, second = bars[0][0], bars[1][0]
    beyond = 2.0 * second[0] - first[0], 2.0 * second[1] - first[1]
    lines += ["0", "POINT", "8", "ground", *pair(first, (10, 20))]
    lines += ["0", "LINE", "8", "guide", *pair(second, (10, 20)), *pair(beyond, (11, 21))]
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""])


def tabled(array: Array, decimals: int) -> sd.Mechanism:
    """Return the array as a table of bodies in m and rad with rounded positions, angles and lengths."""
    bodies, joints = [], []

    def number(x: float) -> float:
        return round(float(x), decimals)

    for k, (start, pivot, end) in enumerate(array.bars()):
        points = {
            "start": (0.0, 0.0),
            "pivot": (number(math.dist(start, pivot)), 0.0),
            "end": (number(math.dist(start, end)), 0.0),
        }
        angle = math.atan2(end[1] - start[1], end[0] - start[0])
        bodies.append(
            sd.Body(f"bar {k + 1}", 1.0, 0.01, points, position=(number(start[0]), number(start[1])), angle=number(angle))
        )
    for k in range(len(array.p)):
        a, b, c, d = (f"bar {2 * k + n}" for n in (1, 2, 3, 4))
        joints.append(sd.Revolute(f"pivot {k}", (b, "pivot"), (a, "pivot")))
        if k + 1 < len(array.p):
            joints += [sd.Revolute(f"upper {k}", (d, "start"), (a, "end")), sd.Revolute(f"lower {k}", (c, "start"), (b, "end"))]
    x, y = array.bars()[0][0]
    foot = number(x), number(y)
    joints.append(sd.Revolute("foot", ("bar 1", "start"), ("ground", "foot")))
    guide = sd.Guide("guide", ("bar 2", "start"), foot, array.lean + 0.5 * math.pi)
    return sd.Mechanism(
        tuple(bodies), tuple(joints), guides=(guide,), ground=(("foot", foot),), gravity=0.0, input_body="bar 1"
    )


def judge(seed: int) -> Outcome:
    """Round a random array, drive it, and compare the angles of all bars with the closed form."""
    rng = np.random.default_rng(seed)
    array, source, decimals = random_array(rng), str(rng.choice(["drawing", "table"])), int(rng.integers(3, 13))
    rounding = 0.5 * 10.0**-decimals * (1e-3 if source == "drawing" else 1.0)
    units, length = len(array.p), min(array.p)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            if source == "drawing":
                text = drawing(array, decimals)
                mechanism = read_dxf(text, tolerance=max(4.0 * rounding, 1e-7)).mechanism
            else:
                mechanism = tabled(array, decimals)
            names = [f"bar {k + 1}" for k in range(2 * units)]
            run = sd.simulate(mechanism.driven(speed=1.0), until=STROKE, samples=8, rtol=1e-12, atol=1e-12)
    except sd.InputError as error:
        return Outcome(seed, source, decimals, units, f"refused: {error}", math.nan)
    if run.attrs["status"] != "complete":
        return Outcome(seed, source, decimals, units, f"failed: {run.attrs['cause']}", math.nan)
    first = array.first + run["time"].values
    expected = np.repeat(array.angles(first), 2, axis=0)
    expected[1::2] *= -1.0
    angle = np.stack([run["angle"].sel(body=name).values for name in names])
    worst = float(np.max(np.abs(np.exp(1j * (angle - array.lean)) - np.exp(1j * expected)))) * length
    # errors of an exact array are compared with the round-off of its coordinates
    errors = worst / max(rounding, 2e-14)
    return Outcome(seed, source, decimals, units, "as the exact one" if errors < ALLOWED else "differs", errors)


def measure(quick: bool = False) -> str:
    """Return the outcomes of the first arrays; an interrupted measurement continues."""
    kept = Kept("rounded_drawings", Outcome, __file__)
    outcomes = kept.complete(range(40 if quick else CASES), judge)
    verdicts = collections.Counter(each.verdict.partition(":")[0] for each in outcomes)
    rows = []
    for source in ("drawing", "table"):
        for low, high in ((3, 5), (6, 8), (9, 12)):
            part = [each for each in outcomes if each.source == source and low <= each.decimals <= high]
            errors = [each.error for each in part if each.verdict == "as the exact one"]
            rows.append(
                [source, f"{low} to {high}", str(len(part)), str(len(errors)), f"{np.median(errors):.2g}", f"{max(errors):.2g}"]
            )
    others = [
        f"* {each.seed}: {each.source}, {each.decimals} decimals, {each.units} units, {each.verdict}, {each.error:.3g}"
        for each in outcomes
        if each.verdict != "as the exact one"
    ]
    return f"""{len(outcomes)} random arrays of 1 to 6 units (rhombi and kites), drawn as DXF in mm or tabled in m and rad, with
3 to 12 decimals. The first bar is driven by {STROKE} rad. The angles of all bars are compared with those of the exact array, by
a closed form. Outcomes: {", ".join(f"{name} {count}" for name, count in verdicts.items())}.

{table(["source", "decimals", "arrays", "as the exact one", "median error in roundings", "largest"], rows)}

""" + "\n".join(others[:40])


if __name__ == "__main__":
    command("rounded_drawings", measure)
