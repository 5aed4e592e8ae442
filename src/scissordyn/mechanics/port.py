"""From the code of a port to its kernels: the one place beside its file that a new port is named in."""

from __future__ import annotations

from scissordyn.component.port import ACTUATOR, FRAME, HINGE, LINE, POINT, TRAVEL, frame, hinge, line, point, travel
from scissordyn.kernel import kernel

_LINE, _HINGE, _TRAVEL, _POINT, _FRAME, _ACTUATOR = (p.code for p in (LINE, HINGE, TRAVEL, POINT, FRAME, ACTUATOR))

_sense_line, _sense_hinge, _sense_travel = line.sense, hinge.sense, travel.sense
_sense_point, _sense_frame = point.sense, frame.sense
_line_forces, _hinge_forces, _travel_forces = line.forces, hinge.forces, travel.forces
_point_forces, _frame_forces = point.forces, frame.forces
_line_wrench, _hinge_wrench, _travel_wrench = line.wrench, hinge.wrench, travel.wrench
_point_wrench, _frame_wrench = point.wrench, frame.wrench
_line_gradients, _hinge_gradients, _travel_gradients = line.gradients, hinge.gradients, travel.gradients
_point_gradients, _frame_gradients = point.gradients, frame.gradients
_line_curvature, _hinge_curvature, _frame_curvature = line.curvature, hinge.curvature, frame.curvature


@kernel
def sense_port(port, maps, angle, q, v):
    """Write coordinates and rates of a port; `angle` is that of its body, with its turns."""
    if port == _LINE:
        _sense_line(maps, angle, q, v)
    elif port == _TRAVEL:
        _sense_travel(maps, angle, q, v)
    elif port == _POINT:
        _sense_point(maps, angle, q, v)
    elif port == _FRAME:
        _sense_frame(maps, angle, q, v)
    else:
        _sense_hinge(maps, angle, q, v)


@kernel
def port_forces(port, maps, q, out):
    """Forces on the six rows of the maps."""
    if port == _LINE:
        return _line_forces(maps, q, out)
    if port == _TRAVEL:
        return _travel_forces(maps, q, out)
    if port == _POINT:
        return _point_forces(maps, q, out)
    if port == _FRAME:
        return _frame_forces(maps, q, out)
    return _hinge_forces(maps, q, out)


@kernel
def port_wrench(port, maps, along, out, fx, fy):
    """Force on the first body's point, and torques on both bodies, where the force on the map u is (fx, fy)."""
    if port == _LINE:
        return _line_wrench(maps, along, out, fx, fy)
    if port == _TRAVEL:
        return _travel_wrench(maps, along, out, fx, fy)
    if port == _POINT:
        return _point_wrench(maps, along, out, fx, fy)
    if port == _FRAME:
        return _frame_wrench(maps, along, out, fx, fy)
    return _hinge_wrench(maps, along, out, fx, fy)


@kernel
def write_port_gradients(port, maps, G, R):
    """Gradients of the coordinates, and of their rates, by the maps."""
    G[:, :] = 0.0
    R[:, :] = 0.0
    if port == _LINE:
        _line_gradients(maps, G, R)
    elif port == _TRAVEL:
        _travel_gradients(maps, G, R)
    elif port == _POINT:
        _point_gradients(maps, G, R)
    elif port == _FRAME:
        _frame_gradients(maps, G, R)
    else:
        _hinge_gradients(maps, G, R)


@kernel
def add_port_curvature(port, q, out, G, K):
    """Add what the maps' forces change because the gradients turn, while the port's forces stay."""
    if port == _LINE:
        _line_curvature(q, out, G, K)
    elif port == _FRAME:
        _frame_curvature(q, out, G, K)
    elif port == _HINGE or port == _ACTUATOR:  # noqa: SIM109 -- a tuple costs a loop in a kernel
        _hinge_curvature(q, out, G, K)
