"""Choice of the integration method, from an estimate of the mechanism's stiffness."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from scissordyn.components.film.asperities import mean_gap
from scissordyn.components.film.film import Film, with_contact_damping
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

EXPLICIT, STIFF = "dop853", "rodas5p"  # methods of the automatic choice: for problems that are not stiff, and for stiff ones

STABILITY_LIMIT = 6.0  # [-] largest stable product of a step size of DOP853 and the rate of a decaying mode, approximately

DENSE_STATES_MAX = 400
"""Largest number of states for which all eigenvalues of the Jacobian are computed.

For more states, Arnoldi's method estimates the largest eigenvalues.
"""


TRIAL_STEPS = 500  # number of explicit steps within which contacts closed at the start must open; otherwise the method is stiff


def choose_method(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> Choice:
    """Return the requested method, or the method that an estimate of stiffness suggests."""
    choice = _choose(plan, system, y, options, tolerances)
    return choice if options.step is None or plan.hard_places else replace(choice, fixed=options.step)


def _choose(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> Choice:
    # A larger system with bars that bend pays over 30 explicit steps for each linearly implicit step.
    implicit_states_max = 150
    # Films of rigid bars are stiff if pressing a journal through its film takes more explicit steps, for stability alone.
    film_steps_max = 30.0
    hard = [plan.contacts[j].name for j in plan.hard_places]
    contacts: list[Any] = [part for part in plan.components if part.declaration.contact]
    bristles = [(f"{part.declaration.label} '{part.name}'", part.friction) for part in contacts if part.friction.states]
    if (options.method == TIME_STEPPING and not hard) or (options.method not in ("auto", TIME_STEPPING) and hard):
        what = f"hard contact in joint '{hard[0]}'" if hard else "no hard contact"
        raise InputError(f"method = '{options.method}' with {what}", f"auto, {TIME_STEPPING}" if hard else "auto")
    if hard and bristles:
        name, friction = bristles[0]
        what = f"{name} has friction law '{friction.name}' with internal states, next to hard contact in joint '{hard[0]}'"
        raise InputError(what, "a law without internal states, or compliant contacts", 'contact = "compliant"')
    if hard:
        step, reason = time_step(plan, system, y, options, tolerances)
        if plan.compliant_places:
            reason += ", and shorter ones the vibration of compliant contacts that are closed"
        reason = f"{len(hard)} of {len(plan.contacts)} contacts are hard; {reason}"
        return Choice(TIME_STEPPING, reason, step, longest_turn(options))
    if options.method != "auto":
        return Choice(options.method, "requested")
    frictions = [
        (f"joint '{contact.name}'", laws.friction) for contact, laws in zip(plan.contacts, plan.clearances, strict=True)
    ]
    stiff = [(name, friction) for name, friction in frictions if friction.stiff]
    stiff += bristles
    if stiff and not (bends(plan.mechanism) and y.size > implicit_states_max):
        name, friction = stiff[0]
        reason = "has internal states that relax within microseconds" if friction.states else "is steep about zero slip speed"
        return Choice(STIFF, f"the friction law of {name} {reason}")
    if plan.lubricated and any(part.declaration.section == "beam" for part in plan.components):
        return Choice(
            STIFF, f"the film of joint '{plan.lubricated[0][0].name}' acts on the light cross-sections of bars that bend"
        )
    if plan.lubricated and not bends(plan.mechanism) and y.size <= DENSE_STATES_MAX:
        steps = film_steps(plan, system, y, tolerances)
        if steps > film_steps_max:
            film = f"the film of joint '{plan.lubricated[0][0].name}'"
            return Choice(
                STIFF, f"to press a journal through {film} once would take {steps:.2g} explicit steps for stability alone"
            )
    if plan.contacts and options.start != "concentric":
        if not plan.coordinates.natural.axes or tolerances.delays:
            return Choice(STIFF, "contacts that start at rest have a stiff damping")
        resting = [joint.name for joint, mode in zip(plan.contacts, system.content.state.mode.tolist(), strict=False) if mode]
        static = options.start == "static"
        # static loads press contacts together for a while: more steps, within the first tenth of the run
        trial = (30 * TRIAL_STEPS, 0.1 * options.until) if static else (TRIAL_STEPS, math.inf)
        if resting and not contacts_open_soon(plan, system, y, tolerances, *trial):
            return Choice(STIFF, f"the contact of joint '{resting[0]}' stays closed from rest, where its damping is stiff")
        if resting:
            soon = "the first tenth of the run" if static else "a few explicit steps"
            return Choice(EXPLICIT, f"the contact of joint '{resting[0]}' opens within {soon}")
    return _choose_by_motion(plan, system, y, options, tolerances)


def _choose_by_motion(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> Choice:
    """Return the choice for a mechanism without stiff contacts, from its fastest modes and from a trial of both methods."""
    # Damping of a film 1/200 of the clearance thick, divided by the damping of the same film at the centre
    thin_film_ratio = 3e5
    # Steps per period that accuracy requires anyway; a problem is stiff if stability requires more.
    accurate_steps = 40.0
    nothing = Choice(EXPLICIT, "no decay is fast enough to limit explicit steps")
    quiet = Choice(STIFF, "the fastest vibrations are at rest and would keep explicit steps short for stability alone")
    if not plan.components:
        return quiet if bends(plan.mechanism) and vibrations_rest(plan, system, y, options, tolerances) else nothing
    oiled = plan.lubricated[0][0].name if plan.lubricated and bends(plan.mechanism) else ""
    if oiled and y.size > DENSE_STATES_MAX:
        return Choice(STIFF, f"the film of joint '{oiled}' acts on light cross-sections of bars that bend")
    decay, oscillation = fastest_modes(plan, system, y)
    resolved = max(oscillation, 2.0 * math.pi / tolerances.time_scale) * accurate_steps / (2.0 * math.pi)
    if decay / STABILITY_LIMIT > resolved:
        return Choice(
            STIFF,
            f"the fastest decay, {decay:.3g} 1/s, would keep explicit steps below {STABILITY_LIMIT / decay:.2g} s without need",
        )
    if oiled and thin_film_ratio * decay / STABILITY_LIMIT > resolved:
        return Choice(
            STIFF,
            f"the film of joint '{oiled}' would keep explicit steps short where it is thin, on light ends of bars that bend",
        )
    if oscillation * options.until / STABILITY_LIMIT > TRIAL_STEPS and vibrations_rest(plan, system, y, options, tolerances):
        return quiet
    if decay == 0.0:
        return nothing
    return Choice(EXPLICIT, f"the fastest decay, {decay:.3g} 1/s, allows steps that accuracy needs anyway")


def contacts_open_soon(plan: Plan, system: Handle, y: np.ndarray, tolerances: Tolerances, most: int, until: float) -> bool:
    """Report whether all contacts open within a number of explicit steps from the start.

    The function makes these steps. Damping divided by the approach speed is stiff from rest until a contact has been open. Bars
    that bend often leave a contact at once, and a linearly implicit step costs ten times as much there.
    """
    with state_kept(system):
        explicit = Choice(EXPLICIT, "")
        driver = Driver(plan, system, y.size, explicit, tolerances)
        driver.begin(plan, y, explicit, tolerances)
        driver.monitor(False)
        closed, status = np.flatnonzero(system.content.state.mode[: len(plan.contacts)] == 1), ADVANCING
        while closed.size and driver.steps_tried < most and status == ADVANCING:
            status = advance(driver, until, most_steps=most // TRIAL_STEPS)
            closed = np.setdiff1d(closed, driver.log["guard"][driver.log["mode"] == 0])
    return closed.size == 0


def vibrations_rest(
    plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances, implicit_cost: int = 10
) -> bool:
    """Report whether linearly implicit steps get further from the start than explicit steps of the same cost.

    The function makes these steps. Both methods resolve a vibration that moves something. Only explicit steps have to
    resolve a vibration that is at rest. Mechanisms with contacts are not tried, since impacts excite vibrations later.

    `implicit_cost`: [explicit steps] cost of a linearly implicit step: 2 with 40 states, 10 with 100 to 250, by measurement.
    """
    if plan.contacts or tolerances.delays:
        return False

    def reach(method: str, until: float, most: int) -> float:
        choice = Choice(method, "")
        with state_kept(system):
            driver = Driver(plan, system, y.size, choice, tolerances)
            driver.begin(plan, y, choice, tolerances)
            driver.monitor(False)
            advance(driver, until, most_steps=most)
        return driver.time

    implicit = reach(STIFF, options.until, TRIAL_STEPS // implicit_cost)
    return reach(EXPLICIT, implicit, TRIAL_STEPS) < implicit


def time_step(plan: Plan, system: Handle, y: np.ndarray, options: Options, tolerances: Tolerances) -> tuple[float, str]:
    """Return the step of time stepping [s] and its reason: the requested step, or the step that the fastest part needs."""
    if options.step is not None:
        return options.step, "the step was requested"
    run_steps, fall_steps = 5000, 5  # smallest number of steps in a run, and in a fall across the smallest clearance from rest
    oscillation_step = 0.5  # largest step times the fastest angular frequency of components
    # Largest step times the fastest decay of components. This limit shrinks the step at most tenfold, since implicit
    # damping is stable and a mode that decays so fast has no part in the motion.
    decay_step, decay_shrink = 0.5, 10
    step, reason = options.until / run_steps, f"the step is 1/{run_steps} of the run"
    answer = np.zeros(3)
    functions.accept(0.0, y.copy(), system.address, answer)
    gain, turn = longest_turn(options)
    spin = min(gain * answer[2] ** (-4.0 / 3.0), turn / answer[2]) if answer[2] > 0.0 else math.inf
    if tolerances.time_scale / fall_steps < step:
        step, reason = tolerances.time_scale / fall_steps, "the step resolves a fall across the smallest clearance"
    if plan.components:
        modes = system.content.state.mode
        closed = modes[plan.compliant_places]
        modes[plan.compliant_places] = 0  # the steps adapt to compliant contacts
        decay, oscillation = fastest_modes(plan, system, y)
        modes[plan.compliant_places] = closed
        if decay * step > decay_step:
            step, reason = max(decay_step / decay, step / decay_shrink), f"the step resolves the fastest decay, {decay:.3g} 1/s"
        if oscillation * step > oscillation_step:
            step, reason = oscillation_step / oscillation, f"the step resolves the fastest oscillation, {oscillation:.3g} 1/s"
    if spin < step:
        step, reason = spin, f"the step resolves the fastest rotation, {answer[2]:.3g} rad/s"
    return step, reason


def longest_turn(options: Options) -> tuple[float, float]:
    """Return the limits `Choice.turn` with which a freely rotating body gains at most a millionth of its energy in a run.

    At the angular speed omega each step h adds the fraction (3/4) (omega h)^4 of the energy. A sample between the ends of a
    step lies on their chord and misses the fraction (omega h)^2/4.
    """
    energy_gain = 1e-6  # largest fraction of its energy that a freely rotating body gains in a run
    if options.step is not None:
        return math.inf, math.inf
    return (energy_gain / (0.75 * options.until)) ** (1.0 / 3.0), 2.0 * math.sqrt(energy_gain)


def film_steps(plan: Plan, system: Handle, y: np.ndarray, tolerances: Tolerances) -> float:
    """Return the explicit steps that stability requires while a journal is pressed through its film, until contact.

    A mass m under an acceleration a has the speed m a/D in a film of damping D. Steps of `STABILITY_LIMIT` m/D are
    stable. The time scale of the clearance c is T = (c/a)^(1/2). D grows at least as the power -3/2 of the film thickness h.
    About D^2 h/(2 `STABILITY_LIMIT` m^2 a) steps reach the thickness h.

    Shapes: `y` (ny,).
    """
    content: System = system.content
    parameters, modes = content.parameters.component, content.state.mode
    saved, thinnest = (parameters.copy(), modes.copy()), 1.0
    modes[: len(plan.contacts)] = 0
    rates(system, 0.0, y)
    for i, part in enumerate(plan.components):
        if isinstance(part, Film):
            thinnest = min(thinnest, mean_gap(0.0, part.roughness / part.clearance))
            parameters[i] = with_contact_damping(parameters[i], content.work.coordinates[i])
    decay, _ = fastest_modes(plan, system, y)
    parameters[...], modes[...] = saved
    return (decay * tolerances.time_scale) ** 2 * thinnest / (2.0 * STABILITY_LIMIT)


def fastest_modes(plan: Plan, system: Handle, y: np.ndarray) -> tuple[float, float]:
    """Return the largest decay rate of strongly damped modes and the largest angular frequency of the others [1/s].

    The modes are those near the start. End stops, cables and other one-sided components count as acting.
    Contacts count as pressed in by a hundredth of their clearance.
    """
    content: System = system.content
    state = content.state
    before = state.mode.copy(), state.memory.copy()
    decay = oscillation = 0.0
    strong_damping = 0.7  # damping ratio from which a mode decays rather than oscillates
    guards = [content.model.component_guard[i] for i, part in enumerate(plan.components) if part.declaration.gap is not None]
    for active in (0, 1) if guards else (0,):
        state.mode[guards] = active
        matrix = jacobian(system, y) if y.size <= DENSE_STATES_MAX else projected_jacobian(system, y)
        if not np.all(np.isfinite(matrix)):
            continue
        values = undamped_eigenvalues(matrix) if bends(plan.mechanism) else None
        values = np.linalg.eigvals(matrix) if values is None else values
        size = np.abs(values)
        damped = -values.real >= strong_damping * size
        decay = max(decay, float(np.max(size[damped], initial=0.0)))
        oscillation = max(oscillation, float(np.max(np.abs(values.imag[~damped]), initial=0.0)))
    state.mode[:], state.memory[:] = before
    return decay, oscillation


def undamped_eigenvalues(matrix: np.ndarray) -> np.ndarray | None:
    """Return the eigenvalues of a Jacobian whose accelerations depend on positions alone; None for any other Jacobian.

    They are the positive and negative roots of the eigenvalues of the accelerations by the positions, half as many.
    """
    n = len(matrix) // 2
    if len(matrix) % 2 or matrix[:n, :n].any() or matrix[n:, n:].any() or not np.allclose(matrix[:n, n:], np.eye(n)):
        return None
    roots = np.sqrt(np.linalg.eigvals(matrix[n:, :n]).astype(complex))
    return np.concatenate([roots, -roots])


def jacobian(system: Handle, y: np.ndarray) -> np.ndarray:
    """Return the derivatives of the rates with respect to the state at t = 0, by central differences, shape (ny, ny)."""
    matrix = np.zeros((y.size, y.size))
    h = 1e-6 * np.maximum(np.abs(y), 1e-3)
    functions.rates_by_state(y, h, system.address, np.zeros(y.size), np.zeros((2, y.size)), matrix)
    return matrix


def projected_jacobian(system: Handle, y: np.ndarray, products: int = 60) -> np.ndarray:
    """Return the Jacobian projected onto a Krylov space (Arnoldi 1951), which has nearly the same largest eigenvalues."""
    scale = np.maximum(np.abs(y), 1e-3)
    count = min(products, y.size)
    basis, small = np.zeros((count + 1, y.size)), np.zeros((count + 1, count))
    basis[0] = np.random.default_rng(0).standard_normal(y.size)
    basis[0] /= np.linalg.norm(basis[0])
    for k in range(count):
        h = 1e-6 / float(np.max(np.abs(basis[k])))
        up, down = (rates(system, 0.0, y + way * scale * basis[k]) for way in (h, -h))
        vector = (up - down) / (2.0 * h * scale)
        for _ in range(2):  # the second pass makes the vectors orthogonal to round-off
            parts = basis[: k + 1] @ vector
            small[: k + 1, k] += parts
            vector = vector - parts @ basis[: k + 1]
        small[k + 1, k] = float(np.linalg.norm(vector))
        if not small[k + 1, k] > 0.0:
            return small[: k + 1, : k + 1]
        basis[k + 1] = vector / small[k + 1, k]
    return small[:count]
