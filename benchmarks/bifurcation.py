"""Measure a bifurcation diagram over the clearance: 300 values with 200 cycles each, with and without friction.

The paper's array is driven at its pinned bar by th_1 = 45 deg + 10 deg sin(2 pi f t) with f = 8 Hz and has clearance at joint
A. The slider's acceleration is about sixty times gravity, and the reaction of joint A changes its sign twice per cycle. From
0.1 to 0.7 mm the motion with friction changes from period 1 through several windows of irregular motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import scissordyn as sd
from benchmarks.cases import name_of
from benchmarks.measure import command, table
from scissordyn.periodic.bifurcation import bifurcation
from scissordyn.periodic.cycles import cycle

__all__ = ["CLEARANCES", "FREQUENCY", "array", "measure"]

FREQUENCY = 8.0  # Frequency of the drive [Hz]

CLEARANCES = (0.1e-3, 0.7e-3)
VALUES, CYCLES, KEPT, WORKERS = 300, 200, 60, 2

TOLERANCES = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3)
TARGET = {None: 100.0, 0.05: 300.0}  # Targets for the time of the diagrams [s], by kinetic friction coefficient

KINETIC = tuple(TARGET)


def array(kinetic: float | None, clearance: float = 0.5e-3) -> sd.Mechanism:
    """Return the paper's array under an oscillating drive."""
    described = sd.Clearance(clearance) if kinetic is None else sd.Clearance(clearance, friction=sd.LuGre(kinetic=kinetic))
    drive = sd.Harmonic(math.radians(45.0), math.radians(10.0), 2.0 * math.pi * FREQUENCY)
    return sd.scissor(units=2, angle=math.radians(45.0)).driven(drive).with_clearance("A", described)


@dataclass(frozen=True)
class Mean:
    """Mean over cycles, and its standard error if cycles were independent."""

    value: float
    error: float

    @classmethod
    def of(cls, values: np.ndarray) -> Mean:
        """Return the mean of one value per cycle."""
        return cls(float(np.mean(values)), float(np.std(values) / math.sqrt(values.size)))

    def __str__(self) -> str:
        return f"{self.value:.5g} ± {self.error:.1g}"


def measure(quick: bool = False) -> str:
    """Return the tables of the diagrams and of the statistics by tolerance."""
    return f"{_diagrams(quick)}\n{_tolerances(quick)}"


def _diagrams(quick: bool) -> str:
    values, cycles = (12, 20) if quick else (VALUES, CYCLES)
    rows = []
    for kinetic in KINETIC:
        diagram = bifurcation(
            array(kinetic),
            over="A.clearance",
            values=np.linspace(*CLEARANCES, values),
            cycles=cycles,
            keep=min(KEPT, cycles),
            engine=WORKERS,
        )
        if set(diagram["status"].values) != {"complete"}:
            raise RuntimeError(f"{name_of(kinetic)}: {sorted(set(diagram['cause'].values))}")
        total = float(diagram["completed_cycles"].sum())
        # other processes increase the wall time, but not the processor time
        whole = VALUES * CYCLES / (float(diagram.attrs["cycles_per_second"]) * WORKERS)
        rows.append(
            [
                name_of(kinetic),
                f"{values} x {cycles}",
                f"{float(diagram['total_steps'].sum()) / total:.0f}",
                f"{float(diagram['total_events'].sum()) / total:.1f}",
                f"{diagram.attrs['cycles_per_second']:.0f}",
                f"{diagram.attrs['wall_seconds']:.0f}",
                f"{whole:.0f} of {TARGET[kinetic]:.0f}: {'met' if whole <= TARGET[kinetic] else 'missed'}",
            ]
        )
    head = ["case", "values x cycles", "steps per cycle", "events per cycle", "cycles/s a core", "wall [s]", "300 x 200 [s]"]
    text = (
        f"Tolerance 1e-6, {WORKERS} threads, {CLEARANCES[0] * 1e3:g} to {CLEARANCES[1] * 1e3:g} mm, {FREQUENCY:g} Hz.\n"
        f"Cycles/s are per second of processor time; the last column is at that rate on {WORKERS} free cores.\n\n"
    )
    return text + table(head, rows)


def _tolerances(quick: bool) -> str:
    rows = []
    cycles, skipped = (20, 10) if quick else (60, 20)
    for kinetic in KINETIC:
        for clearance in (0.19e-3, 0.36e-3) if quick else (0.1e-3, 0.19e-3, 0.36e-3, 0.5e-3, 0.7e-3):
            for tolerance in TOLERANCES:
                run = cycle(array(kinetic, clearance), cycles=cycles, rtol=tolerance, atol=tolerance)
                late = run.isel(cycle=slice(skipped, None))
                rows.append(
                    [
                        name_of(kinetic),
                        f"{clearance * 1e3:g}",
                        f"{tolerance:.0e}",
                        f"{run.attrs['cycles_per_second']:.0f}",
                        str(Mean.of(late["impacts"].values)),
                        str(Mean.of(late["contact_fraction"].values)),
                        str(Mean.of(late["peak_force"].values)),
                        f"{float(late['slider_velocity'].std()):.0e}",
                    ]
                )
    head = [
        "case",
        "c [mm]",
        "tolerance",
        "cycles/s",
        "impacts",
        "contact fraction",
        "peak force [N]",
        "spread of velocity [m/s]",
    ]
    text = f"Statistics of cycles {skipped} to {cycles - 1} against the tolerance.\n\n"
    return text + table(head, rows)


if __name__ == "__main__":
    command("bifurcation", measure)
