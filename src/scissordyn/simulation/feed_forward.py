"""The torque that a course needs, for a controller to feed forward."""

from __future__ import annotations

import dataclasses

from scissordyn.errors import InputError
from scissordyn.model.drive import Motion, TableMotion
from scissordyn.model.element import Actuator, Force
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.interrupt import pass_on
from scissordyn.simulation.run import simulate

__all__ = ["feed_forward"]


def feed_forward(mechanism: Mechanism, reference: Motion, *, until: float, body: str = "", samples: int = 2001) -> TableMotion:
    """The driving torque of the ideal mechanism along a course.

    Loose joints are taken as tight. As long as they stay in contact, the true torque differs from this one by terms of the
    order of clearance over length.

    Parameters
    ----------
    mechanism : Mechanism
        Its actuators and its forces that vary over time are left out: the first are to be replaced, the second are disturbances
        that nobody knows beforehand. Springs, motors and constant loads stay.
    reference : Motion
        The angle wanted [rad].
    until : float
        End of the table [s].
    body : str, optional
        Which body; the mechanism's input body if not given.
    samples : int
        Instants of the table; the spline's error falls with the sixth power of their distance.

    Returns
    -------
    TableMotion
        Torque [N m] over time [s].

    Raises
    ------
    InputError
        If the ideal mechanism cannot follow the reference.
    """
    kept = tuple(
        element
        for element in mechanism.elements
        if not isinstance(element, Actuator) and not (isinstance(element, Force) and element.course is not None)
    )
    ideal = dataclasses.replace(mechanism.tighten(), elements=kept, drives=()).driven(reference, body=body)
    run = pass_on(simulate(ideal, until=until, samples=samples))
    if run.attrs["status"] != "complete":
        raise InputError(f"the ideal mechanism cannot follow the reference: {run.attrs['cause']}", "another reference")
    return TableMotion(tuple(run["time"].values.tolist()), tuple(run["drive_torque"].values.tolist()))
