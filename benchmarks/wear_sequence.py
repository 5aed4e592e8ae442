"""Compare the extrapolated wear of a slider-crank with one trajectory through all its cycles.

The bearing of the trajectory wears after each revolution by the loads of that revolution, so that both roads share only the
contact and the wear by given loads. Command: ``python -m benchmarks.wear_sequence [CYCLES]``.
"""

from __future__ import annotations

import dataclasses
import sys
from functools import partial
from pathlib import Path

from scissordyn.config.file import read_case
from scissordyn.lifetime.loads import CycleRunner, worn_surfaces
from scissordyn.lifetime.step import WornJoint
from scissordyn.lifetime.wear import wear_out
from scissordyn.mechanics.contour import DEPTH
from scissordyn.model.clearance import Clearance
from scissordyn.model.wear import Wear
from scissordyn.plan.plan import plan
from scissordyn.run.batch import Perturbed
from scissordyn.run.stops import drive_period, stops
from scissordyn.run.trajectory import make_driver

CASE = Path(__file__).parent.parent / "examples" / "worn_crank.toml"
CHANGES = ["clearance.wear='1e-3 mm^3/(N m)'"]  # so fast that some hundred cycles change the contour


def depth_of_all(cycles: int, member: int) -> float:
    """Return the largest depth after all cycles in one trajectory [m]; the start of member k is perturbed by round-off."""
    case = read_case(CASE, CHANGES)
    period = drive_period(case.mechanism)
    settings = dataclasses.replace(case.wear or Wear(), cycles=cycles, members=cycles, settle=0)
    (surface,) = worn_surfaces(case.mechanism)
    joint = WornJoint(case.mechanism, [surface], [0], settings.angles)
    clearance, depths = case.mechanism.joint(surface.joint).clearance, joint.depths
    assert isinstance(clearance, Clearance)
    mechanism = case.mechanism.with_clearance(surface.joint, dataclasses.replace(clearance, contour=tuple(depths[0].tolist())))
    runner = CycleRunner(mechanism, case.run, settings, [surface], period)
    start = partial(Perturbed(member, 1e-14).start, member)
    driver, _, _ = make_driver(plan(mechanism), runner.options, perturb=start, loads=True)
    (place,) = (k for k, contact in enumerate(driver.plan.contacts) if contact.name == surface.joint)
    for stop in stops(driver, (period * (k + 1) for k in range(cycles)), case.run.most_steps):
        assert not stop.cause, stop.cause
        worn = joint.worn(depths, runner._loads_of_cycle(driver, ()), 1).depths
        assert worn is not None
        depths = worn
        driver.system.content.parameters.contour[place][:, DEPTH] = depths[0]
    return float(depths.max())


def main(cycles: int) -> None:
    """Print the depths of all cycles, and of computations that leave out different numbers of cycles at their starts."""
    for member in range(2):
        print(f"all {cycles} cycles, start {member + 1}: {1e6 * depth_of_all(cycles, member):.2f} um", flush=True)
    case = read_case(CASE, CHANGES)
    for settle in range(1, 9):
        life = wear_out(case.mechanism, case.run, dataclasses.replace(case.wear or Wear(), cycles=cycles, settle=settle))
        depth, error = (1e6 * float(life[name][-1, 0]) for name in ("depth_largest", "depth_error"))
        print(f"settle {settle}: {depth:.2f} +- {error:.2f} um from {life.attrs['simulated_cycles']} cycles", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
