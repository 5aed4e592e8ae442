#!/usr/bin/env bash
# python3-siconos 4.4.0 (Debian 12), 2026-11-30: a relation written in Python ends the process when its contact closes.
#
# A mass falls onto the floor. Its gap is a class derived from LagrangianScleronomousR, with computeh, computeJachq and computeDotJachq.
# While the contact is open Siconos calls them; in the first step with a closed contact it reads a matrix that is gone. Seen:
# signal 11 in MoreauJeanOSI::computeFreeOutput, without a message. The same gap as a linear relation, or as functions of a library
# in C, works. Needs `apt-get install --no-install-recommends python3-siconos`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat > "$folder/ball.py" <<'PY'
import sys

import numpy as np
import siconos.kernel as sk


class Gap(sk.LagrangianScleronomousR):
    def __init__(self):
        super().__init__()
        self.matrix = np.array([[1.0]], order="F")
        self.setJachqPtr(self.matrix)

    def computeh(self, q, z, y):
        y[0] = q[0]

    def computeJachq(self, q, z):
        self.matrix[0, 0] = 1.0

    def computeDotJachq(self, q, z, rate):
        pass


mass, start, rate, weight = np.eye(1), np.array([0.1]), np.array([0.0]), np.array([-9.81])
ball = sk.LagrangianLinearTIDS(start, rate, mass)
ball.setFExtPtr(weight)
model = sk.NonSmoothDynamicalSystem(0.0, 0.3)
model.insertDynamicalSystem(ball)
law, relation = sk.NewtonImpactNSL(0.5), Gap() if sys.argv[1] == "python" else sk.LagrangianLinearTIR(np.eye(1))
contact = sk.Interaction(law, relation)
model.link(contact, ball)
clock, scheme, solver = sk.TimeDiscretisation(0.0, 1e-3), sk.MoreauJeanOSI(0.5), sk.LCP()
simulation = sk.TimeStepping(model, clock, scheme, solver)
for step in range(300):
    simulation.computeOneStep()
    simulation.nextStep()
    print(f"step {step}: height {ball.q()[0]:.4f} m", flush=True)
PY
/usr/bin/python3 "$folder/ball.py" linear | tail -n 1
status=0
/usr/bin/python3 "$folder/ball.py" python > "$folder/out" 2>&1 || status=$?
grep "^step" "$folder/out" | tail -n 1
echo "ended with status $status"
[ "$status" -eq 139 ] || { echo "a relation in Python works now"; exit 1; }
