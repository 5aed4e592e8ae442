"""Siconos: bodies in x, y and angle with equality constraints, and an impact law for the hole (Moreau-Jean time stepping).

It is Debian's package, for Debian's Python: `apt-get install --no-install-recommends python3-siconos`. Its constraints are
functions of a library in C, which is written and compiled here: relations in Python end the process when a contact closes.
"""

import ctypes
import json
import math
import subprocess
import tempfile
import time

import numpy as np
import siconos.kernel as sk
from shared import read

problem, setting = read()
careful = setting != "default"
step = 5e-4  # 0.5 ms and theta = 0.50001 are the defaults of its runner for mechanics
if careful:
    step = float(setting) if setting != "careful" else 1e-4
theta = 0.5 if careful else 0.50001
SIGNATURE = "(unsigned nq, const double *q, unsigned n, double *out, unsigned nz, double *z)"
source, links = ["#include <math.h>"], []


def relation(values, slopes, law, ends):
    """Write a relation in C: its values, and their derivatives by column."""
    number = len(links)
    for name, lines in (("h", values), ("G", [slope for column in zip(*slopes, strict=True) for slope in column])):
        text = " ".join(f"out[{k}] = {line};" for k, line in enumerate(lines))
        source.append(f"void {name}{number}{SIGNATURE} {{ {text} }}")
    links.append((law, ends))


def point(k, place, first):
    """Return x and y of a point as C, and their derivatives; `first` is the index of the body's x in q."""
    if k < 0:
        return [repr(value) for value in place], [[], []]
    c, s, (a, b) = f"cos(q[{first + 2}])", f"sin(q[{first + 2}])", place
    x, y = f"({c} * {a!r} - {s} * {b!r})", f"({s} * {a!r} + {c} * {b!r})"
    return [f"(q[{first}] + {x})", f"(q[{first + 1}] + {y})"], [["1.0", "0.0", f"-{y}"], ["0.0", "1.0", x]]


for a, place, b, other in problem["pins"]:
    (k, here), (m, there) = sorted([(a, place), (b, other)], reverse=True)  # the ground is last
    (x, dx), (y, dy) = point(k, here, 0), point(m, there, 3)
    slopes = [first + [f"-({slope})" for slope in second] for first, second in zip(dx, dy, strict=True)]
    relation([f"{p} - {q}" for p, q in zip(x, y, strict=True)], slopes, sk.EqualityConditionNSL(2), [k] + [m] * (m >= 0))
for k, turn in problem["slides"]:
    (x, y, angle), across = problem["bodies"][k]["pose"], (-math.sin(turn), math.cos(turn))
    values = [f"{across[0]!r} * (q[0] - {x!r}) + {across[1]!r} * (q[1] - {y!r})", f"q[2] - {angle!r}"]
    relation(values, [[repr(across[0]), repr(across[1]), "0.0"], ["0.0", "0.0", "1.0"]], sk.EqualityConditionNSL(2), [k])
if "hole" in problem:
    hole, friction = problem["hole"], problem["hole"].get("friction", 0.0)
    (x, y), ((_, _, xt), (_, _, yt)) = point(0, hole["place"], 0)
    far = f"(1e-30 + hypot({x}, {y}))"  # the normal is towards the centre of the pin
    normal = [f"-{x} / {far}", f"-{y} / {far}", f"-({x} * {xt} + {y} * {yt}) / {far}"]
    slip = [f"{y} / {far}", f"-{x} / {far}", f"({y} * {xt} - {x} * {yt}) / {far} + {hole['radius']!r}"]
    gap = f"{hole['radius'] - hole['pin']!r} - {far}"
    if friction:
        relation([gap, "0.0"], [normal, slip], sk.NewtonImpactFrictionNSL(hole["restitution"], 0.0, friction, 2), [0])
    else:
        relation([gap], [normal], sk.NewtonImpactNSL(hole["restitution"]), [0])
model = sk.NonSmoothDynamicalSystem(0.0, problem["until"])
bodies, kept = [], []  # Siconos points to the arrays that are kept
for given in problem["bodies"]:
    mass = np.diag([given["mass"], given["mass"], given["inertia"] or 1.0])  # a slider does not rotate
    weight = np.array([*problem["gravity"], 0.0]) * given["mass"]
    start = np.array(given["pose"]), np.array(given["rate"])
    bodies.append(sk.LagrangianLinearTIDS(*start, mass))
    bodies[-1].setFExtPtr(weight)
    kept.extend([mass, weight, *start])
    model.insertDynamicalSystem(bodies[-1])
with tempfile.TemporaryDirectory() as folder:  # Siconos finds the library by its name, as it is loaded already
    library = f"{folder}/RelationsPlugin.so"
    command = ["cc", "-O2", "-shared", "-fPIC", "-Wl,-soname,RelationsPlugin.so", "-o", library, "-x", "c", "-", "-lm"]
    subprocess.run(command, input="\n".join(source), text=True, check=True)
    ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)
for number, (law, ends) in enumerate(links):
    made = sk.LagrangianScleronomousR(f"RelationsPlugin:h{number}", f"RelationsPlugin:G{number}")
    link = sk.Interaction(law, made)
    kept.extend([law, made, link])
    model.link(link, *[bodies[k] for k in ends])
clock = sk.TimeDiscretisation(0.0, step)
impulses = sk.MLCP() if problem["pins"] else (sk.FrictionContact(2) if friction else sk.LCP())
if careful and problem["pins"]:
    scheme, places = sk.MoreauJeanDirectProjectionOSI(theta), sk.MLCPProjectOnConstraints()
    simulation = sk.TimeSteppingDirectProjection(model, clock, scheme, impulses, places)
    simulation.setProjectionMaxIteration(20)
    simulation.setConstraintTol(1e-10)
    simulation.setConstraintTolUnilateral(1e-10)
else:
    scheme = sk.MoreauJeanOSI(theta)
    simulation = sk.TimeStepping(model, clock, scheme, impulses)
samples = len(problem["reference"]) - 1
every = round(problem["until"] / step / samples)
made, began = [], time.perf_counter()
for n in range(every * samples + 1):
    if n % every == 0:
        made.append([[*body.q().tolist(), *body.velocity().tolist()] for body in bodies])
    if n < every * samples:
        simulation.computeOneStep()
        simulation.nextStep()
print("\n" + json.dumps({"states": made, "seconds": time.perf_counter() - began}))
