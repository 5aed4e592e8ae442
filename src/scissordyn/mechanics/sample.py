"""Tables of the samples of a run: the states, and the quantities that are evaluated from them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from scissordyn.kernel import F1, F2, F3, I2, ArrayType
from scissordyn.mechanics.system import CONTACT_RESULT

ContactRows = Annotated[np.ndarray, ArrayType(CONTACT_RESULT, 2)]


class Sampled(NamedTuple):
    """States at given instants, one row each; any object with these fields can be given to `record`."""

    time: F1  # [s]
    state: F2  # Free coordinates, their rates, internal states
    mode: I2  # 1 for each active guard
    memory: F2  # Rate of each guard at its last activation
    mass: F2  # Effective mass of each guard at its last activation
    reference: F2  # Angles at the end of the last step


class Record(NamedTuple):
    """Quantities at the samples."""

    X: F2  # (nt, n + nb) Columns [x; b] and their two derivatives
    V: F2  # (nt, n + nb)
    A: F2  # (nt, n + nb)
    position: F3  # (nt, bodies, 2) Mass centres [m]; velocity [m/s] and acceleration [m/s^2] follow
    velocity: F3  # (nt, bodies, 2)
    acceleration: F3  # (nt, bodies, 2)
    direction: F3  # (nt, bodies, 2) Cosine and sine of the angles
    angle: F2  # (nt, bodies) Angles including full turns [rad]; rates [rad/s] and accelerations [rad/s^2] follow
    angular_velocity: F2  # (nt, bodies)
    angular_acceleration: F2  # (nt, bodies)
    # (nt, bodies, 3) Forces of contacts, components, rods, latches and couplings on each body [N], and their moment about
    # its mass centre [N m]
    load: F3
    contact: ContactRows  # (nt, contacts) Fields of `system.CONTACT_RESULT`
    # (nt, acting + rods, 4) Force on the first point of each contact, component and rod [N], and torques on both bodies [N m]
    wrench: F3
    coordinate: F3  # (nt, components, 4) Coordinates of the ports
    result: F3  # (nt, components, COMPONENT_RESULTS_MAX) Results of the components' kernels
    observed: F3  # (nt, components, 2) Angle error [rad] and recorded signal of actuators
    torque: F2  # (nt, drives)
    multiplier: F2  # (nt, m)
    kinetic: F1  # (nt,) Kinetic energy [J]; then those of gravity, contacts and components
    potential: F1  # (nt,)
    elastic: F1  # (nt,)
    stored: F1  # (nt,)
    length_error: F1  # (1,) Largest relative error of a length
