"""Which integrator suits a mechanism: an estimate of stiffness."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scissordyn.components.film.asperities import mean_gap
from scissordyn.components.film.film import Film, thinned
from scissordyn.errors import InputError
from scissordyn.integrate.advance import ADVANCING
from scissordyn.kernel import Handle
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import System
from scissordyn.model.options import TIME_STEPPING, Options
from scissordyn.plan.bending import bends
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import rates, state_kept
from scissordyn.run.advance.driver import Choice, Driver
from scissordyn.run.advance.loop import advance
from scissordyn.run.advance.tolerance import Tolerances

EXPLICIT, STIFF = "dop853", "rodas5p"

STABLE = 6.0  # An explicit step of DOP853 is stable up to about this number over the rate of a decaying mode

RESOLVED = 40.0
"""Steps that a contact or the fastest oscillation takes for accuracy anyway; more steps than this that only stability asks for
make a problem stiff."""

OVERDAMPED = 0.7  # Modes with at least this damping ratio are forgotten rather than resolved

MOST_EIGENVALUES, PRODUCTS = 400, 60
"""Above this number of states the fastest modes are estimated by so many products with the Jacobian (Arnoldi 1951)."""


FILM_STEPS = 30.0
"""Explicit steps that only stability asks for while a journal is pressed through its film once, above which films of rigid bars
are stiff."""

THIN_FILM = 3e5  # The same on bars that bend: damping of a film of a two-hundredth of the clearance over that in the centre

DEAR_MATRICES = 150
"""Number of states above which a linearly implicit step, with the matrices of bars that bend, costs over 30 explicit ones."""

TRIAL = 500  # Explicit steps in which a contact that is closed at the start has to open

STATIC_TRIAL, STATIC_PART = 15000, 0.1
"""The same from static equilibrium, where loads press contacts together for a while, and in which part of the run."""

PARTS, PARTS_OF_A_FALL = 5000, 5
"""Steps of a run, and of a fall across the smallest clearance from rest, that time stepping makes at least."""

OSCILLATION_STEP = 0.5  # Step of time stepping times the fastest angular frequency of components, at most

SPIN_GAIN = 1e-6
"""Part of its energy that a body that rotates freely gains in a run, at most, by steps that were not asked for. At omega a step
adds the part (3/4) (omega h)^4; a sample within it, on the chord, misses (omega h)^2/4."""

DECAY_STEP, FINEST = 0.5, 10
"""Step of time stepping times the fastest decay of components, as of a servo with derivative gain, at most; but it is not made
more times shorter than this: implicit damping is stable, and what decays so fast has no part in the motion."""


def choose_method(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> Choice:
    """The method that was asked for, or the one that an estimate of stiffness suggests."""
    choice = _choose(plan, system, y, options, tolerances)
    return choice if options.step is None or plan.hard_places else replace(choice, fixed=options.step)


def _choose(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> Choice:
    hard = [plan.contacts[j].name for j in plan.hard_places]
    if (options.method == TIME_STEPPING and not hard) or (options.method not in ("auto", TIME_STEPPING) and hard):
        what = f"hard contact in joint '{hard[0]}'" if hard else "no hard contact"
        raise InputError(f"method = '{options.method}' with {what}", f"auto, {TIME_STEPPING}" if hard else "auto")
    if hard:
        step, why = time_step(plan, system, y, options, tolerances)
        if plan.compliant_places:
            why += ", and shorter ones the vibration of compliant contacts that are closed"
        why = f"{len(hard)} of {len(plan.contacts)} contacts are hard; {why}"
        return Choice(TIME_STEPPING, why, step, longest_turn(options))
    if options.method != "auto":
        return Choice(options.method, "asked for")
    frictions = [(contact.name, laws.friction) for contact, laws in zip(plan.contacts, plan.clearances, strict=True)]
    stiff = [(name, friction) for name, friction in frictions if friction.stiff]
    if stiff and not (bends(plan.mechanism) and y.size > DEAR_MATRICES):
        name, friction = stiff[0]
        why = "has internal states that relax within microseconds" if friction.states else "is steep about zero slip speed"
        return Choice(STIFF, f"the friction law of joint '{name}' {why}")
    if plan.lubricated and any(part.declaration.section == "beam" for part in plan.components):
        return Choice(
            STIFF, f"the film of joint '{plan.lubricated[0][0].name}' acts on the light cross-sections of bars that bend"
        )
    if plan.lubricated and not bends(plan.mechanism) and y.size <= MOST_EIGENVALUES:
        steps = film_steps(plan, system, y, tolerances)
        if steps > FILM_STEPS:
            film = f"the film of joint '{plan.lubricated[0][0].name}'"
            return Choice(
                STIFF, f"to press a journal through {film} once would take {steps:.2g} explicit steps for stability alone"
            )
    if plan.contacts and options.start != "concentric":
        if not plan.coordinates.natural.axes or tolerances.delays:
            return Choice(STIFF, "contacts that start at rest have a stiff damping")
        resting = [joint.name for joint, mode in zip(plan.contacts, system.content.state.mode.tolist(), strict=False) if mode]
        static = options.start == "static"
        trial = (STATIC_TRIAL, STATIC_PART * options.until) if static else (TRIAL, math.inf)
        if resting and not open_soon(plan, system, y, tolerances, *trial):
            return Choice(STIFF, f"the contact of joint '{resting[0]}' stays closed from rest, where its damping is stiff")
        if resting:
            soon = "the first tenth of the run" if static else "a few explicit steps"
            return Choice(EXPLICIT, f"the contact of joint '{resting[0]}' opens within {soon}")
    nothing = Choice(EXPLICIT, "nothing decays faster than it has to be resolved")
    if not plan.components:
        return nothing
    oiled = plan.lubricated[0][0].name if plan.lubricated and bends(plan.mechanism) else ""
    if oiled and y.size > MOST_EIGENVALUES:
        return Choice(STIFF, f"the film of joint '{oiled}' acts on light cross-sections of bars that bend")
    decay, oscillation = fastest_modes(plan, system, y)
    resolved = max(oscillation, 2.0 * math.pi / tolerances.time_scale) * RESOLVED / (2.0 * math.pi)
    if decay / STABLE > resolved:
        return Choice(
            STIFF, f"the fastest decay, {decay:.3g} 1/s, would keep explicit steps below {STABLE / decay:.2g} s without need"
        )
    if oiled and THIN_FILM * decay / STABLE > resolved:
        return Choice(
            STIFF,
            f"the film of joint '{oiled}' would keep explicit steps short where it is thin, on light ends of bars that bend",
        )
    if decay == 0.0:
        return nothing
    return Choice(EXPLICIT, f"the fastest decay, {decay:.3g} 1/s, allows steps that accuracy needs anyway")


def open_soon(plan: Plan, system: Handle, y: np.ndarray, tolerances: Tolerances, most: int, until: float) -> bool:
    """Whether all contacts are open once within some explicit steps from the start, which are made for it.

    Damping over the approach speed, which is next to nothing at rest, is stiff until a contact has been open. Bars that bend
    often move away from it at once, where linearly implicit steps, with their matrices, cost ten times as much.
    """
    with state_kept(system):
        explicit = Choice(EXPLICIT, "")
        driver = Driver(plan, system, y.size, explicit, tolerances)
        driver.begin(plan, y, explicit, tolerances)
        driver.monitor(False)
        closed, status = np.flatnonzero(system.content.state.mode[: len(plan.contacts)] == 1), ADVANCING
        while closed.size and driver.tried < most and status == ADVANCING:
            status = advance(driver, until, most_steps=most // TRIAL)
            closed = np.setdiff1d(closed, driver.log["guard"][driver.log["mode"] == 0])
    return closed.size == 0


def time_step(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> tuple[float, str]:
    """Step of time stepping [s], and why: the one that was asked for, or what the fastest part needs."""
    if options.step is not None:
        return options.step, "the step was asked for"
    step, why = options.until / PARTS, f"the step is 1/{PARTS} of the run"
    answer = np.zeros(3)
    functions.accept(0.0, y.copy(), system.address, answer)
    gain, turn = longest_turn(options)
    spin = min(gain * answer[2] ** (-4.0 / 3.0), turn / answer[2]) if answer[2] > 0.0 else math.inf
    if tolerances.time_scale / PARTS_OF_A_FALL < step:
        step, why = tolerances.time_scale / PARTS_OF_A_FALL, "the step resolves a fall across the smallest clearance"
    if plan.components:
        modes = system.content.state.mode
        closed = modes[plan.compliant_places]
        modes[plan.compliant_places] = 0  # steps adapt to these
        decay, oscillation = fastest_modes(plan, system, y)
        modes[plan.compliant_places] = closed
        if decay * step > DECAY_STEP:
            step, why = max(DECAY_STEP / decay, step / FINEST), f"the step resolves the fastest decay, {decay:.3g} 1/s"
        if oscillation * step > OSCILLATION_STEP:
            step, why = OSCILLATION_STEP / oscillation, f"the step resolves the fastest oscillation, {oscillation:.3g} 1/s"
    if spin < step:
        step, why = spin, f"the step resolves the fastest rotation, {answer[2]:.3g} rad/s"
    return step, why


def longest_turn(options: Options) -> tuple[float, float]:
    """See `Choice.turn`: (3/4) omega (omega h)^3 T, and what a sample on a chord misses, are at most `SPIN_GAIN`."""
    if options.step is not None:
        return math.inf, math.inf
    return (SPIN_GAIN / (0.75 * options.until)) ** (1.0 / 3.0), 2.0 * math.sqrt(SPIN_GAIN)


def film_steps(plan: Plan, system: Handle, y: np.ndarray, tolerances: Tolerances) -> float:
    """Return how many explicit steps stability asks for while a journal is pressed through its film, until contact.

    A mass m under an acceleration a, with which the time scale T of the clearance c is (c/a)^(1/2), has the speed m a/D in a
    film of damping D, and steps of `STABLE` m/D are stable. D grows at least as the power -3/2 of the thickness h, so that
    there are about D^2 h/(2 `STABLE` m^2 a) steps down to h.

    Shapes: `y` (ny,).
    """
    content: System = system.content
    parameters, modes = content.parameters.component, content.state.mode
    kept, thinnest = (parameters.copy(), modes.copy()), 1.0
    modes[: len(plan.contacts)] = 0
    rates(system, 0.0, y)
    for i, part in enumerate(plan.components):
        if isinstance(part, Film):
            thinnest = min(thinnest, mean_gap(0.0, part.roughness / part.clearance))
            parameters[i] = thinned(parameters[i], content.work.coordinates[i])
    decay, _ = fastest_modes(plan, system, y)
    parameters[...], modes[...] = kept
    return (decay * tolerances.time_scale) ** 2 * thinnest / (2.0 * STABLE)


def fastest_modes(plan: Plan, system: Handle, y: np.ndarray) -> tuple[float, float]:
    """Largest rate of decay of strongly damped modes, and largest angular frequency of the others, near the start [1/s].

    End stops, cables and their like are taken as acting too, contacts as pressed in by a hundredth of their clearance.
    """
    content: System = system.content
    state = content.state
    before = state.mode.copy(), state.memory.copy()
    decay = oscillation = 0.0
    guards = [content.model.component_guard[i] for i, part in enumerate(plan.components) if part.declaration.gap is not None]
    for active in (0, 1) if guards else (0,):
        state.mode[guards] = active
        matrix = jacobian(system, y) if y.size <= MOST_EIGENVALUES else projected_jacobian(system, y)
        if not np.all(np.isfinite(matrix)):
            continue
        values = np.linalg.eigvals(matrix)
        size = np.abs(values)
        damped = -values.real >= OVERDAMPED * size
        decay = max(decay, float(np.max(size[damped], initial=0.0)))
        oscillation = max(oscillation, float(np.max(np.abs(values.imag[~damped]), initial=0.0)))
    state.mode[:], state.memory[:] = before
    return decay, oscillation


def jacobian(system: Handle, y: np.ndarray) -> np.ndarray:
    """Derivatives of the rates by the state at t = 0, by central differences, shape (ny, ny)."""
    matrix = np.zeros((y.size, y.size))
    for k, h in enumerate((1e-6 * np.maximum(np.abs(y), 1e-3)).tolist()):
        up, down = y.copy(), y.copy()
        up[k], down[k] = y[k] + h, y[k] - h
        matrix[:, k] = (rates(system, 0.0, up) - rates(system, 0.0, down)) / (2.0 * h)
    return matrix


def projected_jacobian(system: Handle, y: np.ndarray) -> np.ndarray:
    """The Jacobian on a Krylov space, whose largest eigenvalues are those of the whole one nearly, by Arnoldi's method."""
    scale = np.maximum(np.abs(y), 1e-3)
    count = min(PRODUCTS, y.size)
    basis, small = np.zeros((count + 1, y.size)), np.zeros((count + 1, count))
    basis[0] = np.random.default_rng(0).standard_normal(y.size)
    basis[0] /= np.linalg.norm(basis[0])
    for k in range(count):
        h = 1e-6 / float(np.max(np.abs(basis[k])))
        up, down = (rates(system, 0.0, y + way * scale * basis[k]) for way in (h, -h))
        vector = (up - down) / (2.0 * h * scale)
        for _ in range(2):  # orthogonal to rounding
            parts = basis[: k + 1] @ vector
            small[: k + 1, k] += parts
            vector = vector - parts @ basis[: k + 1]
        small[k + 1, k] = float(np.linalg.norm(vector))
        if not small[k + 1, k] > 0.0:
            return small[: k + 1, : k + 1]
        basis[k + 1] = vector / small[k + 1, k]
    return small[:count]
