"""Components in the equations of motion: coordinates of their ports, forces on the bodies, and derivatives.

With q the coordinates of a port and f the forces on them, the forces on the maps m = (u, a, b) of a component are
sum f_i dq_i/dm. Their derivatives need those of the kernel, by central differences over its few arguments, and dq_i/dm,
d q_i'/dm and the second derivatives of q_i, which are written once for each port.
"""

from __future__ import annotations

from scissordyn.components.port import ACTUATOR, AXIS, RAIL
from scissordyn.kernel import call_at, kernel
from scissordyn.laws.evaluate import (
    elastic_energy,
    elastic_force,
    friction_force,
    friction_states,
    normal_force,
    reference_speed,
    settled_states,
)
from scissordyn.mechanics.actuator import actuator_torque, linearise_actuator
from scissordyn.mechanics.flexible_bar import add_flexible_bar
from scissordyn.mechanics.flexible_bar_slopes import linearise_flexible_bar
from scissordyn.mechanics.force_element import add_forces, map_values, write_wrench
from scissordyn.mechanics.port import add_port_curvature, port_forces, port_wrench, sense_port, write_port_gradients
from scissordyn.mechanics.rail import NX, NY, SCALARS, add_rail_force, linearise_rail, sense_rail
from scissordyn.mechanics.rotation import relative_angle
from scissordyn.mechanics.time_function import motion_at
from scissordyn.tolerance import DIFFERENCE_FRACTION

TIME, FACTOR, MODE, APPROACH_SPEED, FACTOR_RATE, DIFFERENCES, REACTION, EFFECTIVE_MASS, NORMAL, TANGENTIAL = range(10)
"""Indices of the values of `declaration.CONTEXT`."""

ARGUMENT_STEP = 1e-7
"""Step of the central differences of component forces, relative to the argument or to one unit of it.

Round-off is then 1e-9 of the force, and the step is short enough for a stiff stop.
"""


@kernel
def factor_of(t, i, S):
    """Return the value of component i's time function, and its rate."""
    first = S.model.function[i]
    if first < 0:
        return 1.0, 0.0
    motion_at(t, first, S)
    return S.work.function_value[0], S.work.function_value[1]


@kernel
def write_context(t, i, S):
    """Write what component kernels may read: time, time function, contact mode, approach speed, effective mass and reaction."""
    x, guard = S.work.context, S.model.component_guard[i]
    x[TIME] = t
    x[FACTOR], x[FACTOR_RATE] = factor_of(t, i, S)
    x[MODE] = float(S.state.mode[guard]) if guard >= 0 else 0.0
    x[APPROACH_SPEED] = S.state.memory[guard] if guard >= 0 else 0.0
    x[EFFECTIVE_MASS] = S.state.mass[guard] if guard >= 0 else 0.0
    x[DIFFERENCES] = 0.0
    which = S.friction.place[i]
    x[REACTION] = S.friction.size[which] if which >= 0 else 0.0


@kernel
def sense(i, S, maps):
    """Write coordinates and rates of the port of component i."""
    if S.model.component_port[i] == RAIL.code:
        sense_rail(i, S, maps)
        return
    _, _, ax, ay, bx, by, _, _, _, _, _, _ = maps
    angle = relative_angle(i, S, ax, ay, bx, by) if S.model.reference_of[i] >= 0 else 0.0
    sense_port(S.model.component_port[i], maps, angle, S.work.coordinates[i], S.work.coordinate_rates[i])


@kernel
def evaluate(i, S, z, address, result):
    """Call the kernel at `address` for component i; write what it returns to `result`.

    Its arguments are the coordinates, rates and context in Work, the states z and the parameters of the component.
    """
    W = S.work
    call_at(address, W.coordinates[i], W.coordinate_rates[i], z, W.context, S.parameters.component[i], result)


@kernel
def evaluate_forces(i, S, z, result):
    """Write forces and further results of component i at the current coordinates, rates and context."""
    M, x, k = S.model, S.work.context, S.model.component_law[i]
    if k < 0:
        evaluate(i, S, z, M.force_kernel[i], result)
        return
    P, forces, first = S.parameters, M.component_forces[i], M.first_rate[i]
    evaluate(i, S, z, M.gap_kernel[i], result)
    depth, rate, slip, law, rates = result[0], result[1], result[2], P.law[k], result[first : first + z.size]
    rates[:] = 0.0
    elastic = energy = 0.0
    x[NORMAL] = x[TANGENTIAL] = 0.0
    if x[MODE] == 1.0:
        if depth > 0.0:
            elastic = elastic_force(law.stiffness, depth, P.elastic[k])
            reference, pressed = reference_speed(elastic, depth, rate, x[APPROACH_SPEED], x[EFFECTIVE_MASS]), law.bristles
            x[NORMAL] = normal_force(
                law.damping, elastic, depth, rate, reference, z[pressed : z.size], rates[pressed : z.size], P.damping[k]
            )
            if x[DIFFERENCES] == 0.0:
                energy = elastic_energy(law.energy, law.stiffness, depth, P.elastic[k])
        x[TANGENTIAL] = friction_force(law.friction, slip, x[NORMAL], z, rates, P.friction[k])
    evaluate(i, S, z, M.force_kernel[i], result)
    result[forces], result[forces + 1] = energy, (x[NORMAL] - elastic) * rate + x[TANGENTIAL] * slip
    result[forces + 2], result[forces + 3], result[forces + 4] = x[NORMAL], x[TANGENTIAL], max(depth, 0.0) * x[MODE]


@kernel
def begin_laws(i, z, S, resting):
    """Set the internal states of the laws of component i at the onset of contact; call `component_gap` first."""
    k = S.model.component_law[i]
    if k < 0:
        return
    P, law, depth, slip = S.parameters, S.parameters.law[k], S.work.answer[0], S.work.answer[2]
    pressed = z[law.bristles : z.size]
    friction_states(law.start, slip, z[: law.bristles], P.friction[k])
    pressed[:] = 0.0
    if resting and law.settled != 0 and depth > 0.0:
        settled_states(law.settled, elastic_force(law.stiffness, depth, P.elastic[k]), depth, pressed, P.damping[k])


@kernel
def component_gap(t, i, z, S):
    """Return value and rate of the guard of component i."""
    sense(i, S, map_values(S.parameters.contact.size + i, S))
    write_context(t, i, S)
    evaluate(i, S, z, S.model.gap_kernel[i], S.work.answer)
    return S.work.answer[0], S.work.answer[1]


@kernel
def switch_loss(t, i, z, S):
    """Return the energy [J] that component i loses when the mode of its guard changes."""
    if S.model.switch_kernel[i] == 0:
        return 0.0
    sense(i, S, map_values(S.parameters.contact.size + i, S))
    write_context(t, i, S)
    evaluate(i, S, z, S.model.switch_kernel[i], S.work.answer)
    return S.work.answer[0]


@kernel
def add_component(t, i, S, z, dz):
    """Add the forces of component i to Work.force; write its results, powers and the rates of its states."""
    M, W = S.model, S.work
    element, port, out = S.parameters.contact.size + i, M.component_port[i], W.result[i]
    if port == AXIS.code:
        add_flexible_bar(t, i, S)
        return
    maps = map_values(element, S)
    sense(i, S, maps)
    if port == ACTUATOR.code:
        out[0] = actuator_torque(t, i, S, maps, z, dz)
    else:
        if M.force_kernel[i] == 0:
            return
        write_context(t, i, S)
        evaluate_forces(i, S, z, out)
        for s in range(z.size):
            dz[s] = out[M.first_rate[i] + s]
    forces, power = M.component_forces[i], 0.0
    for k in range(forces):
        power += out[k] * W.coordinate_rates[i, k]
    power *= M.component_sense[i]
    if port == RAIL.code:
        scalars = W.rail[SCALARS]
        write_wrench(element, S, out[0] * scalars[NX], out[0] * scalars[NY], 0.0, 0.0)
        add_rail_force(element, i, S, out[0])
        write_powers(i, S, out, forces, power)
        return
    fx, fy, gx, gy, hx, hy = port_forces(port, maps, W.coordinates[i], out)
    force_x, force_y, torque_a, torque_b = port_wrench(port, maps, M.travel_direction[i], out, fx, fy)
    write_wrench(element, S, force_x, force_y, torque_a, torque_b)
    add_forces(element, S, fx, fy, gx, gy, hx, hy, W.force, 0, W.force.size)
    write_powers(i, S, out, forces, power)


@kernel
def write_powers(i, S, out, forces, power):
    """Write stored energy and powers of component i, which follow the forces in the kernel's result."""
    M, W = S.model, S.work
    if M.component_passive[i] == 1:
        W.stored_energy[i], W.dissipation[i] = out[forces], out[forces + 1]
        W.power_in[i] = out[forces + 2] if M.component_supplied[i] == 1 else 0.0
    else:
        W.stored_energy[i], W.dissipation[i], W.power_in[i] = 0.0, 0.0, power


@kernel
def port_slopes(t, i, S, z):
    """Write the derivatives of a component's forces and state rates by coordinates, rates, states and time."""
    M, W = S.model, S.work
    forces, first = M.component_forces[i], M.first_rate[i]
    coordinates, up, down = M.component_coordinates[i], W.answer, W.other_answer
    W.context[DIFFERENCES] = 1.0
    for k in range(2 * coordinates + z.size + 1):
        h = ARGUMENT_STEP * (1.0 + abs(t))
        apart = 2.0 * h
        if k == 2 * coordinates + z.size:
            if M.component_timed[i] == 0:
                W.slope[: forces + z.size, k] = 0.0
                continue
            write_context(t + h, i, S)
            evaluate_forces(i, S, z, up)
            write_context(t - h, i, S)
            evaluate_forces(i, S, z, down)
            write_context(t, i, S)
        else:
            argument, place, least = z, k - 2 * coordinates, 0.0
            if k < coordinates:
                argument, place, least = W.coordinates[i], k, 1e-2 * ARGUMENT_STEP
            elif k < 2 * coordinates:
                argument, place, least = W.coordinate_rates[i], k - coordinates, 1e-2 * ARGUMENT_STEP
            else:
                least = DIFFERENCE_FRACTION * S.parameters.state_scale[M.state_start[S.parameters.contact.size + i] + place]
            here = argument[place]
            h = max(ARGUMENT_STEP * abs(here), least)
            # a state acts by its small difference to a coordinate, so the round-off of here + h must not enter
            apart = (here + h) - (here - h) if z.size > 0 else 2.0 * h
            argument[place] = here + h
            evaluate_forces(i, S, z, up)
            argument[place] = here - h
            evaluate_forces(i, S, z, down)
            argument[place] = here
        for f in range(forces):
            W.slope[f, k] = (up[f] - down[f]) / apart
        for s in range(z.size):
            W.slope[forces + s, k] = (up[first + s] - down[first + s]) / apart
    W.context[DIFFERENCES] = 0.0


@kernel
def linearise_component(t, i, S, z, dt, first_state):
    """Write the derivatives of component i's generalised forces into Work.block_x and Work.block_v, and those of its states.

    Partial derivatives by time are added to dt[n:], and to dt[first_state:] for the rates of the states z.
    """
    M, W = S.model, S.work
    element, port = S.parameters.contact.size + i, M.component_port[i]
    if port == AXIS.code:
        linearise_flexible_bar(t, i, S, dt)
        return
    maps = map_values(element, S)
    K, D, G, R = W.by_map, W.by_map_rate, W.gradient_q, W.gradient_v
    K[:, :] = 0.0
    D[:, :] = 0.0
    if port == ACTUATOR.code:
        W.result[i, 0] = linearise_actuator(t, i, S, z, dt, first_state)
        add_port_curvature(port, W.coordinates[i], W.result[i], G, K)
    elif M.force_kernel[i] != 0:
        sense(i, S, maps)
        write_context(t, i, S)
        evaluate_forces(i, S, z, W.result[i])
        port_slopes(t, i, S, z)
        if port == RAIL.code:
            linearise_rail(element, i, S, W.result[i, 0], W.slope[0, 0], W.slope[0, 1])
            return
        write_port_gradients(port, maps, G, R)
        forces, coordinates = M.component_forces[i], M.component_coordinates[i]
        last = 2 * coordinates + z.size
        if M.component_sense[i] < 0.0:  # tension pulls against the length
            for k in range(last + 1):
                W.slope[0, k] = -W.slope[0, k]
        for f in range(forces):
            for c in range(6):
                by_x = by_v = 0.0
                for k in range(coordinates):
                    by_x += W.slope[f, k] * G[k, c] + W.slope[f, coordinates + k] * R[k, c]
                    by_v += W.slope[f, coordinates + k] * G[k, c]
                for r in range(6):
                    K[r, c] += G[f, r] * by_x
                    D[r, c] += G[f, r] * by_v
            by_time = W.slope[f, last]
            if by_time != 0.0:
                row = G[f]
                add_forces(
                    element,
                    S,
                    row[0] * by_time,
                    row[1] * by_time,
                    row[2] * by_time,
                    row[3] * by_time,
                    row[4] * by_time,
                    row[5] * by_time,
                    dt,
                    M.n,
                    M.n,
                )
        add_port_curvature(port, W.coordinates[i], W.result[i], G, K)
        linearise_states(element, forces, coordinates, S, z, dt, first_state)
    spread_blocks(element, S)


@kernel
def linearise_states(element, forces, coordinates, S, z, dt, first_state):
    """Write the derivatives of a component's forces by its internal states, and those of the states' rates."""
    M, W = S.model, S.work
    row, G, R = M.element_row, W.gradient_q, W.gradient_v
    start, states = M.element_start[element], z.size
    for s in range(states):
        slope = W.slope[forces + s]
        dt[first_state + s] += slope[2 * coordinates + states]
        for k in range(states):
            W.rate_by_state[M.state_state_start[element] + s * states + k] = slope[2 * coordinates + k]
        for b in range(M.element_start[element + 1] - start):
            x = v = pull = 0.0
            for c in range(6):
                by_x = by_v = by_state = 0.0
                for k in range(coordinates):
                    by_x += slope[k] * G[k, c] + slope[coordinates + k] * R[k, c]
                    by_v += slope[coordinates + k] * G[k, c]
                for f in range(forces):
                    by_state += W.slope[f, 2 * coordinates + s] * G[f, c]
                x += by_x * row[c, start + b]
                v += by_v * row[c, start + b]
                pull += by_state * row[c, start + b]
            at = M.force_state_start[element] + b * states + s
            W.rate_by_x[at], W.rate_by_v[at], W.force_by_state[at] = x, v, pull


@kernel
def spread_blocks(element, S):
    """Convert the derivatives of a force element by its maps to derivatives by its columns."""
    M, W = S.model, S.work
    row, start = M.element_row, M.element_start[element]
    count, block = M.element_start[element + 1] - start, M.block_start[element]
    for a in range(count):
        for b in range(count):
            x = v = 0.0
            for r in range(6):
                weight = row[r, start + a]
                if weight != 0.0:
                    for c in range(6):
                        x += weight * row[c, start + b] * W.by_map[r, c]
                        v += weight * row[c, start + b] * W.by_map_rate[r, c]
            W.block_x[block + a * count + b] = x
            W.block_v[block + a * count + b] = v
