"""A hinge whose torque a controller chooses; it may sense a point beside."""

from __future__ import annotations

import dataclasses
from typing import Any

from scissordyn.component.port import hinge
from scissordyn.component.port.declaration import Attachment, Output, place


def attachments(component: Any) -> tuple[Attachment, ...]:
    """The directions of both bodies, then where the sensor is from its origin."""
    places = hinge.attachments(component)
    if component.sensor is not None:
        places = (*places, place(component.sensor))
        if component.sensor_origin is not None:
            places = (*places, place(component.sensor_origin, -1.0))
    return places


ACTUATOR = dataclasses.replace(
    hinge.HINGE,
    name="actuator",
    code=5,
    outputs=(Output("torque", "N m", "torque on the body"),),
    symbols={"motor": hinge.MOTOR},
    attachments=attachments,
)
