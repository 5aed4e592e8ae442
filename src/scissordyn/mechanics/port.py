"""Call the kernels of a port, chosen by its code; a new port is registered only here and in its own file.

A port is a way to attach a component to bodies, for example between two points (line) or to the angle of two bodies (hinge).
"""

from __future__ import annotations

from scissordyn.components.port import ACTUATOR, FRAME, HINGE, LINE, POINT, TRAVEL, frame, hinge, line, point, travel
from scissordyn.kernel import kernel


@kernel
def sense_port(port, maps, angle, q, v):
    """Write coordinates and rates of a port; `angle` is that of its body, including turns."""
    if port == LINE.code:
        line.sense(maps, angle, q, v)
    elif port == TRAVEL.code:
        travel.sense(maps, angle, q, v)
    elif port == POINT.code:
        point.sense(maps, angle, q, v)
    elif port == FRAME.code:
        frame.sense(maps, angle, q, v)
    else:
        hinge.sense(maps, angle, q, v)


@kernel
def port_forces(port, maps, q, out):
    """Return the forces on the six rows of the maps."""
    if port == LINE.code:
        return line.forces(maps, q, out)
    if port == TRAVEL.code:
        return travel.forces(maps, q, out)
    if port == POINT.code:
        return point.forces(maps, q, out)
    if port == FRAME.code:
        return frame.forces(maps, q, out)
    return hinge.forces(maps, q, out)


@kernel
def port_wrench(port, maps, along, out, fx, fy):
    """Return the force on the first body's point and the torques on both bodies, for a force (fx, fy) on the map u."""
    if port == LINE.code:
        return line.wrench(maps, along, out, fx, fy)
    if port == TRAVEL.code:
        return travel.wrench(maps, along, out, fx, fy)
    if port == POINT.code:
        return point.wrench(maps, along, out, fx, fy)
    if port == FRAME.code:
        return frame.wrench(maps, along, out, fx, fy)
    return hinge.wrench(maps, along, out, fx, fy)


@kernel
def write_port_gradients(port, maps, G, R):
    """Write the derivatives of a port's coordinates and of their rates by the maps."""
    G[:, :] = 0.0
    R[:, :] = 0.0
    if port == LINE.code:
        line.gradients(maps, G, R)
    elif port == TRAVEL.code:
        travel.gradients(maps, G, R)
    elif port == POINT.code:
        point.gradients(maps, G, R)
    elif port == FRAME.code:
        frame.gradients(maps, G, R)
    else:
        hinge.gradients(maps, G, R)


@kernel
def add_port_curvature(port, q, out, G, K):
    """Add the change of the maps' forces as the gradients rotate at constant forces of the port."""
    if port == LINE.code:
        line.curvature(q, out, G, K)
    elif port == FRAME.code:
        frame.curvature(q, out, G, K)
    elif port == HINGE.code or port == ACTUATOR.code:
        hinge.curvature(q, out, G, K)
