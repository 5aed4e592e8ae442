"""Data of the kernels in four parts: model, parameters, state and workspace.

The model contains everything that follows from the topology and the lengths of a mechanism. It is never written, and threads
can share it. The parameters are the other values of a case. The state, with coordinates and rates, determines the further
motion. The workspace is scratch.

Columns 0 .. n-1 are the free coordinates, n .. n+nb-1 the entries of b(t). Maps are sparse rows: the entries of row k are
start[k] .. start[k+1]-1. Force elements are the contacts, then the components.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from scissordyn.kernel import F1, F2, F3, I1, I2, ArrayType, opener
from scissordyn.laws.evaluate import APPROACH_FLOOR as APPROACH_FLOOR
from scissordyn.mechanics.balance import Balance
from scissordyn.mechanics.bending_loads import BendingLoads
from scissordyn.mechanics.body_maps import BodyMaps

CONTACT = np.dtype(
    [
        ("clearance", "f8"),  # c of a journal, or of a block in its guide [m]
        ("radius", "f8"),  # radius of the journal or corner [m]
        ("normal_x", "f8"),  # normal n of a guide surface in the frame of its body
        ("normal_y", "f8"),
        ("level", "f8"),  # u.n at which a corner touches its surface [m]
        ("area", "f8"),  # projected area of the bearing [m^2]
        ("plane", "i8"),  # 1 for a corner at a guide surface, 0 for a journal in a bearing
        ("spinless", "i8"),  # 1 if the slip speed is that of the contact points R n, which do not turn with the bodies
        ("cells", "i8"),  # number of angles of a worn contour, 0 for a round bearing
        ("cell_area", "f8"),  # area of the bearing between two angles [m^2]
        ("journal", "i8"),  # 1 if the journal has a worn contour
        ("loads", "i8"),  # number of loads that wear it in each direction: 2, or 8 if its journal wears too; 0 without wear
    ]
)
LAW_KERNELS = ("stiffness", "energy", "damping", "settled", "friction", "start", "limit")
"""Kernels of a contact's laws: elastic force, its energy, normal force, settled states, friction, initial states, friction
limit.
"""

LAW = np.dtype([(name, "i8") for name in (*LAW_KERNELS, "bristles", "loaded")])
"""Fields: the address of each kernel of `LAW_KERNELS`, 0 without one; `bristles`, the number of friction states, which are
stored before the states of the normal force; `loaded`, 1 if damping uses `laws.evaluate.reference_speed`, else 0.
"""

_RESULTS = "depth rate slip elastic normal tangential nx ny distance aside lever twist bend"

CONTACT_RESULT = np.dtype([(name, "f8") for name in _RESULTS.split()])
"""Fields: delta [m], delta' [m/s], slip speed [m/s], elastic, normal and tangential force [N], n, e . n or the distance
towards the surface from the middle [m], e . t on a worn contour [m], the lever of the normal force about a worn journal [m],
and for a hard contact on a worn contour the lever's derivative by angle and the radius of curvature of the path of the
journal's centre [m].
"""

(ARM_N, ARM_T, N_BY_X, N_BY_V, SLIP_BY_X, SLIP_BY_V, DEPTH_BY_X, RATE_BY_X, OWN, OTHER, TURN_OWN, PSI_BY_X, LEVER_BY_X) = range(
    13
)
"""Rows of `Workspace.local`: arms of F_n and F_t, derivatives of F_n, slip speed, delta and delta'; others for each kind of
contact.
"""

COMPONENT_RESULTS_MAX = 24  # Largest number of values that a component's kernel returns


ContactArray = Annotated[np.ndarray, ArrayType(CONTACT, 1)]
LawArray = Annotated[np.ndarray, ArrayType(LAW, 1)]
ResultArray = Annotated[np.ndarray, ArrayType(CONTACT_RESULT, 1)]


class Model(NamedTuple):
    """Arrays that follow from topology and lengths."""

    n: int
    nb: int
    inertia: F2  # (n, nb) coupling of x'' and b''
    inertia_b: F2  # (nb, nb)
    coupled: I1  # free coordinates accelerated by b''
    part_start: I1  # (parts+1,) maps of the quadratic constraints
    part_constraint: I1  # (parts,)
    part_full: F1  # (parts,) weights of active constraints
    part_reference: I1  # (parts,) kind of the part (`constraint_part`)
    timed: I1  # constraints whose value follows a time function
    timed_function: I1  # index of that time function
    timed_unit: F1  # one over the length that the constraint's maps are divided by [1/m], or over the scale of a coupling
    timed_linear: I1  # 1 if the value is the time function itself, not half its square
    latch: I2  # (latches, 3) constraint, first part, component
    constraint_start: I1  # (m+1,) entries of all parts of each constraint
    constraint_column: I1
    constraint_row: F2  # (2, entries)
    overlap: I2  # (pairs, 2): constraints k >= l that share columns, in the order of k
    element_start: I1  # (force elements + 1,)
    element_column: I1
    element_row: F2  # (6, entries): u, direction of the first body, of the second
    rotation_start: I1  # (rotations+1,) directions of the families of parallel bodies
    rotation_column: I1
    rotation_row: F2  # (2, entries)
    state_start: I1  # (force elements + 1,) internal states
    elastic_state: I1  # (contacts,) index of a hard contact's elastic energy in y, or -1
    component_port: I1  # (components,) codes of `component.port`
    component_sense: F1  # -1 for a tension, which pulls against its coordinate
    component_coordinates: I1
    component_forces: I1
    component_passive: I1  # whether it stores and dissipates energy
    component_supplied: I1  # whether its time function gives it power
    component_motor: I1  # whether its power counts as a motor's, not a load's
    component_timed: I1  # whether it depends on time
    component_guard: I1  # guard of the component, or -1
    component_law: I1  # row of its laws in `Parameters.law`, after those of the contacts, or -1
    travel_direction: F2  # (components, 2) unit vector of a port "travel"
    first_rate: I1  # index of the first state rate among its results
    force_kernel: I1  # addresses, or 0
    gap_kernel: I1
    switch_kernel: I1
    reference_of: I1  # (components,) entry of State.reference, or -1
    function: I1  # (components,) time function, or -1
    feed_forward: I1  # (components,) time function of feed-forward torques, or -1
    recorder: I1  # (components,) index of the recorded signal, or -1
    monitor: I2  # (monitors, 2) kind and index of monitored quantities
    track_start: I1  # (tracks+1,) maps of the tracked points
    track_column: I1
    track_row: F2  # (2, entries)
    guard_component: I1  # (guards,) component of a guard, or -1 for a contact
    block_start: I1  # (force elements + 1,) start of an element's k x k blocks
    force_state_start: I1
    state_state_start: I1
    permutation: I1  # (n+m+nz,) row of the step matrix for each unknown, -1 if it is eliminated
    band_limits: I1  # (4,) lower, upper of the step matrix and of the Gram matrix
    bar_of: I1  # (components,) flexible bar, or -1
    # (flexible bars, 9): first vector, vectors, points, start of tables, static shapes, first mode column; then `held_table`
    bar: I2
    bar_scale: F1  # (flexible bars,) vector of a mode over its columns
    bar_column: I1  # columns that static shapes depend on
    bar_table: F1  # weights; slopes at points and ends by shapes; stretching; bending, slopes, second derivatives by points
    shape_start: I1  # (vectors + 1,) maps of the vectors of shapes
    shape_column: I1
    shape_row: F2  # (2, entries)
    shape_place: I1  # index of a column among those of its element
    rail: I2  # (components, 4) for components on a rail: start of the table, spans, polynomials, start of the places
    rail_table: F1  # places of the cross-sections; Legendre coefficients of the shapes, by spans
    rail_place: I1  # index of a column of the bar's shapes among those of the element
    pair: I2  # (pairs, 3) part of a constraint whose multiplier is eliminated, and its two coordinates
    pair_of: I1  # (m,) row of `pair` for each constraint, or -1


class Parameters(NamedTuple):
    """Parameters of one case."""

    weight: F1  # (n+nb,) generalised force of gravity
    motion: F2  # (pieces, COLUMNS) pieces of the drives, then of the other time functions
    motion_start: I1  # (functions+1,)
    breaks: F1  # instants at which a time function has a jump in a low derivative
    value: F1  # (m,) values of the constraints at t = 0
    contact: ContactArray  # (contacts,)
    whole_mass: F1  # (contacts+components,) reduced mass of both bodies [kg] if a body is part of a bar that bends, else 0
    law: LawArray  # (laws,) of the contacts, then of the components with laws
    contour: F3  # (contacts, angles, 3) depth of a worn bearing [m], cosine and sine of the angle in the frame of its body
    journal: F2  # (contacts, angles) depth of a worn journal [m] in the frame of its body; no angles if all journals are round
    foundation: F3  # (contacts, pieces, 6) pressure by indentation, see `laws.foundation`
    elastic: F2  # (laws, PARAMETERS)
    damping: F2
    friction: F2
    component: F2  # (components, PARAMETERS)
    state_scale: F1  # (internal states,) scales of the states for error control; 0 if the friction law determines it
    controller: I1  # (components,) address of the torque of an actuator's controller, or 0
    control: F2  # (components, PARAMETERS)
    actuator: F2  # (components, 3): delay, index of the recorded signal, recursion gain
    ideal: F2  # (nodes, 6 tracks) the tracked points of the ideal mechanism: position, velocity, acceleration of each
    ideal_step: F1  # (1,) time between two nodes [s]


class MechanismState(NamedTuple):
    """State in addition to coordinates and rates; a guard is a contact or belongs to a component."""

    mode: I1  # (guards,) 0 open, 1 in contact, locked or taut
    memory: F1  # (guards,) rate of its value when its mode became 1 (`rate_in_range`); NaN: a latch that could not lock
    mass: F1  # (guards,) effective mass along its gap then, see `contact_mass`; 0: damping refers to the rate above alone
    reference: F1  # angles of rotations, then of components and in constraints, at the end of the last step
    history: F2  # (steps, 2 + signals * coefficients) completed steps: start, size, each signal's polynomial in -1 .. 1
    history_length: I1  # (1,)
    initial_history: F1  # (signals,) values before the start


class Workspace(NamedTuple):
    """Scratch arrays of a thread."""

    part_weight: F1  # (parts,) zero while a latch is open
    inactive: F1  # (m,) 1 for an open latch
    value: F2  # (4, m) values of the constraints with three time derivatives
    basis: F2  # (4, nb)
    instant: F1  # (1,) time of `basis` and of timed constraints' values [s]; NaN if they are out of date
    function_value: F1  # (4,)
    X: F1  # (n+nb,) positions; V and A are their rates and accelerations
    V: F1
    A: F1
    force: F1  # (n+nb,)
    direction: F2  # (parts, 2) the maps d, then their derivatives
    direction_rate: F2
    direction_acceleration: F2
    gradient: F1  # (constraint entries,)
    multiplier: F1  # (m,)
    frozen_direction: F2  # directions at the linearisation of the step matrix; rates, gradients and multipliers follow
    frozen_rate: F2
    frozen_gradient: F1
    frozen_multiplier: F1
    band: F2  # step matrix
    aside: F2  # entries of the step matrix for the prescribed changes of pairs
    pivots: I1
    row_factor: F1  # (n,) factors of coordinates in the rows of the step matrix
    unknown_factor: F1  # (n,) factors in its columns; both are 1 except for pairs
    prescribed_factor: F1  # (n,) contribution of a pair's prescribed change; 0 except for pairs
    prescribed: F1  # (n,) prescribed change of a pair
    pair_size: F1  # (pairs,) length of the constraint's row
    load: F1  # (n,) right-hand side by coordinate
    state_inverse: F1  # (nz,) inverse pivot of an eliminated state
    gram: F2  # (m, band)
    gram_pivots: I1
    near: F1  # (4,) data near singular positions (`singular_ahead`), the last instant, and the start of the search [s]
    segment: F1  # (2,) last break of a time function, and the next one [s]
    gram_row: F1  # (n,) zeros, except while the gradient of one constraint is multiplied
    gamma: F1  # (1,) step size times the method's gamma
    contact: ResultArray  # (contacts,) results of the contact kernel
    wrench: (
        F2  # (force elements, 4) force on the first body's point, torques on both bodies; the second gets the opposite force
    )
    block_x: F1  # d force / d X of each force element
    block_v: F1  # d force / d V
    force_by_state: F1  # (entries * states)
    rate_by_x: F1  # (states * entries)
    rate_by_v: F1
    rate_by_state: F1  # states x states of each force element
    local: F2  # (13, widest element)
    surface: F3  # (contacts, angles, 3) sum of both worn contours, as `Parameters.contour`; no angles if all journals are round
    slopes: F2  # (contacts, angles) its derivative by the angle of the journal [m/rad]
    shares: F1  # (angles,) pressure force by angle [N]
    state_work: F2  # (2, most states)
    state_jacobian: F2  # (most states + 7, most states)
    coordinates: F2  # (components, 4) coordinates of the ports
    coordinate_rates: F2
    context: F1  # (5,)
    answer: F1  # (COMPONENT_RESULTS_MAX,)
    other_answer: F1
    result: F2  # (components, COMPONENT_RESULTS_MAX)
    stored_energy: F1  # (components,) [J]
    with_energy: I1  # (1,) 1 while flexible bars write their stored energy, which steps do not need
    dissipation: F1  # (components,) [W]
    power_in: F1  # (components,) power given to the mechanism [W]
    slope: F2  # derivatives of a component's kernel, or of an actuator's controller
    gradient_q: F2  # (4, 6)
    gradient_v: F2
    by_map: F2  # (6, 6)
    by_map_rate: F2
    signal: F1  # (SIGNALS,) signals of one actuator
    signal_rate: F1  # (SIGNALS,) their time derivatives at a fixed state
    control_work: F2  # (2, most states)
    observed: F2  # (components, 2) angle error and recorded signal
    work: F1  # (n+m+nz,)
    scratch: F1  # (2n+nz,)
    work_b: F1  # (nb,)
    bar: F2  # (17, widest flexible bar)
    bar_by_x: F2  # (2 vectors, 2 vectors) derivatives of the forces of a flexible bar
    bar_by_v: F2
    rail: F2  # (8, most columns or polynomials)


class FrictionWorkspace(NamedTuple):
    """Tables and scratch of the f frictions in ideal joints, with the balances that give their reactions.

    Lane 0 of the equations is the mechanism without friction and without the p pressures of teeth and belts. Lane 1 + k is the
    response to friction k at a unit reaction, lane 1 + f + e the response to a unit pressure.
    """

    component: I1  # (f,)
    place: I1  # (components,) index among the frictions, or -1
    guide: I1  # (f,) 1 for a guide, 0 for a pin
    unknown: (
        I2  # (f, 2) rows of the ordered reactions: x and y of a pin; force and moment of a guide, the moment -1 if it has none
    )
    moment: F1  # (f,) force at the edges of a guide per unit moment
    gravity: F1  # (2,) [m/s^2]
    balance: Balance
    maps: BodyMaps
    bending: BendingLoads
    size: F1  # (f,) reaction that friction depends on [N]
    fault: I1  # (1,) fault of `joint_friction`, or 0
    pressing: F2  # (p, f + 1) multipliers of the couplings with a pressure, and their responses
    pressure: F2  # (p, 2) size of each pressure, and its derivative by the multiplier
    direction: F3  # (lanes, bodies, 2) the same in all lanes
    position: F3
    acceleration: F3
    angular_acceleration: F2  # (lanes, bodies)
    load: F3  # (lanes, bodies, 3)
    matrix: F3  # (unknowns, 2 band + 1, 1)
    rows: F3  # (3, widest body, 1)
    right: F2  # (3, lanes)
    reaction: F2  # (unknowns, lanes)
    force: F1  # (n + nb,)
    change: F1  # (n + nb,)
    multiplier: F1  # (m,)
    slope: F2  # (f, width) full matrix stored as a band
    pivots: I1  # (2 f,)
    step: F1  # (f,)
    # Arrays for implicit steps (`reaction_slopes`); empty if there are too many states
    by_state: F2  # (f, states) derivatives of the reactions by the state
    by_time: F1  # (f,)
    response: F2  # (f, n) accelerations per unit reaction, at the last evaluation
    frozen: F2  # (f, n) the same at the linearisation of the step matrix
    solved: F2  # (f, states) these rates multiplied by the inverse of the matrix for constant reactions
    share: F2  # (f, width)
    share_pivots: I1  # (2 f,)
    rates: F1  # (states,)
    upper: F1  # (f,)


class System(NamedTuple):
    """Model, parameters, state, workspace and friction of ideal joints."""

    model: Model
    parameters: Parameters
    state: MechanismState
    work: Workspace
    friction: FrictionWorkspace


open_system = opener(System)  # Returns the system of a handle's address, inside kernels
