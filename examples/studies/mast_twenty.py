"""What is left of the motion of examples/mast_twenty.toml at the end of its run."""

import math

from scissordyn.record.events import ENERGY_TERMS
from scissordyn.run.measure import Ended


def residual_speed(ended: Ended) -> float:
    """Speed of the mast at the end, root mean square over its mass."""
    energy = dict(zip(ENERGY_TERMS, ended.accounts.tolist(), strict=True))
    left = energy.pop("drive_work") + energy.pop("load_work") + energy.pop("motor_work") - sum(energy.values())
    return math.sqrt(2.0 * max(left, 0.0) / sum(body.mass for body in ended.mechanism.bodies))
