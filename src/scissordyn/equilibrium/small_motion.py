"""Equilibrium positions about which a mechanism oscillates: with clearances or ideal joints, drives locked or released."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np

from scissordyn.components.torque import Torque
from scissordyn.equilibrium.rest import activate_closed_gaps, equilibrium, keep_modes
from scissordyn.equilibrium.start import assembled_near, prepare_start, rest_with_clearances
from scissordyn.equilibrium.static_position import StaticPosition, count_turns
from scissordyn.errors import AssemblyError, InputError
from scissordyn.kinematics.assembly import whole_state
from scissordyn.kinematics.branching import locking_position
from scissordyn.kinematics.closure import Inputs
from scissordyn.mechanics import functions
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rest import NO_TURNS, with_inputs
from scissordyn.plan.system import make_system, rates

Position = Literal["static", "concentric"]

STATIC_PREFIX = "start = 'static': "  # First words of errors of `rest.equilibrium`; messages of other analyses omit them

LockDrives = Callable[[float, Mapping[str, float]], Plan]
"""Function that returns the plan with drives locked at a time, for given angles by which the bodies have turned."""

INPUT_STEP_MAX = 0.1  # [rad; lengths in m] largest change of a drive's angle or length between two computed positions


def equilibrium_pair(
    locked: Plan, position: Position, before: StaticPosition | None, change: np.ndarray | None = None
) -> tuple[StaticPosition, StaticPosition]:
    """Return two equilibria of a plan with locked drives: journals resting in contact, and all joints ideal.

    The search starts from the position `before`, or from the start of the plan if it is None. The natural coordinates are
    expected to change by `change`, if it is given.
    """
    ideal = locked.ideal
    system, n = make_system(ideal), ideal.coordinates.free
    if before is None:
        y = prepare_start(ideal, system, position).y
    else:
        count_turns(ideal, system.content, before.turned)
        keep_modes(before.system.content, system.content)
        free_coordinates = assembled_near(ideal, system.content, before.natural, straight=position == "concentric").position
        if position == "static":
            expected = None
            if change is not None:
                expected = assembled_near(ideal, system.content, before.natural + change, straight=False).position
            free_coordinates = equilibrium(ideal, system, free_coordinates, expected=expected).position
        y = whole_state(system.content, free_coordinates)
    functions.accept(0.0, y, system.address, np.zeros(2))
    place = StaticPosition(ideal, system, y)
    if not locked.contacts:
        return place, place
    handle, rest = rest_with_clearances(locked, system, y[:n])
    state = whole_state(handle.content, rest.position)
    functions.accept(0.0, state, handle.address, np.zeros(2))
    activate_closed_gaps(handle, state)
    return StaticPosition(locked, handle, state), place


def equilibria_along_motion(
    lock: LockDrives, driven: Plan, times: Iterable[float], position: Position
) -> Iterator[tuple[StaticPosition, StaticPosition]]:
    """Yield both equilibria of `equilibrium_pair` at each time of the drives' motion, found from those before.

    The drives of `driven`, a plan with ideal joints, prescribe the motion.
    """

    def ideal(time: float, turned: Mapping[str, float]) -> Plan:
        return lock(time, turned).ideal

    path, inputs = _Path(position), Inputs(driven)
    for time in times:
        if not path.places and time != 0.0:
            path.extend(ideal, 0.0)
        before = path.times[-1] if path.times else 0.0
        change = float(np.max(np.abs(inputs.at(time) - inputs.at(before)), initial=0.0))
        stops = np.linspace(before, time, max(1, int(np.ceil(change / INPUT_STEP_MAX))) + 1)[1:-1].tolist()
        with _naming_locking_position(driven, time):
            for between in stops:
                path.extend(ideal, between)
            at = path.extend(lock, time)
        yield at, path.places[-1]


@contextmanager
def _naming_locking_position(driven: Plan, time: float) -> Iterator[None]:
    """Raise the first locking position of the drives until `time`, if there is one, instead of an error of the assembly."""
    try:
        yield
    except AssemblyError as error:
        lock = locking_position(driven, time)
        if lock is None:
            raise
        place = error.what.partition(": ")[0]  # "at t = 0.15 s"
        end = f"until = {0.99 * lock.time:.3g} s"
        raise InputError(f"{place}: {lock.text}", f"an end of the motion before {lock.time:.6g} s", end) from None


class _Path:
    """Last two equilibria with ideal joints along a motion, from which the next one is found."""

    def __init__(self, position: Position) -> None:
        self.position: Position = position
        self.times: list[float] = []
        self.places: list[StaticPosition] = []

    def extend(self, lock: LockDrives, time: float) -> StaticPosition:
        """Add the equilibrium with ideal joints at `time`, and return that with clearances.

        The interval is halved if a body turns too far for its full turns to be counted.
        """
        before, end = self.times[-1] if self.times else time, time
        shortest = 1e-3 * (time - before)
        while True:
            place = self.places[-1] if self.places else None
            whole = lock(end, place.turned if place else NO_TURNS)
            try:
                at, place = equilibrium_pair(whole, self.position, place, self._expected_change(end))
            except InputError as error:
                counted = any(constraint.turning for constraint in whole.coordinates.constraints)
                if place is None or not counted or end - before <= shortest:
                    kind = AssemblyError if isinstance(error, AssemblyError) else InputError
                    raise kind(f"at t = {end:.6g} s: {error.what.removeprefix(STATIC_PREFIX)}", error.expected) from None
                end = 0.5 * (before + end)
                continue
            self.times, self.places = [*self.times[-1:], end], [*self.places[-1:], place]
            if end == time:
                return at
            before, end = end, time

    def _expected_change(self, time: float) -> np.ndarray | None:
        """Return the change of natural coordinates until `time` at the last rate of change; None without a last change."""
        if len(self.times) < 2 or self.times[0] == self.times[1]:
            return None
        earlier, last = (place.natural for place in self.places)
        return np.asarray((last - earlier) * ((time - self.times[1]) / (self.times[1] - self.times[0])))


def release_drives(at: StaticPosition) -> StaticPosition:
    """Return the same position with the drives replaced by the constant torques that hold it."""
    mechanism = at.plan.mechanism
    holding: tuple[Any, ...] = tuple(
        Torque(f"torque that holds '{drive.body}'", drive.body, torque=1.0) for drive in mechanism.drives
    )
    first = len(mechanism.components)
    turned = at.turned
    free = plan(dataclasses.replace(mechanism, drives=(), components=(*mechanism.components, *holding)))
    free = with_inputs(free, [motion for _, motion in free.motions], turned)
    system = make_system(free)
    count_turns(free, system.content, turned)
    start = assembled_near(free, system.content, at.natural, straight=False)
    state = whole_state(system.content, start.position, start.velocity)
    functions.accept(0.0, state, system.address, np.zeros(2))
    activate_closed_gaps(system, state)
    torque, n = system.content.parameters.component[first : first + len(holding), 0], free.coordinates.free

    def acceleration() -> np.ndarray:
        functions.activate(system.address)
        return rates(system, 0.0, state)[n : 2 * n]

    torque[:] = 0.0
    without, by_torque = acceleration(), []
    for k in range(len(holding)):
        torque[k] = 1.0
        by_torque.append(acceleration() - without)
        torque[k] = 0.0
    torque[:] = np.linalg.lstsq(np.array(by_torque).T, -without)[0]
    return StaticPosition(free, system, state)
