"""Air drag of an arm: a torque that grows with the square of its angular velocity."""

from typing import Annotated

import scissordyn as sd
from scissordyn.components.port import HINGE


def force(angle, speed, factor):
    """Return torque [N m], stored energy [J] and dissipated power [W]."""
    torque = factor * abs(speed) * speed
    return -torque, 0.0, torque * speed


@sd.component(port=HINGE, force=force, section="air_drag", symbol="hinge", example={"body": "arm 1", "factor": "1e-5 N m s^2"})
class AirDrag:
    """Torque -c |w| w on a body.

    Parameters
    ----------
    name : str
    body, base : str
    factor : float
        Coefficient c [N m s^2].
    """

    name: str
    body: str
    base: str = "ground"
    factor: Annotated[float, sd.Quantity("N m s^2", minimum=0.0, maximum=1e3, help="torque over angular velocity squared")] = (
        0.0
    )
