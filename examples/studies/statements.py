"""Which of the paper's statements hold: measures of a run that has one choice of the parameters that the paper lost.

The run itself only carries the choice: which bar is driven, its angle at the start, whether it rises or falls, the restitution
coefficient and the bearing length. Each measure is 1 where its statement holds for the paper's runs with that choice, else 0.
"""

from collections.abc import Callable
from functools import cache

import xarray as xr

from scissordyn.casefile.configuration import read_configuration
from scissordyn_paper.cases import Choice
from scissordyn_paper.judge import findings
from scissordyn_paper.statements import CHECKS


@cache
def _answers(choice: Choice) -> tuple[float, ...]:
    """1 or 0 for every statement; all measures of a case share the paper's runs."""
    return tuple(float(finding.holds) for finding in findings(choice))


def _choice(run: xr.Dataset) -> Choice:
    mechanism = read_configuration(run).build_mechanism()
    joint = next(joint for joint in mechanism.joints if joint.name == "A")
    clearance, (drive,) = joint.clearance, mechanism.drives
    assert clearance is not None
    return Choice(
        driven_bar="slider" if drive.body in (joint.journal[0], joint.bearing[0]) else "pinned",
        angle=next(body.angle for body in mechanism.bodies if body.name == drive.body),
        travel="rising" if drive.motion.speed > 0.0 else "falling",
        restitution=clearance.damping.restitution,
        bearing_length=clearance.bearing_length,
    )


def _measure(place: int, says: str) -> Callable[[xr.Dataset], float]:
    def holds(run: xr.Dataset) -> float:
        return _answers(_choice(run))[place]

    holds.__doc__ = says
    return holds


for _place, _check in enumerate(CHECKS):
    globals()[f"holds_{_check.key}"] = _measure(_place, f"{_check.key} {_check.says}")
