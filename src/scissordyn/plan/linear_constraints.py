"""Reduction of a mechanism to few coordinates: linear constraints are eliminated, the mass matrix becomes the identity.

Each body is its origin p and, if it rotates, the unit vector d along its x axis. Every point of it is p + x d + y J d, linear
in both. Linear constraints are pins, guides, prescribed directions, and parallel opposite bars of a parallelogram of ideal
joints. The result is: natural coordinates = T [x; b(t)] with T constant. The free coordinates x are scaled to a unit mass
matrix; b = (1, cos th_1, sin th_1, ...) are the prescribed directions. The quadratic constraints are |d|^2 = 1 for each family
of parallel bars, and one for each guide on a moving body, rod and latch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint
from scissordyn.errors import InputError
from scissordyn.mechanics.time_function import function_start
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bending import beam_mass, bends, dissected
from scissordyn.plan.coordinates import Coordinates, Natural, natural_coordinates
from scissordyn.plan.coupling import coupling_constraints
from scissordyn.plan.elimination import Elimination, Rows, add, scaled
from scissordyn.plan.parallelogram import parallel_bodies
from scissordyn.plan.quadratic_constraints import order_constraints, quadratic_constraints
from scissordyn.plan.redundancy import assembled_near_placed, basis_of, independent
from scissordyn.tolerance import ASSEMBLY_TOL

if TYPE_CHECKING:
    from scipy.sparse import csr_array

REMAINDER_TOLS = ASSEMBLY_TOL, 1e-6, 1e-4, 3e-3, 1e-2
"""Tolerances, in the order tried, of redundant linear constraints: largest remainder after elimination.

The first is round-off, the others suit lengths with fewer and fewer digits. The next one is tried if the joints would move
the bodies far from where they are placed.
"""


class Reduction(NamedTuple):
    """Result of the elimination of linear constraints; it does not depend on masses."""

    elimination: Elimination
    rows: Rows  # Natural coordinates by remaining ones; origins are in mechanism sizes


def make_reduction(mechanism: Mechanism) -> Reduction:
    """Eliminate the linear constraints of a mechanism, parallelograms included."""
    parallel = parallel_bodies(mechanism, lambda: _assembled_angles(mechanism))
    return eliminated(mechanism, natural_coordinates(mechanism), parallel)


def reduced(mechanism: Mechanism, reduction: Reduction | None = None) -> Coordinates:
    """Return the coordinates of a mechanism with all linear constraints eliminated, and its quadratic constraints.

    `reduction` may be that of a mechanism which differs only in masses.
    """
    return _reduced(mechanism, make_reduction(mechanism) if reduction is None else reduction)


def _assembled_angles(mechanism: Mechanism) -> dict[str, float] | None:
    """Return the angles of the rotating bodies, assembled near their placement with parallelograms as quadrilaterals."""
    coordinates = _reduced(mechanism, eliminated(mechanism, natural_coordinates(mechanism), []))
    natural = assembled_near_placed(coordinates, _angles_of_drives(mechanism, coordinates.natural))
    if natural is None:
        return None
    return {body.name: coordinates.natural.angle_of(body.name, natural) for body in mechanism.bodies}


def _angles_of_drives(mechanism: Mechanism, natural: Natural) -> np.ndarray:
    """Return the angles of the drives at t = 0 [rad]."""
    return np.array([function_start(drive.motion, natural.angle(drive.body)) for drive in mechanism.drives], float)


def _reduced(mechanism: Mechanism, reduction: Reduction) -> Coordinates:
    """Return the coordinates of a mechanism after the elimination of its linear constraints."""
    natural, size, basis = natural_coordinates(mechanism), mechanism.size, 1 + 2 * len(mechanism.drives)
    elimination, (start, columns, values) = reduction
    total = natural.total
    is_free = elimination.solved_at[:total] < 0
    free = int(np.sum(is_free))
    position = np.concatenate([np.cumsum(is_free) - 1, free + np.arange(basis)])
    # origins are in units of the mechanism's size
    unit = np.where(origins(natural), size, 1.0)
    data = values * np.repeat(unit, np.diff(start))
    rows, bend = np.repeat(np.arange(total), np.diff(start)), bends(mechanism)
    matrix: Any
    if total <= 200 and not bend:  # small full matrices are faster than sparse ones
        matrix = full(rows, position[columns], data, (total, free + basis))
        mass: Any = full(*_mass(mechanism, natural), (total, total))
    else:
        import scipy.sparse as sp  # imported here: it takes longer than the runs of most small mechanisms

        matrix = sp.csr_array((data, position[columns], start), shape=(total, free + basis))
        *places, values = _mass(mechanism, natural)
        mass = sp.csr_array((values, places), shape=(total, total))
        mass = sp.csr_array(mass + beam_mass(mechanism, natural)) if bend else mass
    try:
        matrix = _normalized(matrix, mass, free, dissected if bend else None)
    except np.linalg.LinAlgError:
        raise _lost_inertia(mechanism) from None
    bare = Coordinates(natural, free, basis, matrix, mass, size)
    constraints, angles = quadratic_constraints(mechanism, bare, elimination), _angles_of_drives(mechanism, natural)
    constraints += coupling_constraints(mechanism, bare.with_constraints(tuple(constraints)), angles)
    coordinates = independent(
        bare.with_constraints(order_constraints(free, constraints)), angles, lenient=mechanism.clearances_closed
    )
    if elimination.nothing_left == ASSEMBLY_TOL:
        return coordinates
    b = basis_of(angles)
    values = np.append(bare.matrix @ np.append(bare.nearest(b, bare.placed[0]), b), b)
    values[:total] /= unit
    names = coordinates.redundant or ("the joint that closes a chain",)
    return coordinates.with_constraints(coordinates.constraints, names, max(coordinates.miss, elimination.error(values)))


def full(rows: np.ndarray, columns: np.ndarray, values: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return a full matrix; values at one place are added."""
    matrix = np.zeros(shape)
    np.add.at(matrix, (rows, columns), values)
    return matrix


def eliminated(mechanism: Mechanism, natural: Natural, parallel: list[tuple[str, str, float]]) -> Reduction:
    """Eliminate the linear constraints, with given pairs of bodies kept parallel."""
    # origins are eliminated before directions: lengths then stay short expressions
    elimination = Elimination(origins(natural), 1 + 2 * len(mechanism.drives))
    _impose_all(mechanism, natural, elimination, parallel)
    placed = natural.placed()[0]
    placed[origins(natural)] /= mechanism.size
    placed = np.concatenate([placed, basis_of(_angles_of_drives(mechanism, natural))])
    for nothing_left in REMAINDER_TOLS:
        try:
            rows = elimination.rows(nothing_left)
        except InputError:
            continue
        if not elimination.misses(rows, placed):
            return Reduction(elimination, rows)
    return Reduction(elimination, elimination.rows())


def origins(natural: Natural) -> np.ndarray:
    """Return True for each natural coordinate of an origin, False for one of a direction."""
    is_origin = np.zeros(natural.total, bool)
    for first in natural.offsets.values():
        is_origin[first : first + 2] = True
    return is_origin


def _lost_inertia(mechanism: Mechanism) -> InputError:
    """Return the error for a singular mass matrix; it names the body whose inertia is too small next to its mass."""

    def fraction(body: Body) -> float:
        x, y = body.centre
        return body_inertia(mechanism, body) / (body.mass * (x * x + y * y) or 1.0) if body.rotates else math.inf

    body = min(mechanism.bodies, key=fraction)
    return InputError(
        f"body '{body.name}': inertia = {body.inertia!r} kg m^2 is lost in rounding, relative to the mass {body.mass:g} kg "
        f"times the square of the distance {math.hypot(*body.centre):g} m of its mass centre from its origin",
        "an origin near the mass centre, or a larger inertia",
    )


def _name_bodies(first: str, second: str) -> str:
    """Name two bodies, one of which may be the ground."""
    names = [f"'{name}'" for name in (first, second) if name != GROUND]
    return f"bodies {names[0]} and {names[1]}" if len(names) == 2 else f"body {names[0]} and the ground"


def _impose_all(
    mechanism: Mechanism, natural: Natural, elimination: Elimination, parallel: list[tuple[str, str, float]]
) -> None:
    """Impose drives, parallelograms, welds, joints and guides on the elimination."""
    ones, size = natural.total, mechanism.size

    def impose_angle(first: str, second: str, angle: float, name: str) -> None:
        """Keep a constant angle between the directions of two bodies, or of the ground and a body."""
        b, cos, sin = natural.offsets[second] + 2, math.cos(angle), math.sin(angle)
        x, y = ({ones: 1.0}, {}) if first == GROUND else natural.direction(first)
        elimination.impose(add({b: 1.0}, scaled(-cos, x), scaled(sin, y)), name)
        elimination.impose(add({b + 1: 1.0}, scaled(-sin, x), scaled(-cos, y)), name)

    def impose_pin(first: BodyPoint, second: BodyPoint, name: str) -> None:
        for here, there in zip(natural.point_expressions(*first, size), natural.point_expressions(*second, size), strict=True):
            elimination.impose(add(here, scaled(-1.0, there)), name)

    for index, drive in enumerate(mechanism.drives):
        d = natural.offsets[drive.body] + 2
        for axis in (0, 1):
            elimination.impose({d + axis: 1.0, ones + 1 + 2 * index + axis: -1.0}, f"the drive of body '{drive.body}'")
    for body, other, angle in parallel:
        impose_angle(body, other, angle, f"the parallelogram of {_name_bodies(body, other)}")
    for weld in mechanism.welds:
        name = f"weld '{weld.name}' of {_name_bodies(weld.start[0], weld.end[0])}"
        rotating = [body for body, _ in (weld.start, weld.end) if natural.rotates(body)]
        if rotating:
            first, second = (GROUND, *rotating)[-2:]
            impose_angle(first, second, natural.angle(second) - natural.angle(first), name)
        impose_pin(weld.start, weld.end, name)
    for joint in mechanism.ideal_joints:
        impose_pin(joint.journal, joint.bearing, f"joint '{joint.name}' of {_name_bodies(*joint.bodies)}")
    for guide in mechanism.ideal_guides:
        follower = guide.follower[0]
        if guide.aligned:
            angle = natural.angle(follower) - natural.angle(guide.body)
            impose_angle(guide.body, follower, angle, f"guide '{guide.name}'")
        if guide.body != GROUND:
            continue
        x, y = natural.point_expressions(*guide.follower, size)
        across = -math.sin(guide.direction), math.cos(guide.direction)
        level = (across[0] * guide.through[0] + across[1] * guide.through[1]) / size
        name = f"guide '{guide.name}' of body '{follower}'"
        elimination.impose(add(scaled(across[0], x), scaled(across[1], y), {ones: -level}), name)


def body_inertia(mechanism: Mechanism, body: Body) -> float:
    """Return a body's moment of inertia about its mass centre, including the rotors of its motors and actuators [kg m^2]."""
    motors: list[Any] = [part for part in mechanism.components if part.declaration.motor and part.declaration.port.turning]
    rotors = (part.inertia for part in motors if part.body == body.name)
    return (body.inertia or 0.0) + sum(map(float, rotors))


def _mass(mechanism: Mechanism, natural: Natural) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows, columns and values of the mass matrix of the bodies."""
    entries: list[tuple[int, int, float]] = []
    for body in mechanism.bodies:
        p, m, (x, y) = natural.offsets[body.name], body.mass, body.centre
        entries += [(p, p, m), (p + 1, p + 1, m)]
        if not natural.rotates(body.name):
            continue
        about_origin = body_inertia(mechanism, body) + m * (x * x + y * y)
        entries += [(p + 2, p + 2, about_origin), (p + 3, p + 3, about_origin)]
        for row, column, value in ((p, p + 2, m * x), (p, p + 3, -m * y), (p + 1, p + 2, m * y), (p + 1, p + 3, m * x)):
            if value != 0.0:
                entries += [(row, column, value), (column, row, value)]
    rows, columns, values = zip(*entries, strict=True)
    return np.array(rows), np.array(columns), np.array(values)


def _normalized(matrix: Any, mass: Any, free: int, ordered: Callable[[csr_array], np.ndarray] | None = None) -> Any:
    """Transform the free coordinates, block by block, so that their mass matrix is the identity.

    A coordinate becomes a mixture of coupled coordinates before it; `ordered` returns an order that keeps these few.
    """
    moving = matrix[:, :free]
    if isinstance(matrix, np.ndarray):
        lower = np.linalg.cholesky(moving.T @ mass @ moving)
        matrix[:, :free] = moving @ np.linalg.inv(lower).T
        return matrix
    import scipy.sparse as sp
    from scipy.linalg import solve_triangular
    from scipy.sparse.csgraph import connected_components

    reduced = sp.csr_array(moving.T @ mass @ moving)
    count, label = connected_components(reduced, directed=False)
    order = np.argsort(label, kind="stable")
    sizes = np.bincount(label, minlength=count)
    blocks: list[np.ndarray] = []
    first, diagonal = 0, reduced.diagonal()
    if not np.all(diagonal > 0.0):
        raise np.linalg.LinAlgError
    for size in sizes.tolist():
        members = order[first : first + size]
        if size == 1:  # most coordinates of flexible bars: sparse indexing would be slow for each
            blocks.append(1.0 / np.sqrt(diagonal[members, None]))
            first += 1
            continue
        if ordered is not None:
            members = members[ordered(sp.csr_array(reduced[members][:, members]))]
            order[first : first + size] = members
        lower = np.linalg.cholesky(reduced[members][:, members].toarray())
        blocks.append(np.linalg.inv(lower).T if ordered is None else solve_triangular(lower, np.eye(size), lower=True).T)
        first += size
    back = np.argsort(order)
    mixing = sp.csr_array(sp.block_diag([sp.coo_array(block) for block in blocks], format="csr"))[back][:, back]
    result = sp.csr_array(sp.hstack([moving @ mixing, matrix[:, free:]]))
    result.eliminate_zeros()
    result.sort_indices()
    return result
