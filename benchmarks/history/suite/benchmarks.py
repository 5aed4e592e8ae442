"""Processor times of a few tasks over the history of the package, for asv."""

import subprocess
import sys
import time

import numpy as np

import scissordyn as sd


class _Task:
    timer = time.process_time
    timeout = 300.0
    number = 1
    repeat = (3, 10, 20.0)

    def setup(self):
        arm = sd.scissor(units=2).driven(speed=sd.rpm(150))
        self.ideal, self.clearance = arm, arm.with_clearance("A", sd.Clearance(0.5e-3))
        self.frictional = arm.with_clearance("A", sd.Clearance(0.5e-3, friction=sd.LuGre(0.1)))
        sd.simulate(self.frictional, until=1e-3)


class Runs(_Task):
    """Runs of the paper's array, 50 ms."""

    def time_ideal(self):
        """Ideal joints."""
        sd.simulate(self.ideal, until=0.05)

    def time_clearance(self):
        """One clearance joint without friction."""
        sd.simulate(self.clearance, until=0.05)

    def time_friction(self):
        """One clearance joint with LuGre friction."""
        sd.simulate(self.frictional, until=0.01)


class Start:
    """Work that a command does before it begins its own."""

    timeout = 120.0
    number = 1
    repeat = 3

    def time_import(self):
        """Measure the import of the package in a new process by wall-clock time."""
        subprocess.run([sys.executable, "-c", "import scissordyn as sd; sd.simulate"], check=True)


class Fit(_Task):
    """A fit to a record of a pendulum."""

    def setup(self):
        """Make the record with the numbers of the case, disturbed by a sine."""
        self.arm = sd.Mechanism(
            bodies=(sd.Body("arm", 0.15, 0.0006, {"pin": (0.0, 0.0)}, centre=(0.15, 0.0), angle=-0.5),),
            joints=(sd.Revolute("A", ("arm", "pin"), ("ground", "O")),),
            ground=(("O", (0.0, 0.0)),),
            components=(sd.TorsionSpring("pivot", "arm", damping=0.0005),),
        )
        run = sd.simulate(self.arm, until=2.0, samples=101, start="as-placed")
        angle = run["angle"].values + 1e-3 * np.sin(40.0 * run["time"].values)[:, None]
        self.record = sd.Measured(run["time"].values, ("angle of arm",), angle, ("rad",))

    def time_pendulum(self):
        """Two numbers and the start."""
        sd.fit(self.arm, self.record, ["arm.inertia", "pivot.damping"], segment=float("inf"))
