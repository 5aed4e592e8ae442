"""Integration from contact to contact: scipy's integrators for smooth pieces of motion, joined at roots of the indentation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.integrate import RK45, OdeSolution, solve_ivp
from scipy.optimize import minimize_scalar

from reference.laws import Elastic, LuGre

FLOOR = 1e-6  # [m/s] smallest approach speed that damping laws use, docs/theory (C4)


@dataclass(frozen=True)
class ClearanceJoint:
    """A clearance joint: radial clearance and journal radius [m], elastic law, damping factor xi, friction."""

    clearance: float
    journal_radius: float
    elastic: Elastic
    damping: float
    friction: LuGre | None = None


class Relative(NamedTuple):
    """Eccentricity and its rate, angular velocities of the journal's and the bearing's bodies."""

    ex: float
    ey: float
    ux: float
    uy: float
    journal_spin: float
    bearing_spin: float


class Load(NamedTuple):
    """Force on the journal [N], opposite on the bearing, and moments on the two bodies about the pin centres [N m]."""

    fx: float
    fy: float
    journal_moment: float
    bearing_moment: float


class Touch(NamedTuple):
    """Forces and rates of one joint in contact."""

    load: Load
    elastic: float
    normal: float
    tangential: float
    rate: float
    slip: float
    bristle_rate: float


NO_LOAD = Load(0.0, 0.0, 0.0, 0.0)  # Load of an open contact


class Model(Protocol):
    """Equations of motion with the loads of the clearance joints on their right-hand side."""

    joints: tuple[ClearanceJoint, ...]
    size: int
    """Number of coordinates."""

    def start(self):
        """Return coordinates and rates at t = 0 with concentric journals."""

    def relative(self, t, q, v):
        """Return the position of each journal in its bearing."""

    def accelerate(self, t, q, v, loads):
        """Return accelerations, drive torque [N m] and drive power [W]."""

    def energy(self, t, q, v):
        """Return kinetic and potential energy together [J]."""

    def settle(self, t, q, v):
        """Return the nearest state without constraint drift."""


class Minimal:
    """One clearance joint in two minimal coordinates, which are zero at the concentric start."""

    joint: ClearanceJoint
    size = 2

    @property
    def joints(self):
        return (self.joint,)

    def start(self):
        return np.zeros(2), np.zeros(2)

    def settle(self, t, q, v):
        """Return the state: minimal coordinates do not drift."""
        return q, v


@dataclass
class Contact:
    """One contact: names and units as in the package's table."""

    joint: int
    start: float
    approach_speed: float
    angle: float
    peak_force: float = 0.0
    peak_time: float = 0.0
    duration: float = math.nan
    rebound_speed: float = math.nan


@dataclass(frozen=True)
class Piece:
    """Smooth piece of motion with the contact of each joint, if any."""

    begin: float
    end: float
    solution: OdeSolution
    open: tuple[Contact | None, ...]


@dataclass
class Samples:
    """Results at given times; arrays along time."""

    eccentricity: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    slip: np.ndarray
    torque: np.ndarray
    coordinates: np.ndarray
    energy: np.ndarray
    elastic_energy: np.ndarray
    work: np.ndarray
    damping_loss: np.ndarray
    friction_loss: np.ndarray


def touch(joint, at, approach, bristle):
    """Return the forces of a joint in contact, docs/theory (C1) to (C3)."""
    e = math.hypot(at.ex, at.ey)
    nx, ny = at.ex / e, at.ey / e
    rate = at.ux * nx + at.uy * ny
    slip = at.uy * nx - at.ux * ny + at.journal_spin * joint.journal_radius - at.bearing_spin * (joint.journal_radius + e)
    elastic = joint.elastic(max(e - joint.clearance, 0.0))
    normal = max(elastic * (1.0 + joint.damping * rate / approach), 0.0)
    coefficient, bristle_rate = joint.friction.evaluate(slip, bristle) if joint.friction else (0.0, 0.0)
    tangential = normal * coefficient
    load = Load(
        -normal * nx + tangential * ny,
        -normal * ny - tangential * nx,
        -joint.journal_radius * tangential,
        (joint.journal_radius + e) * tangential,
    )
    return Touch(load, elastic, normal, tangential, rate, slip, bristle_rate)


@dataclass
class March:
    """A model integrated from contact to contact.

    The state is coordinates, rates, one bristle deflection per joint, then drive work, elastic energy, damping loss and
    friction loss for the energy balance.
    """

    model: Model
    rtol: float = 1e-12  # Relative to each component of the state
    atol: float = 1e-12  # Of the smallest clearance for coordinates, of 1 m/s for rates, of mu_k/sigma_0 for bristles
    max_step: float = 5e-5  # [s]; two crossings of the gap nearer than this might go unseen
    stops: tuple[float, ...] = ()  # [s] ends of steps, where loads or motions are not smooth
    contacts: list[Contact] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.n, self.count = self.model.size, len(self.model.joints)

    def parts(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return coordinates, rates and bristles."""
        n = self.n
        return y[:n], y[n : 2 * n], y[2 * n : 2 * n + self.count]

    def touches(self, t: float, y: np.ndarray, open_: Sequence[Contact | None]) -> list[Touch | None]:
        """Return forces and rates of the joints in contact."""
        q, v, bristles = self.parts(y)
        return [
            None if contact is None else touch(joint, at, max(contact.approach_speed, FLOOR), float(bristle))
            for joint, at, contact, bristle in zip(
                self.model.joints, self.model.relative(t, q, v), open_, bristles, strict=True
            )
        ]

    def rates(self, t: float, y: np.ndarray, open_: Sequence[Contact | None]) -> np.ndarray:
        q, v, _ = self.parts(y)
        found = self.touches(t, y, open_)
        a, _, power = self.model.accelerate(t, q, v, [NO_LOAD if one is None else one.load for one in found])
        acting = [one for one in found if one is not None]
        storing = sum(one.elastic * one.rate for one in acting)
        damping = sum((one.normal - one.elastic) * one.rate for one in acting)
        friction = sum(one.tangential * one.slip for one in acting)
        bristles = [0.0 if one is None else one.bristle_rate for one in found]
        return np.concatenate([v, a, bristles, [power, storing, damping, friction]])

    def gap(self, t: float, y: np.ndarray, j: int) -> tuple[float, float]:
        """Return |e| - c of joint j and its rate."""
        at = self.model.relative(t, *self.parts(y)[:2])[j]
        e = math.hypot(at.ex, at.ey)
        return e - self.model.joints[j].clearance, (at.ex * at.ux + at.ey * at.uy) / e if e > 0.0 else 0.0

    def advance(self, begin: float, y: np.ndarray, end: float, open_: tuple[Contact | None, ...], events: list[Any]) -> Any:
        """Call the integrator once, explicit also with bristles: with steps this accurate it takes a tenth of Radau's time."""
        clearance = min((joint.clearance for joint in self.model.joints), default=1.0)
        bristles = [joint.friction.kinetic / joint.friction.stiffness if joint.friction else 1.0 for joint in self.model.joints]
        # the four energies pass through hundreds of joules; a nanojoule is far below what they are used for
        scale = np.concatenate([np.full(self.n, clearance), np.ones(self.n), bristles, np.full(4, 1e-9 / self.atol)])
        found = solve_ivp(
            lambda t, state: self.rates(t, state, open_),
            (begin, end),
            y,
            method="DOP853",
            rtol=self.rtol,
            atol=self.atol * scale,
            max_step=self.max_step,
            events=events,
            dense_output=True,
        )
        if not found.success:
            raise RuntimeError(found.message)
        return found

    def run(self, until: float, *, most_contacts: int = 1_000_000) -> March:
        """Integrate to a time [s], or until a number of contacts has ended."""
        q, v = self.model.start()
        t, y = 0.0, np.concatenate([q, v, np.zeros(self.count + 4)])
        open_: list[Contact | None] = [None] * self.count
        while t < until:
            events = []
            for j, contact in enumerate(open_):

                def crossing(time: float, state: np.ndarray, j: int = j) -> float:
                    return self.gap(time, state, j)[0]

                crossing.terminal, crossing.direction = True, 1.0 if contact is None else -1.0
                events.append(crossing)
            end = min((stop for stop in self.stops if t < stop < until), default=until)
            found = self.advance(t, y, end, tuple(open_), events)
            self.pieces.append(Piece(t, float(found.t[-1]), found.sol, tuple(open_)))
            self.note_peaks(found.t, found.y)
            hit = [j for j in range(self.count) if found.t_events[j].size]
            if not hit:
                t, y = end, found.y[:, -1].copy()
                continue
            t, y = self.sharpen(found, hit[0], tuple(open_))
            q, v = self.model.settle(t, *self.parts(y)[:2])
            y[: 2 * self.n] = np.concatenate([q, v])
            self.switch(t, y, hit[0], open_)
            if sum(not math.isnan(contact.duration) for contact in self.contacts) >= most_contacts:
                break
        return self

    def sharpen(self, found: Any, j: int, open_: tuple[Contact | None, ...]) -> tuple[float, np.ndarray]:
        """Refine the root by steps that end on it, as the interpolant is less accurate than the steps."""
        begin, y = float(found.t[-2]), found.y[:, -2]
        t, state = float(found.t[-1]), found.y[:, -1].copy()
        for _ in range(5):
            state = self.advance(begin, y, t, open_, []).y[:, -1].copy()
            gap, rate = self.gap(t, state, j)
            if abs(gap) < 1e-12 * self.model.joints[j].clearance or abs(rate) < 1e-9 or not begin < t - gap / rate:
                break
            t -= gap / rate
        return t, state

    def switch(self, t: float, y: np.ndarray, j: int, open_: list[Contact | None]) -> None:
        """Begin or end the contact of joint j."""
        at, joint = self.model.relative(t, *self.parts(y)[:2])[j], self.model.joints[j]
        rate = self.gap(t, y, j)[1]
        contact = open_[j]
        if contact is not None:
            contact.duration, contact.rebound_speed = t - contact.start, rate
            open_[j] = None
            return
        open_[j] = Contact(j, t, rate, math.atan2(at.ey, at.ex))
        self.contacts.append(open_[j])
        if joint.friction:
            y[2 * self.n + j] = joint.friction.begin(touch(joint, at, max(rate, FLOOR), 0.0).slip)

    def note_peaks(self, times: np.ndarray, states: np.ndarray) -> None:
        """Update the peak forces of open contacts with the latest piece."""
        piece = self.pieces[-1]
        for j, contact in enumerate(piece.open):
            if contact is None:
                continue

            def push(t: float, y: np.ndarray, j: int = j) -> float:
                found = self.touches(t, y, piece.open)[j]
                return 0.0 if found is None else found.normal

            forces = [push(t, y) for t, y in zip(times.tolist(), states.T, strict=True)]
            k = int(np.argmax(forces))
            bounds = float(times[max(k - 1, 0)]), float(times[min(k + 1, len(times) - 1)])
            best = minimize_scalar(
                lambda t, push=push: -push(t, piece.solution(t)), bounds=bounds, method="bounded", options={"xatol": 1e-13}
            )
            if -best.fun > contact.peak_force:
                contact.peak_force, contact.peak_time = float(-best.fun), float(best.x) - contact.start

    def at(self, times: Sequence[float] | np.ndarray) -> Samples:
        rows = []
        for t in np.asarray(times, float).tolist():
            piece = next(piece for piece in self.pieces if t <= piece.end)
            y = piece.solution(t)
            q, v, _ = self.parts(y)
            found = self.touches(t, y, piece.open)
            loads = [NO_LOAD if one is None else one.load for one in found]
            acting = [(0.0, 0.0, 0.0) if one is None else (one.normal, one.tangential, one.slip) for one in found]
            rows.append(
                (
                    [(one.ex, one.ey) for one in self.model.relative(t, q, v)],
                    *([one[i] for one in acting] for i in range(3)),
                    self.model.accelerate(t, q, v, loads)[1],
                    q.copy(),
                    self.model.energy(t, q, v),
                    y[-3],
                    y[-4],
                    y[-2],
                    y[-1],
                )
            )
        return Samples(*(np.array(column) for column in zip(*rows, strict=True)))


def march_in_steps(model, until, step):
    """Return the contacts of the only joint of a frictionless model, by Dormand and Prince's steps of one size without events.

    A contact begins with a step that ends inside, and ends with one that ends outside.
    """
    march, open_, contacts = March(model), [None], list[Contact]()
    q, v = model.start()
    y = np.concatenate([q, v, np.zeros(march.count + 4)])
    for k in range(round(until / step)):
        slopes = np.zeros((7, y.size))
        for stage, row in enumerate((*RK45.A, RK45.B)):
            state = y + step * (row[:stage] @ slopes[:stage])
            slopes[stage] = march.rates((k + [*RK45.C, 1.0][stage]) * step, state, open_) if stage < 6 else 0.0
        y, now = state, (k + 1) * step
        gap, rate = march.gap(now, y, 0)
        contact = open_[0]
        if contact is None and gap > 0.0 and rate > 0.0:
            open_[0] = Contact(0, now, rate, 0.0)
            contacts.append(open_[0])
        elif contact is not None and gap < 0.0 and rate < 0.0:
            contact.duration, contact.rebound_speed = now - contact.start, rate
            open_[0] = None
    return contacts
