"""Where the bodies of a mechanism are at the start, for rooms that have to know before a run."""

from __future__ import annotations

from scissordyn.component.beam import Beam
from scissordyn.component.flexible_bar import FlexibleBar
from scissordyn.component.place import Point
from scissordyn.errors import InputError
from scissordyn.kinematics.assembly import Held, assemble, held_rods, natural_state, placed_start
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.advance.system import make_system


def assembled_places(mechanism: Mechanism) -> dict[str, tuple[Point, float]]:
    """Position [m] and angle [rad] of each body with ideal joints; none if it cannot be assembled, which a run says."""
    ideal = mechanism.ideal()
    # what exerts forces holds no place, and a roller may run along a bar that is not yet there
    bent = tuple(part for part in ideal.components if isinstance(part, Beam | FlexibleBar))
    try:
        tables = plan(ideal.with_parts({"components": bent}))
        system, holds = make_system(tables).content, Held(places=True, speeds=True)
        held_rods(tables, system, holds)
        start = assemble(tables, system, placed_start(tables, system), holds)
    except InputError:
        return {}
    natural, _ = natural_state(tables, system, start)
    coordinates, places = tables.coordinates.natural, dict[str, tuple[Point, float]]()
    for body in mechanism.bodies:
        x, y = natural[coordinates.offsets[body.name] :][:2].tolist()
        places[body.name] = (x, y), coordinates.angle_of(body.name, natural)
    return places
