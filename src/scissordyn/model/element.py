"""What pulls, pushes and turns: springs, dampers, loads, motors, actuators and end stops."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from scissordyn.control.controller import Controller
from scissordyn.errors import InputError
from scissordyn.laws.damping.factors import Flores
from scissordyn.model.body import GROUND, Point
from scissordyn.model.drive import Motion
from scissordyn.model.joint import BodyPoint
from scissordyn.units import Quantity, check_quantities

__all__ = [
    "Actuator",
    "AngleStop",
    "Element",
    "Force",
    "Motor",
    "Spring",
    "Torque",
    "TorsionSpring",
    "TravelStop",
    "stop_damping",
]


def _two_bodies(name: str, one: str, other: str) -> None:
    if one == other:
        raise InputError(f"'{name}' acts between body '{one}' and itself", "two different bodies")


@dataclass(frozen=True)
class Spring:
    """A spring and damper between two points: force k (l - l_0) + d l' along the line between them.

    Parameters
    ----------
    name : str
    start, end : (str, str)
        Body and point; the body may be "ground".
    stiffness : float
        k [N/m].
    free_length : float
        l_0 [m].
    damping : float
        d [N s/m].
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    stiffness: Annotated[float, Quantity("N/m", minimum=0.0, help="stiffness")] = 0.0
    free_length: Annotated[float, Quantity("m", minimum=0.0, help="length without force")] = 0.0
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, help="damping")] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self, f"spring '{self.name}'")
        _two_bodies(self.name, self.start[0], self.end[0])


@dataclass(frozen=True)
class TorsionSpring:
    """A hinge spring and damper between two bodies: torque -k (phi - phi_0) - d phi' on the first.

    phi is the angle of the body against its base, counted from the start without jumps as long as it stays within half a
    turn of its value there.

    Parameters
    ----------
    name : str
    body, base : str
        The base may be "ground".
    stiffness : float
        k [N m/rad].
    free_angle : float
        phi_0 [rad].
    damping : float
        d [N m s/rad].
    """

    name: str
    body: str
    base: str = GROUND
    stiffness: Annotated[float, Quantity("N m/rad", minimum=0.0, help="stiffness")] = 0.0
    free_angle: Annotated[float, Quantity("rad", help="angle without torque")] = 0.0
    damping: Annotated[float, Quantity("N m s/rad", minimum=0.0, help="damping")] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self, f"torsion spring '{self.name}'")
        _two_bodies(self.name, self.body, self.base)


@dataclass(frozen=True)
class Force:
    """A force on a point, fixed in direction or following the body, constant or a function of time.

    Parameters
    ----------
    name : str
    point : (str, str)
        Body and point.
    force : (float, float)
        Components [N]; along the body's axes if the force follows it.
    follows : bool
        Whether it turns with the body.
    course : Motion, optional
        A factor over time; 1 if not given.
    """

    name: str
    point: BodyPoint
    force: Point
    follows: bool = False
    course: Motion | None = None

    def __post_init__(self) -> None:
        if len(self.force) != 2 or not all(math.isfinite(part) for part in self.force):
            raise InputError(f"force '{self.name}': force = {self.force!r}", "two finite numbers [N]")
        if self.point[0] == GROUND:
            raise InputError(f"force '{self.name}' on the ground", "a point of a body")


@dataclass(frozen=True)
class Torque:
    """A torque on a body against its base, constant or a function of time.

    Parameters
    ----------
    name : str
    body, base : str
        The base may be "ground".
    torque : float
        [N m]
    course : Motion, optional
        A factor over time; 1 if not given.
    """

    name: str
    body: str
    torque: Annotated[float, Quantity("N m", help="torque")]
    base: str = GROUND
    course: Motion | None = None

    def __post_init__(self) -> None:
        check_quantities(self, f"torque '{self.name}'")
        _two_bodies(self.name, self.body, self.base)


@dataclass(frozen=True)
class Motor:
    """A motor whose torque falls with its speed: T = T_0 (1 - w/w_0), never beyond its limit either way.

    Parameters
    ----------
    name : str
    body, base : str
        Rotor side and stator side; the base may be "ground".
    stall_torque : float
        T_0 [N m]; its sign is the sense in which the motor turns.
    no_load_speed : float
        w_0 [rad/s], at which the torque is gone; beyond it the motor brakes.
    limit : float, optional
        Largest torque in either sense [N m].
    inertia : float
        Of the rotor, turning with the body [kg m^2].
    """

    name: str
    body: str
    stall_torque: Annotated[float, Quantity("N m", help="torque at rest")]
    no_load_speed: Annotated[float, Quantity("rad/s", above=0.0, help="speed at which the torque vanishes")]
    base: str = GROUND
    limit: Annotated[float | None, Quantity("N m", above=0.0, help="largest torque")] = None
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, help="moment of inertia of the rotor")] = 0.0

    def __post_init__(self) -> None:
        check_quantities(self, f"motor '{self.name}'")
        _two_bodies(self.name, self.body, self.base)


@dataclass(frozen=True)
class Actuator:
    """A torque on a body against its base that a controller chooses from what it senses.

    The controller is told the reference course, the angle and speed of the body against its base, and, if there is a sensor,
    the vector to it from its origin.

    Parameters
    ----------
    name : str
    body, base : str
        The base may be "ground".
    controller : Controller
    reference : Motion, optional
        The angle wanted over time [rad]; the one at the start if not given.
    feed_forward : Motion, optional
        A torque over time that the controller may add [N m].
    sensor : (str, str), optional
        Body and point whose place is sensed.
    sensor_origin : (str, str), optional
        Body and point that it is sensed from; the origin of the fixed frame if not given.
    inertia : float
        Of the rotor, turning with the body [kg m^2].
    on_course : bool
        Whether the body starts at the angle and speed of the reference rather than as it was placed.

    Raises
    ------
    InputError
        If the controller needs a feed-forward torque or a sensor that is not there, or has no use for one that is.
    """

    name: str
    body: str
    controller: Controller
    base: str = GROUND
    reference: Motion | None = None
    feed_forward: Motion | None = None
    sensor: BodyPoint | None = None
    sensor_origin: BodyPoint | None = None
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, help="moment of inertia of the rotor")] = 0.0
    on_course: bool = False

    def __post_init__(self) -> None:
        check_quantities(self)
        _two_bodies(self.name, self.body, self.base)
        if not isinstance(self.controller, Controller):
            raise InputError(f"actuator '{self.name}': controller = {self.controller!r}", "a controller", "PID(100.0)")
        what = f"actuator '{self.name}' with the controller '{self.controller.name}'"
        if self.feed_forward is not None and not self.controller.feeds:
            raise InputError(f"{what}, which makes no use of a feed-forward torque", "the controller 'feed-forward'")
        if self.sensor is None and (self.controller.senses or self.sensor_origin is not None):
            raise InputError(f"{what} without a sensor", "sensor=(BODY, POINT)")
        if self.on_course and (self.base != GROUND or self.reference is None):
            raise InputError(f"actuator '{self.name}' starts on course", "a reference, and the ground as the base")


@dataclass(frozen=True)
class AngleStop:
    r"""An end stop of a rotation: beyond its angle a torque pushes the body back.

    .. math:: T = K\delta^n\left(1 + \xi\,\dot\delta/\dot\delta^{(-)}\right)

    with delta the angle beyond the stop, its rate at the touch in the denominator, and the damping factor of Flores et al.
    2011 for the restitution coefficient. The side from which the stop is reached is the one the bodies start on; angles are
    counted within half a turn of the start.

    Parameters
    ----------
    name : str
    body, base : str
        The base may be "ground".
    angle : float
        Of the body against its base at the touch [rad].
    stiffness : float
        K [N m/rad^n].
    exponent : float
        n.
    restitution : float
        Restitution coefficient.
    """

    name: str
    body: str
    angle: Annotated[float, Quantity("rad", help="angle of the body against its base at the touch")]
    base: str = GROUND
    stiffness: Annotated[float, Quantity("1", above=0.0, help="K, in N m/rad^n with the n given here")] = 1e6
    exponent: Annotated[float, Quantity("1", minimum=1.0, maximum=5.0, help="n")] = 1.5
    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient")] = 0.5

    def __post_init__(self) -> None:
        check_quantities(self, f"end stop '{self.name}'")
        _two_bodies(self.name, self.body, self.base)


@dataclass(frozen=True)
class TravelStop:
    r"""An end stop of a point that travels: beyond a line across its direction a force pushes it back.

    .. math:: F = K\delta^n\left(1 + \xi\,\dot\delta/\dot\delta^{(-)}\right)

    Parameters
    ----------
    name : str
    point : (str, str)
        Body and point.
    direction : float
        Direction of travel towards the stop, in the ground's frame [rad].
    limit : float
        How far the point may go: its coordinate along the direction at the touch [m].
    stiffness : float
        K [N/m^n].
    exponent : float
        n.
    restitution : float
        Restitution coefficient.
    """

    name: str
    point: BodyPoint
    direction: Annotated[float, Quantity("rad", help="direction of travel towards the stop")]
    limit: Annotated[float, Quantity("m", help="coordinate along the direction at the touch")]
    stiffness: Annotated[float, Quantity("1", above=0.0, help="K, in N/m^n with the n given here")] = 1e8
    exponent: Annotated[float, Quantity("1", minimum=1.0, maximum=5.0, help="n")] = 1.5
    restitution: Annotated[float, Quantity("1", above=0.0, maximum=1.0, help="restitution coefficient")] = 0.5

    def __post_init__(self) -> None:
        check_quantities(self, f"end stop '{self.name}'")
        if self.point[0] == GROUND:
            raise InputError(f"end stop '{self.name}' for a point of the ground", "a point of a body")


def stop_damping(stop: AngleStop | TravelStop) -> float:
    """Damping factor xi of an end stop [1] (Flores et al. 2011, doi:10.1007/s11044-010-9237-4)."""
    return Flores(restitution=stop.restitution).factor


Element = Spring | TorsionSpring | Force | Torque | Motor | Actuator | AngleStop | TravelStop
