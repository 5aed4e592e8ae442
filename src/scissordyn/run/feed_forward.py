"""Feed-forward torque of a reference motion, by inverse dynamics of the ideal mechanism."""

from __future__ import annotations

import dataclasses

from scissordyn.component.actuator import Actuator
from scissordyn.component.force import Force
from scissordyn.component.time_function import Tabulated, TimeFunction
from scissordyn.errors import InputError
from scissordyn.model.commanded import rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.advance.interrupt import pass_on
from scissordyn.run.simulate import simulate
from scissordyn.units import checked


@checked
def feed_forward(
    mechanism: Mechanism, reference: TimeFunction, *, until: float, body: str = "", samples: int = 2001
) -> Tabulated:
    """The driving torque of the ideal mechanism on a reference motion.

    Clearance joints are taken as ideal, bars that bend as rigid. As long as joints stay in contact, the true torque of rigid
    bars differs from this one by terms of the order of clearance over length.

    Parameters
    ----------
    mechanism : Mechanism
        Its actuators, latches and forces that vary over time are left out: the first are to be replaced, the second hold it
        where the reference would go on, the third are disturbances that nobody knows beforehand. Springs, motors and constant
        loads stay.
    reference : TimeFunction
        The reference angle [rad].
    until : float
        End of the table [s].
    body : str, optional
        The driven body; the mechanism's input body if not given.
    samples : int
        Number of instants of the table; the error of the spline is of sixth order in their distance.

    Returns
    -------
    Tabulated
        Torque [N m] over time [s].

    Raises
    ------
    InputError
        If the ideal mechanism cannot follow the reference.
    """
    stiff = rigid(mechanism.ideal())
    kept = tuple(
        element
        for element in stiff.components
        if not isinstance(element, Actuator) and not (isinstance(element, Force) and element.time_function is not None)
    )
    ideal = dataclasses.replace(stiff, components=kept, latches=(), drives=()).driven(reference, body=body)
    run = pass_on(simulate(ideal, until=until, samples=samples))
    if run.attrs["status"] != "complete":
        raise InputError(f"the ideal mechanism cannot follow the reference: {run.attrs['cause']}", "another reference")
    return Tabulated(tuple(run["time"].values.tolist()), tuple(run["drive_torque"].values.tolist()))
